"""All critical configurations of two, three and four equal discs on flat tori, each counted twice.

The energy is ``-r``.  Squares of distances are polynomials of the relative positions of the discs.
"""

import math
from itertools import combinations, permutations, product

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron
from polycorner.models.disks.disks import TorusDisks
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import stationary_points

HALF = sp.Rational(1, 2)
WHOLE = ((-1, 0, 1), (-1, 0, 1))
LARGEST = (math.sqrt(6) - math.sqrt(2)) / 4  # of three and of four discs

# ------------------------------------------------------------------------------------- two discs


def two_discs(lattice, images=WHOLE, walls=False):
    """The second disc's centre and the radius; the first one is at the origin.

    A stressed component goes around the torus, through at most two contacts, so that the radius is
    at least 1/4.
    """
    M = Manifold.euclidean("u v r")
    u, v, r = M.symbols
    c = {"square": sp.Integer(0), "hexagonal": HALF}[lattice]
    gaps = {"u wall": HALF - u, "v wall": HALF - v} if walls else {}
    for p, q in product(*images):
        a, b = u + p, v + q
        gaps[f"1-2({p},{q})"] = sp.expand(a * a + 2 * c * a * b + b * b - 4 * r * r)
    return Polyhedron(M, gaps), -r, [(-0.26, 0.74), (-0.26, 0.74), (0.2, 0.6)]


def check_two(found, lattice, count):
    """The search from random starts finds the kinds; their copies on the torus add up to -1.

    This is the Euler characteristic of the torus without a point.
    """
    assert found.complete
    assert len(found) == count
    kinds = {(round(c.radius, 6), c.index) for c in TorusDisks(2, lattice).critical(0)}
    assert {(round(float(p.point[2]), 6), p.index) for p in found} == kinds
    assert sum((-1) ** p.index for p in found) == -1


def test_two_discs_on_the_hexagonal_torus():
    d, energy, box = two_discs("hexagonal")
    check_two(stationary_points(d, energy, box=box), "hexagonal", 5)


def test_two_discs_on_the_square_torus():
    """In a chamber of the reflections ``u -> 1 - u`` and ``v -> 1 - v``.

    At a point of the chamber the directions into the set are the images of those into its part of
    the chamber, under the reflections that fix the point.  So stationary points are the same with
    the walls and without.  In the chamber no image of the second disc is nearer than the first.
    """
    d, energy, box = two_discs("square", images=((0,), (0,)), walls=True)
    found = stationary_points(d, energy, box=box)
    check_two(found, "square", 3)
    np.testing.assert_allclose(found.minima[0].point, [0.5, 0.5, math.sqrt(0.125)], atol=1e-9)


def test_four_contacts_of_two_discs_are_not_decided_without_the_walls():
    """Two opposite contacts hold the disc; of any three, one carries no force."""
    d, energy, box = two_discs("square")
    found = stationary_points(d, energy, box=box, max_boxes=50_000)
    assert not found.complete
    assert sorted(p.index for p in found) == [1, 1]
    assert np.abs(found.undecided - [0.5, 0.5, math.sqrt(0.125)]).max() < 1e-5


# ------------------------------------------------------- three and four discs on the square torus


def several_discs(count, radii):
    """The other centres, seen from the point farthest from the first one, and the radius.

    The box is the whole torus for each of them.
    """
    M = Manifold.euclidean([f"{c}{i}" for i in range(2, count + 1) for c in "uv"] + ["r"])
    *centres, r = M.symbols
    places = dict(enumerate(zip(centres[::2], centres[1::2], strict=True), start=2))
    gaps = {}
    for i, (u, v) in places.items():
        for p, q in product((-1, 0), repeat=2):
            gaps[f"1-{i}({p},{q})"] = (u + HALF + p) ** 2 + (v + HALF + q) ** 2 - 4 * r**2
    for (i, (a, b)), (j, (u, v)) in combinations(places.items(), 2):
        for p, q in product(*WHOLE):
            gaps[f"{i}-{j}({p},{q})"] = (u - a + p) ** 2 + (v - b + q) ** 2 - 4 * r**2
    d = Polyhedron(M, {name: sp.expand(gap) for name, gap in gaps.items()})
    return d, -r, [(-0.5, 0.5)] * len(centres) + [radii]


