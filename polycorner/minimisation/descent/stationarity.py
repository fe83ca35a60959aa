"""Classification of stationary points: minima, saddles and the way off a saddle."""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.minimisation.descent.evaluation import (
    FEASIBLE,
    HUGE,
    evaluate,
    lagrangian_hessian,
    normalised_rows,
    violation,
)
from polycorner.minimisation.descent.feasibility import project
from polycorner.minimisation.descent.jit import compiled
from polycorner.minimisation.descent.linear_algebra import (
    add_multiple,
    identity,
    largest,
    largest_entry,
    length,
    plus,
    svd,
)
from polycorner.minimisation.descent.newton import RANK, polish
from polycorner.minimisation.descent.statuses import NEARLY_FLAT

EXACT = 1e-13  # scaled violation allowed after Newton's method
FLAT, MINIMUM, SADDLE, MOVING, REJECTED = 4, 3, 2, 1, 0  # outcomes of `classify`
CURVED = 1e-8  # relative curvature beyond which a stationary point is a saddle
RADII = (1e-3, 1e-2, 1e-1)  # steps in which flat directions are followed, in scale units
# Relative differences up to which values are the same, and gradients: curvatures above `CURVED`
# gain less from such a difference than values may differ.
SAME, PARALLEL = 1e-14, 1e-11
TANGENT = 1e-4  # sine of an angle below which rows are taken for dependent where steps end
MIXTURES = 4  # mixtures of flat directions to follow, per direction, where there are several


@compiled
def least_curvatures(F, J, H, lam, on, m):
    """Return the least curvature along the face, relative to the energy's size, and its directions.

    The first direction has the least curvature; more follow if it vanishes in several.  It is not a
    number where derivatives are not finite, or huge.
    """
    never_inline()
    n, total = H.shape[1], lam.size
    A, b, _, _ = normalised_rows(F, J, on, m)
    V, s = identity(n), np.zeros(n)
    cut = 0.0
    if b.size:
        _, s, V = svd(A)
        cut = RANK * largest(s)
    L = lagrangian_hessian(H, lam)
    reference = max(largest_entry(L), largest_entry(H[total]), largest(J[total])) + 1e-300
    if not reference < HUGE:
        return np.nan, np.zeros((1, n))
    M = np.zeros((n, n))
    for a in range(n):
        for c in range(n):
            if s[a] <= cut and s[c] <= cut:
                for i in range(n):
                    for k in range(n):
                        M[a, c] += V[i, a] * L[i, k] * V[k, c]
        # Shifted to be definite, so that singular vectors are eigenvectors; off the face, large.
        M[a, a] += 2.0 * n * reference
        if s[a] > cut:
            M[a, a] += 2.0 * n * reference
    _, _, W = svd(M)
    least, count, values, ways = np.inf, 1, np.zeros(n), np.zeros((n, n))
    for j in range(n):
        for a in range(n):
            for c in range(n):
                values[j] += W[a, j] * M[a, c] * W[c, j]
        values[j] = values[j] / reference - 2.0 * n
        first = values[j] < least
        if not (first or abs(values[j]) <= CURVED):
            continue
        k = 0 if first else count
        if first and abs(least) <= CURVED:
            for i in range(n):
                ways[count, i] = ways[0, i]
        count += abs(least) <= CURVED if first else 1
        least = min(least, values[j])
        for i in range(n):
            ways[k, i] = 0.0
            for a in range(n):
                ways[k, i] += V[i, a] * W[a, j]
    return least, ways[:count].copy()


@compiled
def classify(problem, use, on, m, u, F, J, H, size, energy):
    """Apply Newton's method on the face to a copy of ``u`` and classify where it ends.

    Returns
    -------
    outcome
        ``MINIMUM``, ``FLAT`` (its second order vanishes in a direction), ``SADDLE``, ``MOVING``
        (not stationary) or ``REJECTED`` (not reached, outside the set, not below ``energy``, or
        without finite derivatives).
    v, multipliers, directions
        The point, its multipliers and the directions of least curvature.
    """
    never_inline()
    v, rows, directions = u.copy(), on.copy(), np.zeros((1, u.size))
    for _ in range(4):
        lam, step = polish(problem, rows, m, np.zeros((0, u.size)), v, F, J, H, size)
        if not step < 1e-8 or largest(plus(v, -1.0, u)) > 0.5:
            return REJECTED, v, lam, directions
        added = False
        for i in range(m):
            if use[i] and not rows[i] and F[i] < -EXACT * length(J[i]):
                rows[i] = added = True
        if not added:
            break
    last = F.size - 1
    reference = max(largest(J[last]), largest_entry(H[last]))
    pull = J[last].copy()
    stationary = True
    for i in range(F.size - 1):
        add_multiple(pull, -lam[i], J[i])
        if i < m and rows[i] and lam[i] * length(J[i]) < -1e-9 * reference:
            stationary = False
    higher = not F[last] <= energy + 1e-9 * (abs(energy) + reference)  # or not finite
    if higher or violation(F, J, use, m) > FEASIBLE:
        return REJECTED, v, lam, directions
    if not (stationary and largest(pull) <= 1e-9 * reference):
        return MOVING, v, lam, directions
    for i in range(m):
        # A contact without a multiplier does not constrain descent: it may open.
        rows[i] = rows[i] and lam[i] * length(J[i]) > 1e-9 * reference
    least, directions = least_curvatures(F, J, H, lam, rows, m)
    if not np.isfinite(least):
        return REJECTED, v, lam, directions
    if least < -CURVED:
        return SADDLE, v, lam, directions
    return MINIMUM if least > NEARLY_FLAT * CURVED else FLAT, v, lam, directions


