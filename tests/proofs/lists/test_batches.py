"""Small linear systems, many at a time."""

import numpy as np
import pytest

from polycorner.proofs.lists.attempts import inverted, solved

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("seen", [True, False])
def test_a_singular_matrix_costs_the_others_nothing(seen, monkeypatch):
    """Also where the determinant is rounded another way than the elimination."""
    matrix, right = RNG.standard_normal((5, 3, 3)), RNG.standard_normal((5, 3))
    matrix[2] = 0.0
    if not seen:
        monkeypatch.setattr(np.linalg, "slogdet", lambda m: (np.ones(len(m)), np.zeros(len(m))))
    x, inverse = solved(matrix, right), inverted(matrix)
    regular = np.arange(5) != 2
    assert np.isnan(x[2]).all()
    assert np.isnan(inverse[2]).all()
    assert np.einsum("bij,bj->bi", matrix, x)[regular] == pytest.approx(right[regular])
    assert (matrix @ inverse)[regular] == pytest.approx(np.tile(np.eye(3), (4, 1, 1)), abs=1e-9)
