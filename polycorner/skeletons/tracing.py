"""Edges while a skeleton grows: traced from corners, or found through one of their points.

The end of an edge at a corner is named by two positions, those of the corner and of the ray.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from polycorner.lookahead import Lookahead
from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.strata import RANK_TOLERANCE
from polycorner.polyhedra.symmetry import Relabelling, renamed
from polycorner.skeletons.points import EvaluatedPoint, HeldPoint, Quotient, projected
from polycorner.skeletons.registry import (
    NEAR,
    SAME,
    CornerRecord,
    CornerRegistry,
    SingularFigure,
    written_point,
)
from polycorner.skeletons.remote_walks import Beginning, Report
from polycorner.skeletons.sign_changes import sign_change
from polycorner.skeletons.vertex_figures import Ray
from polycorner.skeletons.walks import End, Walk, follow
from polycorner.spaces.manifold import Array
from polycorner.values import Value
from polycorner.workers import Shared

# Most steps along an edge to a point near its end.
INWARD = 60

EdgeEnd = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Curve(Value):
    """An edge while the skeleton grows, of at least two points.

    ``relabelled`` carries the names along the walk to the names at the corner ``stop``.
    """

    points: Array
    active: frozenset[int]
    kinds: tuple[End, End]
    start: EdgeEnd | None
    stop: EdgeEnd | None
    relabelled: Relabelling

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            msg = f"points: expected at least two points of an edge; got {len(self.points)}"
            raise ValueError(msg)
        super().__post_init__()

    @property
    def middle(self) -> Array:
        """The vertex half-way along."""
        return np.asarray(self.points[len(self.points) // 2])


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
        self._sent = Shared(quotient)

    def corner(self, point: EvaluatedPoint) -> tuple[int, list[Relabelling]] | None:
        """Return the corner at a point; the edges of a new one are pending.

        See :meth:`CornerRegistry.find`.
        """
        known = len(self.records)
        found = self.registry.find(point)
        if found is not None and found[0] == known:
            orbit = self.records[known].orbit
            self.pending.extend((known, i) for i, twin in enumerate(orbit) if twin == i)
        return found

    @property
    def records(self) -> list[CornerRecord]:
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
        stop, carried = self._arrive(walk, ray) if walk.end is End.CORNER else (None, {})
        curve = Curve(points, ray.active, (End.CORNER, walk.end), end, stop, carried)
        self.curves.append(curve)
        number = len(self.curves) - 1
        record.edges[i] = number
        if stop is not None:
            there = self.records[stop[0]]
            there.edges[there.orbit[stop[1]]] = number
        self._remark(curve)

    def _walk(self, end: EdgeEnd) -> Walk:
        """Return the walk along an edge; others that are pending begin in the meantime."""
        if self.lookahead is None:
            ray = self._ray(end)
            return follow(ray.sample, ray.direction, passive=ray.active)
        for other in self.pending:
            if not self.lookahead.has_room:
                break
            if other not in self.lookahead and not self._is_traced(other):
                self.lookahead.start(other, self._sent, Beginning.of(self._ray(other)))
        report: Report = self.lookahead.result(end)
        return report.walk(self.quotient)

    def _ray(self, end: EdgeEnd) -> Ray:
        return self.records[end[0]].figure.rays[end[1]]

    def _remark(self, curve: Curve) -> None:
        label = self.registry.written(curve.active)
        for kind in curve.kinds:
            if kind not in (End.CORNER, End.CLOSED):
                lost = kind is End.SINGULAR
                self.registry.note(f"the edge {label} {kind.value}", lost=lost)

    def _arrive(self, walk: Walk, ray: Ray) -> tuple[EdgeEnd | None, Relabelling]:
        """Return the end of the edge at the corner where a walk ended."""
        found = self.corner(walk.last)
        if found is None:
            return None, {}
        k, carried = found
        record = self.records[k]
        rays = record.figure.rays
        distance = rays[0].distance if rays else 1e-3
        back = self._before(walk, record, distance)
        sample = None if back is None else back.q
        match = self.registry.match(record, sample, ray, carried, range(len(rays)))
        if match is None:
            self.registry.note(
                f"the edge {self.registry.written(ray.active)} arrives at a corner "
                f"that no edge of this kind leaves",
                lost=True,
            )
            return None, {}
        return (k, match[0]), match[1]

    def _before(self, walk: Walk, record: CornerRecord, distance: float) -> HeldPoint | None:
        """Return the point of a walk at a distance before the corner where it ends.

        Singular corners are known less exactly than edges beside each other are apart there, so
        the distance is that from the corner in record, where it is not elsewhere on the orbit.
        """
        moved = self.manifold.chord(record.point.q, walk.last.q)
        end = walk.last.q + moved * (abs(moved / self.scales).max() < NEAR)
        away = np.linalg.norm((walk.points - end) / self.scales, axis=1)
        beyond = np.flatnonzero(away > distance)
        if not record.figure.singular or not len(beyond):
            guess = walk.last.q - distance * self.scales * walk.tangent
            return projected(self.quotient, guess, walk.last.kept, distance)
        point: HeldPoint | None = HeldPoint(
            self.quotient, walk.points[int(beyond[-1])], walk.last.kept
        )
        for _ in range(INWARD):
            if point is None:
                return None
            way = (end - point.q) / self.scales
            length = float(np.linalg.norm(way))
            # By less than half of the way, so that no step leads to another branch.
            step = min(length - distance, 0.4 * length) * point.tangent(way)
            if np.linalg.norm(step) < 1e-6 * distance:
                break
            point = projected(self.quotient, point.q + self.scales * step, point.kept, length)
        return point

    def _edge_at(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> tuple[str, EdgeEnd | int] | None:
        """Return the edge through a point: its end at a corner, or its position.

        None where there is none, or where it cannot be followed; the notes say so.
        """
        here = HeldPoint(self.quotient, point.q, point.basis(active))
        for k, curve in enumerate(self.curves):
            if curve.active == active and self.lies_on(here.q, curve):
                return ("curve", k) if curve.start is None else ("half", curve.start)
        t = self._along(here)
        walks = []
        for way in (t, -t):
            walk = follow(here, way, passive=active, home=True)
            if walk.end is End.CORNER:
                stop, _ = self._arrive(walk, Ray(way, active, here, 0.0))
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
            renamed(names, g.names) == there and self.lies_on(g.apply(q), curve)
            for g in self.symmetry.group
        )

    def lies_on(self, q: Array, curve: Curve) -> bool:
        """Whether a point lies on a curve: on the arc over a chord that is as near as it is long.

        The nearest vertex may belong to another part of the curve.
        """
        apart = self.symmetry.separations(self.manifold, q, curve.points)
        near = np.minimum(apart[:-1], apart[1:])
        chords = np.linalg.norm(np.diff(curve.points, axis=0) / self.scales, axis=1)
        possible = [k for k in np.argsort(near) if near[k] <= chords[k]]
        return any(self._on_arc(q, curve, int(k)) for k in possible)

    def _on_arc(self, q: Array, curve: Curve, k: int) -> bool:
        """Whether a point lies on the arc over chord ``k``: where the arc passes it."""
        start, end = curve.points[k], curve.points[k + 1]
        q = self.manifold.image(q, start)
        kept = self.quotient.at(start).basis(curve.active)
        along = self.symmetry.displacement(self.manifold, end, start)

        def passed(s: float) -> tuple[float, Array]:
            at = projected(self.quotient, start + s * (end - start), kept, np.inf)
            p = start if at is None else at.q
            return float(self.symmetry.displacement(self.manifold, p, q) @ along), p

        if passed(0.0)[0] > 0 or passed(1.0)[0] < 0:
            return min(self.symmetry.separation(self.manifold, q, p) for p in (start, end)) < SAME
        return self.symmetry.separation(self.manifold, q, sign_change(passed)[1]) < SAME

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
        fixed = null_space(point.matrix([]), RANK_TOLERANCE)
        return int(fixed.shape[1]) - len(point.basis(active))

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
