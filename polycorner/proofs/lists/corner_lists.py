"""Lists of all corners of a polyhedron in a box, and what is proved."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.kinds import checked
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet, Table, facts, number, units
from polycorner.proofs.lists.corner_records import CornerRecord, save
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.search import Tally
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.parts import Completeness
from polycorner.skeletons.search import skeleton
from polycorner.spaces.manifold import Array
from polycorner.tolerances import TOLERANCE, Tolerances
from polycorner.values import Checked

if TYPE_CHECKING:
    import os
    from pathlib import Path


def proved_skeleton(
    polyhedron: Polyhedron,
    points: Sequence[Array],
    symmetry: Symmetry,
    *,
    complete: bool,
    starts: Sequence[Any] = (),
    tolerance: float = TOLERANCE,
    **options: Any,
) -> Skeleton:
    """Return the skeleton found from corners, and whether its corners are proved to be all.

    Parameters
    ----------
    polyhedron : Polyhedron
    points : sequence of (n,) arrays
        The corners of a list.
    symmetry : Symmetry
        Symmetry to divide by.
    complete : bool
        Whether the list is complete.
    starts : sequence of (n,) arrays, optional
        Points of the set from which the search sets out as well.
    tolerance : float, optional
        Distance, in scale units, up to which a function counts as zero; corners of either side are
        compared with what belongs to it.
    options
        Of :func:`polycorner.skeleton`.
    """
    rows = [*points, *(np.asarray(q, dtype=float) for q in starts)]
    around = np.reshape(rows, (-1, polyhedron.manifold.size))
    found = skeleton(polyhedron, around, symmetry=symmetry, tolerance=tolerance, **options)
    notes = _mismatches(found, points, symmetry, Tolerances.of(tolerance).corner)
    if not complete:
        notes.append("the list of corners is not complete")
    proved = not notes and found.complete is Completeness.EXHAUSTED
    return replace(
        found,
        complete=Completeness.CORNERS_PROVED if proved else found.complete,
        notes=(*found.notes, *notes),
    )


def _mismatches(
    found: Skeleton, points: Sequence[Array], symmetry: Symmetry, reach: float
) -> list[str]:
    """Return sentences on the corners of one side that are not those of the other."""
    manifold = found.polyhedron.manifold
    pairs = [
        [bool(symmetry.relabellings(manifold, q, corner.point, reach)) for corner in found.corners]
        for q in points
    ]
    table = np.reshape(np.array(pairs, dtype=bool), (len(points), len(found.corners)))
    notes = [
        f"corner {k} of the list is {count} corners of the skeleton"
        for k, count in enumerate(table.sum(axis=1).tolist())
        if count != 1
    ]
    single = not (symmetry.elements or symmetry.fields)
    for k, count in enumerate(table.sum(axis=0).tolist()):
        if count == 0 or (single and count > 1):
            notes.append(f"corner {k} of the skeleton is {count} corners of the list")
    return notes


@dataclass(frozen=True, eq=False)
class CornerPoint(Checked):
    """A box with exactly one corner.

    Attributes
    ----------
    lower, upper : (n,) arrays
        Enclosure of the corner.
    active : tuple of str
        Functions that vanish there and matter for the set near it.
    singular : bool
        Whether it is isolated by second order, not by independent gradients.
    orbit : int
        Number of the orbit of the declared symmetries that it belongs to.
    """

    lower: Array
    upper: Array
    active: tuple[str, ...]
    singular: bool
    orbit: int

    @property
    def point(self) -> Array:
        """The middle of the enclosure, ``(n,)``."""
        return 0.5 * (self.lower + self.upper)


@dataclass(frozen=True, eq=False)
class CornerList(Printed, Checked):
    """Corners of a polyhedron in a box; see :func:`corners`.

    Attributes
    ----------
    polyhedron : Polyhedron
    domain : Domain
        The box.
    points : tuple of CornerPoint
        The corners, by orbit.
    undecided : (k, 2, n) array
        Boxes, by lower and upper ends, outside of which there is no other corner.
    open_points : tuple of CornerPoint
        Points that may be corners, or the same as others; ``active`` are the functions that vanish
        there for certain.
    tally : Tally
        Numbers of boxes.
    proof : CornerRecord
        The proof, for :meth:`save`.
    """

    polyhedron: Polyhedron
    domain: Domain
    points: tuple[CornerPoint, ...]
    undecided: Array
    open_points: tuple[CornerPoint, ...]
    tally: Tally
    proof: CornerRecord

    @property
    def complete(self) -> bool:
        """Whether it is proved that these are all corners in the box."""
        return not len(self.undecided) and not self.open_points

    def __len__(self) -> int:
        """Return the number of corners."""
        return len(self.points)

    def __iter__(self) -> Iterator[CornerPoint]:
        """Iterate over the corners."""
        return iter(self.points)

    @property
    def statement(self) -> str:
        """What is proved, in a sentence."""
        count, n = len(self.points), len(self.domain.lower)
        where = f"in the box ({n} coordinates)"
        if self.complete:
            return f"Proved: the polyhedron has exactly {count} corners {where}."
        rest = f"{len(self.undecided)} boxes and {len(self.open_points)} points are undecided"
        return f"Not complete: {count} corners are shown {where}; {rest}."

    def __repr__(self) -> str:
        """Return the statement."""
        return f"CornerList({self.statement})"

    def _sheet(self) -> Sheet:
        names = self.polyhedron.manifold.names
        rows = tuple(
            (
                str(k),
                *(number(x) for x in p.point),
                "singular" if p.singular else "regular",
                " ".join(p.active),
            )
            for k, p in enumerate(self.points)
        )
        table = Table(("", *names, "kind", "active"), rows, tuple(range(len(names) + 1)))
        counts = facts([("boxes", str(self.tally.boxes))])
        unit = units(self.polyhedron.manifold.periods)
        return Sheet("Corners", (self.statement, counts, *([table] if rows else []), unit))

    @checked
    def skeleton(self, *, symmetry: Symmetry | None = None, **options: Any) -> Skeleton:
        """Find the skeleton with the corners of this list as starts.

        ``Skeleton.complete`` is ``Completeness.CORNERS_PROVED`` if the list is complete, the
        search is exhausted, and its corners are those of the list, one to one (modulo the
        symmetry); its notes tell what is missing otherwise.  The corners are proved then, edges and
        faces are not: a closed edge or a closed face without corners may be missed.

        Parameters
        ----------
        symmetry : Symmetry, optional
            Symmetry to divide by.
        options
            Of :func:`polycorner.skeleton`; ``starts`` are points from which it sets out as well.
        """
        points = [p.point for p in self.points]
        return proved_skeleton(
            self.polyhedron, points, symmetry or Symmetry(), complete=self.complete, **options
        )

    @checked
    def save(self, path: "str | os.PathLike[str]") -> "Path":
        """Save the list and its proof, for an independent checker; return the path.

        See :mod:`polycorner.proofs.lists.checker`.

        Raises
        ------
        ValueError
            If the name does not end in ``.zip``.
        OSError
            If the file could not be written.
        """
        return save(path, self.proof)
