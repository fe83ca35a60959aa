"""KKT equations of a face as a square system in balls, and Newton's method for them.

Unknowns are ``z = (q, lam, nu)``: the point, the multipliers of the active functions and
equations, and one multiplier for every gauge.  The equations are

- ``dE - sum lam_i df_i - sum nu_k n_k = 0``,
- ``f_i = 0`` for the active functions and the equations of the set,
- ``n_k (q - q0) = 0`` for the gauges.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING

from polycorner.intervals.balls import (
    ball,
    column,
    dot,
    entries,
    middle_inverse,
    midpoints,
    precision,
    square,
)
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

FIRST_BITS = 128  # precision at which Newton's method starts; it then doubles
MOST_STEPS = 25
SUBJECT = "the KKT equations"


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Enclosures of the equations and their derivatives on a box.

    Attributes
    ----------
    residual : list of Ball
        The left-hand sides, ``[N]``.
    jacobian, drift : list of list of Ball
        Their derivatives by the unknowns ``[N][N]`` and by the parameters ``[N][p]``.
    energy : Ball
        The energy.
    rows : list of list of Ball
        Gradients of the active functions and equations, then the gauges, ``[m][n]``.
    curvature : list of list of Ball
        The Lagrangian's Hessian, ``[n][n]``.
    forms : SmoothForms
        Active functions, equations and energy, smooth on the box.
    """

    residual: "list[Ball]"
    jacobian: "list[list[Ball]]"
    drift: "list[list[Ball]]"
    energy: "Ball"
    rows: "list[list[Ball]]"
    curvature: "list[list[Ball]]"
    forms: SmoothForms


@dataclass(frozen=True, eq=False)
class KKTSystem:
    """The KKT equations of one face; see the module.

    Attributes
    ----------
    formulas : Formulas
        Inequalities, equations and energy of the problem, in this order.
    held : tuple of int
        The active functions, then the equations, as rows of ``formulas``.
    gauges : tuple of tuple of float
        The normals ``n_k``.
    anchor : tuple of float
        The point ``q0``.
    units : tuple of float
        Unit of each unknown: the scales of the coordinates, then the multipliers with which the
        gradient of a function is as large as that of the energy.
    """

    formulas: Formulas
    held: tuple[int, ...]
    gauges: tuple[tuple[float, ...], ...]
    anchor: tuple[float, ...]
    units: tuple[float, ...]

    @property
    def dimension(self) -> int:
        """The number of coordinates ``n``."""
        return self.formulas.dimension

    @property
    def scales(self) -> tuple[float, ...]:
        """The units of the coordinates."""
        return self.units[: self.dimension]

    @property
    def size(self) -> int:
        """The number of unknowns ``N``."""
        return self.dimension + len(self.held) + len(self.gauges)

    def at(self, z: "Sequence[Ball]", p: "Sequence[Ball]" = ()) -> Linearisation | Undecided:
        """Return the equations and their derivatives on boxes of unknowns and parameters."""
        return self.linear(z, Box([*z[: self.dimension], *p]))

    def linear(self, z: "Sequence[Ball]", box: Box) -> Linearisation | Undecided:
        """Return the same for a point and parameters that are enclosed jointly by ``box``."""
        n, k = self.dimension, len(self.held)
        forms = self._smooth(box)
        if isinstance(forms, Undecided):
            return forms
        values, gradients, hessians = forms.evaluate(box, 2)
        weights = [*(-lam for lam in z[n : n + k]), ball(1)]
        normals = [[ball(x) for x in gauge] for gauge in self.gauges]
        bent = [_combined(weights, [h[i] for h in hessians]) for i in range(n)]
        slope = _combined(weights, [g[:n] for g in gradients])
        for nu, normal in zip(z[n + k :], normals, strict=True):
            slope = [u - nu * v for u, v in zip(slope, normal, strict=True)]
        away = [q - a for q, a in zip(z[:n], self.anchor, strict=True)]
        rows = [*(g[:n] for g in gradients[:k]), *normals]
        no_rows, no_drift = [ball(0)] * len(rows), [ball(0)] * (self.formulas.inputs - n)
        return Linearisation(
            residual=[*slope, *values[:k], *(dot(normal, away) for normal in normals)],
            jacobian=[
                *([*bent[i][:n], *(-row[i] for row in rows)] for i in range(n)),
                *([*row, *no_rows] for row in rows),
            ],
            drift=[
                *(row[n:] for row in bent),
                *(g[n:] for g in gradients[:k]),
                *(no_drift for _ in normals),
            ],
            energy=values[k],
            rows=rows,
            curvature=[row[:n] for row in bent],
            forms=forms,
        )

    def bend(
        self, z: "Sequence[Ball]", tangents: "Sequence[Sequence[Ball]]", box: Box
    ) -> "list[Ball] | Undecided":
        """Return the second-order remainder of the equations along a predictor.

        On the predictor, enclosed by ``z`` and ``box``, the unknowns have constant derivatives
        ``tangents`` by ``delta``.  The result encloses ``1/2 sum_ab d_a d_b F delta_a delta_b``.
        """
        n, k, count = self.dimension, len(self.held), len(box.reach)
        forms = self._smooth(box)
        if isinstance(forms, Undecided):
            return forms
        turned, bent = forms.slopes(box)
        weights = [*(-lam for lam in z[n : n + k]), ball(1)]
        growth = [*([-t for t in row] for row in tangents[n : n + k]), [ball(0)] * count]
        total = [ball(0)] * self.size
        for a, b, share in _pairs(box.reach):
            along = [*(row[a] for row in tangents[:n]), *(ball(int(a == c)) for c in range(count))]
            for i in range(n):
                second = [dot([x[b] for x in bent[r][i]], along) for r in range(k + 1)]
                first = [turned[r][i] for r in range(k + 1)]
                cross = [growth[r][a] * first[r][b] + growth[r][b] * first[r][a] for r in range(k)]
                total[i] += share * sum(cross, dot(weights, second))
            for r in range(k):
                total[n + r] += share * dot([x[b] for x in turned[r]], along)
        return total

    def _smooth(self, box: Box) -> SmoothForms | Undecided:
        return self.formulas.smooth(box, (*self.held, len(self.formulas.names) - 1))


