"""Witnesses of minima between two energies: multipliers, a polished centre, an inner point, boxes.

Everything here is in doubles, or at the midpoints of balls; what it finds is proved or refused by
:mod:`~polycorner.proofs.bounded`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.optimize import linprog

from polycorner.intervals.balls import Ball, ball, balls, bits_for, exact, middles, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Problem
from polycorner.polyhedra.cones import independent_rows, unit_rows
from polycorner.proofs.bounded import SUBJECT, BoundedMinimum, examine
from polycorner.proofs.growth import Examination
from polycorner.proofs.invariance import Generator, generators, translations
from polycorner.proofs.rattlers import Rattlers, reads
from polycorner.proofs.witnesses import Gauge, UnshownError, Witness
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

UNIT = 1e-3  # share of the energy's slope up to which the support of multipliers is counted
BITS = 128
HALVINGS = 60
TRIES = 8  # boxes in which the growth is shown, and the rest is tried
SIMPLE = 10_000  # largest denominator of a coordinate that is taken to be rational


class WitnessSearch:
    """The witnesses near one point.

    Functions are contacts up to a distance of the tolerances; the fields are symmetries modulo
    which there is a minimum.
    """

    def __init__(
        self,
        problem: Problem,
        formulas: Formulas,
        point: Array,
        fields: Sequence[Generator],
        tolerances: Tolerances,
    ) -> None:
        self.problem, self.formulas, self.fields = problem, formulas, fields
        self.tolerances = tolerances
        self.point = np.array(point)
        self.scales = problem.scales
        m = problem.inequalities
        values, gradients = problem.evaluate(self.point, 1)
        sizes = np.linalg.norm(gradients, axis=1)
        near = abs(values) <= 100 * tolerances.zero * np.where(sizes > 0, sizes, 1.0)
        self.contacts = tuple(np.flatnonzero(near[:m]).tolist())
        rows = unit_rows(gradients[m:-1])
        chosen = independent_rows(rows, tolerances.rank) if len(rows) else []
        self.equations = tuple(sorted(m + i for i in chosen))

    # -------------------------------------------------------------------------------- multipliers

    def multipliers(self, contacts: Sequence[int], q: Array) -> tuple[list[int], Array] | None:
        """Return the rows of ``S`` and weights of ``S`` and the equations; None without any.

        The support is the fullest; on it the least weight, relative to its gradient, is largest.
        """
        _, gradients = self.problem.evaluate(q, 1)
        slope = gradients[-1]
        pull = float(np.linalg.norm(slope)) or 1.0
        rows = np.array([*gradients[list(contacts)], *gradients[list(self.equations)]])
        rows = rows.reshape(-1, len(slope))
        sizes = np.linalg.norm(rows, axis=1)
        if not (sizes.all() and np.isfinite(sizes.sum() + pull)):
            return None
        units, k, e = rows / sizes[:, None], len(contacts), len(self.equations)
        n = len(slope)
        # lam (k), mu (e), t (k), misfit (2 n): as many t > 0 as possible
        balance = np.hstack([units.T, np.zeros((n, k)), np.eye(n), -np.eye(n)])
        cost = np.concatenate([np.zeros(k + e), -np.ones(k), np.full(2 * n, 1e6)])
        under = np.hstack([-np.eye(k), np.zeros((k, e)), np.eye(k), np.zeros((k, 2 * n))])
        bounds: list[Any] = [(0, None)] * k + [(None, None)] * e
        bounds += [(0, UNIT)] * k + [(0, None)] * (2 * n)
        found = linprog(cost, under, np.zeros(k), balance, slope / pull, bounds)
        if found.x is None:
            return None
        support = [i for i in range(k) if found.x[k + e + i] > UNIT / 100]
        kept = [*support, *range(k, k + e)]
        part = units[kept]
        s, width = len(support), len(kept)
        balance = np.hstack([part.T, np.zeros((n, 1)), np.eye(n), -np.eye(n)])
        cost = np.concatenate([np.zeros(width), [-1.0], np.full(2 * n, 1e6)])
        under = np.hstack([-np.eye(s, width), np.ones((s, 1)), np.zeros((s, 2 * n))])
        bounds = [(0, None)] * s + [(None, None)] * (width - s) + [(0, 1)] + [(0, None)] * (2 * n)
        found = linprog(cost, under, np.zeros(s), balance, slope / pull, bounds)
        if found.x is None:
            return None
        misfit = float(found.x[width + 1 :].sum())
        if misfit > 1e3 * self.tolerances.stationary * 10:
            return None
        weights = found.x[:width] * pull / sizes[kept]
        return [contacts[i] for i in support], weights

    # ------------------------------------------------------------------------------------- polish

    def polished(
        self,
        supports: Sequence[int],
        weights: Array,
        gauges: Sequence[Gauge],
        start: "list[Ball]",
        bits: int,
    ) -> "tuple[list[Ball], list[Ball]] | None":
        """Return the point and weights after Gauss-Newton steps, residuals in balls.

        Steps are the shortest in doubles: each wins nearly as many digits as these have.
        """
        rows = (*supports, *self.equations, len(self.formulas.names) - 1)
        k, n = len(rows) - 1, self.problem.dimension
        q, lam = list(start), [ball(float(x)) for x in weights]
        scales = balls(self.scales)
        normals = [[ball(x) * s for x, s in zip(g.normal, scales, strict=True)] for g in gauges]
        anchor = list(start)
        last, stalled = np.inf, 0
        for _ in range(6 + bits // 8):
            box = Box(q)
            forms = self.formulas.smooth(box, rows)
            if isinstance(forms, Undecided):
                return None
            values, gradients = forms.evaluate(box, 1)
            floats = middles(q)
            _, _, curved = self.problem.evaluate(floats, 2)
            scaled = [[g * s for g, s in zip(row, scales, strict=True)] for row in gradients]
            slope = [
                scaled[k][i] - sum((x * scaled[r][i] for r, x in enumerate(lam)), ball(0))
                for i in range(n)
            ]
            apart = [
                sum((a * (x - y) / s for a, x, y, s in zip(normal, q, anchor, scales, strict=True)),
                    ball(0))
                for normal in normals
            ]  # fmt: skip
            right = [x.mid() for x in (*slope, *values[:k], *apart)]
            size = max((abs(x) for x in right), key=float, default=ball(0))
            if not size > 0 or size < ball(2) ** (-bits):
                break
            form = curved[-1] - sum(
                (float(x.mid()) * curved[r] for r, x in zip(rows, lam, strict=False)),
                np.zeros((n, n)),
            )
            across = middles(scaled[:k])
            across = across.reshape(k, n)
            fixed = np.array([[float(x) for x in row] for row in normals]).reshape(-1, n)
            table = np.block(
                [
                    [form, -across.T],
                    [across, np.zeros((k, k))],
                    [fixed, np.zeros((len(fixed), k))],
                ]
            )
            relative = np.array([float((x / size).mid()) for x in right])
            if not np.isfinite(table).all() or not np.isfinite(relative).all():
                return None
            step = np.linalg.lstsq(table, relative, rcond=1e-9)[0]
            q = [
                (x - ball(d) * size * s).mid()
                for x, d, s in zip(q, step[:n].tolist(), scales, strict=True)
            ]
            lam = [(x - ball(d) * size).mid() for x, d in zip(lam, step[n:].tolist(), strict=True)]
            now = float(size.log())
            stalled = stalled + 1 if now > last - 1 else 0
            if stalled > 3:
                break
            last = now
        return q, lam

    def closing(self, contacts: Sequence[int], q: "list[Ball]", bits: int) -> "list[int]":
        """Return the contacts that close together at the vertex of the linearised set near ``q``.

        Their values are known to many digits and scaled, so that doubles tell them apart.
        """
        values = self.formulas.values(Box(q), contacts)
        size = max((abs(x.mid()) for x in values), key=float, default=ball(0))
        if not size > ball(2) ** (-bits // 2):
            return list(contacts)
        _, gradients = self.problem.evaluate(middles(q), 1)
        rows, right = gradients[list(contacts)], [float((x.mid() / size).mid()) for x in values]
        fixed = gradients[list(self.equations)]
        found = linprog(
            gradients[-1], -rows, np.array(right), fixed if len(fixed) else None,
            np.zeros(len(fixed)) if len(fixed) else None, [(-1e4, 1e4)] * rows.shape[1],
        )  # fmt: skip
        if found.x is None:
            return []
        gaps = rows @ found.x + right
        return [i for i, gap in zip(contacts, gaps.tolist(), strict=True) if gap < 1e-6]

    # ------------------------------------------------------------------------------- the witness

    def run(self, digits: int) -> BoundedMinimum | Undecided:
        """Return the minimum that is shown near the point, or why none is."""
        bits = bits_for(digits)
        with precision(bits):
            return self._run(bits)

    def _run(self, bits: int) -> BoundedMinimum | Undecided:
        found = self.multipliers(self.contacts, self.point)
        if found is None:
            return Undecided(SUBJECT, "no multipliers carry the energy's slope")
        supports, weights = found
        gauges = self._gauges(supports)
        q = balls(self.point)
        for _ in range(3):
            polished = self.polished(supports, weights, gauges, q, bits)
            if polished is None:
                return Undecided(SUBJECT, "functions are not smooth near the point")
            q, lam = polished
            kept = self.closing(supports, q, bits)
            if set(kept) == set(supports):
                break
            found = self.multipliers(kept, middles(q))
            if found is None:
                return Undecided(SUBJECT, "no multipliers carry the energy's slope")
            supports, weights = found
        centre = [exact(x.mid()) for x in q]
        near = Fraction(1, 2 ** (bits // 2))
        simple = [x.limit_denominator(SIMPLE) for x in centre]
        centre = [y if abs(x - y) < near else x for x, y in zip(centre, simple, strict=True)]
        best: BoundedMinimum | None = None
        reason: BoundedMinimum | Undecided = Undecided(SUBJECT, "nothing was tried")
        for witness in self._witnesses(supports, centre, lam, gauges, bits):
            if best and witness.order == 2:
                break
            reason = examine(self.problem, self.formulas, witness)
            if isinstance(reason, BoundedMinimum):
                best = best or reason
                # Only to first order, and without unions, a smaller box may say more.
                if reason.alone or witness.order == 2 or self.problem.polyhedron.is_union:
                    return reason
        return best or reason

    def _gauges(self, supports: Sequence[int]) -> tuple[Gauge, ...]:
        """Return a section for each field, along one coordinate of the core."""
        energy = len(self.formulas.names) - 1
        held = (*supports, *self.equations, energy)
        read = frozenset().union(*(reads(self.formulas, i) for i in held))
        found: list[Gauge] = []
        taken: list[int] = []
        box = Box(balls(self.point))
        rows: list[Any] = []
        smooth: list[Generator] = []
        fields = [*self.fields, *self._translations((*supports, *self.equations, energy), box)]
        for field in fields:
            along = field.at(box.hull)
            if isinstance(along, Undecided):
                continue
            smooth.append(field)
            rows.append([float(x.mid()) for x in along])
        left = np.array(rows).reshape(-1, self.problem.dimension) / self.scales
        for k in range(len(left)):
            sizes = abs(left[k])
            sizes[[j for j in range(len(sizes)) if j not in read or j in taken]] = 0.0
            j = int(sizes.argmax())
            if sizes[j] <= self.tolerances.rank:
                continue
            left[k + 1 :] -= np.outer(left[k + 1 :, j] / left[k, j], left[k])
            taken.append(j)
            normal = tuple([Fraction(int(i == j)) for i in range(self.problem.dimension)])
            found.append(Gauge(smooth[k], normal))
        return tuple(found)

    def _translations(self, rows: Sequence[int], box: Box) -> Iterator[Generator]:
        """Return translations along which supports, contacts, equations and energy are constant."""
        forms = self.formulas.smooth(box, (*self.contacts, *rows))
        if not isinstance(forms, Undecided):
            for basis in translations(forms):
                yield from generators(self.problem.polyhedron.manifold, [basis])

    def _witnesses(
        self,
        supports: Sequence[int],
        centre: list[Fraction],
        lam: "list[Ball]",
        gauges: tuple[Gauge, ...],
        bits: int,
    ) -> Iterator[Witness]:
        weights = tuple([exact(x.mid()) for x in lam])
        n = self.problem.dimension
        nothing = tuple([Fraction(0)] * n)
        base = Witness(
            1, tuple(centre), tuple(centre), tuple(supports), self.equations, weights,
            Fraction(1, 2), {}, nothing, gauges,
        )  # fmt: skip
        about = Examination(self.problem, self.formulas, base)
        rattling = about.rattling
        if rattling:
            rattlers = Rattlers(self.problem, self.formulas, rattling)
            middle, room = rattlers.placed(about.at_centre.hull)
            if room is None:
                return
            base = replace(base, centre=middle, inner=middle, room=room)
        for order in (1, 2):
            yield from self._ordered(replace(base, order=order), bits)

    def _ordered(self, base: Witness, bits: int) -> Iterator[Witness]:
        """Return witnesses for one of the lemmas, from wide boxes to narrow ones."""
        reach, tries = Fraction(1, 2), 0
        for _ in range(HALVINGS):
            witness = replace(base, reach=reach)
            about = Examination(self.problem, self.formulas, witness)
            reach /= 2
            try:
                about.growth  # noqa: B018 - it raises
            except UnshownError:
                continue
            complete = self._with_inner(about, bits)
            if complete is not None:
                yield complete
                tries += 1
            if complete is None or tries == TRIES:
                break

    def _with_inner(self, about: Examination, bits: int) -> Witness | None:
        """Return a witness with a point inside, and the direction that leads there."""
        w, core = about.witness, list(about.core)
        rows = [*w.supports, *(i for i in about.closed if reads(self.formulas, i) <= set(core))]
        q = np.array([float(x) for x in w.centre])
        _, gradients = self.problem.evaluate(q, 1)
        table = gradients[rows][:, core]
        fixed = np.array([
            *gradients[list(w.equations)][:, core],
            *[[float(g.normal[j]) * self.scales[j] for j in core] for g in w.gauges],
        ]).reshape(-1, len(core))  # fmt: skip
        direction = np.zeros(len(core))
        if rows:
            sizes = np.linalg.norm(table, axis=1)
            if not sizes.all():
                return None
            units = table / sizes[:, None]
            found = linprog(
                np.array([0.0] * len(core) + [-1.0]),
                np.hstack([-units, np.ones((len(rows), 1))]), np.zeros(len(rows)),
                np.hstack([fixed, np.zeros((len(fixed), 1))]) if len(fixed) else None,
                np.zeros(len(fixed)) if len(fixed) else None,
                bounds=[(-1, 1)] * len(core) + [(0, 1)],
            )  # fmt: skip
            if found.x is None or not found.x[-1] > self.tolerances.rank:
                return w if about.is_corner else None
            direction = found.x[:-1]
        exactly = [Fraction(x) for x in direction.tolist()]
        steps = [Fraction(0)] * len(q)
        for j, x in zip(core, exactly, strict=True):
            steps[j] = x
        values = self.formulas.values(about.at_centre, w.supports)
        worst = max((abs(x).upper() for x in values), key=float, default=ball(0))
        tau = exact((worst + ball(2) ** (8 - bits)).upper())
        scales = [Fraction(s) for s in self.scales.tolist()]
        for _ in range(200):
            inner = tuple([
                c + tau * x * s for c, x, s in zip(w.centre, steps, scales, strict=True)
            ])  # fmt: skip
            witness = replace(w, inner=inner, direction=tuple(steps))
            trial = replace(about, witness=witness)
            try:
                box = trial.inner_box()
            except UnshownError:
                return None
            if about.lies_in(box):
                return witness
            if not rows or tau > w.reach:
                return None
            tau *= 2
        return None


def bounded_minimum(
    problem: Problem,
    formulas: Formulas,
    point: Array,
    fields: Sequence[Generator],
    tolerances: Tolerances,
    digits: int,
) -> BoundedMinimum | Undecided:
    """Return a minimum that is shown to lie near a point, between two energies, or why none is."""
    return WitnessSearch(problem, formulas, point, fields, tolerances).run(digits)
