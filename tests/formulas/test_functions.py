"""Smooth functions: late-bound coordinates, parameters and definitions; bundles; refusals."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from strategies import vectors

from polycorner import Manifold, SmoothFunction
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family

SPACE = Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
a, b, k, u = sp.symbols("a b k u", real=True)
FORMULA = sp.sin(k * a) * b + sp.sqrt(a**2 + b**2 + 1)


def same(f, g, q, tolerance=1e-13):
    """Whether two functions agree with their first and second derivatives."""
    for method in ("value", "gradient", "hessian"):
        left, right = getattr(f, method)(q), getattr(g, method)(q)
        np.testing.assert_allclose(left, right, rtol=tolerance, atol=tolerance)


@pytest.fixture(scope="module")
def bound():
    return SmoothFunction(
        "f", FORMULA, SPACE, variables=("a", "b"), reads=("z", "x"), parameters={"k": 0.7}
    )


@pytest.fixture(scope="module")
def written():
    return SmoothFunction("f", FORMULA.subs({a: z, b: x, k: sp.Float(0.7)}), SPACE)


@pytest.fixture(scope="module")
def functions():
    family = Family.of({"f": FORMULA, "g": a * b * k, "h": a - b}, ("a", "b"), ("k",))

    def of(name, reads, number):
        return SmoothFunction.member(family, name, SPACE, reads=reads, parameters=[number])

    return [
        of("h", ("x", "y"), 1.0),
        of("f", ("x", "y"), 1.0),
        SmoothFunction("alone", x * y * z, SPACE),
        of("g", ("z", "y"), 1.0),
        of("g", ("x", "y"), 1.0),
        of("f", ("x", "y"), 2.0),
        SmoothFunction("other", sp.exp(z / 9) - k, SPACE, parameters={"k": 3}),
    ]


class TestLateBinding:
    @given(vectors(3))
    def test_binding_late_is_writing_out(self, bound, written, q):
        same(bound, written, q, tolerance=1e-12)

    @given(st.lists(vectors(3), min_size=1, max_size=11))
    def test_binding_late_is_writing_out_for_batches(self, bound, written, q):
        same(bound, written, np.array(q), tolerance=1e-12)

    def test_the_expression_is_the_one_written_out(self, bound):
        expected = FORMULA.subs({a: z, b: x})
        assert sp.simplify(bound.expression - expected) == 0

    def test_a_coordinate_that_is_not_read_has_no_slope(self, bound):
        assert bound.gradient([1.0, 2.0, 3.0])[1] == 0
        assert not bound.hessian([1.0, 2.0, 3.0])[1].any()
        assert not bound.hessian([1.0, 2.0, 3.0])[:, 1].any()

    @given(vectors(3), st.permutations(["x", "y", "z"]))
    def test_reading_in_another_order_permutes_the_point(self, q, order):
        cubic = x**2 * y + y * z
        f = SmoothFunction("f", cubic, SPACE)
        g = SmoothFunction("g", cubic, SPACE, reads=order)
        places = [SPACE.names.index(name) for name in order]
        assert g.value(q) == f.value(q[places])
        gradient = np.zeros(3)
        gradient[places] = f.gradient(q[places])
        assert np.array_equal(g.gradient(q), gradient)

    @given(vectors(3, 3.0))
    def test_definitions_are_writing_out(self, q):
        with_names = SmoothFunction(
            "f", u**2 + sp.cos(k), SPACE, definitions={"u": x * y + z, "k": u * x}
        )
        written = (x * y + z) ** 2 + sp.cos((x * y + z) * x)
        same(with_names, SmoothFunction("f", written, SPACE), q, tolerance=1e-12)
        assert sp.expand(with_names.expression - written) == 0

    @given(vectors(2, 3.0), st.floats(-3, 3), st.floats(-3, 3))
    def test_one_family_serves_all_parameters(self, q, first, second):
        plane = Manifold.euclidean("x y")
        family = Family.of({"f": FORMULA}, ("a", "b"), ("k",))
        for number in (first, second):
            late = SmoothFunction.member(
                family, "f", plane, parameters=[number], reads=("x", "y"), label="late"
            )
            exact = math.sin(number * q[0]) * q[1] + math.sqrt(q[0] ** 2 + q[1] ** 2 + 1)
            assert late.name == "late"
            assert late.value(q) == pytest.approx(exact, abs=1e-13)

    def test_reading_one_coordinate_twice_is_refused_or_follows_the_chain_rule(self):
        """``a b`` at ``a = b = x`` is ``x^2``, of slope ``2 x``: never silently something else."""
        try:
            twice = SmoothFunction("f", a * b, SPACE, variables=("a", "b"), reads=("x", "x"))
        except ValueError:
            return
        same(twice, SmoothFunction("f", x**2, SPACE), [3.0, 0.0, 0.0])


class TestShapes:
    f = SmoothFunction("f", x * y + z**2, SPACE)

    @pytest.mark.parametrize("batch", [(), (1,), (8,), (0,), (2, 3), (3, 0), (2, 1, 4)])
    def test_the_last_axis_is_the_point(self, batch):
        q = np.random.default_rng(3).normal(size=(*batch, 3))
        assert np.shape(self.f.value(q)) == batch
        assert self.f.gradient(q).shape == (*batch, 3)
        assert self.f.hessian(q).shape == (*batch, 3, 3)
        np.testing.assert_allclose(self.f.value(q), q[..., 0] * q[..., 1] + q[..., 2] ** 2)

    def test_points_may_be_lists_of_whole_numbers(self):
        assert self.f.value([2, 3, 1]) == 7.0

    def test_views_and_other_orders_are_read_right(self):
        q = np.random.default_rng(3).normal(size=(3, 20))
        expected = self.f.gradient(np.ascontiguousarray(q.T))
        assert np.array_equal(self.f.gradient(q.T), expected)
        assert np.array_equal(self.f.gradient(q.T[::2]), expected[::2])

    def test_a_point_that_may_not_be_written_to_can_be_read(self):
        q = np.array([2.0, 3.0, 1.0])
        q.setflags(write=False)
        assert self.f.value(q) == 7.0
        assert self.f.value(np.broadcast_to(q, (9, 3))).tolist() == [7.0] * 9


class TestBundle:
    @given(st.lists(vectors(3), min_size=0, max_size=10))
    def test_a_bundle_is_its_functions_one_by_one(self, functions, rows):
        points = np.array(rows).reshape(-1, 3)
        together = Bundle(SPACE, functions).evaluate(points, 2)
        for i, f in enumerate(functions):
            assert np.array_equal(together[0][:, i], f.value(points))
            assert np.array_equal(together[1][:, i], f.gradient(points))
            assert np.array_equal(together[2][:, i], f.hessian(points))

    @given(vectors(3), st.integers(0, 2))
    def test_one_point_is_a_batch_of_one(self, functions, q, order):
        bundle = Bundle(SPACE, functions)
        for alone, row in zip(
            bundle.evaluate(q, order), bundle.evaluate(q[None], order), strict=True
        ):
            assert np.array_equal(alone, row[0])

    def test_functions_with_equal_bindings_share_a_call(self, functions):
        calls = Bundle(SPACE, functions).calls
        assert sorted(call.rows for call in calls) == [(0, 1, 4), (2,), (3,), (5,), (6,)]

    def test_a_bundle_of_nothing_has_no_values(self):
        values, gradients = Bundle(SPACE, ()).evaluate(np.zeros((4, 3)), 1)
        assert values.shape == (4, 0)
        assert gradients.shape == (4, 0, 3)

    def test_a_whole_family_in_order_needs_no_assembly(self, functions):
        family = functions[0].family
        whole = [
            SmoothFunction.member(family, n, Manifold.euclidean("a b"), parameters=[1.0])
            for n in family.names
        ]
        shuffled = [whole[i] for i in (2, 0, 1)]
        q = np.random.default_rng(0).normal(size=(11, 2))
        direct = Bundle(whole[0].manifold, whole).evaluate(q, 2)
        assembled = Bundle(whole[0].manifold, shuffled).evaluate(q, 2)
        for left, right in zip(direct, assembled, strict=True):
            assert np.array_equal(left[:, [2, 0, 1]], right)


class TestRefusals:
    @pytest.mark.parametrize("q", [[1.0, 2.0], [1.0, 2.0, math.nan], [[1.0, math.inf, 2.0]], 3.0])
    def test_a_bad_point_is_refused(self, q):
        for method in ("value", "gradient", "hessian"):
            with pytest.raises(ValueError, match=r"^q: "):
                getattr(TestShapes.f, method)(q)

    def test_an_unknown_symbol_is_named(self):
        with pytest.raises(ValueError, match=r"symbol stiffness .*known are x, y, z"):
            SmoothFunction("f", sp.Symbol("stiffness") * x, SPACE)

    def test_an_unsupported_function_is_named(self):
        with pytest.raises(ValueError, match="function zeta"):
            SmoothFunction("f", sp.zeta(x), SPACE)

    @pytest.mark.parametrize("expression", ["x*y", None, [1], {"f": 1}, True, x >= 0, object()])
    def test_what_is_no_expression_is_refused(self, expression):
        with pytest.raises(TypeError, match=r"^gap: expected "):
            SmoothFunction("gap", expression, SPACE)

    @pytest.mark.parametrize("reads", [("x",), ("x", "y"), ("x", "y", "w"), ("x", "y", "z", "x")])
    def test_reads_are_as_many_coordinates_as_variables(self, reads):
        with pytest.raises(ValueError, match=r"^reads: expected 3 .*coordinates x, y, z"):
            SmoothFunction("f", x + y + z, SPACE, reads=reads)

    def test_variables_that_are_no_coordinates_must_be_bound(self):
        with pytest.raises(ValueError, match=r"^reads: "):
            SmoothFunction("f", a + b, SPACE, variables=("a", "b"))

    @pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
    def test_parameters_are_finite(self, number):
        with pytest.raises(ValueError, match=r"^parameters: "):
            SmoothFunction("f", k * x, SPACE, parameters={"k": number})

    @pytest.mark.parametrize("number", ["1", 1j, None, [1.0, 2.0], True])
    def test_parameters_are_numbers(self, number):
        with pytest.raises((TypeError, ValueError), match=r"^parameters: "):
            SmoothFunction("f", k * x, SPACE, parameters={"k": number})

    def test_a_parameter_cannot_hide_a_coordinate(self):
        """Else a slope would silently vanish."""
        with pytest.raises(ValueError, match=r"^parameters: .*x"):
            SmoothFunction("f", x * y, SPACE, parameters={"x": 3.0})

    @pytest.mark.parametrize("name", ["x", "k"])
    def test_a_definition_cannot_hide_a_coordinate_or_a_parameter(self, name):
        with pytest.raises(ValueError, match=f"^definitions: .*{name}"):
            SmoothFunction(
                "f", k * x, SPACE, parameters={"k": 3.0}, definitions={name: sp.Integer(2)}
            )

    @pytest.mark.parametrize("manifold", [None, "x y", ("x", "y", "z")])
    def test_the_manifold_is_a_manifold(self, manifold):
        with pytest.raises(TypeError, match=r"^manifold: expected a Manifold"):
            SmoothFunction("f", x, manifold)

    @pytest.mark.parametrize("numbers", [(), (1.0, 2.0)])
    def test_a_member_has_one_number_for_each_parameter(self, numbers):
        family = Family.of({"f": k * x}, ("x",), ("k",))
        with pytest.raises(ValueError, match=r"^parameters: expected 1 numbers"):
            SmoothFunction.member(family, "f", SPACE, parameters=numbers)
