"""Minima between two energies, at corners with more contacts than balls can show to close."""

from itertools import product

import numpy as np
import pytest
import sympy as sp
from packed_circles import circles, torus

from benchmarks.trials.rational_corners import MINIMA, OTHERS, corners
from benchmarks.trials.run_corners import judged
from polycorner import Manifold, Polyhedron, certify
from polycorner.proofs import prove

# The best packings of seven circles in the unit square: centres of six, and a circle that rattles.
SEVEN = [
    (0.523372890561, 0.174457630187), (0.174457630187, 0.174457630187),
    (0.348915260374, 0.825542369813), (0.523372890561, 0.523372890561),
    (0.174457630187, 0.523372890561), (0.7960, 0.7960), (0.825542369813, 0.348915260374),
]  # fmt: skip


def energies(proof):
    return [sp.Rational(x) for x in proof.enclosures["energy"]]


def test_four_circles_are_a_strict_minimum_by_exact_algebra():
    places = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
    proof = prove(certify(*circles(places)))
    assert proof.proved
    assert proof.statement == "strict local minimum"
    assert energies(proof) == [-sp.Rational(1, 4)] * 2
    assert len(proof.active) == 12


FIVE = [(-1, -1), (1, -1), (-1, 1), (1, 1), (0, 0)]  # of the square of centres


@pytest.mark.parametrize("side", [sp.Integer(1), sp.sin(1)])
def test_five_circles_are_a_minimum_and_strict_where_algebra_knows_the_side(side):
    r = side * (sp.sqrt(2) - 1) / 2
    places = [[float(side / 2 + k * (side / 2 - r)) for k in place] for place in FIVE]
    proof = prove(certify(*circles(places, side)))
    assert proof.proved
    strict = proof.statement == "strict local minimum"
    assert strict == (side == 1)
    assert strict or proof.statement.startswith("a local minimum in the enclosed box")
    low, high = energies(proof)
    assert low <= -r <= high
    assert high - low < sp.Rational(1, 10**29)


def test_a_circle_that_rattles_has_room():
    polyhedron, energy, q = circles(SEVEN)
    proof = prove(certify(polyhedron, energy, q))
    assert proof.proved
    assert proof.statement == "strict local minimum, modulo d/dx5; d/dy5"
    assert list(proof.room) == ["x5", "y5"]
    rng = np.random.default_rng(0)
    reads = [i for i, name in enumerate(polyhedron.names) if "5" in name]
    for _ in range(200):
        place = {name: rng.uniform(*map(float, sides)) for name, sides in proof.room.items()}
        moved = [place.get(name, x) for name, x in zip(polyhedron.manifold.names, q, strict=True)]
        assert polyhedron.values(moved)[reads].min() > 0


def test_the_room_is_nearly_as_large_as_it_can_be():
    D, E, q = circles(SEVEN)
    proof = prove(certify(D, E, q))
    (low, high), names = zip(*map(proof.room.get, ("x5", "y5")), strict=True), [*proof.room]
    assert names == ["x5", "y5"]
    r, others = sp.Rational(proof.enclosures["r"][1]), [k for k in range(7) if k != 5]
    walls, middles = sp.Interval(r, 1 - r), [[sp.Rational(x) for x in SEVEN[k]] for k in others]

    def fits(more):
        ends = [
            (sp.Rational(a) - more * (sp.Rational(b) - sp.Rational(a)),
             sp.Rational(b) + more * (sp.Rational(b) - sp.Rational(a)))
            for a, b in zip(low, high, strict=True)
        ]  # fmt: skip
        apart = (
            (x - a) ** 2 + (y - b) ** 2 > 4 * r**2 for x, y in product(*ends) for a, b in middles
        )
        return all(apart) and all(x in walls for end in ends for x in end)

    assert fits(0)
    assert not fits(sp.Rational(1, 8))


def test_a_coordinate_that_nothing_reads_at_a_strict_minimum_has_room():
    M = Manifold.euclidean("x z")
    x, z = M.symbols
    D = Polyhedron(M, {"floor": x, "low": z + x - 1, "high": 3 - z - x**2})
    proof = prove(certify(D, x, [0.0, 1.7]))
    assert proof.proved
    assert proof.symmetry == ("d/dz",)
    low, high = map(sp.Rational, proof.room["z"])
    assert 1 < low < sp.Rational(11, 10)
    assert sp.Rational(29, 10) < high < 3


def test_translations_of_a_torus_are_factored_out():
    # Two circles in a square torus: the best touch at a diagonal, all four images of one.
    proof = prove(certify(*torus()))
    assert proof.proved
    assert len(proof.symmetry) == 2
    low, high = energies(proof)
    assert low <= -1 / (2 * sp.sqrt(2)) <= high


def test_equations_hold_at_the_inner_point():
    # On a sphere, about the point (1, 1, 1) / sqrt(3), in a corner with one contact too many.
    manifold = Manifold.euclidean("x y z")
    x, y, z = manifold.symbols
    some = {"a": x - y, "b": y - z, "both": x - z}
    polyhedron = Polyhedron(manifold, some, {"sphere": x**2 + y**2 + z**2 - 1})
    proof = prove(certify(polyhedron, 3 * x - y - 2 * z, [3**-0.5] * 3))
    assert proof.proved
    low, high = energies(proof)
    assert low <= 0 <= high


@pytest.mark.parametrize("kind", MINIMA)
def test_minima_are_proved(kind):
    found = [judged(c) for c in corners(np.random.default_rng(3), 20) if c.kind == kind]
    assert found == ["proved"] * 2


@pytest.mark.parametrize("kind", OTHERS)
def test_no_other_point_is(kind):
    found = [judged(c) for c in corners(np.random.default_rng(4), 20) if c.kind == kind]
    assert found == ["open"] * 2


def test_bounds_are_of_the_digits_that_are_asked_for():
    r = (2**0.5 - 1) / 2
    places = [(r, r), (1 - r, r), (r, 1 - r), (1 - r, 1 - r), (0.5, 0.5)]
    certificate = certify(*circles(places))
    narrow, wide = (energies(prove(certificate, digits=d)) for d in (60, 10))
    assert narrow[1] - narrow[0] < sp.Rational(1, 10**58)
    assert wide[0] <= narrow[0] <= narrow[1] <= wide[1]
