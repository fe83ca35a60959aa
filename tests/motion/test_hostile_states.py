"""States with coordinates that are no numbers, or out of all proportion: one sentence, at once."""

from dataclasses import replace

import checked_memory
import numpy as np
import pytest

from polycorner.bodies import Arrangement, HalfSpace, disc
from polycorner.models.textbook import bouncing_ball
from polycorner.motion.simulation import simulate, start

BALL = bouncing_ball(0.7)
DISCS = Arrangement(
    {"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all"
).system(count=5)
STATES = {
    "ball": (BALL, BALL.state([1.0])),
    "discs": (DISCS, DISCS.state([[3.0 * i, 1.5, 0.0] for i in range(5)])),
}


def with_number(state, name, number):
    """Return a state of which the last coordinate, or velocity, is another number."""
    numbers = getattr(state, name).copy()
    numbers.flat[-1] = number
    return replace(state, **{name: numbers})


@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e30])
@pytest.mark.parametrize("name", ["q", "v"])
@pytest.mark.parametrize("kind", STATES)
def test_a_state_beyond_what_numbers_resolve_is_refused(kind, name, number):
    system, state = STATES[kind]
    with pytest.raises(ValueError, match=r"^state: expected coordinates that numbers resolve to"):
        simulate(system, with_number(state, name, number), 0.01, 1e-3)


@pytest.mark.parametrize("number", [5e-324, 1e12, -1e12])
@pytest.mark.parametrize("kind", STATES)
def test_a_fast_body_flies_far(kind, number):
    system, state = STATES[kind]
    path = simulate(system, with_number(state, "v", number), 0.01, 1e-3)
    assert np.isfinite(path.q).all()


@pytest.mark.parametrize("time", [np.nan, np.inf, -np.inf])
def test_a_time_that_is_not_finite_is_refused(time):
    with pytest.raises(ValueError, match=r"^state\.time: expected a finite number"):
        simulate(BALL, replace(STATES["ball"][1], time=time), 0.01, 1e-3)


def test_an_engine_refuses_saved_places_that_are_not_finite():
    engine = start(*STATES["discs"], 1e-3)
    arrays = {name: array.copy() for name, array in engine.save().items()}
    arrays["q"][2, 1] = np.nan
    with pytest.raises(ValueError, match="yD = nan of body 'D 3'"):
        engine.load(arrays)


def test_no_number_of_a_force_or_gap_leads_out_of_an_array():
    checked_memory.run("hostile_motions", 1, 3)
