"""Coordinates of a body, and formulas for where these put its points.

=============  ==========================  ====================================================
frame          coordinates                 for
=============  ==========================  ====================================================
``fixed``      none                        what does not move
``shifted``    ``x y`` or ``x y z``        discs and balls, which look the same when turned
``turned``     ``x y theta``               bodies in the plane
``axial``      ``x y z``, a unit vector    bodies of revolution: the direction of their axis
``rotated``    ``x y z``, a quaternion     bodies in space
``linked``     those of joints             links of chains: ``x y z``, a matrix (:mod:`chains`)
=============  ==========================  ====================================================

A point in coordinates of the body is carried to ``c + R p``; of bodies of revolution only the
position ``s`` along the axis is needed, ``c + s u``.
"""

from collections.abc import Sequence
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from polycorner.spaces.embedding import rotation_matrix
from polycorner.spaces.manifold import Array, Manifold

if TYPE_CHECKING:
    import sympy

    from polycorner.spaces.distances import Point

AXES = "xyz"
POSE = (*AXES, *(f"r{i}{j}" for i in range(3) for j in range(3)))  # origin and matrix of a link


class Frame(Enum):
    """The coordinates of a body; see the module."""

    FIXED = "fixed"
    SHIFTED = "shifted"
    TURNED = "turned"
    AXIAL = "axial"
    ROTATED = "rotated"
    LINKED = "linked"

    @property
    def turns(self) -> bool:
        """Whether bodies turn."""
        return self not in {Frame.FIXED, Frame.SHIFTED}

    def manifold(
        self,
        name: str,
        dimension: int,
        scale: float,
        turn: float,
        unit: str,
        periods: Sequence[float] = (),
    ) -> Manifold:
        """Return the placements of a body called ``name``.

        ``scale`` and ``turn`` are the displacement and the angle that count as a unit, ``periods``
        those of the position.
        """
        d = dimension
        names = tuple(f"{a}{name}" for a in AXES[:d])
        place = Manifold(names, tuple(periods), (scale,) * d, (unit,) * d)
        if self is Frame.TURNED:
            return place * Manifold((f"theta{name}",), (2 * np.pi,), (turn,))
        if self is Frame.AXIAL:
            return place * Manifold.sphere([f"u{a}{name}" for a in AXES], scale=turn)
        if self is Frame.ROTATED:
            return place * Manifold.rotation([f"a{a}{name}" for a in "w" + AXES], scale=turn)
        return place

    def variables(self, name: str, dimension: int) -> tuple[str, ...]:
        """Return the names of the coordinates of a body called ``name``."""
        if self is Frame.FIXED:
            return ()
        if self is Frame.LINKED:
            return tuple(f"{entry}{name}" for entry in POSE)
        return self.manifold(name, dimension, 1.0, 1.0, "").names

    def local(self, vector: Sequence[float], axis: Array | None) -> tuple[float, ...]:
        """Return the numbers by which formulas know a point or vector of the body."""
        if self is Frame.AXIAL and axis is not None:
            return (float(np.dot(vector, axis)),)
        return tuple(map(float, vector))

    def count(self, dimension: int) -> int:
        """How many such numbers there are."""
        return 1 if self is Frame.AXIAL else dimension

    def point(self, name: str, local: "Sequence[sympy.Expr]", dimension: int) -> "Point":
        """Return where a point of a body is; in the plane the third coordinate is zero."""
        there = self.vector(name, local, dimension)
        if self is Frame.FIXED:
            return there
        centre = symbols(self.variables(name, dimension)[:dimension])
        return _triple([c + v for c, v in zip(centre, there, strict=False)])

    def vector(self, name: str, local: "Sequence[sympy.Expr]", dimension: int) -> "Point":
        """Return the direction of a vector of a body."""
        import sympy

        if not self.turns:
            return _triple(local)
        turns = symbols(self.variables(name, dimension)[dimension:])
        if self is Frame.TURNED:
            (theta,), (x, y) = turns, local
            cosine, sine = sympy.cos(theta), sympy.sin(theta)
            return _triple([cosine * x - sine * y, sine * x + cosine * y])
        if self is Frame.AXIAL:
            return _triple([local[0] * u for u in turns])
        return _triple(list(self._matrix(turns) * sympy.Matrix(local)))

    def into(self, name: str, point: "Point", dimension: int) -> "Point":
        """Return a point of space in the coordinates of a body; not for axial ones."""
        import sympy

        if self is Frame.FIXED:
            return point
        names = self.variables(name, dimension)
        away = [p - c for p, c in zip(point, symbols(names[:dimension]), strict=False)]
        if self is Frame.SHIFTED:
            return _triple(away)
        turns = symbols(names[dimension:])
        if self is Frame.TURNED:
            (theta,), (x, y) = turns, away
            cosine, sine = sympy.cos(theta), sympy.sin(theta)
            return _triple([cosine * x + sine * y, cosine * y - sine * x])
        return _triple(list(self._matrix(turns).T * sympy.Matrix(away)))

    def _matrix(self, turns: "Sequence[sympy.Symbol]") -> "sympy.Matrix":
        import sympy

        return sympy.Matrix(3, 3, turns) if self is Frame.LINKED else rotation_matrix(turns)


def symbols(names: Sequence[str]) -> "list[sympy.Symbol]":
    """Return real symbols of the given names."""
    import sympy

    return [sympy.Symbol(name, real=True) for name in names]


def _triple(values: "Sequence[sympy.Expr]") -> "Point":
    import sympy

    x, y, *z = values
    return (x, y, z[0] if z else sympy.S.Zero)
