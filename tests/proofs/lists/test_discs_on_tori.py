"""All critical configurations of two, three and four equal discs on flat tori, each counted twice.

The energy is ``-r``.
"""

import math
from collections import Counter
from itertools import permutations, product

import flint
import numpy as np
import pytest
import sympy as sp

from benchmarks.trials.torus_discs import WHOLE, several_discs, square_of, symmetries
from polycorner import Manifold, Polyhedron
from polycorner.models.disks.disks import TorusDisks
from polycorner.proofs import stationary_points
from polycorner.proofs.checker.__main__ import main

LARGEST = (math.sqrt(6) - math.sqrt(2)) / 4  # of three and of four discs on the square torus


# ------------------------------------------------------------------------------------- two discs


@pytest.mark.parametrize(("lattice", "count"), [("square", 3), ("hexagonal", 5)])
def test_two_discs(lattice, count, tmp_path, capsys):
    """The second disc's centre and the radius; the first one is at the origin.

    A stressed component goes around the torus, through at most two contacts, so that the radius is
    at least 1/4.  On the square torus four contacts hold the densest placement, of which any two
    opposite ones carry all forces.  With copies on the torus the signs of all indices add up to -1,
    the Euler characteristic of the torus without a point.
    """
    M = Manifold.euclidean("u v r")
    u, v, r = M.symbols
    gaps = {
        f"1-2({p},{q})": square_of(lattice, u + p, v + q) - 4 * r**2 for p, q in product(*WHOLE)
    }
    box = [(-0.26, 0.74), (-0.26, 0.74), (0.2, 0.6)]
    found = stationary_points(Polyhedron(M, gaps), -r, box=box)
    assert found.complete
    assert len(found) == count
    kinds = {(round(c.radius, 6), c.index) for c in TorusDisks(2, lattice).critical(0)}
    assert {(round(float(p.point[2]), 6), p.index) for p in found} == kinds
    assert sum((-1) ** p.index for p in found) == -1
    before = flint.ctx.prec
    assert main([str(found.save(tmp_path / "list.zip"))]) == 0
    flint.ctx.prec = before
    assert f"{count} stationary points" in capsys.readouterr().out


# -------------------------------------------------------------------------- three and four discs


def copies(model, configuration):
    """Return a configuration and its images, also those with other labels: ``(k, 2 n - 1)``."""
    away = 0.5 if model.lattice == "square" else 0.0
    turned = np.linalg.inv(model.basis)
    centres = np.reshape(configuration.point[:-1], (-1, 2)) @ model.basis
    rows = []
    for labels, g in product(permutations(range(model.count)), rotations(model.lattice)):
        moved = (centres @ g.T @ turned)[list(labels)]
        apart = moved[1:] - moved[0] - away
        rows.append([*(apart - np.round(apart)).ravel(), configuration.radius])
    return np.unique(np.round(rows, 9) + 0.0, axis=0)


def rotations(lattice):
    """Return the rotations and reflections of a lattice, in the plane."""
    count = 4 if lattice == "square" else 6
    angles = np.arange(count) * math.tau / count
    turns = [np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) for a in angles]
    return [t @ f for t in turns for f in (np.eye(2), np.diag([1.0, -1.0]))]


def check(found, model, radii, counts):
    """The search from random starts finds the same kinds, whose images are the points."""
    assert found.complete
    kinds = [c for c in model.critical(0) if radii[0] < c.radius < radii[1]]
    assert [(c.index, c.nullity) for c in kinds] == [(index, 0) for index in counts]
    assert Counter(p.index for p in found) == counts
    unit = kinds[0].radius / max(p.point[-1] for p in found)
    listed = np.array([p.point for p in found]) * [*[1.0] * (2 * model.count - 2), unit]
    expected = np.concatenate([copies(model, kind) for kind in kinds])
    away = np.abs(listed[:, None] - expected)
    away[:, :, :-1] = np.minimum(away[:, :, :-1], 1 - away[:, :, :-1])
    near = away.max(axis=-1)
    assert len(listed) == len(expected)
    assert (near.min(axis=0) < 1e-7).all()
    assert (near.min(axis=1) < 1e-7).all()


@pytest.mark.parametrize("least", [0.2505, 0.2501])
def test_three_discs_on_the_square_torus(least):
    """All critical configurations with a larger radius: the densest ones, and saddles at 0.25573.

    At 1/4 two discs close a line around the torus, beside which the third one is free.
    """
    d, energy, box = several_discs(3, "square", (least, 0.6))
    found = stationary_points(
        d, energy, box=box, symmetry=symmetries(3, "square"), max_boxes=4_000_000
    )
    check(found, TorusDisks(3), (least, 1.0), {0: 24, 1: 24})
    assert found.minima[0].point[-1] == pytest.approx(LARGEST)


@pytest.mark.parametrize("least", [0.2575, 0.252])
def test_four_discs_on_the_square_torus(least):
    """The densest ones are the only critical ones with a larger radius.

    Of ten contacts in seven coordinates any three discs have five, which hold them; the fourth one
    fits into the gap.  That all ten vanish is shown in the field of the root of 3, with the
    largest radius as the unit.
    """
    radii = (least, 0.6)
    d, energy, box = several_discs(4, "square", radii, unit=(2 - sp.sqrt(3)) / 4)
    found = stationary_points(d, energy, box=box, symmetry=symmetries(4, "square"))
    check(found, TorusDisks(4), radii, {0: 24})
    assert {p.point[-1] for p in found} == {1.0}
    assert {len(p.active) + len(p.redundant) for p in found} == {10}
    assert TorusDisks(4).critical(0)[0].radius == pytest.approx(LARGEST)


@pytest.mark.parametrize("least", [0.251])
def test_three_discs_on_the_hexagonal_torus(least):
    """The densest ones, each disc with three others' images all around, and their mirror images."""
    radii = (least, 0.6)
    d, energy, box = several_discs(3, "hexagonal", radii)
    found = stationary_points(d, energy, box=box, symmetry=symmetries(3, "hexagonal"))
    check(found, TorusDisks(3, "hexagonal"), radii, {0: 2})
    assert {len(p.active) + len(p.redundant) for p in found} == {9}
