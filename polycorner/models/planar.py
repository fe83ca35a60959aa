"""Straight and circular walls in the plane, with corners in closed form, and a region of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import stratum_at
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, Value, cached_property

if TYPE_CHECKING:
    import sympy

MAX_TRIES = 100_000  # random points without one inside, after which a set counts as too thin


@dataclass(frozen=True)
class Wall(Value):
    """A straight or circular wall in the plane: ``f = n (p - m) + k |p - m|^2 / 2 >= 0``.

    The gradient of ``f`` has length one wherever ``f = 0``, so that ``f`` is the distance from
    the wall to first order.

    ===========  ==================================================================
    ``k = 0``    a half-plane, ``n`` pointing into it
    ``k > 0``    outside of a disc of radius ``1/k``: the wall bulges inwards
    ``k < 0``    a disc of radius ``1/|k|``
    ===========  ==================================================================

    Attributes
    ----------
    name : str
        Name of the function ``f``.
    point : (float, float)
        The point ``m`` of the wall.
    normal : (float, float)
        Direction of ``n``, of any length; ``n`` itself has length one.
    bend : float, optional
        The signed curvature ``k``; default 0.
    """

    name: str
    point: tuple[float, float]
    normal: tuple[float, float]
    bend: float = 0.0

    @cached_property
    def frame(self) -> tuple[Array, Array, Array]:
        """The point ``m``, the unit normal ``n``, and the unit tangent, ``n`` turned right."""
        n = np.array(self.normal) / math.hypot(*self.normal)
        return np.array(self.point, dtype=np.float64), n, np.array([n[1], -n[0]])

    def function(self, manifold: Manifold) -> SmoothFunction:
        """Return ``f`` on a plane, whatever its two coordinates are called."""
        m, n, _ = self.frame
        numbers = (*m.tolist(), *n.tolist(), self.bend)
        return SmoothFunction.member(
            wall_family(),
            "wall",
            manifold,
            parameters=numbers,
            reads=manifold.names,
            label=self.name,
        )

    @cached_property
    def coefficients(self) -> tuple[float, Array, float]:
        """The numbers ``(a, b, c)`` of ``f = a |p|^2 + b p + c``."""
        m, n, _ = self.frame
        k = self.bend
        return k / 2, n - k * m, float(k / 2 * (m @ m) - n @ m)

    def meetings(self, other: "Wall") -> Array:
        """Return the points that two walls share, ``(0, 2)``, ``(1, 2)`` or ``(2, 2)``.

        Two walls meet on the line of their pencil, the combination without ``|p|^2``; along it
        the more bent one leaves a quadratic equation.  Walls that touch count as sharing a point
        only as far as rounding lets them; parallel lines and walls of one centre share none.
        """
        one, two = sorted((self.coefficients, other.coefficients), key=lambda wall: abs(wall[0]))
        share = one[0] / two[0] if two[0] else 0.0
        line, offset = one[1] - share * two[1], one[2] - share * two[2]
        size = math.hypot(*line)
        a, b, c = two
        if size <= 10 * DEFAULT.rounding * (math.hypot(*one[1]) + math.hypot(*b)):
            return np.empty((0, 2))
        along = np.array([-line[1], line[0]]) / size
        foot = -offset / size**2 * line
        slope, level = float(along @ (2 * a * foot + b)), float(a * (foot @ foot) + foot @ b + c)
        if a == 0 and abs(slope) <= 10 * DEFAULT.rounding:
            return np.empty((0, 2))
        return foot + np.outer(_roots(a, slope, level), along)

    def position(self, p: ArrayLike) -> Array:
        """Return the signed arc length from ``m`` to points of the wall ``(..., 2)``."""
        m, n, tangent = self.frame
        d = np.asarray(p, dtype=np.float64) - m
        if self.bend == 0:
            return np.asarray(d @ tangent)
        turn = np.arctan2(self.bend * (d @ tangent), 1 + self.bend * (d @ n))
        return np.asarray(turn / self.bend)

    def at(self, position: ArrayLike) -> Array:
        """Return the points of the wall ``(..., 2)`` at arc lengths ``(...)`` from ``m``."""
        m, n, tangent = self.frame
        s = np.asarray(position, dtype=np.float64)[..., None]
        half = np.sinc(self.bend * s / (2 * np.pi))
        along = s * np.sinc(self.bend * s / np.pi)
        return np.asarray(m + along * tangent - self.bend / 2 * (s * half) ** 2 * n)

    def arc(self, start: ArrayLike, end: ArrayLike, count: int = 65) -> Array:
        """Return ``count`` points of the wall from one of its points to another, ``(count, 2)``.

        Of the two arcs of a circle it is the one that does not pass opposite ``m``.
        """
        checks.whole("count", count, least=0)
        return self.at(np.linspace(self.position(start), self.position(end), count))


@lru_cache(maxsize=1)
def wall_family() -> Family:
    """Return the function of a wall; parameters ``mx my nx ny k``."""
    from polycorner.formulas.cache import source_key

    parameters = ("mx", "my", "nx", "ny", "k")
    key = source_key(__name__)
    return Family(("wall",), ("x", "y"), parameters, _wall_formula, key, "1")


def meeting_corners(polyhedron: Polyhedron, walls: Sequence[Wall]) -> Array:
    """Return the corners of a planar polyhedron whose functions are all walls, ``(k, 2)``.

    Candidates are the points that two walls share; those on a face of dimension zero stay.
    """
    reach = DEFAULT.zero / 10 * max(polyhedron.manifold.scales)
    found: list[Array] = []
    for one, two in combinations(walls, 2):
        for point in one.meetings(two):
            known = any(abs(point - other).max() <= reach for other in found)
            if known or not polyhedron.contains(point, tolerance=reach):
                continue
            if stratum_at(polyhedron, point, tolerance=DEFAULT.zero / 10).dimension == 0:
                found.append(point)
    return np.array(found).reshape(-1, 2)


def uniform_points(
    polyhedron: Polyhedron,
    low: ArrayLike,
    high: ArrayLike,
    rng: np.random.Generator | int | None,
    count: int,
) -> Array:
    """Return ``count`` points uniform in the part of ``D`` inside a box, ``(count, n)``.

    Raises
    ------
    TypeError, ValueError
        For an ``rng`` or ``count`` of a wrong kind, or where no random point of the box lies in
        ``D``.
    """
    rng, count = checks.generator("rng", rng), checks.whole("count", count, least=0)
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    kept, tries = np.empty((0, len(low))), 0
    while len(kept) < count:
        points = low + (high - low) * rng.random((max(count, 100), len(low)))
        kept = np.vstack([kept, points[polyhedron.contains(points)]])
        tries += len(points)
        if not len(kept) and tries >= MAX_TRIES:
            msg = f"polyhedron: expected room inside the box; got none in {tries} random points"
            raise ValueError(msg)
    return kept[:count]


def positive(argument: str, value: object) -> float:
    """Return a positive finite number as a float, or raise."""
    return checks.real(argument, value, above=0)


def _wall_formula() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    import sympy

    x, y, mx, my, nx, ny, k = sympy.symbols("x y mx my nx ny k", real=True)
    dx, dy = x - mx, y - my
    return {}, {"wall": nx * dx + ny * dy + k * (dx**2 + dy**2) / 2}


def _roots(a: float, b: float, c: float) -> list[float]:
    """Return the real solutions of ``a s^2 + b s + c = 0``, without cancellation; finite ones."""
    square = b * b - 4 * a * c
    if square < 0:
        return []
    q = -(b + math.copysign(math.sqrt(square), b)) / 2
    if q == 0:
        return [0.0] if a else []
    return [c / q, q / a] if a and math.isfinite(q / a) else [c / q]


# ---------------------------------------------------------------------- a region with seven corners

# Its sides are straight or circular walls; some of the arcs bulge into the region.

SIDES = (
    Wall("AB", (0.2, -1.6), (1, 12), 0.4),
    Wall("BC", (2.5, -1.8), (-3, 2)),
    Wall("CD", (3.3, 0.7), (-6, -1), -0.26),
    Wall("DE", (1.35, 2.2), (-1, -3), 0.57),
    Wall("EF", (-0.6, 2.7), (1, -5)),
    Wall("FG", (-2.6, 1.6), (7, -5), -0.25),
    Wall("GA", (-2.1, -0.75), (2, 1), 0.3),
)


@dataclass(frozen=True)
class Tutorial(Checked):
    """A region in the plane with corners A to G, locally a quadrant at each ([GMBN] app. B).

    Counterclockwise from A its sides ``AB``, ``BC``, ..., ``GA`` are two segments, two arcs that
    bulge outwards and three that bulge inwards.  Every side's inequality holds on the whole
    region, so that no ``AnyOf`` is needed.  Because of the three arcs the region is not convex,
    nor convex near any of their points; two functions that vanish at a corner nevertheless make a
    chart in which it is a quadrant, and that is what local convexity asks for.

    Parameters
    ----------
    size : float, optional
        Factor by which the region, about 6 wide and 5 high, is enlarged; default 1.

    Raises
    ------
    TypeError, ValueError
        If the size is not a positive finite number.

    Examples
    --------
    >>> region = Tutorial()
    >>> "".join(region.corners()), region.polyhedron.contains([0.0, 0.0])
    ('ABCDEFG', True)
    """

    size: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", positive("size", self.size))

    @cached_property
    def manifold(self) -> Manifold:
        """The plane."""
        return Manifold.euclidean("x y", scale=self.size, unit="1")

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The seven sides, counterclockwise."""
        return tuple(
            Wall(
                side.name,
                (side.point[0] * self.size, side.point[1] * self.size),
                side.normal,
                side.bend / self.size,
            )
            for side in SIDES
        )

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The region: all seven functions at least zero."""
        return Polyhedron(self.manifold, AllOf(*[w.function(self.manifold) for w in self.walls]))

    def corners(self) -> dict[str, Array]:
        """Return the seven corners ``(2,)`` by their letters, where two sides meet."""
        found: dict[str, Array] = {}
        for point in meeting_corners(self.polyhedron, self.walls):
            first, second = stratum_at(self.polyhedron, point).active
            (letter,) = set(first) & set(second)
            found[letter] = point
        return dict(sorted(found.items()))

    @checked
    def sides(self, count: int = 65) -> dict[str, Array]:
        """Return the seven sides as polylines ``(count, 2)``, each from its first corner."""
        corners = self.corners()
        return {
            wall.name: wall.arc(corners[wall.name[0]], corners[wall.name[1]], count)
            for wall in self.walls
        }

    @checked
    def starts(self, rng: np.random.Generator | int | None, count: int) -> Array:
        """Return ``count`` points of the region, uniformly distributed, ``(count, 2)``."""
        outline = np.vstack([*self.sides().values()])
        return uniform_points(self.polyhedron, outline.min(axis=0), outline.max(axis=0), rng, count)
