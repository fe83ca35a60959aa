"""What joints take hold of, and the coordinates that they leave, as formulas."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from polycorner.bodies.frames import Frame, symbols
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import sympy

    from polycorner.spaces.distances import Point

    Expressions = dict[str, sympy.Expr]
    Quaternion = tuple[sympy.Expr, sympy.Expr, sympy.Expr, sympy.Expr]


class Holding(NamedTuple):
    """What a joint takes hold of: a body, or space, in whose coordinates fixed bodies are.

    In a periodic box it has images, after ``periods``.
    """

    name: str
    frame: Frame
    dimension: int
    axis: Array | None
    periods: tuple[float, ...] = ()

    def point(self, local: Array) -> "Point":
        """Return where a point of it is."""
        return self.frame.point(self.name, self.frame.local(local.tolist(), self.axis), len(local))

    def along(self, away: "Point", local: Array) -> "sympy.Expr":
        """Return the component of a vector of space along a direction of it."""
        ahead = self.frame.vector(
            self.name, self.frame.local(local.tolist(), self.axis), len(local)
        )
        return sum(a * b for a, b in zip(away, ahead, strict=True))

    @property
    def turns(self) -> "list[sympy.Symbol]":
        """The coordinates of its orientation; none of space."""
        return symbols(self.frame.variables(self.name, self.dimension)[self.dimension :])

    @property
    def quaternion(self) -> "Quaternion":
        """The unit quaternion of its rotation."""
        import sympy

        if self.frame is Frame.FIXED:
            return (sympy.S.One, *[sympy.S.Zero] * 3)
        w, x, y, z = self.turns
        return w, x, y, z


class Angle(NamedTuple):
    """An angle by cosine and sine of its half, in the plane also as itself."""

    cosine: "sympy.Expr"
    sine: "sympy.Expr"
    plain: "sympy.Expr | None" = None

    def wave(self, centre: float) -> "sympy.Expr":
        """Return the cosine of the angle from a centre."""
        import sympy

        if self.plain is not None:
            return sympy.cos(self.plain - centre)
        c, s = self.cosine, self.sine
        return (c**2 - s**2) * math.cos(centre) + 2 * c * s * math.sin(centre)

    def value(self, centre: float = 0.0) -> "sympy.Expr":
        """Return the angle in radians, within half a turn about a centre."""
        import sympy

        if self.plain is not None:
            return centre + 2 * sympy.atan(sympy.tan((self.plain - centre) / 2))
        cosine, sine = math.cos(centre / 2), math.sin(centre / 2)
        ahead = self.cosine * cosine + self.sine * sine
        return centre + 2 * sympy.atan((self.sine * cosine - self.cosine * sine) / ahead)

    def slopes(self, coordinates: "Sequence[sympy.Symbol]") -> "Expressions":
        """Return the derivatives by coordinates."""
        import sympy

        if self.plain is not None:
            return slopes_of(self.plain, coordinates)
        parts = [slopes_of(part, coordinates) for part in (self.cosine, self.sine)]
        change: Expressions = {}
        for name in dict.fromkeys([*parts[0], *parts[1]]):
            c, s = (part.get(name, sympy.S.Zero) for part in parts)
            change[name] = 2 * (self.cosine * s - self.sine * c)
        return change

    def away(self, aim: Any) -> "sympy.Expr":
        """Return what vanishes with the slope 1 at an angle, however often it goes round."""
        import sympy

        return 2 * (self.sine * sympy.cos(aim / 2) - self.cosine * sympy.sin(aim / 2))

    def phase(self, multiple: float) -> "tuple[sympy.Expr, sympy.Expr]":
        """Return cosine and sine of half a whole multiple."""
        import sympy

        if self.plain is not None:
            return sympy.cos(multiple * self.plain / 2), sympy.sin(multiple * self.plain / 2)
        found: tuple[Any, Any] = (sympy.S.One, sympy.S.Zero)
        for digit in f"{abs(int(multiple)):b}":
            found = times(found, found)
            found = times(found, (self.cosine, self.sine)) if digit == "1" else found
        return found[0], found[1] if multiple > 0 else -found[1]


class Position(NamedTuple):
    """A length along a line."""

    plain: "sympy.Expr"

    def value(self, _: float = 0.0) -> "sympy.Expr":
        """Return it."""
        return self.plain

    def slopes(self, coordinates: "Sequence[sympy.Symbol]") -> "Expressions":
        """Return the derivatives by coordinates."""
        return slopes_of(self.plain, coordinates)

    def away(self, aim: Any) -> "sympy.Expr":
        """Return what vanishes with the slope 1 at a position."""
        return self.plain - aim

    def phase(self, multiple: float) -> "tuple[sympy.Expr, sympy.Expr]":
        """Return cosine and sine of half a multiple."""
        import sympy

        return sympy.cos(multiple * self.plain / 2), sympy.sin(multiple * self.plain / 2)


Coordinate = Angle | Position


def slopes_of(e: "sympy.Expr", coordinates: "Sequence[sympy.Symbol]") -> "Expressions":
    """Return the derivatives by the coordinates that a formula has."""
    import sympy

    return {q.name: sympy.diff(e, q) for q in coordinates if e.has(q)}


def times(one: Any, two: Any) -> tuple[Any, Any]:
    """Return the product of two complex numbers."""
    (a, b), (c, d) = one, two
    return a * c - b * d, a * d + b * c


def hamilton(a: "Sequence[Any]", b: "Sequence[Any]") -> "tuple[Any, ...]":
    """Return the product of two quaternions."""
    (p, x, y, z), (r, u, v, w) = a, b
    return (
        p * r - x * u - y * v - z * w,
        p * u + r * x + y * w - z * v,
        p * v + r * y + z * u - x * w,
        p * w + r * z + x * v - y * u,
    )


def across(axis: Array) -> list[Array]:
    """Return unit vectors across one, right-handed with it; of ``z`` they are ``x`` and ``y``."""
    if len(axis) == 2:
        return [np.array([-axis[1], axis[0]])]
    first = np.eye(3)[int(np.argmin(abs(axis).round(9)))]
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    return [first, np.cross(axis, first)]
