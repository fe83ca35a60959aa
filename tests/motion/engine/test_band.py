"""Band matrices, against dense ones."""

import numpy as np
import pytest

from polycorner.motion.engine import band


@pytest.mark.parametrize(("n", "width"), [(1, 0), (6, 5), (30, 7), (40, 0)])
def test_band_systems_are_solved(monkeypatch, n, width):
    monkeypatch.setattr(band, "never_inline", lambda: None)
    rng = np.random.default_rng(n)
    near = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= width
    A = np.where(near, rng.normal(size=(n, n)), 0) + 3 * (width + 1) * np.eye(n)
    b = rng.normal(size=n)
    rows = np.zeros(n * (2 * width + 1))
    for i, j in np.argwhere(near):
        rows[i * (2 * width + 1) + width + j - i] = A[i, j]
    x = b.copy()
    assert band.solve_band.py_func(rows, x, n, width, np.zeros(n, dtype=int))
    np.testing.assert_allclose(A @ x, b, atol=1e-10)


def test_a_matrix_without_a_pivot_is_refused(monkeypatch):
    monkeypatch.setattr(band, "never_inline", lambda: None)
    assert not band.solve_band.py_func(np.zeros(3), np.ones(3), 3, 0, np.zeros(3, dtype=int))
