"""Edges while a skeleton grows: traced from corners, or found through one of their points.

Other processes walk along edges and compute vertex figures ahead of when they are needed.

Walks along edges in workers: what comes back.

Points travel as coordinates with the functions that are held there; values, gradients and frames
are computed again at the other end.
"""

from collections import deque
from dataclasses import dataclass, replace
from itertools import chain, islice

import numpy as np

from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient, Sample
from polycorner.polyhedra.symmetry import Relabelling, renamed
from polycorner.skeletons.curves import Curve, EdgeEnd, lies_on
from polycorner.skeletons.dependence import follow_edge, held_at, is_dependent
from polycorner.skeletons.registry import (
    CornerRegistry,
    FoundCorner,
    SingularFigure,
    figured,
    written_point,
)
from polycorner.skeletons.vertex_figures import Ray, VertexFigure
from polycorner.skeletons.walks import End, Walk, follow
from polycorner.spaces.manifold import Array
from polycorner.workers import Lookahead, Shared

# Most steps along an edge to a point near its end.
INWARD = 60
# In place of a ray: the vertex figure of the corner is to be computed.
FIGURE = -1
# A walk, the relabellings to the corner where it ended, and the position of the edge.
Arrival = tuple[Walk, list[Relabelling], int]


@dataclass(frozen=True, eq=False)
class Report:
    """A walk without the values at its end; see :class:`~polycorner.skeletons.walks.Walk`."""

    points: Array
    last: Sample[HeldPoint]
    dependent: bool
    tangent: Array
    end: End
    length: float

    @classmethod
    def of(cls, walk: Walk) -> "Report":
        """Return that of a walk."""
        last, dependent = Sample.of(walk.last), is_dependent(walk.last)
        return cls(walk.points, last, dependent, walk.tangent, walk.end, walk.length)

    def walk(self, quotient: Quotient, active: frozenset[int]) -> Walk:
        """Return the walk along an edge with given active functions."""
        last = self.last
        there = (
            held_at(quotient, last.q, active, last.kept) if self.dependent else last.at(quotient)
        )
        return Walk(self.points, there, self.tangent, self.end, self.length)


def walked(quotient: Shared, ray: Ray) -> Report:
    """Walk along an edge to its end."""
    start = ray.start(quotient.value)
    return Report.of(follow_edge(start, ray.direction, ray.active))


