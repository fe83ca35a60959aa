"""Impacts with friction between bodies: listed, repeated and of two kinds, by every law."""

import numpy as np
import pytest

from polycorner import simulate
from polycorner.bodies import Arrangement, capsule, disc
from polycorner.motion import EventKind
from polycorner.motion.bodies import IMPACT_LAWS

ROD = capsule([-1, 0], [1, 0], 0.2)
LAWS = {"friction": 0.7, "restitution": 0.9}


def struck(count, law, seed):
    """Velocities after two rods have met once, and the change of their energy."""
    if count == "repeated":
        system = Arrangement({"A": ROD}, orientations="all").system(count=2, impact=law, **LAWS)
    else:
        listed = Arrangement({"A": ROD, "B": ROD}, orientations="all")
        each = {"A": 1, "B": 1} if count == "kinds" else 1
        system = listed.system(count=each, impact=law, **LAWS)
    rng = np.random.default_rng(seed)
    q = np.array([[0, 0, rng.uniform(-3, 3)], [0, 2.6, rng.uniform(-3, 3)]])
    v = np.array([[rng.normal(), 2, 2 * rng.normal()], [rng.normal(), -2, 2 * rng.normal()]])
    shape = q.shape if count == "repeated" else -1
    path = simulate(system, system.state(q.reshape(shape), v.reshape(shape)), 1.0, 0.01, every=1)
    hits = path.of_kind(EventKind.IMPACT)
    later = np.flatnonzero(path.times > hits[0].time + 1e-6)[0]
    return path.v[later].reshape(2, 3), path.kinetic[later] - path.kinetic[0]


@pytest.mark.parametrize("law", IMPACT_LAWS)
@pytest.mark.parametrize("seed", [1, 3, 6])
def test_repeated_bodies_bounce_as_listed_ones(law, seed):
    listed, energy = struck("listed", law, seed)
    for count in ("repeated", "kinds"):
        found, same = struck(count, law, seed)
        np.testing.assert_allclose(found, listed, atol=1e-7)
        assert same == pytest.approx(energy, abs=1e-7)
    if law != "newton unlimited":
        assert energy <= 1e-9


def test_laws_differ_between_rods():
    found = {law: struck("listed", law, 6)[0] for law in IMPACT_LAWS}
    assert abs(found["poisson"] - found["stronge"]).max() > 1e-3
    assert abs(found["poisson"] - found["newton"]).max() > 1e-3


def test_discs_bounce_alike_by_all_laws():
    """Friction of round bodies acts across the normal: the laws have no case to differ."""
    found = []
    for law in IMPACT_LAWS:
        discs = Arrangement({"A": disc(1.0), "B": disc(0.5)}, orientations="all")
        system = discs.system(impact=law, **LAWS)
        state = system.state([0, 0, 0, 0.4, 2.0, 0], [0, 1, 3, 0, -1, -5])
        found.append(simulate(system, state, 0.5, 0.01).v[-1, 0])
    for v in found[1:]:
        np.testing.assert_allclose(v, found[0], atol=1e-7)
