"""Islands of many contacts are solved to the tolerance."""

import numpy as np

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.simulation import start


def test_chattering_piles_are_solved():
    """Dumbbells wedged in many ways, under loads that are drawn anew a hundred times a second."""
    drum = DumbbellDrum(count=12, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    engine = start(drum, drum.state(starts), 1e-3, noise=Noise(chatter=0.3, seed=1))
    engine.advance(4000)
    effort = engine.effort
    assert effort.islands > 1000
    assert effort.unconverged < 0.01 * effort.islands


def test_a_falling_heap_is_solved_to_eight_digits():
    """Sixty dumbbells stick in closed loops: the errors of their gaps must not jam them."""
    drum = DumbbellDrum(count=60)
    starts = bunch(drum, np.random.default_rng(3))
    solver = Solver(tolerance=1e-8, refine=False)
    engine = start(drum, drum.state(starts), 1e-3, solver=solver)
    engine.advance(600)
    effort = engine.effort
    assert effort.islands > 5000
    assert effort.unconverged < 1e-3 * effort.islands
