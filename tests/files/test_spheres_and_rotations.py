"""Manifolds with spheres and rotations in files: certificates, skeletons, graphs, trajectories."""

import numpy as np
import pytest
from kept_files import same_certificate

from polycorner import Manifold, Polyhedron, minimise, skeleton
from polycorner.files import (
    load_certificate,
    load_skeleton,
    load_trajectory,
    save_certificate,
    save_skeleton,
    save_trajectory,
)
from polycorner.files.polyhedra import manifold_entry, read_manifold
from polycorner.motion import System, rotational_energy, simulate, velocities

POSE = Manifold.euclidean("x y z", unit="mm") * Manifold.rotation("a", scale=0.1)
OCTANT = Polyhedron(
    Manifold.sphere("u"), dict(zip("xyz", Manifold.sphere("u").symbols, strict=True))
)


@pytest.mark.parametrize("M", [POSE, POSE**2 * Manifold.sphere("u") ** 3, OCTANT.manifold])
def test_manifolds_are_read_back(M):
    again = read_manifold(manifold_entry(M))
    assert (again, again.units) == (M, M.units)


def test_plain_coordinates_are_written_as_before():
    entry = manifold_entry(Manifold.euclidean("x"))
    assert entry == [{"name": "x", "unit": "", "period": "inf", "scale": 1.0}]


def test_a_certificate_is_certified_again_without_its_normalisation(tmp_path):
    z, turn = POSE.symbols[2], POSE.matrix()
    D = Polyhedron(POSE, {"floor": z - 1}, equations={"x": POSE.symbols[0], "y": POSE.symbols[1]})
    c = minimise(D, z - turn[2, 2] / 2 - turn[0, 0] / 3, [0, 0, 2, 0.8, 0.6, 0, 0])
    path = save_certificate(c, tmp_path / "pose.json")
    assert "|a|" not in path.read_text()
    same_certificate(load_certificate(path), c)
    flat = Polyhedron(Manifold.euclidean(POSE.names), {"floor": z - 1})
    with pytest.raises(ValueError, match=r"scales|rotations"):
        load_certificate(path, flat, z)


def test_a_skeleton_is_read_back(tmp_path):
    found = skeleton(OCTANT, [[0.6, 0.48, 0.64]])
    path = save_skeleton(found, tmp_path / "octant.h5")
    again = load_skeleton(path)
    assert again.polyhedron.manifold == OCTANT.manifold
    assert [e.length for e in again.edges] == [e.length for e in found.edges]


def test_a_trajectory_is_read_back(tmp_path):
    M = Manifold.rotation("a")
    top = System(Polyhedron(M, {}), rotational_energy(M, [1, 2, 3]))
    q = np.array([1.0, 0, 0, 0])
    path = simulate(top, top.state(q, M.frame(q) @ [0.1, 1.0, 0.2]), 0.1, 0.01)
    again = load_trajectory(save_trajectory(path, tmp_path / "top.nc"), top)
    assert again.q.tolist() == path.q.tolist()
    assert len(velocities(M)) == again.q.shape[-1]
