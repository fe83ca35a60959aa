"""Lists of all stationary points of an energy on a polyhedron in a box, and what is proved."""

import os
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from polycorner.kinds import checked
from polycorner.minimisation import Certificate, certify
from polycorner.minimisation.problem import Problem
from polycorner.printing import Printed, Sheet, Table, facts, number, units
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.loci import LocusRegion
from polycorner.proofs.lists.records import Record, save
from polycorner.proofs.lists.search import BoxSearch, Tally
from polycorner.proofs.parameter_boxes import Interval, shown_box
from polycorner.spaces.manifold import Array
from polycorner.tolerances import RANK_TOLERANCE, TOLERANCE
from polycorner.values import Checked

Bounds = tuple[float, float]
P = TypeVar("P", bound="EnclosedPoint")


class EnclosedPoint(Checked):
    """A box with exactly one point that is sought."""

    lower: Array
    upper: Array

    @property
    def point(self) -> Array:
        """The middle of the enclosure, ``(n,)``."""
        return 0.5 * (self.lower + self.upper)


@dataclass(frozen=True, eq=False)
class StationaryPoint(EnclosedPoint):
    """A box with exactly one stationary point.

    It is a nondegenerate KKT point of the active functions, or they are more than can be
    independent and hold it to first order.

    Attributes
    ----------
    lower, upper : (n,) arrays
        Enclosure of the point.
    active : tuple of str
        Functions that vanish there; all their multipliers are positive.
    multipliers : mapping from str to (float, float)
        Enclosures of the multipliers, those of equations included: ``dE = sum lam_i df_i``.
    index : int or None
        Negative eigenvalues of the Hessian of the Lagrangian along the face; None where their
        number is not shown, or where it is not 0 and redundant functions may make the point a
        minimum all the same.
    orbit : int
        Number of the orbit of the declared symmetries that it belongs to.
    redundant : tuple of str
        Other functions that are shown to vanish there; the multipliers are those of one
        combination without them.
    """

    lower: Array
    upper: Array
    active: tuple[str, ...]
    multipliers: Mapping[str, Bounds]
    index: int | None
    orbit: int
    redundant: tuple[str, ...] = ()

    @property
    def is_minimum(self) -> bool:
        """Whether it is shown to be a strict local minimum: no negative eigenvalue."""
        return self.index == 0


@dataclass(frozen=True, eq=False)
class StationaryLocus(Checked):
    """Points with given values of some coordinates, all of them stationary.

    The energy depends on these coordinates only; its derivative vanishes there, and at no other
    stationary point nearby.

    Attributes
    ----------
    lower, upper : mapping from str to float
        Enclosures of the coordinates.
    index : int
        Negative eigenvalues of the second derivative by these coordinates.
    sample : (n,) array or None
        A point of the set on it, which shows that it is not empty; None where none was found.  It
        is then not decided whether the set has points on it.
    """

    lower: Mapping[str, float]
    upper: Mapping[str, float]
    index: int
    sample: Array | None

    @property
    def is_minimum(self) -> bool:
        """Whether its points are shown to be local minima, not strict ones."""
        return self.index == 0


class ProvedList(Printed, Checked, Generic[P]):
    """Points in a box, of which it is proved that they are all, or what is undecided."""

    points: tuple[P, ...]
    record: Record | None

    @property
    @abstractmethod
    def statement(self) -> str:
        """What is proved, in a sentence."""

    def __len__(self) -> int:
        """Return the number of isolated points."""
        return len(self.points)

    def __iter__(self) -> Iterator[P]:
        """Iterate over the isolated points."""
        return iter(self.points)

    def __repr__(self) -> str:
        """Return the statement."""
        return f"{type(self).__name__}({self.statement})"

    @checked
    def save(self, path: str | os.PathLike[str]) -> Path:
        """Save the list and its proof, for an independent checker; return the path.

        See :mod:`polycorner.proofs.checker`.

        Raises
        ------
        ValueError
            If the name does not end in ``.zip``, and for a union of branches with equations of
            their own, which are saved one by one.
        OSError
            If the file could not be written.
        """
        if self.record is None:
            msg = "save: expected a list of one polyhedron; got one of branches with equations"
            raise ValueError(msg)
        return save(path, self.record)


