"""Gaps and slips of two bodies of sharp hulls, called as kernels of formulas are.

Contacts of two parts are the vertices of the second at the first, those of the first at the second,
and in space every edge of the first with every edge of the second.

The *gap* of a vertex is its greatest height over the faces of the other part: negative inside, and
outside a bound of the distance that vanishes with it.  That of two edges is the distance of the
points where they cross, seen along the normal of the plane between the parts, or by how much they
miss each other there, if that is more.  So gaps are continuous as long as the plane is the same,
and none is small where nothing touches.  What is beside a face, or misses an edge, by no more than
is a plane through both, counts as over it: where corners lie on corners, as in a stack, load does
not pass from one to the other with every shift by a rounding error.  All close and slip along the
one plane between the parts (:mod:`~polycorner.motion.hulls.planes`), at the point of the vertex or
edge.  Where parts overlap and no gap says so, the contact of the plane itself, a face and the
vertex that is deepest or two edges, has the height of the plane.  Parts that are far from each
other have one contact, the first, of the height of the plane at the vertex that is nearest to it:
so no body passes through another, however fast it is.

Rows: in the plane, velocities that keep both ends of the overlap of two parallel faces from closing
keep all of it from closing, since the velocity along the normal is affine on it.  In space the
overlap of two faces is a polygon whose corners are vertices of one over the other and crossings of
edges.
"""

import numpy as np

from polycorner.formulas.compilation import call_kernel
from polycorner.motion.hulls.geometry import (
    CONTACTS,
    DIMENSION,
    EDGES,
    FACES,
    GRADIENTS,
    HEAD,
    ONE,
    PAIR,
    PAIRS,
    PERIODS,
    THICKNESS,
    THROUGH,
    TWO,
    VALUES,
    VERTICES,
    ZERO,
    add_motion,
    back,
    beyond,
    cross,
    dot,
    edge_at,
    face_at,
    place,
    relative,
    scaled,
    triple,
    turned,
    vertex_at,
    whole,
)
from polycorner.motion.hulls.memory import compiled, get, put
from polycorner.motion.hulls.planes import FIRST, SECOND, is_far, plane_between

# What slips keep for the next contact: which table and parts, the coordinates, and what follows
# from these: rotations, a shift and a normal.  The number before is that of the limit of gaps.
TABLE, PARTS, PLACE, FRAMES = 1, 2, 3, 17

# How gradients are written: those of infinite gaps not at all, or none is infinite.
PAIR_SLOPES, OWN_SLOPES = np.int64(1), np.int64(2)


@compiled
def places(q, table):
    """Return where both bodies are, of the second the image that is nearest to the first."""
    d, one, two = whole(table, DIMENSION), whole(table, ONE), whole(table, TWO)
    m, c = place(q, np.int64(0), one, d)
    n, e = place(q, one, two, d)
    x, y, z = e
    period = triple(table, PERIODS)
    if period[0] > 0.0:
        x -= period[0] * np.floor((x - c[0]) / period[0] + 0.5)
    if period[1] > 0.0:
        y -= period[1] * np.floor((y - c[1]) / period[1] + 0.5)
    if period[2] > 0.0:
        z -= period[2] * np.floor((z - c[2]) / period[2] + 0.5)
    return m, n, relative(m, n), back(m, beyond((x, y, z), -1.0, c))


@compiled
def parts_of(table, s):
    """Return where both parts of a pair of parts are in a table, and their first contact."""
    at = HEAD + PAIR * s
    return whole(table, at), whole(table, at + 1), whole(table, at + 2)


@compiled
def vertex_gap(table, part, x, normal, height):
    """Return the gap of a point at a part, out of which a normal points; all in its coordinates.

    ``height`` is that of the plane between the parts.
    """
    most, along, nearest = -np.inf, 0.0, -np.inf
    for f in range(whole(table, part + FACES)):
        at = face_at(table, part, f)
        n = triple(table, at)
        above = dot(n, x) - get(table, at + 3)
        most = max(most, above)
        if dot(n, normal) > nearest:
            along, nearest = above, dot(n, normal)
    slack = get(table, THROUGH)
    return along if most <= slack and along >= min(height, 0.0) - slack else most


@compiled
def faces_along(table, at, normal):
    """Return whether a face beside an edge faces along a direction."""
    return max(dot(triple(table, at + 6), normal), dot(triple(table, at + 9), normal)) > 0.0


