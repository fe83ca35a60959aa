"""An atlas that grows: falling into corners, walking edges, shooting across faces.

The end of an edge at a corner is named by two positions, those of the corner and of the ray.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.strata import RANK_TOLERANCE
from polycorner.polyhedra.symmetry import Relabelling, renamed
from polycorner.skeletons.elements import Completeness
from polycorner.skeletons.flags import Crossing, Flag
from polycorner.skeletons.points import EvaluatedPoint, HeldPoint, Quotient, projected
from polycorner.skeletons.registry import SAME, CornerRecord, CornerRegistry, written_point
from polycorner.skeletons.vertex_figures import Ray, faces_beside
from polycorner.skeletons.walks import End, Walk, follow
from polycorner.spaces.manifold import Array

FALLS = 6
SHORT = 20
ARC_SEARCH = 40

EdgeEnd = tuple[int, int]
Progress = Callable[[int, int, int], None]


@dataclass
class Curve:
    """An edge while the atlas grows.

    ``relabelled`` carries the names along the walk to the names at the corner ``stop``.
    """

    points: Array
    active: frozenset[int]
    kinds: tuple[End, End]
    start: EdgeEnd | None
    stop: EdgeEnd | None
    relabelled: Relabelling
    length: float
    branches: int
    beside: dict[frozenset[int], Ray] | None = None

    @property
    def middle(self) -> Array:
        """A point well inside."""
        return np.asarray(self.points[len(self.points) // 2])


class Explorer:
    """What was found and what is left to do."""

    def __init__(
        self, quotient: Quotient, seeds: Iterable[Array], rng: np.random.Generator
    ) -> None:
        self.quotient, self.rng = quotient, rng
        self.polyhedron, self.symmetry = quotient.polyhedron, quotient.symmetry
        self.manifold = self.polyhedron.manifold
        self.scales = self.manifold.scale_array
        self.registry = CornerRegistry(quotient)
        self.curves: list[Curve] = []
        self.passages: list[Crossing] = []
        self.seeds: deque[tuple[int, Array]] = deque(enumerate(seeds))
        self.pending: deque[EdgeEnd] = deque()
        self.shot: set[tuple[int, frozenset[int]]] = set()
        self.crossed = 0  # edges beside which every face was crossed

    # --------------------------------------------------------------------------- order of the work

    def run(self, budget: int, progress: Progress | None) -> Completeness:
        """Work until nothing is left, the budget is used up, or someone interrupts."""
        limit = len(self.curves) + budget
        try:
            for task in self._tasks():
                if len(self.curves) >= limit and (self.pending or self.seeds):
                    return Completeness.BUDGET
                task()
                if progress is not None:
                    progress(len(self.records), len(self.curves), len(self.pending))
        except KeyboardInterrupt:
            return Completeness.INTERRUPTED
        if not self.curves and not self.records:
            return Completeness.SEEDS
        return Completeness.GAPS if self.registry.lost else Completeness.EXHAUSTED

    def _tasks(self) -> Iterator[Callable[[], None]]:
        """Yield what to do next; a task leaves the lists only once it is done."""
        while True:
            if self.pending:
                half = self.pending[0]
                yield partial(self._walk, half)
                self.pending.popleft()
            elif self.seeds:
                number, seed = self.seeds[0]
                yield partial(self._fall, number, seed)
                self.seeds.popleft()
            else:
                crossing = next(self._crossings(), None)
                if crossing is None:
                    return
                yield partial(self._shoot, *crossing)
                self.shot.add(crossing)

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
        """Everything a user should know."""
        return list(self.registry.notes)

    # ---------------------------------------------------------------------------------------- edges

    def _walk(self, half: EdgeEnd) -> None:
        k, i = half
        record = self.records[k]
        if i in record.edges:
            return
        ray = record.figure.rays[i]
        walk = follow(ray.sample, ray.direction, passive=ray.active)
        points = np.vstack([record.point.q, walk.points])
        stop, carried = self._arrive(walk, ray) if walk.end is End.CORNER else (None, {})
        curve = Curve(
            points, ray.active, (End.CORNER, walk.end), half, stop, carried,
            walk.length + ray.distance, walk.branches,
        )  # fmt: skip
        self.curves.append(curve)
        number = len(self.curves) - 1
        record.edges[i] = number
        if stop is not None:
            there = self.records[stop[0]]
            there.edges[there.orbit[stop[1]]] = number
        self._remark(curve)

    def _remark(self, curve: Curve) -> None:
        label = self.registry.written(curve.active)
        for kind in curve.kinds:
            if kind not in (End.CORNER, End.CLOSED):
                lost = kind is End.SINGULAR
                self.registry.note(f"the edge {label} {kind.value}", lost=lost)
        if curve.branches:
            self.registry.note(
                f"the edge {label} meets other curves on the same functions: not followed",
                lost=True,
            )

    def _arrive(self, walk: Walk, ray: Ray) -> tuple[EdgeEnd | None, Relabelling]:
        """Return the end of the edge at the corner a walk came to."""
        found = self.corner(walk.last)
        if found is None:
            return None, {}
        k, carried = found
        record = self.records[k]
        rays = record.figure.rays
        distance = rays[0].distance if rays else 1e-3
        back = projected(
            self.quotient,
            walk.last.q - distance * self.scales * walk.tangent,
            walk.last.kept,
            distance,
        )
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

    def _edge_at(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> tuple[str, EdgeEnd | int] | None:
        """Return the edge through a point: its end at a corner, or its position.

        None where there is none, or where it cannot be followed; the notes say so.
        """
        here = HeldPoint(self.quotient, point.q, point.basis(active))
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
        return "curve", self._free_edge(walks, here, active)

    def _free_edge(self, walks: list[Walk], here: HeldPoint, active: frozenset[int]) -> int:
        """Return the position of an edge without corners, new or known."""
        for k, curve in enumerate(self.curves):
            if curve.start is None and self._is_image(here.q, active, curve):
                return k
        forth = walks[0]
        points = forth.points
        kinds = (forth.end, forth.end)
        if len(walks) == 2:
            points = np.vstack([walks[1].points[::-1], points[1:]])
            kinds = (walks[1].end, forth.end)
        curve = Curve(
            points, active, kinds, None, None, {},
            sum(w.length for w in walks), sum(w.branches for w in walks),
        )  # fmt: skip
        self.curves.append(curve)
        self._remark(curve)
        return len(self.curves) - 1

    def _is_image(self, q: Array, active: frozenset[int], curve: Curve) -> bool:
        """Whether a symmetry carries a point with given active functions to a curve."""
        names, there = self.registry.names(active), self.registry.names(curve.active)
        return any(
            renamed(names, g.names) == there and self.lies_on(g.apply(q), curve)
            for g in self.symmetry.group
        )

    def lies_on(self, q: Array, curve: Curve) -> bool:
        """Whether a point lies on a curve: on one of the chords' arcs beside its nearest vertex."""
        apart = [self.symmetry.separation(self.manifold, q, p) for p in curve.points]
        nearest = int(np.argmin(apart))
        chords = np.linalg.norm(np.diff(curve.points, axis=0) / self.scales, axis=1)
        # A closed curve has its first point twice.
        nearest = nearest or len(chords)
        beside = {nearest - 1, nearest % len(chords)}
        if apart[nearest] > max(chords[k] for k in beside):
            return False
        return any(self._on_arc(q, curve, k) for k in beside)

    def _on_arc(self, q: Array, curve: Curve, k: int) -> bool:
        """Whether a point lies on the arc over chord ``k``, by ternary search."""
        start, end = curve.points[k], curve.points[k + 1]
        kept = self.quotient.at(start).basis(curve.active)

        def apart(s: float) -> float:
            at = projected(self.quotient, start + s * (end - start), kept, np.inf)
            p = start if at is None else at.q
            return self.symmetry.separation(self.manifold, q, p)

        low, high = 0.0, 1.0
        for _ in range(ARC_SEARCH):
            left, right = (2 * low + high) / 3, (low + 2 * high) / 3
            low, high = (low, right) if apart(left) < apart(right) else (left, high)
        return apart((low + high) / 2) < SAME

    # ---------------------------------------------------------------------------------------- falls

    def _fall(self, number: int, seed: Array) -> None:
        """Go straight ahead, forth and back, from face to smaller face, into corners."""
        point = self.quotient.at(seed)
        active = point.active() if np.isfinite(point.values).all() else None
        if active is None:
            self.registry.note(f"start {number} lies outside the polyhedron: left out")
        elif not self._land(point, active, both=True):
            self.registry.note(
                f"start {number}: straight walks in {FALLS} directions, forth and back, met "
                f"nothing within {self.quotient.extent:g} scale units"
            )

    def _land(self, point: EvaluatedPoint, active: frozenset[int], *, both: bool) -> bool:
        """Go on from a point of a face; return whether that led anywhere."""
        undirected = self._undirected(point, active)
        free = self._free(point, active.difference(undirected))
        if free > 0 and undirected:
            self._note_undirected(point, undirected)
            return False
        if free == 0 or (free == 1 and not self._continues(point, active)):
            self.corner(point)
            return True
        if free == 1:
            return self._edge_at(point, active) is not None
        met = False
        for there, found in islice(self._straight(point, active), 2 if both else 1):
            met |= self._land(there, found, both=False)
        return met

    def _straight(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> Iterator[tuple[EvaluatedPoint, frozenset[int]]]:
        """Yield where straight walks in random directions, forth and back, meet something.

        Walks are short first; only where none of them meets anything they go all the way.
        """
        point = HeldPoint(self.quotient, point.q, point.basis(active))
        met = False
        for extent in (self.quotient.extent / SHORT, self.quotient.extent):
            for _ in range(0 if met else FALLS):
                v = point.tangent(self.rng.standard_normal(len(point.q)))
                for way in (v, -v):
                    walk = follow(point, way, passive=active, home=True, extent=extent)
                    there = walk.last.active() if walk.end is End.CORNER else None
                    if there is not None:
                        met = True
                        yield walk.last, there

    def _undirected(self, point: EvaluatedPoint, active: frozenset[int]) -> list[int]:
        """Return the active functions and equations whose gradients have no direction."""
        return point.vanishing([*active, *range(self.quotient.count, len(point.values))])

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

    def _continues(self, point: EvaluatedPoint, active: frozenset[int]) -> bool:
        """Whether functions that depend on each other vanish together on a curve."""
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

    # ---------------------------------------------------------------------------------------- faces

    def _crossings(self) -> Iterator[tuple[int, frozenset[int]]]:
        """Yield edges and faces beside them that were not crossed yet."""
        if self.symmetry.relabels:
            return
        while self.crossed < len(self.curves):
            for face in self.faces_beside(self.curves[self.crossed]):
                if (self.crossed, face) not in self.shot:
                    yield self.crossed, face
            self.crossed += 1

    def faces_beside(self, curve: Curve) -> dict[frozenset[int], Ray]:
        """Return the two-dimensional faces that meet an edge, and the way into each."""
        if curve.beside is None:
            found = faces_beside(self._vantage(curve), curve.active)
            curve.beside = {ray.active: ray for ray in found}
        return curve.beside

    def _vantage(self, curve: Curve) -> EvaluatedPoint:
        """Return the point of a curve nearest to its middle where gradients have a direction."""
        middle = len(curve.points) // 2
        for k in sorted(range(len(curve.points)), key=lambda k: abs(k - middle)):
            point = self.quotient.at(curve.points[k])
            if not self._undirected(point, curve.active):
                return point
        return self.quotient.at(curve.middle)

    def _shoot(self, k: int, face: frozenset[int]) -> None:
        """Go straight across a face from the middle of an edge and record where it ends."""
        ray = self.faces_beside(self.curves[k])[face]
        walk = follow(ray.sample, ray.direction, passive=face)
        active = walk.last.active() if walk.end is End.CORNER else None
        if active is None or not active > face:
            return
        undirected = self._undirected(walk.last, active)
        if undirected:
            self._note_undirected(walk.last, undirected)
            return
        if self._free(walk.last, active) != 1 or not self._continues(walk.last, active):
            return
        edge = self._edge_at(walk.last, active)
        if edge is not None:
            self.passages.append(Crossing(self.flag(k, face), self._flag_of(edge, face)))

    def flag(self, k: int, face: frozenset[int]) -> Flag:
        """Return the flag of an edge and a face beside it."""
        start = self.curves[k].start
        names = self.registry.names(face)
        return ("half", start, names) if start is not None else ("curve", k, names)

    def _flag_of(self, edge: tuple[str, EdgeEnd | int], face: frozenset[int]) -> Flag:
        return (edge[0], edge[1], self.registry.names(face))
