"""Minima of two dumbbells against closed forms, scans, and corners found another way."""

import math
from dataclasses import replace

import numpy as np
import pytest
from crossings import crossing_clearance
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from strategies import placed_pairs

from polycorner import Verdict
from polycorner.dumbbells import DumbbellPair, dyad_minima
from polycorner.dumbbells.statics.minima import (
    energy_symmetry,
    kind_of,
    pair_minima,
    scattered,
)
from polycorner.dumbbells.statics.skeleton import long_rod_length
from polycorner.minimisation import minima

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
PLANE = replace(PAIR, drum_radius=math.inf)


def kinds(found):
    return sorted(kind_of(certificate) for certificate in found)


# --------------------------------------------------------------------------------- symmetry


@given(placed_pairs(weighted=True), st.booleans(), st.floats(-20, 20))
def test_the_symmetry_leaves_energy_and_gaps_unchanged(placed, mirror, shift):
    pair, q = placed
    assume(pair.polyhedron.contains(q, tolerance=pair.rod_radius))
    symmetry = energy_symmetry(pair, mirror=mirror)
    gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q), strict=True))
    size = pair.length + pair.ball_radius
    for element in symmetry.elements:
        image = element.apply(q)
        assert pair.energy.value(image) == pytest.approx(pair.energy.value(q), rel=1e-9, abs=1e-9)
        there = dict(zip(pair.polyhedron.names, pair.polyhedron.values(image), strict=True))
        for name, value in gaps.items():
            assert there[element.names.get(name, name)] == pytest.approx(value, abs=1e-8 * size)
    (tangent,) = symmetry.tangents(q)
    assert pair.energy.value(q + shift * tangent) == pytest.approx(
        pair.energy.value(q), rel=1e-12, abs=1e-12
    )
    np.testing.assert_allclose(
        symmetry.invariants(q + shift * tangent), symmetry.invariants(q), atol=1e-9
    )


@pytest.mark.parametrize("mirror", [False, True])
def test_the_symmetry_is_a_group(mirror):
    """Sixteen or thirty-two motions, different and closed under composition, told by images."""
    q = np.array([0.3, 1.1, 0.4, -0.2, 5.0, 2.1])
    group = energy_symmetry(PAIR, mirror=mirror).group
    images = [PAIR.manifold.wrap(g.apply(q)) for g in group]
    assert len({tuple(image.round(9)) for image in images}) == (32 if mirror else 16)
    told = {tuple(PAIR.manifold.wrap(image).round(9) + 0.0) for image in images}
    for g in group:
        for image in images:
            assert tuple(PAIR.manifold.wrap(g.apply(image)).round(9) + 0.0) in told


def test_rolling_is_no_symmetry_of_the_energy():
    with pytest.raises(ValueError, match=r"^symmetry: expected one that leaves the energy unchang"):
        minima(PAIR.polyhedron, PAIR.energy, starts=[PAIR.nested("R")], symmetry=PAIR.symmetry)


@pytest.mark.parametrize("pair", [PAIR, PLANE], ids=["drum", "plane"])
def test_scattered_pairs_do_not_overlap_and_reach_everywhere(pair):
    starts = scattered(pair, np.random.default_rng(0), 400)
    assert starts.shape == (400, 6)
    assert pair.polyhedron.contains(starts).all()
    across = abs(pair.manifold.difference(pair.swap(starts), starts)[:, 0])
    near = pair.length / 2 + 2 * pair.ball_radius
    side = near / (1 if pair.is_plane else pair.centre_radius)
    along = abs(starts[:, 4] - starts[:, 1])
    by_chance = 0.05 if pair.is_plane is False else 0.4
    assert 0.43 < ((across <= side) & (along <= near)).mean() < 0.57 + by_chance
    assert along.max() > near
    assert across.max() > side
    again = scattered(pair, np.random.default_rng(0), 400)
    np.testing.assert_array_equal(starts, again)


def test_placements_are_found_in_the_tightest_drum():
    pair = DumbbellPair(2.0, 1.0, 0.5, 2.0 + 1e-9)
    assert pair.polyhedron.contains(scattered(pair, np.random.default_rng(0), 5)).all()


# ----------------------------------------------------------------------------- the pair's own


@pytest.mark.parametrize("pair", [PAIR, PLANE], ids=["drum", "plane"])
def test_the_pair_rests_in_the_dyads_corners_and_end_to_end_and_nowhere_else(pair):
    right, left, ends = dyad_minima(pair)
    found = pair_minima(pair, starts=400)
    assert kinds(found) == ["G", "delta", "delta"]
    assert not found.elsewhere
    assert [c.energy for c in found] == pytest.approx(
        [entry.certificate.energy for entry in (ends, right, left)], rel=1e-12
    )
    assert {c.stratum.chirality for c in found[1:]} == {"R", "L"}
    symmetry = energy_symmetry(pair)
    for entry in (right, left):
        place = symmetry.invariants(entry.point)
        images = [symmetry.invariants(g.apply(c.point)) for c in found for g in symmetry.group]
        assert min(abs(image - place).max() for image in images) < 1e-7
    assert kinds(pair_minima(pair, starts=400, mirror=True)) == ["G", "delta"]


