"""Places of bodies, vectors, and the entries of tables, for the compiled contacts of hulls."""

import numpy as np

from polycorner.motion.hulls.memory import compiled, get, put

# Entries of a table, and of a part in it.  Those before the parts: coordinates of either body, the
# height up to which a plane passes through both, the length that is none, the periods, dimension,
# number of contacts, addresses of formulas of further ones (values, gradients; or 0), number of
# pairs of parts, and of each pair the places of both parts and its first contact.
ONE, TWO, THROUGH, ZERO, PERIODS, DIMENSION = 0, 1, 2, 3, 4, 7
CONTACTS, VALUES, GRADIENTS, PAIRS, HEAD = 8, 9, 10, 11, 12
PAIR = 3  # numbers of a pair
VERTICES, FACES, EDGES, CENTRE, THICKNESS, SHAPE = 0, 1, 2, 3, 6, 7
FACE, EDGE = 4, 12  # numbers of a face: normal, height; of an edge: point, direction, two normals


@compiled
def whole(table, at):
    """Return a whole number of a table."""
    return np.int64(get(table, np.int64(at)))


@compiled
def triple(table, at):
    """Return a vector of a table."""
    at = np.int64(at)
    return get(table, at), get(table, at + 1), get(table, at + 2)


@compiled
def vertex_at(part, i):
    """Return where in a table a vertex of a part is."""
    return part + SHAPE + 3 * i


@compiled
def face_at(table, part, f):
    """Return where a face is."""
    return part + SHAPE + 3 * whole(table, part + VERTICES) + FACE * f


@compiled
def edge_at(table, part, e):
    """Return where an edge is."""
    return face_at(table, part, whole(table, part + FACES)) + EDGE * e


@compiled
def dot(a, b):
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a, b):
    """Return the vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@compiled
def beyond(a, t, b):
    """Return ``a + t b``."""
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


@compiled
def scaled(t, a):
    """Return ``t a``."""
    return t * a[0], t * a[1], t * a[2]


@compiled
def turned(m, v):
    """Return ``M v`` for a matrix of nine numbers, row by row."""
    return (
        m[0] * v[0] + m[1] * v[1] + m[2] * v[2],
        m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
        m[6] * v[0] + m[7] * v[1] + m[8] * v[2],
    )


@compiled
def back(m, v):
    """Return ``M' v``."""
    return (
        m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
        m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
        m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
    )


@compiled
def relative(m, n):
    """Return ``M' N``."""
    x = back(m, (n[0], n[3], n[6]))
    y = back(m, (n[1], n[4], n[7]))
    z = back(m, (n[2], n[5], n[8]))
    return x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]


@compiled
def place(q, at, count, dimension):
    """Return rotation and position of a body whose coordinates begin at a place.

    The rotation is that of the quaternion divided by its length, so that bodies keep their size
    between the steps of Newton's method.
    """
    m = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    c = 0.0, 0.0, 0.0
    if count > 0:
        c = get(q, at), get(q, at + 1), get(q, at + 2) if dimension == 3 else 0.0
    if count == 3 and dimension == 2:
        cosine, sine = np.cos(get(q, at + 2)), np.sin(get(q, at + 2))
        m = cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0
    if count == 7:
        w, x, y, z = get(q, at + 3), get(q, at + 4), get(q, at + 5), get(q, at + 6)
        s = 1.0 / (w * w + x * x + y * y + z * z)
        m = (
            s * (w * w + x * x - y * y - z * z),
            2.0 * s * (x * y - w * z),
            2.0 * s * (x * z + w * y),
            2.0 * s * (x * y + w * z),
            s * (w * w - x * x + y * y - z * z),
            2.0 * s * (y * z - w * x),
            2.0 * s * (x * z - w * y),
            2.0 * s * (y * z + w * x),
            s * (w * w - x * x - y * y + z * z),
        )
    return m, c


@compiled
def add_motion(q, at, count, dimension, m, local, along, sign, row, first):
    """Write how a point of a body moves along a direction, for every coordinate of the body.

    ``row`` is an address, ``first`` the index of the first coordinate there.
    """
    for c in range(min(count, dimension)):
        put(row, first + c, sign * along[c])
    if count == 3 and dimension == 2:
        r = turned(m, local)
        put(row, first + 2, sign * (along[1] * r[0] - along[0] * r[1]))
    if count == 7:
        w, u = get(q, at + 3), (get(q, at + 4), get(q, at + 5), get(q, at + 6))
        s = 1.0 / (w * w + dot(u, u))
        pn, un, up = dot(local, along), dot(u, along), dot(u, local)
        # Of N.R(a) p, with R of degree two in a, without the part along a.
        radial = dot(turned(m, local), along)
        f = 2.0 * sign * s
        put(row, first + 3, f * (w * pn + dot(along, cross(u, local)) - radial * w))
        across = cross(local, along)
        for c in range(3):
            value = un * local[c] + up * along[c] + w * across[c] - (pn + radial) * u[c]
            put(row, first + 3 + c + 1, f * value)
