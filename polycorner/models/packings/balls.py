"""Equal balls, and balls with the largest sum of radii, in a region."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog
from scipy.sparse import csr_array

from polycorner import checks
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import Indices
from polycorner.kinds import checked
from polycorner.models.packings.regions import (
    AXES,
    BoxContainer,
    Container,
    TorusContainer,
    pair_gap,
    radius,
    region_of,
)
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Described
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

HOLES = 10  # random points a body, among which holes are looked for
WIDER = 4  # power of the width with which a hole is chosen


class Balls(Checked, Described):
    """Balls in a region, which do not overlap and are to be large."""

    count: int
    equal: bool

    @property
    def area(self) -> Container:
        """The region as a value."""
        raise NotImplementedError

    @cached_property
    def manifold(self) -> Manifold:
        """Centres ``x1 y1 x2 ...``, and then ``r``, or ``r1 r2 ...``."""
        axes = AXES[: self.area.dimension]
        centres = [f"{axis}{i}" for i in range(1, self.count + 1) for axis in axes]
        names = (*centres, *self._radius_names)
        loose = (np.inf,) * len(self._radius_names)
        length = (self.area.size / self.count) ** (1 / self.area.dimension) / 2
        across = length / self.area.unit
        scales = (across,) * len(centres) + (length,) * len(loose)
        return Manifold(names, self.area.periods * self.count + loose, scales)

    @cached_property
    def _radius_names(self) -> tuple[str, ...]:
        return ("r",) if self.equal else tuple(f"r{i}" for i in range(1, self.count + 1))

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """``|x_j - x_i|^2 - (r_i + r_j)^2 >= 0`` for every pair, walls, and ``r_i >= 0``.

        Gaps are called ``i-j``, on a torus ``i-j(p,q)``, with the image of the second ball; those
        of ball and wall ``i-left``, ``i-circle``, and so on.
        """
        gap, all_axes = pair_gap(self.area, self.equal), AXES[: self.area.dimension]
        pairs = [
            self._member(gap, "gap", f"{i}-{j}{_shown(image)}", (i, j), all_axes, image)
            for i, j in combinations(range(1, self.count + 1), 2)
            for image in self.area.images
        ]
        walls = []
        for family, member, axes, parameters, name in self.area.walls():
            # What only the radius is read by is one function of equal balls.
            several = range(1, self.count + 1) if axes or not self.equal else (0,)
            walls += [
                self._member(family, member, f"{i}-{name}" if i else name, (i,), axes, parameters)
                for i in several
            ]
        least = [
            SmoothFunction.member(
                radius(), "least", self.manifold, reads=(name,), label=f"{name}-least"
            )
            for name in self._radius_names
        ]
        return Polyhedron(self.manifold, AllOf(*pairs, *walls, *least))

    def _member(
        self,
        family: Any,
        member: str,
        label: str,
        bodies: Sequence[int],
        axes: str,
        parameters: Sequence[float],
    ) -> SmoothFunction:
        radii = ("r",) if self.equal else tuple(f"r{i}" for i in bodies)
        reads = (*[f"{axis}{i}" for i in bodies for axis in axes], *radii)
        return SmoothFunction.member(
            family, member, self.manifold, parameters=parameters, reads=reads, label=label
        )

    @cached_property
    def energy(self) -> SmoothFunction:
        """``-r``, or ``-(r1 + ... + rn)``."""
        terms = [
            SmoothFunction.member(radius(), "minus radius", self.manifold, reads=(name,))
            for name in self._radius_names
        ]
        return terms[0] if self.equal else SmoothFunction.sum("minus sum of radii", terms)

    @checked
    def starts(self, rng: "np.random.Generator | int | None", count: int) -> Array:
        """Return ``count`` points with uniform centres and the best radii."""
        rng = checks.generator("rng", rng)
        several = range(checks.whole("count", count, least=1))
        return np.array([self._best(self.area.scattered(rng, self.count)) for _ in several])

    def centres(self, q: ArrayLike) -> Array:
        """Return the centres of one point, ``(n, d)``, on a torus as points of the plane."""
        return self.area.plane(self._parts(q)[0])

    def radii(self, q: ArrayLike) -> Array:
        """Return the radii of one point, ``(n,)``."""
        return np.broadcast_to(self._parts(q)[1], self.count)

    @checked
    def point(
        self,
        centres: ArrayLike,
        *,
        origin: "ArrayLike | float" = 0.0,
        unit: float = 1.0,
    ) -> Array:
        """Return the point of given centres with the best radii, those of a table with its frame.

        Equal radii are as large as the nearest pair or wall allows; others are the solution of the
        linear programme ``max sum r_i``.  Centres outside the region are moved onto its border.

        Parameters
        ----------
        centres : (n, d) array
            Cartesian coordinates, or the rows that :func:`read_coordinates` returns; more columns
            than ``d``, such as radii, are refused.
        origin : float or (d,) array, optional
            Where the region's origin lies in the table: its lower left corner, the centre of a
            disc.
        unit : float, optional
            How long its unit is there, such as the side of the unit square.
        """
        d = self.area.dimension
        expected = f"finite centres of shape ({self.count}, {d})"
        given = checks.numbers("centres", centres, expected)
        if given.shape != (self.count, d) or not np.isfinite(given).all():
            checks.refuse("centres", expected, given.shape)
        frame = checks.numbers("origin", origin, f"a number or {d} of them")
        if frame.shape not in {(), (d,)} or not np.isfinite(frame).all():
            checks.refuse("origin", f"a finite number or {d} of them", origin)
        plane = (given - frame) / checks.real("unit", unit, above=0)
        return self._best(self.area.placed(self.area.coordinates(plane)))

    def _best(self, centres: Array) -> Array:
        """Return the point of centres in coordinates of the region, ``(n, d)``, with best radii."""
        room = np.maximum(self.area.room(centres), 0.0)
        i, j = np.triu_indices(self.count, 1)
        apart = self.area.apart(centres, centres)[i, j]
        if self.equal:
            radii = np.array([min(room.min(), apart.min(initial=np.inf) / 2)])
        else:
            radii = _largest_sum(room, i, j, apart)
        return np.concatenate([centres.ravel(), radii])

    def repaired(self, q: ArrayLike) -> Array:
        """Return a point of the polyhedron near ``q``: the same centres with the best radii."""
        return self._best(self.area.placed(self._parts(q)[0]))

    def moved(self, q: ArrayLike, rng: "np.random.Generator | int | None" = None) -> Array:
        """Return ``q`` with all centres shaken, some of them, or a few bodies put into holes.

        The smallest bodies, and those that touch none, are often put elsewhere.
        """
        centres, radii = self._parts(q)
        rng = checks.generator("rng", rng)
        length = float(self.manifold.scales[0])
        kind = rng.integers(3)
        if kind == 0:
            width = length * rng.choice([0.1, 0.2, 0.4, 0.8])
            moved = centres + width * rng.standard_normal(centres.shape)
        elif kind == 1:
            moved = shaken(centres, self.area, rng, length)
        else:
            moved = refilled(centres, radii, self.area, rng)
        return self.repaired(np.append(moved.ravel(), radii))

    @cached_property
    def symmetry(self) -> Symmetry:
        """Rotations of the disc and translations of the torus, as vector fields."""
        pairs = [(f"x{i}", f"y{i}") for i in range(1, self.count + 1)]
        x = dict(zip(self.manifold.names, self.manifold.symbols, strict=True))
        if isinstance(self.area, TorusContainer):
            return Symmetry(fields=[{pair[k]: 1 for pair in pairs} for k in range(2)])
        if isinstance(self.area, BoxContainer):
            return Symmetry()
        turn = {a: -x[b] for a, b in pairs} | {b: x[a] for a, b in pairs}
        return Symmetry(fields=[turn])

    def _parts(self, q: ArrayLike) -> tuple[Array, Array]:
        point, d = self.manifold.point(q), self.area.dimension
        return point[: d * self.count].reshape(self.count, d), point[d * self.count :]


@dataclass(frozen=True)
class CirclesIn(Balls):
    """``n`` circles without overlap in a region, equal and large, or with a large sum of radii.

    ::

        +-----------+    x_i, y_i: centre i; r, or r_i: radii
        |  (1)  (2) |    1-2: |x_2 - x_1|^2 - (r_1 + r_2)^2 >= 0
        |    (3)    |    3-bottom: y_3 - r_3 >= 0
        +-----------+

    Parameters
    ----------
    region : str, (width, height) or two vectors
        ``"square"`` of side 1, ``"circle"`` of radius 1, ``"torus"`` (square lattice of period 1),
        ``"hexagonal torus"``, a rectangle, or a torus by its two lattice vectors.  Numbers are
        taken exactly: whole ones, fractions, decimals as text, and floats as dyadic fractions.
    count : int
        The number ``n`` of circles, at least 1.
    equal : bool, optional
        Whether they share one radius ``r``, with the energy ``-r``; otherwise it is
        ``-(r1 + ... + rn)``.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> model = CirclesIn("square", 5)
    >>> q = model.point([[0, 0], [0, 2], [2, 0], [2, 2], [1, 1]], origin=-0.5, unit=3)
    >>> float(model.radii(q)[0]).__round__(6)
    0.166667
    """

    region: Any
    count: int
    equal: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", checks.whole("count", self.count, least=1))
        checks.flag("equal", self.equal)
        region_of("region", self.region)

    @cached_property
    def area(self) -> Container:
        """The region as a value."""
        return region_of("region", self.region)


@dataclass(frozen=True)
class SpheresInCube(Balls):
    """``n`` spheres without overlap in the unit cube, as :class:`CirclesIn` in the square.

    Parameters
    ----------
    count : int
        The number ``n`` of spheres, at least 1.
    equal : bool, optional
        Whether they share one radius.
    """

    count: int
    equal: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", checks.whole("count", self.count, least=1))
        checks.flag("equal", self.equal)

    @cached_property
    def area(self) -> Container:
        """The unit cube as a value."""
        return BoxContainer((Fraction(1),) * 3)


def shaken(centres: Array, area: Container, rng: np.random.Generator, length: float) -> Array:
    """Return centres of which the neighbours of a random point are moved far."""
    near = np.argsort(area.apart(centres, area.scattered(rng, 1))[:, 0])
    some = near[: rng.integers(2, max(3, len(centres) // 3) + 1)]
    moved = centres.copy()
    moved[some] += length * rng.standard_normal((len(some), centres.shape[1]))
    return moved


def refilled(centres: Array, radii: Array, area: Container, rng: np.random.Generator) -> Array:
    """Return centres of which one or two lie in holes, wide ones more often.

    They are any, or one of the three smallest.
    """
    moved = centres.copy()
    for _ in range(rng.integers(1, 3)):
        smallest = np.argsort(np.broadcast_to(radii, len(centres)))[:3]
        k = rng.choice(smallest if len(radii) > 1 and rng.random() < 0.5 else len(centres))
        holes = area.scattered(rng, HOLES * len(centres))
        width = area.apart(holes, np.delete(moved, k, axis=0)).min(axis=1, initial=1.0)
        weights = width**WIDER
        moved[k] = holes[rng.choice(len(holes), p=weights / weights.sum())]
    return moved


def _largest_sum(room: Array, i: Indices, j: Indices, apart: Array) -> Array:
    """Return radii ``(n,)`` with the largest sum, ``r_i <= room_i`` and ``r_i + r_j <= apart``."""
    near = np.flatnonzero(apart < room[i] + room[j])
    k, n = np.arange(len(near)), len(room)
    places = np.concatenate([i[near], j[near]])
    rows = csr_array((np.ones(2 * len(near)), (np.tile(k, 2), places)), shape=(len(near), n))
    solve: Any = linprog  # whose stubs know no sparse arrays
    bounds = np.column_stack([np.zeros(n), room])
    found = solve(-np.ones(n), A_ub=rows, b_ub=apart[near], bounds=bounds, method="highs-ds")
    radii = np.clip(found.x, 0, room)
    # The solver's tolerance is absolute, and may leave a small overlap.
    sums = radii[i] + radii[j]
    return np.asarray(radii * min(1.0, (apart[sums > 0] / sums[sums > 0]).min(initial=1.0)))


def _shown(image: Sequence[int]) -> str:
    return f"({','.join(map(str, image))})" if image else ""
