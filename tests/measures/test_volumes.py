"""Volumes and moments against closed forms."""

import math

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron
from polycorner.measures import Weighting, volume

M = Manifold.euclidean("x y z")
x, y, z = M.symbols
BALL = Polyhedron(M, {"ball": 1 - x**2 - y**2 - z**2, "floor": z})


def close(estimate, exact):
    return abs(estimate.value - exact) <= 5 * estimate.error


def test_half_a_ball():
    """Volume ``2 pi / 3``, centroid at ``3/8``, variances ``1/5`` and ``1/5 - 9/64``."""
    (found,) = volume(BALL, [(-1, 1), (-1, 1), (0, 1)], points=2**12, rng=1)
    assert close(found.volume, 2 * math.pi / 3)
    share = found.volume.value / 4
    assert found.volume.error < 2 * math.sqrt(share * (1 - share) / 2**16)  # half of random points'
    assert found.volume.effective > 4 * 2**16
    assert all(close(m, e) for m, e in zip(found.mean, (0, 0, 3 / 8), strict=True))
    assert found.covariance == pytest.approx(np.diag([0.2, 0.2, 0.2 - 9 / 64]), abs=3e-3)


def test_sublevel_sets_of_a_height():
    """Below the height ``c``: ``pi (c - c^3 / 3)``."""
    levels = (0.2, 0.5, 2.0)
    found = volume(
        BALL, [(-1, 1), (-1, 1), (0, 1)], levels=levels, weighting=Weighting(energy=z),
        points=2**12, rng=2,
    )  # fmt: skip
    for one, c in zip(found, np.minimum(levels, 1.0), strict=True):
        assert close(one.volume, math.pi * (c - c**3 / 3))


def test_two_hard_discs_on_a_torus():
    """The free area, by a cut at every ``x``."""
    T = Manifold(("x", "y"), periods=(1.0, 1.0))
    import sympy

    a, b = (sympy.sin(sympy.pi * u) for u in T.symbols)
    D = Polyhedron(T, {"apart": a**2 + b**2 - 0.09})
    (found,) = volume(D, [(0, 1), (0, 1)], points=2**14, rng=3)
    u = np.linspace(-0.5, 0.5, 2001)
    inside = np.clip(0.09 - np.sin(np.pi * u) ** 2, 0, None)
    taken = np.trapezoid(2 * np.arcsin(np.sqrt(inside)) / np.pi, u)
    assert found.volume.value == pytest.approx(1 - taken, abs=5 * found.volume.error + 1e-5)


def test_refusals():
    box = [(-1, 1), (-1, 1), (0, 1)]
    with pytest.raises(ValueError, match="power of two"):
        volume(BALL, box, points=100)
    with pytest.raises(ValueError, match="without an energy"):
        volume(BALL, box, levels=[1.0])
    with pytest.raises(ValueError, match="increasing bounds"):
        volume(BALL, box[:2])
