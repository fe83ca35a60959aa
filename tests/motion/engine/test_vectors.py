"""Vectors of eight reals, against NumPy."""

import numpy as np
from numba import njit

from polycorner.motion.engine.vectors import dot, load, store, zeros


@njit
def combine(x, y, out, factor):
    """Write ``0 + factor x - y`` from the third number on; return ``x . y``."""
    first, second = load(x, 1), load(y, 2)
    store(out, 3, zeros() + factor * first - second)
    return dot(first, second)


def test_vectors_are_those_of_numpy_bit_for_bit():
    rng = np.random.default_rng(0)
    for _ in range(100):
        x, y = rng.normal(size=9), rng.normal(size=10)
        out = np.full(12, np.nan)
        product = combine(x, y, out, 0.3)
        np.testing.assert_array_equal(out[3:11], 0.3 * x[1:] - y[2:])
        assert np.isnan(out[[0, 1, 2, 11]]).all()
        terms = x[1:] * y[2:]
        while len(terms) > 1:  # by halves, whatever the processor
            terms = terms[: len(terms) // 2] + terms[len(terms) // 2 :]
        assert product == terms[0]
