"""Corners with more contacts than dimensions: what fails on a choice of them is not refuted."""

import itertools
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, certify, prove
from polycorner.proofs.hypotheses import Status

numbers = st.integers(-3, 3)


def failed(proof):
    return [name for name, found in proof.conditions.items() if found is Status.FAILED]


def in_a_square(centres):
    """Return equal circles in the unit square, the energy minus their radius, and the placement."""
    count = len(centres)
    manifold = Manifold.euclidean([f"{c}{i}" for i in range(count) for c in "xy"] + ["r"])
    *places, r = manifold.symbols
    pairs = list(zip(places[::2], places[1::2], strict=True))
    walls = [g for x in places for g in (x - r, 1 - r - x)]
    two = itertools.combinations
    apart = [(a - c) ** 2 + (b - d) ** 2 - 4 * r**2 for (a, b), (c, d) in two(pairs, 2)]
    rooms = [min(x, 1 - x) for x in np.ravel(centres)]
    rooms += [math.dist(p, q) / 2 for p, q in two(centres, 2)]
    point = np.append(np.ravel(centres), min(rooms))
    return Polyhedron(manifold, [*walls, *apart]), -r, point


def test_best_known_circles_in_a_square_are_not_refuted():
    """Four in a grid and five with one in the middle are strict minima."""
    r = 1 / (2 + 2 * math.sqrt(2))
    ends = (r, 1 - r)
    grid = list(itertools.product((0.25, 0.75), repeat=2))
    five = [*itertools.product(ends, repeat=2), (0.5, 0.5)]
    for centres in (grid, five):
        d, energy, point = in_a_square(centres)
        assert not failed(prove(certify(d, energy, point)))


@given(st.data(), st.integers(2, 3))
def test_strict_minima_at_corners_of_many_planes_are_not_refuted(data, n):
    """The slope is inside the cone of the planes' normals, which span: strict to first order."""
    manifold = Manifold.euclidean([f"x{i}" for i in range(n)])
    x = manifold.symbols
    normals = [
        data.draw(st.lists(numbers, min_size=n, max_size=n).filter(any)) for _ in range(n + 2)
    ]
    slope = [sum(column) for column in zip(*normals, strict=True)]
    planes = [sum(a * t for a, t in zip(row, x, strict=True)) for row in normals]
    energy = sum(a * t for a, t in zip(slope, x, strict=True))
    bowl = sum(t**2 for t in x)
    d = Polyhedron(manifold, [plane - bowl / 7 for plane in planes])
    proof = prove(certify(d, energy - bowl, np.full(n, 1e-10)))
    assert not failed(proof)


def test_a_saddle_among_all_its_contacts_is_refuted():
    """Without a choice a negative multiplier or curvature is a theorem."""
    manifold = Manifold.euclidean("x y")
    x, y = manifold.symbols
    corner = Polyhedron(manifold, [x, y])
    assert failed(prove(certify(corner, x - y, np.zeros(2))))
    assert failed(prove(certify(corner, x - (y - 1) ** 2, np.array([0.0, 1.0]))))
