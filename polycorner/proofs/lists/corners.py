"""Lists of all corners of a polyhedron in a box, and what is proved."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from polycorner.interrupts import first_interrupt
from polycorner.kinds import checked
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Sheet, Table, facts, number, units
from polycorner.progress import Progress, silent
from polycorner.proofs.lists.coincidences import OPEN, ZERO, active_at, signs
from polycorner.proofs.lists.corner_search import CornerSearch
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.enumeration import Limits, begun
from polycorner.proofs.lists.faces import Region
from polycorner.proofs.lists.listing import undecided
from polycorner.proofs.lists.members import RegionPoint, full, image, placed, same
from polycorner.proofs.lists.records import Record, record
from polycorner.proofs.lists.search import Tally
from polycorner.proofs.lists.stationary import EnclosedPoint, ProvedList
from polycorner.proofs.lists.tips import TipRegion
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.parts import Completeness
from polycorner.skeletons.search import skeleton
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH, TOLERANCE, Tolerances

MOST_OPEN = 6  # functions of unknown sign at a point, all of whose signs are gone through

Names = tuple[int, ...]


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

    ``points`` are the corners of a list, which may be complete; the search sets out from
    ``starts``, points of the set, as well.  A function counts as zero up to ``tolerance``, in scale
    units, and corners of either side are compared with what belongs to it.
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
class CornerPoint(EnclosedPoint):
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


@dataclass(frozen=True, eq=False, repr=False)
class CornerList(ProvedList[CornerPoint]):
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
    record : Record
        The proof, for :meth:`save`.
    """

    polyhedron: Polyhedron
    domain: Domain
    points: tuple[CornerPoint, ...]
    undecided: Array
    open_points: tuple[CornerPoint, ...]
    tally: Tally
    record: Record

    @property
    def complete(self) -> bool:
        """Whether it is proved that these are all corners in the box."""
        return not len(self.undecided) and not self.open_points

    @property
    def statement(self) -> str:
        """What is proved, in a sentence."""
        count, n = len(self.points), len(self.domain.lower)
        where = f"in the box ({n} coordinates)"
        if self.complete:
            return f"Proved: the polyhedron has exactly {count} corners {where}."
        rest = f"{len(self.undecided)} boxes and {len(self.open_points)} points are undecided"
        return f"Not complete: {count} corners are shown {where}; {rest}."

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


@dataclass(frozen=True, eq=False)
class Candidate(RegionPoint):
    """A point that may be a corner.

    ``number`` is that of its region in the search; ``active`` are the functions that vanish and
    matter, None where that is not decided.
    """

    number: int
    active: Names | None


def candidates(search: CornerSearch) -> list[Candidate]:
    """Return the points that are corners or may be, each once; regular ones first."""
    order = sorted(enumerate(search.regions), key=lambda pair: isinstance(pair[1], TipRegion))
    found: list[Candidate] = []
    for k, region in order:
        new = _candidate(search, k, region)
        if new is None:
            continue
        alike = [same(search, new, other) for other in found]
        if True in alike:
            continue
        found.append(replace(new, active=None) if None in alike else new)
    return found


def _candidate(search: CornerSearch, number: int, region: Region) -> Candidate | None:
    """Return the point of a region, or None if it is no corner."""
    lower, upper = full(search, region)
    if search.domain.misses(lower, upper, range(len(lower))):
        return None
    found = signs(search.faces, placed(search, region), search.problem.inequalities)
    unknown = [i for i, sign in enumerate(found) if sign == OPEN]
    zeros = frozenset(i for i, sign in enumerate(found) if sign == ZERO)
    possible: set[Names | None] = set()
    sole = False  # whether a function without a gradient may be active, but not all of the region
    if len(unknown) <= MOST_OPEN:
        for choice in product((-1, 0, 1), repeat=len(unknown)):
            for i, sign in zip(unknown, choice, strict=True):
                found[i] = sign
            active = active_at(search.conj, found)
            corner = active is not None and set(region.active) <= set(active)
            possible.add(active if corner else None)
            if active is not None and not corner and isinstance(region, TipRegion):
                sole |= not set(region.critical).isdisjoint(active)
        if possible == {None} and not sole:
            return None
    decided = possible.pop() if len(possible) == 1 and not sole else None
    return Candidate(region, zeros, frozenset(unknown), number, decided)


