"""Positive definiteness of a form on a tangent space, for all matrices in an enclosure."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from polycorner.intervals.balls import ball, matrix

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

Rows: TypeAlias = "Sequence[Sequence[Ball]]"


def tangent_form(curvature: Rows, rows: Rows, scales: Sequence[float]) -> "list[list[Ball]] | None":
    """Return a symmetric form restricted to the null space of ``rows``, in scaled coordinates.

    The basis is turned into approximate eigenvectors, so that the form is nearly diagonal.  None
    where the null space could not be enclosed.
    """
    basis = tangents([_scaled(row, scales, 1.0) for row in rows], len(scales))
    if basis is None:
        return None
    hessian = [_scaled(row, scales, s) for row, s in zip(curvature, scales, strict=True)]
    if not basis:
        return []
    across = matrix(basis)
    form = across * matrix(hessian) * across.transpose()
    middle = np.array([[float(x.mid()) for x in row] for row in form.tolist()])
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
