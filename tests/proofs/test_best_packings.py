"""Best known packings are proved: from their tables, with what rattles."""

import sys
from fractions import Fraction
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from polycorner import certify, exact_point, prove
from polycorner.models import CirclesIn, read_coordinates

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
from run_records import SQUARE  # noqa: E402

DATA = ROOT / "examples" / "data"
RATTLERS = {7: 1, 11: 2, 13: 1, 14: 1, 17: 1, 19: 2}


def blocks(name):
    """Return the centres of a table by its first column."""
    rows = read_coordinates(DATA / name, index=False).floats
    return {int(k): rows[rows[:, 0] == k][:, 2:] for k in np.unique(rows[:, 0])}


@pytest.mark.parametrize("n", range(2, 31))
def test_equal_circles_in_the_square(n):
    model = CirclesIn("square", n)
    q = model.point(blocks("circles_in_square.csv")[n])
    proof = prove(certify(model.polyhedron, model.energy, q))
    assert proof.proved
    low, high = (-Fraction(x) for x in reversed(proof.enclosures["energy"]))
    published = Fraction(SQUARE.split()[n - 2])
    assert abs(low - published) <= Fraction(1, 10**12)
    assert high - low < Fraction(1, 10**28)
    loose = {name[1:] for name in proof.room}
    assert len(loose) == RATTLERS.get(n, len(loose))
    _check_rooms(model, q, proof, {int(k) - 1 for k in loose}, high)


def _check_rooms(model, q, proof, loose, radius):
    """Check that what rattles, anywhere in its room, is apart from all others and the walls."""
    centres, names = model.centres(q), model.manifold.names
    fixed = [centres[k] for k in range(model.count) if k not in loose]
    corners = {}
    for k in loose:
        assert {names[2 * k], names[2 * k + 1]} <= proof.room.keys()
        (a, b), (c, d) = (map(float, proof.room[name]) for name in names[2 * k : 2 * k + 2])
        corners[k] = [(x, y) for x in (a, b) for y in (c, d)]
        r = float(radius)
        assert min(min(x, y, 1 - x, 1 - y) for x, y in corners[k]) > r
        # The distance to a point is convex: its least value on a box is at the clipped point.
        for p in fixed:
            near = np.clip(p, (a, c), (b, d))
            assert np.hypot(*(near - p)) > 2 * r
    for k, other in combinations(loose, 2):
        boxes = [np.array(corners[i]) for i in (k, other)]
        gap = np.maximum(0, np.maximum(boxes[0].min(0) - boxes[1].max(0),
                                       boxes[1].min(0) - boxes[0].max(0)))  # fmt: skip
        assert np.hypot(*gap) > 2 * r


@pytest.mark.parametrize("contacts", [14, 15, 12])
def test_seven_circles_on_the_torus_have_three_optima(contacts):
    model = CirclesIn("torus", 7)
    q = model.point(blocks("seven_circles_on_torus.csv")[contacts])
    assert int((abs(model.polyhedron.values(q)) < 1e-8).sum()) == contacts
    proof = prove(certify(model.polyhedron, model.energy, q), symmetry=model.symmetry)
    assert proof.proved
    low, high = map(sp.Rational, proof.enclosures["energy"])
    assert low <= -(sp.sqrt(3) - 1) / 4 <= high
    assert len(proof.room) == (2 if contacts == 12 else 0)


def test_a_radius_too_large_is_refused_with_the_pairs_that_overlap():
    table = read_coordinates(DATA / "26_circles.csv")
    model = CirclesIn("square", 26, equal=False)
    point = [x for row in table.rows for x in row[:2]] + [row[2] for row in table.rows]
    touching = {}
    for k in (0, 11, 25):
        point[52 + k] += Fraction(9, 10**10)
        found = exact_point(model.polyhedron, point, model.energy)
        assert found.inside is False
        # From the definition: squared distances and sums of radii as fractions.
        for i, j in combinations(range(26), 2):
            d2 = sum((point[2 * i + c] - point[2 * j + c]) ** 2 for c in (0, 1))
            touching[f"{i + 1}-{j + 1}"] = d2 - (point[52 + i] + point[52 + j]) ** 2
        overlap = {name for name, gap in touching.items() if gap < 0}
        named = {v.name for v in found.violations}
        assert {name for name in named if "-" in name and name.split("-")[1].isdigit()} == overlap
        assert all(str(k + 1) in v.name.split("-") for v in found.violations[:3])
        claimed, repaired = Fraction(found.energy_given[1]), Fraction(found.energy[1])
        assert repaired > claimed
        point[52 + k] -= Fraction(9, 10**10)
