"""Local minima between two energies: corners with more contacts than balls can show to close.

Notation and Lemmas 1 and 2 are those of :mod:`~polycorner.proofs.growth`.

Theorem.  Let ``p`` be a point of ``D`` in the interior of ``N``, let ``gap >= E(p) - E(c) +
delta``, and ``rho < R`` with ``rho = gap / kappa``, or ``(eps + sqrt(eps^2 + 2 sigma gap)) /
sigma``.  If the functions that read ``r`` are positive on ``{|u - c| <= rho} x R'``, there is
``u*`` with ``|u* - c| <= rho`` such that ``(u*, r)`` is a local minimum of ``E`` on ``D`` for every
``r`` inside ``R'``; its energy lies between ``E(c) - delta`` (less ``eps^2 / (2 sigma)``) and
``E(p)``; and every point of ``D`` in ``N`` with ``|u - c| > rho`` has more energy than ``p``.

*Proof.*  ``D`` in ``N`` is compact and contains ``p``; let ``E`` be least there at ``(u*, r0)``.
The lemma gives ``|u* - c| <= rho < R``.  Any ``r`` in ``R'`` may replace ``r0``: functions that
read it are positive, the others and ``E`` do not change.

Nothing else (first order).  Let ``Z`` be the functions not shown to be positive on ``N``, none of
which reads ``r``, and ``w`` a direction that all equations annihilate with ``g_i w >= eta_i > 0``
on ``Z``; ``T >= max(e w, 0)``; ``h_i``, ``h_E`` sums of the entries of Hessians; ``M = h_E + T max
h_i / eta_i + sum |mu_j| h_j`` with bounds of ``mu`` that ``e`` and ``G`` give.  With ``pi = |p -
c|``, let ``phi(x) = kappa x - gap - M (x + pi)^2 / 2`` be positive at ``x0`` and at ``R1 <= R``.
Then every stationary point of ``E`` on ``D`` in ``|u - c| <= R1`` has ``|u - c| < x0``.

*Proof.*  ``e = sum nu_i g_i + sum mu_j h_j'`` with ``nu >= 0`` on active functions; times ``w``:
``sum nu_i eta_i <= T``.  Taylor's theorem for ``E - nu f - mu h`` between ``q`` and ``p`` gives
``E(q) <= E(p) + M |q - p|^2 / 2``; with Lemma 1 ``phi(|u - c|) <= 0``, but ``phi`` is concave and
positive at both ends.

Strict.  If ``p = c`` and the functions of ``S`` vanish there exactly, then ``gap = rho = 0``: ``c``
is a strict minimum, modulo ``r``, and the only stationary point with ``|u - c| <= R1``.

Unions: ``S`` belongs to every branch that is not excluded on ``N``, and ``p`` lies in one; nothing
is said then of other stationary points.  Symmetry: let fields ``xi_k`` annihilate ``E``, the
equations and all functions not positive on ``N``, and let the normals ``n_k`` have a regular matrix
``n_k xi_l`` on ``N``.  Then ``n_k (q - c) = 0`` join ``B``, and the flows of the fields carry every
nearby point to this section; what is said of ``N`` holds on the section.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf

import numpy as np

from polycorner.intervals.balls import (
    Ball,
    ball,
    column,
    decimals,
    dot,
    entries,
    exact,
    identity,
    matrix,
    middle_inverse,
    middles,
    square,
)
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.minimisation import Problem
from polycorner.proofs.exact import implied
from polycorner.proofs.growth import Examination, Growth, largest, row_sums, upper_bound
from polycorner.proofs.invariance import annihilated
from polycorner.proofs.rattlers import reads
from polycorner.proofs.witnesses import UnshownError, Witness, decided, need
from polycorner.values import Value

SUBJECT = "a minimum between two energies"


@dataclass(frozen=True, eq=False)
class BoundedMinimum(Value):
    """A local minimum that is shown to exist, and where.

    Attributes
    ----------
    witness : Witness
        What it was shown from.
    energy : (Fraction, Fraction)
        Bounds of its energy.
    radius : Fraction
        ``rho``: it lies within this distance of the centre, in scale units.
    alone : (Fraction, Fraction) or None
        ``x0`` and ``R1``: all stationary points within ``R1`` lie within ``x0``.
    strict : bool
        Whether it is the centre itself, and strict up to what rattles.
    closed : tuple of int
        Rows of functions that are not shown to be positive near it, and do not support.
    rattling : tuple of int
        Coordinates that rattle.
    """

    witness: Witness
    energy: tuple[Fraction, Fraction]
    radius: Fraction
    alone: tuple[Fraction, Fraction] | None
    strict: bool
    closed: tuple[int, ...]
    rattling: tuple[int, ...]

    def region(self, radius: Fraction, problem: Problem) -> tuple[tuple[Fraction, Fraction], ...]:
        """Return the points whose core lies within a radius, in the room of the rest."""
        sides, loose = [], set(self.rattling)
        for j, (c, s) in enumerate(zip(self.witness.centre, problem.scales.tolist(), strict=True)):
            half = (self.witness.room[j] if j in loose else radius) * Fraction(s)
            sides.append((c - half, c + half))
        return tuple(sides)

    def conditions(self, rows: Sequence[str]) -> dict[str, str]:
        """Return the conditions that are shown, each with a reason."""
        supports = ", ".join(rows[i] for i in self.witness.supports) or "nothing"
        lemma = {
            1: f"gradients of {supports} span, with positive multipliers, on the whole box",
            2: f"second derivatives, stiffened across {supports}, are positive on the whole box",
        }
        above = "the point itself is the corner, by exact algebra"
        if not self.strict:
            width = number_of(self.energy[1] - self.energy[0])
            above = f"a point of the set has an energy at most {width} above the lower bound"
        found = {"energy bounded from below": lemma[self.witness.order], "inner point": above}
        if self.closed:
            some = ", ".join(rows[i] for i in self.closed)
            found["inner point"] += f"; {some} may vanish there as well"
        if self.alone:
            inner, outer = (number_of(x) for x in self.alone)
            where = "is the point" if self.strict else f"lies within {inner} scale units of it"
            found["nothing else"] = (
                f"every stationary point within {outer} scale units of the centre {where}"
                f"{', as far as the others are in their room' if self.rattling else ''}"
            )
        return found


def number_of(x: Fraction) -> str:
    """Return an upper bound of a number in three digits."""
    return decimals(x, x, 3)[1]


def examine(problem: Problem, formulas: Formulas, witness: Witness) -> "BoundedMinimum | Undecided":
    """Return the minimum that a witness shows, or the hypothesis that is not shown.

    ``formulas`` are those of the inequalities, the equations and the energy, in this order.
    """
    try:
        return _examined(Examination(problem, formulas, witness))
    except UnshownError as error:
        return Undecided(SUBJECT, str(error))


def _examined(about: Examination) -> BoundedMinimum:
    _check_box(about)
    w = about.witness
    growth = about.growth
    energy = about.central[0][-1]
    strict = w.order == 1 and about.is_corner
    inner = about.at_centre if strict else about.inner_box()
    away = about.away(inner)
    free = all(
        abs(inner.hull[j] - ball(w.centre[j])) < ball(w.room.get(j, Fraction(0))) * about.scales[j]
        for j in about.rattling
    )
    near = strict or (away < ball(w.reach) and free)
    need(near, "the inner point is not shown to lie inside the box")
    need(strict or about.lies_in(inner), "the inner point is not shown to lie in the set")
    (above,) = about.formulas.values(inner, [about.energy_row])
    gap = ball(0) if strict else upper_bound((above - energy + growth.delta).max(ball(0)))
    radius = ball(0) if strict else upper_bound(growth.radius(gap))
    far = f"the minimum is not shown to be closer than the sides of the box, {radius.str(3)}"
    need(radius < ball(w.reach), far)
    _check_room(about, radius)
    alone = _alone(about, growth, gap, ball(0) if strict else upper_bound(away))
    below = energy if strict else energy - growth.slack
    return BoundedMinimum(
        witness=w,
        energy=(exact(below.lower()), exact((energy if strict else above).upper())),
        radius=exact(radius.upper()),
        alone=alone,
        strict=strict,
        closed=about.closed,
        rattling=about.rattling,
    )


def _check_box(about: Examination) -> None:
    """Check the hypotheses on functions and symmetries over the whole box."""
    w, problem = about.witness, about.problem
    for scale, period in zip(about.scales, problem.polyhedron.manifold.periods, strict=True):
        half = ball(period / 2 if period < inf else 1e300)
        need(ball(2 * w.reach) * scale < half, "the box is half a period wide")
    need(about.pieces, "the set does not meet the box")
    every = frozenset.intersection(*about.pieces)
    asked = set(w.supports) <= every
    need(asked, "functions that support are not asked for by every branch, or positive on the box")
    m = problem.inequalities
    for row in range(m, m + len(problem.polyhedron.equations)):
        if row not in w.equations and not implied(about.formulas, w.equations, row):
            msg = f"the equation {about.formulas.names[row]} is not shown to follow from the others"
            raise UnshownError(msg)
    if w.gauges:
        vectors = []
        for gauge in w.gauges:
            if not all(annihilated(about.forms, gauge.field)):
                msg = f"exact algebra does not show that nothing changes along {gauge.field}"
                raise UnshownError(msg)
            vectors.append(decided(gauge.field.at(about.whole.hull)))
        normals = [[ball(x) for x in gauge.normal] for gauge in w.gauges]
        table = matrix([[dot(normal, v) for v in vectors] for normal in normals])
        inverse = middle_inverse(table.tolist())
        crosses = inverse is not None and row_sums(identity(len(vectors)) - inverse * table) < 1
        need(crosses, "symmetries are not shown to cross the section")


def _check_room(about: Examination, radius: "Ball") -> None:
    """Check that functions that read what rattles are positive near the minimum."""
    rattling = set(about.rattling)
    others = [
        i
        for i, sign in enumerate(about.signs)
        if sign <= 0 and reads(about.formulas, i) & rattling
    ]  # fmt: skip
    values = about.formulas.values(about.box(radius), others)
    for i, value in zip(others, values, strict=True):
        need(value > 0, f"{about.formulas.names[i]} is not shown to leave room to what rattles")


def _alone(
    about: Examination, growth: Growth, gap: "Ball", away: "Ball"
) -> tuple[Fraction, Fraction] | None:
    """Return ``x0`` and ``R1`` of the theorem, or None where it says nothing."""
    w = about.witness
    supports, k = len(w.supports), len(w.equations)
    rattling = set(about.rattling)
    if w.order != 1 or about.problem.polyhedron.is_union:
        return None
    if any(reads(about.formulas, i) & rattling for i in about.closed):
        return None
    gradients, hessians = about.gradients, about.hessians
    slope = column([ball(w.direction[j]) for j in about.core])
    sums = [sum((abs(x) for row in h for x in row), ball(0)) for h in hessians]
    first = [*gradients[:supports], *gradients[supports + k :]]
    bends = [*sums[:supports], *sums[supports + k :]]
    rates = entries(matrix(first) * slope)
    pulls = [ball(0)] * k
    if k:
        equations = matrix(gradients[supports : supports + k])
        middle = middles(equations.tolist())
        y = matrix(np.linalg.pinv(middle).tolist())
        try:
            back = (equations * y).inv()
        except ZeroDivisionError:
            return None
        through = matrix(first) * y * back
        rates = entries(matrix(first) * slope - through * (equations * slope))
    pull = rates[-1].max(ball(0)).upper()
    if not all(rate > 0 for rate in rates[:-1]):
        return None
    ratios = [b / rate for b, rate in zip(bends[:-1], rates[:-1], strict=True)]
    curvature = bends[-1] + pull * largest(ratios)
    for j in range(k):
        shares = [abs(through[i, j]) / rates[i] for i in range(len(first) - 1)]
        pulls[j] = abs(through[len(first) - 1, j]) + pull * largest(shares)
        curvature += pulls[j] * sums[supports + j]
    curvature = upper_bound(curvature)

    def phi(x: "Ball") -> bool:
        return bool(growth.kappa * x - gap - curvature * square(x + away) / 2 > 0)

    inner = next((x for x in _ladder(gap / growth.kappa, w.reach) if phi(x)), None)
    if inner is None:
        return None
    outer = ball(w.reach)
    for _ in range(60):
        if phi(outer):
            return (Fraction(0) if not gap > 0 else exact(inner.upper())), exact(outer.lower())
        outer = outer * ball(0.9)
    return None


def _ladder(start: "Ball", reach: Fraction) -> "list[Ball]":
    """Return distances from a little above ``start`` on."""
    if not start > 0:
        return [ball(reach) * ball(2) ** -200]
    found: list[Ball] = []
    x = start * ball(1.01)
    while x < ball(reach) and len(found) < 200:
        found.append(x.upper())
        x = x * 2
    return found
