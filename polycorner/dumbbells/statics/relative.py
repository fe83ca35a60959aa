"""Relative placements of two dumbbells in the plane, for complete lists of places of rest.

Rigid motions of the plane preserve the polyhedron ``D`` of a pair, translations along the axis the
energy as well.  Along a translation across it, the energy of stationary points has no derivative
either, as it leads from ``D`` into ``D`` both ways: the lateral positions of the two dumbbells
add up to zero.  All stationary points of the pair are therefore, up to translations along the axis,
those of the energy on the placements

    A: (-x, -y/2, alpha),   B: (x, y/2, beta)

in four coordinates, and local minima are the same.  Dumbbells whose centres are more than
``l + 2 r`` apart do not touch; there the energy is stationary only at ``x = 0`` and headings that
are multiples of a right angle, for all ``y``.  What remains is compact.

The rods overlap where their axes cross: where no ball of one dumbbell overlaps the rod of the
other, each end is at least ``r + t > 2 t`` from the other axis, which is thus nearer than ``2 t``
only if the axes cross.  They do not cross if and only if their centres are at least ``l`` apart, or
both ends of one lie on one side of the line through the other: closed conditions that are smooth,
also for parallel rods, where the distance of the rods is not.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.formulas.functions import SmoothFunction
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.spaces import distances
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value

if TYPE_CHECKING:
    import sympy

MARGIN = 1.05  # sides of the box over the reach of contacts


@dataclass(frozen=True)
class RelativePlacements(Value):
    """Two equal dumbbells in the plane, modulo translations; see the module.

    Parameters
    ----------
    length, ball_radius, rod_radius : float
        ``l``, ``r`` and ``t`` in mm, as of :class:`~polycorner.dumbbells.pair.DumbbellPair`.

    Raises
    ------
    TypeError, ValueError
        As for a pair.
    """

    length: float
    ball_radius: float
    rod_radius: float

    def __post_init__(self) -> None:
        pair = DumbbellPair(self.length, self.ball_radius, self.rod_radius)
        for name in ("length", "ball_radius", "rod_radius"):
            object.__setattr__(self, name, getattr(pair, name))

    @cached_property
    def manifold(self) -> Manifold:
        """Coordinates ``x`` and ``y`` in mm, ``alpha`` and ``beta`` in rad."""
        r, turn = self.ball_radius, 2 * self.ball_radius / self.length
        periods = (math.inf, math.inf, math.tau, math.tau)
        units = ("mm", "mm", "rad", "rad")
        return Manifold(("x", "y", "alpha", "beta"), periods, (r, r, turn, turn), units)

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """Four ball-ball and four ball-rod gaps, and five ways for the rods not to cross."""
        gaps, ways = self._formulas()
        functions = {
            name: SmoothFunction.quantity(name, formula, self.manifold)
            for name, formula in (gaps | ways).items()
        }
        sides = [
            AllOf(functions[f"{sign}{first}"], functions[f"{sign}{second}"])
            for first, second in (("A1", "A2"), ("B1", "B2"))
            for sign in ("left", "right")
        ]
        return Polyhedron(
            self.manifold,
            AllOf(*[functions[name] for name in gaps], AnyOf(functions["apart"], *sides)),
        )

    @cached_property
    def energy(self) -> SmoothFunction:
        """Half the sum of squared lateral positions of the balls, in mm^2."""
        import sympy

        x, _, alpha, beta = self.manifold.symbols
        half = sympy.Rational(self.length) / 2
        lateral = half**2 * (sympy.sin(alpha) ** 2 + sympy.sin(beta) ** 2)
        return SmoothFunction("trough", 2 * x**2 + lateral, self.manifold, unit="mm^2")

    @property
    def box(self) -> dict[str, tuple[float, float]]:
        """Sides of a box that contains all placements in contact; headings are unrestricted."""
        reach = MARGIN * (self.length + 2 * self.ball_radius)
        return {"x": (-reach / 2, reach / 2), "y": (-reach, reach)}

    @cached_property
    def symmetry(self) -> Symmetry:
        """Half-turns of each dumbbell, their exchange, and the mirror images in both axes."""
        maps = (_turn_a, _turn_b, _exchange, _mirror_across, _mirror_along)
        return Symmetry(elements=tuple(Element(apply, {}) for apply in maps))

    def placement(self, q: ArrayLike) -> Array:
        """Return the placement ``(..., 6)`` of the pair in the plane."""
        x, y, alpha, beta = np.moveaxis(self.manifold.points(q), -1, 0)
        return np.stack([-x, -y / 2, alpha, x, y / 2, beta], axis=-1)

    def _formulas(self) -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
        """Return the gaps, and the functions whose signs say that the rods do not cross."""
        import sympy

        x, y, alpha, beta = self.manifold.symbols
        sizes = (self.length, self.ball_radius, self.rod_radius)
        length, r, t = (sympy.Rational(size) for size in sizes)
        half = length / 2
        heading = {"A": alpha, "B": beta}
        centre = {"A": (-x, -y / 2, sympy.S.Zero), "B": (x, y / 2, sympy.S.Zero)}
        axis = {k: (sympy.sin(h), sympy.cos(h), sympy.S.Zero) for k, h in heading.items()}
        ends = {
            f"{k}{i}": tuple(c + side * half * u for c, u in zip(centre[k], axis[k], strict=True))
            for k in "AB"
            for i, side in ((1, -1), (2, 1))
        }
        gaps: dict[str, Any] = {}
        for a in ("A1", "A2"):
            for b in ("B1", "B2"):
                gaps[a + b] = distances.norm(distances.minus(ends[a], ends[b])) - 2 * r
        ways: dict[str, Any] = {"apart": 4 * x**2 + y**2 - length**2}
        for end, point in ends.items():
            rod = "B" if end[0] == "A" else "A"
            w, u = distances.minus(point, centre[rod]), axis[rod]
            along = distances.dot(w, u)
            foot = (sympy.Abs(along + half) - sympy.Abs(along - half)) / 2  # clamped to the rod
            rest = tuple(wi - foot * ui for wi, ui in zip(w, u, strict=True))
            gaps[f"{end}b" if rod == "B" else f"a{end}"] = distances.norm(rest) - r - t
            side = w[0] * u[1] - w[1] * u[0]
            ways[f"left{end}"], ways[f"right{end}"] = side, -side
        return gaps, ways


def _turn_a(q: Array) -> Array:
    moved: Array = q + np.array([0.0, 0.0, math.pi, 0.0])
    return moved


def _turn_b(q: Array) -> Array:
    moved: Array = q + np.array([0.0, 0.0, 0.0, math.pi])
    return moved


def _exchange(q: Array) -> Array:
    moved: Array = q[..., [0, 1, 3, 2]] * np.array([-1.0, -1.0, 1.0, 1.0])
    return moved


def _mirror_across(q: Array) -> Array:
    moved: Array = q * np.array([-1.0, 1.0, -1.0, -1.0])
    return moved


def _mirror_along(q: Array) -> Array:
    moved: Array = q * np.array([1.0, -1.0, -1.0, -1.0]) + np.array([0.0, 0.0, math.pi, math.pi])
    return moved
