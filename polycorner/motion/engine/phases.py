"""Phases of a step whose items any thread may do.

The items of a phase write to places of their own, so that results do not depend on which thread
does what, or on how many there are.  Each thread has a record of its own of the workspace, with
arrays of its own for what is in the making.  The first thread, which runs the step, says what the
items are, and issues a *ticket*: the number of the phase and of the next item.  All threads take
tickets until there are no more; the first one waits until all items are done.  Others never hold it
up: a thread that comes too late finds a ticket of another phase, or no item left.
"""

import numpy as np

from polycorner.motion.engine.blocks import assemble_contacts
from polycorner.motion.engine.codes import (
    ADD,
    AGAIN,
    ASSEMBLE,
    BACKWARDS,
    COUNT,
    EVALUATE,
    ITEMS_DONE,
    JUDGE,
    KIND,
    LIMIT,
    SEPARATE,
    SET_OFF,
    SOLVE,
    STEP_INDEX,
    STOP,
    STORE,
    SWEEP,
    TICKET,
)
from polycorner.motion.engine.contact_list import add_contacts, store_impulses
from polycorner.motion.engine.crowds import separate_strip, sweep_strip
from polycorner.motion.engine.evaluation import evaluate_body
from polycorner.motion.engine.gauss_seidel import residual
from polycorner.motion.engine.island import solve_island
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.signals import call_nothing, increase, read, write

ITEM_BITS, ITEM_MASK = np.int64(32), np.int64(2**32 - 1)
PATIENCE = 200  # looks at a signal before other threads are let run
AT_ONCE = 256  # bodies, contacts or blocks of an item


@compiled
def do_item(model, state, work, item):
    """Do an item of the present phase."""
    kind, told = work.told[KIND], work.told
    if kind == SWEEP:
        sweep_strip(model, work, 2 * item + told[SET_OFF], told[BACKWARDS])
    elif kind == SEPARATE:
        separate_strip(model, work, 2 * item + told[SET_OFF])
    elif kind == JUDGE:
        first, last = work.strip_start[item], work.strip_start[item + 1]
        work.worst[item] = residual(model, work, first, last, 0.0)
    elif kind == SOLVE:
        i = work.to_solve[item]
        first, last = work.island_start[i], work.island_start[i + 1]
        work.island_residual[i] = solve_island(model, state, work, first, last, told[AGAIN] != 0)
    else:
        do_range(model, state, work, kind, item * AT_ONCE, min(told[COUNT], (item + 1) * AT_ONCE))


@compiled
def do_range(model, state, work, kind, begin, end):
    """Do what is asked for some bodies, contacts or blocks in a row."""
    told, h = work.told, work.told_times[0]
    if kind == EVALUATE:
        for i in range(begin, end):
            if state.alive[i] and not state.asleep[i]:
                evaluate_body(model, state, work, i, h, work.told_times[1], told[STEP_INDEX])
    elif kind == ASSEMBLE:
        b = told[SET_OFF] + (1 + model.pair_laws) * begin
        assemble_contacts(model, state, work, h, begin, end, b)
    elif kind == STORE:
        store_impulses(model, state, work, begin, end, h)
    elif kind == ADD:
        add_contacts(model, state, work, begin, end, told[SET_OFF], h / model.step)


@compiled
def share_range(model, state, work, kind, count, h):
    """Do what is asked for so many bodies, contacts or blocks, together with the other threads."""
    work.told[COUNT], work.told_times[0] = count, h
    share_out(model, state, work, kind, (count + AT_ONCE - 1) // AT_ONCE)


@compiled
def share_out(model, state, work, kind, count):
    """Do the items of a phase, together with the other threads."""
    work.told[KIND] = kind
    if model.threads == 1 or count == 1:
        for item in range(count):
            do_item(model, state, work, item)
        return
    phase = ((read(work.signals, TICKET) >> ITEM_BITS) + 1) << ITEM_BITS
    write(work.signals, ITEMS_DONE, ZERO)
    write(work.signals, LIMIT, phase + count)
    write(work.signals, TICKET, phase)
    take_items(model, state, work)
    looks = 0
    while read(work.signals, ITEMS_DONE) < count:
        looks = pause(model, looks)


@compiled
def take_items(model, state, work):
    """Do items of the present phase until none is left."""
    while True:
        ticket, limit = increase(work.signals, TICKET, ONE), read(work.signals, LIMIT)
        if ticket >> ITEM_BITS != limit >> ITEM_BITS or ticket >= limit:
            return
        do_item(model, state, work, ticket & ITEM_MASK)
        increase(work.signals, ITEMS_DONE, ONE)


@compiled
def pause(model, looks):
    """Wait for a moment; return the number of looks at a signal."""
    if looks >= PATIENCE and model.give_way != 0:
        call_nothing(model.give_way)
        return 0
    return looks + 1


@compiled
def assist(model, state, work):
    """Do items of all phases until the first thread is done."""
    looks, phase = 0, NONE
    while read(work.signals, STOP) == 0:
        now = read(work.signals, TICKET) >> ITEM_BITS
        if now == phase:
            looks = pause(model, looks)
            continue
        phase, looks = now, 0
        take_items(model, state, work)
