"""Clusters of Lennard-Jones: energies from the definition, symmetries, the pair in closed form."""

import itertools

import numpy as np
import pytest

from polycorner import minimise
from polycorner.models import LennardJones


def definition(q):
    atoms = q.reshape(-1, 3)
    pairs = itertools.combinations(atoms, 2)
    return sum(4 * (r**-12 - r**-6) for r in (np.linalg.norm(a - b) for a, b in pairs))


def test_energy_and_extent_are_those_of_the_definition():
    model, rng = LennardJones(4, 1.5), np.random.default_rng(0)
    for q in model.starts(rng, 8):
        assert model.energy.value(q) == pytest.approx(definition(q))
        atoms = q.reshape(-1, 3)
        square = ((atoms - atoms.mean(axis=0)) ** 2).sum() / 4
        assert model.polyhedron.values(q) == pytest.approx([1.5**2 - square])


def test_turns_and_exchanges_are_symmetries():
    model, rng = LennardJones(4), np.random.default_rng(1)
    p = model.starts(rng, 2)[1]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    q = (p.reshape(-1, 3) @ turn)[rng.permutation(4)].ravel() + 0.3
    assert model.symmetry.relabellings(model.manifold, p, q, 1e-9)
    assert not model.symmetry.relabellings(model.manifold, p, 1.01 * q, 1e-9)
    assert model.energy.value(p) == pytest.approx(model.energy.value(q))


def test_every_fourth_start_is_plane():
    heights = LennardJones(5).starts(np.random.default_rng(0), 9).reshape(9, 5, 3)[:, :, 2]
    assert (~heights.any(axis=1)).nonzero()[0].tolist() == [0, 4, 8]


def test_a_pair_rests_at_the_depth_of_its_well():
    model = LennardJones(2)
    found = minimise(model.polyhedron, model.energy, [0, 0, 0, 1, 0.2, 0.1])
    assert found.energy == pytest.approx(-1)
    assert np.linalg.norm(found.point[3:] - found.point[:3]) == pytest.approx(2 ** (1 / 6))


def test_wrong_parameters_are_refused_by_name():
    for name, wrong in (("count", 1), ("count", 2.5), ("extent", 0.0)):
        with pytest.raises((TypeError, ValueError), match=name):
            LennardJones(**{"count": 3, name: wrong})
