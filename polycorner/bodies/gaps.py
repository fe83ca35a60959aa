"""Gaps of rounded hulls as families of formulas, one for each kind of contact.

Every gap is the distance of two features minus the radii around them (the parameter ``s``), with
the first body in role 1 and the second in role 2:

- ``points``: of two points;
- ``segment``: of a point from a segment;
- ``segments``: of two segments, in space;
- ``hull``: of a point from a polygon or polyhedron, inside of it minus the depth;
- ``side``: of a point from the plane of a face, positive outside;
- ``crossing``: of two polyhedra along the common perpendicular of two of their edges;
- ``hollow``: of a point from a cylinder or sphere around it.

A distance that changes form is written on branches that fit together, with continuous first
derivatives; nearest points do not matter to the first order (the envelope theorem, [Danskin]).
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import TYPE_CHECKING

from polycorner.bodies import frames
from polycorner.bodies import waves as waviness
from polycorner.bodies.frames import Frame, symbols
from polycorner.bodies.waves import waves
from polycorner.formulas import cache
from polycorner.formulas.families import Family
from polycorner.spaces import distances
from polycorner.spaces.distances import (
    STATIONARY,
    clamped,
    cross,
    distance_from,
    dot,
    foot,
    minus,
    norm,
    segment_segment_distance,
)

if TYPE_CHECKING:
    import sympy

    from polycorner.spaces.distances import Point

    Expressions = dict[str, sympy.Expr]
    Formulas = tuple[Expressions, Expressions]

FIRST, SECOND = "_1_", "_2_"  # the bodies in roles 1 and 2
# The conditions under which two edges span a face of the difference of two polyhedra.
SUPPORTS = ("left1", "right1", "left2", "right2")
CROSSING = ("gap", *SUPPORTS, "angle")
# The parameters that are points of the bodies in roles 1 and 2, by their letters; ``a`` and ``b``
# are those of the first only where ``g`` and ``h`` are of the second.
POINTS = (("p", "first"), ("q", "g", "h", "v", "second"))
ENDS = ("a", "b")


def _family(
    names: tuple[str, ...],
    one: Frame,
    two: Frame,
    d: int,
    parameters: Sequence[str],
    formulas: "Callable[[], Formulas]",
    written: object,
    stationary: tuple[str, ...] = (),
) -> Family:
    sources = cache.source_key(distances.__name__, frames.__name__, waviness.__name__, __name__)
    key = repr((sources, written, one.value, two.value, d))
    variables = one.variables(FIRST, d) + two.variables(SECOND, d)
    return Family(names, variables, tuple(parameters), formulas, key, stationary=stationary)


def numbers(name: str, frame: Frame, d: int) -> list[str]:
    """Return the names of the numbers of a point or vector of a body."""
    return [f"{name}{k}" for k in range(frame.count(d))]


def points_of(family: Family, *, both: bool) -> list[str]:
    """Return the parameters that are points of bodies that move, or of ``both``.

    Directions may be among them, as lengths that do not matter.
    """
    first, second = map(set, POINTS)
    (first if "g0" in family.parameters else second).update(ENDS)
    letters = {
        letter
        for role, some in ((FIRST, first), (SECOND, second))
        if both or any(name.endswith(role) for name in family.variables)
        for letter in some
    }
    return [name for name in family.parameters if name.rstrip("0123456789_") in letters]


def given(name: str, d: int) -> "Point":
    """Return a vector that is a parameter; in the plane the third coordinate is zero."""
    return Frame.FIXED.vector("", symbols(numbers(name, Frame.FIXED, d)), d)


def beside(p: "Point", corners: "list[Point]", normal: "Point") -> "list[sympy.Expr]":
    """Return on which side of each edge of a face a point is, positive outside."""
    return [
        dot(minus(p, a), cross(minus(b, a), normal))
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]


def harmonics(count: int) -> "list[tuple[sympy.Expr, ...]]":
    """Return order, amplitude and phase of each wave, which are parameters."""
    return [tuple(symbols([f"k{j}", f"z{j}", f"o{j}"])) for j in range(count)]


def _at(name: str, role: str, frame: Frame, d: int) -> "Point":
    return frame.point(role, symbols(numbers(name, frame, d)), d)


def _along(name: str, role: str, frame: Frame, d: int) -> "Point":
    return frame.vector(role, symbols(numbers(name, frame, d)), d)


def _placed(*points: "tuple[str, Point]") -> "tuple[Expressions, list[Point]]":
    """Return definitions of the coordinates of points, and the points by these names.

    Distances then read coordinates, which are computed once, and not what these are sums of.
    """
    definitions: Expressions = {}
    found = []
    for name, point in points:
        x, y, z = (f"{name}{axis}" for axis in frames.AXES)
        definitions |= dict(zip((x, y, z), point, strict=True))
        found.append(tuple(symbols([x, y, z])))
    return definitions, found


@lru_cache(maxsize=64)
def points(one: Frame, two: Frame, d: int) -> Family:
    """Return the gap of two points; parameters ``p`` of 1, ``q`` of 2, ``s``."""
    parameters = [*numbers("p", one, d), *numbers("q", two, d), "s"]
    formulas = partial(_points, one, two, d)
    return _family(("gap",), one, two, d, parameters, formulas, "points")


def _points(one: Frame, two: Frame, d: int) -> "Formulas":
    definitions, (p, q) = _placed(("P", _at("p", FIRST, one, d)), ("Q", _at("q", SECOND, two, d)))
    return definitions, {"gap": norm(minus(p, q)) - symbols(["s"])[0]}


@lru_cache(maxsize=64)
def segment(one: Frame, two: Frame, d: int) -> Family:
    """Return the gap of a point and a segment; parameters ``p`` of 1, ``a``, ``b`` of 2, ``s``."""
    ends = [*numbers("a", two, d), *numbers("b", two, d)]
    parameters = [*numbers("p", one, d), *ends, "s"]
    formulas = partial(_segment, one, two, d)
    return _family(("gap",), one, two, d, parameters, formulas, "segment", ("foot",))


def _segment(one: Frame, two: Frame, d: int) -> "Formulas":
    ends = [(end.upper(), _at(end, SECOND, two, d)) for end in "ab"]
    definitions, (p, a, b) = _placed(("P", _at("p", FIRST, one, d)), *ends)
    per, at, s = symbols(["per", "foot", "s"])
    along = minus(b, a)
    definitions |= {"per": 1 / dot(along, along), "foot": clamped(foot(p, a, b, per))}
    return definitions, {"gap": distance_from(p, a, b, at) - s}


@lru_cache(maxsize=64)
def segments(one: Frame, two: Frame) -> Family:
    """Return the gap of two segments in space; parameters ``a``, ``b``, ``g``, ``h``, ``s``."""
    first = [*numbers("a", one, 3), *numbers("b", one, 3)]
    second = [*numbers("g", two, 3), *numbers("h", two, 3)]
    held = (*STATIONARY, "foot0", "foot1", "foot2", "foot3")
    formulas = partial(_segments, one, two)
    return _family(("gap",), one, two, 3, [*first, *second, "s"], formulas, "segments", held)


def _segments(one: Frame, two: Frame) -> "Formulas":
    roles = [(end, FIRST, one) for end in "ab"] + [(end, SECOND, two) for end in "gh"]
    written = [(end.upper(), _at(end, role, frame, 3)) for end, role, frame in roles]
    definitions, (a, b, g, h) = _placed(*written)
    ends = symbols([f"end{k}" for k in range(4)])
    for k, (p, start, end) in enumerate(((a, g, h), (b, g, h), (g, a, b), (h, a, b))):
        along, (per, at) = minus(end, start), symbols([f"per{k}", f"foot{k}"])
        definitions[f"per{k}"] = 1 / dot(along, along)
        definitions[f"foot{k}"] = clamped(foot(p, start, end, per))
        definitions[f"end{k}"] = distance_from(p, start, end, at)
    crossing, distance = segment_segment_distance((a, b), (g, h), ends)
    return definitions | crossing, {"gap": distance - symbols(["s"])[0]}


@lru_cache(maxsize=64)
def hull(
    one: Frame,
    two: Frame,
    d: int,
    count: int,
    faces: tuple[tuple[int, ...], ...],
    edges: tuple[tuple[int, int], ...],
) -> Family:
    """Return the gap of a point and a polygon or polyhedron.

    Parameters of the family: ``p`` of 1, the ``count`` vertices ``v`` of 2, normals ``n`` of its
    faces, ``s``.  ``faces`` are vertices of each in order, ``edges`` pairs of vertices.
    """
    parameters = [
        *numbers("p", one, d),
        *(f"v{i}_{k}" for i in range(count) for k in range(d)),
        *(f"n{f}_{k}" for f in range(len(faces)) for k in range(d)),
        "s",
    ]
    feet = tuple(f"foot{k}" for k in range(len(edges)))
    formulas = partial(_hull, one, two, d, faces, edges)
    kind = ("hull", count, faces, edges)
    return _family(("gap",), one, two, d, parameters, formulas, kind, feet)


def _hull(
    one: Frame,
    two: Frame,
    d: int,
    faces: tuple[tuple[int, ...], ...],
    edges: tuple[tuple[int, int], ...],
) -> "Formulas":
    """Return the distance from a hull in its own coordinates.

    Over a face it is the height; elsewhere outside the least distance from the edges; inside the
    largest height, which is negative.
    """
    import sympy

    definitions: Expressions = {}

    def define(name: str, expression: "sympy.Expr") -> "sympy.Symbol":
        definitions[name] = expression
        return symbols([name])[0]

    inner = two.into(SECOND, _at("p", FIRST, one, d), d)
    p = tuple(define(f"inner{k}", x) if k < d else x for k, x in enumerate(inner))
    heights, over = [], []
    for f, face in enumerate(faces):
        normal = given(f"n{f}_", d)
        height = define(f"height{f}", dot(normal, minus(p, given(f"v{face[0]}_", d))))
        heights.append(height)
        if d == 3:
            sides = beside(p, [given(f"v{i}_", d) for i in face], normal)
            over.append((height, sympy.And(height >= 0, *(side <= 0 for side in sides))))
    away = []
    for k, (i, j) in enumerate(edges):
        a, b = given(f"v{i}_", d), given(f"v{j}_", d)
        along = minus(b, a)
        at = define(f"foot{k}", clamped(foot(p, a, b, 1 / dot(along, along))))
        away.append(define(f"away{k}", distance_from(p, a, b, at)))
    inside = (sympy.Max(*heights), sympy.And(*(height <= 0 for height in heights)))
    distance = sympy.Piecewise(inside, *over, (sympy.Min(*away), True))
    return definitions, {"gap": distance - symbols(["s"])[0]}


@lru_cache(maxsize=64)
def side(one: Frame, two: Frame, d: int) -> Family:
    """Return the height over a face; parameters ``p`` of 1, ``v``, normal ``n`` of 2, ``s``."""
    face = [*numbers("v", two, d), *numbers("n", two, d)]
    parameters = [*numbers("p", one, d), *face, "s"]
    return _family(("gap",), one, two, d, parameters, partial(_side, one, two, d), "side")


def _side(one: Frame, two: Frame, d: int) -> "Formulas":
    p, v, n = _at("p", FIRST, one, d), _at("v", SECOND, two, d), _along("n", SECOND, two, d)
    return {}, {"gap": dot(n, minus(p, v)) - symbols(["s"])[0]}


@lru_cache(maxsize=64)
def crossing(one: Frame, two: Frame) -> Family:
    """Return the gap along the common perpendicular of two edges, and when it separates.

    Parameters: a point ``p`` and the direction ``u`` of an edge of 1, and directions ``l`` and
    ``r`` from it into the faces on its two sides; ``q``, ``v``, ``m``, ``k`` of 2; the side ``o``,
    1 or -1.  With the normal ``w = o u x v`` two polyhedra are apart if the gap ``w.(q - p) / |w|``
    is positive, the first lies below its edge (``left1``, ``right1``) and the second above its
    own (``left2``, ``right2``), and the edges are not parallel (``angle``).
    """
    letters = [(one, "pulr"), (two, "qvmk")]
    parameters = [n for frame, some in letters for c in some for n in numbers(c, frame, 3)]
    formulas = partial(_crossing, one, two)
    return _family(CROSSING, one, two, 3, [*parameters, "o"], formulas, "crossing")


def _crossing(one: Frame, two: Frame) -> "Formulas":
    import sympy

    names = ("wx", "wy", "wz", "ww", "least")
    wx, wy, wz, ww, least = symbols(names)
    (o,) = symbols(["o"])
    u, v = _along("u", FIRST, one, 3), _along("v", SECOND, two, 3)
    w = tuple(o * c for c in cross(u, v))
    parallel = 1e-9  # sine between the directions of edges below which they separate nothing
    bound = parallel**2 * dot(u, u) * dot(v, v)
    normal = (wx, wy, wz)
    definitions = dict(zip(names, (*w, dot(normal, normal), bound), strict=True))
    apart = dot(normal, minus(_at("q", SECOND, two, 3), _at("p", FIRST, one, 3)))
    size = sympy.sqrt(sympy.Piecewise((ww, ww >= least), (least, True)))
    below = {
        name: -dot(normal, _along(letter, FIRST, one, 3))
        for name, letter in zip(SUPPORTS[:2], "lr", strict=True)
    }
    above = {
        name: dot(normal, _along(letter, SECOND, two, 3))
        for name, letter in zip(SUPPORTS[2:], "mk", strict=True)
    }
    return definitions, {"gap": apart / size, **below, **above, "angle": ww - least}


@lru_cache(maxsize=16)
def hollow(one: Frame, d: int, count: int = 0) -> Family:
    """Return the gap of a point and a cylinder or sphere around it, with ``count`` waves.

    Parameters: ``p`` of 1; centre ``c`` and axis ``w`` (a unit vector; zero for a sphere or a
    circle) in space; the radius ``s``.  With the distance ``r`` from the axis the gap is
    ``(s^2 - r^2) / (2 s)``: smooth, and the distance to first order where it vanishes.

    With waves there are the directions ``e`` and ``f`` of the azimuths 0 and a quarter turn, and
    the harmonic ``k``, amplitude ``z`` and phase ``o`` of each.  At an azimuth where the radius is
    ``t = s + sum z cos(k phi + o)``, of derivative ``t'``, the gap is ``(t^2 - r^2) / (2 sqrt(t^2 +
    t'^2))``, again the distance to first order where it vanishes.
    """
    still = Frame.FIXED
    parameters = [*numbers("p", one, d), *numbers("c", still, d), *numbers("w", still, d), "s"]
    if count:
        parameters += [*numbers("e", still, d), *numbers("f", still, d)]
        parameters += [f"{letter}{j}" for j in range(count) for letter in "kzo"]
    formulas = partial(_hollow, one, d, count)
    return _family(("gap",), one, still, d, parameters, formulas, ("hollow", count))


def _hollow(one: Frame, d: int, count: int) -> "Formulas":
    import sympy

    still = Frame.FIXED
    (s,) = symbols(["s"])
    axis, e, f = (_along(letter, SECOND, still, d) for letter in "wef")
    away = minus(_at("p", FIRST, one, d), _at("c", SECOND, still, d))
    squared = dot(away, away) - dot(away, axis) ** 2
    if not count:
        return {}, {"gap": (s**2 - squared) / (2 * s)}
    (azimuth,) = symbols(["azimuth"])
    outward, slope = waves(azimuth, harmonics(count))
    definitions = {"azimuth": sympy.atan2(dot(away, f), dot(away, e)), "t": s + outward}
    (t,) = symbols(["t"])
    return definitions, {"gap": (t**2 - squared) / (2 * sympy.sqrt(t**2 + slope**2))}
