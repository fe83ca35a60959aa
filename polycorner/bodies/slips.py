"""Slip and rolling velocities where a point of one body touches another body or a wall.

With the point ``p`` inside the rounding of radius ``r``, the nearest point ``q`` of the other
part, and the unit normal ``n`` from ``q`` to ``p``, the bodies touch at ``p - r n``.  The slip is
the difference of their velocities there along tangents: in the plane ``n`` turned left; in space a
basis that depends on ``n`` without a singular direction ([Duff]).  The rolling velocity is the
difference of the angular velocities along the same directions (in the plane, the difference itself)
times ``r``, between bodies of radii ``r`` and ``s`` times ``r s / (r + s)``.  In a periodic box the
second body is displaced by whole periods to the image that touches.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.bodies.facets import Facets
from polycorner.bodies.frames import Frame
from polycorner.bodies.images import wrapped
from polycorner.bodies.pairs import Member, Touch
from polycorner.bodies.poses import Placement
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.bodies.waves import waves
from polycorner.motion.contacts import velocities
from polycorner.motion.rotations import angular_velocity
from polycorner.spaces.distances import PARALLEL, cross, dot, foot, minus, norm
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import sympy

    from polycorner.spaces.distances import Point


def slip(placements: dict[str, Placement], touch: Touch) -> "tuple[sympy.Expr, ...]":
    """Return one component of the slip of two bodies in the plane, two in space."""
    import sympy

    displaced = displacement(touch)
    cases = [
        (_slip(placements, touch.one, p, normal, touch.two, displaced), holds)
        for p, normal, holds in _places(touch)
    ]
    if len(cases) == 1:
        return cases[0][0]
    whole = range(len(cases[0][0]))
    return tuple(
        sympy.Piecewise(*((rows[i], holds) for rows, holds in cases), evaluate=False) for i in whole
    )


def rolling(placements: dict[str, Placement], touch: Touch) -> "tuple[sympy.Expr, ...]":
    """Return the rolling velocity of two bodies, of as many components as the slip.

    Raises
    ------
    NotImplementedError
        At the sides of polygons and polyhedra, where the radius of what is touched jumps between a
        side and a vertex.
    """
    if len(touch.second) > 2:
        msg = (
            f"rolling: expected contacts of discs, balls, capsules, edges and walls; got "
            f"{touch.gap.name!r}, at a polygon or polyhedron"
        )
        raise NotImplementedError(msg)
    ((_, normal, _),) = _places(touch)
    r, s = touch.one.part.radius, touch.two.part.radius
    radius = r * s / (r + s) if r and s else 0.0
    return _rolling(placements, touch.one, normal, touch.two, radius)


def _places(touch: Touch) -> "Iterator[tuple[Point, Point, Any]]":
    """Yield the nearest point of the first part, and the normal from the second to it.

    There are several cases, of which the first that holds counts, at a polygon or polyhedron: its
    faces, over which the point is, and its edges, of which one is nearest.
    """
    import sympy

    first = [_at(touch.one, point) for point in touch.first]
    second = [_plus(_at(touch.two, point), displacement(touch)) for point in touch.second]
    if len(second) <= 2:
        p, q = _nearest(first, second)
        apart = minus(p, q)
        yield p, _scaled(apart, _reciprocal(norm(apart))), sympy.true
        return
    (p,), hull = first, touch.two.part.facets
    assert hull is not None, touch.two.name
    if touch.two.part.dimension == 3:
        yield from _over_faces(touch.two, p, second, hull)
    edges = [(i, j) for i, j, *_ in hull.edges or hull.faces]
    away = [minus(p, _nearest([p], [second[i], second[j]])[1]) for i, j in edges]
    squares = [dot(w, w) for w in away]
    for k, w in enumerate(away):
        later = squares[k + 1 :]
        nearest = _at_most(squares[k], sympy.Min(*later, evaluate=False)) if later else sympy.true
        yield p, _scaled(w, _reciprocal(sympy.sqrt(squares[k]))), nearest


def _over_faces(
    member: Member, p: "Point", vertices: "list[Point]", hull: Facets
) -> "Iterator[tuple[Point, Point, Any]]":
    """Yield the faces of a polyhedron with their normals, and the condition that ``p`` is over."""
    import sympy

    for face, local in zip(hull.faces, hull.normals, strict=True):
        normal = member.frame.vector(member.body, local.tolist(), 3)
        corners = [vertices[i] for i in face]
        sides = [
            _at_most(dot(minus(p, a), cross(minus(b, a), normal)), 0)
            for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
        ]
        above = _at_most(0, dot(normal, minus(p, corners[0])))
        yield p, normal, sympy.And(above, *sides, evaluate=False)


def _nearest(first: "list[Point]", second: "list[Point]") -> "tuple[Point, Point]":
    """Return the nearest points of two points or segments ([Er] sec. 5.1.9)."""
    (p, *p_end), (q, *q_end) = first, second
    if not q_end:
        return p, q
    v = minus(q_end[0], q)
    if not p_end:
        return p, _beyond(q, v, _clamped(foot(p, q, q_end[0], 1 / dot(v, v))))
    u, w = minus(p_end[0], p), minus(p, q)
    a, e, b, c, f = dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)
    normal = cross(u, v)
    s = _clamped((b * f - c * e) / (dot(normal, normal) + PARALLEL**2 * a * e))
    t = _clamped((b * s + f) / e)
    return _beyond(p, u, _clamped((b * t - c) / a)), _beyond(q, v, t)


def displacement(touch: Touch) -> "Point":
    """Return by how much the second body is displaced to the image that touches the first.

    It is a whole number of periods: what is left of the displacement of the two bodies when the
    nearest image of that is taken away.
    """
    import sympy

    one, two, zero = touch.one, touch.two, sympy.S.Zero
    image, sign = (one.image, -1.0) if one.image else (two.image, 1.0)
    if image is None:
        return (zero, zero, zero)
    shift = _fixed(sign * image.shift)
    if one.body == two.body:
        return shift
    away = minus(_at(one, one.middle), _at(two, two.middle))
    found = [zero, zero, zero]
    for k in image.axes:
        period = float(image.periods[k])
        turn = (away[k] - shift[k]) * 2 * sympy.pi / period
        found[k] = away[k] - wrapped(turn, period)
    return (found[0], found[1], found[2])


def slip_at_wall(
    placements: dict[str, Placement], wall: Wall, member: Member, point: Array
) -> "tuple[sympy.Expr, ...]":
    """Return the slip of a point of a body at a wall, which may turn."""
    p = _at(member, point)
    return _slip(placements, member, p, _inward(wall, p), wall, _fixed(np.zeros(3)))


def rolling_at_wall(
    placements: dict[str, Placement], wall: Wall, member: Member, point: Array
) -> "tuple[sympy.Expr, ...]":
    """Return the rolling velocity of a point of a body at a wall, which may turn."""
    normal = _inward(wall, _at(member, point))
    return _rolling(placements, member, normal, wall, member.part.radius)


def _inward(wall: Wall, p: "Point") -> "Point":
    """Return the normal of a wall next to a point."""
    if isinstance(wall, HalfSpace):
        return _fixed(wall.normal)
    away = minus(p, _fixed(wall.point))
    if wall.axis is not None:
        axis = _fixed(wall.axis)
        away = minus(away, _scaled(axis, dot(away, axis)))
    if wall.waves:
        away = minus(away, _uphill(wall, away))
    return _scaled(away, -1 / norm(away))


def _uphill(wall: Cylinder, away: "Point") -> "Point":
    """Return the change of the radius with the azimuth, along the direction of growing azimuths."""
    import sympy

    e, f = map(_fixed, wall.around)
    x, y = dot(away, e), dot(away, f)
    _, slope = waves(sympy.atan2(y, x), [(k, *pair) for k, pair in wall.waves.items()])
    return _scaled(minus(_scaled(f, x), _scaled(e, y)), slope / norm(away))


def _slip(
    placements: dict[str, Placement],
    one: Member,
    p: "Point",
    normal: "Point",
    two: Member | Wall,
    displaced: "Point",
) -> "tuple[sympy.Expr, ...]":
    place = minus(p, _scaled(normal, one.part.radius))
    other = minus(place, displaced)
    velocity = minus(_velocity(placements, one, place), _velocity(placements, two, other))
    if one.part.dimension == 2:
        return (normal[0] * velocity[1] - normal[1] * velocity[0],)
    return _along_tangents(normal, velocity)


def _rolling(
    placements: dict[str, Placement],
    one: Member,
    normal: "Point",
    two: Member | Wall,
    radius: float,
) -> "tuple[sympy.Expr, ...]":
    spin = _scaled(minus(_spin(placements, one), _spin(placements, two)), radius)
    if one.part.dimension == 2:
        return (spin[2],)
    return _along_tangents(normal, spin)


def _velocity(placements: dict[str, Placement], thing: Member | Wall, place: "Point") -> "Point":
    """Return the velocity that a place has as a point of a body or a wall."""
    import sympy

    zero = sympy.S.Zero
    spin = _spin(placements, thing)
    if isinstance(thing, Member) and thing.frame is not Frame.FIXED:
        manifold, d = placements[thing.body].manifold, thing.part.dimension
        x, y, z = (*manifold.symbols[:d], zero)[:3]
        turning = cross(spin, minus(place, (x, y, z)))
        x, y, z = (*velocities(manifold)[:d], zero)[:3]
        return (x + turning[0], y + turning[1], z + turning[2])
    if isinstance(thing, Cylinder) and thing.spin:
        return cross(spin, minus(place, _fixed(thing.point)))
    return (zero, zero, zero)


def _spin(placements: dict[str, Placement], thing: Member | Wall) -> "Point":
    """Return the angular velocity of a body or a wall; in the plane its third component."""
    import sympy

    zero = sympy.S.Zero
    if isinstance(thing, Cylinder) and thing.spin:
        axis = np.array([0.0, 0.0, 1.0]) if thing.axis is None else thing.axis
        return _scaled(_fixed(axis), thing.spin)
    if isinstance(thing, Member) and thing.frame is not Frame.FIXED:
        manifold = placements[thing.body].manifold
        if thing.frame is Frame.TURNED:
            return (zero, zero, velocities(manifold)[thing.part.dimension])
        if thing.frame is Frame.ROTATED:
            x, y, z = angular_velocity(manifold, frame="space")
            return (x, y, z)
    return (zero, zero, zero)


def _along_tangents(n: "Point", velocity: "Point") -> "tuple[sympy.Expr, sympy.Expr]":
    """Return a vector's components along two unit vectors orthogonal to ``n`` and to each other.

    Products are left as they are written: SymPy would ask whether ``n`` makes them infinite.
    """
    import sympy

    x, y, z = map(sympy.sympify, n)
    known = bool(x.is_number and y.is_number and z.is_number)
    side = sympy.Piecewise((1, _at_most(0, z)), (-1, True), evaluate=bool(z.is_number))

    def product(*factors: "sympy.Expr") -> "sympy.Expr":
        return sympy.Mul(*factors, evaluate=known)

    a = _reciprocal(-side - z)
    b = product(x, y, a)
    one = (1 + product(side, x, x, a), product(side, b), product(-1, side, x))
    two = (b, side + product(y, y, a), -y)
    first, second = (
        sympy.Add(*(product(t, v) for t, v in zip(tangent, velocity, strict=True)), evaluate=known)
        for tangent in (one, two)
    )
    return first, second


def _plus(p: "Point", u: "Point") -> "Point":
    return (p[0] + u[0], p[1] + u[1], p[2] + u[2])


def _beyond(p: "Point", u: "Point", at: "sympy.Expr") -> "Point":
    return _plus(p, _scaled(u, at))


def _clamped(at: "sympy.Expr") -> "sympy.Expr":
    """Return a position on a segment, without the branches that a condition must not contain."""
    import sympy

    return sympy.Min(sympy.Max(at, 0, evaluate=False), 1, evaluate=False)


def _at_most(a: "sympy.Expr | int", b: "sympy.Expr | int") -> Any:
    """Return the condition ``a <= b``; of formulas SymPy is not asked, which takes long."""
    import sympy

    known = sympy.sympify(a).is_number and sympy.sympify(b).is_number
    return sympy.Le(a, b, evaluate=bool(known))


def _reciprocal(a: "sympy.Expr") -> "sympy.Expr":
    """Return ``1 / a``; of formulas SymPy is not asked whether they are infinite."""
    import sympy

    return sympy.Pow(a, -1, evaluate=bool(a.is_number))


def _at(member: Member, point: Array) -> "Point":
    return member.frame.point(member.body, member.numbers(point), member.part.dimension)


def _fixed(vector: Array) -> "Point":
    x, y, z = np.append(vector, np.zeros(3 - len(vector))).tolist()
    return (x, y, z)


def _scaled(vector: "Point", factor: "sympy.Expr | float") -> "Point":
    return (factor * vector[0], factor * vector[1], factor * vector[2])
