"""And/or trees of inequalities: membership, pieces, names, sections, refusals."""

import copy
import pickle

import numpy as np
import oracles
import pytest
import sympy as sp
from elsewhere import called
from hypothesis import given
from hypothesis import strategies as st
from strategies import group, leaves_of, trees, vectors

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, Symmetry, stratum_at
from polycorner.formulas.families import Family
from polycorner.polyhedra import Element

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
CURVES = {
    "right": x,
    "above": y,
    "disc": 4 - x**2 - y**2,
    "bowl": y - x**2,
    "hole": (x - 1) ** 2 + y**2 - 1,
    "line": x + 2 * y - 1,
}
FAMILY = Family.of(CURVES, PLANE.names)
FUNCTIONS = [SmoothFunction.member(FAMILY, name, PLANE) for name in CURVES]
LEAVES = len(FUNCTIONS)


def exact_values(q):
    """Return the values of the curves in the order of ``CURVES``, as they are written."""
    a, b = q
    return [
        a,
        b,
        4 - a**2 - b**2,
        b - a**2,
        (a - 1) ** 2 + b**2 - 1,
        a + 2 * b - 1,
    ]


def built(tree):
    """Return the polyhedron of a tree and the positions of its functions among the curves."""
    return Polyhedron(PLANE, group(tree, FUNCTIONS)), leaves_of(tree)


class TestMembership:
    @given(trees(LEAVES), vectors(2, 3.0))
    def test_the_implicit_value_is_the_minimum_and_maximum_down_the_tree(self, tree, q):
        D, _ = built(tree)
        exact = oracles.implicit(tree, exact_values(q))
        assert D.implicit(q) == pytest.approx(exact, abs=1e-13)

    @given(trees(LEAVES), vectors(2, 3.0))
    def test_membership_is_the_truth_of_the_tree(self, tree, q):
        D, order = built(tree)
        values = dict(zip(order, D.values(q), strict=True))
        assert D.contains(q) == oracles.holds(tree, {i: v >= 0 for i, v in values.items()})

    @given(trees(LEAVES), vectors(2, 3.0), st.floats(0, 5))
    def test_a_tolerance_is_allowed_to_every_function(self, tree, q, slack):
        D, order = built(tree)
        values = dict(zip(order, D.values(q), strict=True))
        truth = {i: v >= -slack for i, v in values.items()}
        assert D.contains(q, tolerance=slack) == oracles.holds(tree, truth)

    @given(trees(LEAVES), st.lists(vectors(2, 3.0), max_size=9))
    def test_a_batch_is_its_points(self, tree, rows):
        D, _ = built(tree)
        q = np.array(rows).reshape(-1, 2)
        assert D.contains(q).tolist() == [D.contains(p) for p in q]
        assert D.implicit(q).tolist() == [D.implicit(p) for p in q]

    @given(trees(LEAVES), vectors(2, 3.0))
    def test_exchanging_the_words_and_the_signs_gives_the_complement(self, tree, q):
        """De Morgan: the implicit value of the complement is minus the implicit value."""

        def dual(node):
            if isinstance(node, int):
                return node
            word, children = node
            return ({"all": "any", "any": "all"}[word], tuple(map(dual, children)))

        values = exact_values(q)
        D, order = built(dual(tree))
        negated = np.array([-values[i] for i in order])
        original = oracles.implicit(tree, values)
        assert D.implicit_of(negated) == -original

    def test_a_list_and_a_mapping_mean_all_of_them(self):
        q = np.random.default_rng(0).uniform(-2, 2, (50, 2))
        forms = [[x, y], (x, y), {"a": x, "b": y}, AllOf(x, y), AllOf(AllOf(x), AllOf(y))]
        inside = [Polyhedron(PLANE, form).contains(q) for form in forms]
        for other in inside:
            assert np.array_equal(other, (q >= 0).all(axis=1))

    def test_one_expression_is_a_polyhedron(self):
        assert Polyhedron(PLANE, y - x).contains([0.0, 1.0]) is True
        assert Polyhedron(PLANE, y - x).contains([1.0, 0.0]) is False

    def test_a_union_is_recognised(self):
        assert Polyhedron(PLANE, AllOf(x, AnyOf(x, y))).is_union
        assert not Polyhedron(PLANE, AllOf(x, AnyOf(y))).is_union


