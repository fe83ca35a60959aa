"""Corners of sparse polyhedra by Newton's method: found to rounding, or declined."""

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

from polycorner.minimisation.sparse.faces import on_corner


def powers(exponents):
    """Return the functions ``(u_i - i)^k`` with their derivatives."""
    k, at = np.array(exponents), np.arange(len(exponents))

    def evaluate(u):
        return (u - at) ** k, csr_array(diags_array(k * (u - at) ** (k - 1.0)))

    return evaluate


def test_a_corner_with_independent_gradients_is_found_with_its_multipliers():
    found = on_corner(powers([1, 1, 1]), np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.9, 2.2]))
    assert np.allclose(found.point, [0, 1, 2], atol=1e-15)
    assert np.allclose(found.multipliers, [1, 2, 3])
    assert found.residual < 1e-15


@pytest.mark.parametrize("power", [2, 4])
def test_a_multiple_root_is_declined(power):
    """Steps shorten by a factor only, and multipliers grow without bound as they do."""
    start = np.array([0.05, 1.0])
    assert on_corner(powers([power, 1]), np.array([1.0, 1.0]), start) is None