@dataclass(frozen=True, eq=False, repr=False)
class StationaryList(ProvedList[StationaryPoint]):
    """Stationary points of an energy on a polyhedron in a box; see :func:`stationary_points`.

    Attributes
    ----------
    problem : Problem
        Polyhedron and energy.
    domain : Domain
        The box.
    parameters : mapping from str to (float, float)
        Intervals of parameters, or empty.  The list is one for each of their values: what is
        enclosed is the point at all values, as a function of them.
    points : tuple of StationaryPoint
        Isolated ones, by orbit.  A point whose enclosure meets a side of the box is listed, whether
        it lies in the box or beside it.
    loci : tuple of StationaryLocus
        Connected sets of them along coordinates that the energy does not depend on.
    undecided : (k, 2, n) array
        Boxes, by lower and upper ends, outside of which there is no other stationary point; where
        symmetries are declared, none outside of these boxes and their images.
    open_points : tuple of StationaryPoint
        KKT points of faces for which it is not decided whether they lie in the polyhedron.
    tally : Tally
        Numbers of boxes.
    record : Record or None
        The proof, for :meth:`save`; None for a union of branches with equations of their own.
    minima_only : bool
        Whether only local minima are listed.
    """

    problem: Problem
    domain: Domain
    parameters: "Mapping[str, Interval]"
    points: tuple[StationaryPoint, ...]
    loci: tuple[StationaryLocus, ...]
    undecided: Array
    open_points: tuple[StationaryPoint, ...]
    tally: Tally
    record: Record | None
    minima_only: bool = False

    @property
    def complete(self) -> bool:
        """Whether it is proved that these are all stationary points in the box."""
        found = all(place.sample is not None for place in self.loci)
        return not len(self.undecided) and not self.open_points and found

    @property
    def minima(self) -> tuple[StationaryPoint, ...]:
        """The strict local minima among the isolated points."""
        return tuple(p for p in self.points if p.is_minimum)

    @checked
    def certificates(
        self, *, tolerance: float = TOLERANCE, rank_tolerance: float = RANK_TOLERANCE
    ) -> tuple[Certificate, ...]:
        """Return certificates at the middles of the isolated points.

        Parameters
        ----------
        tolerance, rank_tolerance : float, optional
            As for :func:`polycorner.certify`.

        Raises
        ------
        ValueError
            For a list over intervals of parameters.
        """
        if self.parameters:
            msg = "certificates: expected a list for one value of each parameter; got intervals"
            raise ValueError(msg)
        d, energy = self.problem.polyhedron, self.problem.energy
        options = {"tolerance": tolerance, "rank_tolerance": rank_tolerance}
        return tuple(certify(d, energy, p.point, **options) for p in self.points)

    @property
    def undecided_volume(self) -> float:
        """Volume of the undecided boxes, as a share of the domain's."""
        free = list(self.domain.free)
        widths = (self.undecided[:, 1] - self.undecided[:, 0])[:, free]
        whole = (self.domain.upper - self.domain.lower)[free]
        return float((widths / whole).prod(axis=1).sum())

    @property
    def statement(self) -> str:
        """What is proved, in a sentence."""
        count, n = len(self.points), self.problem.dimension
        kind = "strict local minima" if self.minima_only else "stationary points"
        loci = f" and {len(self.loci)} loci" if self.loci else ""
        where = f"in the box ({n} coordinates)"
        if self.parameters:
            where += f" for all {shown_box(self.parameters)}"
        sides = sum(not self.domain.holds(p.lower, p.upper) for p in self.points)
        on_sides = f"; {sides} of them on a side of it, or beside by rounding" if sides else ""
        if self.complete:
            shown = f"exactly {count} isolated {kind}{loci} {where}{on_sides}"
            return f"Proved: the energy has {shown}."
        empty = sum(place.sample is None for place in self.loci)
        rest = f"{len(self.undecided)} boxes and {len(self.open_points)} points are undecided"
        rest += f", and whether {empty} loci are empty" if empty else ""
        return f"Not complete: {count} {kind}{loci} are shown {where}; {rest}."

    def _sheet(self) -> Sheet:
        names = self.problem.polyhedron.manifold.names
        energies = () if self.parameters else ("energy",)
        head = ("", *names, *energies, "index", "active")
        rows = tuple(
            (
                str(k),
                *(number(x) for x in p.point),
                *(number(float(self.problem.energy.value(p.point))) for _ in energies),
                "?" if p.index is None else str(p.index),
                " ".join(p.active) or "none",
            )
            for k, p in enumerate(self.points)
        )
        counts = [
            ("boxes", str(self.tally.boxes)),
            ("minima", str(len(self.minima))),
            ("loci", str(len(self.loci))),
            ("undecided volume", f"{self.undecided_volume:.1e}"),
        ]
        numbers = tuple(range(len(names) + len(energies) + 2))
        tables = [Table(head, rows, numbers)] if rows else []
        if self.loci:
            tables.append(self._locus_table())
        unit = units(self.problem.polyhedron.manifold.periods)
        return Sheet("Stationary points", (self.statement, facts(counts), *tables, unit))

    def _locus_table(self) -> Table:
        """Return the loci: the coordinates that are given, and a point on each."""
        names = self.problem.polyhedron.manifold.names
        given = [name for name in names if name in self.loci[0].lower]
        rows = tuple(
            (
                *(number(0.5 * (place.lower[name] + place.upper[name])) for name in given),
                str(place.index),
                "none found" if place.sample is None else ", ".join(map(number, place.sample)),
            )
            for place in self.loci
        )
        head = (*given, "index", f"a point ({', '.join(names)})")
        return Table(head, rows, tuple(range(len(given) + 1)), "Loci")


def locus_of(search: BoxSearch, place: LocusRegion) -> StationaryLocus:
    """Return a locus by the names of its coordinates."""
    keys = [search.domain.manifold.names[i] for i in place.z]
    n = len(search.domain.lower) - len(search.domain.parameters)
    return StationaryLocus(
        dict(zip(keys, place.sharp_lower.tolist(), strict=True)),
        dict(zip(keys, place.sharp_upper.tolist(), strict=True)),
        place.index,
        None if place.sample is None else place.sample[:n],
    )
