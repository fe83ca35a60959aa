"""Entry point of the compiled engine, cached under a key over the sources of all stages."""

from typing import Any

from numba import njit

from polycorner.formulas.compilation import sources_digest
from polycorner.motion.engine.arrays import DONE, EVENTS_FULL, STEPS
from polycorner.motion.engine.jit import ZERO
from polycorner.motion.engine.records import log_at, model_at, state_at, work_at
from polycorner.motion.engine.refinement import step
from polycorner.motion.engine.sleep import stays_asleep


def _entry_point(sources: str) -> Any:
    """Return the compiled function; it reads ``sources``, which puts it into its cache key."""

    @njit(cache=True, error_model="numpy")
    def advance(tables, steps):
        """Advance by several steps; return why it stopped, and how many steps and events."""
        _ = sources
        model, state = model_at(tables[0]), state_at(tables[1])
        work, log = work_at(tables[2]), log_at(tables[3])
        count = ZERO
        most = 2 * work.contact.shape[0] + model.bodies * (3 + model.restitution.size)
        for done in range(steps):
            if count + most > log.entries.shape[0]:
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

    return advance


SOURCES = sources_digest(__package__)
advance = _entry_point(SOURCES)
