"""A frozen skeleton from what a search found.

Pieces of faces that have tips, put together by nets.

Near a point an algebraic set is a cone over its link ([Mil] sec. 2), so that a face and the part of
it outside small balls about some of its points are connected alike.  That part is smooth where the
gradients of the functions that vanish on the face are dependent at these points only, and a net
that begins at one of its points covers the component of this point.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from polycorner.polyhedra.strata import stratum_of
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.incidences import (
    Flag,
    Partition,
    edge_of,
    flags_of,
    groups_of,
    joins_of,
    mask_of,
    masked,
    positions_in,
    untold,
)
from polycorner.skeletons.nets import Border, Net, Tip, balls_about, seeds_of
from polycorner.skeletons.parts import Completeness, Contact, Corner, Edge, Face
from polycorner.skeletons.probing import Anchor
from polycorner.skeletons.registry import FoundCorner
from polycorner.skeletons.surfaces import Surface
from polycorner.skeletons.vertex_figures import Ray, Sector
from polycorner.skeletons.walks import End
from polycorner.spaces.manifold import Array


def tip_of(explorer: Explorer, record: FoundCorner, sector: Sector) -> Tip | None:
    """Return the tip of a face at a corner; None where no point of the face near it is known."""
    rays = [record.figure.rays[i] for i in sector.rays]
    beside = sector.sample or (rays[0].sample if rays else None)
    if beside is None:
        return None
    point, held = record.point, sector.held
    fewer = len(point.basis(held)) < len(explorer.quotient.at(beside.q).basis(held))
    ways = tuple(ray.direction for ray in rays)
    return Tip(point.q, beside.q, ways, sector.sample is not None, fewer)


def pointed_faces(explorer: Explorer) -> dict[int, list[Tip]]:
    """Return the tips of faces that are not smooth at one of them, by their functions.

    None modulo relabellings and orbits without invariants, where there are no nets.
    """
    found: dict[int, list[Tip]] = {}
    symmetry = explorer.symmetry
    moving = bool(symmetry.fields) or symmetry.tangents is not None
    if symmetry.relabels or (moving and symmetry.invariants is None):
        return found
    for record in explorer.records:
        for sector in record.figure.sectors if record.figure.singular else ():
            tip = tip_of(explorer, record, sector)
            if tip is not None and tip.pointed:
                found.setdefault(mask_of(sector.held), []).append(tip)
    return found


def joined_by_nets(
    explorer: Explorer, mask: int, tips: list[Tip], curves: list[list[Flag]], notes: list[str]
) -> Iterator[tuple[Flag, Flag]]:
    """Yield flags of boundary curves around faces with tips, two by two, that belong to one face.

    A sentence is added to the notes where a net leaves open what belongs together.
    """
    active = frozenset(positions_in(mask))
    left = [(curve[0], list(_points(explorer, curve, active))) for curve in curves]
    group, unsure = explorer.symmetry.group, 0
    while len(left) > 1:
        flag, seeds = left.pop(0)
        if not seeds:
            unsure += 1
            continue
        surface = Surface(explorer.quotient, active, seeds[0], balls_about(tips))
        net = Net(surface, np.array(seeds[:1]), explorer.quotient.extent, up_to_extent=True)
        on = [any(net.holds(g.apply(q)) for q in points for g in group) for _, points in left]
        yield from ((flag, other) for (other, _), near in zip(left, on, strict=True) if near)
        left = [entry for entry, near in zip(left, on, strict=True) if not near]
        unsure += bool(left) and not net.within
    if unsure:
        notes.append(
            f"which boundary curves and singular corners belong to one face of "
            f"{explorer.registry.written(active)} is not decided: {unsure} could not be covered"
        )


def _points(explorer: Explorer, curve: list[Flag], active: frozenset[int]) -> Iterator[Array]:
    """Yield points of a face near flags of one boundary curve."""
    for flag in curve:
        edge = edge_of(explorer, flag)
        if flag[0] == "apex":
            k, s = flag[1]
            sample = explorer.records[k].figure.sectors[s].sample
            if sample is not None:
                yield sample.q
        elif edge >= 0 and active in explorer.faces_beside(edge):
            yield explorer.faces_beside(edge)[active].sample.q


def assembled(explorer: Explorer, complete: Completeness) -> Skeleton:
    """Return the skeleton as far as it was found."""
    finished = complete is Completeness.EXHAUSTED
    faces, components, notes = _faces(explorer, finished=finished)
    if notes and finished:
        complete = Completeness.GAPS
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
        notes=tuple(dict.fromkeys([*explorer.notes, *notes])),
        components=components,
        whole=_whole(explorer),
        contacts=_contacts(explorer, corners, edges, faces),
        state=explorer.state,
    )


def _whole(explorer: Explorer) -> bool:
    """Whether faces and Euler characteristic can be trusted everywhere."""
    if explorer.symmetry.relabels:
        return False
    for record in explorer.records:
        figure = record.figure
        flags = [(i, sector.held) for sector in figure.sectors for i in sector.rays]
        if max(Counter(flags).values(), default=0) > 1:
            return False
    return True


def _ordered(explorer: Explorer, names: frozenset[str]) -> tuple[str, ...]:
    return tuple(name for name in explorer.polyhedron.names if name in names)


def _corner(explorer: Explorer, record: FoundCorner) -> Corner:
    ends = [record.edges.get(representative) for representative in record.orbit]
    return Corner(
        point=explorer.manifold.canonical(record.point.q),
        stratum=stratum_of(
            explorer.polyhedron,
            record.point.q,
            record.point.values,
            record.point.gradients,
            explorer.quotient.tolerances.zero,
            explorer.quotient.tolerances.rank,
        ),
        singular=record.figure.singular,
        edges=tuple(end for end in ends if end is not None),
    )


def _faces(
    explorer: Explorer, *, finished: bool
) -> tuple[tuple[Face, ...], dict[int, int], list[str]]:
    """Assemble faces: flags that meet at corners and along edges, then crossings.

    A straight way across a face with a tip may pass through the tip into another one: there nets
    tell what belongs together.  Notes say where they do not.
    """
    flags = dict.fromkeys(flags_of(explorer))
    boundary, surface = Partition(flags), Partition(flags)
    broken: list[Flag] = []
    for one, other in joins_of(explorer):
        if one in flags and other in flags:
            boundary.join(one, other)
            surface.join(one, other)
        elif one in flags:
            broken.append(one)
    pointed = pointed_faces(explorer)
    for crossing in explorer.crossings:
        start, stop = (masked(explorer, flag) for flag in (crossing.start, crossing.stop))
        if start[2] not in pointed:
            surface.join(start, stop)
    notes = list(untold(explorer, flags)) if finished else []
    for mask, tips in pointed.items():
        around = groups_of(surface, [flag for flag in flags if flag[2] == mask])
        for one, other in joined_by_nets(explorer, mask, tips, around, notes):
            surface.join(one, other)
    patches = _patches(explorer, flags)
    for flag, k in patches.items():
        surface.join(flag, next(other for other, j in patches.items() if j == k))
    loose = {boundary[flag] for flag in [*broken, *_ends(explorer, flags)]}
    faces = []
    for group in groups_of(surface, flags):
        curves = groups_of(boundary, group)
        faces.append(
            Face(
                active=tuple(explorer.polyhedron.names[i] for i in positions_in(group[0][2])),
                boundary=tuple(
                    tuple(sorted({edge_of(explorer, flag) for flag in curve} - {-1}))
                    for curve in curves
                ),
                closed=not any(boundary[curve[0]] in loose for curve in curves),
                border=_border(
                    explorer, group, sum(c[0][0] != "apex" for c in curves), patches.get(group[0])
                ),
            )
        )
    alone = [k for k in range(len(explorer.patches)) if k not in patches.values()]
    faces += [
        Face(_ordered(explorer, explorer.registry.names(explorer.patches[k].active)), (), True, b)
        for k, b in ((k, _closed_border(explorer, k)) for k in alone)
    ]
    return tuple(faces), _components(explorer, flags, surface, patches, len(faces)), notes


def _patches(explorer: Explorer, flags: Iterable[Flag]) -> dict[Flag, int]:
    """Return the closed surfaces on which faces that only have apexes lie, by position."""
    found = {}
    for flag in flags if explorer.patches else ():
        if flag[0] == "apex":
            k, s = flag[1]
            sector = explorer.records[k].figure.sectors[s]
            here = None if sector.sample is None else sector.sample.at(explorer.quotient)
            on = None if here is None else explorer.patch_at(here, sector.active)
            if on is not None:
                found[flag] = on
    return found


def _closed_border(explorer: Explorer, k: int) -> Border:
    patch = explorer.patches[k]
    return Border(explorer.quotient, patch.active, patch.point[None], (), (), 0)


def _border(explorer: Explorer, group: list[Flag], curves: int, patch: int | None) -> Border | None:
    """Return the edges around a face, and its corners; None where they are not known.

    For a closed surface without those of its points that are apexes: of the whole surface.
    """
    if patch is not None:
        return _closed_border(explorer, patch)
    if explorer.symmetry.relabels:
        return None
    positions = sorted({edge_of(explorer, flag) for flag in group} - {-1})
    around = [explorer.curves[k] for k in positions]
    members, corners, tips = set(group), [], list[Tip]()
    for k, record in enumerate(explorer.records):
        for s, sector in enumerate(record.figure.sectors):
            rays = sector.rays
            where = ("half", (k, rays[0])) if rays else ("apex", (k, s))
            if (*where, mask_of(sector.held)) not in members:
                continue
            if record.figure.singular or sector.sample is not None:
                tip = tip_of(explorer, record, sector)
                if tip is None:
                    return None
                tips.append(tip)
            else:
                corners.append(
                    (_ray(record.figure.rays[rays[0]]), _ray(record.figure.rays[rays[-1]]))
                )
    seeds = [seeds_of([curve.points for curve in around])] if around else []
    seeds += [tip.near[None] for tip in tips if tip.sampled]
    return Border(
        quotient=explorer.quotient,
        active=frozenset(positions_in(group[0][2])),
        seeds=np.concatenate(seeds) if seeds else np.empty((0, 0)),
        edges=tuple((c.active, c.points, c.start is None) for c in around),
        corners=tuple(corners),
        curves=curves,
        tips=tuple(tips),
    )


def _ray(ray: Ray) -> tuple[frozenset[int], Array]:
    return ray.active, np.array([ray.sample.q, ray.direction])


def _contacts(
    explorer: Explorer,
    corners: Sequence[Corner],
    edges: Sequence[Edge],
    faces: Sequence[Face],
) -> dict[str, Contact]:
    kinds = [
        Counter(name for part in parts for name in part.active) for parts in (corners, edges, faces)
    ]
    found = {}
    for name in explorer.polyhedron.names:
        at, along, on = (kind[name] for kind in kinds)
        least = None if at or along or on else explorer.least.get(name)
        found[name] = Contact(at, along, on, least)
    return found


def _ends(explorer: Explorer, flags: Iterable[Flag]) -> Iterator[Flag]:
    """Yield flags where a boundary curve has an end: at infinity, or not traced."""
    for flag in flags:
        if flag[0] == "curve":
            if explorer.curves[flag[1]].kinds[0] is not End.CLOSED:
                yield flag
        elif flag[0] == "half" and edge_of(explorer, flag) < 0:
            yield flag


def _components(
    explorer: Explorer,
    flags: Iterable[Flag],
    surface: Partition,
    patches: Mapping[Flag, int],
    faces: int,
) -> dict[int, int]:
    points = [record.point.q for record in explorer.records[:1]]
    points += [curve.points[0] for curve in explorer.curves[:1]]
    points += [patch.point for patch in explorer.patches[:1]]
    if not points:
        return {}
    point = explorer.quotient.at(points[0])
    fixed = len(point.matrix([])) - len(explorer.quotient.equations)
    free = explorer.manifold.size - len(point.matrix([]))
    counts = {fixed: len(explorer.records), fixed + 1: len(explorer.curves)}
    if free >= 2:
        counts[fixed + 2] = faces
    if free == 3 and not explorer.polyhedron.is_union and not explorer.symmetry.relabels:
        patch_places = [("patch", k) for k in range(len(explorer.patches))]
        inside = Partition([*patch_places, *(("surface", surface[flag]) for flag in flags)])
        for flag in flags:
            if flag[0] != "apex":
                inside.join(("edge", edge_of(explorer, flag)), ("surface", surface[flag]))
        for flag, k in patches.items():
            inside.join(("patch", k), ("surface", surface[flag]))
        for link in explorer.links:
            places = [place for anchor in link for place in _places(explorer, anchor)]
            for one, other in pairwise(places):
                inside.join(one, other)
        surfaces = {("surface", surface[flag]) for flag in flags}
        counts[fixed + 3] = len({inside[x] for x in [*patch_places, *surfaces]})
    return counts


def _places(explorer: Explorer, anchor: Anchor) -> Iterator[tuple[str, int]]:
    """Yield the edges that something a descent arrived at stands for, or the closed face."""
    kind, where = anchor
    if kind == "patch" and isinstance(where, int):
        yield "patch", where
    elif kind == "curve" and isinstance(where, int):
        yield "edge", where
    elif kind == "corner" and isinstance(where, int):
        if not explorer.records[where].figure.singular:
            yield from (("edge", k) for k in explorer.records[where].edges.values())
    elif isinstance(where, tuple):
        record = explorer.records[where[0]]
        found = record.edges.get(record.orbit[where[1]])
        if found is not None:
            yield "edge", found
