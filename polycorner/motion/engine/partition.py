"""Partition of the blocks of a step into islands of touching bodies."""

import numpy as np

from polycorner.motion.engine.jit import NONE, ZERO, compiled


@compiled
def root_of(root, i):
    """Return the representative of a body in the union-find forest."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


@compiled
def is_pressed_by_former(work, b):
    """Return whether a block is friction on which the block before it presses."""
    return work.block_rows[b] > 0 and work.pressing[b] == b - 1 and b > 0


@compiled
def island_of(work, b):
    """Return the island of a block: that of one of its bodies that is awake."""
    first = work.block_bodies[b, 0]
    return work.parent[first if work.awake[first] else work.block_bodies[b, 1]]


@compiled
def find_islands(model, work, blocks):
    """Order the blocks by islands of touching bodies, which start at ``work.island_start``."""
    N = model.bodies
    for i in range(N):
        work.parent[i] = i
    for b in range(blocks):
        if work.block_rows[b] > 0:
            continue  # friction between bodies acts where a contact presses
        i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
        if j >= 0 and work.awake[i] and work.awake[j]:
            x, y = root_of(work.parent, i), root_of(work.parent, j)
            if x != y:
                work.parent[max(x, y)] = min(x, y)
    starts, cursor = work.island_start, work.cursor
    starts[0] = 0
    for i in range(N):
        starts[i + 1] = 0
    for i in range(N):
        work.parent[i] = root_of(work.parent, i)
    r = last = begin = ZERO
    for b in range(blocks):
        if not is_pressed_by_former(work, b):  # friction is of the same island
            r = island_of(work, b)
        work.unsorted[b] = r
        if r != last:  # many in a row are of one island
            starts[last + 1] += b - begin
            last, begin = r, np.int64(b)
    starts[last + 1] += blocks - begin
    for i in range(N):
        starts[i + 1] += starts[i]
    for i in range(N):
        cursor[i] = starts[i]
    last, place = NONE, ZERO
    for b in range(blocks):
        r = work.unsorted[b]
        if r != last:
            if last >= 0:
                cursor[last] = place
            last, place = r, cursor[r]
        work.order[place] = b
        place += 1
