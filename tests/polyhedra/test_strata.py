"""Strata: rank, dimension, type, and what they do not depend on."""

import itertools
import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, stratum_at
from polycorner.formulas.families import Family
from polycorner.polyhedra import LocalType

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
CUBE = Polyhedron(
    SPACE, {"left": x, "right": 1 - x, "front": y, "back": 1 - y, "floor": z, "lid": 1 - z}
)
OCTAHEDRAL = Polyhedron(SPACE, {"pp": z - x - y, "pm": z - x + y, "mp": z + x - y, "mm": z + x + y})


def seen(stratum):
    """Return what a stratum says about the shape of the set."""
    return stratum.dimension, stratum.rank, stratum.local_type


class TestCube:
    @given(st.tuples(*[st.sampled_from([0.0, 1.0, 0.3, 0.7])] * 3))
    def test_the_dimension_is_the_number_of_free_coordinates(self, q):
        free = sum(0 < a < 1 for a in q)
        kind = LocalType.QUADRANT if free < 3 else LocalType.INTERIOR
        assert seen(stratum_at(CUBE, q)) == (free, 3 - free, kind)

    @given(st.tuples(*[st.sampled_from([0.0, 1.0, 0.3])] * 3))
    def test_the_active_functions_are_the_ones_that_vanish(self, q):
        sides = (("left", "right"), ("front", "back"), ("floor", "lid"))
        active = [pair[int(a)] for pair, a in zip(sides, q, strict=True) if a in (0.0, 1.0)]
        stratum = stratum_at(CUBE, q)
        assert stratum.active == tuple(active)
        assert stratum.pieces == (tuple(active),)

    @pytest.mark.parametrize("q", [[-0.1, 0.5, 0.5], [1.0, 1.0, 1.1], [2.0, 2.0, 2.0]])
    def test_outside_there_is_no_face(self, q):
        stratum = stratum_at(CUBE, q)
        assert stratum.local_type is LocalType.OUTSIDE
        assert stratum.pieces == ()
        assert stratum.active == ()

    def test_the_faces_satisfy_eulers_formula(self):
        """Among the points of a 3 x 3 x 3 grid there is one in every face of the cube."""
        count = [0, 0, 0, 0]
        for q in itertools.product([0.0, 0.5, 1.0], repeat=3):
            count[stratum_at(CUBE, q).dimension] += 1
        assert count == [8, 12, 6, 1]
        assert count[0] - count[1] + count[2] == 2

    def test_a_point_may_be_named(self):
        assert stratum_at(CUBE, {"z": 0.0, "x": 0.0, "y": 0.5}).active == ("left", "floor")


class TestCones:
    def test_the_apex_has_four_facets_of_rank_three(self):
        stratum = stratum_at(OCTAHEDRAL, [0.0, 0.0, 0.0])
        assert len(stratum.active) == 4
        assert seen(stratum) == (0, 3, LocalType.CONE)

    @pytest.mark.parametrize("edge", [[1, 0, 1], [0, 1, 1], [-1, 0, 1], [0, -1, 1]])
    def test_its_edges_are_quadrants(self, edge):
        assert seen(stratum_at(OCTAHEDRAL, edge)) == (1, 2, LocalType.QUADRANT)

    def test_a_curved_apex_is_the_same_to_first_order(self):
        bent = [f + x * y * z + y**2 for f in (z - x - y, z - x + y, z + x - y, z + x + y)]
        D = Polyhedron(SPACE, bent)
        assert seen(stratum_at(D, [0.0, 0.0, 0.0])) == (0, 3, LocalType.CONE)


class TestDegenerate:
    @pytest.mark.parametrize(
        "parts",
        [
            [x**3 - y, x**3 + y],
            [x**2 - y, y],
            [y, -y],
            [x**3 - y**2],
            [x**2 + y**2],
            [x, y, -x - y],
        ],
        ids=["cusp", "tangent from below", "no inside", "one cusp", "point", "opposed"],
    )
    def test_no_inward_direction_is_degenerate(self, parts):
        assert stratum_at(Polyhedron(PLANE, parts), [0.0, 0.0]).local_type is LocalType.DEGENERATE

    def test_beside_a_cusp_all_is_well(self):
        D = Polyhedron(PLANE, [x**3 - y, x**3 + y])
        assert seen(stratum_at(D, [1.0, 1.0])) == (1, 1, LocalType.QUADRANT)
        assert stratum_at(D, [1.0, 0.0]).local_type is LocalType.INTERIOR


