"""Piles at rest, against the largest share of friction that they can do without, by Clarabel."""

import cvxpy as cp
import numpy as np

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.engine.arrays import OWN_FRICTION
from polycorner.motion.engine.sets import DISC
from polycorner.motion.simulation import start


def rest_problem(engine, before, share):
    """Return the impulses that bodies lack for rest, and the rules for those of their contacts.

    From the definition, for Clarabel: forces have to be in their sets, those of the drum with a
    ``share`` of its loads left out.  The rows of contacts and the loads are those of the engine's
    last step.
    """
    work, model = engine.work, engine.model
    k, count = model.dimension, int(work.island.start[-1])
    p, rules = cp.Variable((count, 2)), []
    sums = {
        i: work.mid.mass[i, :, :k] @ (work.velocity.free[i, :k] - before[i]) for i in awake(engine)
    }
    for b in range(count):
        rows, owner = max(1, work.block.rows[b]), work.block.pressing[b]
        J = work.block.jacobian[b, :rows].reshape(rows, 2, -1)
        bodies = [i for i in work.block.bodies[b] if i >= 0]
        for side, i in enumerate(bodies):
            if i in sums:
                sums[i] = sums[i] + J[:, side, :k].T @ p[b, :rows]
        if work.block.rows[b] == 0:
            ends = [J[0, side, :k] @ before[i] for side, i in enumerate(bodies)]
            opens = sum(ends) + work.block.offset[b, 0] > 1e-2
            rules.append(p[b, 0] == 0 if opens else p[b, 0] >= 0)
            continue
        drum = work.block.origin[b, 0] == OWN_FRICTION
        shape = (model.friction_sets if drum else model.pair_sets)[work.block.origin[b, 2], 0]
        mu = model.set_sizes[shape, 0 if model.set_kinds[shape] == DISC else 1]
        load = (1 - share) * work.block.load[b] if drum else p[owner, 0]
        rules.append(cp.norm(p[b, :rows]) <= mu * load)
    return sums, rules


def awake(engine):
    return np.flatnonzero(engine.work.body.awake)


def spare(engine, before):
    """Return the largest share of the drum's friction without which a pile would remain at rest."""
    share = cp.Variable()
    sums, rules = rest_problem(engine, before, share)
    rules += [share <= 1, *(total == 0 for total in sums.values())]
    cp.Problem(cp.Maximize(share), rules).solve(solver=cp.CLARABEL)
    return share.value


def least_motion(engine, before):
    """Return the least velocity that a pile must get, over the largest that forces would give it.

    The solver's measure of accuracy, found without it.
    """
    work, model, most = engine.work, engine.model, cp.Variable()
    sums, rules = rest_problem(engine, before, 0.0)
    for i, total in sums.items():
        velocity = work.mid.inverse_mass[i, :, : model.dimension] @ total
        rules.append(cp.norm_inf(cp.multiply(model.units[model.kind[i]], velocity)) <= most)
    cp.Problem(cp.Minimize(most), rules).solve(solver=cp.CLARABEL)
    speeds = [
        abs(work.block.free[b, :rows] + work.block.offset[b, :rows]).max()
        for b, rows in enumerate(np.maximum(1, work.block.rows[: int(work.island.start[-1])]))
    ]
    return most.value / max(speeds)


def test_a_pile_remains_at_rest_as_long_as_it_can():
    """Carried up by the drum, it slides when forces can no longer balance, and not before.

    Friction is left to spare, within the solver's accuracy, whenever the engine finds an
    equilibrium; there is none when the pile starts to slide.
    """
    drum = DumbbellDrum(count=8, floor=True)
    engine = start(drum, drum.state(bunch(drum, np.random.default_rng(3))), 1e-3)
    engine.advance(9500)
    left, slides, moved = [], [], []
    while engine.time < 30:
        before, rested = engine.motion.v.copy(), engine.motion.rests.all()
        engine.advance(1)
        if rested and engine.work.body.awake.any():
            found = left if engine.motion.rests.all() else slides
            found.append(spare(engine, before))
            if found[-1] < 0:  # no equilibrium, if the solver were exact
                moved.append(least_motion(engine, before))
    assert max(left) > 0.1
    assert max(moved) < 3 * engine.model.tolerance
    assert len(slides) > 1
    assert max(map(abs, slides)) < 2e-3
