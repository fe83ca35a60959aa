"""Two parts are apart: the and/or tree of gaps that says so.

Two hulls with interiors do not overlap if and only if a face of one of them separates them, or in
space a plane along an edge of each (the separating axis theorem, [Er] ch. 4): a union of
intersections of smooth functions.  Rounded hulls with the radii ``r`` and ``s`` do not overlap if
and only if the distance of the hulls is at least ``r + s``: an intersection of distances of
features.  These are also large where the hulls cross each other or one contains the other; the
union, which is then never active, excludes that.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from polycorner.bodies import gaps
from polycorner.bodies.chains import Chain
from polycorner.bodies.frames import Frame
from polycorner.bodies.gaps import FIRST, SECOND
from polycorner.bodies.images import Image, nearest_image, own
from polycorner.bodies.lattices import middle
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body, Part
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Value

Tree = AllOf | AnyOf | SmoothFunction


@dataclass(frozen=True, eq=False)
class PlacedPart(Value):
    """A part of a body in an arrangement.

    Attributes
    ----------
    body, name : str
        Name of the body; and that of the part after it and a dot.
    part : Part
    frame : Frame
    axis : (d,) array, optional
        That of an axial body.
    coordinates : tuple of str
        Names of the body's coordinates; empty for fixed ones.
    middle : (d,) array
        A point of the body, of fixed ones of the part.
    image : Image, optional
        In a periodic box, which image it is.
    chain : Chain, optional
        Of a link: how joints place it.
    """

    body: str
    name: str
    part: Part
    frame: Frame
    axis: Array | None
    coordinates: tuple[str, ...]
    middle: Array
    image: Image | None = None
    chain: Chain | None = None

    def at(self, mark: str, image: Image) -> "PlacedPart":
        """Return an image of it, with a mark on the name of the body."""
        name = self.body + mark + self.name[len(self.body) :]
        return replace(self, name=name, image=image)

    def numbers(self, *vectors: Array) -> list[float]:
        """Return the parameters of formulas for points and vectors of the body."""
        return [x for v in vectors for x in self.frame.local(v.tolist(), self.axis)]

    def vertex(self, i: int) -> str:
        """Return what a point is called: the part itself if it has only one."""
        return f"{self.name}.v{i + 1}" if len(self.part.points) > 1 else self.name


def members(name: str, body: Body, placement: Placement | None) -> list[PlacedPart]:
    """Return the parts of a body, fixed if it has no coordinates."""
    frame = Frame.FIXED if placement is None else placement.frame
    coordinates = () if placement is None else placement.manifold.names
    return [
        PlacedPart(
            name,
            f"{name}.{part}" if part else name,
            shape,
            frame,
            body.axis,
            coordinates,
            middle(shape.points if placement is None else body.markers),
        )
        for part, shape in body.parts.items()
    ]


def function_of(
    manifold: Manifold,
    family: Family,
    one: PlacedPart,
    two: PlacedPart | None,
    parameters: list[float],
    label: str,
    member: str = "gap",
) -> SmoothFunction:
    """Return a member of a family as a function of what it reads of two bodies.

    Of two links one has the chain that leads to it from the other, which is fixed.
    """
    if chain := one.chain or (two and two.chain):
        return chain.function(manifold, family, parameters, label, member)
    if two is not None and (one.image or two.image):
        family, further = _imaged(family, one, two)
        parameters = parameters + further
    reads = [
        name.replace(FIRST, one.body)
        if two is None or FIRST in name
        else name.replace(SECOND, two.body)
        for name in family.variables
    ]
    return SmoothFunction.member(
        family, member, manifold, parameters=parameters, reads=reads, label=label
    )


def _imaged(family: Family, one: PlacedPart, two: PlacedPart) -> tuple[Family, list[float]]:
    """Return the family of functions of images, and its further parameters."""
    d = one.part.dimension
    image, sign = (one.image, 1.0) if one.image else (two.image, -1.0)
    assert image is not None, two.name
    shift = (sign * image.shift).tolist()
    if one.body == two.body:
        return own(family, one.frame, d), shift
    lengths = image.periods[list(image.axes)].tolist()
    eccentric = (bool(one.middle.any()), bool(two.middle.any()))
    middles = [x for m in (one, two) if m.middle.any() for x in m.numbers(m.middle)]
    made = nearest_image(family, one.frame, two.frame, d, image.axes, eccentric)
    return made, [*middles, *shift, *lengths]


def both_sharp(one: PlacedPart, two: PlacedPart) -> bool:
    """Whether neither of two parts is rounded."""
    return one.part.radius + two.part.radius == 0


def apart(manifold: Manifold, one: PlacedPart, two: PlacedPart, *, excluded: bool = True) -> Tree:
    """Return the gaps of two parts.

    ``excluded`` says whether a union excludes rounded hulls that cross; motions, which start
    elsewhere, do without.
    """
    if one.frame is Frame.FIXED:
        one, two = two, one
    if both_sharp(one, two):
        return separated(manifold, one, two)
    parts: list[Tree] = [touch.gap for touch in distances(manifold, one, two)]
    if excluded and can_cross(one, two):
        parts.append(separated(manifold, one, two))
    return parts[0] if len(parts) == 1 else AllOf(*parts)


def can_cross(one: PlacedPart, two: PlacedPart) -> bool:
    """Whether the distances are also large for hulls that cross; not of two rods in space."""
    if min(len(one.part.points), len(two.part.points)) == 1 or _are_parallel(one, two):
        return False
    return one.part.dimension == 2 or bool(one.part.facets or two.part.facets)


def _are_parallel(one: PlacedPart, two: PlacedPart) -> bool:
    """Whether they are a rod and its own image."""
    return one.part is two.part and one.body == two.body and len(one.part.points) == 2


class Touch(NamedTuple):
    """The gap of two parts, and which of their features it is the distance of.

    Features are one point ``(1, d)``, two ends of an edge ``(2, d)``, or all points of a hull.
    """

    gap: SmoothFunction
    one: PlacedPart
    first: Array
    two: PlacedPart
    second: Array


def distances(manifold: Manifold, one: PlacedPart, two: PlacedPart) -> Iterator[Touch]:
    """Yield the gaps of two parts of which one is rounded."""
    radius = one.part.radius + two.part.radius
    a, b, d = one.part.points, two.part.points, one.part.dimension
    if len(a) == len(b) == 1:
        numbers = [*one.numbers(a[0]), *two.numbers(b[0]), radius]
        family = gaps.points(one.frame, two.frame, d)
        function = function_of(manifold, family, one, two, numbers, f"{one.name}-{two.name}")
        yield Touch(function, one, a, two, b)
        return
    if d == 3 and len(a) > 1 and len(b) > 1:
        yield from _rods(manifold, one, two, radius)
    else:
        yield from _from_segment(manifold, one, two, radius)
        # A rod and its image exchange their ends when turned about the point between them.
        if not _are_parallel(one, two):
            yield from _from_segment(manifold, two, one, radius)
    yield from _from_hull(manifold, one, two, radius)
    yield from _from_hull(manifold, two, one, radius)


def _from_segment(
    manifold: Manifold, one: PlacedPart, two: PlacedPart, radius: float
) -> Iterator[Touch]:
    """Distances of the points of one part from the other, which is a segment."""
    if len(two.part.points) != 2:
        return
    family = gaps.segment(one.frame, two.frame, one.part.dimension)
    for i, p in enumerate(one.part.points):
        numbers = [*one.numbers(p), *two.numbers(*two.part.points), radius]
        function = function_of(manifold, family, one, two, numbers, f"{one.vertex(i)}-{two.name}")
        yield Touch(function, one, p[None], two, two.part.points)


def _from_hull(
    manifold: Manifold, one: PlacedPart, two: PlacedPart, radius: float
) -> Iterator[Touch]:
    """Distances of the points of one part from the other, which has faces."""
    facets = two.part.facets
    if facets is None:
        return
    d, vertices = two.part.dimension, two.part.points
    edges = facets.faces if d == 2 else tuple((i, j) for i, j, _, _ in facets.edges)
    family = gaps.hull(one.frame, two.frame, d, len(vertices), facets.faces, edges)
    shape = [*vertices.ravel().tolist(), *facets.normals.ravel().tolist()]
    for i, p in enumerate(one.part.points):
        numbers = [*one.numbers(p), *shape, radius]
        function = function_of(manifold, family, one, two, numbers, f"{one.vertex(i)}-{two.name}")
        yield Touch(function, one, p[None], two, two.part.points)


def _rods(manifold: Manifold, one: PlacedPart, two: PlacedPart, radius: float) -> Iterator[Touch]:
    """Distances of all edges in space."""
    family = gaps.segments(one.frame, two.frame)
    for (i, first), (j, second) in product(_edges(one), _edges(two)):
        numbers = [*one.numbers(*first), *two.numbers(*second), radius]
        function = function_of(manifold, family, one, two, numbers, f"{one.name}{i}-{two.name}{j}")
        yield Touch(function, one, first, two, second)


def _edges(member: PlacedPart) -> list[tuple[str, Array]]:
    """Return the ends of all edges with the ends of their names; a segment is its own edge."""
    points, facets = member.part.points, member.part.facets
    if facets is None:
        return [("", points)]
    return [(f".e{k + 1}", points[[i, j]]) for k, (i, j, _, _) in enumerate(facets.edges)]


def separated(manifold: Manifold, one: PlacedPart, two: PlacedPart) -> Tree:
    """Return the union over all planes that may separate two hulls, segments included."""
    first, second = _faces(one.part), _faces(two.part)
    if not (one.frame.turns or two.frame.turns):
        # A face and its opposite of the other body are parallel for good, and say the same.
        first = [f for f in first if all(f.normal @ g.normal > DEFAULT.alike - 1 for g in second)]
    branches = [_outside(manifold, one, two, face) for face in second]
    branches += [_outside(manifold, two, one, face) for face in first]
    if one.part.dimension == 3:
        branches += _by_edges(manifold, one, two)
    return AnyOf(*branches)


class _Face(NamedTuple):
    name: str
    point: Array
    normal: Array


def _faces(part: Part) -> list[_Face]:
    """Return the faces of a part; in the plane both sides of a segment."""
    points, facets = part.points, part.facets
    if facets is None and part.dimension == 3:
        return []
    if facets is None:
        along = points[1] - points[0]
        normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        found = [(points[0], normal), (points[0], -normal)]
    else:
        starts = [points[face[0]] for face in facets.faces]
        found = list(zip(starts, facets.normals, strict=True))
    letter = "e" if part.dimension == 2 else "f"
    return [_Face(f"{letter}{f + 1}", *some) for f, some in enumerate(found)]


def _outside(manifold: Manifold, one: PlacedPart, two: PlacedPart, face: _Face) -> Tree:
    """All points of the first are outside of a face of the second."""
    family = gaps.side(one.frame, two.frame, two.part.dimension)
    numbers = [*two.numbers(face.point, face.normal), 0.0]
    label = f"{two.name}.{face.name}-{one.name}"
    lowest = nearest(one, face.normal, turning=two.frame.turns)
    some = [
        function_of(manifold, family, one, two, [*one.numbers(p), *numbers], f"{label}.v{i + 1}")
        for i, p in lowest
    ]
    return some[0] if len(some) == 1 else AllOf(*some)


def nearest(member: PlacedPart, normal: Array, *, turning: bool) -> list[tuple[int, Array]]:
    """Return the points of a part, with their numbers, that may be nearest to a plane.

    If neither the plane nor the body turns it is always the same one.
    """
    points = member.part.points
    if turning or member.frame.turns:
        return list(enumerate(points))
    i = int(np.argmin(points @ normal))
    return [(i, points[i])]


def _by_edges(manifold: Manifold, one: PlacedPart, two: PlacedPart) -> Iterator[Tree]:
    """Pairs of edges, on either side, whose common perpendicular separates."""
    family = gaps.crossing(one.frame, two.frame)
    # A segment lies on both sides of each of its planes.
    flat = [k for k, member in enumerate((one, two)) if member.part.facets is None]
    needless = [name for k in flat for name in gaps.SUPPORTS[2 * k : 2 * k + 2]]
    conditions = [name for name in gaps.CROSSING if name not in needless]
    for (i, first), (j, second) in product(
        enumerate(_supports(one.part)), enumerate(_supports(two.part))
    ):
        for side in (1.0, -1.0):
            numbers = [*one.numbers(*first), *two.numbers(*second), side]
            sign = ">" if side > 0 else "<"
            label = f"{one.name}.e{i + 1}{sign}{two.name}.e{j + 1}"
            labels = [label, *(f"{label} {name}" for name in conditions[1:])]
            yield AllOf(
                *(
                    function_of(manifold, family, one, two, numbers, *some)
                    for some in zip(labels, conditions, strict=True)
                )
            )


def _supports(part: Part) -> list[tuple[Array, Array, Array, Array]]:
    """Return of every edge a point, its direction, and the ways from it into both faces."""
    points, facets = part.points, part.facets
    if facets is None:
        return [(points[0], points[1] - points[0], np.zeros(3), np.zeros(3))]
    found = []
    for i, j, left, right in facets.edges:
        along = points[j] - points[i]
        ways = (
            np.cross(facets.normals[left], along),
            -np.cross(facets.normals[right], along),
        )
        found.append((points[i], along, *ways))
    return found
