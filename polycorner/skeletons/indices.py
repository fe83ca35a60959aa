"""Euler characteristics of two-dimensional faces, by stratified Morse theory.

For a height without degenerate critical points on a compact face and on its edges,

    chi = sum over critical points of (-1)^index * (1 - chi(lower link across the stratum)):

a critical point inside counts ``(-1)^index``; a minimum of the height along an edge counts 1 and a
maximum -1 if the height rises into the face there, otherwise 0; a corner counts 1 if the height
rises everywhere, -1 if it falls on two sides of a rise, otherwise 0 [GoreskyMacPherson, part I].
Tips count as below.  Several heights in general position have to agree.

What tips count in the Euler characteristic of a face.

At a tip, where tangents do not tell the face, its link is followed: the arc or the closed curve in
which the face meets a small sphere, and over which it is a cone ([Mil] sec. 2).  A height that
vanishes on no limit of tangent planes has there the index ``1 - chi`` of the part of the link that
lies lower ([GoreskyMacPherson], part I): chi is the number of arcs of this part, and 0 where it is
all of a closed curve.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from polycorner.polyhedra.faces import HeldPoint
from polycorner.polyhedra.symmetry import Element
from polycorner.skeletons.nets import LEVELS, Border, Net, Tip, balls_about, seeds_of
from polycorner.skeletons.spheres_about import link_about
from polycorner.skeletons.surfaces import Height, Surface
from polycorner.skeletons.walks import End, follow
from polycorner.spaces.manifold import Array

Links = list[tuple[Tip, Array]]
# Heights that have to agree, and that are tried.
AGREEING = 3
HEIGHTS = 8
# How many times more points a second net has on its rays, which may pass a narrow gap otherwise.
FINER = 4
NEWTON = 10
# Parts of the way from the net to a critical point at which it must be on the face.
WAY = np.linspace(0.1, 1.0, 10)
HALVINGS = 12


def aligned(border: Border) -> Border | None:
    """Return a border with all its edges carried to one image of the face.

    None if a symmetry carries the face to itself, so that it is not its own quotient, or if it is
    not clear which image of an edge bounds it.
    """
    group = border.quotient.symmetry.group
    if len(group) == 1:
        return border
    surface = Surface(border.quotient, border.active, border.seeds[0])
    net = Net(surface, border.seeds[:1])
    if any(_covered(net, _carried(g, net.points)) for g in group[1:]):
        return None
    edges = []
    for active, points, closed in border.edges:
        images = [_carried(g, points) for g in group]
        here = [image for image in images if _covered(net, image)]
        if len(here) != 1:
            return None
        edges.append((active, here[0], closed))
    if not edges:
        return border
    around = surface.embedded(np.concatenate([points for _, points, _ in edges]))

    h = 100 * surface.tolerances.difference

    def moved(ray: tuple[frozenset[int], Array]) -> tuple[frozenset[int], Array]:
        active, (q, direction) = ray
        ahead = q + h * surface.scales * direction
        images = [_carried(g, np.array([q, ahead])) for g in group]
        away = [
            np.linalg.norm(surface.apart(surface.embedded(image[:1]), around), axis=1).min()
            for image in images
        ]
        start, end = images[int(np.argmin(away))]
        return active, np.array([start, (end - start) / surface.scales / h])

    corners = tuple((moved(first), moved(last)) for first, last in border.corners)
    seeds = seeds_of([points for _, points, _ in edges])
    return replace(border, edges=tuple(edges), corners=corners, seeds=seeds)


def _carried(element: Element, points: Array) -> Array:
    return np.array([element.apply(q) for q in points])


def _covered(net: Net, points: Array) -> bool:
    """Whether a net covers any of the points."""
    q, _ = net.surface.projected(points)
    _, gradients = net.surface.evaluated(q)
    return bool(net.covers(net.surface.embedded(q), net.surface.across(gradients)).any())


def links_at(surface: Surface, tips: Iterable[Tip]) -> Links | None:
    """Return tips with their links, as :func:`tips_index` takes them; None if one is unknown."""
    found = [(tip, _link(surface, tip)) for tip in tips]
    known = [(tip, link) for tip, link in found if link is not None]
    return known if len(known) == len(found) else None


def tips_index(height: Height, links: Links) -> int:
    """Return what tips count for a height."""
    return sum(_index(height, tip, link) for tip, link in links)


def _link(surface: Surface, tip: Tip) -> Array | None:
    """Return the scaled ways from a tip to points of its link in order, ``(n, k)``.

    None where the link is not known.
    """
    if not tip.sampled:
        parallel = 1 - surface.quotient.options.straight
        opposite = len(tip.ways) == 2 and abs(tip.ways[0] @ tip.ways[1]) > parallel
        return np.array(tip.ways).T if opposite else None
    radius = float(np.linalg.norm((tip.near - tip.point) / surface.scales))
    link = link_about(surface.quotient.at(tip.point), radius)
    start = HeldPoint(link, tip.near, link.at(tip.near).basis(surface.active))
    ahead = start.tangent(np.random.default_rng(0).standard_normal(len(tip.near)))
    sides: list[Array] = []
    for way in (ahead, -ahead):
        walk = follow(start, way, passive=surface.active, home=True)
        sides.append(walk.points[:: 1 - 2 * len(sides)])
        if walk.end is End.CLOSED and not tip.ways:
            break
        if walk.end is not End.CORNER or not tip.ways:
            return None
    points = np.concatenate(sides[::-1])
    return np.asarray(((points - tip.point) / surface.scales).T)


def _index(height: Height, tip: Tip, link: Array) -> int:
    """Return what a tip counts; of its link the scaled ways are given."""
    low = height.slopes(tip.point[None], link[None])[0] < 0
    before = np.append(bool(not tip.ways and low[-1]), low[:-1])
    return 1 - int((low & ~before).sum())


def face_euler_characteristic(border: Border) -> int | None:
    """Return the Euler characteristic of a compact face; None where it is not determined.

    It is not where a net does not cover the face, where the net leaves the face elsewhere than
    at the edges of the border, where heights do not agree, or where a finite symmetry carries the
    face to itself.  A bounded face of a plane has no handles: there the number of boundary curves
    must tell the same, and at thin tips, which a net does not fill, tells it alone.
    """
    symmetry = border.quotient.symmetry
    whole = None if symmetry.relabels else aligned(border)
    if whole is None:
        return None
    border = whole
    surface = Surface(border.quotient, border.active, border.seeds[0], balls_about(border.tips))
    found = _agreed(border, surface, np.random.default_rng(0))
    handles = None if found is None else 2 - border.curves - found
    if surface.is_plane:
        known = handles == 0 or (found is None and border.tips and _is_bounded(surface, border))
        return 2 - border.curves if known else None
    orientable = symmetry.invariants is None and not surface.manifold.rotations
    if handles is None or handles < 0 or (orientable and handles % 2):
        return None
    return found


def _agreed(border: Border, surface: Surface, rng: np.random.Generator) -> int | None:
    """Return the number in which several heights agree."""
    links = links_at(surface, border.tips)
    seeds, extent = border.seeds, border.quotient.extent
    nets = (Net(surface, seeds, extent, levels) for levels in (LEVELS, FINER * LEVELS))
    net = next((net for net in nets if net.complete and _enclosed(surface, net, border)), None)
    if links is None or net is None:
        return None
    found: list[int] = []
    for _ in range(HEIGHTS):
        height = Height(surface, rng)
        total = _counted(border, surface, net, height)
        if total is not None:
            found.append(total + tips_index(height, links))
        if len(found) == AGREEING:
            break
    return found[0] if len(found) == AGREEING and len(set(found)) == 1 else None


def _is_bounded(surface: Surface, border: Border) -> bool:
    """Whether a face of a plane lies inside its boundary: whether Green's theorem gives an area."""
    height, area = Height(surface, np.random.default_rng(0)), 0.0
    surface = Surface(surface.quotient, surface.active, border.seeds[0])
    for active, points, _ in border.edges:
        k = len(points) // 2
        chord = (points[k] - points[k - 1])[None] / surface.scales
        found = _sides(surface, height, active, points[k : k + 1], chord)
        if found is None:
            return False
        u, inward = points / surface.scales, found[2][0]
        turn = np.sign(chord[0, 0] * inward[1] - chord[0, 1] * inward[0])
        area += turn * float((u[:-1, 0] * u[1:, 1] - u[1:, 0] * u[:-1, 1]).sum())
    return area > 0


