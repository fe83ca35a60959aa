"""Error bars of headings: derivatives, and the same by sampling."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.critical import critical_rod_radius
from polycorner.dumbbells.statics.error_bars import error_bar, heading_error_bar, pair_sensitivity

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
TOLERANCES = {"length": 0.1, "ball_radius": 0.05, "rod_radius": 0.05, "drum_radius": 1.0}


@given(st.floats(11, 24), st.floats(0.2, 0.8))
def test_heading_in_the_plane_moves_as_the_closed_form_says(length, share):
    """Differences of the closed form, extrapolated to fourth order."""
    pair = DumbbellPair(length, 3.0, 3.0 * share)
    found = dict(zip((s := pair_sensitivity(pair)).parameters, s.of("theta1"), strict=True))
    assert set(found) == {"length", "ball_radius", "rod_radius", "rod_weight"}

    def difference(name, h):
        up, down = (replace(pair, **{name: getattr(pair, name) + d}) for d in (h, -h))
        return (up.plane_corner()[0] - down.plane_corner()[0]) / (2 * h)

    for name in ("length", "ball_radius", "rod_radius"):
        h = 1e-3
        slope = (4 * difference(name, h / 2) - difference(name, h)) / 3
        assert found[name] == pytest.approx(slope, abs=1e-9)
    assert found["rod_weight"] == pytest.approx(0, abs=1e-12)


def test_ball_radius_moves_the_cylinder_of_centres_too():
    """d/d ball_radius at fixed R differs from d/dr at fixed rho, and differences confirm it."""
    drum = replace(PAIR, drum_radius=15.0)
    s, h = pair_sensitivity(drum), 1e-4
    up, down = (
        minimise(p.polyhedron, p.energy, s.certificate.point).point[0]
        for p in (replace(drum, ball_radius=3 + d) for d in (h, -h))
    )
    k = s.parameters.index("ball_radius")
    assert s.point[0, k] == pytest.approx((up - down) / (2 * h), rel=1e-6)


def test_weight_of_the_rods_only_multiplies_energy_and_multipliers():
    heavy = replace(PAIR, rod_weight=0.6)
    s = pair_sensitivity(heavy)
    k = s.parameters.index("rod_weight")
    np.testing.assert_allclose(s.point[:, k], 0, atol=1e-12)
    assert s.energy[k] == pytest.approx(s.certificate.energy / 2.6)
    for name, row in s.multipliers.items():
        assert row[k] == pytest.approx(s.certificate.multipliers[name] / 2.6, rel=1e-9)


def test_chiralities_are_mirror_images():
    right, left = pair_sensitivity(PAIR, "R"), pair_sensitivity(PAIR, "L")
    np.testing.assert_allclose(right.of("theta1"), -left.of("theta1"), atol=1e-12)
    np.testing.assert_allclose(right.energy, left.energy, atol=1e-12)


def sampled(tolerances, normal):
    """Headings of pairs with sampled sizes, in degrees, each brought to rest anew."""
    near = minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested("R")).point
    headings = []
    for row in normal:
        sizes = {
            n: getattr(PAIR, n) + s * z for (n, s), z in zip(tolerances.items(), row, strict=True)
        }
        pair = replace(PAIR, **sizes)
        rest = minimise(pair.polyhedron, pair.energy, near)
        assert rest.is_minimum
        headings.append(math.degrees(pair.heading(rest.point)[0]))
    return np.array(headings)


def test_error_bar_is_the_spread_of_sampled_pairs():
    bar = heading_error_bar(PAIR, TOLERANCES)
    normal = np.random.default_rng(5).standard_normal((300, len(TOLERANCES)))
    headings = sampled(TOLERANCES, normal)
    assert bar.value == pytest.approx(headings.mean(), abs=4 * bar.spread / math.sqrt(300))
    # The standard deviation of a sample of N has the relative error 1/sqrt(2 N).
    assert headings.std(ddof=1) == pytest.approx(bar.spread, rel=4 / math.sqrt(600))
    linear = bar.value + normal @ [bar.shares[name] for name in TOLERANCES]
    assert np.abs(headings - linear).max() < 0.1 * bar.spread


def test_what_the_error_bar_neglects_is_of_second_order():
    normal = np.random.default_rng(6).standard_normal((20, len(TOLERANCES)))
    left = []
    for factor in (1.0, 0.5, 0.25):
        tolerances = {name: factor * size for name, size in TOLERANCES.items()}
        bar = heading_error_bar(PAIR, tolerances)
        linear = bar.value + normal @ [bar.shares[name] for name in tolerances]
        left.append(np.sqrt(np.mean((sampled(tolerances, normal) - linear) ** 2)))
    orders = np.log2(np.array(left[:-1]) / np.array(left[1:]))
    assert ((1.9 < orders) & (orders < 2.1)).all()


def test_shares_add_in_squares_and_exact_sizes_do_not_count():
    bar = heading_error_bar(PAIR, TOLERANCES)
    single = [heading_error_bar(PAIR, {name: size}) for name, size in TOLERANCES.items()]
    assert bar.spread == pytest.approx(math.sqrt(sum(one.spread**2 for one in single)))
    assert heading_error_bar(PAIR, {}).spread == 0.0
    assert str(heading_error_bar(PAIR, {"length": 0.1})) == "7.943 +- 0.048"
    assert str(heading_error_bar(PAIR, {})) == "7.942818 +- 0.000000"


def test_any_quantity_may_have_an_error_bar():
    found = pair_sensitivity(PAIR)
    bar = error_bar(found, PAIR.energy, {"drum_radius": 0.5})
    k = found.parameters.index("drum_radius")
    assert bar.value == pytest.approx(found.certificate.energy)
    assert bar.spread == pytest.approx(0.5 * abs(found.energy[k]))


def test_without_a_corner_there_is_no_derivative():
    with pytest.raises(ValueError, match="does not lie in the polyhedron"):
        pair_sensitivity(replace(PAIR, length=7.0, rod_radius=0.5))


def test_at_the_critical_thickness_there_is_no_derivative():
    critical = replace(PAIR, rod_radius=critical_rod_radius(PAIR))
    with pytest.raises(ValueError, match=r"multiplier of A2b, aB1 is zero.*one-sided"):
        pair_sensitivity(critical)