class EdgeTracer:
    """Corners and edges that were found, and ends of edges still to trace."""

    def __init__(self, quotient: Quotient, singular: SingularFigure) -> None:
        self.quotient = quotient
        self.polyhedron, self.symmetry = quotient.polyhedron, quotient.symmetry
        self.manifold = self.polyhedron.manifold
        self.scales = self.manifold.scale_array
        self.registry = CornerRegistry(quotient, singular)
        self.curves: list[Curve] = []
        self.pending: deque[EdgeEnd] = deque()
        self.lookahead: Lookahead | None = None  # where others than this process walk
        self._arrivals: dict[int, list[Arrival]] = {}  # at corners without a vertex figure
        self._sent = Shared(quotient)

    def corner(self, point: EvaluatedPoint) -> tuple[int, list[Relabelling]] | None:
        """Return the corner at a point; the edges of a new one are pending.

        See :meth:`CornerRegistry.find`.  Its vertex figure is computed by others in the meantime;
        edges that arrive before it is needed wait for it.
        """
        known = len(self.records)
        found = self.registry.find(point)
        if found is not None and found[0] == known:
            self.pending.append((known, FIGURE))
            self._arrivals[known] = []
            if self.lookahead is not None:
                record, singular = self.records[known], self.registry.singular_figure
                corner = Sample.of(record.point)
                self.lookahead.start(
                    (known, FIGURE), figured, self._sent, singular, corner, record.active
                )
        return found

    def _furnish(self, k: int) -> None:
        """Give a corner its vertex figure, and the edges that arrived there their ends."""
        if k not in self._arrivals:
            return
        end, record = (k, FIGURE), self.records[k]
        if self.lookahead is not None and end in self.lookahead:
            figure: VertexFigure = self.lookahead.result(end)
        else:
            figure = self.registry.figure(record.point, record.active)
        self.registry.furnish(k, figure)
        for walk, carried, number in self._arrivals[k]:
            curve = self.curves[number]
            stop, relabelled = self._stop(walk, curve.active, k, carried)
            self.curves[number] = replace(curve, stop=stop, relabelled=relabelled)
            self._arrived(stop, number)
        del self._arrivals[k]

    def expand(self, most: int | None = None) -> None:
        """Put the ends of edges in place of the vertex figures among the first that are pending."""
        first = list(islice(self.pending, most))
        for k, i in first:
            if i == FIGURE:
                self._furnish(k)
        ends = [e for end in first for e in (self._ends(end[0]) if end[1] == FIGURE else [end])]
        self.pending = deque(chain(ends, islice(self.pending, len(first), None)))

    def _ends(self, k: int) -> list[EdgeEnd]:
        orbit = self.records[k].orbit
        return [(k, i) for i, twin in enumerate(orbit) if twin == i]

    @property
    def records(self) -> list[FoundCorner]:
        """The corners."""
        return self.registry.records

    @property
    def notes(self) -> list[str]:
        """What a user should know."""
        return list(self.registry.notes)

    def _is_traced(self, end: EdgeEnd) -> bool:
        """Whether an edge already arrived from its other end."""
        return end[1] in self.records[end[0]].edges

    def _trace(self, end: EdgeEnd) -> None:
        k, i = end
        record = self.records[k]
        ray = record.figure.rays[i]
        walk = self._walk(end)
        points = np.vstack([record.point.q, walk.points])
        found = self._at_corner(walk) if walk.end is End.CORNER else None
        waits = found is not None and found[0] in self._arrivals
        stop, relabelled = (
            (None, {}) if found is None or waits else self._stop(walk, ray.active, *found)
        )
        curve = Curve(points, ray.active, (End.CORNER, walk.end), end, stop, relabelled)
        number = len(self.curves)
        self.curves.append(curve)
        record.edges[i] = number
        if found is not None and waits:
            self._arrivals[found[0]].append((walk, found[1], number))
        self._arrived(stop, number)
        self._remark(curve)

    def _walk(self, end: EdgeEnd) -> Walk:
        """Return the walk along an edge; others that are pending begin in the meantime."""
        if self.lookahead is None:
            ray = self._ray(end)
            return follow_edge(ray.start(self.quotient), ray.direction, ray.active)
        for other in self.pending:
            if other != end and not self.lookahead.has_room:
                break
            known = other[1] == FIGURE or other in self.lookahead
            if not known and not self._is_traced(other):
                self.lookahead.start(other, walked, self._sent, self._ray(other))
        report: Report = self.lookahead.result(end)
        return report.walk(self.quotient, self._ray(end).active)

    def _ray(self, end: EdgeEnd) -> Ray:
        return self.records[end[0]].figure.rays[end[1]]

    def _remark(self, curve: Curve) -> None:
        label = self.registry.written(curve.active)
        for kind in curve.kinds:
            if kind not in (End.CORNER, End.CLOSED):
                lost = kind is End.SINGULAR
                self.registry.note(f"the edge {label} {kind.value}", lost=lost)

    def _at_corner(self, walk: Walk) -> tuple[int, list[Relabelling]] | None:
        """Return the corner where a walk ended."""
        # Along dependent edges more is held than functions of the polyhedron.
        last = self.quotient.at(walk.last.q) if is_dependent(walk.last) else walk.last
        return self.corner(last)

    def _arrive(self, walk: Walk, active: frozenset[int]) -> EdgeEnd | None:
        """Return the end of an edge at the corner where a walk along it ended."""
        found = self._at_corner(walk)
        if found is None:
            return None
        self._furnish(found[0])
        return self._stop(walk, active, *found)[0]

    def _stop(
        self, walk: Walk, active: frozenset[int], k: int, carried: list[Relabelling]
    ) -> tuple[EdgeEnd | None, Relabelling]:
        """Return the end of an edge at a corner with a vertex figure, and the relabelling to it."""
        match = self._matched(k, walk, active, carried)
        return (None, {}) if match is None else ((k, match[0]), match[1])

    def _arrived(self, stop: EdgeEnd | None, number: int) -> None:
        if stop is not None:
            record = self.records[stop[0]]
            record.edges[record.orbit[stop[1]]] = number

    def _matched(
        self, k: int, walk: Walk, active: frozenset[int], carried: list[Relabelling]
    ) -> tuple[int, Relabelling] | None:
        """Return the ray of a corner on which a walk arrived, and the relabelling to it."""
        record, sample = self.records[k], None
        rays = record.figure.rays
        if record.figure.singular or self.polyhedron.is_union:
            back = self._before(walk, record, rays[0].distance if rays else 1e-3)
            sample = None if back is None else back.q
        match = self.registry.match(record, sample, active, carried, range(len(rays)))
        if match is None:
            self.registry.note(
                f"the edge {self.registry.written(active)} arrives at a corner "
                f"that no edge of this kind leaves",
                lost=True,
            )
        return match

    def _before(self, walk: Walk, record: FoundCorner, distance: float) -> HeldPoint | None:
        """Return the point of a walk at a distance before the corner where it ends.

        Singular corners are known less exactly than edges beside each other are apart there, so
        the distance is that from the corner in record, where it is not elsewhere on the orbit.
        """
        quotient = walk.last.quotient
        moved = self.manifold.chord(record.point.q, walk.last.q)
        near = self.quotient.tolerances.near
        end = walk.last.q + moved * (abs(moved / self.scales).max() < near)
        away = np.linalg.norm((walk.points - end) / self.scales, axis=1)
        beyond = np.flatnonzero(away > distance)
        if not record.figure.singular or not len(beyond):
            guess = walk.last.q - distance * self.scales * walk.tangent
            return projected(quotient, guess, walk.last.kept, distance)
        point: HeldPoint | None = HeldPoint(quotient, walk.points[int(beyond[-1])], walk.last.kept)
        for _ in range(INWARD):
            if point is None:
                return None
            way = (end - point.q) / self.scales
            length = float(np.linalg.norm(way))
            # By less than half of the way, so that no step leads to another branch.
            step = min(length - distance, 0.4 * length) * point.tangent(way)
            if np.linalg.norm(step) < 1e-6 * distance:
                break
            point = projected(quotient, point.q + self.scales * step, point.kept, length)
        return point

    def _edge_at(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> tuple[str, EdgeEnd | int] | None:
        """Return the edge through a point: its end at a corner, or its position.

        None where there is none, or where it cannot be followed; the notes say so.
        """
        here = HeldPoint(self.quotient, point.q, point.basis(active))
        for k, curve in enumerate(self.curves):
            if curve.active == active and lies_on(self.quotient, here.q, curve):
                return ("curve", k) if curve.start is None else ("half", curve.start)
        t = self._along(here)
        walks = []
        for way in (t, -t):
            walk = follow(here, way, passive=active, home=True)
            if walk.end is End.CORNER:
                stop = self._arrive(walk, active)
                return None if stop is None else ("half", stop)
            walks.append(walk)
            if walk.end is End.CLOSED:
                break
        if all(len(walk.points) == 1 for walk in walks):
            self.registry.note(
                f"the edge {self.registry.written(active)} {walks[0].end.value}", lost=True
            )
            return None
        return self._free_edge(walks, here, active)

    def _free_edge(
        self, walks: list[Walk], here: HeldPoint, active: frozenset[int]
    ) -> tuple[str, EdgeEnd | int]:
        """Return an edge along which no corner was met, new or known.

        One that goes on beyond the extent may be known from another part of it: of two parts of a
        curve that overlap, one contains an end of the other.
        """
        for k, curve in enumerate(self.curves):
            if curve.start is None and self._is_image(here.q, active, curve):
                return "curve", k
        forth = walks[0]
        points = forth.points
        kinds = (forth.end, forth.end)
        if len(walks) == 2:
            points = np.vstack([walks[1].points[::-1], points[1:]])
            kinds = (walks[1].end, forth.end)
        found = Curve(points, active, kinds, None, None, {})
        for k, curve in enumerate(self.curves):
            both = zip(curve.points[[0, -1]], curve.kinds, strict=True)
            ends = [q for q, kind in both if kind is End.INFINITY]
            if any(self._is_image(q, curve.active, found) for q in ends):
                return ("curve", k) if curve.start is None else ("half", curve.start)
        self.curves.append(found)
        self._remark(found)
        return "curve", len(self.curves) - 1

    def _is_image(self, q: Array, active: frozenset[int], curve: Curve) -> bool:
        """Whether a symmetry carries a point with given active functions to a curve."""
        names, there = self.registry.names(active), self.registry.names(curve.active)
        return any(
            renamed(names, g.names) == there and lies_on(self.quotient, g.apply(q), curve)
            for g in self.symmetry.group
        )

    def _undirected(self, point: EvaluatedPoint, active: frozenset[int]) -> list[int]:
        """Return the active functions and equations whose gradients have no direction."""
        return point.vanishing(self.quotient.held(active))

    def _note_undirected(self, point: EvaluatedPoint, rows: list[int]) -> None:
        every = (*self.polyhedron.names, *self.polyhedron.equation_names)
        self.registry.note(
            f"the gradient of {', '.join(every[i] for i in rows)} vanishes at "
            f"{written_point(point.q)}: not followed from there",
            lost=True,
        )

    def _free(self, point: EvaluatedPoint, active: frozenset[int]) -> int:
        return int(point.frame.shape[1]) - len(point.basis(active))

    def _on_curve(self, point: EvaluatedPoint, active: frozenset[int]) -> bool:
        """Whether dependent functions vanish together on a curve, not at a point."""
        kept = point.basis(active)
        if len(kept) == len(active):
            return True
        t = self._along(HeldPoint(self.quotient, point.q, kept))
        ahead = projected(self.quotient, point.q + 1e-3 * self.scales * t, kept, 1e-3)
        return ahead is not None and ahead.active() == active

    @staticmethod
    def _along(point: HeldPoint) -> Array:
        """Return the direction of the curve on which the held functions vanish."""
        matrix = point.matrix(point.kept)
        if not len(matrix):
            return np.ones(1)
        return np.asarray(np.linalg.svd(matrix)[2][-1])
