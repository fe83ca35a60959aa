"""Depths of dyads and their passes: closed forms, six coordinates, constrained descent."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize, minimize_scalar

from polycorner import Verdict
from polycorner.dumbbells import (
    DumbbellPair,
    RelativePlacements,
    critical_rod_radius,
    pair_landscape,
    plane_depth_formula,
)
from polycorner.dumbbells.statics.critical import escape_barrier, mountain_pass
from polycorner.dumbbells.statics.depths import PairLandscape
from polycorner.minimisation import stationary_on

DRUM = DumbbellPair(16, 3, 1.5, 125)
PLANE = replace(DRUM, drum_radius=math.inf)
found = cache(pair_landscape)
both = pytest.mark.parametrize("pair", [DRUM, PLANE], ids=["drum", "plane"])


def height(pair, q):
    """Return the height of a placement in six coordinates above the pair end to end."""
    return float(pair.energy.value(q) - pair.energy.value(pair.end_to_end()))


def inside(bounds, number):
    """Whether exact bounds contain a number of forty digits."""
    return sympy.Rational(bounds[0]) <= number <= sympy.Rational(bounds[1])


@both
def test_the_tree_is_that_of_the_paper(pair):
    one = found(pair)
    assert one.landscape.complete
    assert {level.name: len(level.numbers) for level in one.minima} == {"G": 8, "delta": 16}
    passes = {level.name: (len(level.numbers), level.contacts) for level in one.passes}
    assert passes.keys() == {"G - delta", "delta_L - delta_R"}
    (opens, first), (turns, second) = passes["G - delta"], passes["delta_L - delta_R"]
    assert (opens, turns) == (16, 8)
    assert [[*map(len, names)] for names in (first, second)] == [[4], [4, 4]]
    # of two contacts each ball has one
    assert len(set(second[0] + second[1])) == 4


@both
def test_closed_forms_of_the_passes(pair):
    r = sympy.Rational(pair.ball_radius)
    first = r**2
    if not pair.is_plane:
        rho = sympy.Rational(pair.centre_radius)
        first = sympy.N(2 * (rho - sympy.sqrt(rho**2 - r**2)), 40)
    opens, turns = (level.height for level in found(pair).passes)
    assert inside(opens, first)
    assert inside(turns, 2 * first)
    assert all(high - low < 1e-9 * low for low, high in (opens, turns))
    for k in found(pair).passes[1].numbers:
        assert inside(found(pair).landscape.passes[k].energy, 2 * r**2)


def test_closed_form_of_the_depth_in_the_plane():
    symbols = sympy.symbols("l r t", positive=True)
    sizes = dict(zip(symbols, (16, 3, sympy.Rational(3, 2)), strict=True))
    low, high = found(PLANE).depth
    assert inside((low, high), sympy.N(plane_depth_formula().subs(sizes), 40))
    assert high - low < 1e-9 * low


@both
def test_stationary_points_in_six_coordinates_have_these_heights(pair):
    opens, turns = (level.height for level in found(pair).passes)
    top = mountain_pass(pair)
    assert height(pair, top.point) == pytest.approx(opens[0], rel=1e-9)
    beside = stationary_on(pair.polyhedron, pair.energy, pair.side_by_side(), ("A1B1", "A2B2"))
    assert beside.verdict is Verdict.SADDLE
    assert height(pair, beside.point) == pytest.approx(turns[0], rel=1e-9)
    assert found(pair).depth[0] == pytest.approx(escape_barrier(pair), rel=1e-9)


@both
def test_points_of_the_landscape_have_these_heights_in_six_coordinates(pair):
    one, model = found(pair), RelativePlacements(pair)
    pairs = [(one.minima, one.landscape.minima), (one.passes, one.landscape.passes)]
    for levels, points in pairs:
        for level in levels:
            for k in level.numbers:
                q = model.placement(points[k].point)
                assert height(pair, q) == pytest.approx(level.height[0], rel=1e-9, abs=1e-9)
                assert pair.polyhedron.values(q).min() > -1e-9


@both
def test_pulling_a_dyad_apart_takes_that_much(pair):
    """The greatest of the least heights of pairs with a given distance along the drum."""
    unit = pair.manifold.scale_array
    start = pair.nested("R", clearance=0.0)

    def least(apart):
        rules = [
            {"type": "ineq", "fun": lambda s: pair.polyhedron.values(s * unit)},
            {"type": "eq", "fun": lambda s: ((s * unit)[4] - (s * unit)[1] - apart) / unit[1]},
        ]
        begun = start + np.array([0, start[1] - apart / 2 + start[4], 0, 0, 0, 0])
        options = {"ftol": 1e-14, "maxiter": 300}
        done = minimize(
            lambda s: height(pair, s * unit), begun / unit, constraints=rules, options=options
        )
        assert pair.polyhedron.values(done.x * unit).min() > -1e-7
        return done.fun

    reach = pair.length
    top = minimize_scalar(lambda y: -least(y), bounds=(0.9 * reach, reach), method="bounded")
    low = minimize_scalar(least, bounds=(0.75 * reach, 0.8 * reach), method="bounded")
    assert -top.fun - low.fun == pytest.approx(found(pair).depth[0], rel=1e-3)


@both
def test_the_way_out_lies_in_the_set_and_below_its_top(pair):
    one, model = found(pair), RelativePlacements(pair)
    route = one.opening.route
    assert route.verified
    shares = np.linspace(0, 1, 20)[:, None]
    steps = list(pairwise(route.vertices))
    curved = np.array([one.pair.polyhedron.values(model.placement(v)).min() < 1e-9
                       for v in route.vertices])  # fmt: skip
    for (a, b), ends in zip(steps, pairwise(curved), strict=True):
        q = model.placement(a + shares * (b - a))
        # Between vertices on the same wall the path is a curve along it.
        assert pair.polyhedron.values(q).min() > (-5e-3 if any(ends) else -1e-9)
        heights = pair.energy.value(q) - pair.energy.value(pair.end_to_end())
        assert heights.max() <= one.passes[0].height[1] + 1e-9
    q = model.placement(route.vertices)
    assert pair.polyhedron.values(q).min() > -1e-8
    heights = pair.energy.value(q) - pair.energy.value(pair.end_to_end())
    assert heights[0] == pytest.approx(one.rest[0], rel=1e-6)
    assert heights[-1] == pytest.approx(0.0, abs=1e-6)


def test_rods_with_weight_multiply_heights():
    heavy = replace(DRUM, rod_weight=0.6)
    one = PairLandscape(heavy, found(DRUM).landscape)
    assert one.depth[0] == pytest.approx(1.3 * found(DRUM).depth[0], rel=1e-12)
    assert one.depth[0] == pytest.approx(escape_barrier(heavy), rel=1e-9)


@given(st.floats(1e-12, 20), st.floats(30, 2000), st.floats(0, 3))
def test_bounds_of_heights_contain_the_exact_value(energy, drum, weight):
    one = PairLandscape(DumbbellPair(16, 3, 1.5, drum, weight), found(DRUM).landscape)
    rho, e = sympy.Rational(one.pair.centre_radius), sympy.Rational(energy)
    exact = sympy.N(4 * (rho - sympy.sqrt(rho**2 - e / 2)) * (1 + sympy.Rational(weight) / 2), 40)
    low, high = one.height((energy, energy))
    assert inside((low, high), exact)
    assert high - low <= 1e-14 * high + 1e-300


@given(st.floats(12, 60), st.floats(0.2, 0.97))
def test_the_depth_vanishes_at_the_critical_rod_and_opening_is_half_of_turning(length, share):
    """Above ``delta`` the hands are more than twice as far from each other as from ``G``."""
    pair = DumbbellPair(length, 3, 1.5)
    critical = critical_rod_radius(pair)
    symbols = sympy.symbols("l r t", positive=True)
    depth = sympy.lambdify(symbols, plane_depth_formula())
    assert depth(length, 3.0, critical) == pytest.approx(0, abs=1e-6)
    thin = depth(length, 3.0, share * critical)
    assert 0 < thin < 9
    assert thin + 9 > 2 * thin
    assert escape_barrier(replace(pair, rod_radius=share * critical)) == pytest.approx(
        thin, rel=1e-6, abs=1e-9
    )


@given(st.integers(0, 10**6), st.floats(-0.3, 0.3), st.floats(-0.5, 0.5))
def test_a_tilt_and_common_accelerations_only_scale_the_landscape(seed, tilt, turn):
    """Gravity across the drum is turned by rolling, and along the drum it moves no relative one."""
    q = DRUM.placements(np.random.default_rng(seed), 3)
    x, y, z = np.moveaxis(DRUM.ball_centres(q), -1, 0)
    tilted = (math.cos(tilt) * z - math.sin(tilt) * y).sum(axis=-1)
    along = 2 * (q[:, 1] + q[:, 4])
    assert tilted == pytest.approx(math.cos(tilt) * z.sum(axis=-1) - math.sin(tilt) * along)
    turned = (math.cos(turn) * z + math.sin(turn) * x).sum(axis=-1)
    rolled = q + np.array([turn, 0, 0, turn, 0, 0])
    assert turned == pytest.approx(DRUM.ball_centres(rolled)[..., 2].sum(axis=-1))


def test_thick_rods_hold_no_dyad():
    thick = found(replace(PLANE, rod_radius=2.95))
    assert {level.name for level in thick.minima} == {"G"}
    assert thick.rest is thick.opening is thick.depth is thick.turnover is None
    assert "depth" not in str(thick).split("Minima")[0]


def test_without_time_nothing_is_claimed():
    one = pair_landscape(DRUM, max_seconds=1e-9)  # one round of boxes, on any machine
    assert not one.landscape.complete
    assert one.depth is None
    assert "not proved" in str(one)
