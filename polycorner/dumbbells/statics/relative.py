"""Relative placements of two dumbbells, in the plane and in the drum, for complete lists.

Motions of the whole pair preserve the polyhedron ``D``: translations of the plane, or rolling and
shifting in the drum.  Shifts along the axis preserve the energy as well.  When the pair rolls by
``s`` the energy is ``-K d cos(s - s0)`` up to a constant, with the distance ``d`` of the centre of
mass from the axis of the drum: at a local minimum ``s = s0``, the centre of mass is straight below
the axis.  The local minima of the pair are those of

    E = 2 (rho^2 - d^2)

on its placements up to rolling and shifts, which have four coordinates: A at azimuth ``-x`` and B
at ``x``, at ``-y/2`` and ``y/2`` along the axis, with headings ``alpha`` and ``beta``.  In the
plane, the limit of large drums, ``x`` is a length, the centre of mass lies on the lowest line, and
``E`` is half the sum of squared lateral positions of the four balls.

Dumbbells whose centres are more than ``l + 2 r`` apart do not touch.  Each of them is then a local
minimum by itself only on the lowest line and along it: ``x = 0`` and the headings are multiples of
half a turn, for all ``y``.  What remains is compact.

**Rods.**  Let every end of a rod be at least ``p = r + t`` from the axis of the other one, and let
``e`` be vertical at the mean azimuth.  Then the axes are nearer than ``2 t`` if and only if they
cross, seen along ``e``:

*   Where they cross or touch, the two points that are seen as one lie between the cylinders on
    which the balls and the middles of the longest chords are.  One is at most
    ``h = l^2 / (8 sqrt(rho^2 - l^2/4 - w^2))`` above the other, at a distance ``w`` from the mean
    azimuth's vertical plane.  It is required that ``h < 2 t``.
*   If they are nearer than ``2 t``, they are so at interior points ``P`` and ``Q``, because
    ``p > 2 t``, and ``PQ``, of length ``d``, is orthogonal to both.  They are not parallel, or they
    were as near at an end.  Let ``g`` be their angle, with directions such that ``cos g >= 0``.  On
    each side of ``PQ`` let ``k`` be the shorter arm to an end.  The foot of its end lies within the
    other rod, thus ``d^2 + k^2 sin(g)^2 >= p^2``: all four arms are at least ``a / sin g`` with
    ``a = sqrt(p^2 - 4 t^2)``, and ``sin g >= 2 a / l``.  Both axes are orthogonal to ``e`` up to
    ``|sin x|``, so that ``e`` and ``PQ`` make an angle ``f`` with
    ``sin f <= 2 |sin x| / sin g <= l |sin x| / a``.  Seen along ``e``, the lines cross at most
    ``d tan f / sin g`` from ``P`` and ``Q``, which is within the rods if ``2 t tan f < a``, as is
    required.

In the plane ``h = 0`` and ``f = 0``.  Axes do not cross where both ends of one are on one side of
the line through the other, or the centres are ``l`` apart: closed conditions that are smooth, also
for parallel rods, where the distance of the rods is not.  Of two dumbbells that do not overlap one
of them holds strictly, so that corners are made of contacts alone.
"""

import math
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.formulas import Family, SmoothFunction
from polycorner.polyhedra import AllOf, AnyOf, Element, Polyhedron, Symmetry
from polycorner.spaces import Manifold
from polycorner.toolkit import Array, Checked, cached_property, checks, dot, minus, norm

if TYPE_CHECKING:
    import sympy

DIGITS = 50  # of heights, before they are rounded
MARGIN = 1.05  # sides of the box over the reach of contacts


def height_of(pair: DumbbellPair, energy: float) -> float:
    """Return the height of a pair with an energy; see :meth:`RelativePlacements.height`."""
    most = math.inf if pair.is_plane else 2 * pair.centre_radius**2
    value = checks.real("energy", energy, most=most, unit="mm^2")
    weights = Fraction(4) + 2 * Fraction(pair.rod_weight)
    if pair.is_plane:
        return float(weights * Fraction(value) / 4)
    with localcontext(prec=DIGITS):
        rho, half = Decimal(pair.centre_radius), Decimal(value) / 2
        lower = half / (rho + max(rho * rho - half, Decimal(0)).sqrt())
        return float(Fraction(lower) * weights)