class TestEvaluation:
    D = Polyhedron(PLANE, FUNCTIONS)

    @pytest.mark.parametrize("batch", [(), (7,), (0,), (2, 3)])
    def test_everything_is_the_functions_one_by_one(self, batch):
        q = np.random.default_rng(1).uniform(-2, 2, (*batch, 2))
        values, gradients, hessians = self.D.evaluate(q, 2)
        assert values.shape == (*batch, LEAVES)
        for i, f in enumerate(FUNCTIONS):
            assert np.array_equal(values[..., i], f.value(q))
            assert np.array_equal(gradients[..., i, :], f.gradient(q))
            assert np.array_equal(hessians[..., i, :, :], f.hessian(q))

    def test_each_level_alone_is_the_level_together(self):
        q = np.random.default_rng(1).uniform(-2, 2, (5, 2))
        values, gradients, hessians = self.D.evaluate(q, 2)
        np.testing.assert_allclose(self.D.values(q), values, atol=1e-14)
        np.testing.assert_allclose(self.D.gradients(q), gradients, atol=1e-14)
        np.testing.assert_allclose(self.D.hessians(q), hessians, atol=1e-14)

    @pytest.mark.parametrize("q", [[1.0], [1.0, np.nan], [[1.0, 2.0], [np.inf, 0.0]], "xy"])
    def test_a_bad_point_is_refused(self, q):
        for method in ("values", "gradients", "hessians", "implicit", "contains"):
            with pytest.raises((ValueError, TypeError), match=r"^q: "):
                getattr(self.D, method)(q)


class TestPieces:
    @given(trees(LEAVES), st.data())
    def test_pieces_decide_every_way_in_which_vanishing_functions_may_turn(self, tree, data):
        D, order = built(tree)
        signs = data.draw(st.lists(st.sampled_from([-1, 0, 1]), min_size=LEAVES, max_size=LEAVES))
        pieces = D.signs_to_pieces([signs[i] for i in order])
        for truth in oracles.truth_table(signs):
            near = [truth[i] for i in order]
            assert oracles.holds(tree, truth) == any(all(near[i] for i in p) for p in pieces)

    @given(trees(LEAVES), st.data())
    def test_pieces_are_minimal_and_made_of_vanishing_functions(self, tree, data):
        D, order = built(tree)
        signs = data.draw(
            st.lists(st.sampled_from([-1, 0, 1]), min_size=len(order), max_size=len(order))
        )
        pieces = D.signs_to_pieces(signs)
        assert len(set(pieces)) == len(pieces)
        assert not any(p < q for p in pieces for q in pieces)
        assert all(signs[i] == 0 for piece in pieces for i in piece)

    def test_outside_there_is_no_piece_and_inside_the_empty_one(self):
        D = Polyhedron(PLANE, AnyOf(x, y))
        assert D.signs_to_pieces([-1, -1]) == []
        assert D.signs_to_pieces([1, 0]) == [frozenset()]
        assert D.signs_to_pieces([0, -1]) == [frozenset([0])]
        assert D.signs_to_pieces([0, 0]) == [frozenset([0]), frozenset([1])]

    @given(trees(LEAVES), vectors(2, 3.0))
    def test_the_roomiest_selection_has_the_implicit_value(self, tree, q):
        D, _ = built(tree)
        values = D.values(q)
        first = D.selections(values)[0]
        assert min(values[i] for i in first) == D.implicit(q)

    @given(trees(LEAVES), vectors(2, 3.0))
    def test_inside_every_selection_holds(self, tree, q):
        D, order = built(tree)
        values = D.values(q)
        selections = D.selections(values)
        assert len(set(selections)) == len(selections)
        if D.contains(q):
            assert all(values[i] >= 0 for selection in selections for i in selection)
        for selection in selections:
            truth = {i: position in selection for position, i in enumerate(order)}
            assert oracles.holds(tree, truth), "a selection suffices for membership"


