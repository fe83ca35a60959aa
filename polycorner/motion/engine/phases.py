"""Phases of a step whose items any thread may do.

The items of a phase write to places of their own, so that results do not depend on which thread
does what, or on how many there are.  Each thread has a record of its own of the workspace, with
arrays of its own for what is in the making.  The first thread, which runs the step, says what the
items are, and issues a *ticket*: the number of the phase and of the next item.  All threads take
tickets until there are no more; the first one waits until all items are done.  Others never hold it
up: a thread that comes too late finds a ticket of another phase, or no item left.
"""

import numpy as np

from polycorner.motion.engine.accounts import book_block, book_body
from polycorner.motion.engine.blocks import assemble_contacts
from polycorner.motion.engine.codes import (
    ADD,
    AGAIN,
    ASSEMBLE,
    BEGIN,
    BOOK,
    COMPACT,
    COUNT,
    COUNT_GAPS,
    DETECT,
    DISTANCE,
    END,
    EVALUATE,
    ISLAND,
    ITEMS_DONE,
    JUDGE,
    KIND,
    LENGTH,
    LIMIT,
    OBSERVE,
    PREDICT,
    PRESS,
    SET_OFF,
    SOLVE,
    SPEED,
    START,
    STEP_INDEX,
    STOP,
    STORE,
    SWEEP,
    TICKET,
    TIME,
)
from polycorner.motion.engine.compact import begin_compact, end_compact
from polycorner.motion.engine.contact_list import add_contacts, observe_block, store_impulses
from polycorner.motion.engine.crowds import (
    compact_strip,
    judge_strip,
    press_strip,
    sweep_strips,
)
from polycorner.motion.engine.evaluation import evaluate_body, start_body
from polycorner.motion.engine.island import solve_island
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import count_range, detect_counted
from polycorner.motion.engine.prediction import predict_body
from polycorner.motion.engine.signals import call_nothing, increase, read, write
from polycorner.motion.engine.sizes import AT_ONCE

ITEM_BITS, ITEM_MASK = np.int64(32), np.int64(2**32 - 1)
PATIENCE = 200  # looks at a signal before other threads are let run


@compiled
def do_item(model, state, work, item):
    """Do an item of the present phase."""
    kind, told = work.told[KIND], work.told
    if kind == SWEEP:
        sweep_strips(model, work, item, told[SET_OFF])
    elif kind == COMPACT:
        work.worst[item] = compact_strip(model, state, work, item)
    elif kind == PRESS:
        press_strip(model, work, 2 * item + told[SET_OFF])
    elif kind == JUDGE:
        t = 2 * item + told[SET_OFF]
        work.worst[t] = judge_strip(model, work, t)
    elif kind == SOLVE:
        i = work.to_solve[item]
        first, last = work.island_start[i], work.island_start[i + 1]
        work.island_residual[i] = solve_island(model, state, work, first, last, told[AGAIN] != 0)
    else:
        do_range(model, state, work, kind, item * AT_ONCE, min(told[COUNT], (item + 1) * AT_ONCE))


@compiled
def do_range(model, state, work, kind, begin, end):
    """Do what is asked for some bodies, contacts or blocks in a row."""
    told, h = work.told, work.told_times[LENGTH]
    if kind == EVALUATE:
        for i in range(begin, end):
            if state.alive[i] and not state.asleep[i]:
                evaluate_body(model, state, work, i, h, work.told_times[TIME], told[STEP_INDEX])
    elif kind == ASSEMBLE:
        b = told[SET_OFF] + (1 + model.pair_laws) * begin
        assemble_contacts(model, state, work, h, begin, end, b)
    elif kind == START:
        for i in range(begin, end):
            start_body(model, state, work, i)
    elif kind == PREDICT:
        for i in range(begin, end):
            predict_body(model, state, work, i, h, work.told_times[DISTANCE])
    elif kind == COUNT_GAPS:
        limit = work.told_times[DISTANCE]
        work.found[begin // AT_ONCE] = count_range(model, state, work, begin, end, limit)
    elif kind == DETECT:
        limit, count = work.told_times[DISTANCE], work.found[begin // AT_ONCE]
        detect_counted(model, state, work, begin, end, limit, h / model.step, count)
    elif kind in (OBSERVE, BOOK):
        if told[COUNT] <= AT_ONCE:
            book_range(model, state, work, kind, begin, end, state.sums)
        else:
            item = begin // AT_ONCE
            for a in range(state.sums.size):
                work.booked[item, a] = 0.0
            book_range(model, state, work, kind, begin, end, work.booked[item])
    elif kind in (BEGIN, END):
        for i in range(begin, end):
            if work.awake[i] and work.parent[i] == told[ISLAND]:
                if kind == BEGIN:
                    begin_compact(model, state, work, i)
                else:
                    end_compact(model, state, work, i)
                    work.island_speed[i] = max(work.island_speed[i], work.told_times[SPEED])
    elif kind == STORE:
        store_impulses(model, state, work, begin, end, h)
    elif kind == ADD:
        add_contacts(model, state, work, begin, end, told[SET_OFF], h / model.step)


@compiled
def book_range(model, state, work, kind, begin, end, sums):
    """Book the work of some blocks, and observe them, or that of some bodies, in given sums."""
    h, time = work.told_times[LENGTH], work.told_times[TIME]
    for b in range(begin, end):
        if kind == OBSERVE:
            book_block(model, work, b, sums)
            observe_block(model, state, work, b, h, time, sums)
        else:
            book_body(model, state, work, b, sums)


@compiled
def share_range(model, state, work, kind, count, h):
    """Do what is asked for so many bodies, contacts or blocks, together with the other threads."""
    work.told[COUNT], work.told_times[LENGTH] = count, h
    share_out(model, state, work, kind, items_of(count))


@compiled
def items_of(count):
    """Return how many items so many bodies, contacts or blocks are."""
    return (count + AT_ONCE - 1) // AT_ONCE


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
