"""Local minima between two energies: corners with more contacts than balls can show to close.

Whether a redundant contact closes exactly cannot be decided by enclosures, and need not be.  Let
``D = {f_i >= 0, h_j = 0}``, ``S`` some inequalities, ``B`` some equations, and let the *core* ``u``
be the coordinates that the energy ``E``, ``S`` or ``B`` read; the others, ``r``, rattle.  Lengths
are in scale units, and ``|.|`` is the largest entry.  ``U`` is the box ``|u - c| <= R``, ``R'`` a
box of ``r``, and ``N = U x R'``.  The gradients of ``S`` and ``B``, the rows of ``G``, and that of
``E``, which is ``e``, are enclosed over ``N``, on which these functions are smooth; ``lam`` are
weights, positive on ``S``.

Lemma 1 (gradients that span).  Let ``P`` be any matrix with ``|I - G^T P| = k < 1`` (row sums),
``t = k / (1 - k)``, ``s = e - G^T lam``, and let the enclosures ``m = lam + P (s +- t |s|)`` be
positive on ``S``.  With ``P'_ia = |P_ia| + t sum_b |P_ib|`` and
``kappa = min m_i / P'_ia`` over ``S`` and all ``a``,

``E(q) >= E(c) - delta + kappa |u - c|`` on ``{f_S >= 0, h_B = 0}`` in ``N``,

``delta = sum_S 2 m_i max(f_i(c), 0) + sum_B (|m_j| + kappa max_a P'_ja) |h_j(c)|``.

*Proof.*  For ``d = u - c`` mean values give ``f(u) = f(c) + G~ d`` and ``E(u) = E(c) + e~ d`` with
``G~`` and ``e~`` in the enclosures.  For a vector ``v`` whose entries add up to at most ``kappa``,
``w = lam + P (G~^T P)^-1 (e~ - G~^T lam - v)`` solves ``G~^T w = e~ - v``, and on ``S`` it lies
between 0 and ``2 m``, since ``(G~^T P)^-1 - I`` has row sums of at most ``t``.  So
``e~ d - v d = sum w_i (f_i(u) - f_i(c)) >= -delta``; take ``v = kappa sign(d_a)`` at the largest
``|d_a|``.

Lemma 2 (second order).  Let ``H`` be the Hessian of ``L = E - sum lam_i f_i - sum mu_j h_j``,
``F_i`` a bound of ``f_i`` on ``U``, ``w_i = lam_i / F_i`` on ``S`` and any ``w_j > 0`` on ``B``.
If ``H + sum w_i g_i g_i^T - sigma I`` is positive definite for all enclosed matrices, then there,
with Euclidean norms and ``eps >= |dL(c)|``,

``E(q) >= E(c) - delta - eps |d| + sigma |d|^2 / 2``,
``delta = sum |lam_i f_i(c)| + w_i f_i(c)^2``.

*Proof.*  From ``0 <= f_i <= F_i`` follows
``lam_i f_i >= w_i f_i^2 >= w_i ((g~ d)^2 / 2 - f_i(c)^2)``; expand ``L`` at ``c``.

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
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.intervals.balls import (
    ball,
    column,
    decimals,
    dot,
    entries,
    exact,
    identity,
    matrix,
    middle_inverse,
    square,
)
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Problem
from polycorner.polyhedra.polyhedron import Piece
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.definite import pivots
from polycorner.proofs.exact import implied
from polycorner.proofs.invariance import Generator, annihilated
from polycorner.proofs.rattlers import reads
from polycorner.proofs.symbols import Symbols, evaluate
from polycorner.values import Value, cached_property

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball, Matrix
    from polycorner.spaces.manifold import Array

Point = tuple[Fraction, ...]
SUBJECT = "a minimum between two energies"


class UnshownError(Exception):
    """A hypothesis that is not shown, in a sentence."""


@dataclass(frozen=True, eq=False)
class Gauge(Value):
    """A symmetry and the section that it crosses: a field and a normal in coordinates."""

    field: Generator
    normal: Point


@dataclass(frozen=True, eq=False)
class Witness(Value):
    """What a claim is made from; nothing of it is taken on trust.

    Attributes
    ----------
    order : int
        Which lemma is applied, 1 or 2.
    centre : tuple of Fraction
        The point ``c``; at coordinates that rattle the middle of their room.
    inner : tuple of Fraction
        The point ``p``, up to coordinates that the equations determine.
    supports, equations : tuple of int
        Rows of ``S`` and of the equations in ``B``.
    weights : tuple of Fraction
        ``lam`` on ``S``, then on the equations.
    reach : Fraction
        ``R``, in scale units.
    room : mapping from int to Fraction
        Half sides of ``R'`` in scale units, by coordinates.
    direction : tuple of Fraction
        ``w``, in scale units.
    gauges : tuple of Gauge
        Symmetries modulo which the minimum is one.
    """

    order: int
    centre: Point
    inner: Point
    supports: tuple[int, ...]
    equations: tuple[int, ...]
    weights: Point
    reach: Fraction
    room: dict[int, Fraction]
    direction: Point
    gauges: tuple[Gauge, ...] = ()


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


@dataclass(frozen=True, eq=False)
class _Growth:
    """A lower bound ``E(c) - delta - eps |d| + kappa |d|``, or with ``sigma |d|^2 / 2``."""

    delta: "Ball"
    kappa: "Ball"
    sigma: "Ball"
    eps: "Ball"

    def radius(self, gap: "Ball") -> "Ball":
        """Return the distance from the centre beyond which the energy exceeds ``E(p)``."""
        if self.sigma > 0:
            return (self.eps + (square(self.eps) + 2 * self.sigma * gap).sqrt()) / self.sigma
        return gap / self.kappa

    @property
    def slack(self) -> "Ball":
        """How far the energy may lie below ``E(c)``."""
        return self.delta + (square(self.eps) / (2 * self.sigma) if self.sigma > 0 else ball(0))


@dataclass(frozen=True, eq=False)
class Examination:
    """Formulas, a witness, and what both say of its box.

    The working precision is set by the caller.
    """

    problem: Problem
    formulas: Formulas
    witness: Witness

    @property
    def energy_row(self) -> int:
        """The row of the energy."""
        return len(self.formulas.names) - 1

    @cached_property
    def core(self) -> tuple[int, ...]:
        """Coordinates that energy, supports, equations or gauges read."""
        w = self.witness
        read = reads(self.formulas, self.energy_row).union(
            *(reads(self.formulas, row) for row in (*w.supports, *w.equations)),
            *(frozenset(j for j, x in enumerate(g.normal) if x) for g in w.gauges),
        )
        return tuple(sorted(read))

    @cached_property
    def rattling(self) -> tuple[int, ...]:
        """The other coordinates."""
        return tuple(j for j in range(self.problem.dimension) if j not in set(self.core))

    @cached_property
    def scales(self) -> "list[Ball]":
        """The scales."""
        return [ball(s) for s in self.problem.scales.tolist()]

    def box(self, radius: "Fraction | Ball") -> Box:
        """Return the points whose core is near the centre, in the room of the rest."""
        w, hull = self.witness, []
        core = set(self.core)
        for j, (c, s) in enumerate(zip(w.centre, self.scales, strict=True)):
            half = radius if j in core else w.room.get(j, Fraction(0))
            hull.append(ball(c) + ball(0, 1) * ball(half) * s)
        return Box(hull)

    @cached_property
    def whole(self) -> Box:
        """``N``."""
        return self.box(self.witness.reach)

    @cached_property
    def at_centre(self) -> Box:
        """The centre."""
        return Box([ball(c) for c in self.witness.centre])

    @cached_property
    def signs(self) -> list[int]:
        """Signs of the inequalities on ``N``; 0 where they are not shown."""
        values = self.formulas.values(self.whole, range(self.problem.inequalities))
        return [1 if v > 0 else -1 if v < 0 else 0 for v in values]

    @cached_property
    def pieces(self) -> list[Piece]:
        """``D`` in ``N`` as a union of functions that have to hold."""
        return self.problem.polyhedron.signs_to_pieces(self.signs)

    @cached_property
    def closed(self) -> tuple[int, ...]:
        """``Z`` without ``S``: functions that may vanish in ``N`` and matter there."""
        held = set(self.witness.supports)
        return tuple(sorted(frozenset().union(*self.pieces) - held))

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """``S``, ``B``, the rest of ``Z``, and the energy."""
        w = self.witness
        return (*w.supports, *w.equations, *self.closed, self.energy_row)

    @cached_property
    def forms(self) -> SmoothForms:
        """These functions, smooth on ``N``."""
        found = self.formulas.smooth(self.whole, self.rows)
        if isinstance(found, Undecided):
            raise UnshownError(str(found))
        return found

    @cached_property
    def gradients(self) -> "list[list[Ball]]":
        """Their gradients on ``N`` by the core, in scale units."""
        return self._scaled(self.forms.evaluate(self.whole, 1)[1])

    @cached_property
    def hessians(self) -> "list[list[list[Ball]]]":
        """Their second derivatives on ``N`` by the core, in scale units."""
        hessians = self.forms.evaluate(self.whole, 2)[2]
        return [
            [[h[i][j] * self.scales[i] * self.scales[j] for j in self.core] for i in self.core]
            for h in hessians
        ]

    @cached_property
    def central(self) -> "tuple[list[Ball], list[list[Ball]]]":
        """Values and gradients at the centre, in scale units."""
        values, gradients = self.forms.evaluate(self.at_centre, 1)
        return values, self._scaled(gradients)

    def _scaled(self, gradients: Any) -> "list[list[Ball]]":
        return [[g[j] * self.scales[j] for j in self.core] for g in gradients]

    @property
    def normals(self) -> "list[list[Ball]]":
        """The normals of the gauges, in scale units."""
        return [
            [ball(g.normal[j]) * self.scales[j] for j in self.core] for g in self.witness.gauges
        ]

    @property
    def held(self) -> int:
        """The number of functions in ``S`` and ``B``, without gauges."""
        return len(self.witness.supports) + len(self.witness.equations)

    @cached_property
    def weights(self) -> "list[Ball]":
        """``lam``; gauges have none."""
        given = [ball(x) for x in self.witness.weights]
        return [*given, *[ball(0)] * len(self.witness.gauges)]

    # ------------------------------------------------------------------------------- the lemmas

    @cached_property
    def growth(self) -> "_Growth":
        """The lower bound that the lemma of the witness gives."""
        return self._spread() if self.witness.order == 1 else self._bent()

    def _spread(self) -> "_Growth":
        """Return the growth that Lemma 1 gives."""
        gradients = self.gradients
        values, around = self.central
        rows = [*gradients[: self.held], *self.normals]
        supports, size = len(self.witness.supports), len(self.core)
        if not supports or len(rows) < size:
            msg = "the gradients of the functions that support do not span"
            raise UnshownError(msg)
        middle = np.array(
            [[float(x.mid()) for x in row] for row in (*around[: self.held], *self.normals)]
        )
        if not np.isfinite(middle).all():
            msg = "gradients are not finite"
            raise UnshownError(msg)
        p = matrix(np.linalg.pinv(middle.T).tolist())
        across = matrix(rows).transpose()
        defect = _row_sums(identity(size) - across * p)
        if not defect < 1:
            msg = "the gradients of the functions that support are not shown to span on the box"
            raise UnshownError(msg)
        t = defect / (1 - defect)
        slope = gradients[-1]
        rest = entries(column(slope) - across * column(self.weights))
        largest = _largest(rest)
        wide = [x + ball(0, 1) * t * largest for x in rest]
        shares = entries(p * column(wide))
        m = [lam + x for lam, x in zip(self.weights, shares, strict=True)]
        if not all(x > 0 for x in m[:supports]):
            msg = "multipliers are not shown to be positive on the box"
            raise UnshownError(msg)
        sizes = [[abs(x) for x in row] for row in p.tolist()]
        spreads = [_largest(row) + t * sum(row, ball(0)) for row in sizes]
        kappa = _least([x.lower() / s for x, s in zip(m[:supports], spreads, strict=False)])
        delta = ball(0)
        for x, value in zip(m[:supports], values, strict=False):
            delta += 2 * x * value.max(ball(0))
        pairs = zip(m[supports : self.held], spreads[supports:], values[supports:], strict=False)
        for x, s, value in pairs:
            delta += (abs(x) + kappa * s) * abs(value)
        return _Growth(_upper(delta), kappa.lower(), ball(0), ball(0))

    def _bent(self) -> "_Growth":
        """Return the growth that Lemma 2 gives."""
        gradients, hessians = self.gradients, self.hessians
        values, around = self.central
        w, size = self.witness, len(self.core)
        supports = len(w.supports)
        lam = self.weights[: self.held]
        if not all(x > 0 for x in lam[:supports]):
            msg = "multipliers are not positive"
            raise UnshownError(msg)
        form = matrix(hessians[-1])
        for x, hessian in zip(lam, hessians, strict=False):
            form = form - matrix(hessian) * x
        top = self.formulas.values(self.whole, w.supports)
        stiff = [x / f.upper() for x, f in zip(lam, top, strict=False)]
        if not all(x > 0 and x.is_finite() for x in stiff):
            msg = "functions that support are not bounded on the box"
            raise UnshownError(msg)
        middle = np.array([[float(x.mid()) for x in row] for row in form.tolist()])
        if not np.isfinite(middle).all():
            msg = "second derivatives are not finite"
            raise UnshownError(msg)
        # Equations hold exactly, so that any weight of theirs is right: one as large as the form.
        heavy = 1e6 * (abs(middle).max() or 1.0)
        stiff += [ball(heavy)] * len(w.equations) + [ball(heavy)] * len(w.gauges)
        rows = [*gradients[: self.held], *self.normals]
        bent = _middle_form(middle, rows, stiff)
        turn = matrix(np.linalg.eigh((bent + bent.T) / 2)[1].tolist())
        # Turned first: errors of w g g^T would couple directions of very different stiffness.
        form = turn.transpose() * form * turn
        for x, row in zip(stiff, rows, strict=True):
            along = entries(turn.transpose() * column(row))
            form = form + matrix(
                [[x * (square(a) if i == j else a * b) for j, b in enumerate(along)]
                 for i, a in enumerate(along)]
            )  # fmt: skip
        # An orthogonal matrix in doubles is orthogonal up to rounding: |turn d|^2 <= (1 + s) |d|^2.
        stretch = 1 + _row_sums(turn.transpose() * turn - identity(size))
        least = min(float(form[i, i].mid()) for i in range(size))
        for share in (0.5, 0.1, 0.01):
            sigma = ball(share * least)
            if sigma > 0:
                found = pivots((form - identity(size) * sigma).tolist())
                if len(found) == size and all(x > 0 for x in found):
                    break
        else:
            msg = "second derivatives are not shown to be positive on the box"
            raise UnshownError(msg)
        slope = column(around[-1])
        if lam:
            slope = slope - matrix(around[: self.held]).transpose() * column(lam)
        eps = sum((square(x) for x in entries(slope)), ball(0)).nonnegative_part().sqrt()
        delta = ball(0)
        for x, stiffness, value in zip(lam, stiff, values, strict=False):
            delta += abs(x * value) + stiffness * square(value)
        sigma = (sigma / stretch).lower()
        return _Growth(_upper(delta), ball(0), sigma, _upper(eps))

    # ------------------------------------------------------------------------------- the theorem

    def inner_box(self) -> Box:
        """Return an enclosure of ``p``, a zero of the equations and gauges.

        Coordinates that these determine are enclosed by Krawczyk's test, the others are exact.
        """
        w = self.witness
        start = [ball(x) for x in w.inner]
        if not w.equations and not w.gauges:
            return Box(start)
        zeros = _Zeros(self, w.equations, w.gauges)
        return Box(zeros.enclosed(start))

    def lies_in(self, box: Box) -> bool:
        """Whether a point, enclosed, is shown to satisfy the functions of one piece of ``D``."""
        rows = sorted(frozenset().union(*self.pieces))
        values = dict(zip(rows, self.formulas.values(box, rows), strict=True))
        return self._holds({i: bool(value >= 0) for i, value in values.items()})

    def _holds(self, known: dict[int, bool]) -> bool:
        return any(all(known[i] for i in piece) for piece in self.pieces)

    @cached_property
    def is_corner(self) -> bool:
        """Whether supports and equations vanish exactly at the centre, and it lies in the set.

        So exact algebra says, at rational numbers.
        """
        w, formulas = self.witness, self.formulas
        inputs = [algebra.number(x) for x in w.centre]
        every = [*w.supports, *w.equations, *self.closed]
        values = evaluate(formulas.graph, [formulas.outputs[i] for i in every], inputs, Symbols())
        if any(value is None for value in values) or any(values[: self.held]):
            return False
        signs = [algebra.constant(value) for value in values[self.held :]]
        least = zip(self.closed, signs, strict=True)
        known = {i: sign is not None and sign >= 0 for i, sign in least}
        return self._holds(known | dict.fromkeys(w.supports, True))

    def away(self, box: Box) -> "Ball":
        """Return the distance of a point from the centre, by the core."""
        apart = [
            abs(box.hull[j] - ball(self.witness.centre[j])) / self.scales[j] for j in self.core
        ]
        return _largest(apart)


class _Zeros:
    """The point of some equations and sections near a point, in as many of its coordinates."""

    def __init__(
        self, about: Examination, equations: Sequence[int], gauges: Sequence[Gauge]
    ) -> None:
        self.about, self.equations, self.gauges = about, tuple(equations), tuple(gauges)

    def _at(self, hull: "list[Ball]") -> "tuple[list[Ball], list[list[Ball]]]":
        about = self.about
        values: list[Ball] = []
        rows: list[list[Ball]] = []
        if self.equations:
            forms = about.formulas.smooth(Box(hull), self.equations)
            if isinstance(forms, Undecided):
                raise UnshownError(str(forms))
            some, gradients = forms.evaluate(Box(hull), 1)
            values += some
            rows += [[g * s for g, s in zip(row, about.scales, strict=True)] for row in gradients]
        for gauge in self.gauges:
            apart = [x - ball(c) for x, c in zip(hull, about.witness.centre, strict=True)]
            normal = [ball(x) for x in gauge.normal]
            values.append(dot(normal, apart))
            rows.append([x * s for x, s in zip(normal, about.scales, strict=True)])
        return values, rows

    def enclosed(self, start: "list[Ball]") -> "list[Ball]":
        """Return an enclosure of the point, by Krawczyk's test after Newton steps."""
        hull, about = list(start), self.about
        places: list[int] = []
        last = inf
        for _ in range(200):
            values, rows = self._at(hull)
            if not places:
                places = _pivots(rows)
            inverse = middle_inverse([[row[j] for j in places] for row in rows])
            if inverse is None:
                msg = "the equations are not shown to be independent"
                raise UnshownError(msg)
            step = entries(inverse * column(values))
            size = max(float(abs(x).upper()) for x in step)
            for j, x in zip(places, step, strict=True):
                hull[j] = (hull[j] - x * about.scales[j]).mid()
            if not size < last / 2:
                break
            last = size
        values, rows = self._at(hull)
        inverse = middle_inverse([[row[j] for j in places] for row in rows])
        assert inverse is not None
        base = inverse * column(values)
        radius = 4 * _largest(entries(base)) + ball(2) ** (-2000)
        for _ in range(6):
            wide = list(hull)
            for j in places:
                wide[j] = hull[j] + ball(0, 1) * radius * about.scales[j]
            _, rows = self._at(wide)
            jacobian = matrix([[row[j] for j in places] for row in rows])
            around = column([ball(0, 1) * radius for _ in places])
            image = entries((identity(len(places)) - inverse * jacobian) * around - base)
            if all(abs(x) < radius for x in image):
                found = list(hull)
                for j, x in zip(places, image, strict=True):
                    found[j] = hull[j] + x * about.scales[j]
                return found
            radius = 4 * radius
        msg = "no point of the equations is enclosed"
        raise UnshownError(msg)


