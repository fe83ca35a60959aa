"""Entry point of the engine, and its intermediate code."""

from polycorner.formulas.intermediate import intermediate_code
from polycorner.motion.engine.arrays import DONE, EVENTS_FULL, STEPS
from polycorner.motion.engine.codes import STOP
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.phases import assist
from polycorner.motion.engine.records import readers
from polycorner.motion.engine.refinement import step
from polycorner.motion.engine.signals import write
from polycorner.motion.engine.sleep import stays_asleep


@compiled
def advance(model, state, work, log, steps):
    """Advance by several steps; return why it stopped, and how many steps and events."""
    count = ZERO
    for done in range(steps):
        if count > model.event_room:
            return EVENTS_FULL, done, count
        why, count = step(model, state, work, log, count)
        if why != DONE:
            work.list_status[1] = 0
            return why, done, count
    index, h = state.counts[STEPS], model.step
    for i in range(model.bodies):
        if state.alive[i] and state.asleep[i] and state.booked_to[i] < index:
            stays_asleep(model, state, work, i, state.neighbour_impulse, h, index * h, index)
    return DONE, steps, count


def made(dimension: int) -> str:
    """Return the engine as intermediate code.

    It is for bodies of ``dimension`` coordinates, or of any number if that is 0.  Called for less
    than zero steps, it assists the thread that advances.
    """
    model_at, state_at, work_at, log_at = readers(dimension)

    @compiled
    def enter(model, state, work, log, steps):
        if steps < 0:
            assist(model_at(model), state_at(state), work_at(work))
            return DONE, ZERO, ZERO
        done = advance(model_at(model), state_at(state), work_at(work), log_at(log), steps)
        write(work_at(work).signals, STOP, ONE)
        return done

    return intermediate_code({"advance": enter}, arguments=5)