def _counted(border: Border, surface: Surface, net: Net, height: Height) -> int | None:
    total = _inside(surface, net, height)
    surface = Surface(surface.quotient, surface.active, border.seeds[0])  # balls would hide ends
    for edge in border.edges:
        along = None if total is None else _along(surface, height, *edge)
        total = None if along is None or total is None else total + along
    for rays in border.corners:
        at = None if total is None else _at_corner(surface, height, rays)
        total = None if at is None or total is None else total + at
    return total


def _enclosed(surface: Surface, net: Net, border: Border) -> bool:
    """Whether rays of a net leave the face only near the edges of its border, and at balls."""
    if not len(net.ends):
        return True
    ends = surface.embedded(net.ends)
    near = surface.inside_balls(net.ends)
    for _, points, _ in border.edges:
        where = surface.embedded(points)
        chords = np.diff(where, axis=0)
        lengths = np.einsum("kn,kn->k", chords, chords)
        for start, chord, length in zip(where[:-1], chords, lengths, strict=True):
            apart = surface.apart(ends, start[None])
            part = np.clip(apart @ chord / max(length, 1e-300), 0, 1)
            off = np.linalg.norm(apart - part[:, None] * chord, axis=1)
            near |= off < 0.2 * np.sqrt(length) + 1e-5
    return bool(near.all())


