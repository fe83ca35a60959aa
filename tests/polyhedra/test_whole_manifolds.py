"""A polyhedron without inequalities and equations is the whole manifold, for everything."""

import math
import pickle

import numpy as np
import pytest

from polycorner import (
    AllOf,
    Manifold,
    Polyhedron,
    System,
    certify,
    minima,
    minimise,
    prove,
    simulate,
    skeleton,
    stratum_at,
    velocities,
)
from polycorner.bodies import Arrangement, capsule, disc
from polycorner.files import load_certificate, save_certificate
from polycorner.landscapes import landscape
from polycorner.minimisation import immobility
from polycorner.motion import accelerations

M = Manifold.euclidean("x y")
(X, Y), (VX, VY) = M.symbols, velocities(M)
BOWL = (X - 1) ** 2 + 3 * (Y + 2) ** 2


@pytest.fixture(scope="module")
def whole():
    return Polyhedron(M, {})


@pytest.mark.parametrize("parts", [[], (), AllOf(), AllOf(AllOf()), None], ids=repr)
def test_nothing_is_said_in_several_ways(whole, parts):
    other = Polyhedron(M) if parts is None else Polyhedron(M, parts)
    assert repr(other) == repr(whole)
    assert other.contains([0, 0])


def test_every_point_is_inside(whole):
    assert whole.contains([1e9, -3.0])
    assert whole.contains(np.zeros((4, 2))).all()
    assert whole.implicit([0, 0]) == math.inf
    assert not whole.is_union
    assert whole.values(np.zeros((4, 2))).shape == (4, 0)
    found = stratum_at(whole, [1, 2])
    assert (found.dimension, found.rank, found.local_type.name) == (2, 0, "INTERIOR")
    assert pickle.loads(pickle.dumps(whole)).contains([0, 0])
    assert "x, y" in str(whole)


@pytest.mark.parametrize("method", ["newton", "slsqp", "scp"])
def test_a_minimum_is_that_of_the_function(whole, method):
    found = minimise(whole, BOWL, [5, 5], method=method)
    np.testing.assert_allclose(found.point, [1, -2], atol=1e-6)
    assert found.verdict.name == "STRICT_MINIMUM"
    assert found.active == ()


def test_proofs_lists_and_files(whole, tmp_path):
    found = certify(whole, BOWL, [1, -2])
    assert prove(found).proved
    again = load_certificate(save_certificate(found, tmp_path / "c.json"))
    np.testing.assert_array_equal(again.point, found.point)
    assert len(minima(whole, BOWL, box=[[-3, 3], [-3, 3]], starts=5)) == 1
    assert len(landscape(whole, BOWL, box=[[-3, 3], [-3, 3]]).minima) == 1
    assert immobility(whole, [0, 0]).mobility.name == "MOBILE"


def test_there_are_no_corners(whole):
    found = skeleton(whole, [[0, 0]])
    assert (len(found.corners), len(found.edges), len(found.faces)) == (0, 0, 0)


def test_a_free_body_falls(whole):
    system = System(whole, (VX**2 + VY**2) / 2, 10 * Y)
    start = system.state([0, 0], [1, 2])
    path = simulate(system, start, 1.0, 1e-2)
    np.testing.assert_allclose(path.q[-1, 0], [1, 2 - 5], atol=1e-9)
    assert path.touching == ((),) * len(path)
    np.testing.assert_allclose(accelerations(system, start).values, [[0, -10]])


def test_a_body_alone_is_anywhere():
    rod = Arrangement({"rod": capsule([-1, 0], [1, 0], 0.1)})
    assert rod.polyhedron.contains([3, 4, 5])
    system = rod.system(gravity=[0, -10])
    q = simulate(system, system.state([0, 0, 0], [1, 0, 2]), 1.0, 1e-3).q[-1, 0]
    np.testing.assert_allclose(q, [1, -5, 2], atol=1e-9)


def test_discs_that_touch_each_other_alone():
    discs = Arrangement({"D": disc(1)}, period=[20, 20]).system(count=2, restitution=1)
    assert discs.contacts == ()
    path = simulate(discs, discs.state([[0, 0], [3, 0]], [[1, 0], [0, 0]]), 2.0, 1e-2)
    np.testing.assert_allclose(path.q[-1], [[1, 0], [4, 0]], atol=1e-9)  # they exchange velocities
