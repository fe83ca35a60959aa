"""Phases of a step whose items any thread may do.

The items of a phase write to places of their own, so that results do not depend on which thread
does what, or on how many there are.  Each thread has a record of its own of the workspace, with
arrays of its own for what is in the making.  The first thread, which runs the step, says what the
items are, and issues a *ticket*: the number of the phase and of the next item.  All threads take
tickets until there are no more; the first one waits until all items are done.  Others never hold it
up: a thread that comes too late finds a ticket of another phase, or no item left.
"""

import numpy as np

from polycorner.motion.engine import codes
from polycorner.motion.engine.accounts import book_block, book_body
from polycorner.motion.engine.blocks import assemble_contacts, predict_body
from polycorner.motion.engine.compact import begin_compact, end_compact
from polycorner.motion.engine.contact_list import add_contacts, observe_block, store_impulses
from polycorner.motion.engine.crowds import (
    change_strip,
    compact_strip,
    gain_strip,
    judge_strip,
    press_strip,
    sweep_strips,
)
from polycorner.motion.engine.evaluation import evaluate_body, start_body
from polycorner.motion.engine.island import solve_island
from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled
from polycorner.motion.engine.neighbours import count_range, detect_counted
from polycorner.motion.engine.signals import call_nothing, increase, read, write
from polycorner.motion.engine.sizes import AT_ONCE

ITEM_BITS, ITEM_MASK = np.int64(32), np.int64(2**32 - 1)
PATIENCE = 200  # looks at a signal before other threads are let run


@compiled
def do_item(model, state, work, item):
    """Do an item of the present phase."""
    island, block, crowd = work.island, work.block, work.crowd
    shared, scratch = work.shared, work.scratch
    kind, told = shared.told[codes.KIND], shared.told
    if kind == codes.SWEEP:
        sweep_strips(model, block, crowd, scratch, item, told[codes.SET_OFF])
    elif kind == codes.COMPACT:
        shared.worst[item] = compact_strip(model, state, work, item)
    elif kind == codes.PRESS:
        press_strip(model, crowd, 2 * item + told[codes.SET_OFF])
    elif kind == codes.JUDGE:
        t = 2 * item + told[codes.SET_OFF]
        shared.worst[t], shared.sunk[t] = judge_strip(model, block, crowd, scratch, t)
    elif kind == codes.GAIN:
        shared.gained[item] = gain_strip(block, crowd, item)
    elif kind in (codes.COMPRESS, codes.KEEP, codes.MIX):
        change_strip(block, crowd, item, kind, shared.times[codes.SHARE])
    elif kind == codes.SOLVE:
        i = shared.to_solve[item]
        first, last = island.start[i], island.start[i + 1]
        island.residual[i] = solve_island(model, state, work, first, last, told[codes.AGAIN] != 0)
    else:
        do_range(
            model, state, work, kind, item * AT_ONCE, min(told[codes.COUNT], (item + 1) * AT_ONCE)
        )


