"""Sets whose equations follow from each other have the skeleton of independent equations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from skeleton_shapes import counts

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.files import load_skeleton, save_skeleton
from polycorner.skeletons import resume

SPACE = Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
OCTANT = {"x": x, "y": y, "z": z}
sphere = x**2 + y**2 + z**2 - 1
seeds = st.integers(0, 99)


def described(atlas):
    """Return counts, Euler number, components and lengths."""
    lengths = sorted(round(edge.length, 8) for edge in atlas.edges)
    return counts(atlas), atlas.euler_characteristic, dict(atlas.components), lengths


@given(arrays(float, (3, 2), elements=st.floats(0.01, 2) | st.floats(-2, -0.01)), seeds)
def test_combinations_of_two_equations(mixed, seed):
    """A segment of the plane ``x + y + z = 1``, from three to five equations of rank two."""
    equations = [x + y + z - 1, x - y, *(mixed @ np.array([x + y + z - 1, x - y]))]
    found = skeleton(Polyhedron(SPACE, OCTANT, equations=equations), [[0.3, 0.3, 0.4]], rng=seed)
    alone = skeleton(Polyhedron(SPACE, OCTANT, equations=equations[:2]), [[0.3, 0.3, 0.4]])
    assert counts(alone) == (2, 1, 0)
    assert described(found) == described(alone)


MULTIPLES = {
    "twice": [sphere, sphere],
    "a factor that does not vanish": [sphere, (2 + x) * sphere],
    "a factor that vanishes on the way": [sphere, (x - y) * sphere],
    "a square": [sphere**2, sphere],
    "another function of it": [sphere, (x**2 + y**2 + z**2) ** 3 - 1],
}


@pytest.mark.parametrize("kind", MULTIPLES)
@pytest.mark.parametrize("start", [[0.6, 0.64, 0.48], [1, 0, 0], [0, 0, 1]])
def test_equations_that_follow_from_a_curved_one(kind, start):
    """An eighth of the sphere, from its middle and from its corners."""
    found = skeleton(Polyhedron(SPACE, OCTANT, equations=MULTIPLES[kind]), [start])
    assert (counts(found), found.euler_characteristic) == ((3, 3, 1), 1)
    assert [e.length for e in found.edges] == pytest.approx([np.pi / 2] * 3, rel=1e-9)
    assert not found.notes


def test_equations_that_are_independent_somewhere_else_stay():
    """``z = 0`` and the sphere are dependent nowhere on their circle, though at the poles."""
    D = Polyhedron(SPACE, {"x": x, "y": y}, equations=[sphere, z, sphere + z])
    assert described(skeleton(D, [[1, 0, 0]]))[0] == (2, 1, 0)


def test_an_unfinished_search_goes_on_from_a_file(tmp_path):
    D = Polyhedron(SPACE, OCTANT, equations=MULTIPLES["twice"])
    begun = skeleton(D, [[0.6, 0.64, 0.48]], budget=1)
    assert len(begun.edges) < 3
    read = load_skeleton(save_skeleton(begun, tmp_path / "begun.json"))
    assert described(resume(read)) == described(skeleton(D, [[0.6, 0.64, 0.48]]))