@compiled
def edge_gap(table, p, u, q, v, normal):
    """Return the gap of two edges, and where the first meets the second, from 0 to 1."""
    w, r, zero = cross(u, v), beyond(q, -1.0, p), get(table, ZERO)
    size, uu, vv = dot(w, normal), dot(u, u), dot(v, v)
    # Edges that are parallel, as seen along the normal, meet in their ends, which are vertices.
    if size * size <= zero * zero * max(uu, vv):
        return np.inf, 0.0
    s, t = dot(cross(r, v), normal) / size, dot(cross(r, u), normal) / size
    missed = abs(size) * max(max(-s, s - 1.0) / np.sqrt(vv), max(-t, t - 1.0) / np.sqrt(uu))
    # Of nearly parallel edges lines cross far away: heights are those of points of the edges.
    s, t = min(max(s, 0.0), 1.0), min(max(t, 0.0), 1.0)
    apart = dot(normal, beyond(beyond(r, t, v), -s, u))
    if missed > get(table, THROUGH):
        apart = max(apart, missed)
    return apart, s


@compiled
def add_row(q, table, here, along, x, row, first):
    """Write how a contact at a point of the first body's coordinates opens along a direction."""
    m, n, r, t = here
    d, one, two = whole(table, DIMENSION), whole(table, ONE), whole(table, TWO)
    add_motion(q, np.int64(0), one, d, m, x, along, -1.0, row, first)
    local = back(r, beyond(x, -1.0, t))
    add_motion(q, one, two, d, n, local, along, 1.0, row, first + one)


@compiled
def point_of(table, here, one, two, normal, g):
    """Return the point of a contact, by its number among those of two parts."""
    _, _, r, t = here
    count, other = whole(table, two + VERTICES), whole(table, one + VERTICES)
    if g < count:
        return beyond(turned(r, triple(table, vertex_at(two, g))), 1.0, t)
    if g < count + other:
        return triple(table, vertex_at(one, g - count))
    a, b = divmod(g - count - other, whole(table, two + EDGES))
    at, there = edge_at(table, one, a), edge_at(table, two, b)
    x, u = triple(table, at), triple(table, at + 3)
    y, v = beyond(turned(r, triple(table, there)), 1.0, t), turned(r, triple(table, there + 3))
    _, meets = edge_gap(table, x, u, y, v, normal)
    return beyond(x, meets, u)


@compiled
def contacts_of(table, one, two):
    """Return how many contacts two parts have."""
    vertices = whole(table, one + VERTICES) + whole(table, two + VERTICES)
    return vertices + whole(table, one + EDGES) * whole(table, two + EDGES)


@compiled
def show_overlap(q, table, here, s, f, J, slopes):
    """Give the contact of the plane between two parts its height, which is negative.

    They overlap like two bars across each other, no corner inside.
    """
    m, _, r, t = here
    one, two, g = parts_of(table, s)
    height, normal, kind, i, j = plane_between(table, one, two, r, t)
    count, other = whole(table, two + VERTICES), whole(table, one + VERTICES)
    if kind == FIRST:
        slot = j
    elif kind == SECOND:
        slot = count + j
    else:
        slot = count + other + i * whole(table, two + EDGES) + j
    put(f, g + slot, height)
    if slopes:
        width = whole(table, ONE) + whole(table, TWO)
        x = point_of(table, here, one, two, normal, slot)
        add_row(q, table, here, turned(m, normal), x, J + 8 * width * (g + slot), np.int64(0))


@compiled
def is_wanted(wanted, g):
    """Return whether a gap is wanted, as all are if there are no numbers that say it."""
    return wanted == 0 or get(wanted, g) != 0.0


