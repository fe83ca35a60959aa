"""Singular corners: common zeros with dependent gradients that second order isolates.

Let functions ``f_i`` vanish at a point ``p`` of a box ``X``, with gradients ``G_i`` there, and let
``sum l_i G_i = 0``.  For ``q`` in ``X`` and ``d = q - p`` Taylor's theorem gives ``H_i`` in the
enclosure of the second derivatives on ``X`` with ``f_i(q) = G_i d + d' H_i d / 2``, and
therefore, for every ``w``,

    sum_i (l_i + w G_i d) f_i(q) = d' Q d,
    Q = sum_i (l_i H_i / 2 + w G_i' G_i + w (G_i d) H_i / 2).

If all matrices in the enclosure of ``Q`` are positive definite, ``p`` is the only common zero in
``X``.  The gradients being dependent is no property that enclosures could show: ``p`` has rational
coordinates, at which values and gradients are evaluated exactly, and so are the ``l_i``.

Where a single function has the gradient 0 at ``p`` and a regular second derivative on all of ``X``,
there is no other such point in ``X`` either.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from polycorner.intervals.balls import Ball, ball, balls, dot, middles, precision
from polycorner.intervals.enclosures import SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.definite import is_definite, is_regular
from polycorner.proofs.lists.faces import BITS, EnclosedFaces, Region, enclosing, outward
from polycorner.proofs.symbols import Symbols, evaluate
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH

DENOMINATORS = (1, 12, 1000, 10**6)
FACTORS = (1.0, 4.0, 16.0, 64.0)  # of the least w that may do, by the sizes of the terms of Q
MOST_STEPS = 60

Exact = tuple[Fraction, ...]


@dataclass(frozen=True, eq=False)
class TipRegion(Region):
    """A box in which some functions vanish together at one point only, where they are dependent.

    Attributes
    ----------
    exact : tuple of Fraction
        The point, all coordinates.
    combination : tuple of Fraction
        ``l``, for the active functions, then the equations.
    weight : float
        ``w``.
    critical : tuple of int
        The active functions whose gradient vanishes at this point and at no other one of the box.
    """

    exact: Exact
    combination: Exact
    weight: float
    critical: tuple[int, ...]


def tips(faces: EnclosedFaces, q: Array, open_: Sequence[int], reach: float) -> Iterator[TipRegion]:
    """Yield boxes about a singular corner near ``q``, for each set of functions that isolates it.

    ``open_`` are the inequalities that may vanish there, ``reach`` is how far the corner may be, in
    scale units.
    """
    with precision(BITS):
        # An exact point must be guessed: an enclosure never shows that gradients are dependent.
        near = _approximate(faces, q, open_)
        if near is None or (abs(near - q) > reach * faces.scales).any():
            return
        for point in _rational(faces, near, reach):
            found = list(_tips_at(faces, point, open_))
            yield from found
            if found:
                return


def _tips_at(faces: EnclosedFaces, point: Exact, open_: Sequence[int]) -> Iterator[TipRegion]:
    active, slopes = _vanishing(faces, point, open_)
    if active is None:
        return
    rest = range(len(active), len(active) + faces.equations)
    # Each set is a region of its own: a box needs those that may vanish in it.
    for size in range(len(faces.free) - faces.equations + 1):
        for places in combinations(range(len(active)), size):
            chosen = [slopes[i] for i in (*places, *rest)]
            found = _isolated(faces, point, [active[i] for i in places], chosen)
            if found is not None:
                yield found


def _approximate(faces: EnclosedFaces, q: Array, open_: Sequence[int]) -> Array | None:
    """Return a common zero of functions near ``q`` by the method of Gauss and Newton."""
    free, rows = list(faces.free), faces.rows(open_)
    q = q.copy()
    for _ in range(MOST_STEPS):
        forms = faces.formulas.smooth(Box(balls(q)), rows)
        if isinstance(forms, Undecided):
            return None
        values, gradients = forms.evaluate(Box(balls(q)), 1)
        slopes = np.array([[float(g[i].mid()) for i in free] for g in gradients])
        missed = middles(values)
        if not (np.isfinite(slopes).all() and np.isfinite(missed).all()):
            return None
        # Dependent gradients: convergence is linear, and least squares takes the shortest step.
        step = np.linalg.lstsq(slopes * faces.scales[free], -missed, rcond=1e-9)[0]
        q[free] += step * faces.scales[free]
        # Rounding of the step itself; what `_rational` needs is a few digits less.
        if abs(step).max(initial=0.0) < 1e-14:
            break
    return q


def _rational(faces: EnclosedFaces, near: Array, reach: float) -> Iterator[Exact]:
    """Yield points with small denominators near one, the smallest first."""
    fixed = set(range(len(near))) - set(faces.free)
    seen = set()
    # Small denominators first: of two fractions within reach the simpler one is meant.
    for most in DENOMINATORS:
        numbers = [Fraction(x) for x in near.tolist()]
        point = tuple(
            [x if i in fixed else x.limit_denominator(most) for i, x in enumerate(numbers)]
        )
        away = abs(np.array([float(x) for x in point]) - near) / faces.scales
        if point not in seen and (away <= reach).all():
            seen.add(point)
            yield point


def _vanishing(
    faces: EnclosedFaces, point: Exact, open_: Sequence[int]
) -> tuple[list[int] | None, list[list[Fraction]]]:
    """Return the functions that vanish exactly at a point, and their gradients, equations last.

    None unless all equations vanish and everything is a rational number.
    """
    rows = faces.rows(open_)
    forms = faces.formulas.smooth(Box([ball(x) for x in point]), rows)
    if isinstance(forms, Undecided):
        return None, []
    d = forms.graph.derivative
    slopes = [d(f, i) for f in forms.outputs for i in faces.free]
    inputs = [algebra.number(x) for x in point]
    found = evaluate(forms.graph, [*forms.outputs, *slopes], inputs, Symbols())
    numbers = [None if p is None else algebra.constant(p) for p in found]
    values, n = numbers[: len(rows)], len(faces.free)
    # None (not a number that algebra knows) counts as different from 0, which is safe.
    if any(value != 0 for value in values[len(open_) :]):
        return None, []
    active, gradients = [], []
    for r, value in enumerate(values):
        gradient = numbers[len(rows) + n * r : len(rows) + n * (r + 1)]
        # One whose value is no number that algebra knows is left out: the others may isolate the
        # point.
        if value == 0:
            if any(x is None for x in gradient):
                return None, []
            gradients.append([Fraction(x) for x in gradient if x is not None])
            active += [rows[r]] if r < len(open_) else []
    return active, gradients


def _isolated(
    faces: EnclosedFaces, point: Exact, active: list[int], slopes: list[list[Fraction]]
) -> TipRegion | None:
    """Return the widest box tried in which the point is the only common zero."""
    import sympy

    if not slopes:
        return None
    # Relations are rational as the gradients are, found without any rounding.
    relations = [
        tuple([Fraction(int(x.p), int(x.q)) for x in v])
        for v in sympy.Matrix(
            [[sympy.Rational(x.numerator, x.denominator) for x in row] for row in slopes]
        ).T.nullspace()
    ]
    chosen = _relations(relations)
    q = np.array([float(x) for x in point])
    for radii in faces.reaches(SEARCH.widest) if chosen else ():
        lower, upper = q - radii, q + radii
        box = enclosing(lower, upper)
        forms = faces.formulas.smooth(box, faces.rows(active))
        if isinstance(forms, Undecided):
            continue
        hessians = _hessians(forms, box, faces.free)
        away = [box.hull[i] - ball(point[i]) for i in faces.free]
        for relation in chosen:
            # Any w proves it; sizes of the two parts of Q tell where one may be found.
            for weight in _weights(hessians, slopes, relation):
                if isolates(hessians, slopes, away, relation, weight):
                    ends = np.array([outward(ball(point[i])) for i in faces.free])
                    critical = [
                        i
                        for i, g, h in zip(active, slopes, hessians, strict=False)
                        if not any(g) and not faces.equations and is_regular(h)
                    ]
                    return TipRegion(
                        lower, upper, tuple(active), ends[:, 0], ends[:, 1], None,
                        point, relation, weight, tuple(critical),
                    )  # fmt: skip
    return None


def _hessians(forms: SmoothForms, box: Box, free: Sequence[int]) -> "list[list[list[Ball]]]":
    return [[[h[i][j] for j in free] for i in free] for h in forms.evaluate(box, 2)[2]]


def _relations(basis: list[Exact]) -> list[Exact]:
    """Return combinations of relations that may be definite: each, and sums of two."""
    every = list(basis)
    for u, v in pairwise(basis):
        # Where no relation is definite by itself, a sum or a difference may be.
        every += [tuple(a + s * b for a, b in zip(u, v, strict=True)) for s in (1, -1)]
    # Both signs: Q has to be positive, and a relation has no sign of its own.
    return [tuple(s * x for x in relation) for relation in every for s in (1, -1)]


def _weights(hessians: Any, slopes: list[list[Fraction]], relation: Exact) -> list[float]:
    """Return values of ``w`` that may do."""
    middle = np.array([[[float(x.mid()) for x in row] for row in h] for h in hessians])
    gradients = np.array(slopes, dtype=float)
    bent = np.linalg.norm(np.tensordot(np.array(relation, dtype=float), middle, 1))
    steep = np.linalg.norm(gradients.T @ gradients)
    if not steep > 0:
        return [0.0]
    start = float(bent / steep)
    return [factor * start for factor in FACTORS] if np.isfinite(start) else []


def isolates(
    hessians: Any, slopes: Sequence[Sequence[Fraction]], away: Any, relation: Exact, weight: float
) -> bool:
    """Whether ``Q`` is positive definite for all ``d`` in a box and all second derivatives."""
    n, w = len(away), ball(weight)
    gradients = [[ball(x) for x in row] for row in slopes]
    factors = [ball(x) / 2 + w * dot(g, away) / 2 for x, g in zip(relation, gradients, strict=True)]
    form = [
        [
            dot(factors, [h[i][j] for h in hessians])
            + w * dot([g[i] for g in gradients], [g[j] for g in gradients])
            for j in range(n)
        ]
        for i in range(n)
    ]
    # Balls of equal numbers need not be equal; only the symmetric part matters for d' Q d.
    return is_definite([[(form[i][j] + form[j][i]) / 2 for j in range(n)] for i in range(n)])
