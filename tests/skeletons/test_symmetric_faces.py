"""Euler characteristics of faces modulo a finite symmetry, which may be known in several images."""

import itertools

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, Symmetry, skeleton
from polycorner.polyhedra.symmetry import Element

SPACE = Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
TWO_BALLS = 1 - (x**2 - 4) ** 2 / 4 - y**2 - z**2  # near (2, 0, 0) and (-2, 0, 0)
STARTS = list(itertools.permutations([[2, 0, 0], [-2, 0, 0]]))


def modulo(matrix):
    image = np.diag(np.array(matrix, dtype=float))
    return Symmetry(elements=[Element(lambda q: q @ image, {})])


@pytest.mark.parametrize("starts", [*STARTS, [[2, 0, 0]]])
@pytest.mark.parametrize("matrix", [[-1, 1, 1], [-1, -1, -1]], ids=["mirror", "point"])
def test_two_images_of_a_cut_ball_are_one_sphere(matrix, starts):
    """A set of two halves modulo their exchange is one half, whose boundary is a sphere."""
    cuts = {"y": 1 / 4 - y**2} if matrix[1] < 0 else {"y": 1 / 2 - y}
    D = Polyhedron(SPACE, {"balls": TWO_BALLS, "z": 1 / 4 - z**2, **cuts})
    found = skeleton(D, starts, symmetry=modulo(matrix))
    whole = skeleton(D, [[2, 0, 0]])
    sizes = [len(found.corners), len(found.edges), len(found.faces)]
    assert sizes == [len(whole.corners), len(whole.edges), len(whole.faces)]
    assert found.euler_characteristic == whole.euler_characteristic == 2


def test_a_face_that_is_carried_to_itself_has_no_number():
    """A mirror makes of the cap of a ball half a cap, of which the search knows nothing."""
    D = Polyhedron(SPACE, {"ball": 1 - x**2 - y**2 - z**2, "cap": 1 / 2 - z, "side": 1 / 2 - y})
    found = skeleton(D, [[0.1, 0, 0]], symmetry=modulo([-1, 1, 1]))
    assert found.faces
    assert found.euler_characteristic is None
