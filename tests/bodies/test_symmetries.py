"""Symmetries of arrangements: motions keep gaps, invariants tell orbits apart, boxes and mirrors.

The oracle of full symmetries knows no walls, frames or names: an isometry that is written out
carries the bodies of a placement, and it is looked up which element gives the same bodies.
"""

import math
from itertools import combinations, permutations, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import minima, minimise, prove, skeleton
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    box,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    sphere,
)
from tests.support.arrangements import anywhere, assert_renamed, rank_of_invariants

SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
WEDGE = polygon([[0, 0], [2, 0], [0, 1]], 0.1)  # has no mirror image among its rotations
ROD = capsule([-1, 0, 0], [1, 0, 0], 0.3)
CUBE = polytope(np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T)
TETRAHEDRON = polytope([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
PEAR = compound([sphere(0.5), sphere(0.3, at=[0, 0, 1])])
BENT = compound([sphere(0.5), sphere(0.5, at=[1, 0, 0]), sphere(0.5, at=[0, 1, 0])])
FLOOR = HalfSpace([0, 0, 1], [0, 0, -5])
PIPE = Cylinder(5.0, axis=[1, 2, 2], point=[0.5, 0, 0])
BALL = Cylinder(5.0, point=[0.5, 0, 0])

# Arrangement, dimension of the motions, number of exchanges and rotations with the identity.
CASES = {
    "squares": (Arrangement([SQUARE, SQUARE]), 3, 4 * 4 * 2),
    "squares in a box": (Arrangement([SQUARE, SQUARE], box([-3, -3], [3, 3])), 0, 32),
    "wedges and discs": (Arrangement([WEDGE, WEDGE, disc(1), disc(1), disc(2)]), 3, 4),
    "on a line": (Arrangement([SQUARE, WEDGE], {"floor": HalfSpace([1, 2], [0, 0])}), 1, 4),
    "in a circle": (Arrangement([disc(1), disc(1)], {"ring": Cylinder(5, point=[1, 0])}), 1, 2),
    "around a disc": (Arrangement([SQUARE], fixed={"peg": disc(1, at=[3, 1])}), 1, 4),
    "around a square": (Arrangement([SQUARE], fixed={"peg": SQUARE}), 0, 4),
    "spinning disc": (Arrangement([disc(1), SQUARE], orientations="all"), 4, 4),
    "shifted squares": (Arrangement([SQUARE, SQUARE], orientations="none"), 2, 2),
    "shifted discs": (Arrangement([disc(1), disc(1)], orientations="none"), 3, 2),
    "shifted cubes": (Arrangement([CUBE, CUBE, sphere(1)], orientations="none"), 3, 2),
    "balls": (Arrangement([sphere(1)] * 4), 6, 24),
    "rods": (Arrangement([ROD, ROD]), 6, 8),
    "pears": (Arrangement([PEAR, PEAR, sphere(1)]), 6, 2),
    "spinning rod": (Arrangement([ROD, CUBE], orientations="all"), 7, 48),
    "spinning ball": (Arrangement([sphere(1), CUBE], orientations="all"), 9, 24),
    "tetrahedra": (Arrangement([TETRAHEDRON, TETRAHEDRON]), 6, 12 * 12 * 2),
    "bent": (Arrangement([BENT, BENT]), 6, 2 * 2 * 2),
    "rods on a floor": (Arrangement([ROD, ROD], {"floor": FLOOR}), 3, 8),
    "rods in a pipe": (Arrangement([ROD, BENT], {"pipe": PIPE}), 2, 4),
    "rods in a ball": (Arrangement([ROD, BENT], {"shell": BALL}), 3, 4),
    "pipe and floor": (Arrangement([ROD, ROD], {"pipe": PIPE, "floor": FLOOR}), 0, 8),
    "around a ball": (Arrangement([BENT], fixed={"B": sphere(1, at=[1, 2, 3])}), 3, 2),
    "around a rod": (Arrangement([BENT], fixed={"B": ROD}), 1, 2),
}


@pytest.mark.parametrize("case", CASES)
def test_motions_keep_gaps_and_invariants(case):
    a, count, _ = CASES[case]
    rng = np.random.default_rng(len(case))
    for _ in range(3):
        q = anywhere(a, rng)
        tangents = a.symmetry.directions(a.manifold, q) * a.manifold.scale_array
        assert len(tangents) == count
        if not count:
            continue
        assert np.linalg.matrix_rank(tangents) == count
        step = rng.standard_normal(count) @ tangents
        assert np.abs(a.polyhedron.gradients(q) @ step).max() < 1e-9
        h = 1e-5
        moved = [a.symmetry.invariants(a.manifold.canonical(q + s * h * step)) for s in (1, -1)]
        np.testing.assert_allclose(moved[0], moved[1], atol=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_invariants_change_along_everything_else(case):
    a, count, _ = CASES[case]
    if not count:
        assert a.symmetry.invariants is None
        return
    q = anywhere(a, np.random.default_rng(len(case)))
    assert rank_of_invariants(a, q) == a.manifold.dimension - count


@pytest.mark.parametrize("case", CASES)
def test_exchanges_rename_gaps_and_form_a_group(case):
    a, _, count = CASES[case]
    assert len(a.symmetry.elements) + 1 == count
    assert_renamed(a, a.symmetry.elements, anywhere(a, np.random.default_rng(len(case))))


def test_mirror_images_are_different_orbits():
    """Four balls: the mirror image has the same distances."""
    a = Arrangement([sphere(0.5), sphere(0.6), sphere(0.7), sphere(0.8)])
    q = np.array([0, 0, 0, 2, 0, 0, 0, 2, 0, 0.3, 0.4, 2], dtype=float)
    mirrored = q * np.tile([1, 1, -1], 4)
    turned = Rotation.from_rotvec([1, 2, 3]).apply(q.reshape(4, 3)).ravel()
    assert a.symmetry.separation(a.manifold, q, turned) < 1e-12
    assert a.symmetry.separation(a.manifold, q, mirrored) > 0.1


def test_too_many_exchanges_are_left_out():
    a = Arrangement([disc(1)] * 8)
    assert math.factorial(8) > 10_000
    assert len(a.symmetry.elements) == 0
    assert a.symmetry.directions(a.manifold, np.arange(16.0)).shape == (3, 16)


# ---------------------------------------------------------------------------------- full symmetries

KITE = polygon([[-1, 0], [0, -1], [2, 0], [0, 1]])
SCREW = compound([sphere(0.5, at=p) for p in ([0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1])])
CHANNEL = {"floor": HalfSpace([0, 1], [0, 0]), "roof": HalfSpace([0, -1], [0, 3])}
RING = Cylinder(5, point=[1, 0])

# Arrangement and the order of its full finite group: isometries x exchanges x congruences.
FULL_CASES = {
    "discs in a square": (Arrangement([disc(1)] * 2, box([0, 0], [6, 6])), 8 * 2),
    "discs in a rectangle": (Arrangement([disc(1)] * 2, box([0, 0], [6, 7])), 4 * 2),
    "squares in a square": (Arrangement([SQUARE] * 2, box([-3, -3], [3, 3])), 8 * 2 * 16),
    "wedge in a square": (Arrangement([WEDGE], box([-3, -3], [3, 3])), 4),
    "kite and wedge": (Arrangement([KITE, WEDGE], box([-3, -3], [3, 3])), 4),
    "kites in a rectangle": (Arrangement([KITE] * 2, box([-3, -3], [3, 4])), 4 * 2),
    "shifted wedge": (Arrangement([WEDGE], box([-3, -3], [3, 3]), orientations="none"), 1),
    "shifted squares": (Arrangement([SQUARE], box([0, 0], [6, 6]), orientations="none"), 8),
    "free squares": (Arrangement([SQUARE] * 2), 2 * 2 * 16),
    "free wedges": (Arrangement([WEDGE] * 2), 2),
    "in a ring": (Arrangement([disc(1), KITE], {"ring": RING}), 2),
    "on a floor": (Arrangement([KITE], {"floor": HalfSpace([0, 1], [0, 0])}), 2),
    "around a square": (Arrangement([disc(1)], fixed={"peg": SQUARE}), 8),
    "around a wedge": (Arrangement([disc(1)], fixed={"peg": WEDGE}), 1),
    "periodic square": (Arrangement([disc(0.4)] * 2, period=[4, 4]), 8 * 2),
    "periodic rectangle": (Arrangement([disc(0.4)] * 2, period=[4, 5]), 4 * 2),
    "channel": (Arrangement([disc(0.4)] * 2, CHANNEL, period=[4, None]), 4 * 2),
    "rods in a cube": (Arrangement([ROD], box([0, 0, 0], [6, 6, 6])), 48 * 2),
    "rods in a brick": (Arrangement([ROD] * 2, box([0, 0, 0], [6, 6, 7])), 16 * 2 * 4),
    "bent in a pipe": (Arrangement([BENT], {"pipe": Cylinder(5, axis=[0, 0, 1])}), 4 * 2),
    "screw in a pipe": (Arrangement([SCREW], {"pipe": Cylinder(5, axis=[0, 0, 1])}), 2 * 2),
    "screw and ball": (Arrangement([SCREW, sphere(1)]), 2),
    "cube and ball": (Arrangement([CUBE, sphere(1)]), 24 * 2),
    "spinning rod": (Arrangement([ROD, sphere(1)], orientations="all"), 2 * 2),
}
IN_A_BOX = ["discs in a square", "discs in a rectangle", "squares in a square", "rods in a cube"]


@pytest.mark.parametrize("case", FULL_CASES)
def test_elements_rename_gaps_and_are_as_many_as_isometries_allow(case):
    a, count = FULL_CASES[case]
    assert len(a.full_symmetry.elements) + 1 == count
    assert_renamed(a, a.full_symmetry.elements, anywhere(a, np.random.default_rng(len(case))))


@pytest.mark.parametrize("case", FULL_CASES)
def test_symmetry_is_contained_in_the_full_one(case):
    a, _ = FULL_CASES[case]
    assert len(a.symmetry.elements) <= len(a.full_symmetry.elements)
    assert len(a.symmetry.fields) == len(a.full_symmetry.fields)


def figure(bodies):
    """Return the parts of all bodies as a set of rounded points and radii."""
    return {
        (round(part.radius, 6), frozenset(tuple(p) for p in part.points.round(6).tolist()))
        for body in bodies.values()
        for part in body.parts.values()
    }


@pytest.mark.parametrize("case", IN_A_BOX)
def test_elements_are_the_isometries_of_the_box(case):
    """Every symmetry of the box, written out, is an element, and every element is one."""
    a, _ = FULL_CASES[case]
    d, q = a.dimension, anywhere(a, np.random.default_rng(3))
    low, high = a.walls["left"].point, a.walls["right"].point
    middle, sizes = (low + high) / 2, high - low
    wanted = set()
    for order, signs in product(permutations(range(d)), product((1, -1), repeat=d)):
        if np.array_equal(sizes[list(order)], sizes):
            matrix = np.diag(signs) @ np.eye(d)[list(order)]
            moved = {n: b.carried(middle - matrix @ middle, matrix) for n, b in a.placed(q).items()}
            wanted.add(frozenset(figure(moved)))
    images = [q, *(element.apply(q) for element in a.full_symmetry.elements)]
    assert {frozenset(figure(a.placed(image))) for image in images} == wanted


@pytest.mark.parametrize(("size", "edges"), [([4, 4], 1), ([4, 5], 2)])
def test_a_disc_in_a_box_has_one_corner_modulo_the_box(size, edges):
    a = Arrangement([disc(1)], box([0, 0], size))
    start = a.point({"1": [1.5, 1.7]})
    plain = skeleton(a.polyhedron, [start], symmetry=a.symmetry)
    full = skeleton(a.polyhedron, [start], symmetry=a.full_symmetry)
    assert (len(plain.corners), len(plain.edges)) == (4, 4)
    assert (len(full.corners), len(full.edges)) == (1, edges)


def test_minima_are_counted_modulo_the_box():
    """Away from the middle of a square a disc has four places, all of a kind."""
    a = Arrangement([disc(1)], box([0, 0], [4, 4]))
    x, y = a.manifold.symbols
    away = -((x - 2) ** 2) - (y - 2) ** 2
    starts = [[x, y] for x in (1.4, 2.7) for y in (1.2, 2.9)]
    counts = [
        len(minima(a.polyhedron, away, starts=starts, symmetry=group))
        for group in (a.symmetry, a.full_symmetry)
    ]
    assert counts == [4, 1]


@pytest.mark.parametrize(("body", "count"), [(disc(0.5), 2), (sphere(0.5), 3)])
def test_a_proof_modulo_the_full_group_is_that_modulo_motions(body, count):
    """Equal bodies as near to each other as they can be: a minimum up to motions alone."""
    a = Arrangement([body] * count)
    d = a.dimension
    places = np.array(a.manifold.symbols).reshape(count, d)
    pairs = combinations(places, 2)
    energy = sum(x**2 for p, q in pairs for x in p - q)
    start = np.array([[0, 0, 0], [1.5, 0.1, 0.3], [0.2, 1.4, -0.3]])[:count, :d]
    found = minimise(a.polyhedron, energy, start.ravel())
    motions, full = (prove(found, symmetry=group) for group in (a.symmetry, a.full_symmetry))
    assert full.proved
    assert len(full.symmetry) == d * (d + 1) / 2
    assert (full.symmetry, full.enclosures) == (motions.symmetry, motions.enclosures)
    assert not prove(found).proved  # translations alone are found without being declared


def test_two_discs_lie_in_a_corner_of_a_square_in_one_way():
    """Descents that end in mirror images end in one orbit; others do not."""
    a = Arrangement([disc(1)] * 2, box([0, 0], [3.6, 3.6]))
    y = a.manifold.symbols[1] + a.manifold.symbols[3]
    left, right = (
        minimise(a.polyhedron, y, a.point({"1": [x, 1.1], "2": [3.6 - x, 2.5]})).point
        for x in (1.1, 2.5)
    )
    assert not a.symmetry.relabellings(a.manifold, left, right, 1e-6)
    assert a.full_symmetry.relabellings(a.manifold, left, right, 1e-6)
    upside_down = np.array([left[0], 3.6 - left[1], left[2], 3.6 - left[3]])
    assert a.full_symmetry.relabellings(a.manifold, left, upside_down, 1e-6)
    assert not a.full_symmetry.relabellings(a.manifold, left, left + 0.1, 1e-6)


def test_mirror_images_of_balls_are_one_orbit_and_those_of_a_screw_are_not():
    q = np.array([0, 0, 0, 2, 0, 0, 0, 2, 0, 0.3, 0.4, 2], dtype=float)
    balls = Arrangement([sphere(r) for r in (0.5, 0.6, 0.7, 0.8)])
    mirrored = q * np.tile([1, 1, -1], 4)
    assert balls.full_symmetry.relabellings(balls.manifold, q, mirrored, 1e-9)
    screw = Arrangement([SCREW, sphere(0.4)])
    here, there = (screw.point({"1": [0, 0, 0], "2": [x, 2.0, -0.3]}) for x in (0.2, 0.7))
    assert not screw.full_symmetry.relabellings(screw.manifold, here, there, 1e-9)