def symmetries(count):
    """The symmetries of the square, and relabellings of all discs but the first."""

    def element(labels, axes, signs):
        order = [*(2 * i + axis for i in labels for axis in axes), 2 * len(labels)]
        factors = np.array([*signs * len(labels), 1])
        return Element(lambda q: factors * np.asarray(q)[order], {})

    every = product(
        permutations(range(count - 1)), permutations(range(2)), product((1, -1), repeat=2)
    )
    next(every)  # the identity
    return Symmetry(elements=[element(*e) for e in every])


def copies(model, configuration):
    """Return a configuration and its images, also those with other labels: ``(k, 2 n - 1)``."""
    centres = np.reshape(configuration.point[:-1], (-1, 2))
    rows = []
    for labels, g in product(permutations(range(model.count)), model.point_group):
        moved = (centres @ g.T)[list(labels)]
        away = moved[1:] - moved[0] - 0.5
        rows.append([*(away - np.round(away)).ravel(), configuration.radius])
    return np.unique(np.round(rows, 9) + 0.0, axis=0)


@pytest.mark.parametrize("least", [0.2505, pytest.param(0.2501, marks=pytest.mark.slow)])
def test_three_discs_on_the_square_torus(least):
    """All critical configurations with a larger radius.

    At 1/4 two discs close a line around the torus, beside which the third one is free.
    """
    d, energy, box = several_discs(3, (least, 0.6))
    found = stationary_points(d, energy, box=box, symmetry=symmetries(3), max_boxes=4_000_000)
    assert found.complete
    model = TorusDisks(3)
    kinds = [c for c in model.critical(0) if c.radius > least]
    assert [(c.index, c.nullity) for c in kinds] == [(0, 0), (1, 0)]
    for kind in kinds:
        listed = np.array([p.point for p in found if p.index == kind.index])
        expected = copies(model, kind)
        assert len(listed) == len(expected) == 24
        apart = np.abs(listed[:, None] - expected).max(axis=-1)
        assert (apart.min(axis=0) < 1e-7).all()
        assert (apart.min(axis=1) < 1e-7).all()
    # four discs are no larger than any three of them, and there are four of this size
    a = (math.sqrt(3) - 1) / 4
    b = 0.5 - a
    assert max(p.point[-1] for p in found) == pytest.approx(LARGEST)
    assert TorusDisks(4).radius([a, a, -a, -a, b, -b, -b, b, 0]) == pytest.approx(LARGEST)


@pytest.mark.parametrize(
    "radii", [(0.2595, 0.6), pytest.param((0.252, 0.258), marks=pytest.mark.slow)]
)
def test_no_four_discs_on_the_square_torus_are_critical_at_other_radii(radii):
    d, energy, box = several_discs(4, radii)
    found = stationary_points(d, energy, box=box, symmetry=symmetries(4))
    assert found.complete
    assert not len(found)
    assert not any(radii[0] <= c.radius <= radii[1] for c in TorusDisks(4).critical(0))


@pytest.mark.slow
def test_four_discs_on_the_square_torus():
    """Above 0.258 nothing is critical but what is near the densest four discs.

    These have ten contacts in seven coordinates.  Five of them hold three discs, and the fourth one
    fits into the gap without force, so that they stay undecided.
    """
    d, energy, box = several_discs(4, (0.258, 0.6))
    found = stationary_points(d, energy, box=box, symmetry=symmetries(4), resolution=2e-3)
    assert not len(found)
    assert np.ptp(found.undecided, axis=1).max() < 0.002
    model = TorusDisks(4)
    densest = copies(model, model.critical(0)[0])
    assert len(densest) == 24
    assert densest[:, -1] == pytest.approx(LARGEST)
    apart = np.abs(found.undecided[:, :, None] - densest).max(axis=(1, 3))
    assert apart.min(axis=1).max() < 0.013
