"""Problems that lie within one tolerance and beyond another: what the two arguments change."""

import numpy as np
import pytest

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Verdict, certify, minimise, stationary_on
from polycorner.minimisation import Mobility, immobility, minima

LINE, PLANE = Manifold.euclidean("x"), Manifold.euclidean("x y")
(s,) = LINE.symbols
x, y = PLANE.symbols


@pytest.mark.parametrize(("tolerance", "end"), [(1e-6, 1.0), (1e-8, -(2.0**-10))])
def test_a_contact_within_the_tolerance_is_passed(tolerance, end):
    """At the distance t of the contact the gap is t^2 / 2, which every step closes by half of t."""
    D = Polyhedron(PLANE, {"wall": y + x**2 / 2, "end": 1 - x}, {"floor": y})
    c = minimise(D, -x, [-1.0, 0.0], max_iterations=10, tolerance=tolerance)
    assert c.point == pytest.approx([end, 0.0], abs=1e-12)
    assert (c.verdict is Verdict.STRICT_MINIMUM) == (end == 1.0)


@pytest.mark.parametrize(("tolerance", "least"), [(1e-5, -1.0), (1e-8, 0.0)])
def test_branches_that_touch_within_the_tolerance_are_followed(tolerance, least):
    D = Polyhedron(LINE, AnyOf(s, AllOf(-1e-6 - s, s + 1)))
    c = minimise(D, s, [0.5], tolerance=tolerance)
    assert c.point == pytest.approx([least], abs=1e-12)
    assert c.verdict is Verdict.STRICT_MINIMUM


@pytest.mark.parametrize(("tolerance", "found"), [(1e-6, True), (1e-7, False)])
def test_the_last_step_on_a_face_is_within_the_tolerance(tolerance, found):
    """Newton's method multiplies x by 4/5; the last of sixty steps is (4/5)^59 / 5 ~ 4e-7."""
    c = stationary_on(Polyhedron(LINE, {"wall": s + 2}), s**6, [1.0], [], tolerance=tolerance)
    assert c.point == pytest.approx([0.8**60 if found else 1.0], rel=1e-6)
    assert (c.search is None) == found


@pytest.mark.parametrize(("tolerance", "count"), [(1e-8, 1), (1e-10, 2)])
def test_minima_apart_by_more_than_the_tolerance_has_as_the_same_are_two(tolerance, count):
    """Their distance 8e-7 is less than 1e-6, and more than 1e-6 (1e-10 / 1e-8)^(3/4)."""
    D = Polyhedron(LINE, AnyOf(s - 8e-7, -s))
    found = minima(D, (s - 4e-7) ** 2, starts=[[1.0], [-1.0]], tolerance=tolerance)
    assert len(found) == count
    assert sum(found.counts) == 2


@pytest.mark.parametrize("tolerance", [1e-10, 1e-8, 1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize("energy", [x**2 + y, x**2 + y**2])
def test_a_point_beside_a_minimum_is_it_within_the_tolerance(energy, tolerance):
    D = Polyhedron(PLANE, {"floor": y})
    weak = energy.has(y**2)
    for share, verdict in (
        (0.5, "WEAK_MINIMUM" if weak else "STRICT_MINIMUM"),
        (2, "NOT_STATIONARY"),
    ):
        c = certify(D, energy, [share * tolerance, 0.0], tolerance=tolerance)
        assert c.verdict.name == verdict


@pytest.mark.parametrize(("rank_tolerance", "count"), [(1e-6, 2), (1e-3, 1)])
def test_weak_functions_hold_directions_that_are_independent(rank_tolerance, count):
    """Unit gradients at the angle 1e-4 have the singular values 1.4 and 7e-5."""
    D, energy = Polyhedron(PLANE, {"a": y, "b": y + 1e-4 * x}), x**2 + y**2
    (found,) = minima(D, energy, starts=[[1.0, 1.0]], rank_tolerance=rank_tolerance)
    for c in (found, certify(D, energy, [0.0, 0.0], rank_tolerance=rank_tolerance)):
        assert c.entrapment_counts["half-U"] == count
        assert c.rank_tolerance == rank_tolerance


@pytest.mark.parametrize(("rank_tolerance", "unique"), [(1e-6, False), (1e-3, True)])
def test_multipliers_of_a_small_range_are_unique(rank_tolerance, unique):
    """Of x, y and x + y, that of x + y is from 0 to 1e-5, beyond 1e-7 and within 1e-4."""
    D = Polyhedron(PLANE, {"a": x, "b": y, "c": x + y})
    c = certify(D, x + 1e-5 * y, [0.0, 0.0], rank_tolerance=rank_tolerance)
    assert c.multiplier_ranges["c"] == pytest.approx((0.0, 1e-5))
    assert c.multipliers_unique == unique


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_a_point_off_a_channel_by_less_than_the_tolerance_slides(size):
    straight = Polyhedron(PLANE, {"floor": size * y, "ceiling": -size * y})
    found = immobility(straight, [0.0, -1e-7], tolerance=1e-6)
    assert found.mobility is Mobility.MOBILE
    assert abs(found.motion) == pytest.approx(np.array([1.0, 0.0]))
    bent = Polyhedron(PLANE, {"floor": size * (y - x**2), "ceiling": -size * y})
    assert immobility(bent, [0.0, -1e-7], tolerance=1e-6).mobility is Mobility.SECOND_ORDER
