"""What the compiled step is made of: projections on cones, band matrices; and heaps converge."""

import math

import numpy as np
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st
from scipy.optimize import minimize

from polycorner.models.drum import DumbbellDrum
from polycorner.motion import compiled
from polycorner.motion.noise import Noise
from polycorner.studies.drum_starts import bunch

NUMBERS = st.floats(-3, 3).map(lambda x: round(x, 3))


def projected(mu, z):
    out = np.zeros(12)
    compiled.project_cone.py_func(mu, *z, out)
    return out[:3], out[3:].reshape(3, 3)


@given(st.floats(0.05, 2), st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_nothing_in_the_cone_is_nearer_than_the_projection(mu, z):
    """Variational inequality: (z - proj z).(y - proj z) <= 0 for all y of the cone."""
    z = np.array(z)
    nearest, _ = projected(mu, z)
    assert math.hypot(*nearest[1:]) <= mu * nearest[0] + 1e-12
    angles = np.linspace(0, math.tau, 60)
    rays = np.stack([np.ones(60), mu * np.cos(angles), mu * np.sin(angles)], axis=-1)
    for y in (*rays, *(5 * rays), np.zeros(3), np.array([1.0, 0, 0])):
        assert (z - nearest) @ (y - nearest) <= 1e-10


def test_the_projection_is_what_a_minimiser_finds():
    mu, z = 0.3, np.array([0.2, 0.7, -0.4])
    cone = {"type": "ineq", "fun": lambda y: mu * y[0] - math.hypot(y[1], y[2])}
    found = minimize(lambda y: np.sum((y - z) ** 2), [1.0, 0.1, 0.1], constraints=cone, tol=1e-14)
    np.testing.assert_allclose(projected(mu, z)[0], found.x, atol=1e-6)


@given(st.floats(0.05, 2), st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_its_derivative_is_the_limit_of_differences(mu, z):
    z, h = np.array(z), 1e-6
    far = math.hypot(z[1], z[2])
    if min(abs(far - mu * z[0]), abs(mu * far + z[0]), far) < 1e-3:
        reject()  # it has none on the cone, on its polar, and none that is bounded on the axis
    differences = [
        (projected(mu, z + d)[0] - projected(mu, z - d)[0]) / (2 * h) for d in h * np.eye(3)
    ]
    np.testing.assert_allclose(projected(mu, z)[1], np.transpose(differences), atol=1e-5)


@pytest.mark.parametrize(("n", "width"), [(1, 0), (6, 5), (30, 7), (40, 0)])
def test_band_systems_are_solved(monkeypatch, n, width):
    monkeypatch.setattr(compiled, "stay_whole", lambda: None)
    rng = np.random.default_rng(n)
    near = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= width
    A = np.where(near, rng.normal(size=(n, n)), 0) + 3 * (width + 1) * np.eye(n)
    b = rng.normal(size=n)
    band = np.zeros(n * (2 * width + 1))
    for i, j in np.argwhere(near):
        band[i * (2 * width + 1) + width + j - i] = A[i, j]
    x = b.copy()
    assert compiled.solve_band.py_func(band, x, n, width)
    np.testing.assert_allclose(A @ x, b, atol=1e-10)


def test_a_matrix_without_a_pivot_is_refused(monkeypatch):
    monkeypatch.setattr(compiled, "stay_whole", lambda: None)
    assert not compiled.solve_band.py_func(np.zeros(3), np.ones(3), 3, 0)


def test_chattering_heaps_are_solved():
    """Dumbbells that hold each other in many ways, their loads drawn anew twenty times a second."""
    drum = DumbbellDrum(count=12, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    engine = drum.engine(starts, noise=Noise(chatter=0.3, seed=1))
    engine.advance(4000)
    effort = engine.effort
    assert effort.islands > 1000
    assert effort.unconverged < 0.01 * effort.islands
