"""Vectors of four reals, against NumPy."""

import numpy as np
from numba import njit

from polycorner.motion.engine.vectors import entry, load, store, total, zeros


@njit
def combine(x, y, out, factor):
    """Write ``0 + factor x - x y`` from the third number on; return the sum of ``x y``."""
    first, second = load(x, 1), load(y, 2)
    store(out, 3, zeros() + factor * first - first * second)
    return total(first * second)


@njit
def entry_of(array, at):
    """Return a number of an array."""
    return entry(array, at)


def test_vectors_are_those_of_numpy_bit_for_bit():
    rng = np.random.default_rng(0)
    for _ in range(100):
        x, y = rng.normal(size=5), rng.normal(size=6)
        out = np.full(8, np.nan)
        product = combine(x, y, out, 0.3)
        terms = x[1:] * y[2:]
        np.testing.assert_array_equal(out[3:7], 0.3 * x[1:] - terms)
        assert np.isnan(out[[0, 1, 2, 7]]).all()
        assert product == (terms[0] + terms[2]) + (terms[1] + terms[3])  # on any processor


def test_places_count_through_all_axes():
    cube = np.arange(24.0).reshape(2, 3, 4)
    assert [entry_of(cube, at) for at in range(24)] == cube.ravel().tolist()
