"""List of neighbours: pairs of bodies that may meet within some steps."""

import numpy as np

from polycorner.motion.engine.families import family_of
from polycorner.motion.engine.jit import NONE, ZERO, compiled
from polycorner.motion.engine.neighbours import nearest, position_of, travel
from polycorner.motion.engine.ties import are_apart

SKIN = 0.4  # relative width by which the neighbour list exceeds the reach of bodies
MANY = 256  # bodies that are searched for neighbours column by column
FARTHEST = 1e9  # column


@compiled
def outdated(model, state, body, neighbours, h, time):
    """Return whether a body has moved so far that the neighbour list may lack a pair."""
    if neighbours.status[1] == 0 or travel(model, body, h) > neighbours.travel[0]:
        return True
    # A quarter of the skin for each of two bodies; the other half is for what they travel within
    # the step.
    limit = (0.25 * SKIN * model.reach) ** 2
    for i in range(model.bodies):
        if state.alive[i]:
            far = 0.0
            for a in range(3):
                x = position_of(model, state, i, a, time) - neighbours.position[i, a]
                far += nearest(model, a, x) ** 2
            if far > limit:
                return True
    return False


@compiled
def ahead(period, along, around):
    """Return whether a body is nearer in the other direction; at half a period one counts."""
    return 2.0 * along > period or (around and 2.0 * along == period)


@compiled
def list_neighbours(model, state, body, island, neighbours, pair, h, time):
    """List the pairs of bodies that may meet soon, ascending; return whether there was room.

    Many bodies are divided into columns, which are searched one by one, each with the next one.
    Where positions repeat, there is one column, in which the first bodies follow the last ones, up
    to half a period ahead.
    """
    N = model.bodies
    # Twice the present travel, so that a body that gets faster does not make every step list anew.
    neighbours.travel[0] = max(0.125 * SKIN * model.reach, 2.0 * travel(model, body, h))
    for i in range(N):
        for a in range(3):
            neighbours.position[i, a] = nearest(model, a, position_of(model, state, i, a, time))
    far = model.reach * (1.0 + SKIN) + max(
        0.0, 2.0 * neighbours.travel[0] - 0.25 * SKIN * model.reach
    )
    divide_into_columns(model, neighbours, far)
    sort_by_columns(neighbours, N)
    count = begin = ZERO
    while begin < N and count >= 0:
        end = end_of_column(neighbours, begin, N)
        count = search_column(model, state, neighbours, begin, end, far, count)
        begin = end
    if count < 0:
        return False
    sort_pairs(state, island, neighbours, pair, N, count)
    neighbours.status[0], neighbours.status[1] = count, 1
    return True


@compiled
def sort_pairs(state, island, neighbours, pair, bodies, count):
    """Sort pairs of ranks, and replace them by the bodies, the one with the lower number first.

    Pairs are counted by the lower rank; the few higher ranks of each are sorted by insertion.
    """
    pairs, higher, cursor = neighbours.pairs, pair.sort_keys, island.cursor
    for one in range(bodies + 1):
        cursor[one] = 0
    for s in range(count):
        cursor[pairs[s, 0] + 1] += 1
    for one in range(bodies):
        cursor[one + 1] += cursor[one]
    for s in range(count):
        higher[cursor[pairs[s, 0]]] = pairs[s, 1]
        cursor[pairs[s, 0]] += 1
    begin = ZERO
    for one in range(bodies):
        for s in range(begin, cursor[one]):
            two, t = higher[s], s
            while t > begin and higher[t - 1] > two:
                higher[t] = higher[t - 1]
                t -= 1
            higher[t] = two
        for s in range(begin, cursor[one]):
            i, j = state.body_of_rank[one], state.body_of_rank[higher[s]]
            pairs[s, 0], pairs[s, 1] = min(i, j), max(i, j)
        begin = cursor[one]


@compiled
def divide_into_columns(model, neighbours, far):
    """Divide bodies into columns, wider than neighbours are apart, where there are many."""
    width = 2.0 * model.reach
    # Doubled rather than fitted: bodies then keep their columns while the list gets a little wider,
    # and remain nearly sorted.
    while width < far:
        width *= 2.0
    one = model.bodies < MANY or min(model.period[0], model.period[1]) < np.inf
    for i in range(model.bodies):
        x = neighbours.position[i, 0] / width
        neighbours.column[i] = ZERO if one or not abs(x) < FARTHEST else np.int64(np.floor(x))


@compiled
def sort_by_columns(neighbours, count):
    """Sort bodies by columns, and along the second axis in each of them.

    This is done by insertion, as they are nearly sorted from the last time.
    """
    ordered, position, column = neighbours.ordered, neighbours.position, neighbours.column
    # No order has the same body at both ends, except the zeros of a new array and that of a single
    # body.
    if ordered[0] == ordered[count - 1]:  # the first time
        for i in range(count):
            ordered[i] = i
    for s in range(count):
        i, t = ordered[s], s
        while t > 0:
            j = ordered[t - 1]
            if column[j] < column[i] or (
                column[j] == column[i] and position[j, 1] <= position[i, 1]
            ):
                break
            ordered[t] = j
            t -= 1
        ordered[t] = i


@compiled
def end_of_column(neighbours, begin, count):
    """Return where the column ends that begins at a place in the order."""
    end = begin
    while (
        end < count
        and neighbours.column[neighbours.ordered[end]]
        == neighbours.column[neighbours.ordered[begin]]
    ):
        end += 1
    return end


@compiled
def search_column(model, state, neighbours, begin, end, far, count):
    """Add the neighbours within a column, and between it and the next; return how many there are.

    If there is no room, that is -1.
    """
    ordered, position, period = neighbours.ordered, neighbours.position, model.period[1]
    size, low, last = end - begin, end, end
    if (
        end < model.bodies
        and neighbours.column[ordered[end]] == neighbours.column[ordered[begin]] + 1
    ):
        last = end_of_column(neighbours, end, model.bodies)
    for s in range(begin, end):
        i = ordered[s]
        for t in range(s + 1, s + size if period < np.inf else end):
            j = ordered[t if t < end else t - size]
            along = position[j, 1] - position[i, 1]
            if t >= end:
                along += period
            if along > far or ahead(period, along, t >= end):
                break
            count = add_if_near(model, state, neighbours, i, j, along, far, count)
        # Both columns ascend, so that the window in the next one only moves forward.
        while low < last and position[ordered[low], 1] < position[i, 1] - far:
            low += 1
        for t in range(low, last):
            j = ordered[t]
            along = position[j, 1] - position[i, 1]
            if along > far:
                break
            count = add_if_near(model, state, neighbours, i, j, along, far, count)
        if count < 0:
            break
    return count


@compiled
def add_if_near(model, state, neighbours, i, j, along, far, count):
    """Add the ranks of two neighbours, if they are; return how many pairs there are, or -1."""
    position, family = neighbours.position, family_of(model, i, j)
    across = nearest(model, 0, position[j, 0] - position[i, 0])
    above = nearest(model, 2, position[j, 2] - position[i, 2])
    # The list is made for the largest reach: that of other bodies is shorter by as much.
    far -= model.reach - model.pair_reach[family] if family >= 0 else np.inf
    near = far > 0.0 and across * across + along * along + above * above < far * far
    if count < 0 or not (near and state.alive[i] and state.alive[j]):
        return count
    if model.ties > 0 and are_apart(model, i, j):
        return count
    if count == model.neighbour_room:
        return NONE
    one, two = state.rank[i], state.rank[j]
    neighbours.pairs[count, 0], neighbours.pairs[count, 1] = min(one, two), max(one, two)
    return count + 1