# ------------------------------------------------------------------------------------------ inside


def _inside(surface: Surface, net: Net, height: Height) -> int | None:
    """Return the sum of ``(-1)^index`` over the critical points inside the face."""
    starts, radii = _starts(surface, net)
    settled = 100 * surface.tolerances.settled  # of a last Newton step to a critical point
    q, first = starts, True
    for _ in range(NEWTON):
        _, slope, curvature, tangents = _restricted(surface, height, q)
        if tangents is None:
            return None
        step = _newton(slope, curvature)
        long = np.linalg.norm(step, axis=1)
        if first:
            near = long < 2 * radii
            q, step, long, tangents = q[near], step[near], long[near], tangents[near]
            starts, radii, first = starts[near], radii[near], False
        if not len(q):
            return 0
        step *= np.minimum(1.0, radii / np.maximum(long, 1e-300))[:, None]
        q, found = surface.projected(q + surface.scales * np.einsum("knt,kt->kn", tangents, step))
        away = np.linalg.norm((q - starts) / surface.scales, axis=1)
        keep = found & (away < 4 * radii)
        q, starts, radii, last = q[keep], starts[keep], radii[keep], long[keep]
        if (last < settled).all():
            break
    q = q[last < settled] if len(q) else q
    return _signed(surface, net, height, _distinct(surface, q))


def _starts(surface: Surface, net: Net) -> tuple[Array, Array]:
    rounds = net.frames * (0.5 * net.radii)[:, None, None]
    moves = [0 * rounds[..., 0], *(sign * rounds[..., i] for i in (0, 1) for sign in (1, -1))]
    points = np.concatenate([net.points + surface.scales * move for move in moves])
    q, found = surface.projected(points)
    return q[found], np.tile(net.radii, len(moves))[found]


def _restricted(
    surface: Surface, height: Height, q: Array
) -> tuple[Array, Array, Array, Array | None]:
    """Return values, and gradients and Hessians of the height along the surface."""
    values, gradients = surface.evaluated(q)
    tangents = surface.tangents(q, gradients)
    if tangents is None:
        return values, q, q, None
    slope, curvature = height.restricted(q, gradients, tangents)
    known = np.isfinite(slope).all() and np.isfinite(curvature).all()
    return values, slope, curvature, tangents if known else None


def _newton(slope: Array, curvature: Array) -> Array:
    (a, b), (c, d) = curvature.transpose(1, 2, 0)
    det = a * d - b * c
    with np.errstate(all="ignore"):
        step = -np.stack([d * slope[:, 0] - b * slope[:, 1], a * slope[:, 1] - c * slope[:, 0]], 1)
        step = step / det[:, None]
    far = 1e9  # a step of this length is none
    return np.asarray(np.clip(np.nan_to_num(step, nan=far), -far, far))


def _distinct(surface: Surface, q: Array) -> Array:
    where = surface.embedded(q) if len(q) else q
    chosen: list[int] = []
    for k in range(len(q)):
        apart = surface.apart(where[k][None], where[chosen]) if chosen else np.full((1, 1), np.inf)
        if (np.linalg.norm(apart, axis=1) > 1e-5).all():
            chosen.append(k)
    return q[chosen]


def _signed(surface: Surface, net: Net, height: Height, q: Array) -> int | None:
    if not len(q):
        return 0
    values, _, curvature, tangents = _restricted(surface, height, q)
    if tangents is None:
        return None
    on = surface.contains(values)
    total = 0
    for k in np.flatnonzero(on):
        det, size = np.linalg.det(curvature[k]), np.linalg.norm(curvature[k])
        if abs(det) < surface.tolerances.rank * size**2 or not _reached(surface, net, q[k]):
            return None
        total += 1 if det > 0 else -1
    return total


def _reached(surface: Surface, net: Net, q: Array) -> bool:
    """Whether a straight way leads from a point of the net to a point without leaving the face."""
    apart = surface.apart(surface.embedded(q[None]), net.where)
    distance = np.linalg.norm(apart, axis=1)
    for j in np.argsort(distance)[:8]:
        if distance[j] > 2 * net.radii[j]:
            break
        flat = net.frames[j] @ (net.images[j].T @ apart[j])
        way, found = surface.projected(net.points[j] + surface.scales * WAY[:, None] * flat)
        if (found & surface.contains(surface.values(way))).all():
            return True
    return False


# ------------------------------------------------------------------------------------ the boundary


