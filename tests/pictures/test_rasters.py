"""Pictures by a depth buffer against rays that are followed step by step."""

import numpy as np
import pytest
from hulls import distance
from scipy.spatial.transform import Rotation

from polycorner.bodies import capsule, polytope, sphere
from polycorner.pictures.rasters import DARK, EDGE, FINE, Raster

CORNERS = [[x, y, z] for x in (-1, 1) for y in (-0.7, 0.7) for z in (-0.5, 0.5)]
SOLIDS = {
    "ball": sphere(0.9, [0.2, 0, 0]),
    "rod": capsule([-1, 0, 0.2], [0.8, 0.5, 0], 0.3),
    "sharp": polytope(CORNERS),
    "rounded": polytope(CORNERS, 0.2),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_the_first_point_on_each_ray_is_seen(name):
    (part,) = SOLIDS[name].parts.values()
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    raster = Raster(30, np.array([[-2.0] * 3, [2.0] * 3]))
    raster.part(part, np.array([0.1, 0.2, -0.1]), turn, "red")
    placed = part.moved(np.array([0.1, 0.2, -0.1]), turn)
    rng = np.random.default_rng(0)
    hits = 0
    for i, j in rng.integers(0, 30 * FINE, (80, 2)):
        x, y, depth = raster.x[j], raster.y[i], raster.depth[i, j]
        heights = np.linspace(3, -3, 400) if np.isinf(depth) else [depth + 0.02, depth - 0.02]
        points = np.array([[x, y, z] for z in heights]) @ raster.frame.T
        gaps = [distance(p[None], placed.points) - placed.radius for p in points]
        if np.isinf(depth):
            assert min(gaps) > -0.005
        else:  # outside, then inside; along the rim by less than a step
            assert gaps[0] > -1e-6
            assert gaps[1] < 0.02
            hits += 1
    assert hits > 2


def test_what_is_nearer_hides_what_is_behind():
    for order in ((0, 1), (1, 0)):
        raster = Raster(40, np.array([[-2.0] * 3, [2.0] * 3]))
        (ball,) = sphere(0.5).parts.values()
        near, far = raster.frame[:, 2], -raster.frame[:, 2]
        for k in order:
            raster.part(ball, (near, far)[k], np.eye(3), ("red", "blue")[k])
        red, _, blue = raster.picture()[20, 20].tolist()
        assert red > 100
        assert blue < 30


def test_lines_are_hidden_and_marks_are_not():
    raster = Raster(40, np.array([[-2.0] * 3, [2.0] * 3]))
    (ball,) = sphere(0.5).parts.values()
    raster.part(ball, np.zeros(3), np.eye(3), "white")
    right, away = raster.frame[:, 0], raster.frame[:, 2]
    raster.lines([np.array([-2 * right - away, 2 * right - away])], "blue")
    before = raster.picture()
    row = before[19:21].astype(int)
    assert (row[:, 3, 2] - row[:, 3, 0] > 60).any()
    assert abs(row[:, 20, 2] - row[:, 20, 0]).max() < 5
    raster.mark(np.array([-away]), 0.2, "red")
    assert raster.picture()[20, 20, 0] > raster.picture()[20, 20, 2] + 60


def test_edges_of_sharp_parts_are_darker_than_their_faces():
    """The middles of three edges between visible faces of a cube, and those of the faces."""
    raster = Raster(200, np.array([[-1.0] * 3, [1.0] * 3]))
    cube = polytope([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    raster.part(cube.parts[""], np.zeros(3), np.eye(3), "white")

    def darkest(point):
        x, y, _ = point @ raster.frame
        i, j = np.argmin(abs(raster.y - y)), np.argmin(abs(raster.x - x))
        return raster.colour[i - 1 : i + 2, j - 1 : j + 2].min()

    corner = np.sign(raster.frame[:, 2]) / 2
    for axis in np.eye(3):
        assert darkest(corner * (1 - axis)) == pytest.approx(EDGE)
        assert darkest(corner * axis) >= DARK > EDGE
