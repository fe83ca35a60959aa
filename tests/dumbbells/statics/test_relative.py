"""Relative placements: the same set as the pair's, and all of its places of rest."""

import math

import numpy as np
import pytest
from atlases import kept_atlas
from mpmath import mp

from polycorner import certify, minimise
from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.dumbbells.statics.skeleton import corner_kind
from polycorner.proofs import corners, stationary_points

SIZES = (16.0, 3.0, 1.5)


@pytest.fixture(scope="module", params=[math.inf, 125.0], ids=["plane", "drum"])
def model(request):
    return RelativePlacements(DumbbellPair(*SIZES, request.param))


def placements(model, widest, count=20_000):
    """Return random placements in the box whose distance along the axis is at most ``widest``."""
    sides = np.array([model.box["x"], (-widest, widest), (-4, 4), (-4, 4)])
    return np.random.default_rng(1).uniform(sides[:, 0], sides[:, 1], (count, 4))


def test_gaps_are_those_of_the_pair(model):
    q = placements(model, 24, 2000)
    theirs = model.pair.polyhedron.values(model.placement(q)).T
    ours = dict(zip(model.polyhedron.names, model.polyhedron.values(q).T, strict=True))
    for name, values in zip(model.pair.polyhedron.names, theirs, strict=True):
        if name != "ab":
            assert np.allclose(ours[name], values, atol=1e-11)


def test_energy_is_least_over_rolling_and_grows_with_the_height(model):
    """In the drum it is a function of the least height; in the plane translations are rolling."""
    q = placements(model, 24, 300)
    rolling = np.linspace(-0.4, 0.4, 4001) * (model.pair.ball_radius if model.pair.is_plane else 1)
    placed = model.placement(q)[:, None, :] + rolling[:, None] * np.array([1.0, 0, 0, 1.0, 0, 0])
    least = model.pair.energy.value(placed.reshape(-1, 6)).reshape(len(q), -1).min(axis=1)
    if not model.pair.is_plane:
        rho = model.pair.centre_radius
        deep = (4 * model.pair.drum_radius - least) / 4  # of the centre of mass under the axis
        least = 2 * (rho**2 - deep**2)
    assert np.allclose(model.energy.value(q), least, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("weight", [0.0, 0.7])
@pytest.mark.parametrize("radius", [math.inf, 125.0, 80.0])
def test_heights_are_those_of_the_bodies(radius, weight):
    """Of balls and rods, with the pair rolled to where it hangs lowest, over the lowest line."""
    model = RelativePlacements(DumbbellPair(*SIZES, radius, weight))
    pair, rho = model.pair, model.pair.centre_radius
    for q in placements(model, 24, 40):
        centres = pair.ball_centres(model.placement(q))
        weights = 4 + 2 * weight
        if pair.is_plane:
            lateral = centres[:, 0] - centres[:, 0].mean()
            expected = weights / 8 * (lateral**2).sum()
        else:
            expected = weights * (rho - math.hypot(*centres.mean(axis=0)[[0, 2]]))
        found = model.height(float(model.energy.value(q)))
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-10)
        assert model.energy_at(found) == pytest.approx(model.energy.value(q), rel=1e-9, abs=1e-9)


def test_heights_are_correct_to_the_last_bit():
    model = RelativePlacements(DumbbellPair(*SIZES, 125.0, 0.3))
    rho = model.pair.centre_radius
    with mp.workdps(700):
        weights = 4 + 2 * mp.mpf(0.3)
        for energy in [0.0, 1e-300, 1e-9, 6.348466742, 18.0, 500.0, -1e-3, 2 * rho**2]:
            exact = weights * (rho - mp.sqrt(rho**2 - mp.mpf(energy) / 2))
            assert model.height(energy) == float(exact)
    assert model.height(0.0) == 0.0