@compiled
def evaluate_parts(q, table, here, s, f, J, slopes, limit, wanted):
    """Write the gaps of two parts and, unless ``slopes`` is zero, gradients of those below a limit.

    If ``wanted`` is the address of numbers, gaps for which these are zero may be left out.
    """
    m, _, r, t = here
    one, two, g = parts_of(table, s)
    width = whole(table, ONE) + whole(table, TWO)
    height, normal, kind, _, j = plane_between(table, one, two, r, t)
    thickness = min(get(table, one + THICKNESS), get(table, two + THICKNESS))
    # Finite where curvature is measured: a contact that acts may be none at the next midpoint.
    none = np.inf if slopes == PAIR_SLOPES else thickness + max(height, 0.0)
    if is_far(table, one, two, height):
        for a in range(contacts_of(table, one, two)):
            put(f, g + a, none)
        slot = j if kind == FIRST else whole(table, two + VERTICES) + j
        put(f, g, height)
        if slopes and height < limit:
            x = point_of(table, here, one, two, normal, slot)
            add_row(q, table, here, turned(m, normal), x, J + 8 * width * g, np.int64(0))
        return
    # Whether any gap says that parts overlap is known only when all are.
    deep = height < -get(table, THROUGH)
    wanted = np.int64(0) if deep else wanted
    along, inward, least = turned(m, normal), scaled(-1.0, back(r, normal)), np.inf
    for v in range(whole(table, two + VERTICES)):
        if is_wanted(wanted, g):
            x = beyond(turned(r, triple(table, vertex_at(two, v))), 1.0, t)
            gap = vertex_gap(table, one, x, normal, height)
            least = min(least, gap)
            put(f, g, gap)
            if slopes and gap < limit:
                add_row(q, table, here, along, x, J + 8 * width * g, np.int64(0))
        g += 1
    for v in range(whole(table, one + VERTICES)):
        if is_wanted(wanted, g):
            x = triple(table, vertex_at(one, v))
            gap = vertex_gap(table, two, back(r, beyond(x, -1.0, t)), inward, height)
            least = min(least, gap)
            put(f, g, gap)
            if slopes and gap < limit:
                add_row(q, table, here, along, x, J + 8 * width * g, np.int64(0))
        g += 1
    edges, others = whole(table, one + EDGES), whole(table, two + EDGES)
    for b in range(others):
        at = edge_at(table, two, b)
        other = faces_along(table, at, inward)
        y, v = beyond(turned(r, triple(table, at)), 1.0, t), turned(r, triple(table, at + 3))
        for a in range(edges):
            at, slot, gap, meets = edge_at(table, one, a), g + a * others + b, np.inf, 0.0
            if other and is_wanted(wanted, slot) and faces_along(table, at, normal):
                x, u = triple(table, at), triple(table, at + 3)
                gap, meets = edge_gap(table, x, u, y, v, normal)
                least = min(least, gap)
                if slopes and gap < limit:
                    x = beyond(x, meets, u)
                    add_row(q, table, here, along, x, J + 8 * width * slot, np.int64(0))
            put(f, slot, min(gap, none))
    if deep and least > 0.0:
        show_overlap(q, table, here, s, f, J, slopes)


@compiled
def gaps(q, table, f, J, slopes, limit, wanted):
    """Write the gaps of two bodies, and their gradients unless ``slopes`` is zero."""
    here = places(q, table)
    for s in range(whole(table, PAIRS)):
        evaluate_parts(q, table, here, s, f, J, slopes, limit, wanted)
    formulas = whole(table, GRADIENTS if slopes else VALUES)
    if formulas != 0:
        count = whole(table, CONTACTS)
        width = whole(table, ONE) + whole(table, TWO)
        call_kernel(formulas, q, table, f + 8 * count, J + 8 * width * count, q)
    return 0


@compiled
def values(q, table, f, J, H):
    """Write the gaps of two bodies, at least those for which the numbers at ``H`` are not zero."""
    return gaps(q, table, f, J, np.int64(0), np.inf, H)


@compiled
def gradients(q, table, f, J, H):
    """Write the gaps of two bodies, and the gradients of those below the number at ``H``, if any.

    Infinite gaps have none.
    """
    limit = np.inf if H == 0 else get(H, np.int64(0))
    return gaps(q, table, f, J, PAIR_SLOPES, limit, np.int64(0))


@compiled
def finite(q, table, f, J, H):
    """Write the gaps of two bodies, none of which is infinite, and their gradients."""
    width = whole(table, ONE) + whole(table, TWO)
    for a in range(width * whole(table, CONTACTS)):
        put(J, np.int64(a), 0.0)
    return gaps(q, table, f, J, OWN_SLOPES, np.inf, np.int64(0))


