"""Slip and rolling velocities where a point of one body touches another body or a wall.

With the point ``p`` inside the rounding of radius ``r``, the nearest point ``q`` of the other
part, and the unit normal ``n`` from ``q`` to ``p``, the bodies touch at ``p - r n``.  The slip is
the difference of their velocities there along tangents: in the plane ``n`` turned left; in space a
basis that depends on ``n`` without a singular direction ([Duff]).  The rolling velocity is the
difference of the angular velocities along the same directions (in the plane, the difference itself)
times ``r``, between bodies of radii ``r`` and ``s`` times ``r s / (r + s)``.

Like gaps, slips are families of formulas, one for each kind of contact.  Their variables are the
coordinates of both bodies and then the velocities, by which alone they are differentiated.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

from polycorner.bodies import frames, gaps
from polycorner.bodies.frames import AXES, Frame, symbols
from polycorner.bodies.gaps import FIRST, SECOND, beside, given, harmonics, numbers
from polycorner.bodies.pairs import PlacedPart, Touch, function_of
from polycorner.bodies.shapes import Part
from polycorner.bodies.walls import Cylinder, HalfSpace, WallTouch
from polycorner.bodies.waves import waves
from polycorner.formulas import cache
from polycorner.formulas.expressions import as_expression
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.motion import rotations
from polycorner.motion.contacts import velocities
from polycorner.motion.formulation import dotted
from polycorner.spaces import distances
from polycorner.spaces.distances import (
    PARALLEL,
    beyond,
    clamped,
    cross,
    dot,
    foot,
    minus,
    norm,
    plus,
    scaled,
    zero,
)
from polycorner.spaces.manifold import Manifold

if TYPE_CHECKING:
    import sympy

    from polycorner.bodies.gaps import Expressions, Formulas
    from polycorner.spaces.distances import Point

SLIDING, ROLLING = "sliding", "rolling"
COMPONENTS = ("s0", "s1")
SPIN = ("spin0", "spin1", "spin2")  # angular velocity of a wall

# Nearest points of two parts that touch, and the normal there.  Quantities in between are
# *defined*: to SymPy they are symbols, so that formulas stay short however many faces there are.


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


# -------------------------------------------------------------------------------------------- slips


class RigidVelocity(NamedTuple):
    """Velocity of the origin of a body, its angular velocity, and the origin."""

    velocity: "Point"
    spin: "Point"
    origin: "Point"

    def at(self, place: "Point") -> "Point":
        """Return the velocity that a place has as a point of the body."""
        return plus(self.velocity, cross(self.spin, minus(place, self.origin)))


def slips_of(space: Manifold, touch: Touch, kind: str) -> tuple[SmoothFunction, ...]:
    """Return the slip or rolling velocity of two bodies: one component in the plane, two in space.

    Parameters
    ----------
    space : Manifold
        Coordinates and velocities.
    touch : Touch
    kind : str
        ``SLIDING`` or ``ROLLING``.

    Raises
    ------
    NotImplementedError
        For rolling at the sides of polygons and polyhedra, where the radius of what is touched
        jumps between a side and a vertex.
    """
    one, two, d = touch.one, touch.two, touch.one.part.dimension
    r = rolling_arm(one.part, two.part) if kind == ROLLING else one.part.radius
    values = [*one.numbers(*touch.first), *two.numbers(*touch.second)]
    features, hull = Features(len(touch.first), len(touch.second)), two.part.facets
    if features.second > 2 and hull is not None:
        if kind == ROLLING:
            msg = (
                f"rolling: expected contacts of discs, balls, capsules, edges and walls; got "
                f"{touch.gap.name!r}, at a polygon or polyhedron"
            )
            raise NotImplementedError(msg)
        if d == 3:
            features = features._replace(faces=hull.faces, edges=tuple(e[:2] for e in hull.edges))
            values += hull.normals.ravel().tolist()
        else:
            features = features._replace(edges=hull.faces)
    family = _between(kind, one.frame, two.frame, d, features)
    return _functions(space, family, one, two, [*values, r], touch.gap.name)


def rolling_arm(one: Part, two: Part) -> float:
    """Return the length by which rolling of two parts on each other counts as a displacement."""
    r, s = one.radius, two.radius
    return r * s / (r + s) if r and s else 0.0


def slips_at_wall(space: Manifold, touch: WallTouch, kind: str) -> tuple[SmoothFunction, ...]:
    """Return the slip or rolling velocity of a point of a body at a wall, which may turn."""
    gap, member, point, wall, _ = touch
    label = gap.name
    r, distance = member.part.radius, wall.family(member.frame)
    values = [*member.numbers(point), *wall.numbers(r), r, *wall.angular_velocity.tolist()]
    waviness = len(wall.waves) if isinstance(wall, Cylinder) else 0
    flat = isinstance(wall, HalfSpace)
    family = _at_wall(kind, distance, member.frame, wall.dimension, flat, waviness)
    return _functions(space, family, member, None, values, label)


def _functions(
    space: Manifold,
    family: Family,
    one: PlacedPart,
    two: PlacedPart | None,
    values: list[float],
    label: str,
) -> tuple[SmoothFunction, ...]:
    return tuple(
        function_of(space, family, one, two, values, f"{label} {name}", name)
        for name in family.names
    )


@lru_cache(maxsize=256)
def _between(kind: str, one: Frame, two: Frame, d: int, features: Features) -> Family:
    """Return the slips of two bodies."""
    parameters = [
        *(n for i in range(features.first) for n in numbers(f"p{i}_", one, d)),
        *(n for i in range(features.second) for n in numbers(f"v{i}_", two, d)),
        *(f"n{f}_{k}" for f in range(len(features.faces)) for k in range(d)),
        "r",
    ]
    formulas = partial(_between_bodies, kind, one, two, d, features)
    return _family(one, two, d, parameters, formulas, (kind, features))


@lru_cache(maxsize=256)
def _at_wall(kind: str, gap: Family, frame: Frame, d: int, flat: bool, waviness: int) -> Family:
    """Return the slips at a wall, whose parameters are those of the gap, ``r`` and the spin."""
    parameters = [*gap.parameters, "r", *SPIN]
    formulas = partial(_along_wall, kind, frame, d, flat, waviness)
    return _family(frame, Frame.FIXED, d, parameters, formulas, (kind, flat, waviness))


def _family(
    one: Frame,
    two: Frame,
    d: int,
    parameters: list[str],
    formulas: "Callable[[], Formulas]",
    written: object,
) -> Family:
    rooms = (distances, frames, gaps, rotations)
    sources = cache.source_key(*(room.__name__ for room in rooms), waves.__module__, __name__)
    key = repr((sources, written, one.value, two.value, d))
    places = one.variables(FIRST, d) + two.variables(SECOND, d)
    variables = (*places, *map(dotted, places))
    names = COMPONENTS[: d - 1]
    return Family(names, variables, tuple(parameters), formulas, key, stationary=places)


# --------------------------------------------------------------------------------------- formulas


def _between_bodies(kind: str, one: Frame, two: Frame, d: int, features: Features) -> "Formulas":
    w = Definitions()
    first = [_placed(w, f"p{i}", FIRST, one, d) for i in range(features.first)]
    if features.edges:
        (p,) = first
        normal = two.vector(SECOND, off_hull(w, two.into(SECOND, p, d), d, features)[:d], d)
    else:
        second = [_placed(w, f"v{i}", SECOND, two, d) for i in range(features.second)]
        p, q = nearest(w, first, second)
        apart = w.point("apart", minus(p, q))
        normal = scaled(apart, 1 / norm(apart))
    return _across(w, kind, d, p, normal, _motion(FIRST, one, d), _motion(SECOND, two, d))


def _along_wall(kind: str, frame: Frame, d: int, flat: bool, waviness: int) -> "Formulas":
    w = Definitions()
    p = w.point("P", frame.point(FIRST, symbols(numbers("p", frame, d)), d))
    centre = given("v" if flat else "c", d)
    x, y, z = symbols(SPIN)
    wall = RigidVelocity(zero(), (x, y, z), centre)
    normal = given("n", d) if flat else inward(w, minus(p, centre), d, waviness)
    return _across(w, kind, d, p, normal, _motion(FIRST, frame, d), wall)


def _placed(w: Definitions, name: str, role: str, frame: Frame, d: int) -> "Point":
    """Define the place of a point of a body; in the family's parameters it has the same name."""
    return w.point(name, frame.point(role, symbols(numbers(f"{name}_", frame, d)), d))


