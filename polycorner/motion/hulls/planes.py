"""The plane that separates two hulls, or nearly does.

By the separating axis theorem two convex hulls ``A`` and ``B`` do not overlap if and only if one of
finitely many planes separates them: that of a face of one of them or, in space, one along an edge
of each ([Er] ch. 4).  The *height* of a plane with the normal ``n`` from ``A`` to ``B`` is ``min
n.b - max n.a``.  For a face it takes one look at the other's vertices.  A pair of edges has a plane
of its own if and only if the arcs of their normals cross on the sphere of directions, those of
``B`` reversed: then the edges span a face of the difference ``B - A`` (the Gauss map,
[Gregorius]).  The greatest of all heights is at most the distance of the hulls, and vanishes with
it; where they overlap it is minus the depth, the length of the shortest way apart.

The placements without overlap are a *union*: one of the planes has a height that is not negative.
What moves follows one piece of the union at a time, as with the common plane of [Cundall] or one
branch of the disjunction of [WLT].  The piece is chosen anew wherever gaps are evaluated, by the
placement alone, so that nothing has to be kept.  It is

- a plane through both hulls, of the height zero up to rounding.  As long as it separates, what
  touches there may slide, also across the seam of two bodies side by side, whose sides have greater
  heights but say nothing.  Of several planes, as where a vertex meets a vertex, it is that whose
  normal is nearest to the direction between the centres, and of equal ones the first: there motion
  is not unique, and this is a choice;
- otherwise the plane of the greatest height, of faces before edges and the first of equal ones.
"""

import numpy as np

from polycorner.motion.hulls.geometry import (
    CENTRE,
    DIMENSION,
    EDGES,
    FACES,
    THICKNESS,
    THROUGH,
    VERTICES,
    back,
    beyond,
    cross,
    dot,
    edge_at,
    face_at,
    scaled,
    triple,
    turned,
    vertex_at,
    whole,
)
from polycorner.motion.hulls.memory import compiled, get

# What a plane is of: a face of the first or of the second, or an edge of each.
FIRST, SECOND, BOTH = np.int64(0), np.int64(1), np.int64(2)


NEARBY = 0.125  # height up to which parts are near each other, of half the lesser thickness


@compiled
def is_far(table, one, two, height):
    """Return whether a plane of a height keeps two parts far from each other."""
    return height > NEARBY * min(get(table, one + THICKNESS), get(table, two + THICKNESS))


@compiled
def lowest(table, part, normal):
    """Return the least product of a vector with the vertices of a part, and its vertex."""
    least, where = np.inf, np.int64(0)
    for i in range(whole(table, part + VERTICES)):
        height = dot(normal, triple(table, vertex_at(part, i)))
        if height < least:
            least, where = height, np.int64(i)
    return least, where


@compiled
def plane_between(table, one, two, m, t):
    """Return height, normal, kind and numbers of features of the plane between two parts.

    The rotation ``m`` and the shift ``t`` carry the second into the coordinates of the first, in
    which the normal is, from the first to the second.  The numbers are a face and the vertex of the
    other part that is nearest, or two edges.
    """
    slack = get(table, THROUGH)
    toward = beyond(
        beyond(turned(m, triple(table, two + CENTRE)), 1.0, t), -1.0, triple(table, one + CENTRE)
    )
    best, normal, kind, i, j = -np.inf, (0.0, 0.0, 0.0), FIRST, np.int64(0), np.int64(0)
    through, nearest = False, -np.inf
    for side in (FIRST, SECOND):
        part, other = (one, two) if side == FIRST else (two, one)
        for f in range(whole(table, part + FACES)):
            at = face_at(table, part, f)
            n, level = triple(table, at), get(table, at + 3)
            if side == FIRST:
                height, v = lowest(table, other, back(m, n))
                height, out = height + dot(n, t) - level, n
            else:
                along = turned(m, n)
                height, v = lowest(table, other, along)
                height, out = height - dot(along, t) - level, scaled(-1.0, along)
            if abs(height) <= slack:
                better = not through or dot(out, toward) > nearest
                through = True
            else:
                better = not through and height > best
            if better:
                best, normal, kind, i, j = height, out, side, np.int64(f), v
                nearest = dot(out, toward)
    far = is_far(table, one, two, best)
    if not (through or far) and get(table, DIMENSION) == 3.0:
        return edges_between(table, one, two, m, t, best + slack, (best, normal, kind, i, j))
    return best, normal, kind, i, j


@compiled
def edges_between(table, one, two, m, t, limit, found):
    """Return the plane along two edges that is higher than a limit, or else the one found."""
    centre = triple(table, one + CENTRE)
    for g in range(whole(table, two + EDGES)):
        at = edge_at(table, two, g)
        v = turned(m, triple(table, at + 3))
        c, d = turned(m, triple(table, at + 6)), turned(m, triple(table, at + 9))
        q = beyond(turned(m, triple(table, at)), 1.0, t)
        for e in range(whole(table, one + EDGES)):
            at = edge_at(table, one, e)
            u, a, b = triple(table, at + 3), triple(table, at + 6), triple(table, at + 9)
            cu, bv = dot(c, u), dot(b, v)
            if not (cu * dot(d, u) < 0.0 and dot(a, v) * bv < 0.0 and cu * bv < 0.0):
                continue
            w = cross(u, v)
            p, size = triple(table, at), np.sqrt(dot(w, w))
            if dot(w, beyond(p, -1.0, centre)) < 0.0:
                size = -size
            if size == 0.0:
                continue
            n = scaled(1.0 / size, w)
            height = dot(n, beyond(q, -1.0, p))
            if height > limit:
                limit, found = height, (height, n, BOTH, np.int64(e), np.int64(g))
    return found
