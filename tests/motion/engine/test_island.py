"""Islands of many contacts are solved to the tolerance."""

import numpy as np

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.noise import Noise
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