@compiled
def do_range(model, state, work, kind, begin, end):
    """Do what is asked for some bodies, contacts or blocks in a row."""
    mid, body, neighbours, pair, block = work.mid, work.body, work.neighbours, work.pair, work.block
    event, crowd, shared, scratch = work.event, work.crowd, work.shared, work.scratch
    told, h = shared.told, shared.times[codes.LENGTH]
    if kind == codes.EVALUATE:
        for i in range(begin, end):
            if state.alive[i] and not state.asleep[i]:
                evaluate_body(
                    model,
                    state,
                    mid,
                    scratch,
                    i,
                    h,
                    shared.times[codes.TIME],
                    told[codes.STEP_INDEX],
                )
    elif kind == codes.ASSEMBLE:
        assemble_contacts(model, state, work, h, begin, end, pair.first_block[begin])
    elif kind == codes.START:
        for i in range(begin, end):
            start_body(model, state, work, i)
    elif kind == codes.PREDICT:
        for i in range(begin, end):
            predict_body(model, state, work, i, h, shared.times[codes.DISTANCE])
    elif kind == codes.COUNT_GAPS:
        limit = shared.times[codes.DISTANCE]
        shared.found[begin // AT_ONCE] = count_range(
            model, state, mid, body, neighbours, scratch, begin, end, limit
        )
    elif kind == codes.DETECT:
        limit, count = shared.times[codes.DISTANCE], shared.found[begin // AT_ONCE]
        detect_counted(
            model, state, mid, neighbours, pair, scratch, begin, end, limit, h / model.step, count
        )
    elif kind in (codes.OBSERVE, codes.BOOK):
        # A single item books where the sums are: small systems have the sums that they had before
        # there were items.
        if told[codes.COUNT] <= AT_ONCE:
            book_range(model, state, work, kind, begin, end, state.sums)
        else:
            item = begin // AT_ONCE
            for a in range(state.sums.size):
                shared.booked[item, a] = 0.0
            book_range(model, state, work, kind, begin, end, shared.booked[item])
    elif kind in (codes.BEGIN, codes.END):
        for i in range(begin, end):
            if body.awake[i] and work.island.parent[i] == told[codes.ISLAND]:
                if kind == codes.BEGIN:
                    begin_compact(model, state, mid, crowd, i)
                else:
                    end_compact(model, state, work.velocity, crowd, i)
                    body.island_speed[i] = max(body.island_speed[i], shared.times[codes.SPEED])
    elif kind == codes.STORE:
        store_impulses(model, state, pair, block, begin, end, h)
    elif kind == codes.ADD:
        add_contacts(
            model, state, body, pair, block, event, begin, end, told[codes.SET_OFF], h / model.step
        )


@compiled
def book_range(model, state, work, kind, begin, end, sums):
    """Book the work of some blocks, and observe them, or that of some bodies, in given sums."""
    mid, velocity, body, sleep, shared = work.mid, work.velocity, work.body, work.sleep, work.shared
    h, time = shared.times[codes.LENGTH], shared.times[codes.TIME]
    for b in range(begin, end):
        if kind == codes.OBSERVE:
            book_block(model, body, work.tie, work.block, b, sums)
            observe_block(model, state, work, b, h, time, sums)
        else:
            book_body(model, state, mid, velocity, body, sleep, b, sums)


@compiled
def share_range(model, state, work, kind, count, h):
    """Do what is asked for so many bodies, contacts or blocks, together with the other threads."""
    shared = work.shared
    shared.told[codes.COUNT], shared.times[codes.LENGTH] = count, h
    share_out(model, state, work, kind, items_of(count))


@compiled
def items_of(count):
    """Return how many items so many bodies, contacts or blocks are."""
    return (count + AT_ONCE - 1) // AT_ONCE


@compiled
def share_out(model, state, work, kind, count):
    """Do the items of a phase, together with the other threads."""
    shared = work.shared
    shared.told[codes.KIND] = kind
    # One item is not worth the signals.
    if model.threads == 1 or count == 1:
        for item in range(count):
            do_item(model, state, work, item)
        return
    phase = ((read(shared.signals, codes.TICKET) >> ITEM_BITS) + 1) << ITEM_BITS
    write(shared.signals, codes.ITEMS_DONE, ZERO)
    # Before the ticket, by which others see that there is a phase; a thread that is late finds a
    # limit of another phase, and leaves.
    write(shared.signals, codes.LIMIT, phase + count)
    write(shared.signals, codes.TICKET, phase)
    take_items(model, state, work)
    looks = 0
    while read(shared.signals, codes.ITEMS_DONE) < count:
        looks = pause(model, looks)


@compiled
def take_items(model, state, work):
    """Do items of the present phase until none is left."""
    shared = work.shared
    while True:
        ticket, limit = (
            increase(shared.signals, codes.TICKET, ONE),
            read(shared.signals, codes.LIMIT),
        )
        if ticket >> ITEM_BITS != limit >> ITEM_BITS or ticket >= limit:
            return
        do_item(model, state, work, ticket & ITEM_MASK)
        increase(shared.signals, codes.ITEMS_DONE, ONE)


@compiled
def pause(model, looks):
    """Wait for a moment; return the number of looks at a signal."""
    # Phases last microseconds: looking costs less than sleeping, unless there are fewer processors
    # than threads.
    if looks >= PATIENCE and model.give_way != 0:
        call_nothing(model.give_way)
        return 0
    return looks + 1


@compiled
def assist(model, state, work):
    """Do items of all phases until the first thread is done."""
    shared = work.shared
    looks, phase = 0, NONE
    while read(shared.signals, codes.STOP) == 0:
        now = read(shared.signals, codes.TICKET) >> ITEM_BITS
        if now == phase:
            looks = pause(model, looks)
            continue
        phase, looks = now, 0
        take_items(model, state, work)
