"""Partition of the blocks of a step into islands of touching bodies."""

import numpy as np

from polycorner.motion.engine.jit import NONE, ZERO, compiled

LARGE = 48  # blocks of an island beyond which impacts need not be located


@compiled
def is_large(island, i):
    """Return whether impacts need not be located in the island that a body represents."""
    return island.start[i + 1] - island.start[i] > LARGE


@compiled
def root_of(root, i):
    """Return the representative of a body in the union-find forest."""
    while root[i] != i:
        # Halving the path keeps the forest flat without a second pass or ranks.
        root[i] = root[root[i]]
        i = root[i]
    return i


@compiled
def is_pressed_by_former(block, b):
    """Return whether a block is friction on which the block before it presses."""
    return block.rows[b] > 0 and block.pressing[b] == b - 1 and b > 0


@compiled
def island_of(body, island, block, b):
    """Return the island of a block: that of one of its bodies that is awake."""
    first = block.bodies[b, 0]
    return island.parent[first if body.awake[first] else block.bodies[b, 1]]


@compiled
def find_islands(model, body, island, block, blocks):
    """Order the blocks by islands of touching bodies, which start at ``island.start``."""
    N = model.bodies
    for i in range(N):
        island.parent[i] = i
    for b in range(blocks):
        if block.rows[b] > 0:
            continue  # friction between bodies acts where a contact presses
        i, j = block.bodies[b, 0], block.bodies[b, 1]
        if j >= 0 and body.awake[i] and body.awake[j]:
            x, y = root_of(island.parent, i), root_of(island.parent, j)
            if x != y:
                island.parent[max(x, y)] = min(x, y)
    for t in range(model.ties):
        # Also where they have no block: forces of ties depend on both bodies.
        i, j = model.tie_bodies[t, 0], model.tie_bodies[t, 1]
        if j >= 0 and body.awake[i] and body.awake[j]:
            x, y = root_of(island.parent, i), root_of(island.parent, j)
            island.parent[max(x, y)] = min(x, y)
    starts, cursor = island.start, island.cursor
    starts[0] = 0
    for i in range(N):
        starts[i + 1] = 0
    for i in range(N):
        island.parent[i] = root_of(island.parent, i)
    r = last = begin = ZERO
    for b in range(blocks):
        if not is_pressed_by_former(block, b):  # friction is of the same island
            r = island_of(body, island, block, b)
        island.unsorted[b] = r
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
        r = island.unsorted[b]
        if r != last:
            if last >= 0:
                cursor[last] = place
            last, place = r, cursor[r]
        block.order[place] = b
        place += 1
