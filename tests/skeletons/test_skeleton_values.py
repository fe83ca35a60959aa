"""Skeletons as values: sent to other processes, copied, read-only, resumed from a pickle."""

import copy
import pickle

import numpy as np
import pytest
from elsewhere import called
from skeleton_shapes import identical

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, skeleton
from polycorner.models.spheres import SphereCluster
from polycorner.skeletons import Completeness, resume, traced
from polycorner.skeletons.orbits import orbits

PLANE = Manifold.euclidean("x y")
x, y, z = Manifold.euclidean("x y z").symbols
BALL = Polyhedron(
    Manifold.euclidean("x y z"),
    AllOf(1 - x**2 - y**2 - z**2, AnyOf(x + 0.5, y + 0.5), z + 0.2),
)
START = ((0.1, 0.1, 0.1),)


def pickled(value):
    return pickle.loads(pickle.dumps(value))


@pytest.fixture(scope="module")
def found():
    return skeleton(BALL, START)


def test_a_spawned_process_takes_a_part_and_returns_the_whole(found):
    part = skeleton(BALL, START, budget=2)
    assert part.complete is Completeness.BUDGET
    assert identical(called(resume, part), found)


@pytest.mark.parametrize("again", [pickled, copy.deepcopy, copy.copy])
def test_a_copy_is_resumed_traced_and_read_as_the_original(again, found):
    part = skeleton(BALL, START, budget=2)
    assert identical(resume(again(part)), found)
    other = again(found)
    assert identical(other, found)
    assert str(other) == str(found)
    assert other.euler_characteristic == found.euler_characteristic
    for edge, twin in zip(found.edges, other.edges, strict=True):
        np.testing.assert_array_equal(traced(found, edge), traced(other, twin))


def test_a_state_is_independent_of_the_searches_that_resume_it(found):
    part = skeleton(BALL, START, budget=2)
    before = pickle.dumps(part)
    first = resume(part, budget=1)
    resume(first)
    assert pickle.dumps(part) == before
    assert identical(resume(part), found)


def test_a_skeleton_modulo_a_group_is_sent_as_well():
    model = SphereCluster(5)
    found = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    other = called(resume, found)
    assert identical(other, found)
    assert orbits(other, ()) == orbits(found, ())


def test_arrays_are_read_only(found):
    for again in (found, pickled(found), copy.deepcopy(found)):
        for array in (again.corners[0].point, again.edges[0].polyline):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0.0


def test_every_skeleton_says_its_euler_characteristic_or_why_not(found):
    x, y = PLANE.symbols
    wedge = skeleton(Polyhedron(PLANE, {"floor": y, "wall": x}), [[1, 2]], extent=40)
    crossed = skeleton(Polyhedron(PLANE, {"saddle": x * y, "disc": 1 - x**2 - y**2}), [[0.5, 0.2]])
    nothing = skeleton(Polyhedron(PLANE, {"floor": y}), [[0, -1]])
    for one in (found, wedge, crossed, nothing, skeleton(BALL, START, budget=1)):
        assert "None" not in str(one)
        assert (one.euler_characteristic is None) == bool(one.euler_note)
        told = one.euler_note and f"not determined: {one.euler_note}"
        assert f"Euler characteristic  {told or one.euler_characteristic}" in str(one)


def test_a_corner_has_one_name(found):
    assert all(f"C{k} " in str(found) for k in range(len(found.corners)))
