"""Relative placements: the same set as the pair's, and all of its places of rest."""

import math

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.proofs import stationary_points

SIZES = (16.0, 3.0, 1.5)


@pytest.fixture(scope="module")
def model():
    return RelativePlacements(*SIZES)


def test_gaps_and_energy_are_those_of_the_pair(model):
    pair, rng = DumbbellPair(*SIZES), np.random.default_rng(1)
    sides = np.array([[-12, 12], [-24, 24], [-4, 4], [-4, 4]])
    q = rng.uniform(sides[:, 0], sides[:, 1], (2000, 4))
    placed = model.placement(q)
    ours = dict(zip(model.polyhedron.names, model.polyhedron.values(q).T, strict=True))
    theirs = dict(zip(pair.polyhedron.names, pair.polyhedron.values(placed).T, strict=True))
    for name in set(theirs) - {"ab"}:
        assert np.allclose(ours[name], theirs[name], atol=1e-12)
    assert np.allclose(model.energy.value(q), pair.energy.value(placed), atol=1e-10)


def test_rods_do_not_overlap_where_their_axes_do_not_cross(model):
    """Membership agrees with the pair's, whose rods are kept 2 t apart by their distance."""
    pair, rng = DumbbellPair(*SIZES), np.random.default_rng(1)
    sides = np.array([[-9, 9], [-18, 18], [-4, 4], [-4, 4]])
    q = rng.uniform(sides[:, 0], sides[:, 1], (20_000, 4))
    inside = np.asarray(model.polyhedron.contains(q))
    assert np.array_equal(inside, np.asarray(pair.polyhedron.contains(model.placement(q))))
    assert 0.1 < inside.mean() < 0.9


def test_parallel_rods_are_decided(model):
    """At the nested corner, where the formula of the distance of the rods changes."""
    assert model.polyhedron.contains([-1.5, 12.0, 0.2, 0.2]) == DumbbellPair(
        *SIZES
    ).polyhedron.contains(model.placement([-1.5, 12.0, 0.2, 0.2]))


@pytest.mark.slow
def test_the_nested_corners_and_the_line_are_all_local_minima(model):
    """The paper's claim on local minima in the plane, proved for its sizes."""
    found = stationary_points(
        model.polyhedron, model.energy, box=model.box, symmetry=model.symmetry
    )
    assert found.complete
    corners = [("A2B1", "A2b", "aB1"), ("A2B2", "A2b", "aB2"), ("A1B1", "A1b", "aB1")]
    assert {p.active for p in found.minima} == {*corners, ("A1B2", "A1b", "aB2")}
    assert len({p.orbit for p in found.minima}) == 1
    heading, along, across = DumbbellPair(*SIZES).plane_corner()
    for p in found.minima:
        assert math.isclose(abs(math.remainder(p.point[2], math.pi)), heading, abs_tol=1e-9)
        apart = math.hypot(2 * p.point[0], p.point[1])
        assert math.isclose(apart, math.hypot(along, across), abs_tol=1e-8)
    lines = [place for place in found.loci if place.is_minimum]
    for place in lines:
        for name in ("alpha", "beta"):
            assert abs(math.remainder(place.lower[name], math.pi)) < 1e-6
        assert place.lower["x"] <= 0 <= place.upper["x"]
    assert any(place.sample is not None for place in lines)