def test_labelled_pairs_rest_in_eight_loci_end_to_end_and_sixteen_corners():
    starts = scattered(PAIR, np.random.default_rng(1), 700)
    found = minima(PAIR.polyhedron, PAIR.energy, starts=starts)
    assert kinds(found) == ["G"] * 8 + ["delta"] * 16
    names = {c.active for c in found if kind_of(c) == "delta"}
    assert len(names) == 4  # by the balls that touch


def test_end_to_end_is_one_locus_of_any_distance():
    found = pair_minima(PAIR, starts=200)
    ends, points = found[0], found.points[0]
    assert ends.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert ends.signature == (0, 4, 2)
    assert ends.active == ()
    apart = abs(points[:, 4] - points[:, 1])
    assert apart.min() >= PAIR.length + 2 * PAIR.ball_radius - 1e-9
    assert apart.max() > 100


# ------------------------------------------------------------------------- where there are others


def scanned_room(pair):
    """Return the largest least gap of a level crossing, over where on the lower rod it lies."""
    half, rho = pair.length / 2, pair.centre_radius
    lift = 1 - 2 * pair.rod_radius / rho
    width = rho * math.sqrt(max(1 - lift**2, 0.0))
    if width > half or lift < 0:
        return -math.inf
    q = np.zeros((4001, 6))
    q[:, 5] = math.asin(width / half)
    q[:, 4] = np.linspace(0, half, 4001)
    return float(pair.polyhedron.values(q).min(axis=1).max())


@given(st.floats(2, 25), st.floats(0.01, 0.95), st.floats(0.05, 1.9))
@settings(max_examples=100)
def test_a_level_crossing_fits_where_a_scan_finds_room(length, rod, curvature):
    drum = length / curvature
    assume(drum > 1.05 and length < 1.99 * (drum - 1))
    pair = DumbbellPair(length, 1.0, rod, drum)
    room = crossing_clearance(pair)
    assume(abs(room) > 1e-3)
    assert (scanned_room(pair) > -1e-6) == (room > 0)


def test_nothing_crosses_in_the_plane():
    assert crossing_clearance(PLANE) == -math.inf


@pytest.mark.parametrize(
    ("length", "rod", "drum"), [(12, 0.2, 12), (16, 0.1, 16), (24, 0.35, 16), (12, 0.05, 24)]
)
def test_long_thin_dumbbells_also_rest_crossed(length, rod, drum):
    """The upper one's rod is ``2 t`` higher all along, so its two balls together are ``4 t``."""
    pair = DumbbellPair(length, 1.0, rod, drum)
    assert crossing_clearance(pair) > 0.05
    found = pair_minima(pair, starts=300, mirror=True)
    (crossed,) = (c for c in found if kind_of(c) == "crossed")
    assert crossed.energy == pytest.approx(4 + 4 * rod, rel=1e-12)
    assert crossed.active == ("ab",)
    assert crossed.signature == (1, 3, 2)
    low, high = sorted(abs(pair.heading(crossed.point)))
    width = 2 * math.sqrt(rod * (drum - 1 - rod))
    assert (low, math.sin(high) * length / 2) == pytest.approx((0, width), abs=1e-6)


def test_crossing_in_the_middle_and_off_it_are_two_loci_where_balls_are_between():
    """Along the lower rod a level crossing fits near the middle, then not, and then again."""
    pair = DumbbellPair(6, 1.0, 0.02, 6 / 0.128)
    q = np.zeros((3, 6))
    q[:, 4] = 0.0, 0.7, 1.35
    q[:, 5] = math.asin(2 / 3 * math.sqrt(pair.rod_radius * (pair.centre_radius - pair.rod_radius)))
    assert (pair.polyhedron.implicit(q) > -1e-9).tolist() == [True, False, True]
    found = pair_minima(pair, starts=1500, mirror=True)
    crossed = [k for k, c in enumerate(found) if kind_of(c) == "crossed"]
    shifts = sorted(float(abs(np.diff(found.points[k][:, [1, 4]])).max()) for k in crossed)
    assert len(shifts) == 2
    assert shifts[0] < 0.7 < shifts[1]


def test_a_pair_with_no_room_to_cross_level_does_not():
    pair = DumbbellPair(6, 1.0, 0.5, 12)
    assert crossing_clearance(pair) < -0.5
    assert kinds(pair_minima(pair, starts=300, mirror=True)) == ["G", "delta"]


def test_two_balls_hold_a_short_pair_in_a_tight_drum():
    pair = DumbbellPair(2.2, 1.0, 0.5, 2.2)
    assert kinds(pair_minima(pair, starts=400, mirror=True)) == ["200", "G", "staggered"]


@pytest.mark.parametrize("rod", [0.2, 0.5])
def test_what_nests_changes_where_a_ball_begins_to_reach_the_other_rod(rod):
    limit = long_rod_length(1.0, rod)
    for length, kind in ((limit - 0.1, "staggered"), (limit + 0.1, "delta")):
        found = pair_minima(DumbbellPair(length, 1.0, rod, 20), starts=300, mirror=True)
        assert kinds(found) == ["G", kind]