class TestNames:
    def test_a_mapping_names_its_functions(self):
        assert Polyhedron(PLANE, {"bowl": y - x**2, "lid": 2 - y}).names == ("bowl", "lid")

    def test_nameless_expressions_are_numbered(self):
        D = Polyhedron(PLANE, [x, AnyOf(y, AllOf(x - 1, y - 1))], equations=[x - y])
        assert D.names == ("f1", "f2", "f3", "f4")
        assert D.equation_names == ("h1",)

    def test_smooth_functions_keep_their_names(self):
        D = Polyhedron(PLANE, AnyOf(FUNCTIONS[2], AllOf(FUNCTIONS[0], FUNCTIONS[1])))
        assert D.names == ("disc", "right", "above")

    def test_a_function_used_twice_is_one_function(self):
        f, g, _, _, h, _ = FUNCTIONS
        D = Polyhedron(PLANE, AnyOf(AllOf(f, g), AllOf(f, h)))
        assert D.names == ("right", "above", "hole")

    @pytest.mark.parametrize(
        ("parts", "equations", "name"),
        [
            ([SmoothFunction("f", x, PLANE), SmoothFunction("f", y, PLANE)], (), "f"),
            ({"a": x}, {"a": y}, "a"),
            ({"f1": x, "": y}, (), "f1"),
            ([FUNCTIONS[0]], {"right": y}, "right"),
            ([FUNCTIONS[0]], [FUNCTIONS[0]], "right"),
        ],
    )
    def test_names_that_repeat_are_refused(self, parts, equations, name):
        with pytest.raises(ValueError, match=f"distinct names; got {name} more than once"):
            Polyhedron(PLANE, parts, equations)

    def test_the_representation_says_what_there_is(self):
        text = repr(Polyhedron(PLANE, {"bowl": y - x**2}, {"cut": x}))
        assert all(word in text for word in ("x", "y", "bowl", "cut"))


class TestSections:
    D = Polyhedron(PLANE, {"above": y}, {"circle": x**2 + y**2 - 1, "cut": x - y})

    def test_points_of_a_section_satisfy_all_equations(self):
        s = np.sqrt(0.5)
        q = [[s, s], [-s, -s], [1.0, 0.0], [0.0, 0.0]]
        assert self.D.contains(q, tolerance=1e-12).tolist() == [True, False, False, False]

    @given(vectors(2, 3.0))
    def test_equation_values(self, q):
        a, b = q
        np.testing.assert_allclose(
            self.D.equation_values(q), [a * a + b * b - 1, a - b], atol=1e-13
        )

    @given(vectors(2, 3.0))
    def test_the_bundle_lists_inequalities_before_equations(self, q):
        values = self.D.bundle.evaluate(q, 0)[0]
        expected = np.concatenate([self.D.values(q), self.D.equation_values(q)])
        np.testing.assert_allclose(values, expected, atol=1e-14)

    def test_equations_alone_make_a_section(self):
        D = Polyhedron(PLANE, (), [x - y])
        assert D.names == ()
        assert D.contains([2.0, 2.0])
        assert not D.contains([2.0, 1.0])
        assert D.contains([[2.0, 2.0], [2.0, 1.0]]).tolist() == [True, False]

    def test_without_equations_there_is_nothing_to_satisfy(self):
        assert Polyhedron(PLANE, x).equation_values([[1.0, 2.0]] * 3).shape == (3, 0)

    def test_all_of_equations_is_flat(self):
        D = Polyhedron(PLANE, (), AllOf(x, AllOf(y)))
        assert D.equation_names == ("h1", "h2")

    def test_equations_cannot_be_joined_by_or(self):
        with pytest.raises(ValueError, match=r"^equations: .*AnyOf"):
            Polyhedron(PLANE, x, AllOf(y, AnyOf(x - 1, y - 1)))


