"""Entry point of the engine, the records as it reads them, and its intermediate code.

The first length of an array is not told: Numba adds it to indices below zero, of which there are
none; added as zero, it vanishes from the machine code.

The number of a body's coordinates may be known when code is compiled: then it is a constant, and so
are the lengths that follow from it, and loops over coordinates are unrolled.
"""

from typing import Any, get_type_hints

from polycorner.formulas.intermediate import intermediate_code
from polycorner.formulas.records import RecordType, reader
from polycorner.motion.engine import codes
from polycorner.motion.engine.arrays import (
    DONE,
    EVENTS_FULL,
    STEPS,
    EngineState,
    Log,
    Model,
    Work,
    declarations,
    whole,
)
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.phases import assist
from polycorner.motion.engine.refinement import step
from polycorner.motion.engine.signals import write
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.sleep import stays_asleep

UNTOLD = 0  # said in place of the first length of an array


def readers(dimension: int) -> list[Any]:
    """Return the functions that make model, state, work and log of the addresses of their tables.

    The table of the work has the addresses of those of its parts.  ``dimension`` is the number of
    coordinates of a body of the only kind, or 0 for any bodies.
    """
    lanes = -(-dimension // WIDTH) * WIDTH
    lengths = {"k": dimension, "2*k": 2 * dimension, "K": lanes, "2*K": 2 * lanes}
    # Code for any number of coordinates is also that for bodies of several kinds.
    one = {"dimension": dimension, "lanes": lanes, "kinds": 1}
    known = lengths | one if dimension else {}

    def read(record: Any) -> Any:
        name = f"{record.__name__}, {dimension}"
        return reader(RecordType(name, declarations(record), known, UNTOLD))

    parts = get_type_hints(Work)
    table_at = reader(RecordType("Work", dict.fromkeys(parts, whole())))
    manner = read(parts["manner"])
    mid = read(parts["mid"])
    velocity = read(parts["velocity"])
    body = read(parts["body"])
    ahead = read(parts["ahead"])
    path = read(parts["path"])
    sleep = read(parts["sleep"])
    island = read(parts["island"])
    neighbours = read(parts["neighbours"])
    pair = read(parts["pair"])
    tie = read(parts["tie"])
    limit = read(parts["limit"])
    block = read(parts["block"])
    event = read(parts["event"])
    search = read(parts["search"])
    graph = read(parts["graph"])
    matrix = read(parts["matrix"])
    crowd = read(parts["crowd"])
    shared = read(parts["shared"])
    scratch = read(parts["scratch"])

    @compiled
    def work_at(address):
        at = table_at(address)
        return Work(
            manner(at.manner),
            mid(at.mid),
            velocity(at.velocity),
            body(at.body),
            ahead(at.ahead),
            path(at.path),
            sleep(at.sleep),
            island(at.island),
            neighbours(at.neighbours),
            pair(at.pair),
            tie(at.tie),
            limit(at.limit),
            block(at.block),
            event(at.event),
            search(at.search),
            graph(at.graph),
            matrix(at.matrix),
            crowd(at.crowd),
            shared(at.shared),
            scratch(at.scratch),
        )

    return [read(Model), read(EngineState), work_at, read(Log)]


@compiled
def advance(model, state, work, log, steps):
    """Advance by several steps; return why it stopped, and how many steps and events."""
    mid, body, sleep, scratch = work.mid, work.body, work.sleep, work.scratch
    count = ZERO
    for done in range(steps):
        # Between steps, so that a step never runs out of room for its events.
        if count > model.event_room:
            return EVENTS_FULL, done, count
        why, count = step(model, state, work, log, count)
        if why != DONE:
            # The room changes before the step is done again, and with it the list.
            work.neighbours.status[1] = 0
            return why, done, count
    # Work on sleepers is booked when they are checked; what is left has to be before sums are read.
    index, h = state.counts[STEPS], model.step
    for i in range(model.bodies):
        books = state.asleep[i] and not state.pile[i] and state.booked_to[i] < index
        if state.alive[i] and books:
            stays_asleep(model, state, mid, body, sleep, scratch, i, h, index * h, index)
    return DONE, steps, count


def made(dimension: int) -> str:
    """Return the engine as intermediate code.

    It is for bodies of one kind with ``dimension`` coordinates, or for any if that is 0.  Called
    for less than zero steps, it assists the thread that advances.
    """
    model_at, state_at, work_at, log_at = readers(dimension)

    @compiled
    def enter(model, state, work, log, steps):
        if steps < 0:
            assist(model_at(model), state_at(state), work_at(work))
            return DONE, ZERO, ZERO
        done = advance(model_at(model), state_at(state), work_at(work), log_at(log), steps)
        write(work_at(work).shared.signals, codes.STOP, ONE)
        return done

    return intermediate_code({"advance": enter}, arguments=5)
