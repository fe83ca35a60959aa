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

# Definitions on which the distance of two segments does not depend to the first order.
STATIONARY = ("at_first", "at_second", "mx", "my", "mz")


def minus(p: "Point", q: "Point") -> "Point":
    """Return the vector from ``q`` to ``p``."""
    return (p[0] - q[0], p[1] - q[1], p[2] - q[2])


def plus(p: "Point", u: "Point") -> "Point":
    """Return the sum."""
    return (p[0] + u[0], p[1] + u[1], p[2] + u[2])


def scaled(u: "Point", factor: "sympy.Expr") -> "Point":
    """Return a vector times a number."""
    return (factor * u[0], factor * u[1], factor * u[2])


def beyond(p: "Point", u: "Point", at: "sympy.Expr") -> "Point":
    """Return ``p + at u``."""
    return plus(p, scaled(u, at))


def zero() -> "Point":
    """Return the zero vector."""
    import sympy

    return (sympy.S.Zero,) * 3


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


def foot(p: "Point", start: "Point", end: "Point", per: "sympy.Expr") -> "sympy.Expr":
    """Return the position of the foot of ``p`` on a line: 0 at ``start``, 1 at ``end``.

    ``per`` is one over the squared distance of ``start`` and ``end``.
    """
    return per * dot(minus(p, start), minus(end, start))


def clamped(at: "sympy.Expr") -> "sympy.Expr":
    """Return the position on a segment that is nearest to a position on its line."""
    import sympy

    return sympy.Piecewise((0, at <= 0), (1, at >= 1), (at, True))


def distance_from(p: "Point", start: "Point", end: "Point", at: "sympy.Expr") -> "sympy.Expr":
    """Return the distance of ``p`` from the point of a line that is at ``at``.

    It is least, and does not depend on ``at`` to the first order, where ``at`` is the foot of
    ``p``; clamped to the segment, ``at`` is the foot or constant.
    """
    w, u = minus(p, start), minus(end, start)
    return norm((w[0] - at * u[0], w[1] - at * u[1], w[2] - at * u[2]))


def segment_segment_distance(
    first: "tuple[Point, Point]",
    second: "tuple[Point, Point]",
    ends: "list[sympy.Expr]",
) -> "tuple[dict[str, sympy.Expr], sympy.Expr]":
    """Return definitions and the distance of two segments.

    ``ends`` are the four distances of an end of one from the other segment.  Where the common
    perpendicular meets both segments it is the distance; elsewhere the least of ``ends`` is.

    The perpendicular from ``x = a + s u`` to ``y = b + t v`` along the unit normal ``m`` has the
    length ``m.(x - y)``, which does not depend on ``s``, ``t`` and ``m`` (``STATIONARY``) to the
    first order: ``m.u = m.v = 0``, and ``x - y`` is along ``m``, whose change is orthogonal to it.
    """
    import sympy

    u, v, w = minus(first[1], first[0]), minus(second[1], second[0]), minus(first[0], second[0])
    names = ("nx", "ny", "nz", "nn", "per", *STATIONARY)
    nx, ny, nz, nn, per, s, t, mx, my, mz = sympy.symbols(names, real=True)
    normal, unit = (nx, ny, nz), (mx, my, mz)
    # Everything from the common normal n = u x v: |u|^2 |v|^2 - (u.v)^2 would lose all digits for
    # nearly parallel segments.  The foot on the first is at s/nn, on the second at t/nn.
    past_first, past_second = -dot(cross(w, v), normal), -dot(cross(w, u), normal)
    side = sympy.Piecewise((-1, dot(w, normal) < 0), (1, True))
    common = (*cross(u, v), dot(normal, normal), side / sympy.sqrt(nn))
    written = (*common, past_first * per**2, past_second * per**2, *(per * n for n in normal))
    inside = sympy.And(0 < past_first, past_first < nn, 0 < past_second, past_second < nn)
    crossing = sympy.And(nn > PARALLEL**2 * dot(u, u) * dot(v, v), inside)
    between = tuple(w[i] + s * u[i] - t * v[i] for i in range(3))
    apart = dot(between, unit)
    distance = sympy.Piecewise((apart, crossing), (sympy.Min(*ends), True))
    return dict(zip(names, written, strict=True)), distance
