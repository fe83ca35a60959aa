"""Symmetries of arrangements: motions keep all gaps, invariants tell orbits apart."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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
from tests.support.arrangements import anywhere

SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
WEDGE = polygon([[0, 0], [2, 0], [0, 1]], 0.1)
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
    frame, h = a.manifold.frame(q), 1e-6
    slopes = [
        (a.symmetry.invariants(q + h * way) - a.symmetry.invariants(q - h * way)) / (2 * h)
        for way in frame.T
    ]
    assert np.linalg.matrix_rank(np.array(slopes), tol=1e-4) == a.manifold.dimension - count


@pytest.mark.parametrize("case", CASES)
def test_exchanges_rename_gaps_and_form_a_group(case):
    a, _, count = CASES[case]
    d = a.polyhedron
    elements = a.symmetry.elements
    assert len(elements) + 1 == count
    rng = np.random.default_rng(len(case))
    q = anywhere(a, rng)
    before = dict(zip(d.names, d.values(q), strict=True))
    for element in elements[:: max(1, len(elements) // 12)]:
        image = element.apply(q)
        after = dict(zip(d.names, d.values(image), strict=True))
        for name, value in before.items():
            assert after[element.names.get(name, name)] == pytest.approx(value, abs=1e-9)
        renamed = [element.names.get(name, name) for name in d.names]
        assert sorted(renamed) == sorted(d.names)


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