class TestUnions:
    CONCAVE = Polyhedron(PLANE, AnyOf(x, y))

    def test_a_concave_corner_is_a_union(self):
        stratum = stratum_at(self.CONCAVE, [0.0, 0.0])
        assert seen(stratum) == (0, 2, LocalType.UNION)
        assert stratum.pieces == (("f1",), ("f2",))

    def test_on_one_side_only_that_side_counts(self):
        stratum = stratum_at(self.CONCAVE, [0.0, -1.0])
        assert seen(stratum) == (1, 1, LocalType.QUADRANT)
        assert stratum.active == ("f1",)

    def test_a_function_that_vanishes_without_mattering_is_dropped(self):
        stratum = stratum_at(self.CONCAVE, [0.0, 1.0])
        assert seen(stratum) == (2, 0, LocalType.INTERIOR)
        assert stratum.active == ()

    def test_where_no_part_holds_is_outside(self):
        assert stratum_at(self.CONCAVE, [-1.0, -1.0]).local_type is LocalType.OUTSIDE

    def test_two_squares_that_share_a_corner(self):
        D = Polyhedron(PLANE, AnyOf(AllOf(x, y), AllOf(-x, -y)))
        stratum = stratum_at(D, [0.0, 0.0])
        assert seen(stratum) == (0, 2, LocalType.UNION)
        assert len(stratum.pieces) == 2

    def test_a_union_with_one_part_is_that_part(self):
        assert seen(stratum_at(Polyhedron(PLANE, AnyOf(AllOf(x, y))), [0.0, 0.0])) == (
            0,
            2,
            LocalType.QUADRANT,
        )


class TestRedundant:
    @pytest.mark.parametrize(
        "parts",
        [[y, y], [y, 3 * y], [y, y + x**2], [y, y - x**2], [y, sp.exp(y) - 1, sp.sin(y)]],
        ids=["twice", "a multiple", "parabola below", "parabola above", "three ways"],
    )
    def test_the_dimension_counts_the_rank_not_the_functions(self, parts):
        """All these sets have a smooth boundary at the origin."""
        stratum = stratum_at(Polyhedron(PLANE, parts), [0.0, 0.0])
        assert (stratum.dimension, stratum.rank) == (1, 1)
        assert stratum.local_type in (LocalType.QUADRANT, LocalType.CONE)

    def test_a_third_line_through_a_corner(self):
        stratum = stratum_at(Polyhedron(PLANE, [x, y, x + y]), [0.0, 0.0])
        assert (stratum.dimension, stratum.rank) == (0, 2)
        assert stratum.local_type in (LocalType.QUADRANT, LocalType.CONE)


class TestSections:
    SPHERE = Polyhedron(SPACE, {"above": z, "right": x}, {"sphere": x**2 + y**2 + z**2 - 1})

    @pytest.mark.parametrize(
        ("q", "dimension", "kind"),
        [
            ([0.6, 0.0, 0.8], 2, LocalType.INTERIOR),
            ([0.6, 0.8, 0.0], 1, LocalType.QUADRANT),
            ([0.0, 1.0, 0.0], 0, LocalType.QUADRANT),
            ([0.5, 0.5, 0.5], 0, LocalType.OUTSIDE),
            ([0.6, 0.0, -0.8], 0, LocalType.OUTSIDE),
        ],
    )
    def test_an_equation_lowers_the_dimension(self, q, dimension, kind):
        stratum = stratum_at(self.SPHERE, q)
        assert stratum.local_type is kind
        if kind is not LocalType.OUTSIDE:
            assert stratum.dimension == dimension

    def test_a_section_tangent_to_a_wall_is_degenerate(self):
        D = Polyhedron(PLANE, {"above": y}, {"parabola": y + x**2})
        assert stratum_at(D, [0.0, 0.0]).local_type is LocalType.DEGENERATE

    def test_an_equation_written_twice_is_degenerate(self):
        D = Polyhedron(PLANE, (), [y, 2 * y])
        assert seen(stratum_at(D, [1.0, 0.0])) == (1, 1, LocalType.DEGENERATE)