def with_images(
    search: CornerSearch, found: Sequence[Candidate]
) -> Iterator[tuple[Candidate, int]]:
    """Yield corners and their images under the symmetries, with the numbers of their orbits.

    Those that may be others again are not decided to be active anywhere.
    """
    listed: list[Candidate] = []
    orbit = 0
    for one in found:
        if one.active is None or any(same(search, one, other) for other in listed):
            continue
        new = [one]
        for g, p in zip(search.motions, search.maps, strict=True):
            inverse = {there: i for i, there in enumerate(p)}
            region = image(search, one.region, g, p)
            parts = [tuple(sorted(inverse[i] for i in s)) for s in (one.zeros, one.active)]
            moved = Candidate(region, frozenset(parts[0]), frozenset(), one.number, parts[1])
            alike = [same(search, moved, other) for other in (*listed, *new)]
            if True not in alike:
                new.append(replace(moved, active=None) if None in alike else moved)
        listed += new
        for each in new:
            yield each, orbit
        orbit += 1


@checked
def corners(
    polyhedron: Polyhedron,
    *,
    box: Any,
    symmetry: Symmetry | None = None,
    resolution: float = SEARCH.resolution,
    max_boxes: int = SEARCH.max_boxes,
    max_seconds: float = np.inf,
    workers: int = 1,
    progress: Progress = silent,
) -> CornerList:
    """Find all corners of a polyhedron in a box, with proof.

    Near a point ``q`` the set ``D`` is a union of pieces, each of them the points where some
    functions that vanish at ``q`` are not negative; ``A(q)`` are the functions of those pieces that
    do not have all functions of another piece.  A *corner* is a point of ``D`` that is isolated
    among the common zeros of ``A(q)`` and the equations.  It is regular if the gradients of these
    have rank ``N``, the number of coordinates that are free (there may be more of them), and
    singular otherwise: a cusp, a contact of two curves, an apex.

    Branch and bound over the box shows that there are no corners elsewhere
    (:mod:`~polycorner.proofs.lists.corner_search`).  Singular corners are isolated by second order
    where they have rational coordinates (:mod:`~polycorner.proofs.lists.tips`); what is not decided
    is returned as boxes, and as points of which it is not known whether they are corners.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``; and/or trees and equations are allowed.  Of inequalities that are positive
        multiples of each other the first stands for all of them, and ``f >= 0`` with ``-f >= 0``
        in every branch is the equation ``f = 0``.
    box, symmetry, resolution, max_boxes, max_seconds, workers, progress
        As for :func:`stationary_points`.  With coordinates fixed, corners are points isolated
        modulo the continuous symmetry.

    Returns
    -------
    CornerList
        After an interruption (Ctrl-C), with what was found so far and all waiting boxes undecided.

    Raises
    ------
    TypeError, ValueError
        As :func:`stationary_points`.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y})
    >>> found = corners(D, box=[(-3, 3), (-3, 3)])
    >>> found.complete, len(found), len(found.skeleton().edges)
    (True, 2, 2)
    """
    import sympy

    nothing = sympy.Integer(0)
    search = begun(CornerSearch, polyhedron, nothing, box, symmetry, resolution)
    limits = Limits(max_boxes, max_seconds, workers, progress)
    with first_interrupt(limits.stop.set):
        limits.run(search)
    return listed(search)


def listed(search: CornerSearch) -> CornerList:
    """Return what a search found."""
    found = candidates(search)
    points = [(one, _point(search, one, orbit)) for one, orbit in with_images(search, found)]
    unknown = [one for one in found if one.active is None]
    sure = [(one.number, one.active) for one in found if one.active is not None]
    return CornerList(
        search.problem.polyhedron,
        search.domain,
        tuple(point for one, point in points if one.active is not None),
        undecided(search),
        (
            *(_point(search, one, -1) for one in unknown),
            *(point for one, point in points if one.active is None),
        ),
        search.tally,
        record(
            search,
            (number for number, _ in sure),
            (one.number for one in unknown),
            active=tuple(active for _, active in sure),
            relations=tuple(filter(None, search.relations.values())),
        ),
    )


def _point(search: CornerSearch, one: Candidate, orbit: int) -> CornerPoint:
    lower, upper = full(search, one.region)
    names = search.problem.polyhedron.names
    rows = sorted(one.zeros) if one.active is None else one.active
    singular = isinstance(search.regions[one.number], TipRegion)
    return CornerPoint(lower, upper, tuple(names[i] for i in rows), singular, orbit)
