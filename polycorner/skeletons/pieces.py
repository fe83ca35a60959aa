"""Pieces of faces that have tips, put together by nets.

Near a point an algebraic set is a cone over its link ([Mil] sec. 2), so that a face and the part of
it outside small balls about some of its points are connected alike.  That part is smooth where the
gradients of the functions that vanish on the face are dependent at these points only, and a net
that begins at one of its points covers the component of this point.
"""

from collections.abc import Iterator

import numpy as np

from polycorner.skeletons.borders import Tip, balls_about
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.incidences import Flag, edge_of
from polycorner.skeletons.masks import mask_of, positions_in
from polycorner.skeletons.nets import Net
from polycorner.skeletons.registry import CornerRecord
from polycorner.skeletons.sectors import Sector
from polycorner.skeletons.surfaces import Surface
from polycorner.spaces.manifold import Array


def tip_of(explorer: Explorer, record: CornerRecord, sector: Sector) -> Tip | None:
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
    """Yield flags of curves around faces with tips, two by two, that belong to one face.

    Parameters
    ----------
    explorer : Explorer
        A finished search.
    mask : int
        Functions that vanish on the faces.
    tips : list of Tip
        Where the faces are not smooth.
    curves : list of list of Flag
        Flags of each boundary curve of one of the faces.
    notes : list of str
        A sentence is added where a net leaves open what belongs together.
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
