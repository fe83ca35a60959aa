"""Pictures of arrangements: walls, bodies, and images in periodic boxes."""

from itertools import product

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d import proj3d

from polycorner.bodies import (
    Arrangement,
    HalfSpace,
    Robot,
    RobotJoint,
    RobotLink,
    box,
    capsule,
    disc,
    sphere,
)
from polycorner.pictures import draw_arrangement


def outlines(figure):
    """The lowest and highest corners of all outlines, ``(k, 2, 2)``."""
    patches = [p.get_xy() for p in figure.axes[0].patches if isinstance(p, Polygon)]
    return np.array([[xy.min(axis=0), xy.max(axis=0)] for xy in patches])


def test_bodies_are_drawn_once_without_a_period():
    a = Arrangement([disc(0.1), disc(0.2)], {"floor": HalfSpace([0, 1], [0, 0])})
    assert len(outlines(draw_arrangement(a, a.point({"1": [0, 1], "2": [1, 1]})))) == 3


def test_a_box_of_walls_is_seen_whole():
    a = Arrangement([disc(0.1)], box([-1, 0], [1, 3]))
    axes = draw_arrangement(a, [0.5, 0.2]).axes[0]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert left < -1
    assert right > 1
    assert -0.5 < low < 0
    assert 3 < high < 3.5


def test_images_reach_into_the_box_from_all_sides():
    a = Arrangement([disc(0.1), disc(0.1)], period=[1, 1])
    figure = draw_arrangement(a, a.point({"1": [5, -3], "2": [0.5, 0.5]}))
    assert len(figure.axes[0].lines) == 4
    middles = {tuple(np.round(some.mean(axis=0), 2) + 0.0) for some in outlines(figure)}
    assert middles == {(0, 0), (0, 1), (1, 0), (1, 1), (0.5, 0.5)}


def test_in_a_channel_there_are_images_along_it():
    a = Arrangement([capsule([0, 0], [0.5, 0], 0.1), disc(0.1)], period=[1, None])
    figure = draw_arrangement(a, a.point({"1": [0.7, 0], "2": [0.3, 0.4]}))
    assert len(figure.axes[0].lines) == 2
    assert len(outlines(figure)) == 3


def test_in_space_bodies_are_in_the_box():
    a = Arrangement([sphere(0.1), sphere(0.2)], period=[1, 1, 1])
    figure = draw_arrangement(a, a.point({"1": [5.1, -2.9, 0], "2": [0.5, 0.5, 0.5]}))
    low, high = figure.axes[0].get_xlim()
    assert (low, high) == pytest.approx((-0.15, 1.15), abs=0.05)
    assert len(figure.axes[0].collections) == 2


def test_in_space_without_walls_there_are_no_outlines():
    a = Arrangement([sphere(0.1), sphere(0.2)])
    figure = draw_arrangement(a, a.point({"1": [0, 0, 0], "2": [0.5, 0, 0]}))
    assert len(figure.axes[0].collections) == 1


def test_in_space_nothing_is_cut_off():
    """Names of axes, their numbers, and the cube that is seen are within the figure."""
    a = Arrangement([sphere(0.1)], box([0, 0, 0], [1, 1, 1]), unit="angstrom")
    figure = draw_arrangement(a, [0.5, 0.5, 0.1], titles=["at rest"])
    (axes,) = figure.axes
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    around = [
        axis.get_tightbbox(canvas.get_renderer()) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)
    ]
    for seen in (axes.title.get_window_extent(), *around):
        assert figure.bbox.x0 <= seen.x0
        assert seen.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= seen.y0
        assert seen.y1 <= figure.bbox.y1
    low, high = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T
    for corner in product(*zip(low, high, strict=True)):
        x, y, _ = proj3d.proj_transform(*corner, axes.get_proj())
        assert axes.bbox.contains(*axes.transData.transform((x, y)))


def test_a_robot_is_drawn_with_what_it_touches():
    rod = RobotLink(capsule([0, 0, 0], [0, 0, -1], 0.1))
    joints = {"pivot": RobotJoint("stand", "rod", axis=[0, 1, 0])}
    end = np.array([-np.sin(0.3), 0, -np.cos(0.3) - 0.1])
    floor = {"floor": HalfSpace([0, 0, 1], end)}
    robot = Robot({"stand": RobotLink(), "rod": rod}, joints, walls=floor)
    (axes,) = draw_arrangement(robot, [0.3], contacts=True).axes
    (marks,) = [line for line in axes.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(np.ravel(marks.get_data_3d()), end, atol=1e-9)
    with pytest.raises(ValueError, match="points: expected at least one point; got 'none'"):
        draw_arrangement(robot, np.empty((0, 1)))
