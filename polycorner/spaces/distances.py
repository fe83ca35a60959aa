"""Distances between balls and rods, as SymPy expressions free of spurious derivatives.

A point is a triple of expressions.  Distances that change form (a foot that leaves the segment)
are written branch by branch; the branch is chosen by the foot of the perpendicular ([Er] ch. 5).
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy

    Point = tuple[sympy.Expr, sympy.Expr, sympy.Expr]

# Two rods whose directions differ by less than this sine count as parallel: their distance is
# then taken between ends and rods, which errs by less than the length times this number.
PARALLEL = 1e-10


def minus(p: "Point", q: "Point") -> "Point":
    """Return the vector from ``q`` to ``p``."""
    return (p[0] - q[0], p[1] - q[1], p[2] - q[2])


def dot(u: "Point", v: "Point") -> "sympy.Expr":
    """Return the scalar product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def cross(u: "Point", v: "Point") -> "Point":
    """Return the vector product."""
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )


def norm(u: "Point") -> "sympy.Expr":
    """Return the length of a vector."""
    import sympy

    return sympy.sqrt(dot(u, u))


def foot(p: "Point", start: "Point", end: "Point") -> "sympy.Expr":
    """Return the position of the foot of ``p`` on a line: 0 at ``start``, 1 at ``end``."""
    u = minus(end, start)
    return dot(minus(p, start), u) / dot(u, u)


def point_line_distance(p: "Point", start: "Point", end: "Point", at: "sympy.Expr") -> "sympy.Expr":
    """Return the distance of ``p`` from a line on which its foot is at ``at``."""
    w, u = minus(p, start), minus(end, start)
    return norm((w[0] - at * u[0], w[1] - at * u[1], w[2] - at * u[2]))


def point_segment_distance(
    at: "sympy.Expr", to_start: "sympy.Expr", to_end: "sympy.Expr", to_line: "sympy.Expr"
) -> "sympy.Expr":
    """Return the distance from a segment, given the foot and the three distances it may be."""
    import sympy

    return sympy.Piecewise((to_start, at <= 0), (to_end, at >= 1), (to_line, True))


def segment_segment_distance(
    first: "tuple[Point, Point]",
    second: "tuple[Point, Point]",
    ends: "list[sympy.Expr]",
) -> "tuple[dict[str, sympy.Expr], sympy.Expr]":
    """Return definitions and the distance of two segments.

    ``ends`` are the four distances of an end of one from the other segment.  Where the common
    perpendicular meets both segments it is the distance; elsewhere the least of ``ends`` is.
    """
    import sympy

    u, v, w = minus(first[1], first[0]), minus(second[1], second[0]), minus(first[0], second[0])
    names = ("nx", "ny", "nz", "nn")
    nx, ny, nz, nn = sympy.symbols(names, real=True)
    normal = (nx, ny, nz)
    # Everything from the common normal n = u x v: |u|^2 |v|^2 - (u.v)^2 would lose all digits for
    # nearly parallel segments.  The foot on the first is at s/nn, on the second at t/nn.
    definitions = dict(zip(names, (*cross(u, v), dot(normal, normal)), strict=True))
    s, t = -dot(cross(w, v), normal), -dot(cross(w, u), normal)
    crossing = sympy.And(nn > PARALLEL**2 * dot(u, u) * dot(v, v), 0 < s, s < nn, 0 < t, t < nn)
    apart = sympy.Abs(dot(w, normal)) / sympy.sqrt(nn)
    return definitions, sympy.Piecewise((apart, crossing), (sympy.Min(*ends), True))
