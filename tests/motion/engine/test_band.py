"""Band matrices, against dense ones."""

import numpy as np
import pytest

from polycorner.motion.engine import band
from tests.support.stages import callable_stage

solve_band, row_length = callable_stage(band.solve_band), callable_stage(band.row_length)


@pytest.mark.parametrize(("n", "width"), [(1, 0), (6, 5), (30, 7), (40, 0)])
def test_band_systems_are_solved(n, width):
    rng = np.random.default_rng(n)
    near = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= width
    A = np.where(near, rng.normal(size=(n, n)), 0) + 3 * (width + 1) * np.eye(n)
    b = rng.normal(size=n)
    rows = np.zeros(n * row_length(width))
    for i, j in np.argwhere(near):
        rows[i * row_length(width) + width + j - i] = A[i, j]
    x = b.copy()
    assert solve_band(rows, x, n, width, np.zeros(n, dtype=int))
    np.testing.assert_allclose(A @ x, b, atol=1e-10)


def test_a_matrix_without_a_pivot_is_refused():
    rows = np.zeros(3 * row_length(0))
    assert not solve_band(rows, np.ones(3), 3, 0, np.zeros(3, dtype=int))
