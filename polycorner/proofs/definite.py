"""Positive definiteness of a form on a tangent space, for all matrices in an enclosure."""

from collections.abc import Sequence
from itertools import combinations
from typing import TypeAlias

import numpy as np

from polycorner.intervals.balls import Ball, Matrix, ball, matrix, middles
from polycorner.spaces.manifold import Array

SHARPNESS = (3.0, 30.0, 300.0)  # with which least eigenvalues are smoothed, relative to the form

Rows: TypeAlias = "Sequence[Sequence[Ball]]"


def tangent_form(curvature: Rows, rows: Rows, scales: Sequence[float]) -> "list[list[Ball]] | None":
    """Return a symmetric form restricted to the null space of ``rows``, in scaled coordinates.

    The basis is turned into approximate eigenvectors, so that the form is nearly diagonal.  None
    where the null space could not be enclosed.
    """
    basis = tangents([_scaled(row, scales, 1.0) for row in rows], len(scales))
    if basis is None:
        return None
    return _turned(_restricted(curvature, basis, scales)) if basis else []


def positive_on_cone(curvature: Rows, rows: Rows, slopes: Rows, scales: Sequence[float]) -> bool:
    """Whether a form is shown to be positive on ``{d != 0 : rows d = 0, slopes d >= 0}``.

    With ``G`` the slopes, it is if ``H - G^T N G`` is positive definite on the null space of the
    rows for a symmetric ``N`` without negative entries; for independent slopes, of which there are
    at most four, this is also necessary ([Diananda]).
    """
    basis = tangents([_scaled(row, scales, 1.0) for row in rows], len(scales))
    if not basis:
        return basis is not None
    form = _restricted(curvature, basis, scales)
    if is_definite(_turned(form)):
        return True
    across = matrix([_scaled(row, scales, 1.0) for row in slopes]) * matrix(basis).transpose()
    weights = _weights(middles(form.tolist()), middles(across.tolist()))
    if weights is None:
        return False
    shifted = form - across.transpose() * matrix(weights.tolist()) * across
    return is_definite(_turned(shifted))


def _weights(form: Array, slopes: Array) -> Array | None:
    """Return ``N`` for which the least eigenvalue of ``H - G^T N G`` is large, in doubles.

    The least eigenvalue is smoothed, more sharply in each round.
    """
    from scipy.optimize import minimize

    sizes = np.linalg.norm(slopes, axis=1)
    if not (np.isfinite(form).all() and np.isfinite(sizes).all() and sizes.all()):
        return None
    size = abs(form).max() or 1.0
    units, pairs = slopes / sizes[:, None], list(combinations(range(len(slopes)), 2))
    if not pairs:
        return None
    bends = np.array(
        [np.outer(units[i], units[j]) + np.outer(units[j], units[i]) for i, j in pairs]
    )

    def smoothed(nu: Array, sharpness: float) -> tuple[float, Array]:
        values, vectors = np.linalg.eigh(form / size - np.tensordot(nu, bends, 1))
        shares = np.exp(-sharpness * (values - values[0]))
        slope = np.einsum("ai,kab,bi,i->k", vectors, bends, vectors, shares / shares.sum())
        return float(-values[0] + np.log(shares.sum()) / sharpness), slope

    nu = np.zeros(len(pairs))
    for sharpness in SHARPNESS:
        nu = minimize(smoothed, nu, (sharpness,), jac=True, bounds=[(0, None)] * len(nu)).x
    weights = np.zeros((len(slopes), len(slopes)))
    for (i, j), share in zip(pairs, nu, strict=True):
        weights[i, j] = weights[j, i] = max(0.0, share) * size / (sizes[i] * sizes[j])
    return weights


def _restricted(curvature: Rows, basis: Rows, scales: Sequence[float]) -> "Matrix":
    hessian = matrix([_scaled(row, scales, s) for row, s in zip(curvature, scales, strict=True)])
    across = matrix(basis)
    return across * hessian * across.transpose()


def _turned(form: "Matrix") -> "list[list[Ball]]":
    middle = middles(form.tolist())
    if np.isfinite(middle).all():
        turn = matrix(np.linalg.eigh((middle + middle.T) / 2)[1].tolist())
        form = turn.transpose() * form * turn
    return list(form.tolist())


def _scaled(row: "Sequence[Ball]", scales: Sequence[float], factor: float) -> "list[Ball]":
    return [x * s * factor for x, s in zip(row, scales, strict=True)]


def tangents(rows: Rows, n: int) -> "list[list[Ball]] | None":
    """Return a basis of the vectors that independent rows annihilate, for all rows enclosed.

    Gauss-Jordan elimination, pivots being the largest entries of the longest row that is left:
    with ``[I N]`` the reduced rows, the columns of ``[-N; I]`` are the basis.
    """
    left = [list(row) for row in rows]
    columns: list[int] = []
    for k in range(len(left)):
        largest = [
            (float(abs(row[j]).mid()), i, j)
            for i, row in enumerate(left[k:], k)
            for j in range(n)
            if j not in columns
        ]
        if not largest:
            return None
        _, i, j = max(largest)
        if left[i][j].contains(0):
            return None
        left[k], left[i] = left[i], left[k]
        pivot = left[k][j]
        left[k] = [x / pivot for x in left[k]]
        left[k][j] = ball(1)
        for other in range(len(left)):
            factor = left[other][j]
            if other != k:
                left[other] = [x - factor * y for x, y in zip(left[other], left[k], strict=True)]
                left[other][j] = ball(0)
        columns.append(j)
    basis = []
    for free in (j for j in range(n) if j not in columns):
        vector = [ball(int(j == free)) for j in range(n)]
        for row, j in zip(left, columns, strict=True):
            vector[j] = -row[free]
        basis.append(vector)
    return basis


def is_definite(form: Rows) -> bool:
    """Whether every symmetric matrix enclosed is shown to be positive definite."""
    found = pivots(form)
    return len(found) == len(form) and all(pivot > 0 for pivot in found)


def is_regular(rows: Rows) -> bool:
    """Whether every matrix enclosed is shown to be regular."""
    try:
        matrix(rows).inv()
    except ZeroDivisionError:
        return False
    return True


def pivots(form: Rows) -> "list[Ball]":
    """Return the pivots of symmetric elimination, up to the first that is not positive.

    All positive: every symmetric matrix enclosed is positive definite.  One negative: none is.
    """
    rows = [list(row) for row in form]
    found: list[Ball] = []
    for k in range(len(rows)):
        pivot = rows[k][k]
        found.append(pivot)
        if not pivot > 0:
            break
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / pivot
            for j in range(i, len(rows)):
                rows[i][j] = rows[i][j] - factor * rows[k][j]
                rows[j][i] = rows[i][j]
    return found
