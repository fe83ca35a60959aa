"""Arguments of a wrong kind or size: the error names the argument."""

import math

import numpy as np
import pytest
from skeleton_shapes import counts, half_spaces, isomorphic, polytope, space

from polycorner import AllOf, Polyhedron, Symmetry, skeleton
from polycorner.polyhedra import WalkOptions
from polycorner.skeletons import Budget, resume, traced

TRIANGLE = polytope([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])
START = ((0.2, 0.2),)


@pytest.fixture(scope="module")
def found():
    return skeleton(TRIANGLE, START)


WRONG = [
    ("starts", [[0.1, math.nan]], ValueError),
    ("starts", [[0.1, math.inf]], ValueError),
    ("starts", [[0.1, 0.2, 0.3]], ValueError),
    ("starts", [], ValueError),
    ("starts", np.zeros((2, 3, 2)), ValueError),
    ("starts", "point", TypeError),
    ("starts", None, TypeError),
    ("starts", [[0.1, 1j]], TypeError),
    ("starts", [[0.1], [0.1, 0.2]], ValueError),
    ("tolerance", 0, ValueError),
    ("tolerance", 1.5, ValueError),
    ("tolerance", math.nan, ValueError),
    ("tolerance", "small", TypeError),
    ("rank_tolerance", 0, ValueError),
    ("rank_tolerance", 1, ValueError),
    ("rank_tolerance", "small", TypeError),
    ("extent", 0, ValueError),
    ("extent", -1.0, ValueError),
    ("extent", math.nan, ValueError),
    ("extent", "far", TypeError),
    ("extent", True, TypeError),
    ("options", 0.1, TypeError),
    ("options", WalkOptions, TypeError),
    ("budget", 0, ValueError),
    ("budget", -3, ValueError),
    ("budget", 2.5, TypeError),
    ("budget", True, TypeError),
    ("symmetry", "D4", TypeError),
    ("symmetry", Symmetry, TypeError),
    ("progress", 3, TypeError),
    ("rng", "seed", TypeError),
    ("rng", 1.5, TypeError),
    ("rng", -1, ValueError),
    ("polyhedron", None, TypeError),
    ("polyhedron", TRIANGLE.manifold, TypeError),
]


@pytest.mark.parametrize(("argument", "value", "kind"), WRONG)
def test_the_error_of_a_search_names_the_argument(argument, value, kind):
    arguments = {"polyhedron": TRIANGLE, "starts": START} | {argument: value}
    with pytest.raises(kind, match=rf"^{argument}: expected [^\n]+; got [^\n]+$"):
        skeleton(**arguments)


@pytest.mark.parametrize(
    ("call", "argument", "kind"),
    [
        (lambda _: resume(None), "skeleton", TypeError),
        (lambda found: resume(found.polyhedron), "skeleton", TypeError),
        (lambda found: resume(found, budget=0), "budget", ValueError),
        (lambda _: Budget(1, 0), "seconds", ValueError),
        (lambda _: Budget(1, "long"), "seconds", TypeError),
        (lambda found: traced(None, found.edges[0]), "skeleton", TypeError),
        (lambda found: traced(found, 0), "edge", TypeError),
        (lambda found: traced(found, found.edges[0], pieces=0), "pieces", ValueError),
    ],
)
def test_the_error_of_a_call_names_the_argument(call, argument, kind, found):
    with pytest.raises(kind, match=rf"^{argument}: expected [^\n]+; got [^\n]+$"):
        call(found)


def test_whole_numbers_will_do():
    assert counts(skeleton(TRIANGLE, [[0, 0]], extent=10, rng=3)) == (3, 3, 1)


def test_a_function_may_be_a_smooth_function_or_an_expression():
    one = Polyhedron(space(2), AllOf(*half_spaces([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])))
    q1, q2 = space(2).symbols
    other = Polyhedron(space(2), [q1, q2, 1 - q1 - q2])
    assert isomorphic(skeleton(one, START), skeleton(other, START))
