"""Motions whose forces, gaps and slips are hostile numbers here and there.

Run as a program: the compiled engine is given such kernels; see ``checked_memory``.
"""

import ctypes
import random
import sys
import warnings
from contextlib import suppress

import numpy as np
from hostile_numbers import HOSTILE, POINT

from polycorner.bodies import Arrangement, HalfSpace, disc
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.errors import SolverError
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.simulation import start

SHARES = (0.001, 0.02, 0.3)  # of the numbers that are hostile
DT, SIDE = 1e-3, 3


def motions(rng):
    """Return an engine: dumbbells in a drum, or discs on a floor, solved exactly or by sweeps."""
    kind, numbers = rng.randrange(3), np.random.default_rng(rng.randrange(100))
    if kind == 0:
        drum = DumbbellDrum(count=12, floor=True)
        noise = Noise(chatter=0.2, kicks={"eta": 1.0}, seed=1)
        return start(drum, drum.state(bunch(drum, numbers)), DT, noise=noise)
    discs = Arrangement(
        {"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all"
    ).system(count=SIDE**2, friction=0.4)
    places = [[2.01 * i, 1.0 + 2.01 * j, 0.0] for j in range(SIDE) for i in range(SIDE)]
    state = discs.state(places, numbers.normal(0.0, 1.0, (SIDE**2, 3)))
    return start(discs, state, DT, solver=Solver(crowd_sweeps=4) if kind == 1 else None)


class Hostile:
    """Point routines that are called in place of an engine's, and replace some numbers."""

    def __init__(self, rng, engine):
        self.rng, self.share, self.kept = rng, rng.choice(SHARES), []
        model, k = engine.model, engine.bodies.dimension
        calls = {name: getattr(model, name).copy() for name in ("gap_calls", "slip_calls")}
        for table in calls.values():
            for call in table:
                call[0] = self.wrapped(call[0], call[2], call[2] * call[1])
        loads, (kernel,) = int(model.loads[0]), model.force_kernel
        force = self.wrapped(kernel, k * (k + 1) // 2 + 2 * k + loads, 0)
        engine.model = model._replace(force_kernel=np.array([force]), **calls)
        if model.families:
            n, m = int(model.first_read[1]), int(model.pair_gaps[0])
            pair = self.wrapped(model.pair_kernel[0], m, m * n)
            values = self.wrapped(model.pair_values[0], m, 0)
            engine.model = engine.model._replace(
                pair_kernel=np.array([pair]), pair_values=np.array([values])
            )
        engine._allocate()

    def wrapped(self, address, values, slopes):
        original = POINT(int(address))

        def point(q, p, f, J, H):
            original(q, p, f, J, H)
            for numbers, count in ((f, values), (J, slopes)):
                for at in range(count):
                    if self.rng.random() < self.share:
                        numbers[at] = self.rng.choice(HOSTILE)

        self.kept.append(POINT(point))
        return ctypes.cast(self.kept[-1], ctypes.c_void_p).value


def run(seed, count):
    """Advance hostile motions by some steps each: they go on, or it is said why they cannot."""
    rng = random.Random(seed)
    for _ in range(count):
        engine = motions(rng)
        engine.advance(5)
        hostile = Hostile(rng, engine)
        with suppress(SolverError):
            for _ in range(10):
                hostile.share = rng.choice((0.0, *SHARES))
                engine.advance(1)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    run(*map(int, sys.argv[1:]))
