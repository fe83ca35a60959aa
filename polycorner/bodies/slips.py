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

from polycorner.bodies import frames, gaps, normals, waves
from polycorner.bodies.frames import Frame, symbols
from polycorner.bodies.gaps import FIRST, SECOND, given, numbers
from polycorner.bodies.normals import Definitions, Features, inward, nearest, off_hull
from polycorner.bodies.pairs import PlacedPart, Touch, function_of
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.formulas import cache
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.motion import rotations
from polycorner.motion.contacts import velocities
from polycorner.motion.formulation import dotted
from polycorner.spaces import distances
from polycorner.spaces.distances import cross, dot, minus, norm, plus, scaled, zero
from polycorner.spaces.manifold import Array, Manifold

if TYPE_CHECKING:
    from polycorner.bodies.gaps import Formulas
    from polycorner.spaces.distances import Point

SLIDING, ROLLING = "sliding", "rolling"
COMPONENTS = ("s0", "s1")
SPIN = ("spin0", "spin1", "spin2")  # angular velocity of a wall

AtWall = tuple[str, Wall, PlacedPart, Array]  # name of the contact, wall, part, point


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
    r, s = one.part.radius, two.part.radius
    if kind == ROLLING:
        r = r * s / (r + s) if r and s else 0.0
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


def slips_at_wall(space: Manifold, touch: AtWall, kind: str) -> tuple[SmoothFunction, ...]:
    """Return the slip or rolling velocity of a point of a body at a wall, which may turn."""
    label, wall, member, point = touch
    r, gap = member.part.radius, wall.family(member.frame)
    values = [*member.numbers(point), *wall.numbers(r), r, *wall.angular_velocity.tolist()]
    waviness = len(wall.waves) if isinstance(wall, Cylinder) else 0
    flat = isinstance(wall, HalfSpace)
    family = _at_wall(kind, gap, member.frame, wall.dimension, flat, waviness)
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
    rooms = (distances, frames, waves, gaps, normals, rotations)
    sources = cache.source_key(*(room.__name__ for room in rooms), __name__)
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
