"""Nearest points of two parts that touch, and the normal there, as formulas.

Quantities in between are *defined*: to SymPy they are symbols, so that formulas stay short however
many faces and edges there are.
"""

from typing import TYPE_CHECKING, NamedTuple

from polycorner.bodies.frames import AXES, symbols
from polycorner.bodies.gaps import beside, given, harmonics
from polycorner.bodies.waves import waves
from polycorner.formulas.expressions import as_expression
from polycorner.spaces.distances import (
    PARALLEL,
    beyond,
    clamped,
    cross,
    dot,
    foot,
    minus,
    norm,
    scaled,
    zero,
)

if TYPE_CHECKING:
    import sympy

    from polycorner.bodies.gaps import Expressions
    from polycorner.spaces.distances import Point


class Features(NamedTuple):
    """What touches: a point or the two of an edge, of each part; or a point and a hull.

    Attributes
    ----------
    first, second : int
        How many points.
    faces, edges : tuple of tuple of int
        The points of each face of a polyhedron in order, and of each edge of a hull.
    """

    first: int
    second: int
    faces: tuple[tuple[int, ...], ...] = ()
    edges: tuple[tuple[int, ...], ...] = ()


class Definitions:
    """Intermediate quantities, which are symbols to SymPy once they are defined."""

    def __init__(self) -> None:
        self.written: Expressions = {}

    def number(self, name: str, expression: "sympy.Expr") -> "sympy.Expr":
        """Define a number, and return its symbol; itself if it is known."""
        expression = as_expression(name, expression)
        if expression.is_Number:
            return expression
        self.written[name] = expression
        return symbols([name])[0]

    def point(self, name: str, point: "Point") -> "Point":
        """Define a point or vector."""
        x, y, z = (self.number(f"{name}{axis}", c) for axis, c in zip(AXES, point, strict=True))
        return (x, y, z)


def nearest(w: Definitions, first: "list[Point]", second: "list[Point]") -> "tuple[Point, Point]":
    """Return the nearest points of two points or segments ([Er] sec. 5.1.9)."""
    (p, *p_end), (q, *q_end) = first, second
    if not q_end:
        return p, q
    v = w.point("v", minus(q_end[0], q))
    if not p_end:
        at = w.number("t", clamped(w.number("free_t", foot(p, q, q_end[0], 1 / dot(v, v)))))
        return p, beyond(q, v, at)
    u, apart = w.point("u", minus(p_end[0], p)), w.point("w", minus(p, q))
    pairs = {"uu": (u, u), "vv": (v, v), "uv": (u, v), "uw": (u, apart), "vw": (v, apart)}
    a, e, b, c, f = (w.number(name, dot(*pair)) for name, pair in pairs.items())
    normal = w.point("m", cross(u, v))

    def held(name: str, at: "sympy.Expr") -> "sympy.Expr":
        return w.number(name, clamped(w.number(f"free_{name}", at)))

    s = held("s", (b * f - c * e) / (dot(normal, normal) + PARALLEL**2 * a * e))
    t = held("t", (b * s + f) / e)
    return beyond(p, u, held("back", (b * t - c) / a)), beyond(q, v, t)


def off_hull(w: Definitions, point: "Point", d: int, features: Features) -> "Point":
    """Return the normal of a hull at the point of it that is nearest, in its own coordinates.

    Over a face it is that of the face; elsewhere it comes from the nearest edge.
    """
    import sympy

    p = w.point("inner", point)
    least: sympy.Expr = sympy.oo
    away = zero()
    for k, (i, j) in enumerate(features.edges):
        a, b = given(f"v{i}_", d), given(f"v{j}_", d)
        along = minus(b, a)
        at = w.number(f"at{k}", clamped(w.number(f"foot{k}", foot(p, a, b, 1 / dot(along, along)))))
        here = w.point(f"from{k}", minus(p, beyond(a, along, at)))
        square = w.number(f"square{k}", dot(here, here))
        nearer = square < least
        away = w.point(f"away{k}", _chosen(nearer, here, away))
        least = w.number(f"least{k}", sympy.Piecewise((square, nearer), (least, True)))
    normal = scaled(away, 1 / sympy.sqrt(least))
    for f, face in enumerate(features.faces):
        outward, corners = given(f"n{f}_", d), [given(f"v{i}_", d) for i in face]
        height = dot(outward, minus(p, corners[0]))
        over = sympy.And(height >= 0, *(x <= 0 for x in beside(p, corners, outward)))
        normal = w.point(f"normal{f}", _chosen(over, outward, normal))
    return normal


def _chosen(holds: "sympy.Basic", one: "Point", other: "Point") -> "Point":
    import sympy

    x, y, z = (sympy.Piecewise((a, holds), (b, True)) for a, b in zip(one, other, strict=True))
    return (x, y, z)


def inward(w: Definitions, away: "Point", d: int, waviness: int) -> "Point":
    """Return the normal of a cylinder, circle or sphere around a point that is off its centre."""
    import sympy

    axis = given("w", d)
    away = w.point("away", minus(away, scaled(axis, dot(away, axis))))
    if waviness:
        e, f = given("e", d), given("f", d)
        x, y = w.number("along_e", dot(away, e)), w.number("along_f", dot(away, f))
        _, slope = waves(sympy.atan2(y, x), harmonics(waviness))
        uphill = scaled(minus(scaled(f, x), scaled(e, y)), slope / norm(away))
        away = w.point("across", minus(away, uphill))
    return scaled(away, -1 / norm(away))
