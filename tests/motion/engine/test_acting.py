"""Contacts that are left out of large islands obey the inclusion like all others."""

import numpy as np

from polycorner.bodies import Arrangement, HalfSpace, disc
from polycorner.motion.engine.island import CROWD
from polycorner.motion.noise import Solver
from polycorner.motion.simulation import start
from tests.motion.engine.inclusion import residuals

SIDE, MU, TOLERANCE = 8, 0.3, 1e-4


def heap():
    """Return the engine of discs above a tray."""
    tray = {
        "floor": HalfSpace([0, 1], [0, 0]),
        "left": HalfSpace([1, 0.2], [0, 0]),
        "right": HalfSpace([-1, 0.2], [2.2 * SIDE, 0]),
    }
    system = Arrangement({"D": disc(1.0)}, tray, orientations="all").system(
        gravity=[0, -10.0], friction=MU, count=SIDE**2
    )
    rows, columns = np.divmod(np.arange(SIDE**2), SIDE)
    places = np.stack([1.6 + 2.05 * columns + 0.5 * (rows % 2), 1.2 + 2.4 * rows], axis=-1)
    state = system.state(np.column_stack([places, 0 * rows]))
    return start(system, state, 1e-2, solver=Solver(tolerance=TOLERANCE, refine=False))


def test_all_contacts_of_a_large_island_obey_the_inclusion():
    engine, large, left_out = heap(), 0, 0
    for _ in range(100):
        engine.advance(1)
        work = engine.work
        for root in np.flatnonzero(np.diff(work.island.start) > CROWD):
            blocks = work.block.order[work.island.start[root] : work.island.start[root + 1]]
            bodies = np.unique(work.block.bodies[blocks])
            bodies = bodies[bodies >= 0]
            if engine.motion.rests[bodies].any():
                continue
            far, v = residuals(work, blocks, MU)
            assert far.max() <= 1.001 * TOLERANCE * work.body.island_speed[root]
            np.testing.assert_allclose(v[bodies], work.velocity.new[bodies], atol=1e-8)
            normal = blocks[work.block.rows[blocks] == 0]
            large, left_out = large + 1, left_out + int((work.block.impulse[normal, 0] == 0).sum())
    assert engine.effort.unconverged == 0
    assert large > 30
    assert left_out > 100
