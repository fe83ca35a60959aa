"""Arguments of a wrong kind are refused in one sentence that names them."""

import math

import numpy as np
import pytest
from atlas_shapes import counts, half_spaces, isomorphic, polytope, space

from polycorner import (
    AllOf,
    Polyhedron,
    Symmetry,
    skeleton,
)
from polycorner.skeletons.search import resume

TRIANGLE = polytope([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])


class TestArguments:
    @pytest.mark.parametrize(
        ("starts", "kind", "says"),
        [
            ([[0.1, math.nan]], ValueError, "expected finite numbers; got nan"),
            ([[0.1, math.inf]], ValueError, "expected finite numbers; got inf"),
            ([[0.1, 0.2, 0.3]], ValueError, r"expected shape \(..., 2\)"),
            ([], ValueError, "expected "),
            (np.zeros((2, 3, 2)), ValueError, "expected "),
            ("point", TypeError, "expected real numbers"),
            (None, TypeError, "expected real numbers"),
            ([[0.1, 1j]], TypeError, "expected real numbers"),
            ([[0.1], [0.1, 0.2]], ValueError, "expected a rectangular array"),
        ],
        ids=["nan", "inf", "too long", "none", "batch", "text", "nothing", "complex", "ragged"],
    )
    def test_starts_are_finite_points_of_the_manifold(self, starts, kind, says):
        with pytest.raises(kind, match=f"^starts: {says}"):
            skeleton(TRIANGLE, starts)

    @pytest.mark.parametrize(
        ("option", "value", "kind"),
        [
            ("tolerance", 0, ValueError),
            ("tolerance", 1.5, ValueError),
            ("tolerance", math.nan, ValueError),
            ("tolerance", "small", ValueError),
            ("extent", 0, ValueError),
            ("extent", -1.0, ValueError),
            ("extent", math.nan, ValueError),
            ("extent", "far", ValueError),
            ("extent", True, ValueError),
            ("budget", 0, ValueError),
            ("budget", -3, ValueError),
            ("budget", 2.5, ValueError),
            ("budget", True, ValueError),
            ("symmetry", "D4", TypeError),
            ("symmetry", Symmetry, TypeError),
            ("progress", 3, TypeError),
            ("rng", "seed", TypeError),
            ("rng", 1.5, TypeError),
            ("rng", -1, ValueError),
        ],
    )
    def test_an_option_of_a_wrong_kind_is_named(self, option, value, kind):
        with pytest.raises(kind, match=rf"^{option}: expected [^\n]+; got [^\n]+$"):
            skeleton(TRIANGLE, [[0.2, 0.2]], **{option: value})

    @pytest.mark.parametrize("thing", [None, 3, TRIANGLE.manifold])
    def test_the_set_is_a_polyhedron(self, thing):
        with pytest.raises(TypeError, match=r"^polyhedron: expected a Polyhedron; got \w+$"):
            skeleton(thing, [[0.2, 0.2]])

    @pytest.mark.parametrize("thing", [None, 3, TRIANGLE])
    def test_only_an_atlas_can_be_taken_up(self, thing):
        with pytest.raises(TypeError, match=r"^atlas: expected a Skeleton [^;]+; got \w+$"):
            resume(thing)

    def test_a_budget_to_go_on_with_is_positive(self):
        atlas = skeleton(TRIANGLE, [[0.2, 0.2]])
        with pytest.raises(ValueError, match=r"^budget: expected [^;]+; got 0$"):
            resume(atlas, budget=0)

    def test_whole_numbers_will_do(self):
        assert counts(skeleton(TRIANGLE, [[0, 0]], extent=10, rng=3)) == (3, 3, 1)

    def test_a_function_may_be_a_smooth_function_or_an_expression(self):
        one = Polyhedron(space(2), AllOf(*half_spaces([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])))
        q1, q2 = space(2).symbols
        other = Polyhedron(space(2), [q1, q2, 1 - q1 - q2])
        assert isomorphic(skeleton(one, [[0.2, 0.2]]), skeleton(other, [[0.2, 0.2]]))
