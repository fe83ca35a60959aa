"""The order in which the bodies of an island are eliminated: that of minimum degree.

The bodies are the vertices of a graph, and those that touch are joined.  To eliminate a body joins
its neighbours with each other: what is joined to it then are the entries of its rows right of the
diagonal.  The body with the fewest neighbours is next ([GL]).
"""

from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled


@compiled
def list_bodies(work, first, last):
    """List the awake bodies of an island in ``work.listed``, numbered as listed; return how many.

    Bodies without blocks are not listed.
    """
    n = ZERO
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i >= 0:
                work.number[i] = NONE
    for s in range(first, last):
        for side in range(2):
            i = work.block_bodies[work.order[s], side]
            if i >= 0 and work.awake[i] and work.number[i] < 0:
                work.listed[n], work.number[i] = i, n
                n += ONE
    return n


@compiled
def find_neighbours(work, first, last, n):
    """Join the bodies that share blocks; return whether there is room."""
    for v in range(n):
        work.first_neighbour[v], work.degree[v], work.mark[v] = NONE, ZERO, NONE
    work.link_status[0], work.link_status[1] = NONE, ZERO
    x = y = NONE
    for s in range(first, last):
        b = work.order[s]
        i, j = work.block_bodies[b, 0], work.block_bodies[b, 1]
        if j < 0 or not (work.awake[i] and work.awake[j]):
            continue
        low = min(work.number[i], work.number[j])
        high = max(work.number[i], work.number[j])
        if low == x and high == y:
            continue
        x, y = low, high
        at = work.first_neighbour[x]
        while at >= 0 and work.link[at, 0] != y:
            at = work.link[at, 1]
        if at < 0 and not (join(work, x, y) and join(work, y, x)):
            return False
    return True


@compiled
def join(work, x, y):
    """Make ``y`` a neighbour of ``x``; return whether there is room."""
    at = work.link_status[0]
    if at >= 0:
        work.link_status[0] = work.link[at, 1]
    else:
        at = work.link_status[1]
        if 2 * at == work.link.size:
            return False
        work.link_status[1] += ONE
    work.link[at, 0], work.link[at, 1] = y, work.first_neighbour[x]
    work.first_neighbour[x] = at
    work.degree[x] += ONE
    return True


@compiled
def enqueue(work, v):
    """Put a vertex among those of its degree."""
    d = work.degree[v]
    after = work.first_of_degree[d]
    work.queue[v, 0], work.queue[v, 1] = NONE, after
    if after >= 0:
        work.queue[after, 0] = v
    work.first_of_degree[d] = v


@compiled
def dequeue(work, v):
    """Take a vertex from those of its degree."""
    before, after = work.queue[v, 0], work.queue[v, 1]
    if before >= 0:
        work.queue[before, 1] = after
    else:
        work.first_of_degree[work.degree[v]] = after
    if after >= 0:
        work.queue[after, 0] = before


@compiled
def take_least(work, low):
    """Take a vertex of the least degree, which is not below ``low``; return both."""
    while work.first_of_degree[low] < 0:
        low += ONE
    v = work.first_of_degree[low]
    dequeue(work, v)
    return v, low


@compiled
def release(work, v, row):
    """List the neighbours of a vertex from place ``row`` on, and free its links.

    Return where the list ends, or -1 if there is no room.
    """
    at = work.first_neighbour[v]
    while at >= 0:
        if row == work.columns.size:
            return NONE
        following = work.link[at, 1]
        work.columns[row] = work.link[at, 0]
        work.link[at, 1], work.link_status[0] = work.link_status[0], at
        row += ONE
        at = following
    return row


@compiled
def fill_in(work, v, u, begin, end):
    """Join a neighbour ``u`` of ``v`` with the others, and part it from ``v``.

    The neighbours of ``v`` are listed between these places.  Return whether there is room.
    """
    before, at = NONE, work.first_neighbour[u]
    while at >= 0:
        following = work.link[at, 1]
        if work.link[at, 0] == v:
            if before < 0:
                work.first_neighbour[u] = following
            else:
                work.link[before, 1] = following
            work.link[at, 1], work.link_status[0] = work.link_status[0], at
        else:
            work.mark[work.link[at, 0]] = u
            before = at
        at = following
    work.degree[u] -= ONE
    work.mark[u] = u
    for t in range(begin, end):
        w = work.columns[t]
        if work.mark[w] != u and not join(work, u, w):
            return False
    return True


@compiled
def eliminate_all(work, n):
    """Order vertices, and list the entries of rows right of the diagonal; return if there is room.

    ``work.place`` gets the place of each, and row ``p`` the columns between ``row_start[p]`` and
    ``row_start[p + 1]``, which are places in ascending order.
    """
    for d in range(n):
        work.first_of_degree[d] = NONE
    for v in range(n - 1, -1, -1):
        enqueue(work, v)
    low = end = ZERO
    for p in range(n):
        v, low = take_least(work, low)
        begin = end
        end = release(work, v, begin)
        if end < 0:
            return False
        work.place[v], work.row_start[p], work.row_start[p + 1] = p, begin, end
        for t in range(begin, end):
            u = work.columns[t]
            dequeue(work, u)
            if not fill_in(work, v, u, begin, end):
                return False
            enqueue(work, u)
            low = min(low, work.degree[u])
    for p in range(n):
        sort_row(work, work.row_start[p], work.row_start[p + 1])
    return True


@compiled
def sort_row(work, begin, end):
    """Turn the vertices of a row into their places, and sort them."""
    for s in range(begin, end):
        value, t = work.place[work.columns[s]], s
        while t > begin and work.columns[t - 1] > value:
            work.columns[t] = work.columns[t - 1]
            t -= 1
        work.columns[t] = value
