"""The list of neighbours, beside all pairs of bodies."""

import numpy as np
import pytest

from polycorner.bodies import Arrangement, HalfSpace, disc
from polycorner.motion.engine.neighbour_list import MANY, SKIN
from polycorner.motion.noise import Solver
from polycorner.motion.simulation import start

DT = 1e-3


def flying(count, width, seed, solver=None):
    """Return the engine of discs that fly anywhere above a floor, some of them fast."""
    rng, side = np.random.default_rng(seed), int(1.1 * count**0.5) + 1
    apart = np.array([(x, y) for x in range(side) for y in range(side)])
    chosen = rng.choice(len(apart), count, replace=False)
    places = 2.5 * apart[chosen] + rng.uniform(-0.2, 0.2, (count, 2)) - [width, -5.0]
    system = Arrangement(
        {"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all"
    ).system(count=count)
    velocity = rng.normal(0.0, 20.0, (count, 2))
    state = system.state(*(np.column_stack([a, 0 * a[:, 0]]) for a in (places, velocity)))
    return start(system, state, DT, solver=solver or Solver(crowd_sweeps=4))


@pytest.mark.parametrize("count", [MANY - 1, MANY, 3 * MANY])
def test_neighbours_are_all_pairs_that_are_near_enough(count):
    engine, lists = flying(count, 75.0, count), 0
    former = None
    for _ in range(40):
        engine.advance(1)
        work = engine.work
        places = work.neighbours.position.copy()
        if former is not None and (places == former).all():
            continue
        former, lists = places, lists + 1
        reach, travel = engine.model.reach, work.neighbours.travel[0]
        far = reach * (1 + SKIN) + max(0.0, 2 * travel - 0.25 * SKIN * reach)
        apart = np.linalg.norm(places[:, None] - places[None], axis=2)
        expected = np.argwhere(np.triu(apart < far, 1))
        found = work.neighbours.pairs[: work.neighbours.status[0]]
        assert len(found) == len(expected) > count / 2
        ranks = np.sort(engine.motion.rank[found], axis=1) @ [count, 1]
        assert (np.diff(ranks) > 0).all()
        np.testing.assert_array_equal(found[np.lexsort(found.T[::-1])], expected)
    assert lists > 2
    assert (work.neighbours.column.max() > work.neighbours.column.min() + 5) == (count >= MANY)


def test_a_body_that_flew_far_away_has_no_neighbours():
    engine = flying(MANY, 75.0, 0)
    engine.motion.q[7, 0] = 1e200
    engine.advance(1)
    assert not (engine.work.neighbours.pairs[: engine.work.neighbours.status[0]] == 7).any()
    assert engine.work.neighbours.status[0] > MANY / 2
