"""Small pictures of relative placements: bodies where they are, contacts where they touch."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.dumbbells.pictures import draw_relative

SIZES = (16.0, 3.0, 1.5)


@pytest.mark.parametrize("radius", [125.0, np.inf])
def test_two_dumbbells_side_by_side_touch_at_two_balls(radius):
    model = RelativePlacements(DumbbellPair(*SIZES, radius))
    pair = model.pair
    x = 3.0 if pair.is_plane else float(np.arcsin(3 / pair.centre_radius))
    axes = Figure().add_subplot()
    draw_relative(model)(axes, np.array([x, 0.0, 0.0, 0.0]))
    circles = [patch for patch in axes.patches if isinstance(patch, Circle)]
    balls = np.array([c.center for c in circles if c.radius == pair.ball_radius])
    touching = np.array([c.center for c in circles if c.radius < pair.ball_radius])
    assert sorted(map(tuple, balls.round(2))) == [(-3, -8), (-3, 8), (3, -8), (3, 8)]
    assert sorted(map(tuple, abs(touching).round(2))) == [(0, 8), (0, 8)]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert (left, low) < (-6, -11)
    assert (right, high) > (6, 11)
