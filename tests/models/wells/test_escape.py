"""Escape from wells by noise: exponents, the overdamped limit and the backward equation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import gamma

from polycorner import Entrapment
from polycorner.models.wells.escape import (
    barrier,
    mean_escape_time,
    overdamped_escape_time,
    places,
    speeds,
)
from polycorner.models.wells.wells import KINDS, Well

U, HALF_U, HALF_V = KINDS
numbers = st.floats(0.3, 3.0)


def kick_at(well, temperature):
    return math.sqrt(2 * well.drag * temperature)


# ----------------------------------------------------------------------------------------- barriers


def least_action(well, steps=160):
    """Find the cheapest force from rest at 0 to the rim that stays in the well, by brute force."""
    import cvxpy as cp

    best = math.inf
    natural = well.rim * math.sqrt(well.mass / well.depth)
    slow = natural + well.rim**2 * well.drag / well.depth
    for time in np.linspace(1.5 * natural, 2 * slow + 1.5 * natural, 13):
        h = time / steps
        x, v, u = cp.Variable(steps + 1), cp.Variable(steps + 1), cp.Variable(steps)
        middle, mean = (x[1:] + x[:-1]) / 2, (v[1:] + v[:-1]) / 2
        force = u - well.slope - well.stiffness * middle - well.drag * mean
        rules = [x[0] == 0, v[0] == 0, x[-1] == well.rim, x >= 0]
        rules += [x[1:] - x[:-1] == h * mean, well.mass * (v[1:] - v[:-1]) == h * force]
        problem = cp.Problem(cp.Minimize(h * cp.sum_squares(u) / 2), rules)
        problem.solve(solver=cp.CLARABEL)
        best = min(best, problem.value)
    return best


@pytest.mark.parametrize("kind", [HALF_U, HALF_V])
@pytest.mark.parametrize("drag", [0.0, 0.7, 3.0])
def test_barrier_is_the_least_action(kind, drag):
    """The wall only pushes outward at rest there, which is as good as starting later."""
    well = Well.of_depth(kind, 1.3, 0.8, mass=0.6, drag=drag)
    assert least_action(well) / 0.5**2 == pytest.approx(barrier(well, 0.5), rel=0.02)


@given(numbers, numbers, numbers)
def test_barriers_without_drag_in_closed_form(depth, rim, mass):
    """``8 sqrt(2/3) sqrt(a m) f^1.5 / 2`` and ``a^2 m^2 w^3 / pi``, over ``kick^2``; none for U."""
    half_v = Well.of_depth(HALF_V, depth, rim, mass=mass)
    expected = 4 * math.sqrt(2 / 3 * rim * mass) * half_v.slope**1.5 / 2
    assert barrier(half_v, 1.0) == pytest.approx(expected, rel=1e-6)
    half_u = Well.of_depth(HALF_U, depth, rim, mass=mass)
    expected = rim**2 * mass**2 * half_u.frequency**3 / math.pi
    assert barrier(half_u, 1.0) == pytest.approx(expected, rel=1e-9)
    assert barrier(replace(half_u, drag=1e-6), 1.0) == pytest.approx(expected, rel=1e-4)
    assert barrier(Well.of_depth(U, depth, rim, mass=mass), 1.0) == 0.0


@given(numbers, st.floats(0.01, 30.0))
def test_absorbing_walls_raise_barriers_in_the_papers_order(depth, drag):
    """Never below ``D / T``, which is left where drag outweighs inertia; half-V is the highest."""
    first, second, third = (barrier(Well.of_depth(k, depth, drag=drag), 1.0) for k in KINDS)
    assert first == pytest.approx(2 * drag * depth)
    assert first <= second * (1 + 1e-12)
    assert second < third * (1 + 1e-6)


def test_barriers_are_those_of_equilibrium_when_overdamped():
    for kind in KINDS:
        wells = [Well.of_depth(kind, 1.0, drag=c) for c in (20.0, 40.0, 80.0)]
        rises = [barrier(well, kick_at(well, 0.2)) / 5 - 1 for well in wells]
        if kind is HALF_V:
            orders = np.log2(np.array(rises[:-1]) / rises[1:])
            assert orders == pytest.approx(2, abs=0.05)
        assert rises[-1] == pytest.approx(0, abs=1e-3)


def test_elastic_walls_change_no_barrier():
    for kind in (HALF_U, HALF_V):
        well = Well.of_depth(kind, 1.0, drag=0.3, restitution=1.0)
        assert barrier(well, 0.5) == pytest.approx(1.0 / well.temperature(0.5))


def test_a_spring_adds_to_a_slope():
    slope, spring = Well(1.0, 0.0, drag=0.5), Well(0.0, 1.0, drag=0.5)
    both = barrier(Well(1.0, 1.0, drag=0.5), 1.0)
    assert both > barrier(slope, 1.0) + barrier(spring, 1.0)
    assert barrier(Well(1.0, 1e-9, drag=0.5), 1.0) == pytest.approx(barrier(slope, 1.0))
    assert barrier(Well(1e-9, 1.0, drag=0.5), 1.0) == pytest.approx(barrier(spring, 1.0), rel=1e-3)


# --------------------------------------------------------------------------------- overdamped limit


def by_sums(well, kick, count=4000):
    """The double integral as sums over a grid, by the midpoint rule."""
    temperature = kick**2 / (2 * well.drag)
    y = (np.arange(count) + 0.5) * well.rim / count
    inner = np.cumsum(np.exp(-well.potential(y) / temperature))
    inner -= 0.5 * np.exp(-well.potential(y) / temperature)
    total = np.sum(np.exp(well.potential(y) / temperature) * inner) * (well.rim / count) ** 2
    return well.drag / temperature * total


@given(st.sampled_from([(0.0, 2.0), (1.5, 0.0), (1.0, 3.0)]), numbers, numbers)
def test_overdamped_times_are_the_double_integral(strength, rim, temperature):
    well = Well(*strength, rim, drag=1.7)
    kick = kick_at(well, temperature)
    assert overdamped_escape_time(well, kick) == pytest.approx(by_sums(well, kick), rel=1e-4)


@given(st.floats(0.1, 40.0), numbers, numbers)
def test_overdamped_half_v_is_an_elementary_function(ratio, rim, drag):
    well = Well.of_depth(HALF_V, ratio, rim, drag=drag)
    expected = drag * rim**2 * (math.exp(ratio) - 1 - ratio) / ratio**2
    assert overdamped_escape_time(well, kick_at(well, 1.0)) == pytest.approx(expected, rel=1e-9)


@given(st.floats(0.1, 40.0))
def test_overdamped_series(ratio):
    """Term by term half-U is above half-V, by a factor that grows from 1."""
    n = np.arange(1, 150)
    start, rest = 0.5, ratio ** n.astype(float) / (gamma(n + 1) * (n + 1) * (n + 2))
    factor = (n + 2) * math.sqrt(math.pi) * gamma(n + 1) / (4 * gamma(n + 1.5))
    assert factor[0] == pytest.approx(1.0)
    assert (np.diff(factor) > 0).all()
    for kind, total in ((HALF_V, rest.sum()), (HALF_U, rest @ factor), (U, rest @ factor)):
        well = Well.of_depth(kind, ratio, drag=1.0)
        found = overdamped_escape_time(well, kick_at(well, 1.0))
        assert found == pytest.approx(start + total, rel=1e-9)


def test_deep_and_overdamped_half_v_is_weaker_by_a_root():
    def ratio(depth):
        first, second = (Well.of_depth(kind, depth, drag=1.0) for kind in (HALF_U, HALF_V))
        times = [overdamped_escape_time(well, kick_at(well, 1.0)) for well in (first, second)]
        return times[0] / times[1] / (math.sqrt(math.pi * depth) / 4)

    gaps = [ratio(depth) - 1 for depth in (20.0, 40.0, 80.0)]
    assert 0 < gaps[2] < gaps[1] < gaps[0] < 0.03
    assert math.log2(gaps[0] / gaps[1]) == pytest.approx(1, abs=0.1)


# -------------------------------------------------------------------------------- backward equation


@pytest.mark.parametrize("drag", [0.0, 0.8, 5.0])
def test_an_elastic_half_u_well_is_the_folded_u_well(drag):
    """Two grids, one with a wall and one without."""
    walled = Well.of_depth(HALF_U, 1.5, drag=drag, restitution=1.0)
    kick = kick_at(walled, 0.75) if drag > 0 else 1.0
    both = [mean_escape_time(w, kick) for w in (walled, Well.of_depth(U, 1.5, drag=drag))]
    assert both[0] == pytest.approx(both[1], rel=5e-3)


@given(numbers, numbers, st.sampled_from(KINDS))
def test_units_do_not_matter(rim, mass, kind):
    """Lengths in rims, times in ``a sqrt(m / D)``."""
    depth, unit = 1.5, rim * math.sqrt(mass / 1.5)
    well = Well.of_depth(kind, depth, rim, mass=mass, drag=0.8 * mass / unit, friction=0.1 / rim)
    plain = Well.of_depth(kind, 1.0, drag=0.8, friction=0.1 / depth)
    scaled = mean_escape_time(well, kick_at(well, 0.75), cells=15) / unit
    assert scaled == pytest.approx(mean_escape_time(plain, kick_at(plain, 0.5), cells=15), rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_differences_are_of_second_order_at_least(kind):
    well = Well.of_depth(kind, 2.0, drag=1.0, restitution=1.0)
    found = [mean_escape_time(well, kick_at(well, 1.0), cells=n) for n in (15, 30, 60)]
    first, second = np.abs(np.diff(found))
    assert math.log2(first / second) > 1.6
    assert second < 0.02 * found[-1]


@pytest.mark.parametrize("kind", KINDS)
def test_with_much_drag_it_is_the_overdamped_time(kind):
    """A layer of the thickness ``sqrt(m T) / c`` at the rim is left, of first order."""
    excess = []
    for drag in (25.0, 50.0, 100.0):
        well = Well.of_depth(kind, 1.5, drag=drag)
        limit = overdamped_escape_time(well, kick_at(well, 1.0))
        excess.append(mean_escape_time(well, kick_at(well, 1.0)) / limit - 1)
    assert excess[0] < 0.3
    orders = np.log2(np.array(excess[:-1]) / excess[1:])
    assert orders == pytest.approx(1, abs=0.25)


def test_walls_matter_less_and_less_with_drag():
    ratios = []
    for drag in (1.0, 4.0, 16.0, 64.0):
        wells = [Well.of_depth(HALF_U, 2.0, drag=drag, restitution=e) for e in (0.0, 1.0)]
        absorbing, elastic = (mean_escape_time(w, kick_at(w, 1.0)) for w in wells)
        ratios.append(absorbing / elastic - 1)
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[0] > 0.8
    assert ratios[-1] < 0.02


@pytest.mark.parametrize(("kind", "low"), [(U, 0.97), (HALF_U, 0.97), (HALF_V, 0.86)])
def test_times_grow_like_the_exponential_of_the_barrier(kind, low):
    """A power of the noise is left, so that the slope comes near to 1 slowly."""
    well = Well.of_depth(kind, 1.0, drag=2.0)
    kicks = [kick_at(well, 1 / ratio) for ratio in (3.0, 4.0, 5.0)]
    logs = np.log([mean_escape_time(well, kick, cells=50) for kick in kicks])
    slopes = np.diff(logs) / np.diff([barrier(well, kick) for kick in kicks])
    assert ((low < slopes) & (slopes < 1.06)).all()


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_friction_and_losses_lengthen_the_time(restitution):
    for kind in KINDS:
        well = Well.of_depth(kind, 1.5, drag=1.0, restitution=restitution if kind is not U else 0)
        times = [
            mean_escape_time(replace(well, friction=f), 1.4, cells=30) for f in (0.0, 0.2, 0.4)
        ]
        assert times == sorted(times)
        assert times[1] > 1.1 * times[0]


def test_grids_hold_both_ends_and_no_speed_of_zero():
    for kind in KINDS:
        well = Well.of_depth(kind, 1.0, 2.0, drag=1.0)
        x, v = places(well, 20), speeds(well, 1.0, 20)
        assert (np.diff(x) > 0).all()
        assert x[[0, -1]].tolist() == [0.0 if well.wall else -2.0, 2.0]
        assert v == pytest.approx(-v[::-1])
        assert v[len(v) // 2] > 0
        assert v[-1] > math.sqrt(2 * well.depth / well.mass)


# ---------------------------------------------------------------------------------------- arguments


def test_what_has_no_answer_is_refused():
    rubbing = Well(1.0, 0.0, drag=1.0, friction=0.1)
    for function in (barrier, overdamped_escape_time):
        with pytest.raises(ValueError, match=r"friction: expected 0, .* no closed form; got 0.1"):
            function(rubbing, 1.0)
    with pytest.raises(ValueError, match=r"restitution: expected 0 or 1, .*; got 0.5"):
        barrier(Well(1.0, 0.0, restitution=0.5), 1.0)
    with pytest.raises(ValueError, match="kick: expected noise that shakes the mass out now and"):
        mean_escape_time(Well(1.0, 0.0, drag=1.0), 0.01)
    with pytest.raises(ValueError, match="cells: expected more for noise as weak as"):
        mean_escape_time(Well.of_depth(HALF_V, 3.0, drag=0.5), 1.0, cells=10)
    assert Well(1.0, 0.0).kind is Entrapment.HALF_V
