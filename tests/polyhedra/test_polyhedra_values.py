"""Polyhedra, strata and symmetries as values: pickled, copied, sent to a spawned process."""

import copy
import pickle

import numpy as np
import pytest
from elsewhere import called

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry, stratum_at
from polycorner.polyhedra import Element

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols


def side(q):
    return "R" if q[0] > 0 else "L"


def mirrored(q):
    return q * np.array([-1.0, 1.0])


CONCAVE = Polyhedron(
    PLANE,
    {"disc": 1 - x**2 - y**2, "step": AnyOf(x, AllOf(y, y + x))},
    {"h": x - y},
    annotations={"chirality": side},
)
MIRROR = Symmetry(elements=(Element(mirrored, {"left": "right", "right": "left"}),))
AGAIN = pytest.mark.parametrize(
    "again", [lambda value: pickle.loads(pickle.dumps(value)), copy.deepcopy, copy.copy],
    ids=["pickle", "deepcopy", "copy"],
)  # fmt: skip


@AGAIN
def test_a_polyhedron_keeps_its_functions_tree_and_annotations(again):
    other = again(CONCAVE)
    points = np.random.default_rng(0).normal(size=(50, 2))
    np.testing.assert_array_equal(other.values(points), CONCAVE.values(points))
    np.testing.assert_array_equal(other.hessians(points), CONCAVE.hessians(points))
    np.testing.assert_array_equal(other.implicit(points), CONCAVE.implicit(points))
    assert repr(other) == repr(CONCAVE)
    assert other.is_union
    assert stratum_at(other, [0.0, 0.0]) == stratum_at(CONCAVE, [0.0, 0.0])


@AGAIN
def test_groups_strata_and_symmetries(again):
    assert repr(again(AnyOf(x, AllOf(y, x + y)))) == repr(AnyOf(x, AllOf(y, x + y)))
    stratum = stratum_at(CONCAVE, [0.5, 0.5])
    assert again(stratum) == stratum
    np.testing.assert_array_equal(again(MIRROR).group[1].apply(np.ones(2)), [-1.0, 1.0])


def test_a_spawned_process_computes_the_same():
    assert called(stratum_at, CONCAVE, [0.0, 0.0]) == stratum_at(CONCAVE, [0.0, 0.0])
    assert called(MIRROR.separation, PLANE, np.zeros(2), np.ones(2)) == 1.0
