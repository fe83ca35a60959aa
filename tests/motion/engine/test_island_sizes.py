"""Islands of few and of many rows."""

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron
from polycorner.motion import Disc, Friction, System, simulate
from polycorner.motion.contacts import velocities


@pytest.mark.parametrize("copies", [1, 3, 30, 120])
def test_a_block_slides_alike_on_any_number_of_floors(copies):
    """A floor several times, each with its friction: many rows for few velocities.

    The friction of the floors adds up to that of one: the block stops after ``v^2 / (2 mu g)``.
    """
    M = Manifold.euclidean("x z")
    (_, z), (vx, vz) = M.symbols, velocities(M)
    speed, mu, gravity = 2.0, 0.5, 10.0
    block = System(
        Polyhedron(M, {f"floor{i}": z + i * z**2 for i in range(copies)}),
        (vx**2 + vz**2) / 2,
        gravity * z,
        friction=tuple(
            Friction(f"grip{i}", (vx, 0 * vx), Disc(mu), f"floor{i}") for i in range(copies)
        ),
    )
    run = simulate(block, block.state([0.0, 0.0], [speed, 0.0]), 0.6, 1e-3)
    assert run.effort.unconverged == 0
    np.testing.assert_allclose(run.q[-1].ravel(), [speed**2 / (2 * mu * gravity), 0.0], atol=1e-6)
    assert not run.v[-1].any()