class TestRefusals:
    @pytest.mark.parametrize("manifold", [None, "x y", ("x", "y"), [x, y]])
    def test_the_manifold_is_a_manifold(self, manifold):
        with pytest.raises(TypeError, match=r"^manifold: "):
            Polyhedron(manifold, x)

    @pytest.mark.parametrize("parts", [AnyOf(), [x, AnyOf()], AllOf(x, AllOf(AnyOf()))])
    def test_an_empty_union_is_refused(self, parts):
        with pytest.raises(ValueError, match="AnyOf of nothing"):
            Polyhedron(PLANE, parts)

    @pytest.mark.parametrize(
        ("parts", "name"),
        [
            ("x", "f1"),
            (["x"], "f1"),
            ([x, "y"], "f2"),
            ({"wall": "x"}, r"parts\['wall'\]"),
            ([x >= 0], "f1"),
            ([x, [y]], "f2"),
            ({"wall": {"x": x}}, r"parts\['wall'\]"),
            ({x}, "f1"),
            (None, "f1"),
            (True, "f1"),
            (lambda q: q, "f1"),
        ],
    )
    def test_what_is_no_function_is_refused_by_name(self, parts, name):
        with pytest.raises(TypeError, match=f"^{name}: expected "):
            Polyhedron(PLANE, parts)

    @pytest.mark.parametrize("group", [AllOf, AnyOf])
    def test_groups_refuse_at_once_what_is_no_function(self, group):
        with pytest.raises(TypeError, match=r"^parts: expected a SymPy expression; got 'y'"):
            group(x, "y")

    def test_strings_are_no_equations_either(self):
        with pytest.raises(TypeError, match="h1: expected a SymPy expression"):
            Polyhedron(PLANE, x, "y")

    def test_names_are_strings(self):
        with pytest.raises(TypeError, match="names"):
            Polyhedron(PLANE, {1: x})

    def test_functions_on_another_manifold_are_refused(self):
        line = Manifold.euclidean("x")
        with pytest.raises(ValueError, match="away lives on the coordinates x; expected x, y"):
            Polyhedron(PLANE, [y, SmoothFunction("away", line.symbols[0], line)])

    def test_the_same_names_with_another_scale_are_another_manifold(self):
        other = Manifold.euclidean("x y", scale=2.0)
        with pytest.raises(ValueError, match="away lives on"):
            Polyhedron(other, SmoothFunction("away", x, PLANE))

    def test_symbols_that_are_no_coordinates_are_named(self):
        with pytest.raises(ValueError, match="symbol z "):
            Polyhedron(PLANE, {"wall": x + sp.Symbol("z")})


def test_it_prints_its_formulas_and_how_they_are_joined():
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    a = sp.Symbol("a")
    bowl = SmoothFunction("bowl", y - a * x**2, M, parameters={"a": 2.0})
    D = Polyhedron(M, AllOf(bowl, AnyOf(x, 1 - y)), equations={"line": x + y - 1})
    text = str(D)
    for words in ("Polyhedron in x, y", "with a = 2", "line", "x + y - 1", " or "):
        assert words in text
    assert D._repr_html_().count("<tr>") >= 4
    assert "\n" not in repr(D)


def test_long_formulas_are_told_by_their_coordinates():
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    many = Polyhedron(M, [x - k + sp.sin(k * y) for k in range(40)])
    assert "The first 20 of 40" in str(many)
    long = sum(sp.sin(k * x) for k in range(1, 40))
    assert "a function of x, y" in str(Polyhedron(M, {"long": long + y}))


# ------------------------------------------------------------------------------------------- values


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
