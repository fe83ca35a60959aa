"""How fast an energy grows from a corner on a box, whether or not all its contacts close.

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
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import inf
from typing import Any

import numpy as np

from polycorner.intervals.balls import (
    Ball,
    Matrix,
    ball,
    balls,
    column,
    dot,
    entries,
    identity,
    matrix,
    middle_inverse,
    middles,
    square,
)
from polycorner.intervals.enclosures import Formulas, SmoothForms
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Problem
from polycorner.polyhedra.polyhedron import Piece
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.definite import pivots
from polycorner.proofs.kkt import krawczyk, strictly_inside
from polycorner.proofs.rattlers import reads
from polycorner.proofs.symbols import Symbols, evaluate
from polycorner.proofs.witnesses import UnshownError, Witness, decided, need
from polycorner.values import cached_property

MOST_STEPS, MOST_WIDENED = 200, 6  # of Newton's method, and of the box of Krawczyk's test
LEAST_BITS = 2000  # of the half side of this box


@dataclass(frozen=True, eq=False)
class Growth:
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
        return balls(self.problem.scales)

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
        return decided(self.formulas.smooth(self.whole, self.rows))

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
    def growth(self) -> "Growth":
        """The lower bound that the lemma of the witness gives."""
        return self._spread() if self.witness.order == 1 else self._bent()

    def _spread(self) -> "Growth":
        """Return the growth that Lemma 1 gives."""
        gradients = self.gradients
        values, around = self.central
        rows = [*gradients[: self.held], *self.normals]
        supports, size = len(self.witness.supports), len(self.core)
        spans = supports and len(rows) >= size
        need(spans, "the gradients of the functions that support do not span")
        middle = middles((*around[: self.held], *self.normals))
        need(np.isfinite(middle).all(), "gradients are not finite")
        p = matrix(np.linalg.pinv(middle.T).tolist())
        across = matrix(rows).transpose()
        defect = row_sums(identity(size) - across * p)
        need(
            defect < 1,
            "the gradients of the functions that support are not shown to span on the box",
        )
        t = defect / (1 - defect)
        slope = gradients[-1]
        rest = entries(column(slope) - across * column(self.weights))
        spread = t * largest(rest)
        wide = [x + ball(0, 1) * spread for x in rest]
        shares = entries(p * column(wide))
        m = [lam + x for lam, x in zip(self.weights, shares, strict=True)]
        need(
            all(x > 0 for x in m[:supports]), "multipliers are not shown to be positive on the box"
        )
        sizes = [[abs(x) for x in row] for row in p.tolist()]
        spreads = [largest(row) + t * sum(row, ball(0)) for row in sizes]
        kappa = _least([x.lower() / s for x, s in zip(m[:supports], spreads, strict=False)])
        delta = ball(0)
        for x, value in zip(m[:supports], values, strict=False):
            delta += 2 * x * value.max(ball(0))
        pairs = zip(m[supports : self.held], spreads[supports:], values[supports:], strict=False)
        for x, s, value in pairs:
            delta += (abs(x) + kappa * s) * abs(value)
        return Growth(upper_bound(delta), kappa.lower(), ball(0), ball(0))

    def _bent(self) -> "Growth":
        """Return the growth that Lemma 2 gives."""
        gradients, hessians = self.gradients, self.hessians
        values, around = self.central
        w, size = self.witness, len(self.core)
        supports = len(w.supports)
        lam = self.weights[: self.held]
        need(all(x > 0 for x in lam[:supports]), "multipliers are not positive")
        form = matrix(hessians[-1])
        for x, hessian in zip(lam, hessians, strict=False):
            form = form - matrix(hessian) * x
        top = self.formulas.values(self.whole, w.supports)
        stiff = [x / f.upper() for x, f in zip(lam, top, strict=False)]
        need(
            all(x > 0 and x.is_finite() for x in stiff),
            "functions that support are not bounded on the box",
        )
        middle = middles(form.tolist())
        need(np.isfinite(middle).all(), "second derivatives are not finite")
        # Equations hold exactly, so that any weight of theirs is right: one as large as the form.
        heavy = 1e6 * (abs(middle).max() or 1.0)
        stiff += [ball(heavy)] * len(w.equations) + [ball(heavy)] * len(w.gauges)
        rows = [*gradients[: self.held], *self.normals]
        normals = zip(stiff, map(middles, rows), strict=True)
        bent = sum((float(x.mid()) * np.outer(g, g) for x, g in normals), middle)
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
        stretch = 1 + row_sums(turn.transpose() * turn - identity(size))
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
        return Growth(upper_bound(delta), ball(0), sigma, upper_bound(eps))

    # ------------------------------------------------------------------------------- the theorem

    def inner_box(self) -> Box:
        """Return an enclosure of ``p``, a zero of the equations and gauges.

        Coordinates that these determine are enclosed by Krawczyk's test, the others are exact.
        """
        w = self.witness
        start = [ball(x) for x in w.inner]
        if not w.equations and not w.gauges:
            return Box(start)
        return Box(_Zeros(self).enclosed(start))

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
        return largest(apart)


class _Zeros:
    """The point of the equations and sections of a witness, in as many of its coordinates."""

    def __init__(self, about: Examination) -> None:
        self.about = about
        self.places: list[int] = []

    def at(self, hull: "list[Ball]") -> "tuple[list[Ball], list[list[Ball]]]":
        """Return values, and derivatives by these coordinates, by all until they are chosen."""
        about, w = self.about, self.about.witness
        values, rows = list[Any](), list[Any]()
        if w.equations:
            forms = decided(about.formulas.smooth(Box(hull), w.equations))
            values, rows = map(list, forms.evaluate(Box(hull), 1))
        for gauge in w.gauges:
            normal = [ball(x) for x in gauge.normal]
            values.append(dot(normal, [x - ball(c) for x, c in zip(hull, w.centre, strict=True)]))
            rows.append(normal)
        rows = [[g * s for g, s in zip(row, about.scales, strict=True)] for row in rows]
        self.places = self.places or _pivots(rows)
        return values, [[row[j] for j in self.places] for row in rows]

    def moved(self, hull: "list[Ball]", by: "Sequence[Ball]") -> "list[Ball]":
        """Return a point with these coordinates moved, in scale units."""
        found = list(hull)
        for j, x in zip(self.places, by, strict=True):
            found[j] = hull[j] + x * self.about.scales[j]
        return found

    def enclosed(self, start: "list[Ball]") -> "list[Ball]":
        """Return an enclosure of the point, by Krawczyk's test after Newton steps."""
        hull, last = list(start), inf
        for _ in range(MOST_STEPS):
            values, rows = self.at(hull)
            inverse = middle_inverse(rows)
            if inverse is None:
                msg = "the equations are not shown to be independent"
                raise UnshownError(msg)
            step = entries(inverse * column(values))
            size = float(largest(step))
            hull = [x.mid() for x in self.moved(hull, [-x for x in step])]
            if not size < last / 2:
                break
            last = size
        values, rows = self.at(hull)
        inverse = middle_inverse(rows)
        assert inverse is not None
        nothing = [ball(0)] * len(self.places)
        radius = 4 * largest(entries(inverse * column(values))) + ball(2) ** (-LEAST_BITS)
        for _ in range(MOST_WIDENED):
            around = [ball(0, 1) * radius] * len(self.places)
            _, rows = self.at(self.moved(hull, around))
            image = krawczyk(values, rows, inverse, around, nothing)
            if strictly_inside(image, around):
                return self.moved(hull, image)
            radius = 4 * radius
        msg = "no point of the equations is enclosed"
        raise UnshownError(msg)


# ------------------------------------------------------------------------------ matrices of balls


def upper_bound(x: "Ball") -> "Ball":
    """Return the upper bound of a ball that is not negative, as a ball without radius."""
    return x.upper().max(ball(0))


def largest(balls: "Sequence[Ball]") -> "Ball":
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


def row_sums(rows: "Matrix") -> "Ball":
    """Return an upper bound of the sums of sizes by rows."""
    return largest([sum((abs(x) for x in row), ball(0)) for row in rows.tolist()])


def _pivots(rows: "list[list[Ball]]") -> list[int]:
    """Return as many coordinates as rows, in which these are independent."""
    left = middles(rows)
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