def _along(
    surface: Surface, height: Height, active: frozenset[int], points: Array, closed: bool
) -> int | None:
    """Return what extrema of the height along an edge count."""
    if not closed:
        points = _approached(surface, active, points)
    inner = slice(None) if closed else slice(1, -1)
    chords = np.gradient(points / surface.scales, axis=0)[inner]
    found = _sides(surface, height, active, points[inner], chords)
    if found is None:
        return None
    along, across, _ = found
    if closed:  # the last point is the first, at which the height may have its extremum
        along[-1], across[-1] = along[0], across[0]
    total = 0
    falls = along < 0  # a height that is level at a point counts as rising there
    for k in np.flatnonzero(falls[:-1] != falls[1:]):
        rise, change = across[k], abs(along[k + 1] - along[k])
        # Beside a critical point the slope across may change its sign twice from point to point.
        if rise * across[k + 1] <= 0 or min(abs(across[k : k + 2])) < change:
            ends = points[inner][[k, k + 1]]
            rise = _rise(surface, height, active, ends, float(along[k]))
        if rise == 0:
            return None
        if rise > 0:
            total += 1 if falls[k] else -1
    return total


def _approached(surface: Surface, active: frozenset[int], points: Array) -> Array:
    """Return the points of an edge with one more just before its end.

    Without those that are its ends but for rounding, as where a walk arrives at a tip.
    """
    away = [np.linalg.norm((points - end) / surface.scales, axis=1) for end in points[[0, -1]]]
    apart = np.minimum(*away) > surface.tolerances.same
    apart[[0, -1]] = True
    points = points[apart]
    back = points[-2] - points[-1]
    part = min(0.5, surface.tolerances.beside / float(np.linalg.norm(back / surface.scales)))
    edge = Surface(surface.quotient, active, points[-2])
    last, _ = edge.projected((points[-1] + part * back)[None])
    return np.concatenate([points[:-1], last, points[-1:]])


def _rise(
    surface: Surface, height: Height, active: frozenset[int], ends: Array, first: float
) -> float:
    """Return how the height rises into the face at its extremum between two points of an edge."""
    edge, rise = Surface(surface.quotient, active, ends[0]), 0.0
    chord = (ends[1] - ends[0])[None] / surface.scales
    for _ in range(HALVINGS):
        middle, found = edge.projected(ends.mean(axis=0)[None])
        sides = _sides(surface, height, active, middle, chord) if found.all() else None
        if sides is None:
            return 0.0
        rise = float(sides[1][0])
        same = float(sides[0][0]) * first > 0
        ends = np.array([middle[0], ends[1]] if same else [ends[0], middle[0]])
    return rise


def _sides(
    surface: Surface, height: Height, active: frozenset[int], q: Array, chords: Array
) -> tuple[Array, Array, Array] | None:
    """Return slopes of the height along an edge and into the face, and directions into it."""
    _, gradients = surface.evaluated(q)
    tangents = surface.tangents(q, gradients)
    rows = sorted(active - surface.active)
    if tangents is None or not rows:
        return None
    across = np.einsum("knt,kin->kit", tangents, gradients[:, rows])
    sizes = np.linalg.norm(across, axis=2)
    across = across[:, int(np.argmax(sizes.min(axis=0)))]
    size = np.linalg.norm(across, axis=1)
    if not (size > 0).all():
        return None
    across = across / size[:, None]
    normal = np.einsum("knt,kt->kn", tangents, across)
    flat = np.stack([-across[:, 1], across[:, 0]], 1)
    along = np.einsum("knt,kt->kn", tangents, flat)
    along *= np.sign(np.einsum("kn,kn->k", along, chords))[:, None]
    across_edge = 10 * surface.tolerances.zero
    beside = (q + sign * across_edge * surface.scales * normal for sign in (1, -1))
    sides = [surface.placed(p)[1] for p in beside]
    if not (sides[0] ^ sides[1]).all():
        return None
    inward = np.where(sides[0], 1.0, -1.0)[:, None] * normal
    slopes = height.slopes(q, np.stack([along, inward], axis=-1))
    return slopes[:, 0], slopes[:, 1], inward


def _at_corner(
    surface: Surface, height: Height, rays: tuple[tuple[frozenset[int], Array], ...]
) -> int | None:
    """Return what a corner counts."""
    both = [_sides(surface, height, active, ray[:1], ray[1:]) for active, ray in rays]
    if both[0] is None or both[1] is None:
        return None
    along = np.concatenate([found[0] for found in both if found])
    here, there = (ray[1] for _, ray in rays)
    turn = float(both[0][2][0] @ there)
    parallel = surface.tolerances.rank
    reflex = turn < -parallel
    if abs(turn) <= parallel and float(here @ there) > 0 and surface.polyhedron.is_union:
        return None
    if (along > 0).all():
        return 0 if reflex else 1
    if (along < 0).all():
        return -1 if reflex else 0
    return 0
