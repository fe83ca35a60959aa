"""Barriers of friction sets, against central differences."""

from types import SimpleNamespace

import numpy as np
import pytest

from polycorner.motion.engine import sets
from polycorner.motion.friction import ConvexPolygon, CutDisc, Disc, Ellipse, Interval

SQUARE = ConvexPolygon([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
EDGES = {  # how far a force (load, x, y) is from the boundary: a product, from the definition
    Interval(lower=-0.2, upper=0.5): lambda n, x, _: (x + 0.2 * n) * (0.5 * n - x),
    Disc(0.4): lambda n, x, y: n**2 - (x**2 + y**2) / 0.4**2,
    Ellipse(0.5, 0.3): lambda n, x, y: n**2 - (x / 0.5) ** 2 - (y / 0.3) ** 2,
    CutDisc(0.5, 0.3): lambda n, x, y: (
        (n**2 - (x**2 + y**2) / 0.5**2) * (0.3 * n - x) * (0.3 * n + x)
    ),
    SQUARE: lambda n, x, y: (0.25 * n**2 - x**2) * (0.25 * n**2 - y**2),
}


def model_with(shape):
    """Model constants with one set."""
    kind, numbers, vertices = shape.code
    vertices = np.asarray(vertices).reshape(-1, 2)
    return SimpleNamespace(
        set_kinds=[kind],
        set_sizes=np.array([[*numbers, 0, 0, 0, 0][:4]]),
        first_vertex=[0, len(vertices)],
        vertices=vertices,
    )


@pytest.mark.parametrize("shape", EDGES, ids=lambda shape: type(shape).__name__)
def test_barriers_are_differentiated(monkeypatch, shape):
    """Gradient and Hessian of ``-log`` of the distance, against central differences."""
    for name in ("add_linear_barrier", "add_quadratic_barrier"):
        monkeypatch.setattr(sets, name, getattr(sets, name).py_func)
    model, h = model_with(shape), 1e-5
    at, out = np.array([1.3, 0.11, -0.07]), np.zeros(9)
    if isinstance(shape, Interval):
        at[2] = 0.0

    def slope(z):
        sets.barrier.py_func(model, 0, *z, out)
        return out[:3].copy()

    def value(z):
        return -np.log(EDGES[shape](*z))

    steps = h * np.eye(3)
    expected = [(value(at + d) - value(at - d)) / (2 * h) for d in steps]
    np.testing.assert_allclose(slope(at), expected, rtol=1e-6, atol=1e-8)
    curvature = np.array([(slope(at + d) - slope(at - d)) / (2 * h) for d in steps])
    slope(at)
    found = np.array([[out[3], out[4], out[5]], [out[4], out[6], out[7]], [out[5], out[7], out[8]]])
    if isinstance(shape, Interval):  # what it does not hold is not to vanish
        assert found[2, 2] == 1.0
        found[2, 2] = 0.0
    np.testing.assert_allclose(found, curvature, rtol=1e-6, atol=1e-7)
