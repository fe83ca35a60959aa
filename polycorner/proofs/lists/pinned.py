"""Boxes around points that redundant functions hold to first order, such as jammed discs.

Let the set be one intersection without equations, and let functions ``Z`` vanish at a point ``p``,
in a box ``X`` around it with ``|x_j - p_j| <= r_j``, on which all functions of ``Z`` and the energy
are smooth.  Bounds on ``X`` of half the sum of ``|d_a d_b f_i| r_a r_b`` are called ``R_i``, those
of the energy ``R``.  Suppose that

- for every coordinate ``j`` and both signs ``s`` there are weights ``mu >= 0`` and a number ``t``
  with ``sum mu_i df_i(p) = dE(p) + s t e_j`` over ``Z``: the energy's gradient lies in the interior
  of the cone of the functions';
- for some vector ``u``, ``df_i u >= c_i > 0`` on ``X`` for all of ``Z``;
- ``t r_j > sum mu_i R_i + 2 R + L`` for all ``j`` and ``s``, where ``L`` is the largest
  ``R_i / c_i`` times a bound of ``dE u`` on ``X``, or 0 if that is negative.

Then no point ``x`` of the set in ``X`` is stationary but ``p``, if no functions vanish there but
those of ``Z``.  For let ``S`` be these, ``v = p - x``, and ``tau`` the largest ``|v_j| / r_j``, for
the coordinate ``j`` and the sign ``s`` of ``v_j``.  As ``f_i(p) = 0 <= f_i(x)``, ``df_i(p) v`` is
at most ``tau R_i`` by Taylor's theorem, so that

    ``dE(p) v + tau t r_j <= tau sum mu_i R_i`` and
    ``dE(x) v <= tau (sum mu_i R_i + 2 R - t r_j)``.

If ``x`` is stationary, ``dE(x) = sum lam_i df_i(x)`` over ``S`` with ``lam_i >= 0``, as the
functions of ``S`` all increase along ``u``.  Therefore ``sum lam_i c_i <= dE(x) u``; and, as
``f_i(p) = f_i(x)`` on ``S``, ``df_i(x) v >= -tau R_i`` and ``dE(x) v >= -tau L``.  So ``tau`` is 0.
The same is true of ``x`` where others vanish, if ``dE(x)`` is such a combination over a part of
``Z``.  Expanding the energy about ``p`` shows in the same way that ``p`` is a sharp minimum on the
set in ``X``.

Nor do all of ``Z`` vanish at another point ``x`` of ``X``: then ``|df_i(p) v| <= tau R_i``, and the
equations for ``s`` and ``-s`` give ``(t + t') tau r_j <= tau sum (mu_i + mu'_i) R_i``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner.intervals.balls import Ball, ball, column, dot, entries, matrix, middles, precision
from polycorner.intervals.enclosures import SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.polyhedra.cones import independent_rows
from polycorner.proofs.lists.coincidences import ZERO, Place, signs
from polycorner.proofs.lists.faces import BITS, EnclosedFaces, Region, enclosing, outward
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH

SHRINKINGS = 8  # of a box
LEAST_SHARE, MOST_SHARE = 0.25, 0.9  # of a box that the next one reaches
ENOUGH = 1.001  # by how much a reach has to be large enough, roundings included
SHARE = 0.8  # of the reach at which a box would just do


@dataclass(frozen=True, eq=False)
class Pinned(Region):
    """A box around a point that its active functions, more than are independent, hold.

    They vanish there, and the multipliers are those of one combination of all of them.

    Attributes
    ----------
    corner : tuple of int
        As many of them as there are free coordinates, with independent gradients.
    into : (n,) array
        ``u``, in the free coordinates, as ``n``.
    steps : (2 n,) array
        ``t``, for ``s = 1`` in all coordinates, then ``s = -1``.
    weights : (2 n, active) array
        ``mu``, to within rounding errors.
    """

    corner: tuple[int, ...]
    into: Array
    steps: Array
    weights: Array


def pinned(faces: EnclosedFaces, q: Array, slopes: Array, widest: float) -> Pinned | None:
    """Return the widest box tried about a point at which some functions vanish, or None.

    ``slopes`` are the scaled gradients of the functions at the point, nearly, in the free
    coordinates, 0 of those that do not vanish, ``(m, n)``; ``widest`` is the largest reach of the
    box, in scale units.
    """
    corner = _independent(slopes)
    if corner is None:
        return None
    # The point is that of n of the functions; the others vanish there exactly, or are left out.
    around = faces.vertex(q, corner, widest)
    if around is None:
        return None
    with precision(BITS):
        point = list(enclosing(around.lower, around.upper).hull)
        zero = faces.zero(around.lower, around.upper, corner)
        for i, x in zip(faces.free, zero or (), strict=bool(zero)):
            point[i] = x
        place = Place(point, around.lower, around.upper, corner)
        found = signs(faces, place, faces.inequalities)
        # Functions that are open are no harm: items in which they may vanish are not closed.
        zeros = tuple(i for i, sign in enumerate(found) if sign == ZERO)
        return _within(faces, (*zeros, faces.inequalities), corner, point, widest)


def _independent(slopes: Array) -> tuple[int, ...] | None:
    """Return as many rows as there are columns whose gradients are far from dependent, or None."""
    longest = float(np.linalg.norm(slopes, axis=1).max(initial=0.0))
    chosen = independent_rows(slopes, DEFAULT.alike / 10 * longest)
    return tuple(sorted(chosen)) if len(chosen) == slopes.shape[1] else None


def _within(
    faces: EnclosedFaces,
    rows: tuple[int, ...],
    corner: tuple[int, ...],
    point: "list[Ball]",
    widest: float,
) -> Pinned | None:
    """Return the widest box tried around an enclosed point, or None."""
    free, zeros = list(faces.free), rows[:-1]
    forms = faces.formulas.smooth(Box(point), rows)
    if isinstance(forms, Undecided):
        return None
    slopes = [[g[i] for i in free] for g in forms.evaluate(Box(point), 1)[1]]
    known = middles(slopes)
    guess = _guessed(known, faces.scales[free]) if np.isfinite(known).all() else None
    if guess is None:
        return None
    steps, weights = guess
    # Before any box: the weights belong to the point, and are the same for all of them.
    exact = _corrected(slopes, steps, weights)
    if exact is None:
        return None
    middle, radii = middles(point), np.zeros_like(faces.scales)
    radii[free] = min(widest, SEARCH.widest) * faces.scales[free]
    for _ in range(SHRINKINGS):
        lower, upper = middle - radii, middle + radii
        box = enclosing(lower, upper)
        reach = [(box.hull[i] - point[i]).abs_upper() for i in free]
        # In a box with a kink Taylor's theorem does not hold; a smaller one may be without.
        found, share = faces.formulas.smooth(box, rows), None
        if not isinstance(found, Undecided):
            into = _into(found, box, free, reach)
            share = _shown(found, box, free, reach, steps, exact, into)
            if share is not None and share > ENOUGH:
                whole = _combination(exact, steps, len(free))
                ends = np.array([outward(x) for x in (*(point[i] for i in free), *whole)])
                sides = lower, upper, zeros, ends[:, 0], ends[:, 1], 0
                return Pinned(*sides, corner, into, steps, weights)
        # Bends shrink with the square of the reach: the share tells about where a box would do.
        radii *= max(LEAST_SHARE, min(MOST_SHARE, SHARE * share)) if share else LEAST_SHARE
    return None


def _guessed(slopes: Array, scales: Array) -> tuple[Array, Array] | None:
    """Return the largest steps and their weights, approximately; None if there are none."""
    from scipy.optimize import linprog

    g, pull = slopes[:-1] * scales, slopes[-1] * scales
    (count, n), sizes = g.shape, np.linalg.norm(g, axis=1)
    # No weight of 0: the exact correction that follows may make it negative.
    smallest = 1e-4 * np.linalg.norm(pull) / sizes.max()
    steps, weights = np.zeros(2 * n), np.zeros((2 * n, count))
    for k in range(2 * n):
        sign, j = 1 - 2 * (k // n), k % n
        side = np.zeros((n, 1))
        side[j] = -sign
        found: Any = linprog(
            np.append(np.zeros(count), -1.0),
            A_eq=np.hstack([g.T, side]),
            b_eq=pull,
            bounds=[(smallest, None)] * count + [(0.0, 1e6 * np.linalg.norm(pull))],
        )
        if not found.success or not found.x[-1] > 0:
            return None
        steps[k], weights[k] = found.x[-1] / scales[j], found.x[:-1]
    return steps, weights


def _corrected(
    slopes: "list[list[Ball]]", steps: Array, weights: Array
) -> "list[list[Ball]] | None":
    """Return the weights with which gradients add up exactly; None if any may be negative."""
    *rows, pull = slopes
    n, g = len(pull), matrix(rows)
    middle = g.mid()
    right = []
    for k, (t, row) in enumerate(zip(steps.tolist(), weights.tolist(), strict=True)):
        wanted = [x + (t if j == k % n else 0) * (1 - 2 * (k // n)) for j, x in enumerate(pull)]
        total = entries(g.transpose() * column(row))
        right.append([a - b for a, b in zip(wanted, total, strict=True)])
    try:
        # The shortest correction, as there are more weights than equations.
        change = middle * (g.transpose() * middle).solve(matrix(right).transpose())
    except ZeroDivisionError:
        return None
    found = (matrix(weights.tolist()) + change.transpose()).tolist()
    # For balls x >= 0 means for certain.
    return found if all(x >= 0 for row in found for x in row) else None


def _combination(exact: "list[list[Ball]]", steps: Array, n: int) -> "list[Ball]":
    """Return positive multipliers with which the gradients add up to the energy's."""
    total = [ball(0)] * len(exact[0])
    for j in range(n):
        up, down = ball(steps[j]), ball(steps[n + j])
        pairs = zip(total, exact[j], exact[n + j], strict=True)
        # Weighted by the other step, t e_j and -t' e_j cancel: what is left is dE.
        total = [m + (down * a + up * b) / ((up + down) * n) for m, a, b in pairs]
    return total