@pytest.mark.parametrize(("name", "value"), [("height", 1e6), ("energy_at", 1e6)])
def test_a_centre_of_mass_above_the_axis_is_refused(name, value):
    model = RelativePlacements(DumbbellPair(*SIZES, 125.0))
    with pytest.raises(ValueError, match=r"^(energy|height): expected a number <= "):
        getattr(model, name)(value)


def test_rods_do_not_overlap_where_their_axes_do_not_cross(model):
    """Membership agrees with the pair's, whose rods are kept 2 t apart by their distance."""
    q = placements(model, 18)
    inside = np.asarray(model.polyhedron.contains(q))
    assert np.array_equal(inside, np.asarray(model.pair.polyhedron.contains(model.placement(q))))
    assert 0.1 < inside.mean() < 0.9


def test_parallel_rods_are_decided(model):
    """At the nested corner, where the formula of the distance of the rods changes."""
    pair = model.pair
    q = [-1.5 / (1 if pair.is_plane else pair.centre_radius), 12.0, 0.2, 0.2]
    assert model.polyhedron.contains(q) == pair.polyhedron.contains(model.placement(q))


def test_rods_that_can_lie_across_each_other_are_refused():
    """Crossed in the drum, the middles of rods hang 0.02 mm apart at most."""
    with pytest.raises(ValueError, match="pair: expected rods too thick to lie across"):
        RelativePlacements(DumbbellPair(12.5, 3.0, 0.05, 125.0))
    assert RelativePlacements(DumbbellPair(12.5, 3.0, 0.05)).pair.is_plane


def test_the_nested_corners_and_the_line_are_all_local_minima(model):
    """The paper's claim on local minima, proved for its sizes in the plane and in the drum."""
    found = stationary_points(
        model.polyhedron, model.energy, box=model.box, symmetry=model.symmetry
    )
    assert found.complete
    corners = [("A2B1", "A2b", "aB1"), ("A2B2", "A2b", "aB2"), ("A1B1", "A1b", "aB1")]
    assert {p.active for p in found.minima} == {*corners, ("A1B2", "A1b", "aB2")}
    assert len({p.orbit for p in found.minima}) == 1
    assert len(found.minima) == 16  # two hands, either ball of each may be the first, and exchange
    assert {model.pair.chirality(model.placement(p.point)) for p in found.minima} == {"L", "R"}
    for p in found.minima:
        placed = model.placement(p.point)
        rest = minimise(model.pair.polyhedron, model.pair.energy, placed)
        assert certify(model.pair.polyhedron, model.pair.energy, rest.point).is_minimum
        assert model.pair.manifold.distance(rest.point, placed) < 1e-7
    if model.pair.is_plane:
        heading = model.pair.plane_corner()[0]
        for p in found.minima:
            assert math.isclose(abs(math.remainder(p.point[2], math.pi)), heading, abs_tol=1e-9)
    lines = [place for place in found.loci if place.is_minimum]
    assert len(lines) == 4
    for place in lines:
        for name in ("alpha", "beta"):
            assert abs(math.remainder(place.lower[name], math.pi)) < 1e-6
        assert place.lower["x"] <= 0 <= place.upper["x"]
    assert any(place.sample is not None for place in lines)


def test_all_corners_in_the_plane_are_those_of_the_search():
    """Eight of either kind; at those of four contacts, the fourth by algebra."""
    pair = DumbbellPair(*SIZES)
    model = RelativePlacements(pair)
    found = corners(model.polyhedron, box={**model.box, "alpha": 0.0}, symmetry=model.rotations)
    assert found.complete
    walked = kept_atlas(pair)
    kinds = [corner_kind(p.active, pair.chirality(model.placement(p.point))) for p in found]
    assert sorted(kinds) == sorted(map(walked.kind, walked.skeleton.corners))
    assert {frozenset(p.active) for p in found} == {
        frozenset(corner.active) for corner in walked.skeleton.corners
    }


def test_rotations_are_no_symmetries_in_a_drum():
    with pytest.raises(ValueError, match="pair: expected a pair in the plane"):
        RelativePlacements(DumbbellPair(*SIZES, 125.0)).rotations  # noqa: B018
