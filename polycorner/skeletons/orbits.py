"""Orbits of a finite group on the corners, edges and faces of a skeleton."""

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence

from polycorner.polyhedra.symmetry import Element, renamed
from polycorner.skeletons.curves import lies_on
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.spaces.manifold import Array

Orbits = tuple[tuple[int, ...], ...]
Nearby = Callable[[Array], Array]


def orbits(
    skeleton: Skeleton, elements: Sequence[Element], *, nearby: Nearby | None = None
) -> Mapping[str, Orbits]:
    """Return the orbits of a finite group on the corners, edges and faces of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton
        A skeleton without relabellings.
    elements : sequence of Element
        Generators suffice.
    nearby : callable, optional
        ``(n,) -> (k,)``, for groups that carry one section of the polyhedron to another: numbers
        that change little from section to section.  The image of a corner is then the one with
        the right active functions that is nearest in these numbers.

    Returns
    -------
    mapping with the keys ``corners``, ``edges`` and ``faces``
        Each a tuple of orbits, an orbit being the positions of its members.

    Raises
    ------
    ValueError
        If the image of a corner, edge or face is not in the skeleton: the group is no symmetry, or
        the skeleton is not complete.
    """
    images = _Images(skeleton, nearby)
    counts = {
        "corners": (len(skeleton.corners), images.corner),
        "edges": (len(skeleton.edges), images.edge),
        "faces": (len(skeleton.faces), images.face),
    }
    return {kind: _grouped(n, elements, image) for kind, (n, image) in counts.items()}


def _grouped(
    count: int, elements: Sequence[Element], image: Callable[[int, Element], int | None]
) -> Orbits:
    from networkx.utils import UnionFind

    sets = UnionFind(range(count))
    for k in range(count):
        for g in elements:
            other = image(k, g)
            if other is None:
                msg = "elements: expected symmetries of the skeleton; an image is not in it"
                raise ValueError(msg)
            sets.union(k, other)
    groups: dict[int, list[int]] = {}
    for k in range(count):
        groups.setdefault(sets[k], []).append(k)
    return tuple(map(tuple, groups.values()))


class _Images:
    """Images of the parts of a skeleton under elements of the group."""

    def __init__(self, skeleton: Skeleton, nearby: Nearby | None) -> None:
        self.skeleton, self.nearby = skeleton, nearby
        self.explorer = Explorer.resumed(skeleton.state)
        self.names = self.explorer.registry.names
        self.faces = {_signature(f.active, f.boundary): k for k, f in enumerate(skeleton.faces)}

    def corner(self, k: int, g: Element) -> int | None:
        """Return the image of a corner."""
        records = self.explorer.records
        active = renamed(self.names(records[k].active), g.names)
        alike = [j for j, other in enumerate(records) if self.names(other.active) == active]
        same = self.explorer.quotient.tolerances.corner
        return self._nearest(
            g.apply(records[k].point.q), [(j, records[j].point.q) for j in alike], same
        )

    def edge(self, k: int, g: Element) -> int | None:
        """Return the image of an edge."""
        curve = self.explorer.curves[k]
        active = renamed(self.names(curve.active), g.names)
        if curve.start is None:
            alike = [c for c in self.explorer.curves if c.start is None]
            moved = g.apply(curve.middle)
            for other in alike:
                if self.names(other.active) == active and lies_on(
                    self.explorer.quotient, moved, other
                ):
                    return self.explorer.curves.index(other)
            return None
        corner = self.corner(curve.start[0], g)
        if corner is None:
            return None
        ray = self.explorer.records[curve.start[0]].figure.rays[curve.start[1]]
        record = self.explorer.records[corner]
        rays = [
            (i, other.sample.q)
            for i, other in enumerate(record.figure.rays)
            if self.names(other.active) == active
        ]
        found = self._nearest(g.apply(ray.sample.q), rays, 0.2 * ray.distance)
        return None if found is None else record.edges.get(record.orbit[found])

    def face(self, k: int, g: Element) -> int | None:
        """Return the image of a face."""
        face = self.skeleton.faces[k]
        boundary = [[self.edge(e, g) for e in curve] for curve in face.boundary]
        return self.faces.get(_signature(renamed(frozenset(face.active), g.names), boundary))

    def _nearest(self, q: Array, among: list[tuple[int, Array]], limit: float) -> int | None:
        """Return which of some points is the same as ``q``, or nearest to it."""
        if not among:
            return None
        apart = sorted((self._apart(q, p), k) for k, p in among)
        return apart[0][1] if self.nearby is not None or apart[0][0] <= limit else None

    def _apart(self, p: Array, q: Array) -> float:
        if self.nearby is not None:
            return float(abs(self.nearby(p) - self.nearby(q)).max())
        symmetry, manifold = self.explorer.symmetry, self.explorer.manifold
        return min(symmetry.separation(manifold, g.apply(p), q) for g in symmetry.group)


def _signature(active: Iterable[str], boundary: Iterable[Iterable[int | None]]) -> Hashable:
    return frozenset(active), frozenset(frozenset(curve) for curve in boundary)
