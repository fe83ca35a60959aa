"""State of a search: problem, domain, symmetries and evaluators; regions and loci found."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Formulas
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.branches import Mask, conjunctions
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.faces import EnclosedFaces, Region
from polycorner.proofs.lists.images import Motion, weights
from polycorner.proofs.lists.loci import LocusRegion, read_coordinates
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

AGAIN = 1 / 64  # of the widest region that was tried in vain: a smaller one is worth trying
FIRST = 64  # rows that a growing array has room for


@dataclass
class GrowingRows:
    """An array that grows by rows, ``(R, width)``."""

    width: int
    _array: Array = field(init=False)
    _count: int = 0

    def __post_init__(self) -> None:
        self._array = np.zeros((FIRST, self.width))

    def __len__(self) -> int:
        return self._count

    def add(self, row: Array) -> None:
        """Add a row."""
        if self._count == len(self._array):
            # Doubling: regions come one by one, thousands of them perhaps, and are read as one
            # array.
            self._array = np.concatenate([self._array, np.zeros_like(self._array)])
        self._array[self._count] = row
        self._count += 1

    @property
    def array(self) -> Array:
        """The rows so far, which later ones do not change."""
        return self._array[: self._count]


class Sides:
    """Boxes by the active functions of their regions, looked up by points."""

    def __init__(self, width: int) -> None:
        self.width = width
        self._rows: dict[frozenset[int], GrowingRows] = {}

    def add(self, active: frozenset[int], lower: Array, upper: Array) -> None:
        """Add a box."""
        rows = self._rows.setdefault(active, GrowingRows(2 * self.width))
        rows.add(np.concatenate([lower, upper]))

    def of(self, active: frozenset[int]) -> tuple[Array, Array]:
        """Return the lower and the upper ends of all boxes with some active functions."""
        rows = self._rows.get(active)
        found = rows.array if rows else np.zeros((0, 2 * self.width))
        return found[:, : self.width], found[:, self.width :]


class Tried:
    """Points about which regions were tried in vain, by active functions, and the widest reach."""

    def __init__(self, scales: Array) -> None:
        self.scales = scales
        self._rows: dict[tuple[int, ...], GrowingRows] = {}

    def add(self, active: tuple[int, ...], q: Array, widest: float) -> None:
        """Add a point."""
        rows = self._rows.setdefault(active, GrowingRows(len(q) + 1))
        rows.add(np.append(q, widest))

    def has(self, active: tuple[int, ...], q: Array, widest: float) -> bool:
        """Whether regions of about this size were tried at this point before."""
        if active not in self._rows:
            return False
        found = self._rows[active].array
        near = (abs(found[:, :-1] - q) <= DEFAULT.alike * self.scales).all(axis=1)
        # A much smaller region may be shown where a larger one was not.
        return bool((near & (found[:, -1] * AGAIN < widest) & (widest <= found[:, -1])).any())

    def items(self) -> list[tuple[tuple[int, ...], list[list[float]]]]:
        """Return the points with their reach, ``n + 1`` numbers each, by active functions."""
        return [(active, rows.array.tolist()) for active, rows in self._rows.items()]


class Known:
    """Regions and loci, in the order in which they were found.

    Positions of ``parameters`` are given, as these have the same sides in all boxes and regions.
    """

    def __init__(self, dimension: int, inequalities: int, parameters: tuple[int, ...] = ()) -> None:
        self.regions: list[Region] = []
        self.loci: list[LocusRegion] = []
        self.missed: list[LocusRegion] = []  # loci without a point of the set
        # Two tables: by active functions for points, and all in one for the tests of boxes.
        self._sides = Sides(dimension)
        self._all = GrowingRows(2 * dimension + inequalities)
        self._dimension = dimension
        self._parameters = list(parameters)

    def add(self, region: Region) -> None:
        """Add a region."""
        self.regions.append(region)
        self._sides.add(frozenset(region.active), region.lower, region.upper)
        row = np.zeros(self._all.width)
        sides = np.array([region.lower, region.upper])
        # All boxes have the same sides in parameters, so that these do not tell regions apart.
        sides[:, self._parameters] = 0.0  # of no account
        row[: 2 * self._dimension] = sides.ravel()
        row[[2 * self._dimension + i for i in region.active]] = 1.0
        self._all.add(row)

    def has(self, q: Array, active: frozenset[int]) -> bool:
        """Whether a point lies in a region with the given active functions."""
        lower, upper = self._sides.of(active)
        return bool(((q >= lower) & (q <= upper)).all(axis=1).any())

    def has_locus(self, place: LocusRegion) -> bool:
        """Whether a locus lies in the box of a known one."""
        return any(
            (place.sharp_lower >= other.lower).all() and (place.sharp_upper <= other.upper).all()
            for other in (*self.loci, *self.missed)
        )

    def has_value(self, z: Array) -> bool:
        """Whether values of the coordinates that the energy reads lie in the box of a locus."""
        known = (*self.loci, *self.missed)
        return any((z >= p.lower).all() and (z <= p.upper).all() for p in known)

    def sides(self, since: int = 0) -> tuple[tuple[Array, Array], NDArray[np.bool_]]:
        """Return lower and upper ends ``(R, n)`` and active functions ``(R, m)`` of regions.

        Of all but the first ``since``.
        """
        found, n = self._all.array[since:], self._dimension
        return (found[:, :n], found[:, n : 2 * n]), found[:, 2 * n :] > 0


@dataclass
class Setting:
    """What is searched in, which does not change during a search, and what is known so far.

    Attributes
    ----------
    problem : Problem
    domain : Domain
    resolution : float
        Largest side, in scale units, of boxes that are not bisected.
    motions : tuple of Motion
        Symmetries.
    maps : tuple of tuple of int
        Where they take inequalities.
    minima_only : bool
        Whether only local minima are searched.
    critical : bool
        Whether all functions that may vanish, in any branch, have to hold together.
    cap : float
        An energy above which nothing is searched.
    functions : BoxFunctions
        Inequalities, equations, energy.
    faces : EnclosedFaces
    conj : (c, m) array of bool
        The set as a union of intersections.
    reads : tuple of int
        Free coordinates that the energy depends on.
    weights : (n,) array
        Of orbits, points with the largest ``weights . q`` are searched.
    known : Known
        Regions and loci that were found.
    """

    problem: Problem
    domain: Domain
    resolution: float
    motions: tuple[Motion, ...] = ()
    maps: tuple[tuple[int, ...], ...] = ()
    minima_only: bool = False
    critical: bool = False
    cap: float = np.inf
    functions: BoxFunctions = field(init=False)
    faces: EnclosedFaces = field(init=False)
    conj: Mask = field(init=False)
    reads: tuple[int, ...] = field(init=False)
    weights: Array = field(init=False)
    known: Known = field(init=False)

    def __post_init__(self) -> None:
        manifold = self.problem.polyhedron.manifold
        self.functions = BoxFunctions(self.problem.functions, manifold)
        formulas = Formulas(self.problem.functions, manifold)
        free = self.domain.free
        about = formulas, self.problem.inequalities, free, self.problem.scales
        self.faces = EnclosedFaces(*about, self.domain.held)
        self.conj = conjunctions(self.problem.polyhedron)
        self.reads = read_coordinates(formulas, free)
        self.weights = weights(self.domain)
        size = self.problem.dimension
        self.known = Known(size, self.problem.inequalities, self.domain.parameters)

    @property
    def branches(self) -> tuple[tuple[int, ...], ...]:
        """The set as a union of intersections: the functions of each."""
        return tuple(tuple(np.flatnonzero(branch).tolist()) for branch in self.conj)

    @property
    def equations(self) -> int:
        """The number of equations."""
        return self.faces.equations

    @property
    def may_have_loci(self) -> bool:
        """Whether the energy does not depend on some free coordinate."""
        return self.reads != self.domain.free