def examine(problem: Problem, formulas: Formulas, witness: Witness) -> "BoundedMinimum | Undecided":
    """Return the minimum that a witness shows, or the hypothesis that is not shown.

    Parameters
    ----------
    problem : Problem
        The polyhedron and the energy.
    formulas : Formulas
        Its inequalities, equations and energy, in this order.
    witness : Witness
        Points, weights and boxes; see the module.
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
    if not (strict or (away < ball(w.reach) and free)):
        msg = "the inner point is not shown to lie inside the box"
        raise UnshownError(msg)
    if not (strict or about.lies_in(inner)):
        msg = "the inner point is not shown to lie in the set"
        raise UnshownError(msg)
    (above,) = about.formulas.values(inner, [about.energy_row])
    gap = ball(0) if strict else _upper((above - energy + growth.delta).max(ball(0)))
    radius = ball(0) if strict else _upper(growth.radius(gap))
    if not radius < ball(w.reach):
        msg = f"the minimum is not shown to be closer than the sides of the box, {radius.str(3)}"
        raise UnshownError(msg)
    _check_room(about, radius)
    alone = _alone(about, growth, gap, ball(0) if strict else _upper(away))
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
    for j, period in enumerate(problem.polyhedron.manifold.periods):
        if not ball(2 * w.reach) * about.scales[j] < ball(period / 2 if period < inf else 1e300):
            msg = "the box is half a period wide"
            raise UnshownError(msg)
    if not about.pieces:
        msg = "the set does not meet the box"
        raise UnshownError(msg)
    every = frozenset.intersection(*about.pieces)
    if not set(w.supports) <= every:
        msg = "functions that support are not asked for by every branch, or positive on the box"
        raise UnshownError(msg)
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
            along = gauge.field.at(about.whole.hull)
            if isinstance(along, Undecided):
                raise UnshownError(str(along))
            vectors.append(along)
        normals = [[ball(x) for x in gauge.normal] for gauge in w.gauges]
        table = matrix([[dot(normal, v) for v in vectors] for normal in normals])
        inverse = middle_inverse(table.tolist())
        if inverse is None or not _row_sums(identity(len(vectors)) - inverse * table) < 1:
            msg = "symmetries are not shown to cross the section"
            raise UnshownError(msg)


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
        if not value > 0:
            msg = f"{about.formulas.names[i]} is not shown to leave room to what rattles"
            raise UnshownError(msg)


def _alone(
    about: Examination, growth: _Growth, gap: "Ball", away: "Ball"
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
        middle = np.array([[float(x.mid()) for x in row] for row in equations.tolist()])
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
    curvature = bends[-1] + pull * _largest(ratios)
    for j in range(k):
        shares = [abs(through[i, j]) / rates[i] for i in range(len(first) - 1)]
        pulls[j] = abs(through[len(first) - 1, j]) + pull * _largest(shares)
        curvature += pulls[j] * sums[supports + j]
    curvature = _upper(curvature)

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


# ------------------------------------------------------------------------------ matrices of balls


def _upper(x: "Ball") -> "Ball":
    """Return the upper bound of a ball that is not negative, as a ball without radius."""
    return x.upper().max(ball(0))


def _largest(balls: "Sequence[Ball]") -> "Ball":
    """Return an upper bound of sizes."""
    found = ball(0)
    for x in balls:
        found = found.max(abs(x).upper())
    return found


def _least(balls: "Sequence[Ball]") -> "Ball":
    found = balls[0].lower()
    for x in balls:
        found = found.min(x.lower())
    return found


def _row_sums(rows: "Matrix") -> "Ball":
    """Return an upper bound of the sums of sizes by rows."""
    return _largest([sum((abs(x) for x in row), ball(0)) for row in rows.tolist()])


def _middle_form(form: "Array", rows: "list[list[Ball]]", stiff: "list[Ball]") -> "Array":
    found = form.copy()
    for x, row in zip(stiff, rows, strict=True):
        middle = np.array([float(y.mid()) for y in row])
        found += float(x.mid()) * np.outer(middle, middle)
    return found


def _pivots(rows: "list[list[Ball]]") -> list[int]:
    """Return as many coordinates as rows, in which these are independent."""
    left = np.array([[float(x.mid()) for x in row] for row in rows])
    found: list[int] = []
    for k in range(len(left)):
        sizes = abs(left[k:])
        sizes[:, found] = 0.0
        i, j = divmod(int(sizes.argmax()), left.shape[1])
        left[[k, k + i]] = left[[k + i, k]]
        if left[k, j]:
            left[k + 1 :] -= np.outer(left[k + 1 :, j] / left[k, j], left[k])
        found.append(j)
    return found
