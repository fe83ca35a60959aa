"""Dumbbells that rub side by side in a drum: impacts, and sticking in closed loops."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import Arrangement, Cylinder, capsule, compound, sphere
from polycorner.motion import Solver

RADIUS, LENGTH, BALL, ROD = 125.0, 16.0, 3.0, 1.5
COUNT = 6


@pytest.fixture(scope="module")
def body():
    ends = np.array([[0, -LENGTH / 2, 0], [0, LENGTH / 2, 0]])
    dumbbell = compound(
        {
            "1": sphere(BALL, at=ends[0]),
            "2": sphere(BALL, at=ends[1]),
            "rod": capsule(*ends, ROD),
        }
    )
    drum = Cylinder(RADIUS, axis=[0, 1, 0])
    return Arrangement({"D": dumbbell}, {"drum": drum}, orientations="all")


def test_a_row_that_falls_together_loses_energy_and_comes_to_rest(body):
    """It slides down from both sides; contacts are doubled, and stick in closed loops."""
    system = body.system(gravity=[0, 0, -9810.0], density=1e-3, friction=0.3, count=COUNT)
    phi = (np.arange(COUNT) - (COUNT - 1) / 2) * 0.09
    away = RADIUS - BALL
    starts = [
        body.point(
            {"D": ([away * np.sin(f), 0, -away * np.cos(f)], Rotation.from_rotvec([0, -f, 0]))}
        )
        for f in phi
    ]
    path = simulate(system, system.state(np.array(starts)), 0.6, 1e-3, solver=Solver(1e-8))
    assert path.effort.unconverged <= 3
    assert path.max_penetration < 1e-3 * BALL
    assert path.audit < 1e-3
    energy = path.kinetic + path.potential
    assert np.diff(energy).max() < 1e-6 * np.ptp(energy)
    mirrored = path.q[-1, ::-1, 0]
    assert path.q[-1, :, 0] == pytest.approx(-mirrored, abs=0.05)
    neighbours = np.linalg.norm(np.diff(path.q[-1, :, :3], axis=0), axis=1)
    assert neighbours == pytest.approx(np.full(COUNT - 1, 2 * BALL), abs=0.5)
