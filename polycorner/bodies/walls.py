"""Walls: half-spaces, boxes, and cylinders and spheres around bodies.

A part stays on the inner side of a wall if its points stay ``radius`` away from it, since the
inside is convex.  The outside of a cylinder, a sphere or a box is that of a fixed body.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies import gaps
from polycorner.bodies.frames import Frame
from polycorner.bodies.pairs import PlacedPart, function_of, nearest
from polycorner.bodies.waves import checked_waves, wave_depth
from polycorner.checks import refuse
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property


@dataclass(frozen=True, eq=False)
class HalfSpace(Checked):
    """The points on one side of a line in the plane, or of a plane in space.

    Parameters
    ----------
    normal : (d,) array
        Of any length, pointing to where bodies may be.
    point : (d,) array
        A point of the line or plane.
    """

    normal: Array
    point: Array

    def __post_init__(self) -> None:
        normal = _vector("normal", self.normal)
        object.__setattr__(self, "normal", normal / np.linalg.norm(normal))
        object.__setattr__(self, "point", _vector("point", self.point, len(normal), zero=True))
        super().__post_init__()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.normal)

    @property
    def described(self) -> str:
        """The wall in words."""
        axes = "xyz"
        for axis, x in zip(axes, self.normal.tolist(), strict=False):
            if abs(x) == 1:
                level = self.point[axes.index(axis)]
                return f"{axis} {'>=' if x > 0 else '<='} {level:g}"
        normal = ", ".join(f"{x:g}" for x in self.normal)
        return f"half-space with normal ({normal})"

    def family(self, frame: Frame) -> Family:
        """Return the gap of a point of a body."""
        return gaps.side(frame, Frame.FIXED, self.dimension)

    def numbers(self, radius: float) -> list[float]:
        """Return its parameters, for a part of a given radius."""
        return [*self.point.tolist(), *self.normal.tolist(), radius]

    @property
    def angular_velocity(self) -> Array:
        """Zero, ``(3,)``."""
        return np.zeros(3)

    def fixed_by(self) -> tuple[Array, Array]:
        """Return vectors ``(k, d)``, ``(m, d)`` that a motion of the wall onto itself keeps.

        The velocity at ``point`` has to be orthogonal to the first ones; the second ones must not
        be turned.
        """
        return self.normal[None], self.normal[None]


@dataclass(frozen=True, eq=False)
class Cylinder(Checked):
    """The inside of a circle in the plane, and of a cylinder or a sphere in space.

    Parameters
    ----------
    radius : float
    axis : (3,) array, optional
        The direction of the axis of a cylinder in space; without it, a circle or a sphere.
    point : (d,) array, optional
        A point of the axis, or the centre; default the origin.  Needed for a sphere.
    spin : float, optional
        Angular velocity of the wall about its axis, in rad/s; of a circle counterclockwise.
        Friction drags bodies along.  Default 0; a sphere does not turn.
    waves : mapping from int to (float, float), optional
        Amplitude ``a_k`` and phase ``p_k`` of each harmonic ``k >= 1`` of a wall that is out of
        round: to first order in ``a / R``, the points of a part of radius ``r`` reach up to
        ``R - r + sum_k a_k cos(k phi + p_k)``.  The azimuth ``phi`` grows counterclockwise, or
        right-handed about the axis, from the direction of ``x``, or in space from its projection
        (of ``y``, where the axis is along ``x``).  Such a wall does not spin; the axes may turn
        instead, with all that stands in them (``turning`` of :class:`Arrangement`).
    """

    radius: float
    axis: Array | None = None
    point: Array = field(default_factory=lambda: np.zeros(2))
    spin: float = 0.0
    waves: Mapping[int, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checks.real("radius", self.radius, above=0))
        point = checks.reals("point", self.point)
        if self.axis is not None:
            axis = _vector("axis", self.axis, 3)
            object.__setattr__(self, "axis", axis / np.linalg.norm(axis))
            if np.size(point) == 2 and not np.any(point):
                point = np.zeros(3)
        d = 3 if self.axis is not None else np.size(point)
        object.__setattr__(self, "point", _vector("point", point, d, zero=True))
        object.__setattr__(self, "spin", checks.real("spin", self.spin))
        if self.spin and self.axis is None and d == 3:
            refuse("spin", "0 for a sphere, which has no axis", self.spin)
        object.__setattr__(self, "waves", checked_waves(self.waves, self.radius))
        if self.waves and (self.spin or (self.axis is None and d == 3)):
            what = "a circle or cylinder that does not spin, where there are waves"
            refuse("waves", what, self.waves)
        super().__post_init__()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.point)

    @property
    def described(self) -> str:
        """The wall in words."""
        planar = "circle" if self.dimension == 2 else "sphere"
        kind = planar if self.axis is None else "cylinder"
        waves = " with waves" if self.waves else ""
        return f"inside of a {kind} of radius {self.radius:g}{waves}"

    def family(self, frame: Frame) -> Family:
        """Return the gap of a point of a body."""
        return gaps.hollow(frame, self.dimension, len(self.waves))

    def numbers(self, radius: float) -> list[float]:
        """Return its parameters, for a part of a given radius."""
        axis = np.zeros(self.dimension) if self.axis is None else self.axis
        around = self.around.ravel().tolist() if self.waves else []
        terms = [x for k, (a, p) in self.waves.items() for x in (float(k), a, p)]
        return [*self.point.tolist(), *axis.tolist(), self.radius - radius, *around, *terms]

    @property
    def angular_velocity(self) -> Array:
        """That of the wall, ``(3,)``, in rad/s."""
        axis = np.array([0.0, 0.0, 1.0]) if self.axis is None else self.axis
        return self.spin * axis

    @cached_property
    def around(self) -> Array:
        """The directions of the azimuths 0 and a quarter turn, ``(2, d)``."""
        if self.axis is None:
            return np.eye(2)
        is_along_x = abs(self.axis[0]) > 1 - 1e-6
        first = np.eye(3)[int(is_along_x)]
        start = first - (first @ self.axis) * self.axis
        start /= np.linalg.norm(start)
        return np.stack([start, np.cross(self.axis, start)])

    def fixed_by(self) -> tuple[Array, Array]:
        """Return what motions of the wall onto itself keep; see :meth:`HalfSpace.fixed_by`."""
        whole = np.eye(self.dimension)
        held = whole if self.waves else whole[:0]
        if self.axis is None:
            return whole, held
        return whole - np.outer(self.axis, self.axis), np.concatenate([self.axis[None], held])


Wall = HalfSpace | Cylinder


@shown
def box(low: ArrayLike, high: ArrayLike) -> dict[str, HalfSpace]:
    """Return the walls of a box: ``left``, ``right``, ``bottom``, ``top``, ``front``, ``back``.

    Parameters
    ----------
    low, high : (2,) or (3,) array
        Two opposite corners; the last coordinate goes from bottom to top.

    Examples
    --------
    >>> list(box([0, 0], [4, 3]))
    ['left', 'right', 'bottom', 'top']
    """
    one = _vector("low", low, zero=True)
    two = _vector("high", high, len(one), zero=True)
    if (two <= one).any():
        refuse("high", f"a corner above and right of {one.tolist()}", two.tolist())
    names = [("left", "right"), ("front", "back"), ("bottom", "top")]
    sides = names if len(one) == 3 else [names[0], names[2]]
    walls: dict[str, HalfSpace] = {}
    for pair, normal in zip(sides, np.eye(len(one)), strict=True):
        walls[pair[0]] = HalfSpace(normal, one)
        walls[pair[1]] = HalfSpace(-normal, two)
    return walls


class WallTouch(NamedTuple):
    """The gap of a part at a wall, and which point of the part it is of.

    Attributes
    ----------
    gap : SmoothFunction
    member : PlacedPart
    point : (d,) array
        In coordinates of the body.
    wall : HalfSpace or Cylinder
    name : str
        Name of the wall.
    """

    gap: SmoothFunction
    member: PlacedPart
    point: Array
    wall: Wall
    name: str


def within(manifold: Manifold, name: str, wall: Wall, member: PlacedPart) -> list[WallTouch]:
    """Return the gaps of a part and a wall."""
    radius = member.part.radius
    if isinstance(wall, Cylinder) and wall.radius - wave_depth(wall.waves) <= radius:
        room = f" plus {wave_depth(wall.waves):g} for its waves" if wall.waves else ""
        refuse("walls", f"a radius of {name!r} above that of {member.name!r}{room}", wall.radius)
    numbers, family = wall.numbers(radius), wall.family(member.frame)
    points = list(enumerate(member.part.points))
    if isinstance(wall, HalfSpace):
        points = nearest(member, wall.normal, turning=False)
    found = []
    for i, p in points:
        given, label = [*member.numbers(p), *numbers], f"{member.vertex(i)}-{name}"
        function = function_of(manifold, family, member, None, given, label)
        found.append(WallTouch(function, member, p, wall, name))
    return found


def _vector(argument: str, given: Any, size: int | None = None, *, zero: bool = False) -> Array:
    expected = f"{size or '2 or 3'} finite numbers" + ("" if zero else ", not all zero")
    vector = checks.numbers(argument, given, expected)
    sizes = (2, 3) if size is None else (size,)
    if vector.ndim != 1 or len(vector) not in sizes or not np.isfinite(vector).all():
        refuse(argument, expected, given)
    if not zero and not vector.any():
        refuse(argument, expected, given)
    return vector