def _bends(forms: SmoothForms, box: Box, free: Sequence[int], reach: "list[Ball]") -> "list[Ball]":
    """Return ``R_i`` of all functions, the energy's last."""
    pairs = [
        (a, b, reach[k] * reach[j] / 2) for k, a in enumerate(free) for j, b in enumerate(free)
    ]
    hessians = forms.evaluate(box, 2)[2]
    return [sum((h[a][b].abs_upper() * r for a, b, r in pairs), ball(0)).upper() for h in hessians]


def _into(forms: SmoothForms, box: Box, free: Sequence[int], reach: "list[Ball]") -> Array:
    """Return a vector along which the functions increase, by more where they are more curved."""
    from scipy.optimize import linprog

    slopes = np.array([[float(g[i].mid()) for i in free] for g in forms.evaluate(box, 1)[1]])
    bends = np.array([float(x) for x in _bends(forms, box, free, reach)[:-1]])
    most = bends.max(initial=0.0)
    if not (np.isfinite(slopes).all() and np.isfinite(most)):
        return np.zeros(len(free))
    # A little for functions without curvature, too: they have to increase as well.
    wanted = bends / most + 0.01 if most > 0 else np.ones_like(bends)
    scale = np.linalg.norm(slopes[:-1], axis=1) @ wanted / (wanted @ wanted)
    found: Any = linprog(
        slopes[-1], A_ub=-slopes[:-1], b_ub=-wanted * scale, bounds=[(None, None)] * len(free)
    )
    return np.asarray(found.x if found.success else np.zeros(len(free)))


def _shown(
    forms: SmoothForms,
    box: Box,
    free: Sequence[int],
    reach: "list[Ball]",
    steps: Array,
    weights: "list[list[Ball]]",
    into: Array,
) -> float | None:
    """Return how many times larger than needed ``t r_j`` is, at least; None without ``u``."""
    *bends, bend = _bends(forms, box, free, reach)
    *grows, pull = [dot([g[i] for i in free], into.tolist()) for g in forms.evaluate(box, 1)[1]]
    if not all(x > 0 for x in grows):
        return None
    # Where the energy falls along u there is no loss, and no gain is taken from it.
    most = max(pull.upper(), ball(0))
    loss = max((r / x * most).upper() for r, x in zip(bends, grows, strict=True))
    shares: list[float] = []
    for k, (t, mu) in enumerate(zip(steps.tolist(), weights, strict=True)):
        needed, there = (dot(mu, bends) + 2 * bend + loss).upper(), t * reach[k % len(reach)]
        shares.append(float((there / needed).lower()) if needed > 0 else np.inf)
    return min(shares)