def _motion(role: str, frame: Frame, d: int) -> RigidVelocity:
    """Return the motion of a body."""
    if frame is Frame.FIXED:
        return RigidVelocity(zero(), zero(), zero())
    if frame is Frame.LINKED:  # [spin] is the rate of the matrix times its transpose
        names = frame.variables(role, d)
        place, changes = symbols(names), symbols([*map(dotted, names)])
        (o, *rows), (v, *turns) = (
            [(x[k], x[k + 1], x[k + 2]) for k in range(0, len(x), d)] for x in (place, changes)
        )
        omega = dot(turns[2], rows[1]), dot(turns[0], rows[2]), dot(turns[1], rows[0])
        return RigidVelocity(v, omega, o)
    manifold, spin = frame.manifold(role, d, 1.0, 1.0, ""), zero()
    rates = velocities(manifold)
    if frame is Frame.TURNED:
        spin = (*spin[:2], rates[d])
    if frame is Frame.ROTATED:
        x, y, z = rotations.angular_velocity(manifold, frame="space")
        spin = (x, y, z)
    velocity, origin = ((*some[:d], *zero())[:3] for some in (rates, manifold.symbols))
    return RigidVelocity(velocity, spin, origin)


def _across(
    w: Definitions,
    kind: str,
    d: int,
    p: "Point",
    normal: "Point",
    one: RigidVelocity,
    two: RigidVelocity,
) -> "Formulas":
    """Return the components across the normal of the difference of two motions."""
    (r,), n = symbols(["r"]), w.point("n", normal)
    one, two = (
        motion._replace(spin=w.point(f"spin_of_{k}", motion.spin))
        for k, motion in enumerate((one, two))
    )
    if kind == ROLLING:
        u = w.point("relative", scaled(minus(one.spin, two.spin), r))
    else:
        place = w.point("place", minus(p, scaled(n, r)))
        u = w.point("relative", minus(one.at(place), two.at(place)))
    if d == 2:
        component = u[2] if kind == ROLLING else n[0] * u[1] - n[1] * u[0]
        return w.written, dict(zip(COMPONENTS, [component], strict=False))
    tangents = _tangents(w, n)
    return w.written, {name: dot(t, u) for name, t in zip(COMPONENTS, tangents, strict=True)}


def _tangents(w: Definitions, n: "Point") -> "tuple[Point, Point]":
    """Return two unit vectors orthogonal to ``n`` and to each other."""
    import sympy

    x, y, z = n
    side = w.number("side", sympy.Piecewise((1, z >= 0), (-1, True)))
    a = w.number("a", -1 / (side + z))
    b = w.number("b", x * y * a)
    return (1 + side * x**2 * a, side * b, -side * x), (b, side + y**2 * a, -y)
