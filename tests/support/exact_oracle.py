"""Whether what a proof says about an exactly known problem is true.

Everything is decided from the definitions in rational arithmetic, in the straight coordinates of
:mod:`minima.exact_problems`; nothing here is shared with the library.
"""

from itertools import combinations, product
from types import SimpleNamespace

import mpmath
from exact_algebra import (
    ZERO,
    applied,
    combined,
    inertia,
    null_space,
    reduced,
    restricted,
    solved,
    span,
)


def holds(problem, proof):
    """Whether a proof's face, point and claim of a minimum are true."""
    bounds = problem.straightened(proof)
    lower, upper = bounds[0]
    slope = list(problem.slope)
    if problem.kink:
        if lower <= problem.edge <= upper:
            return False  # no second-order theorem speaks of a kink
        slope[0] += problem.kink if lower > problem.edge else ZERO
    beyond = problem.third or problem.fourth
    if beyond and not lower <= 0 <= upper:
        return _nearly_holds(problem, proof, bounds)
    # Where (u-c)_1 = 0 the terms of higher order have no derivatives up to the second.
    if proof.minimum is None:
        return _exactly_holds(problem, slope, proof, bounds, beyond)
    # A minimum in the enclosure: one that holds for some of the functions that support it.
    parts = (c for k in range(len(proof.active) + 1) for c in combinations(proof.active, k))
    chosen = (SimpleNamespace(active=part, symmetry=proof.symmetry) for part in parts)
    return any(_exactly_holds(problem, slope, part, bounds, beyond) for part in chosen)


def _exactly_holds(problem, slope, proof, bounds, beyond):
    active = [int(name[1:]) for name in proof.active]
    n, k = problem.n, len(active)
    rows = [problem.normals[j] for j in active]
    if len(reduced(rows)[1]) < k:
        return False
    matrix = [[*problem.form[i], *(-row[i] for row in rows)] for i in range(n)]
    matrix += [[*row, *[ZERO] * k] for row in rows]
    right = [*(-g for g in slope), *(problem.offsets[j] for j in active)]
    answer = solved(matrix, right)
    if answer is None or not all(lam >= 0 for lam in answer[0][n:]):
        return False
    z, alone = answer
    # A multiplier of 0 holds nothing: the form has to be positive where the others alone hold.
    # That suffices, and is more than a minimum needs, so a false theorem never passes by it.
    strong = [row for row, lam in zip(rows, z[n:], strict=True) if lam]
    if len(strong) < k and not alone:
        return False
    basis = null_space(strong or [[ZERO] * n], n)
    form = restricted(problem.form, basis)
    positive, negative = inertia(form)
    if alone:
        inside = all(lo <= x <= up for x, (lo, up) in zip(z[:n], bounds, strict=True))
        strict = positive == len(basis) and not (beyond and z[0])
        return inside and strict and _face_alone(problem, active, _signs_at(problem, z[:n]))
    if negative or not proof.symmetry:
        return False
    # A whole locus: along it the form and the terms of higher order have to vanish altogether.
    kernel = [combined(basis, weights) for weights in null_space(form, len(basis))]
    if any(any(applied(problem.form, v)) or (beyond and v[0]) for v in kernel):
        return False
    for row, b in zip(rows, right[n:], strict=True):
        lower, upper = span(row, bounds)
        if not lower <= b <= upper:
            return False
    return _face_alone(problem, active, _signs_on(problem, bounds, active))


def _signs_at(problem, point):
    values = [x - b for x, b in zip(applied(problem.normals, point), problem.offsets, strict=True)]
    return [(v > 0) - (v < 0) for v in values]


def _signs_on(problem, bounds, active):
    signs = []
    for j, (row, b) in enumerate(zip(problem.normals, problem.offsets, strict=True)):
        lower, upper = span(row, bounds)
        signs.append(0 if j in active else 1 if lower > b else -1 if upper < b else 0)
    return signs


def _face_alone(problem, active, signs):
    """Whether every branch of the tree near the point asks for all active functions, and one is."""
    joined = {j for group in problem.groups for j in group}
    alone = [j for j in range(len(signs)) if j not in joined]
    branches = [{*alone, *choice} for choice in product(*problem.groups)]
    pieces = [{j for j in b if not signs[j]} for b in branches if all(signs[j] >= 0 for j in b)]
    return bool(pieces) and all(piece >= set(active) for piece in pieces)


def _nearly_holds(problem, proof, bounds):
    """The same to fifty digits, away from ``c``, where the solution is no rational number."""
    with mpmath.workdps(50):
        d = [mpmath.mpf((lo + up).numerator) / (lo + up).denominator / 2 for lo, up in bounds]
        form = mpmath.matrix([list(map(_real, row)) for row in problem.form])
        slope = form * mpmath.matrix(d) + mpmath.matrix(list(map(_real, problem.slope)))
        third, fourth = _real(problem.third), _real(problem.fourth)
        slope[0] += 3 * third * d[0] ** 2 + 4 * fourth * d[0] ** 3
        form[0, 0] += 6 * third * d[0] + 12 * fourth * d[0] ** 2
        active = [int(name[1:]) for name in proof.active]
        rows = [problem.normals[j] for j in active]
        small = mpmath.mpf(10) ** -15
        if rows:
            normals = mpmath.matrix([list(map(_real, row)) for row in rows])
            weights = mpmath.lu_solve(normals * normals.T, normals * slope)
            slope -= normals.T * weights
            if not min(weights) > small:
                return False
        basis = null_space(rows or [[ZERO] * problem.n], problem.n)
        if basis:
            across = mpmath.matrix([list(map(_real, v)) for v in basis])
            if not min(mpmath.eigsy(across * form * across.T, eigvals_only=True)) > small:
                return False
        stationary = max(abs(x) for x in slope) < small
        return stationary and _face_alone(problem, active, _signs_on(problem, bounds, active))


def _real(x):
    return mpmath.mpf(x.numerator) / x.denominator
