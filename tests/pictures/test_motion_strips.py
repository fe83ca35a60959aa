"""Rows of pictures of motions of bodies: at equal steps, with the contacts that are closed."""

import numpy as np
import pytest

from polycorner import simulate
from polycorner.bodies import Arrangement, box, capsule, disc
from polycorner.models.spheres import SphereCluster
from polycorner.pictures import draw_motion

ROD = Arrangement({"A": capsule([-1, 0], [1, 0], 0.3)}, box([-3, 0], [3, 4]))
# Along the floor, from the left wall to the right one; a unit is as long as the scale.
ALONG = np.array([[x, 0.3, 0.0] for x in (-1.7, -1.0, 0.0, 1.2, 1.7)])


def marks(axes):
    """The points that are marked."""
    return [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]


def test_frames_along_an_edge_are_at_equal_steps():
    panes = draw_motion(ROD, ALONG, 5).axes
    lengths = [float(pane.get_title().split("\n")[0]) for pane in panes]
    np.testing.assert_allclose(lengths, np.linspace(0, 3.4 / 0.3, 5), atol=0.006)
    for pane, x in zip(panes, np.linspace(-1.7, 1.7, 5), strict=True):
        (points,) = marks(pane)
        floor = points[points[:, 1] < 0.01]
        np.testing.assert_allclose(np.sort(floor[:, 0]), [x - 1, x + 1], atol=1e-9)


def test_contacts_that_open_and_close_are_named():
    titles = [pane.get_title() for pane in draw_motion(ROD, ALONG, 3).axes]
    assert titles[0].endswith("opening A.v1-left")
    assert titles[1].endswith("\n")
    assert titles[2].endswith("closing A.v2-right")


def test_a_trajectory_is_shown_at_equal_times():
    a = Arrangement({"D": disc(0.5)}, box([0, 0], [4, 4]))
    system = a.system(count=2, gravity=[0, -10])
    path = simulate(system, system.state([[1, 0.5], [3, 2.5]]), 1.0, 0.01)
    panes = draw_motion(a, path, 3).axes
    assert [pane.get_title() for pane in panes] == ["0 s", "0.5 s", "1 s"]
    (first,), (last,) = marks(panes[1]), marks(panes[2])
    np.testing.assert_allclose(first, [[1, 0]], atol=1e-6)
    np.testing.assert_allclose(last, [[1, 0], [3, 0]], atol=1e-6)


def test_what_is_no_motion_is_refused():
    with pytest.raises(ValueError, match="polyline: expected at least two points"):
        draw_motion(ROD, [0, 1, 0])
    a = Arrangement({"D": disc(0.5)}, box([0, 0], [4, 4]))
    system = a.system()
    path = simulate(system, system.state([1, 1]), 0.1, 0.01)
    with pytest.raises(TypeError, match="polyline: expected points of the cluster"):
        draw_motion(SphereCluster(3), path)
    with pytest.raises(ValueError, match="polyline: expected one of the coordinates xA, yA"):
        draw_motion(ROD, path)