@compiled
def tangent(normal, d, which):
    """Return a tangent of a normal: in the plane, it turned left; in space as in [Duff]."""
    x, y, z = normal
    if d == 2:
        return -y, x, 0.0
    side = 1.0 if z >= 0.0 else -1.0
    a = -1.0 / (side + z)
    if which == 0:
        return 1.0 + side * x * x * a, side * x * y * a, -side * x
    return x * y * a, side + y * y * a, -y


@compiled
def add_slip(q, table, here, normal, x, f, J, row):
    """Write the slip at a point, and its derivatives by velocities, into rows from one on."""
    d, reads = whole(table, DIMENSION), whole(table, ONE) + whole(table, TWO)
    for c in range(d - 1):
        at = J + 8 * 2 * reads * (row + c)
        add_row(q, table, here, tangent(normal, d, c), x, at, reads)
        slip = 0.0
        for a in range(reads, 2 * reads):
            slip += get(at, np.int64(a)) * get(q, np.int64(a))
        put(f, np.int64(row + c), slip)


@compiled
def nine(numbers, at):
    """Return the nine numbers of a matrix."""
    x, y, z = triple(numbers, at), triple(numbers, at + 3), triple(numbers, at + 6)
    return x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]


@compiled
def is_kept(q, table, s, kept):
    """Return whether what is kept is of these two parts where they are."""
    if get(kept, np.int64(PARTS)) != s or get(kept, np.int64(TABLE)) != table:
        return False
    for a in range(whole(table, ONE) + whole(table, TWO)):
        if get(kept, np.int64(PLACE + a)) != get(q, np.int64(a)):
            return False
    return True


@compiled
def placed_parts(q, table, s, kept):
    """Return where both bodies are, and the normal of the plane between two of their parts.

    They are the same for all contacts of these: the last ones are ``kept`` at an address.
    """
    if kept != 0 and is_kept(q, table, s, kept):
        here = nine(kept, FRAMES), nine(kept, FRAMES + 9), nine(kept, FRAMES + 18)
        return (*here, triple(kept, FRAMES + 27)), triple(kept, FRAMES + 30)
    here = places(q, table)
    m, n, r, t = here
    one, two, _ = parts_of(table, s)
    _, normal, _, _, _ = plane_between(table, one, two, r, t)
    if kept != 0:
        put(kept, np.int64(TABLE), np.float64(table))
        put(kept, np.int64(PARTS), np.float64(s))
        for a in range(whole(table, ONE) + whole(table, TWO)):
            put(kept, np.int64(PLACE + a), get(q, np.int64(a)))
        numbers = (*m, *n, *r, *t, *normal)
        for a in range(len(numbers)):
            put(kept, np.int64(FRAMES + a), numbers[a])
    return here, normal


@compiled
def slips(q, entry, f, J, H):
    """Write the slip velocities at a contact, and their derivatives by velocities.

    The entry of a contact has its number, and by how many numbers the table begins before; at
    ``H``, unless that is 0, there is room for what its neighbours have in common with it.
    """
    table, g = entry - 8 * whole(entry, 1), whole(entry, 0)
    s = whole(table, PAIRS) - 1
    while s > 0 and whole(table, HEAD + PAIR * s + 2) > g:
        s -= 1
    one, two, first = parts_of(table, s)
    here, normal = placed_parts(q, table, np.int64(s), H)
    x = point_of(table, here, one, two, normal, g - first)
    add_slip(q, table, here, turned(here[0], normal), x, f, J, np.int64(0))
    return 0


@compiled
def all_slips(q, table, f, J, H):
    """Write the slip velocities at all contacts; zero where parts are far from each other."""
    here, rows = places(q, table), whole(table, DIMENSION) - 1
    m, _, r, t = here
    count = whole(table, CONTACTS)
    for a in range(rows * count):
        put(f, np.int64(a), 0.0)
    for a in range(rows * count * 2 * (whole(table, ONE) + whole(table, TWO))):
        put(J, np.int64(a), 0.0)
    for s in range(whole(table, PAIRS)):
        one, two, first = parts_of(table, s)
        height, normal, _, _, _ = plane_between(table, one, two, r, t)
        if is_far(table, one, two, height):
            continue
        for g in range(contacts_of(table, one, two)):
            x = point_of(table, here, one, two, normal, g)
            add_slip(q, table, here, turned(m, normal), x, f, J, rows * (first + g))
    return 0
