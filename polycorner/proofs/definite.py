"""Positive definiteness of a form on a tangent space, for all matrices in an enclosure."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from polycorner.intervals.balls import matrix

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball, Matrix
    from polycorner.spaces.manifold import Array

Rows: TypeAlias = "Sequence[Sequence[Ball]]"


def tangent_form(curvature: Rows, rows: Rows, scales: Sequence[float]) -> "list[list[Ball]] | None":
    """Return a symmetric form restricted to the null space of ``rows``, nearly diagonal.

    In scaled coordinates, with ``C`` the rows and ``Z``, ``R`` floating-point approximations of an
    orthonormal basis of their null space and of their pseudoinverse, the columns of
    ``Z - R (C R)^-1 C Z`` are annihilated by ``C``, for every ``C`` in the enclosure.  The basis is
    then turned into approximate eigenvectors.  None where the inverse cannot be enclosed.
    """
    n, m = len(scales), len(rows)
    if m >= n:
        return []
    hessian = matrix([_scaled(row, scales, s) for row, s in zip(curvature, scales, strict=True)])
    basis: Matrix | None = matrix(np.eye(n).tolist())
    if m:
        basis = _null_space([_scaled(row, scales, 1.0) for row in rows])
    if basis is None:
        return None
    form = basis.transpose() * hessian * basis
    middle = _floats(form)
    if not np.isfinite(middle).all():
        return None
    turn = matrix(np.linalg.eigh((middle + middle.T) / 2)[1].tolist())
    return list((turn.transpose() * form * turn).tolist())


def _scaled(row: "Sequence[Ball]", scales: Sequence[float], factor: float) -> "list[Ball]":
    return [x * s * factor for x, s in zip(row, scales, strict=True)]


def _floats(rows: "Matrix") -> "Array":
    return np.array([[float(x.mid()) for x in row] for row in rows.tolist()])


def _null_space(rows: "list[list[Ball]]") -> "Matrix | None":
    middle = _floats(matrix(rows))
    sizes = np.linalg.norm(middle, axis=1)
    if not np.isfinite(middle).all() or not sizes.all():
        return None
    units = middle / sizes[:, None]
    held = matrix([[x / s for x in row] for row, s in zip(rows, sizes.tolist(), strict=True)])
    null = matrix(np.linalg.svd(units)[2][len(rows) :].T.tolist())
    pseudo = matrix(np.linalg.pinv(units).tolist())
    try:
        return null - pseudo * (held * pseudo).solve(held * null)
    except ZeroDivisionError:
        return None


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