@dataclass(frozen=True)
class RelativePlacements(Checked):
    """Two equal dumbbells up to rolling and shifts; see the module.

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells, in the plane or in a drum.  The weight of the rods moves no minimum.

    Raises
    ------
    TypeError, ValueError
        If that is no pair, or its rods are so thin that one can lie across the other in the drum.
    """

    pair: DumbbellPair

    def __post_init__(self) -> None:
        checks.instance("pair", self.pair, DumbbellPair)
        if not self._rods_cross_seen_from_above():
            expected = "rods too thick to lie across each other in the drum"
            checks.refuse("pair", expected, self.pair)

    @property
    def reach(self) -> float:
        """Bound of ``|x|`` of placements in contact, with a margin; in mm or rad."""
        apart = MARGIN * (self.pair.length + 2 * self.pair.ball_radius) / 2
        if self.pair.is_plane:
            return apart
        return math.asin(min(1.0, apart / self._least_depth))

    @property
    def _least_depth(self) -> float:
        """Least distance of a dumbbell's centre from the axis of the drum, in mm."""
        return math.sqrt(self.pair.centre_radius**2 - self.pair.length**2 / 4)

    def _rods_cross_seen_from_above(self) -> bool:
        """Whether the two requirements of the module hold."""
        if self.pair.is_plane:
            return True
        rho, t = self.pair.centre_radius, self.pair.rod_radius
        seen = self.reach + math.asin(self.pair.length / (2 * rho))
        if seen >= math.pi / 2:
            return False
        below = self._least_depth**2 - (rho * math.sin(seen)) ** 2
        if below <= 0 or self.pair.length**2 / (8 * math.sqrt(below)) >= 2 * t:
            return False
        a = math.sqrt((self.pair.ball_radius + t) ** 2 - 4 * t**2)
        sine = self.pair.length * math.sin(self.reach) / a
        return sine < 1 and 2 * t * math.tan(math.asin(sine)) < a

    @cached_property
    def manifold(self) -> Manifold:
        """Coordinates ``x`` in mm, or in rad in the drum, ``y`` in mm, headings in rad."""
        r, turn, plane = (
            self.pair.ball_radius,
            2 * self.pair.ball_radius / self.pair.length,
            self.pair.is_plane,
        )
        scales = (r if plane else r / self.pair.centre_radius, r, turn, turn)
        units = ("mm" if plane else "rad", "mm", "rad", "rad")
        periods = (math.inf, math.inf, math.tau, math.tau)
        return Manifold(("x", "y", "alpha", "beta"), periods, scales, units)

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """Four ball-ball and four ball-rod gaps, and five ways for the rods not to cross."""
        gaps, ways = self._formulas()
        names, values = zip(*self.parameters.items(), strict=True)
        family = Family.of(gaps | ways, self.manifold.names, names)
        functions = {
            name: SmoothFunction.member(family, name, self.manifold, parameters=values)
            for name in family.names
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

    @property
    def parameters(self) -> dict[str, float]:
        """The sizes in the formulas by name: ``l``, ``r``, ``t``, and ``rho`` in the drum."""
        sizes = {"l": self.pair.length, "r": self.pair.ball_radius, "t": self.pair.rod_radius}
        return sizes if self.pair.is_plane else sizes | {"rho": self.pair.centre_radius}

    @cached_property
    def energy(self) -> SmoothFunction:
        """``2 (rho^2 - d^2)``, half the sum of squared lateral positions in the plane, in mm^2."""
        import sympy

        x, _, alpha, beta = self.manifold.symbols
        length, rho = sympy.symbols("l rho")
        if self.pair.is_plane:
            sines = sympy.sin(alpha) ** 2 + sympy.sin(beta) ** 2
            formula = 2 * x**2 + length**2 / 4 * sines
        else:
            (s, c), (u, d) = _half_chord(alpha), _half_chord(beta)
            formula = rho**2 * (1 - c * d + (s**2 + u**2) / 2 + 2 * c * d * sympy.sin(x) ** 2)
        known = {str(symbol) for symbol in formula.free_symbols}
        sizes = {name: value for name, value in self.parameters.items() if name in known}
        return SmoothFunction("trough", formula, self.manifold, parameters=sizes, unit="mm^2")

    def height(self, energy: float) -> float:
        """Return how much higher a pair hangs than one on the lowest line, in mm times a weight.

        The height of balls and rods, in mm times the weight of a ball, with the centre of mass
        below the axis: ``K (rho - d)``, where ``d^2 = rho^2 - E/2`` and ``K`` is 4 and the weights
        of both rods.  Correct to within the last bit.  In the plane the limit of ``rho`` times
        that, ``K E / 4``, in mm^2.

        Parameters
        ----------
        energy : float
            A value of :attr:`energy`, in mm^2.

        Raises
        ------
        ValueError
            For a centre of mass above the axis.
        """
        return height_of(self.pair, energy)

    def energy_at(self, height: float) -> float:
        """Return the energy of a :meth:`height`, to within rounding.

        Parameters
        ----------
        height : float
            In mm times the weight of a ball, at most that of a centre of mass on the axis; in the
            plane in mm^2.
        """
        pair = self.pair
        weights = 4 + 2 * pair.rod_weight
        if pair.is_plane:
            return 4 * checks.real("height", height, unit="mm^2") / weights
        most = weights * pair.centre_radius
        up = checks.real("height", height, most=most, unit="mm") / weights
        return 2 * up * (2 * pair.centre_radius - up)

    @property
    def box(self) -> dict[str, tuple[float, float]]:
        """Sides of a box that contains all placements in contact; headings are unrestricted."""
        apart = MARGIN * (self.pair.length + 2 * self.pair.ball_radius)
        return {"x": (-self.reach, self.reach), "y": (-apart, apart)}

    @cached_property
    def symmetry(self) -> Symmetry:
        """Half-turns of each dumbbell, their exchange, and the mirror images in both axes."""
        maps = (_turn_a, _turn_b, _exchange, _mirror_across, _mirror_along)
        return Symmetry(elements=tuple(Element(apply, {}) for apply in maps))

    @cached_property
    def rotations(self) -> Symmetry:
        """Rotations of the plane about the middle of the centres, which preserve all contacts.

        Raises
        ------
        ValueError
            In a drum.
        """
        if not self.pair.is_plane:
            checks.refuse("pair", "a pair in the plane, where rotations are symmetries", self.pair)
        x, y = self.manifold.symbols[:2]
        return Symmetry(fields=({"x": y / 2, "y": -2 * x, "alpha": 1, "beta": 1},))

    def placement(self, q: ArrayLike) -> Array:
        """Return the placement ``(..., 6)`` of the pair."""
        x, y, alpha, beta = np.moveaxis(self.manifold.points(q), -1, 0)
        return np.stack([-x, -y / 2, alpha, x, y / 2, beta], axis=-1)

    def _formulas(self) -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
        """Return the gaps, and the functions whose signs say that the rods do not cross."""
        import sympy

        length, r, t = sympy.symbols("l r t")
        half = length / 2
        centre, axis = self._axes()
        ends = {
            f"{k}{i}": tuple(c + side * half * u for c, u in zip(centre[k], axis[k], strict=True))
            for k in "AB"
            for i, side in ((1, -1), (2, 1))
        }
        gaps: dict[str, Any] = {}
        for a in ("A1", "A2"):
            for b in ("B1", "B2"):
                gaps[a + b] = norm(minus(ends[a], ends[b])) - 2 * r
        apart = minus(centre["B"], centre["A"])
        ways: dict[str, Any] = {"apart": apart[0] ** 2 + apart[1] ** 2 - length**2}
        for end, point in ends.items():
            rod = "B" if end[0] == "A" else "A"
            w, u = minus(point, centre[rod]), axis[rod]
            along = dot(w, u)
            foot = (sympy.Abs(along + half) - sympy.Abs(along - half)) / 2  # clamped to the rod
            rest = tuple(wi - foot * ui for wi, ui in zip(w, u, strict=True))
            gaps[f"{end}b" if rod == "B" else f"a{end}"] = norm(rest) - r - t
            side = w[0] * u[1] - w[1] * u[0]
            ways[f"left{end}"], ways[f"right{end}"] = side, -side
        return gaps, ways

    def _axes(self) -> "tuple[dict[str, Any], dict[str, Any]]":
        """Return centres and unit axes: across, along, and up at the mean azimuth."""
        import sympy

        x, y, alpha, beta = self.manifold.symbols
        centre, axis = {}, {}
        for k, sign, heading in (("A", -1, alpha), ("B", 1, beta)):
            across, along = sympy.sin(heading), sympy.cos(heading)
            if self.pair.is_plane:
                centre[k] = (sign * x, sign * y / 2, sympy.S.Zero)
                axis[k] = (across, along, sympy.S.Zero)
            else:
                depth = sympy.Symbol("rho") * _half_chord(heading)[1]
                sine, cosine = sign * sympy.sin(x), sympy.cos(x)
                centre[k] = (depth * sine, sign * y / 2, -depth * cosine)
                axis[k] = (across * cosine, along, across * sine)
        return centre, axis


def _half_chord(heading: "sympy.Expr") -> "tuple[sympy.Expr, sympy.Expr]":
    """Return sine and cosine of half the angle that a dumbbell's balls subtend."""
    import sympy

    length, rho = sympy.symbols("l rho")
    sine = length / (2 * rho) * sympy.sin(heading)
    return sine, sympy.sqrt(1 - sine**2)


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
