"""Weights of faces against areas."""

import pytest

from polycorner import Manifold, Polyhedron, Symmetry, skeleton
from polycorner.measures import SampleOptions, Weighting, face_weights, measure
from polycorner.polyhedra import Element

M = Manifold.euclidean("x y z")
x, y, z = M.symbols
SIDES = {"x": 1.0, "y": 0.7, "z": 0.4}
BOX = Polyhedron(
    M,
    {f"low {s}": s for s in M.symbols} | {f"high {s}": SIDES[s.name] - s for s in M.symbols},
)
OPTIONS = SampleOptions(step=0.4, sideways=0.2, reach=0.4)


def weights(symmetry=None):
    atlas = skeleton(BOX, [[0.2, 0.2, 0.2]], symmetry=symmetry)
    found = measure(atlas, weighting=Weighting(gradients=False))
    return face_weights(found, points=20_000, rng=5, options=OPTIONS)


def test_sides_of_a_box():
    found = weights()
    assert len(found.by_contacts) == 6
    for (contact,), estimate in found.by_contacts.items():
        a, b = (length for name, length in SIDES.items() if name != contact[-1])
        assert abs(estimate.value - a * b) < 4 * estimate.error
    assert abs(found.total.value - 2 * (0.7 + 0.4 + 0.28)) < 4 * found.total.error
    assert found.total.error < 0.05


def test_mirror_images_are_one():
    names = {"low x": "high x", "high x": "low x"}
    found = weights(Symmetry(elements=[Element(lambda q: q * [-1, 1, 1] + [1, 0, 0], names)]))
    assert len(found.by_contacts) == 5
    assert abs(found.total.value - (0.7 + 0.4 + 0.28)) < 4 * found.total.error


def test_edges_have_to_be_weighed():
    with pytest.raises(ValueError, match="edges with weights"):
        face_weights(measure(skeleton(BOX, [[0.2, 0.2, 0.2]]), edges=False))