@compiled
def leave_saddle(problem, use, on, m, v, direction, F, J, H, size, energy):
    """Move ``v`` off a saddle along ``direction`` to a feasible point below ``energy``.

    ``energy`` is that of the last iterate, so that a descent which leaves a saddle cannot return to
    it, not even by a rounding error.  An iterate within the tolerance of feasibility may be lower
    than the saddle itself; the point reached has to be below both.  Returns whether one was found.

    For each length a straight step is projected onto the set; if the set's curvature defeats it,
    the step follows the face instead.
    """
    never_inline()
    evaluate(problem, v, F, J, H, size, False)
    energy = min(energy, F[F.size - 1])
    along = np.zeros((1, v.size))
    whole = length(direction)
    for i in range(direction.size):
        along[0, i] = direction[i] / whole
    for k in range(48):
        step = 0.1 * 0.5 ** (k // 4) * (1.0 - 2.0 * (k % 2))
        trial = plus(v, step, direction)
        if k % 4 < 2:
            reached = project(problem, use, m, trial, F, J, H, size, np.int64(6))
        else:
            _, last = polish(problem, on, m, along, trial, F, J, H, size)
            reached = last < 1e-8 and violation(F, J, use, m) <= FEASIBLE
        if reached and F[F.size - 1] < energy:
            for i in range(v.size):
                v[i] = trial[i]
            return True
    return False


@compiled
def leave_tangency(problem, use, on, m, v, F, J, H, size, energy):
    """Move ``v`` downhill along a face with nearly dependent rows; return whether it got lower.

    Where an inequality touches an equation, as a wall touches a circle, the linearised rows meet
    halfway to the point of contact: every step is half as long as the one before, and none passes
    the point, where there are no multipliers ([NW] 12.2).  Along the tangents that such rows have
    in common steps are projected onto the set itself, which the point may not end.
    """
    never_inline()
    evaluate(problem, v, F, J, H, size, False)
    last = F.size - 1
    A, b, _, _ = normalised_rows(F, J, on, m)
    direction = J[last].copy()
    if b.size:
        _, s, V = svd(A)
        for c in range(v.size):
            part = 0.0
            for k in range(v.size):
                part += V[k, c] * J[last, k]
            # Across the rows, but not across the small angles between them.
            if s[c] > TANGENT * largest(s):
                add_multiple(direction, -part, V[:, c])
    # Without a slope there is no way down to look for.
    if not 1e-9 * length(J[last]) < length(direction) < HUGE:
        return False
    way = plus(np.zeros(v.size), -1.0 / length(direction), direction)
    return leave_saddle(problem, use, on, m, v, way, F, J, H, size, energy)


@compiled
def is_constant(problem, v, way, values, slopes, F, J, H, size):
    """Return whether values and gradients stay what they are at ``v`` along a straight line."""
    never_inline()
    reach = 1.0 + largest(v)
    for radius in RADII:
        for side in range(2):
            evaluate(problem, plus(v, radius if side else -radius, way), F, J, H, size, False)
            for i in range(F.size):
                scale = abs(values[i]) + reach * largest(slopes[i])
                if not abs(F[i] - values[i]) <= SAME * scale:
                    return False
                for c in range(v.size):
                    if not abs(J[i, c] - slopes[i, c]) <= PARALLEL * scale:
                        return False
    return True


@compiled
def leave_flat(problem, use, on, m, v, ways, F, J, H, size, energy):
    """Move ``v`` from a point with vanishing second order to a lower one nearby; return success.

    Along every direction of ``ways``, and mixtures of them, both ways, straight steps are
    projected onto the set, and curved ones keep the energy stationary across the direction, on the
    face.  The energy must not rise on the way: no barrier is crossed.  A decrease counts beyond
    the rounding error and what a violation within the tolerance can give.  Nothing is lower along
    a line on which all values and gradients are what they are at ``v``.
    """
    never_inline()
    evaluate(problem, v, F, J, H, size, True)
    values, slopes, constant = F.copy(), J.copy(), False
    last = F.size - 1
    noise = 1e-13 * (abs(F[last]) + largest_entry(H[last])) + 10.0 * FEASIBLE * largest(J[last])
    energy = min(energy, F[last])
    count = ways.shape[0]
    along, everything = np.zeros((1, v.size)), count * (1 + (MIXTURES if count > 1 else 0))
    for k in range(4 * everything):
        j = k // 4
        for i in range(v.size):
            along[0, i] = ways[j, i] if j < count else 0.0
            for c in range(count if j >= count else 0):
                along[0, i] += np.cos(1.0 + j * np.sqrt(2.0 + c)) * ways[c, i]
        whole = length(along[0])
        for i in range(v.size):
            along[0, i] /= whole
        way = along[0]
        if k % 4 == 0:
            constant = is_constant(problem, v, way, values, slopes, F, J, H, size)
        if constant:
            continue
        lowest, best = energy, v
        for radius in RADII:
            trial = plus(v, radius if k % 2 else -radius, way)
            if k % 4 < 2:
                reached = project(problem, use, m, trial, F, J, H, size, np.int64(6))
            else:
                _, step = polish(problem, on, m, along, trial, F, J, H, size)
                reached = step < 1e-8 and violation(F, J, use, m) <= FEASIBLE
            if not reached or not F[last] <= lowest + noise:
                break
            if F[last] < lowest:
                lowest, best = F[last], trial
        if lowest < energy - noise:
            for i in range(v.size):
                v[i] = best[i]
            return True
    return False
