"""Where bodies touch in space: points and normals of contacts, from the shapes of the bodies.

They follow from nearest points and not from the formulas of gaps, whose gradients and slips they
have to agree with.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from polycorner.bodies.frames import Frame
from polycorner.bodies.pairs import PlacedPart, Touch, can_cross
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Facets, hull_distance
from polycorner.bodies.slips import rolling_arm
from polycorner.bodies.walls import HalfSpace, Wall, WallTouch
from polycorner.bodies.waves import waves
from polycorner.motion.hulls.contacts import HullContacts
from polycorner.motion.scenes import Scene, Site
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import cached_property

Twins = tuple[Sequence[Placement], Sequence[Touch], HullContacts | None]


@dataclass(frozen=True, eq=False)
class BodiesInSpace(Scene):
    """The bodies of an arrangement, and their contacts.

    Attributes
    ----------
    placements : tuple of Placement
    touches : tuple of Touch
        Contacts of different bodies.
    at_walls : tuple of WallTouch
    walls : frozenset of str
    count : int
        How often the only body is repeated.
    twins : function
        Returns the placements of two bodies like it and their contacts.
    hulls : sequence of (HullContacts, (str, str))
        Contacts of sharp bodies, and the names of the two.
    """

    placements: tuple[Placement, ...]
    touches: tuple[Touch, ...]
    at_walls: tuple[WallTouch, ...]
    walls: frozenset[str]
    count: int
    twins: Callable[[], Twins]
    hulls: Sequence[tuple[HullContacts, tuple[str, str]]] = ()

    @cached_property
    def names(self) -> tuple[str, ...]:  # type: ignore[override] # it is not written
        """Names of all bodies; of those that are repeated that of the one and a number from 1."""
        names = tuple(p.name for p in self.placements)
        if self.count == 1:
            return names
        kind = "" if names[0].isdigit() else f"{names[0]} "  # no name but a number
        return tuple(f"{kind}{k}" for k in range(1, self.count + 1))

    @cached_property
    def _between(self) -> dict[str, tuple[Touch, Mapping[str, Placement]]]:
        """The contacts of bodies, and where the coordinates of the two stand."""
        own = {p.name: p for p in self.placements}
        found: dict[str, tuple[Touch, Mapping[str, Placement]]] = {
            t.gap.name: (t, own) for t in self.touches
        }
        if self.count > 1:
            (one, two), touches, _ = self.twins()
            n = one.manifold.size
            pair = {one.name: one, two.name: replace(two, at=slice(n, 2 * n))}
            found |= {t.gap.name: (t, pair) for t in touches}
        return found

    @cached_property
    def _at_walls(self) -> dict[str, WallTouch]:
        return {touch.gap.name: touch for touch in self.at_walls}

    @cached_property
    def lever(self) -> Array:
        """How far a unit of each coordinate turns points of the hulls of a body.

        An angle by their distance from the origin, a quaternion by twice that.
        """
        found = []
        for p in self.placements:
            far = max(float(np.linalg.norm(m.points, axis=1).max()) for m in p.body.parts.values())
            turn = {Frame.SHIFTED: 0.0, Frame.ROTATED: 2 * far}.get(p.frame, far)
            d = p.body.dimension
            found += d * [0.0] + (p.manifold.size - d) * [turn]
        return np.array(found)

    @cached_property
    def can_cross(self) -> bool:  # type: ignore[override] # it is not written
        """Whether two of the bodies, or one and a fixed body, may cross unnoticed by gaps."""
        return any(self._crossing.values())

    @cached_property
    def _crossing(self) -> dict[int, list[tuple[Touch, Mapping[str, Placement]]]]:
        """Contacts of parts that may cross, of one body and of two, one for each pair of parts."""
        found: dict[int, dict[frozenset[str], tuple[Touch, Mapping[str, Placement]]]]
        found = {1: {}, 2: {}}
        for t, placements in self._between.values():
            if can_cross(t.one, t.two):
                several = self.count > 1 and bool(t.one.coordinates and t.two.coordinates)
                found[1 + several][frozenset((t.one.name, t.two.name))] = t, placements
        return {n: [*pairs.values()] for n, pairs in found.items()}

    def crossed(self, bodies: tuple[int, ...], q: Array) -> tuple[str, ...]:
        """Return the names of two that cross each other; empty if none do."""
        own = q[list(bodies)].ravel()
        for t, placements in self._crossing[len(bodies)]:
            first = _placed(t.one, t.one.part.points, placements, own)
            second = _placed(t.two, t.two.part.points, placements, own)
            away = _to_image(t.one, t.two, placements, own)
            size = float(np.ptp(first, axis=0).max())
            if hull_distance(first, second + away) <= DEFAULT.same * size:
                return self._called(t.one, bodies), self._called(t.two, bodies)
        return ()

    def parties(self, bodies: tuple[int, ...], contact: str) -> tuple[str, ...]:
        """Return the names of the two that touch at a contact of bodies; empty if not known."""
        if contact in self._at_walls:
            member, two = self._at_walls[contact].member, self._at_walls[contact].name
            return self._called(member, bodies), two
        if contact in self._between:
            t, _ = self._between[contact]
            return self._called(t.one, bodies), self._called(t.two, bodies)
        if len(bodies) == 2:
            return self.names[bodies[0]], self.names[bodies[1]]
        if contact not in self._of_hulls:
            return ()
        names = self._of_hulls[contact][1]
        moving = {p.name for p in self.placements} if self.count > 1 else {}
        one, two = (self.names[bodies[0]] if name in moving else name for name in names)
        return one, two

    @cached_property
    def _of_hulls(self) -> dict[str, tuple[HullContacts, tuple[str, str]]]:
        """The contacts of sharp bodies; of repeated ones among each other as well."""
        more = self.twins()[2] if self.count > 1 else None
        every = [*self.hulls, *([] if more is None else [(more, ("", ""))])]
        return {name: one for one in every for name in one[0].names}

    def _called(self, m: PlacedPart, bodies: tuple[int, ...]) -> str:
        """Return the name of a body, where it is repeated that of one of those at the contact."""
        if self.count == 1 or not m.coordinates:
            return m.body
        is_second = len(bodies) > 1 and m.body == f"{self.placements[0].name}2"
        return self.names[bodies[int(is_second)]]

    def site(self, bodies: tuple[int, ...], contact: str, q: Array) -> Site | None:
        """Return where a contact of bodies is; None if it is not known."""
        if not (names := self.parties(bodies, contact)):
            return None
        a, b = names
        own = q[list(bodies)].ravel()
        if contact in self._at_walls:
            _, member, local, wall, _ = self._at_walls[contact]
            (p,) = _placed(member, local[None], {x.name: x for x in self.placements}, own)
            normal, radius = _inward(wall, p), member.part.radius
            return Site(a, b, p - radius * normal, normal, radius)
        if contact not in self._between:
            return self._at_hulls(names, contact, own)
        touch, placements = self._between[contact]
        one, two = touch.one, touch.two
        first = _placed(one, touch.first, placements, own)
        second = _placed(two, touch.second, placements, own)
        away = _to_image(one, two, placements, own)
        facets = _turned(two, placements, own) if len(second) > 2 else None
        p, normal = _nearest(first, second + away, facets)
        return Site(a, b, p - one.part.radius * normal, normal, rolling_arm(one.part, two.part))

    def _at_hulls(self, names: tuple[str, ...], contact: str, own: Array) -> Site | None:
        if contact not in self._of_hulls:
            return None
        hulls, (one, two) = self._of_hulls[contact][0], names
        known = [name for p in self.placements for name in p.manifold.names]
        if {*hulls.reads} <= {*known}:  # else those of two bodies that are alike
            own = own[[known.index(name) for name in hulls.reads]]
        point, normal = hulls.site(contact, own)
        # Friction is along the tangents of the normal to the second, which in space are not minus
        # those of its opposite: there the second comes first.
        if len(normal) == 2:
            return Site(one, two, point, -normal, 0.0)
        return Site(two, one, point, normal, 0.0)


@dataclass(frozen=True, eq=False)
class KindsInSpace(Scene):
    """Bodies of several kinds, numbered kind after kind, and their contacts.

    Attributes
    ----------
    alone : mapping from str to BodiesInSpace
        One body of each kind.
    count : mapping from str to int
    twins : function
        Returns the placements of two bodies of given kinds, and their contacts.
    """

    alone: Mapping[str, BodiesInSpace]
    count: Mapping[str, int]
    twins: Callable[[str, str], Twins]

    @cached_property
    def names(self) -> tuple[str, ...]:  # type: ignore[override] # it is not written
        """Names of all bodies: that of the kind and a number from 1."""
        return tuple(f"{kind} {k}" for kind, n in self.count.items() for k in range(1, n + 1))

    @cached_property
    def walls(self) -> frozenset[str]:  # type: ignore[override] # it is not written
        """Which names are those of walls."""
        return frozenset().union(*(one.walls for one in self.alone.values()))

    @cached_property
    def can_cross(self) -> bool:  # type: ignore[override] # it is not written
        """Whether there are bodies other than discs and balls."""
        every = [p.body for one in self.alone.values() for p in one.placements]
        return any(len(part.points) > 1 for body in every for part in body.parts.values())

    @cached_property
    def _kinds(self) -> list[str]:
        return [kind for kind, n in self.count.items() for _ in range(n)]

    @cached_property
    def _met(self) -> dict[tuple[str, str], BodiesInSpace]:
        return {}

    def _pair(self, one: str, two: str) -> BodiesInSpace:
        """Return two bodies of given kinds by themselves."""
        if (one, two) not in self._met:
            (p, q), touches, hulls = self.twins(one, two)
            n, listed = p.manifold.size, () if hulls is None else ((hulls, (p.name, q.name)),)
            placed = (replace(p, at=slice(n)), replace(q, at=slice(n, n + q.manifold.size)))
            pair = BodiesInSpace(placed, tuple(touches), (), frozenset(), 1, _never, listed)
            self._met[one, two] = pair
        return self._met[one, two]

    def _alone(self, bodies: tuple[int, ...]) -> BodiesInSpace:
        kinds = [self._kinds[i] for i in bodies]
        return self.alone[kinds[0]] if len(bodies) == 1 else self._pair(kinds[0], kinds[1])

    def parties(self, bodies: tuple[int, ...], contact: str) -> tuple[str, ...]:
        """Return the names of the two that touch at a contact of bodies; empty if not known."""
        called = self._called(bodies)
        return tuple(called.get(n, n) for n in self._alone(bodies).parties((0,), contact))

    def _called(self, bodies: tuple[int, ...]) -> dict[str, str]:
        """Return what bodies by themselves are called among all."""
        ours = (self.names[i] for i in bodies)
        return dict(zip(self._alone(bodies).names, ours, strict=True))

    def crossed(self, bodies: tuple[int, ...], q: Array) -> tuple[str, ...]:
        """Return the names of two that cross each other; empty if none do."""
        called = self._called(bodies)
        found = self._alone(bodies).crossed((0,), self._places(bodies, q))
        return tuple(called.get(n, n) for n in found)

    def _places(self, bodies: tuple[int, ...], q: Array) -> Array:
        """Return the coordinates of bodies by themselves, ``(1, k)``."""
        sizes = [p.manifold.size for p in self._alone(bodies).placements]
        return np.concatenate([q[i, :n] for i, n in zip(bodies, sizes, strict=True)])[None]

    def site(self, bodies: tuple[int, ...], contact: str, q: Array) -> Site | None:
        """Return where a contact of bodies is; None if it is not known."""
        scene = self._alone(bodies)
        found = scene.site((0,), contact, self._places(bodies, q))
        if found is None:
            return None
        called = self._called(bodies)
        one, two = (called.get(name, name) for name in (found.one, found.two))
        return found._replace(one=one, two=two)


def _inward(wall: Wall, p: Array) -> Array:
    """Return the unit normal of a wall where a point ``(d,)`` of a body is nearest to it."""
    if isinstance(wall, HalfSpace):
        return wall.normal
    away = p - wall.point
    if wall.axis is not None:
        away = away - (away @ wall.axis) * wall.axis
    if wall.waves:
        x, y = wall.around @ away
        _, slope = waves(math.atan2(y, x), [(k, *wave) for k, wave in wall.waves.items()])
        away = away - np.array([-y, x]) @ wall.around * float(slope) / math.hypot(x, y)
    return np.asarray(-away / np.linalg.norm(away))


def _pose(m: PlacedPart, placements: Mapping[str, Placement], q: Array) -> tuple[Array, Array]:
    d = m.part.dimension
    return placements[m.body].pose(q) if m.coordinates else (np.zeros(d), np.eye(d))


def _placed(m: PlacedPart, points: Array, placements: Mapping[str, Placement], q: Array) -> Array:
    origin, matrix = _pose(m, placements, q)
    return np.asarray(origin + points @ matrix.T)


def _turned(m: PlacedPart, placements: Mapping[str, Placement], q: Array) -> Facets | None:
    """Return the facets of a part, with the normals that they have in space."""
    _, matrix = _pose(m, placements, q)
    f = m.part.facets
    return None if f is None else Facets(f.faces, f.normals @ matrix.T, f.edges)


def _to_image(
    one: PlacedPart, two: PlacedPart, placements: Mapping[str, Placement], q: Array
) -> Array:
    """Return the displacement of the second part to the image that touches the first."""
    if one.image is None and two.image is None:
        return np.zeros(one.part.dimension)
    image, sign = (two.image, 1.0) if two.image is not None else (one.image, -1.0)
    assert image is not None, two.name
    shift = sign * image.shift
    if one.body == two.body:
        return np.asarray(shift)
    a, b = (_placed(m, m.middle[None], placements, q)[0] for m in (one, two))
    axes = list(image.axes)
    shift = shift.copy()
    shift[axes] += image.periods[axes] * np.round((a - b - shift)[axes] / image.periods[axes])
    return np.asarray(shift)


def _nearest(first: Array, second: Array, facets: Facets | None) -> tuple[Array, Array]:
    """Return the point of the first hull nearest to the second, and the unit vector towards it.

    The first is a point, or a segment if the second is one.  Three cases: the nearest point of the
    second is on an edge; over a face; the hulls touch, and the normal is that of the nearest face.
    """
    if len(first) == 2:
        p, foot = _nearest_of_segments(first, second)
    else:
        p = first[0]
        foot = _nearest_on(p, second, facets)
    away = p - foot
    size = float(np.linalg.norm(away))
    extent = float(np.abs(second - first[0]).max(initial=size))
    if size > DEFAULT.alike * extent:
        return p, away / size
    if facets is not None:
        starts = second[[face[0] for face in facets.faces]]
        heights = ((p - starts) * facets.normals).sum(axis=1)
        return p, facets.normals[int(np.argmax(heights))]
    normal = np.cross(first[-1] - first[0], second[-1] - second[0])
    return p, normal / np.linalg.norm(normal)


def _nearest_on(p: Array, points: Array, facets: Facets | None) -> Array:
    """Return the point of a hull, given by its vertices, that is nearest to a point outside."""
    if facets is None:
        return points[0] if len(points) == 1 else _foot(p, points[0], points[1])
    planar = len(p) == 2
    edges = facets.faces if planar else tuple(edge[:2] for edge in facets.edges)
    feet = [_foot(p, points[e[0]], points[e[1]]) for e in edges]
    for face, normal in zip(() if planar else facets.faces, facets.normals, strict=False):
        corners = points[list(face)]
        height = normal @ (p - corners[0])
        along = np.roll(corners, -1, axis=0) - corners
        if height > 0 and (np.cross(along, p - corners) @ normal >= 0).all():
            feet.append(p - height * normal)
    return min(feet, key=lambda foot: float(np.linalg.norm(p - foot)))


def _nearest_of_segments(first: Array, second: Array) -> tuple[Array, Array]:
    """Return the nearest points of two segments: both inside them, or one of them an end."""
    pairs = [(p, _foot(p, *second)) for p in first]
    pairs += [(_foot(q, *first), q) for q in second]
    u, v = first[1] - first[0], second[1] - second[0]
    found, _, rank, _ = np.linalg.lstsq(np.column_stack([u, -v]), second[0] - first[0], rcond=None)
    if rank == 2 and (found >= 0).all() and (found <= 1).all():
        pairs.append((first[0] + found[0] * u, second[0] + found[1] * v))
    return min(pairs, key=lambda pair: float(np.linalg.norm(pair[0] - pair[1])))


def _foot(p: Array, start: Array, end: Array) -> Array:
    along = end - start
    at = (p - start) @ along / (along @ along)
    return np.asarray(start + min(1.0, max(0.0, float(at))) * along)


def _never() -> Twins:
    """Stand for the twins of bodies that are not repeated."""
    raise AssertionError