def _combined(weights: "Sequence[Ball]", rows: "Sequence[Sequence[Ball]]") -> "list[Ball]":
    return [dot(weights, entry) for entry in zip(*rows, strict=True)]


def _pairs(reach: "Sequence[Ball]") -> "Iterator[tuple[int, int, Ball]]":
    """Return pairs ``a <= b`` with the factor of ``d_a d_b`` in half a quadratic form."""
    for a, b in combinations_with_replacement(range(len(reach)), 2):
        yield a, b, square(reach[a]) / 2 if a == b else reach[a] * reach[b]


def newton(
    system: KKTSystem,
    z: "Sequence[Ball]",
    p: "Sequence[Ball]" = (),
    *,
    bits: int,
    steps: int = MOST_STEPS,
) -> "list[Ball] | Undecided":
    """Return an approximate solution near ``z``, correct to nearly ``bits`` binary digits.

    Precision is doubled as steps converge, and where they do not: the equations may be singular to
    a few digits only.
    """
    working = min(bits, FIRST_BITS)
    while True:
        with precision(working):
            found = _settled(system, z, p, ball(2) ** (-working // 2), steps)
        if working >= bits:
            return found
        z = z if isinstance(found, Undecided) else found
        working = min(2 * working, bits)


def _settled(
    system: KKTSystem, z: "Sequence[Ball]", p: "Sequence[Ball]", small: "Ball", steps: int
) -> "list[Ball] | Undecided":
    """Take Newton steps until one is relatively small, then one more."""
    last = False
    for _ in range(steps):
        linear = system.at(z, p)
        if isinstance(linear, Undecided):
            return linear
        backwards = middle_inverse(linear.jacobian)
        if backwards is None:
            return Undecided(SUBJECT, "their Jacobian is singular")
        step = midpoints(entries(backwards * column(linear.residual)))
        if not all(dx.is_finite() for dx in step):
            return Undecided(SUBJECT, "Newton's method left the domain of the functions")
        z = midpoints([x - dx for x, dx in zip(z, step, strict=True)])
        if last:
            return list(z)
        sizes = zip(step, system.units, strict=True)
        last = all(abs(dx) <= small * unit for dx, unit in sizes)
    return Undecided(SUBJECT, "Newton's method found no solution near the point")
