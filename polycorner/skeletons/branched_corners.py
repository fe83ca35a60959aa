"""Vertex figures of corners where gradients have several relations, or one and full rank.

The edges are the branches of second order that stay in the polyhedron, see
:mod:`~polycorner.skeletons.branches`.  Faces are told by where they meet a small sphere about the
corner: in arcs between the edges' points on it.  The arcs that leave such a point are known as the
edges out of a corner are, by first derivatives where gradients are independent and otherwise by
second ones.  Faces that meet the sphere in a closed arc, with no edge, are not sought.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import replace
from math import comb

import numpy as np

from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Sample
from polycorner.skeletons.branches import MAX_SETS, Branches
from polycorner.skeletons.dependence import dependent_at, follow_edge
from polycorner.skeletons.folds import fold_figure
from polycorner.skeletons.singularities import SingularPoint
from polycorner.skeletons.spheres_about import SAMPLED, link_about
from polycorner.skeletons.vertex_figures import (
    Ray,
    Sector,
    VertexFigure,
    corner_rank,
    rounding,
    vertex_figure,
)
from polycorner.skeletons.walks import End
from polycorner.spaces.manifold import Array

# Distance between points of one edge, relative to that from the corner.
ALIKE = 1e-2
# Distances in a link at which arcs are looked for: second derivatives shrink with its radius.
BESIDE = (0.1, 0.03, 0.01)
# Times that a point of a dependent edge is moved to its distance.
PLACED = 3

# What holds on an arc, and the edges at its ends.
Ends = list[tuple[int, Ray]]


def dependent_rays(
    point: EvaluatedPoint, active: frozenset[int], distance: float
) -> Iterator[Ray | frozenset[int]]:
    """Yield the rays of dependent edges; in place of one that is unclear, what is held."""
    branches = Branches(point, sorted(active))
    found, straight = list[Ray](), point.quotient.options.straight
    for y, held in branches.double():
        if any(_contains(ray, held, branches.frame @ y, straight) for ray in found):
            continue
        curve = dependent_at(point, held)
        if curve is None:
            yield held
            continue
        way = curve[1] * np.sign(curve[1] @ (branches.frame @ y))
        there = _placed(point, curve[0], way, distance)
        if there is None or abs(there.distances[sorted(held)]).max() > branches.tolerances.held:
            if there is None or not branches.excludes(held, there):
                yield held
            continue
        along = there.active()
        if along is None or along == active or _known(point, found, along, there.q, distance):
            continue
        here = point.quotient.at(there.q)
        if len(here.basis(along)) == branches.full - 1:
            continue  # no function but the dependent ones opens: an edge of independent gradients
        placed = dependent_at(here, along)
        if placed is None:
            yield held
            continue
        found.append(Ray(way, along, Sample.of(placed[0]), distance, dependent=True))
        yield found[-1]


def branched_rays(
    point: EvaluatedPoint, active: frozenset[int], distance: float, least: int = 1
) -> tuple[list[Ray], list[frozenset[int]]]:
    """Return the rays at a degenerate corner, and sets of functions whose curves are unclear.

    Rays whose functions leave fewer than ``least`` dimensions to first order are left out.
    """
    scales = point.quotient.scales
    branches = Branches(point, sorted(active))
    rays: list[Ray] = []
    for y, held in branches.simple(least):
        way = branches.frame @ y
        ahead = point.q + distance * scales * way
        there = _near(point, ahead, sorted(held), distance / 2)
        along = None if there is None else _along(there, active)
        if there is None:
            branches.unclear.append(held)
        elif along and along != active and not _known(point, rays, along, there.q, distance):
            rays.append(Ray(way, along, Sample.of(there), distance))
    for found in dependent_rays(point, active, distance):
        if not isinstance(found, Ray):
            branches.unclear.append(found)
        elif not _known(point, rays, found.active, found.sample.q, distance):
            rays.append(found)
    explained = [ray.active for ray in rays if ray.dependent]
    return rays, [held for held in branches.unclear if held not in explained]


def _near(point: EvaluatedPoint, q: Array, held: list[int], reach: float) -> HeldPoint | None:
    """Return the nearest point of a curve, first with functions that are independent at its corner.

    Beside the corner the others meet these at small angles.
    """
    there = projected(point.quotient, q, held, reach)
    if there is None:
        first = projected(point.quotient, q, point.basis(held), reach)
        there = None if first is None else projected(point.quotient, first.q, held, reach)
    return there


def _along(there: HeldPoint, active: frozenset[int]) -> frozenset[int] | None:
    """Return what vanishes at a point of a curve; None where that leaves the polyhedron.

    Functions that open to third order are within the tolerance of zero near the corner, but not
    zero to rounding.
    """
    found, away = there.active(), there.distances
    opened = [i for i in active.intersection(found or ()) if abs(away[i]) > rounding(there)]
    if found is None or any(away[i] < 0 for i in opened):
        return None
    return found.difference(opened)


def _is_same(ray: Ray, other: Ray, straight: float) -> bool:
    """Whether two rays, of independent gradients, belong to one edge."""
    return ray.active == other.active and bool(ray.direction @ other.direction > 1 - straight)


def _contains(ray: Ray, held: frozenset[int], way: Array, straight: float) -> bool:
    """Whether a dependent edge is the only curve in a direction on which some functions vanish."""
    return held <= ray.active and bool(ray.direction @ way > 1 - straight)


def _known(
    point: EvaluatedPoint, rays: list[Ray], active: frozenset[int], q: Array, distance: float
) -> bool:
    """Whether an edge of given functions goes through a point at a distance from the corner."""
    near = ALIKE * distance * point.quotient.scales
    return any(ray.active == active and (abs(ray.sample.q - q) < near).all() for ray in rays)


def _placed(
    point: EvaluatedPoint, curve: HeldPoint, way: Array, distance: float
) -> HeldPoint | None:
    """Return the point of a curve at a distance from where it begins."""
    scales = point.quotient.scales
    there = None
    for _ in range(PLACED):
        q = point.q + distance * scales * way
        there = projected(curve.quotient, q, curve.kept, distance / 2)
        if there is None:
            return None
        way = (there.q - point.q) / scales
        way = way / np.linalg.norm(way)
    return there


def _unclear(point: EvaluatedPoint, active: frozenset[int], held: frozenset[int]) -> str:
    """Return the note on an edge that second derivatives do not tell."""
    opened, every = map(point.quotient.written, (active - held, active))
    return (
        f"whether an edge that opens {opened} leaves the corner {every} is not decided by second "
        f"derivatives: not followed"
    )


def with_branches(
    figure: VertexFigure, point: EvaluatedPoint, active: frozenset[int]
) -> VertexFigure:
    """Return the figure of a corner of full rank with the edges that first derivatives do not tell.

    Where more functions vanish than there are dimensions, gradients may be independent along an
    edge and dependent at the corner, or dependent all along.  Then the edge need not leave along an
    extreme ray of the tangent cone, but where a function of second or third order changes sign
    inside a face of the cone.  Faces beside such edges are told at their other corners only.
    """
    options = point.quotient.options
    found, held = branched_rays(point, active, options.distances[0], least=2)
    rays = [
        ray
        for ray in found
        if not any(_is_same(ray, other, options.straight) for other in figure.rays)
    ]
    unclear = [_unclear(point, active, some) for some in held]
    return replace(figure, rays=(*figure.rays, *rays), notes=(*figure.notes, *unclear))


def branched_figure(
    point: EvaluatedPoint, active: frozenset[int], rank: int, full: int
) -> VertexFigure | None:
    """Return the rays and sectors at a singular corner, in more than three dimensions.

    None where there are few, where the polyhedron is locally a union, and where the sets of
    functions are too many.
    """
    if point.quotient.polyhedron.is_union or full <= SAMPLED:
        return None
    if len(active) < full - 1 or comb(len(active), full - 1) > MAX_SETS:
        return None
    distances = point.quotient.options.distances
    near, far = (branched_rays(point, active, distance) for distance in distances[1::-1])
    rays, unclear = far
    notes = [_unclear(point, active, held) for held in unclear]
    if Counter(ray.active for ray in near[0]) != Counter(ray.active for ray in rays):
        notes.append(f"{_unclear(point, active, frozenset())}: different ones at two distances")
    arcs = _ArcsAround(point, rays, distances[0])
    sectors = arcs.sectors()
    if arcs.lost:
        notes.append(
            f"of the faces at the corner {point.quotient.written(active)} at least "
            f"{arcs.lost} could not be followed around it"
        )
    return VertexFigure(rank, full, tuple(rays), sectors, tuple(notes))


class _ArcsAround:
    """The arcs of a small sphere about a corner between the points of edges.

    ``lost`` counts those that were not found or not followed.
    """

    def __init__(self, point: EvaluatedPoint, rays: list[Ray], radius: float) -> None:
        self.rays, self.lost = rays, 0
        self.link = link_about(point, radius)

    def sectors(self) -> tuple[Sector, ...]:
        """Return the faces between edges."""
        ends: dict[frozenset[int], Ends] = defaultdict(list)
        for i, ray in enumerate(self.rays):
            for arc in self._leaving(ray):
                ends[arc.active].append((i, arc))
        return tuple(
            Sector(pair, tuple(sorted(held)))
            for held, some in ends.items()
            for pair in self._pairs(some)
        )

    def _leaving(self, ray: Ray) -> tuple[Ray, ...]:
        """Return the arcs that leave the point of an edge."""
        point = self.link.at(ray.sample.q)
        rank, full = corner_rank(point, ray.active)
        if rank == full:
            return vertex_figure(point, ray.active).rays
        point = SingularPoint(self.link, point.q, sorted(ray.active))
        found = fold_figure(point, ray.active, rank, full, BESIDE)
        if found is not None:
            self.lost += len(found.notes)
            return found.rays
        if len(ray.active) < full - 1:
            self.lost += 1
            return ()
        rays, unclear = branched_rays(point, ray.active, BESIDE[0])
        self.lost += len(unclear)
        return tuple(rays)

    def _pairs(self, ends: Ends) -> Iterator[tuple[int, int]]:
        """Yield the edges at both ends of the arcs on which the same functions vanish."""
        left = list(ends)
        while len(left) > 2:
            i, arc = left.pop(0)
            stop = self._followed(arc)
            if stop is None:
                self.lost += 1 + len(left)
                return
            away = [float(np.linalg.norm(end[1].sample.q - stop)) for end in left]
            yield i, left.pop(int(np.argmin(away)))[0]
        if len(left) == 2:
            yield left[0][0], left[1][0]
        else:
            self.lost += len(left)

    def _followed(self, arc: Ray) -> Array | None:
        """Return a point shortly before the end of an arc; None if it ends at no edge."""
        walk = follow_edge(arc.start(self.link), arc.direction, arc.active)
        if walk.end is not End.CORNER:
            return None
        scales = self.link.scales
        return np.asarray(walk.last.q - arc.distance * scales * walk.tangent)
