"""Links of singular corners: what the polyhedron looks like on a small sphere about them.

Near a point an algebraic set is a cone over its link, its intersection with a sphere that is
small enough ([Mil] sec. 2): the corners of the link are the edges at the point, its edges the
two-dimensional faces there, and a closed edge without a corner is a face around an apex.
The link is a polyhedron of one dimension less, so its own skeleton is searched for; two radii must
agree.  This holds whatever the order of contact: for crossings, cusps and apexes alike.
At folds the link is known from first and second derivatives and not searched, and where there are
several relations its corners are.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, combinations, islice

import numpy as np

from polycorner.polyhedra.cones import unit_rows
from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient, Sample
from polycorner.skeletons.branched_corners import branched_figure
from polycorner.skeletons.folds import fold_figure
from polycorner.skeletons.sectors import Sector
from polycorner.skeletons.spheres_about import SAMPLED, link_about
from polycorner.skeletons.tracing import EdgeTracer
from polycorner.skeletons.vertex_figures import Ray, VertexFigure, singular_rays
from polycorner.skeletons.walks import End
from polycorner.spaces.manifold import Array

# Random points of a link of a curve or a surface, and sets of functions to hold there.
POINTS = 16
MAX_SETS = 40
HALVINGS = 40  # of Newton steps towards them

Search = Callable[[Quotient, Sequence[Array]], EdgeTracer]


def singular_figure(
    search: Search, point: EvaluatedPoint, active: frozenset[int], rank: int
) -> VertexFigure:
    """Return the rays and sectors at a singular corner."""
    frame = point.frame
    full = int(frame.shape[1])
    folded = fold_figure(point, active, rank, full) or branched_figure(point, active, rank, full)
    if folded is not None:
        return folded
    before = None
    for radius in point.quotient.options.radii:
        notes: list[str] = []
        found = _link(search, point, active, frame, radius, notes)
        figure = VertexFigure(rank, full, *found, tuple(notes))
        if before is not None and _signature(before) == _signature(figure):
            return figure
        before = figure
    assert before is not None
    note = (
        f"at the singular corner {point.quotient.written(active)} "
        f"small spheres of different radii meet different edges"
    )
    return VertexFigure(rank, full, before.rays, before.sectors, (*before.notes, note))


def _signature(figure: VertexFigure) -> tuple[Counter[object], Counter[object], bool]:
    rays = [ray.active for ray in figure.rays]
    sectors = [
        (s.active, frozenset(Counter(rays[i] for i in s.rays).items())) for s in figure.sectors
    ]
    return Counter(rays), Counter(sectors), not figure.notes


def _link(
    search: Search,
    point: EvaluatedPoint,
    active: frozenset[int],
    frame: Array,
    radius: float,
    notes: list[str],
) -> tuple[tuple[Ray, ...], tuple[Sector, ...]]:
    """Return rays and sectors from the link of one radius."""
    quotient, link = point.quotient, link_about(point, radius)
    found = search(link, list(_starts(point, link, active, frame, radius, notes)))
    names = quotient.written(active)
    if found.registry.lost:
        notes += [f"near the singular corner {names}: {note}" for note in found.notes]
    scales = quotient.scales
    rays: list[Ray] = []
    position: dict[int, int] = {}
    for k, record in enumerate(found.records):
        kept = quotient.at(record.point.q).basis(record.active)
        there = projected(quotient, record.point.q, kept, 0.1 * radius)
        if there is None or not there.is_curve:
            notes.append(f"an edge out of the singular corner {names} has dependent gradients")
            continue
        position[k] = len(rays)
        way = (there.q - point.q) / scales
        sample = Sample.of(there)
        rays.append(Ray(way / np.linalg.norm(way), record.active, sample, radius))
    sectors = []
    for curve in found.curves:
        ends = [None if end is None else position.get(end[0]) for end in (curve.start, curve.stop)]
        held = tuple(sorted(curve.active))
        middle = Sample(curve.middle, tuple(quotient.at(curve.middle).basis(held)), HeldPoint)
        if curve.kinds[0] is End.CLOSED:
            sectors.append(Sector((), held, middle))
        elif ends[0] is None or ends[1] is None:
            notes.append(f"a face at the singular corner {names} could not be followed around it")
        else:
            sectors.append(Sector((ends[0], ends[1]), held, middle))
    return tuple(rays), tuple(sectors)


def _starts(
    point: EvaluatedPoint,
    link: Quotient,
    active: frozenset[int],
    frame: Array,
    radius: float,
    notes: list[str],
) -> Iterator[Array]:
    """Yield points of the link: on its corners, edges and faces where its dimension is small."""
    scales = radius * point.quotient.scales
    full = frame.shape[1]
    if full > SAMPLED:
        ways = [(frame @ y, [tight]) for y, tight in singular_rays(point, active, notes)]
    else:
        sizes = range(min(full, len(active) + 1))
        subsets = chain.from_iterable(combinations(sorted(active), k) for k in sizes)
        sets = [frozenset(some) for some in islice(subsets, MAX_SETS)]
        random = np.random.default_rng(0).standard_normal((POINTS, full))
        ways = [(frame @ y, sets) for y in unit_rows(random)]
    for way, sets in ways:
        for kept in sets:
            q = point.q + scales * way
            # Where curves touch, steps are halved until they are told apart.
            start = projected(link, q, link.at(q).basis(kept), 2.0, HALVINGS)
            if start is not None and start.active() is not None:
                yield start.q
