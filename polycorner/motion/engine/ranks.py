"""Ranks of the bodies of crowds: places in space, in whose order contacts stand in memory.

Contacts are listed, detected, assembled and booked pair by pair, in the order of the ranks of their
bodies.  Where this is an order in space, what one phase of a step writes the next one reads in the
same order, and no cache has to hold all of it.  Bodies mix: ranks are renewed from time to time, in
steps that their numbers tell, so that motions that were saved and loaded remain the same.
"""

import numpy as np

from polycorner.motion.engine.arrays import CONTACTS
from polycorner.motion.engine.crowds import extent_of, place_of
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.neighbours import heap_sort, key_of, pair_of

PERIOD = 128  # steps for which ranks hold
COLUMNS, LEVELS = 1024, 2**20  # across the longer extent, at most; along each of them


@compiled
def renew_ranks(model, state, work, index):
    """Rank bodies by columns across the longer extent if this is the step for it."""
    if model.crowd_sweeps == 0 or work.located[0] or index % PERIOD != 0:
        return
    least, extent = extent_of(model, state, work, 0)
    low, height = extent_of(model, state, work, 1)
    axis = 0 if extent > height else 1
    if axis == 1:
        least, extent, low, height = low, height, least, extent
    if not 0.0 < extent < np.inf or not height < np.inf:
        return
    columns, N = max(1, min(COLUMNS, np.int64(extent / model.reach))), model.bodies
    for i in range(N):
        column, level = columns, np.int64(0)
        if state.alive[i]:
            column = np.int64((place_of(model, work, i, axis) - least) / extent * columns)
            if height > 0.0:
                up = (place_of(model, work, i, 1 - axis) - low) / height
                level = np.int64(up * (LEVELS - 1))
        work.sort_keys[i] = (column * LEVELS + level) * N + i
    heap_sort(work.sort_keys, N)
    remember_contacts(model, state, work)
    for s in range(N):
        i = work.sort_keys[s] % N
        state.rank[i], state.body_of_rank[s] = s, i
    sort_remembered(model, state, work)
    work.list_status[1] = 0


@compiled
def remember_contacts(model, state, work):
    """Copy the contacts of the last step to where those of this step are going to be."""
    for s in range(state.counts[CONTACTS]):
        i, j = pair_of(model, state, state.keys[s] // model.pair_gaps)
        work.contact[s, 0], work.contact[s, 1] = i, j
        work.contact[s, 2] = state.keys[s] % model.pair_gaps
        work.contact_gap[s] = state.pair_release[s]
        work.contact_before[s] = 2 * state.pair_flags[s, 0] + state.pair_flags[s, 1]
        for a in range(state.pair_impulse.shape[1]):
            work.contact_impulse[s, a] = state.pair_impulse[s, a]
        for a in range(2 * model.dimension):
            work.contact_gradient[s, a] = state.pair_action[s, a]


@compiled
def sort_remembered(model, state, work):
    """Write the contacts of the last step in the order of the new ranks."""
    count, keys = state.counts[CONTACTS], work.sort_keys
    for s in range(count):
        keys[s] = key_of(model, state, work, s) * count + s
    heap_sort(keys, count)
    for t in range(count):
        s = keys[t] % count
        state.keys[t], state.pair_release[t] = keys[t] // count, work.contact_gap[s]
        state.pair_flags[t, 0] = work.contact_before[s] // 2
        state.pair_flags[t, 1] = work.contact_before[s] % 2
        for a in range(state.pair_impulse.shape[1]):
            state.pair_impulse[t, a] = work.contact_impulse[s, a]
        for a in range(2 * model.dimension):
            state.pair_action[t, a] = work.contact_gradient[s, a]