# A bent octahedral cone in stretched coordinates, every function with a factor of its own.
SIZES = sp.symbols("a b c f1 f2 f3 f4", positive=True)
_X, _Y, _Z = (s / size for s, size in zip((x, y, z), SIZES[:3], strict=True))
STRETCHED = Family.of(
    {
        "pp": SIZES[3] * (_Z - _X - _Y + _X**2),
        "pm": SIZES[4] * (_Z - _X + _Y + _X**2),
        "mp": SIZES[5] * (_Z + _X - _Y + _X**2),
        "mm": SIZES[6] * (_Z + _X + _Y + _X**2),
    },
    SPACE.names,
    [str(size) for size in SIZES],
)
factors = st.floats(-3, 3).map(lambda e: 10.0**e)
PLACES = {
    "apex": ([0.0, 0.0, 0.0], (0, 3, LocalType.CONE)),
    "edge": ([0.5, 0.0, 0.25], (1, 2, LocalType.QUADRANT)),
    "face": ([0.5, 0.25, 0.5], (2, 1, LocalType.QUADRANT)),
    "inside": ([0.1, 0.1, 1.0], (3, 0, LocalType.INTERIOR)),
    "outside": ([0.1, 0.1, -1.0], None),
}


class TestInvariance:
    @staticmethod
    def stretched(numbers):
        space = Manifold(SPACE.names, scales=numbers[:3])
        return Polyhedron(
            space,
            [
                SmoothFunction.member(STRETCHED, name, space, parameters=numbers)
                for name in STRETCHED.names
            ],
        )

    @given(
        st.lists(factors, min_size=7, max_size=7),
        st.sampled_from(sorted(PLACES)),
        st.lists(st.floats(-1e-10, 1e-10), min_size=3, max_size=3),
    )
    def test_strata_do_not_depend_on_units_or_on_factors(self, numbers, place, noise):
        q, expected = PLACES[place]
        D = self.stretched(numbers)
        stratum = stratum_at(D, (np.array(q) + noise) * D.manifold.scale_array)
        if expected is None:
            assert stratum.local_type is LocalType.OUTSIDE
        else:
            assert seen(stratum) == expected

    @given(st.lists(factors, min_size=7, max_size=7), st.sampled_from([1e-4, 1e-6, 1e-9]))
    def test_the_tolerance_is_a_distance_in_scale_units(self, numbers, tolerance):
        """At twice the tolerance from a face the point is inside, at half of it on the face."""
        D = self.stretched(numbers)
        q, _ = PLACES["face"]
        normal = np.array([0.0, -1.0, 1.0]) / math.sqrt(2)
        for share, dimension in ((0.5, 2), (2.0, 3)):
            near = (np.array(q) + share * tolerance * normal) * D.manifold.scale_array
            assert stratum_at(D, near, tolerance=tolerance).dimension == dimension
        beyond = (np.array(q) - 2 * tolerance * normal) * D.manifold.scale_array
        assert stratum_at(D, beyond, tolerance=tolerance).local_type is LocalType.OUTSIDE

    def test_a_whole_turn_changes_nothing(self):
        circle = Manifold(("phi", "h"), (math.tau, math.inf))
        phi, h = circle.symbols
        D = Polyhedron(circle, [sp.cos(phi), h])
        first = stratum_at(D, [math.pi / 2, 0.0])
        assert first == stratum_at(D, [math.pi / 2 - math.tau, 0.0])
        assert first.dimension == 0


class TestAnswers:
    def test_local_types_are_sentences(self):
        assert all(kind.value.count(" ") > 3 for kind in LocalType)

    def test_a_model_may_say_something_about_a_point(self):
        D = Polyhedron(PLANE, x, annotations={"chirality": lambda q: "R" if q[1] > 0 else None})
        assert stratum_at(D, [0.0, 1.0]).chirality == "R"
        assert stratum_at(D, [0.0, -1.0]).chirality is None
        assert stratum_at(Polyhedron(PLANE, x), [0.0, 1.0]).chirality is None

    @pytest.mark.parametrize("name", ["tolerance", "rank_tolerance"])
    @pytest.mark.parametrize("value", [0.0, 1.0, -1e-8, math.nan, math.inf, "small", None])
    def test_a_tolerance_lies_between_zero_and_one(self, name, value):
        with pytest.raises((ValueError, TypeError), match=f"^{name}: "):
            stratum_at(CUBE, [0.0, 0.0, 0.0], **{name: value})

    @pytest.mark.parametrize("q", [[0.0, 0.0], [[0.0, 0.0, 0.0]], [0.0, 0.0, math.nan], {"x": 0}])
    def test_the_point_is_one_point(self, q):
        with pytest.raises(ValueError, match=r"^q: "):
            stratum_at(CUBE, q)


def test_a_list_is_no_polyhedron():
    with pytest.raises(TypeError, match="polyhedron: expected a Polyhedron; got list"):
        stratum_at([x], [0.0, 0.0, 0.0])
