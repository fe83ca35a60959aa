"""Matrices of islands, against dense ones."""

import numpy as np
import pytest

from polycorner.motion.engine import band
from tests.support.stages import callable_stage

solve_band, fill_in = callable_stage(band.solve_band), callable_stage(band.fill_in)
place_rows = callable_stage(band.place_rows)


def stored(A, K, touch):
    """Return the arguments of the solver for a matrix of bodies, of which some pairs touch."""
    n = len(touch)
    begin = np.arange(n)
    end = np.array(
        [1 + max(np.flatnonzero(row), default=0) for row in touch | np.eye(n, dtype=bool)]
    )
    fill_in(begin, end, n)
    line = np.zeros(n, dtype=int)
    rows = np.full(place_rows(K, begin, end, line, n), np.nan)
    for i in range(n * K):
        body = i // K
        place = line[body] + (i - body * K) * (end[body] - begin[body]) * K
        columns = np.arange(begin[body] * K, end[body] * K)
        rows[place + columns] = A[i, columns]
    assert not np.isnan(rows).any()  # rows stand side by side, without gaps
    return rows, (n, K, begin, end, line, np.zeros(16))


@pytest.mark.parametrize("K", [4, 8])
@pytest.mark.parametrize(("n", "reach"), [(1, 0), (2, 1), (6, 5), (30, 4), (40, 0), (25, 25)])
def test_systems_are_solved(n, reach, K):
    """Pairs that touch are drawn, at most so far apart: elimination fills in the rest."""
    rng = np.random.default_rng(n)
    apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    for share in (0.2, 1.0):
        touch = (apart <= reach) & (rng.random((n, n)) < share)
        touch = touch | touch.T | (apart == 0)
        A = np.kron(touch, np.ones((K, K))) * rng.normal(size=(n * K, n * K))
        A += 3 * K * (reach + 1) * np.eye(n * K)
        b = rng.normal(size=n * K)
        rows, rest = stored(A, K, touch)
        x = b.copy()
        assert solve_band(rows, x, *rest)
        np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("column", range(4))
def test_a_matrix_without_a_pivot_is_refused(column):
    A = np.eye(8)
    A[:, column] = A[:, 4 + column] = 0.0
    rows, rest = stored(A, 4, np.ones((2, 2), dtype=bool))
    assert not solve_band(rows, np.ones(8), *rest)
