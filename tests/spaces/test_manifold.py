"""Products of lines and circles: wrapping, shortest vectors, products, and refusals."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import manifolds, vectors

from polycorner import Manifold, SmoothFunction

CYLINDER = Manifold(("phi", "eta"), periods=(math.tau, math.inf), scales=(0.1, 3.0))
PLANE = Manifold.euclidean("x y")


@st.composite
def manifold_and_points(draw, count, reach=1e4):
    M = draw(manifolds())
    return (M, *(draw(vectors(M.dimension, reach)) for _ in range(count)))


def close(M, p, q, reach=1e4):
    """Whether two points agree, angles modulo their periods, up to rounding."""
    return np.abs(M.difference(p, q)).max() <= 64 * np.spacing(reach)


class TestWrap:
    @given(manifold_and_points(1))
    def test_lands_in_the_half_open_period(self, drawn):
        M, q = drawn
        wrapped, periods = M.wrap(q), np.array(M.periods)
        assert (wrapped > -periods / 2 - np.spacing(abs(q))).all()
        assert (wrapped <= periods / 2 + np.spacing(abs(q))).all()

    @given(manifold_and_points(1))
    def test_moves_by_whole_periods_and_leaves_lines_alone(self, drawn):
        M, q = drawn
        moved = M.wrap(q) - q
        for x, period in zip(moved, M.periods, strict=True):
            turns = 0.0 if math.isinf(period) else round(x / period) * period
            assert x == pytest.approx(turns, abs=8 * np.spacing(1e4))

    @given(manifold_and_points(1))
    def test_is_idempotent(self, drawn):
        M, q = drawn
        assert close(M, M.wrap(M.wrap(q)), M.wrap(q))

    def test_half_a_period_belongs_to_the_positive_end(self):
        assert CYLINDER.wrap([-math.pi, 0.0])[0] == math.pi
        assert CYLINDER.wrap([math.pi, 0.0])[0] == math.pi

    def test_does_not_change_its_argument(self):
        q = np.array([10.0, 10.0])
        CYLINDER.wrap(q)
        assert q.tolist() == [10.0, 10.0]


class TestDifferenceAndShift:
    @given(manifold_and_points(2))
    def test_difference_leads_from_the_second_to_the_first(self, drawn):
        M, p, q = drawn
        assert close(M, M.shift(q, M.difference(p, q)), p)

    @given(manifold_and_points(2))
    def test_difference_is_the_shortest_of_all_representatives(self, drawn):
        M, p, q = drawn
        vector = M.difference(p, q)
        for x, a, b, period in zip(vector, p, q, M.periods, strict=True):
            turns = [0.0] if math.isinf(period) else [k * period for k in range(-2, 3)]
            base = a - b - (0 if math.isinf(period) else round((a - b) / period) * period)
            assert abs(x) <= min(abs(base + turn) for turn in turns) + 8 * np.spacing(1e4)

    @given(manifold_and_points(2))
    def test_difference_is_antisymmetric_up_to_a_period(self, drawn):
        M, p, q = drawn
        total = M.difference(p, q) + M.difference(q, p)
        assert close(M, total, 0 * total)

    @given(manifold_and_points(1), st.lists(st.integers(-5, 5), min_size=4, max_size=4))
    def test_whole_turns_do_not_matter(self, drawn, turns):
        M, q = drawn
        winding = np.array(
            [
                0.0 if math.isinf(period) else k * period
                for k, period in zip(turns, M.periods, strict=False)
            ]
        )
        assert np.abs(M.difference(q + winding, q)).max() <= 64 * np.spacing(1e4)

    @given(manifold_and_points(2, reach=0.49))
    def test_difference_undoes_a_short_shift(self, drawn):
        M, q, v = drawn
        np.testing.assert_allclose(M.difference(M.shift(q, v), q), v, atol=1e-12)

    @given(manifold_and_points(2))
    def test_a_shift_lands_in_the_half_open_period(self, drawn):
        M, q, v = drawn
        assert np.array_equal(M.shift(q, v), M.wrap(q + v))

    @given(manifold_and_points(3))
    def test_shifts_add_up(self, drawn):
        M, q, v, w = drawn
        assert close(M, M.shift(M.shift(q, v), w), M.shift(q, v + w))

    @given(manifolds(), st.integers(0, 9), st.integers(0, 2**32 - 1))
    def test_a_batch_is_its_rows(self, M, count, seed):
        rng = np.random.default_rng(seed)
        p, q = rng.uniform(-9, 9, (2, count, M.dimension))
        for batched, single in ((M.difference, M.difference), (M.shift, M.shift)):
            rows = [single(a, b) for a, b in zip(p, q, strict=True)]
            assert np.array_equal(batched(p, q), np.reshape(rows, p.shape))
        assert np.array_equal(M.wrap(p), np.reshape([M.wrap(a) for a in p], p.shape))


class TestProducts:
    def test_names_that_would_repeat_are_numbered(self):
        assert (CYLINDER * CYLINDER).names == ("phi1", "eta1", "phi2", "eta2")
        assert (CYLINDER**3).names == ("phi1", "eta1", "phi2", "eta2", "phi3", "eta3")

    def test_names_that_do_not_repeat_are_kept(self):
        assert (CYLINDER * PLANE).names == ("phi", "eta", "x", "y")
        assert (CYLINDER * CYLINDER * CYLINDER).names[-2:] == ("phi", "eta")

    def test_the_first_power_numbers_nothing(self):
        assert PLANE**1 == PLANE

    @given(manifolds(), manifolds())
    def test_dimension_periods_and_scales_are_those_of_the_factors(self, M, N):
        product = M * N
        assert product.dimension == M.dimension + N.dimension
        assert product.periods == M.periods + N.periods
        assert product.scales == M.scales + N.scales
        assert len(set(product.names)) == product.dimension

    @given(manifolds(), st.integers(2, 4))
    def test_a_power_is_a_repeated_product(self, M, copies):
        assert (M**copies).periods == M.periods * copies
        assert (M**copies).scales == M.scales * copies

    @given(manifold_and_points(2), manifold_and_points(2))
    def test_the_factors_do_not_see_each_other(self, first, second):
        (M, p, q), (N, s, t) = first, second
        whole = (M * N).difference(np.concatenate([p, s]), np.concatenate([q, t]))
        assert np.array_equal(whole, np.concatenate([M.difference(p, q), N.difference(s, t)]))

    def test_what_is_no_manifold_is_no_factor(self):
        with pytest.raises(TypeError):
            PLANE * 3

    @pytest.mark.parametrize("copies", [0, -1, 2.0, "2", None])
    def test_a_power_is_a_positive_whole_number(self, copies):
        with pytest.raises(ValueError, match="copies"):
            PLANE**copies


class TestPoints:
    def test_a_point_may_be_named(self):
        assert PLANE.point({"y": 2.0, "x": 1.0}).tolist() == [1.0, 2.0]

    @pytest.mark.parametrize("q", [[1, 2], (1, 2), np.array([1, 2]), np.float32([1, 2])])
    def test_whole_and_short_numbers_become_float64(self, q):
        assert PLANE.points(q).dtype == np.float64
        assert PLANE.points(q).tolist() == [1.0, 2.0]

    @pytest.mark.parametrize(
        ("q", "error", "says"),
        [
            ([1.0, math.nan], ValueError, "q: .*nan"),
            ([math.inf, 1.0], ValueError, "q: .*inf"),
            ([[0.0, 1.0], [-math.inf, 1.0]], ValueError, r"q: .*-inf at index \(1, 0\)"),
            ([1.0, 2.0, 3.0], ValueError, r"q: .*\(3,\)"),
            (1.0, ValueError, r"q: .*\(\)"),
            ([], ValueError, r"q: .*\(0,\)"),
            (np.zeros((2, 3)), ValueError, r"q: .*\(2, 3\)"),
            ([[1.0, 2.0], [3.0]], ValueError, "q: .*ragged"),
            (["a", "b"], TypeError, "q: "),
            ([True, False], TypeError, "q: .*bool"),
            ([1j, 0.0], TypeError, "q: .*complex"),
            ([None, 1.0], TypeError, "q: .*object"),
            (None, TypeError, "q: .*object"),
        ],
    )
    def test_what_is_no_point_is_refused_by_name(self, q, error, says):
        for method in (PLANE.points, PLANE.point, PLANE.wrap):
            with pytest.raises(error, match=says):
                method(q)
        with pytest.raises(error, match=says):
            PLANE.difference([0.0, 0.0], q)

    @pytest.mark.parametrize("bad", [[1.0, math.nan], [1.0], ["a", "b"], [[1.0], [1.0, 2.0]]])
    def test_the_other_argument_is_named_too(self, bad):
        with pytest.raises((ValueError, TypeError), match=r"^p: "):
            PLANE.difference(bad, [0.0, 0.0])
        with pytest.raises((ValueError, TypeError), match=r"^v: "):
            PLANE.shift([0.0, 0.0], bad)

    def test_one_point_is_not_a_batch(self):
        with pytest.raises(ValueError, match=r"q: expected one point .*\(1, 2\)"):
            PLANE.point([[1.0, 2.0]])

    @pytest.mark.parametrize("q", [{"x": 1.0}, {"x": 1.0, "z": 2.0}, {"x": 1, "y": 2, "z": 3}])
    def test_a_named_point_has_exactly_the_coordinates(self, q):
        with pytest.raises(ValueError, match="q: expected the coordinates x, y"):
            PLANE.point(q)

    @pytest.mark.filterwarnings("error")
    def test_very_large_numbers_are_finite(self):
        assert PLANE.points([1e300, -1e300]).tolist() == [1e300, -1e300]


class TestConstruction:
    def test_lines_of_scale_one_are_the_default(self):
        M = Manifold(("x", "y"))
        assert (M.periods, M.scales) == ((math.inf, math.inf), (1.0, 1.0))
        assert M == PLANE

    @pytest.mark.parametrize("names", ["x y", "x, y", "x,y", ("x", "y"), ["x", "y"]])
    def test_names_in_one_string_or_several(self, names):
        assert Manifold.euclidean(names) == PLANE

    def test_symbols_are_real_and_in_order(self):
        assert [(s.name, s.is_real) for s in PLANE.symbols] == [("x", True), ("y", True)]

    def test_equal_manifolds_are_equal_and_hash_alike(self):
        again = Manifold(["phi", "eta"], [math.tau, math.inf], [0.1, 3])
        assert again == CYLINDER
        assert hash(again) == hash(CYLINDER)

    @pytest.mark.parametrize("kind", [list, tuple, np.array])
    def test_periods_and_scales_may_be_any_sequence(self, kind):
        M = Manifold(("x", "y"), periods=kind([1.0, math.inf]), scales=kind([1.0, 2.0]))
        assert M == Manifold(("x", "y"), (1.0, math.inf), (1.0, 2.0))

    @pytest.mark.parametrize(
        "names",
        ["", (), "x x", ("x", "y", "x"), ("1x",), ("x y",), ("",), (1, 2), ("x", None), "x-y"],
    )
    def test_bad_names_are_refused(self, names):
        with pytest.raises(ValueError, match=r"^names: "):
            Manifold.euclidean(names)

    def test_a_repeated_name_is_quoted(self):
        with pytest.raises(ValueError, match=r"names: .*phi more than once"):
            Manifold(("phi", "eta", "phi"))

    @pytest.mark.parametrize("names", [None, 5])
    def test_what_is_no_sequence_of_names_is_refused(self, names):
        with pytest.raises((ValueError, TypeError), match=r"^names: "):
            Manifold(names)

    @pytest.mark.parametrize("argument", ["periods", "scales"])
    @pytest.mark.parametrize(
        "bad",
        [
            (1.0,),
            (1.0, 2.0, 3.0),
            3.0,
            (0.0, 1.0),
            (-1.0, 1.0),
            (math.nan, 1.0),
            (-math.inf, 1.0),
            ((1.0, 2.0), (3.0, 4.0)),
            ((1.0, 2.0), 3.0),
            ("a", "b"),
            ("1", "2"),
            "ab",
            (None, 1.0),
            (1j, 1.0),
        ],
    )
    def test_bad_periods_and_scales_are_refused_by_name(self, argument, bad):
        with pytest.raises((ValueError, TypeError), match=f"^{argument}: "):
            Manifold(("x", "y"), **{argument: bad})

    def test_a_scale_is_finite_although_a_period_need_not_be(self):
        with pytest.raises(ValueError, match=r"^scales: "):
            Manifold(("x",), scales=(math.inf,))

    @pytest.mark.parametrize("scale", [0.0, -1.0, math.nan, math.inf])
    def test_the_scale_of_euclidean_space_is_positive(self, scale):
        with pytest.raises(ValueError, match=r"^scales?: "):
            Manifold.euclidean("x y", scale=scale)


def test_units_are_stated_and_angles_have_theirs():
    drum = Manifold(("phi", "eta", "turns"), (math.tau, math.inf, 1.0))
    assert drum.units == ("rad", "", "")
    stated = Manifold(drum.names, drum.periods, units=("rad", "mm", "turn"))
    assert stated == drum
    assert (stated * Manifold.euclidean("x y", unit="m")).units == ("rad", "mm", "turn", "m", "m")
    assert pickle.loads(pickle.dumps(stated)).units == stated.units
    for units in (("mm",), "mm", ("rad", "mm", None)):
        with pytest.raises(ValueError, match=r"^units: expected 3 strings"):
            Manifold(drum.names, drum.periods, units=units)


def test_functions_have_units():
    M = Manifold.euclidean("x")
    gap = SmoothFunction("gap", M.symbols[0], M, unit="mm")
    assert (gap.unit, gap.renamed("other").unit) == ("mm", "mm")
    assert SmoothFunction("gap", M.symbols[0], M).unit == ""
