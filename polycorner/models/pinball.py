"""Pinball: a ball on a tilted board with round pins, wedges and cups.

The ball is a point.  A ball of radius ``r`` among obstacles is the point that is its centre, with
walls moved in and pins and cups made thicker by ``r``; a wedge thickened in this way would have
rounded corners: use a thinner wedge with a pin at each corner.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import reals, refuse
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.models.planar import Wall, meeting_corners, positive, uniform_points
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Described
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

    Point = tuple[float, float]

PINS = (
    (1.2, 6.9, 0.3),
    (3.0, 7.1, 0.3),
    (4.8, 6.9, 0.3),
    (2.1, 6.0, 0.3),
    (3.9, 6.0, 0.3),
    (2.4, 4.6, 0.4),
    (3.0, 4.4, 0.4),
    (0.5, 3.9, 0.6),
)
WEDGES = (
    ((0.8, 2.9), (2.2, 1.4), (0.8, 1.6)),
    ((3.2, 2.4), (1.8, 1.5), (3.0, 1.0)),
    ((-0.5, 5.7), (0.9, 5.7), (-0.5, 5.0)),
)
CUPS = ((4.3, 3.1, 0.5, 0.65), (6.0, 4.7, 0.6, 0.75))


@dataclass(frozen=True)
class Pinball(Checked, Described):
    """A point ball on a tilted board between walls, among pins, wedges and cups.

    Coordinates are ``x`` across the board and ``y`` up the board, from its lower left corner.
    Obstacles may overlap each other and the walls; pockets form between them.  The functions are
    named after the obstacles:

    ================================  =====================================================
    ``left right floor lid``          the walls
    ``pin1``                          outside of a disc
    ``wedge1.ab wedge1.bc ...``       beyond a side of a triangle; any one of three is enough
    ``cup1.hollow .shell .rim``       inside the hollow of a half-ring that is open above,
                                      outside of it, or above its rim; any one is enough
    ================================  =====================================================

    Parameters
    ----------
    width, height : float, optional
        Size of the board.
    pins : sequence of (x, y, radius), optional
        Round pins.
    wedges : sequence of three corners (x, y), optional
        Triangles a, b, c, either way round.
    cups : sequence of (x, y, inner, outer), optional
        Centre of the rim and the two radii.
    tilt : float, optional
        Angle of the board with the horizontal in radians, up to ``pi/2``.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> board = Pinball(pins=[(3, 4, 1)], wedges=(), cups=())
    >>> board.polyhedron.names, board.polyhedron.contains([3.0, 4.5])
    (('left', 'right', 'floor', 'lid', 'pin1'), False)
    """

    width: float = 6.0
    height: float = 8.0
    pins: tuple[tuple[float, float, float], ...] = PINS
    wedges: "tuple[tuple[Point, Point, Point], ...]" = WEDGES
    cups: tuple[tuple[float, float, float, float], ...] = CUPS
    tilt: float = math.radians(6.5)

    def __post_init__(self) -> None:
        for name in ("width", "height", "tilt"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        for name, shape, meaning in (
            ("pins", (3,), "rows (x, y, radius)"),
            ("wedges", (3, 2), "triangles of three corners (x, y)"),
            ("cups", (4,), "rows (x, y, inner, outer)"),
        ):
            object.__setattr__(self, name, _rows(name, getattr(self, name), shape, meaning))
        _check(self)

    @cached_property
    def manifold(self) -> Manifold:
        """The plane of the board."""
        return Manifold.euclidean("x y", unit="1")

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """Every wall, in the order of the functions."""
        return tuple(wall for group in self._obstacles for wall in group)

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The free region: inside the board and outside of every obstacle."""
        parts = [
            [wall.function(self.manifold) for wall in obstacle] for obstacle in self._obstacles
        ]
        return Polyhedron(
            self.manifold,
            AllOf(*[part[0] if len(part) == 1 else AnyOf(*part) for part in parts]),
        )

    @cached_property
    def energy(self) -> SmoothFunction:
        """``E``: the height of the ball above the board's lower end, ``y sin(tilt)``."""
        return SmoothFunction.member(
            _heights(), "height", self.manifold, parameters=(math.sin(self.tilt),)
        )

    def corners(self) -> Array:
        """Return every corner of the region, locally convex or concave, ``(k, 2)``."""
        return meeting_corners(self.polyhedron, self.walls)

    @checked
    def starts(self, rng: np.random.Generator | int | None, count: int) -> Array:
        """Return ``count`` points of the region, uniformly distributed, ``(count, 2)``."""
        return uniform_points(self.polyhedron, (0, 0), (self.width, self.height), rng, count)

    @cached_property
    def _obstacles(self) -> tuple[tuple[Wall, ...], ...]:
        """Walls in groups: a ball is outside of an obstacle where any wall of its group holds."""
        return (
            (Wall("left", (0, 0), (1, 0)),),
            (Wall("right", (self.width, 0), (-1, 0)),),
            (Wall("floor", (0, 0), (0, 1)),),
            (Wall("lid", (0, self.height), (0, -1)),),
            *[(_disc(f"pin{i}", x, y, r),) for i, (x, y, r) in enumerate(self.pins, 1)],
            *[tuple(_beyond(f"wedge{i}", wedge)) for i, wedge in enumerate(self.wedges, 1)],
            *[tuple(_around(f"cup{i}", *cup)) for i, cup in enumerate(self.cups, 1)],
        )


