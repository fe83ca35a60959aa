"""The order in which the bodies of an island are eliminated: that of minimum degree.

The bodies are the vertices of a graph, and those that touch are joined.  To eliminate a body joins
its neighbours with each other: what is joined to it then are the entries of its rows right of the
diagonal.  The body with the fewest neighbours is next ([GL]).
"""

from polycorner.motion.engine.jit import NONE, ONE, ZERO, compiled


@compiled
def list_bodies(body, block, graph, matrix, first, last):
    """List the awake bodies of an island in ``graph.listed``, numbered as listed; return how many.

    Bodies without blocks are not listed.
    """
    n = ZERO
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i >= 0:
                matrix.number[i] = NONE
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i >= 0 and body.awake[i] and matrix.number[i] < 0:
                graph.listed[n], matrix.number[i] = i, n
                n += ONE
    return n


@compiled
def find_neighbours(body, block, graph, matrix, first, last, n):
    """Join the bodies that share blocks; return whether there is room."""
    for v in range(n):
        graph.first_neighbour[v], graph.degree[v], graph.mark[v] = NONE, ZERO, NONE
    graph.link_status[0], graph.link_status[1] = NONE, ZERO
    x = y = NONE
    for s in range(first, last):
        b = block.order[s]
        i, j = block.bodies[b, 0], block.bodies[b, 1]
        if j < 0 or not (body.awake[i] and body.awake[j]):
            continue
        low = min(matrix.number[i], matrix.number[j])
        high = max(matrix.number[i], matrix.number[j])
        # The blocks of one contact follow each other; they need no look at the links.
        if low == x and high == y:
            continue
        x, y = low, high
        at = graph.first_neighbour[x]
        while at >= 0 and graph.link[at, 0] != y:
            at = graph.link[at, 1]
        if at < 0 and not (join(graph, x, y) and join(graph, y, x)):
            return False
    return True


@compiled
def join(graph, x, y):
    """Make ``y`` a neighbour of ``x``; return whether there is room."""
    at = graph.link_status[0]
    if at >= 0:
        graph.link_status[0] = graph.link[at, 1]
    else:
        at = graph.link_status[1]
        if 2 * at == graph.link.size:
            return False
        graph.link_status[1] += ONE
    graph.link[at, 0], graph.link[at, 1] = y, graph.first_neighbour[x]
    graph.first_neighbour[x] = at
    graph.degree[x] += ONE
    return True


@compiled
def enqueue(graph, v):
    """Put a vertex among those of its degree."""
    d = graph.degree[v]
    after = graph.first_of_degree[d]
    graph.queue[v, 0], graph.queue[v, 1] = NONE, after
    if after >= 0:
        graph.queue[after, 0] = v
    graph.first_of_degree[d] = v


@compiled
def dequeue(graph, v):
    """Take a vertex from those of its degree."""
    before, after = graph.queue[v, 0], graph.queue[v, 1]
    if before >= 0:
        graph.queue[before, 1] = after
    else:
        graph.first_of_degree[graph.degree[v]] = after
    if after >= 0:
        graph.queue[after, 0] = before


@compiled
def take_least(graph, low):
    """Take a vertex of the least degree, which is not below ``low``; return both."""
    while graph.first_of_degree[low] < 0:
        low += ONE
    v = graph.first_of_degree[low]
    dequeue(graph, v)
    return v, low


@compiled
def release(graph, matrix, v, row):
    """List the neighbours of a vertex from place ``row`` on, and free its links.

    Return where the list ends, or -1 if there is no room.
    """
    at = graph.first_neighbour[v]
    while at >= 0:
        if row == matrix.columns.size:
            return NONE
        following = graph.link[at, 1]
        matrix.columns[row] = graph.link[at, 0]
        graph.link[at, 1], graph.link_status[0] = graph.link_status[0], at
        row += ONE
        at = following
    return row


@compiled
def fill_in(graph, matrix, v, u, begin, end):
    """Join a neighbour ``u`` of ``v`` with the others, and part it from ``v``.

    The neighbours of ``v`` are listed between these places.  Return whether there is room.
    """
    before, at = NONE, graph.first_neighbour[u]
    while at >= 0:
        following = graph.link[at, 1]
        if graph.link[at, 0] == v:
            if before < 0:
                graph.first_neighbour[u] = following
            else:
                graph.link[before, 1] = following
            graph.link[at, 1], graph.link_status[0] = graph.link_status[0], at
        else:
            graph.mark[graph.link[at, 0]] = u
            before = at
        at = following
    graph.degree[u] -= ONE
    graph.mark[u] = u
    for t in range(begin, end):
        w = matrix.columns[t]
        if graph.mark[w] != u and not join(graph, u, w):
            return False
    return True


@compiled
def eliminate_all(graph, matrix, n):
    """Order vertices, and list the entries of rows right of the diagonal; return if there is room.

    ``matrix.place`` gets the place of each, and row ``p`` the columns between ``row_start[p]`` and
    ``row_start[p + 1]``, which are places in ascending order.
    """
    for d in range(n):
        graph.first_of_degree[d] = NONE
    # Backwards, so that of equal degrees the first is on top: the order does not depend on what was
    # here before.
    for v in range(n - 1, -1, -1):
        enqueue(graph, v)
    low = end = ZERO
    for p in range(n):
        v, low = take_least(graph, low)
        begin = end
        end = release(graph, matrix, v, begin)
        if end < 0:
            return False
        matrix.place[v], matrix.row_start[p], matrix.row_start[p + 1] = p, begin, end
        for t in range(begin, end):
            u = matrix.columns[t]
            dequeue(graph, u)
            if not fill_in(graph, matrix, v, u, begin, end):
                return False
            enqueue(graph, u)
            # A degree falls by one at most when a neighbour goes, so that the search for the least
            # one hardly ever starts anew.
            low = min(low, graph.degree[u])
    for p in range(n):
        sort_row(matrix, matrix.row_start[p], matrix.row_start[p + 1])
    return True


@compiled
def sort_row(matrix, begin, end):
    """Turn the vertices of a row into their places, and sort them."""
    for s in range(begin, end):
        value, t = matrix.place[matrix.columns[s]], s
        while t > begin and matrix.columns[t - 1] > value:
            matrix.columns[t] = matrix.columns[t - 1]
            t -= 1
        matrix.columns[t] = value
