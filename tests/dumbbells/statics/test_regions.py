"""Regions of a rectangle between curves."""

import numpy as np
import pytest

from polycorner.dumbbells.statics.regions import Plane, deepest, joined, near

PLANE = Plane(((1.0, 8.0), (1.0, 8.0)), 60)


def circle(radius):
    angle = np.linspace(0, 2 * np.pi, 40)
    return np.exp(np.log(np.sqrt(8)) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))


@pytest.mark.parametrize("radii", [(0.5,), (0.3, 0.8)])
def test_circles_separate_what_is_inside(radii):
    lines = [PLANE.smooth(circle(radius)) for radius in radii]
    labels = PLANE.labels(lines)
    first, second = np.meshgrid(*map(np.log, PLANE.axes), indexing="ij")
    apart = np.hypot(first - np.log(8) / 2, second - np.log(8) / 2)
    rings = np.searchsorted(radii, apart)
    clear = abs(apart[..., None] - np.array(radii)).min(axis=-1) > 0.02
    for k in range(len(radii) + 1):
        assert len(np.unique(labels[(rings == k) & clear])) == 1
    assert len(np.unique(labels[clear])) == len(radii) + 1
    middle = labels == labels[30, 30]
    assert np.hypot(*np.subtract(deepest(middle), 29.5)) < 3


def test_a_curve_that_ends_inside_separates_nothing():
    assert len(np.unique(PLANE.labels([PLANE.smooth(circle(0.5)[:25])]))) == 1


def test_ways_cross_lines_or_do_not():
    line = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]])
    assert not joined(np.array([0.0, 1.0]), np.array([1.0, 0.0]), [line])
    assert not joined(np.array([1.0, 2.0]), np.array([1.0, 0.0]), [line])
    assert joined(np.array([0.0, 1.0]), np.array([1.0, 2.0]), [line])
    assert joined(np.array([0.5, 0.0]), np.array([1.5, 0.0]), [line])


def test_lines_are_near_all_along_or_not():
    line = PLANE.smooth(circle(0.5))
    assert near(line[3:9] + 0.01, [line], 0.1)
    assert not near(PLANE.smooth(circle(0.6)), [line], 0.1)
    assert not near(line, [line[:5]], 0.1)
    np.testing.assert_allclose(PLANE.placed(PLANE.points(line)), line, atol=1e-9)