def _disc(name: str, x: float, y: float, radius: float) -> Wall:
    """Return the outside of a disc, seen from its top."""
    return Wall(name, (x, y + radius), (0, 1), 1 / radius)


def _beyond(name: str, corners: "tuple[Point, Point, Point]") -> Iterator[Wall]:
    """Yield the half-planes whose union is the outside of a triangle."""
    turn = math.copysign(1.0, _double_area(np.array(corners)))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        (ax, ay), (bx, by) = corners[i], corners[j]
        yield Wall(f"{name}.{'abc'[i]}{'abc'[j]}", (ax, ay), (turn * (by - ay), turn * (ax - bx)))


def _around(name: str, x: float, y: float, inner: float, outer: float) -> Iterator[Wall]:
    """Yield the inside, the outside and the top whose union leaves out a half-ring."""
    yield Wall(f"{name}.hollow", (x, y - inner), (0, 1), -1 / inner)
    yield Wall(f"{name}.shell", (x, y - outer), (0, -1), 1 / outer)
    yield Wall(f"{name}.rim", (x, y), (0, 1))


def _double_area(corners: Array) -> float:
    (ax, ay), (bx, by) = corners[1] - corners[0], corners[2] - corners[0]
    return float(ax * by - ay * bx)


@lru_cache(maxsize=1)
def _heights() -> Family:
    """Return the height; parameter ``s``, the sine of the tilt."""
    from polycorner.formulas.cache import source_key

    return Family(("height",), ("x", "y"), ("s",), _height_formula, source_key(__name__), "1")


def _height_formula() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    import sympy

    y, s = sympy.symbols("y s", real=True)
    return {}, {"height": s * y}


def _rows(argument: str, values: Any, shape: tuple[int, ...], meaning: str) -> Any:
    """Return an array of rows as nested tuples, so that the board is hashable."""
    array = finite(reals(argument, values), argument)
    if array.shape[:1] == (0,):
        return ()
    if array.shape[1:] != shape:
        msg = f"{argument}: expected {meaning}; got an array of shape {array.shape}"
        raise ValueError(msg)
    return _tuples(array.tolist())


def _tuples(values: Any) -> Any:
    return tuple(map(_tuples, values)) if isinstance(values, list) else values


def _check(board: Pinball) -> None:
    if board.tilt > math.pi / 2:
        msg = f"tilt: expected an angle of at most pi/2; got {board.tilt:g}"
        raise ValueError(msg)
    for pin in board.pins:
        if not pin[2] > 0:
            refuse("pins", "positive radii", pin)
    for wedge in board.wedges:
        corners = np.array(wedge)
        longest = max(math.dist(corners[i], corners[i - 1]) for i in range(3))
        if abs(_double_area(corners)) <= DEFAULT.alike * longest**2:
            refuse("wedges", "three corners that are not in line", wedge)
    for cup in board.cups:
        if not 0 < cup[2] < cup[3]:
            refuse("cups", "radii with 0 < inner < outer", cup)
