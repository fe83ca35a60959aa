"""Walls: half-spaces, boxes, and cylinders and spheres around bodies.

A part stays on the inner side of a wall if its points stay ``radius`` away from it, since the
inside is convex.  The outside of a cylinder, a sphere or a box is that of a fixed body.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies import gaps
from polycorner.bodies.frames import Frame
from polycorner.bodies.pairs import Member, gap, nearest
from polycorner.checks import refuse
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class HalfSpace(Value):
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

    def family(self, frame: Frame) -> Family:
        """Return the gap of a point of a body."""
        return gaps.side(frame, Frame.FIXED, self.dimension)

    def numbers(self, radius: float) -> list[float]:
        """Return its parameters, for a part of a given radius."""
        return [*self.point.tolist(), *self.normal.tolist(), radius]

    def fixed_by(self) -> tuple[Array, Array]:
        """Return vectors ``(k, d)``, ``(m, d)`` that a motion of the wall onto itself keeps.

        The velocity at ``point`` has to be orthogonal to the first ones; the second ones must not
        be turned.
        """
        return self.normal[None], self.normal[None]


@dataclass(frozen=True, eq=False)
class Cylinder(Value):
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
    """

    radius: float
    axis: Array | None = None
    point: Array = field(default_factory=lambda: np.zeros(2))
    spin: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", checks.real("radius", self.radius, above=0))
        point = self.point
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
        super().__post_init__()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return len(self.point)

    def family(self, frame: Frame) -> Family:
        """Return the gap of a point of a body."""
        return gaps.hollow(frame, self.dimension)

    def numbers(self, radius: float) -> list[float]:
        """Return its parameters, for a part of a given radius."""
        axis = np.zeros(self.dimension) if self.axis is None else self.axis
        return [*self.point.tolist(), *axis.tolist(), self.radius - radius]

    def fixed_by(self) -> tuple[Array, Array]:
        """Return what motions of the wall onto itself keep; see :meth:`HalfSpace.fixed_by`."""
        whole = np.eye(self.dimension)
        if self.axis is None:
            return whole, whole[:0]
        return whole - np.outer(self.axis, self.axis), self.axis[None]


Wall = HalfSpace | Cylinder


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


def within(
    manifold: Manifold, name: str, wall: Wall, member: Member
) -> list[tuple[SmoothFunction, Array]]:
    """Return the gaps of a part and a wall, and the points of the part that they are of."""
    radius = member.part.radius
    if isinstance(wall, Cylinder) and wall.radius <= radius:
        refuse("walls", f"a radius of {name!r} above that of {member.name!r}", wall.radius)
    numbers, family = wall.numbers(radius), wall.family(member.frame)
    points = list(enumerate(member.part.points))
    if isinstance(wall, HalfSpace):
        points = nearest(member, wall.normal, turning=False)
    found = []
    for i, p in points:
        label = f"{member.vertex(i)}-{name}"
        function = gap(manifold, family, member, None, [*member.numbers(p), *numbers], label)
        found.append((function, p))
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
