"""A frozen skeleton from what a search found."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from polycorner.polyhedra.strata import stratum_of
from polycorner.polyhedra.symmetry import renamed
from polycorner.skeletons.elements import Completeness, Corner, Edge, Face, Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.flags import Flag
from polycorner.skeletons.registry import CornerRecord
from polycorner.skeletons.walks import End

if TYPE_CHECKING:
    from networkx.utils import UnionFind


def assembled(explorer: Explorer, complete: Completeness) -> Skeleton:
    """Return the skeleton as far as it was found."""
    faces, components = _faces(explorer)
    corners = tuple(_corner(explorer, record) for record in explorer.records)
    edges = tuple(
        Edge(
            active=_ordered(explorer, explorer.registry.names(curve.active)),
            ends=(
                curve.start[0] if curve.start is not None else None,
                curve.stop[0] if curve.stop is not None else None,
            ),
            kinds=curve.kinds,
            polyline=curve.points,
            quotient=explorer.quotient,
        )
        for curve in explorer.curves
    )
    return Skeleton(
        polyhedron=explorer.polyhedron,
        corners=corners,
        edges=edges,
        faces=faces,
        complete=complete,
        notes=tuple(explorer.notes),
        components=components,
        whole=_whole(explorer),
        state=explorer.state,
    )


def _whole(explorer: Explorer) -> bool:
    """Whether faces and Euler characteristic can be trusted everywhere."""
    if explorer.symmetry.relabels:
        return False
    for record in explorer.records:
        figure = record.figure
        flags = [(i, sector.active) for sector in figure.sectors for i in sector.rays]
        if max(Counter(flags).values(), default=0) > 1:
            return False
    return True


def _ordered(explorer: Explorer, names: frozenset[str]) -> tuple[str, ...]:
    return tuple(name for name in explorer.polyhedron.names if name in names)


def _corner(explorer: Explorer, record: CornerRecord) -> Corner:
    ends = [record.edges.get(representative) for representative in record.orbit]
    return Corner(
        point=explorer.manifold.wrap(record.point.q),
        stratum=stratum_of(
            explorer.polyhedron,
            record.point.q,
            record.point.values,
            record.point.gradients,
            explorer.quotient.tolerance,
        ),
        singular=record.figure.singular,
        edges=tuple(end for end in ends if end is not None),
    )


def _faces(explorer: Explorer) -> tuple[tuple[Face, ...], dict[int, int]]:
    """Assemble faces: flags that meet at corners and along edges, then crossings."""
    from networkx.utils import UnionFind

    flags = dict.fromkeys(_flags(explorer))
    boundary, surface = UnionFind(flags), UnionFind(flags)
    broken: list[Flag] = []
    for one, other in _joins(explorer):
        if one in flags and other in flags:
            boundary.union(one, other)
            surface.union(one, other)
        elif one in flags:
            broken.append(one)
    for crossing in explorer.crossings:
        surface.union(crossing.start, crossing.stop)
    loose = {boundary[flag] for flag in [*broken, *_ends(explorer, flags)]}
    faces = []
    for group in _groups(surface, flags):
        curves = _groups(boundary, group)
        faces.append(
            Face(
                active=_ordered(explorer, group[0][2]),
                boundary=tuple(
                    tuple(sorted({_edge_of(explorer, flag) for flag in curve} - {-1}))
                    for curve in curves
                ),
                closed=not any(boundary[curve[0]] in loose for curve in curves),
            )
        )
    return tuple(faces), _components(explorer, flags, surface, len(faces))


def _groups(sets: "UnionFind", flags: Iterable[Flag]) -> list[list[Flag]]:
    """Return flags by set, in the order they come."""
    found: dict[Flag, list[Flag]] = {}
    for flag in flags:
        found.setdefault(sets[flag], []).append(flag)
    return list(found.values())


def _flags(explorer: Explorer) -> Iterator[Flag]:
    for k, record in enumerate(explorer.records):
        for s, sector in enumerate(record.figure.sectors):
            names = explorer.registry.names(sector.active)
            for i in sector.rays:
                yield ("half", (k, i), names)
            if not sector.rays:
                yield ("apex", (k, s), names)
    for k, curve in enumerate(explorer.curves):
        if curve.start is None:
            for face in explorer.faces_beside(k):
                yield explorer.flag(k, face)


def _joins(explorer: Explorer) -> Iterator[tuple[Flag, Flag]]:
    """Yield flags that belong to one boundary curve of one face."""
    for k, record in enumerate(explorer.records):
        yield from _joins_at(explorer, k, record)
    for curve in explorer.curves:
        if curve.start is not None:
            record = explorer.records[curve.start[0]]
            for sector in record.figure.sectors:
                if curve.start[1] in sector.rays:
                    face = explorer.registry.names(sector.active)
                    stop: Flag = ("half", curve.stop, renamed(face, curve.relabelled))
                    yield ("half", curve.start, face), stop


def _joins_at(explorer: Explorer, k: int, record: CornerRecord) -> Iterator[tuple[Flag, Flag]]:
    """Yield flags at one corner that one sector has, or that a relabelling exchanges."""
    active = [explorer.registry.names(ray.active) for ray in record.figure.rays]
    alike: dict[frozenset[str], list[int]] = {}
    for i, names in enumerate(active):
        alike.setdefault(names, []).append(i)
    # A relabelling that changes no name joins nothing.
    changes = [p for p in record.stabiliser if any(a != b for a, b in p.items())]
    images = [[alike.get(renamed(names, p), []) for names in active] for p in changes]
    for sector in record.figure.sectors:
        if not sector.rays:
            continue
        face = explorer.registry.names(sector.active)
        first, last = sector.rays
        yield ("half", (k, first), face), ("half", (k, last), face)
        for p, image in zip(changes, images, strict=True):
            moved = renamed(face, p)
            for ray in sector.rays:
                for other in image[ray]:
                    yield ("half", (k, ray), face), ("half", (k, other), moved)


def _ends(explorer: Explorer, flags: Iterable[Flag]) -> Iterator[Flag]:
    """Yield flags where a boundary curve has an end: at infinity, or not traced."""
    for flag in flags:
        if flag[0] == "curve":
            if explorer.curves[flag[1]].kinds[0] is not End.CLOSED:
                yield flag
        elif flag[0] == "half" and _edge_of(explorer, flag) < 0:
            yield flag


def _edge_of(explorer: Explorer, flag: Flag) -> int:
    if flag[0] == "curve":
        return int(flag[1])
    if flag[0] == "apex":
        return -1
    k, i = flag[1]
    record = explorer.records[k]
    found: int = record.edges.get(record.orbit[i], -1)
    return found


def _components(
    explorer: Explorer, flags: Iterable[Flag], surface: "UnionFind", faces: int
) -> dict[int, int]:
    from networkx.utils import UnionFind

    point = explorer.records[0].point if explorer.records else None
    if point is None and not explorer.curves:
        return {}
    if point is None:
        point = explorer.quotient.at(explorer.curves[0].points[0])
    fixed = len(point.matrix([])) - len(explorer.quotient.equations)
    free = explorer.manifold.dimension - len(point.matrix([]))
    counts = {fixed: len(explorer.records), fixed + 1: len(explorer.curves)}
    if free >= 2:
        counts[fixed + 2] = faces
    if free == 3 and not explorer.polyhedron.is_union and not explorer.symmetry.relabels:
        inside = UnionFind()
        for flag in flags:
            if flag[0] != "apex":
                inside.union(("edge", _edge_of(explorer, flag)), surface[flag])
        counts[fixed + 3] = len({inside[surface[flag]] for flag in flags})
    return counts
