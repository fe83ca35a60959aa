"""Search for the skeleton of a polyhedron: descents, edges, crossings of faces, in this order."""

import copy
import math
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from time import monotonic

import numpy as np

from polycorner import checks
from polycorner.progress import Progress, silent
from polycorner.skeletons.elements import Completeness
from polycorner.skeletons.flags import Crossing, Flag
from polycorner.skeletons.links import SAMPLED, Link, singular_figure
from polycorner.skeletons.points import VICINITY, EvaluatedPoint, HeldPoint, Quotient
from polycorner.skeletons.registry import CornerRecord
from polycorner.skeletons.singularities import singular_point, singular_points
from polycorner.skeletons.tracing import Curve, EdgeEnd, EdgeTracer
from polycorner.skeletons.vertex_figures import Ray, faces_beside
from polycorner.skeletons.walks import End, follow
from polycorner.spaces.manifold import Array
from polycorner.values import Value

# Random directions of a descent.
DIRECTIONS = 6
# Points of a face from which its singular points are sought.
TRIES = 4
# The first walks of a descent end after this part of the extent.
SHORT = 20


@dataclass(frozen=True)
class Budget:
    """How much a search may do before it stops and can be resumed.

    Attributes
    ----------
    edges : int
        Most edges to trace; as many starts may be descended from, and as many faces crossed.
    seconds : float
        Time after which it stops: between two edges, descents or crossings, of which it does at
        least one.

    Raises
    ------
    TypeError, ValueError
        Naming the argument.
    """

    edges: int = 100_000
    seconds: float = math.inf

    def __post_init__(self) -> None:
        checks.whole("budget", self.edges, least=1)
        checks.real("seconds", self.seconds, above=0, infinite=True, unit="s")


@dataclass(frozen=True, eq=False)
class SearchState(Value):
    """Everything that a search found and has left to do.

    Attributes
    ----------
    quotient : Quotient
        The polyhedron with its symmetry and tolerances.
    records : tuple of CornerRecord
        Corners.
    curves : tuple of Curve
        Edges.
    crossings : tuple of Crossing
        Straight ways across faces.
    starts : tuple of (int, (n,) array)
        Numbered starts that no descent was made from yet.
    pending : tuple of EdgeEnd
        Ends of edges to trace.
    tried : frozenset
        Faces beside edges and apexes that were crossed.
    notes : tuple of str
        What a user should know.
    lost : bool
        Whether something could not be followed.
    rng : numpy.random.Generator
        For the descents that are left.
    """

    quotient: Quotient
    records: tuple[CornerRecord, ...]
    curves: tuple[Curve, ...]
    crossings: tuple[Crossing, ...]
    starts: tuple[tuple[int, Array], ...]
    pending: tuple[EdgeEnd, ...]
    tried: frozenset[Flag]
    notes: tuple[str, ...]
    lost: bool
    rng: np.random.Generator


class Explorer(EdgeTracer):
    """A search in progress."""

    def __init__(
        self, quotient: Quotient, starts: Iterable[Array], rng: np.random.Generator
    ) -> None:
        super().__init__(quotient, partial(singular_figure, _searched))
        self.rng = rng
        self.starts: deque[tuple[int, Array]] = deque(enumerate(starts))
        self.crossings: list[Crossing] = []
        self.tried: set[Flag] = set()
        self._beside: dict[int, Mapping[frozenset[int], Ray]] = {}
        self._sought: Counter[frozenset[int]] = Counter()  # singular points, by face
        self._finished = 0  # edges beside which every face was crossed

    @classmethod
    def resumed(cls, state: SearchState) -> "Explorer":
        """Return a search in a given state; the state stays as it is."""
        explorer = cls(state.quotient, (), copy.deepcopy(state.rng))
        explorer.registry.records += map(_copied, state.records)
        explorer.registry.notes.update(dict.fromkeys(state.notes))
        explorer.registry.lost = state.lost
        explorer.curves += state.curves
        explorer.crossings += state.crossings
        explorer.starts.extend(state.starts)
        explorer.pending.extend(state.pending)
        explorer.tried |= state.tried
        return explorer

    @property
    def state(self) -> SearchState:
        """The state of the search, independent of what it does next."""
        return SearchState(
            quotient=self.quotient,
            records=tuple(map(_copied, self.records)),
            curves=tuple(self.curves),
            crossings=tuple(self.crossings),
            starts=tuple(self.starts),
            pending=tuple(self.pending),
            tried=frozenset(self.tried),
            notes=tuple(self.notes),
            lost=self.registry.lost,
            rng=copy.deepcopy(self.rng),
        )

    # --------------------------------------------------------------------------- order of the work

    def run(self, budget: Budget, progress: Progress) -> Completeness:
        """Work until nothing is left, budget or time is used up, or Ctrl-C.

        At least one edge, descent or crossing is done, however short the time.
        """
        deadline, first = monotonic() + budget.seconds, True
        try:
            for allowed, work in self._work(budget.edges):
                if not allowed or (monotonic() > deadline and not first):
                    return Completeness.BUDGET
                work()
                first = False
                count = len(self.curves)
                progress(count, count + len(self.pending), f"{len(self.records)} corners")
        except KeyboardInterrupt:
            return Completeness.INTERRUPTED
        if not self.curves and not self.records:
            return Completeness.SEEDS
        return Completeness.GAPS if self.registry.lost else Completeness.EXHAUSTED

    def _work(self, budget: int) -> Iterator[tuple[bool, Callable[[], None]]]:
        """Yield what to do next, and whether the budget allows it.

        Work leaves the lists only once it is done, so that an interruption loses nothing.
        """
        edges, crossings, descents = len(self.curves) + budget, len(self.tried) + budget, budget
        while True:
            if self.pending:
                if not self._is_traced(self.pending[0]):
                    yield len(self.curves) < edges, partial(self._trace, self.pending[0])
                self.pending.popleft()
            elif self.starts:
                allowed = len(self.curves) < edges and descents > 0
                yield allowed, partial(self._descend, *self.starts[0])
                self.starts.popleft()
                descents -= 1
            else:
                way = next(self._uncrossed(), None)
                if way is None:
                    return
                yield len(self.tried) < crossings, partial(self._cross, *way)
                self.tried.add(way[0])

    # ------------------------------------------------------------------------------------- descents

    def _descend(self, number: int, start: Array) -> None:
        """Walk straight ahead in random directions, from face to smaller face, to corners."""
        point = self.quotient.at(start)
        active = point.active() if np.isfinite(point.values).all() else None
        if active is None:
            self.registry.note(f"start {number} lies outside the polyhedron: left out")
        elif not self._descend_from(point, active, both=True):
            self.registry.note(
                f"start {number}: straight walks in {DIRECTIONS} directions, forth and back, met "
                f"nothing within {self.quotient.extent:g} scale units"
            )

    def _descend_from(self, point: EvaluatedPoint, active: frozenset[int], *, both: bool) -> bool:
        """Descend from a point of a face; return whether that found an edge or a corner."""
        undirected = self._undirected(point, active)
        free = self._free(point, active.difference(undirected))
        if free > 0 and undirected:
            return self._singular(point, active, undirected)
        if free == 0 or (free == 1 and not self._on_curve(point, active)):
            self.corner(point)
            return True
        if free == 1:
            return self._edge_at(point, active) is not None
        met = self._find_singular(point, active)
        for there, found in islice(self._straight(point, active), 2 if both else 1):
            met |= self._descend_from(there, found, both=False)
        return met

    def _singular(
        self, point: EvaluatedPoint, active: frozenset[int], undirected: list[int]
    ) -> bool:
        """Record the singular corner at a point where gradients have no direction, if it is one."""
        reach = VICINITY * self.quotient.tolerance
        corner = singular_point(self.quotient, point.q, sorted(active), reach)
        if corner is None or corner.active() is None:
            self._note_undirected(point, undirected)
            return False
        self.corner(corner)
        return True

    def _find_singular(self, point: EvaluatedPoint, face: frozenset[int]) -> bool:
        """Record the singular corners that a point of a face leads to; return whether any."""
        self._sought[face] += 1
        if isinstance(self.polyhedron, Link) or self._sought[face] > TRIES:
            return False
        corners = [self.corner(found) for found in singular_points(point, face)]
        return any(corner is not None for corner in corners)

    def _straight(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> Iterator[tuple[EvaluatedPoint, frozenset[int]]]:
        """Yield the ends of straight walks in random directions and their opposites.

        Walks are short first; only where none of them ends in a smaller face are they long.
        """
        point = HeldPoint(self.quotient, point.q, point.basis(active))
        met = False
        for extent in (self.quotient.extent / SHORT, self.quotient.extent):
            for _ in range(0 if met else DIRECTIONS):
                v = point.tangent(self.rng.standard_normal(len(point.q)))
                for way in (v, -v):
                    walk = follow(point, way, passive=active, home=True, extent=extent)
                    there = walk.last.active() if walk.end is End.CORNER else None
                    if there is not None:
                        met = True
                        yield walk.last, there

    # ------------------------------------------------------------------------------------ crossings

    def _uncrossed(self) -> Iterator[tuple[Flag, HeldPoint, Array]]:
        """Yield ways into faces that were not crossed yet: from edges, then from apexes."""
        if self.symmetry.relabels or (isinstance(self.polyhedron, Link) and self._is_large):
            return
        while self._finished < len(self.curves):
            for face, ray in self.faces_beside(self._finished).items():
                flag = self.flag(self._finished, face)
                if flag not in self.tried:
                    yield flag, ray.sample, ray.direction
            self._finished += 1
        for k, record in enumerate(self.records):
            for i, sector in enumerate(record.figure.sectors):
                flag = ("apex", (k, i), self.registry.names(sector.active))
                if not sector.rays and sector.sample is not None and flag not in self.tried:
                    way = self.manifold.difference(sector.sample.q, record.point.q) / self.scales
                    yield flag, sector.sample, way

    @property
    def _is_large(self) -> bool:
        """Whether a link's faces are too many to cross: those of the corner suffice."""
        return len(self.manifold.names) - len(self.polyhedron.equation_names) >= SAMPLED

    def faces_beside(self, k: int) -> Mapping[frozenset[int], Ray]:
        """Return the two-dimensional faces that meet an edge, and a ray into each."""
        if k not in self._beside:
            curve = self.curves[k]
            found = faces_beside(self._vantage(curve), curve.active)
            self._beside[k] = {ray.active: ray for ray in found}
        return self._beside[k]

    def _vantage(self, curve: Curve) -> EvaluatedPoint:
        """Return the point of a curve nearest to its middle where gradients have a direction."""
        middle = len(curve.points) // 2
        for k in sorted(range(len(curve.points)), key=lambda k: abs(k - middle)):
            point = self.quotient.at(curve.points[k])
            if not self._undirected(point, curve.active):
                return point
        return self.quotient.at(curve.middle)

    def _cross(self, start: Flag, sample: HeldPoint, direction: Array) -> None:
        """Walk straight across a face and record the edge at the end; look for its apexes."""
        face = sample.active() or frozenset()
        walk = follow(sample, direction, passive=face)
        middle = self.quotient.at(walk.points[len(walk.points) // 2])
        self._find_singular(middle, face)
        active = walk.last.active() if walk.end is End.CORNER else None
        if active is None or not active > face:
            return
        undirected = self._undirected(walk.last, active)
        if undirected:
            self._singular(walk.last, active, undirected)
            return
        if self._free(walk.last, active) != 1 or not self._on_curve(walk.last, active):
            return
        edge = self._edge_at(walk.last, active)
        if edge is not None:
            names = self.registry.names(face)
            self.crossings.append(Crossing(start, self._flag_of(edge, names)))

    def flag(self, k: int, face: frozenset[int]) -> Flag:
        """Return the flag of an edge and a face beside it."""
        start = self.curves[k].start
        names = self.registry.names(face)
        return ("half", start, names) if start is not None else ("curve", k, names)

    @staticmethod
    def _flag_of(edge: tuple[str, EdgeEnd | int], names: frozenset[str]) -> Flag:
        return (edge[0], edge[1], names)


def _searched(quotient: Quotient, starts: Sequence[Array]) -> Explorer:
    """Return a finished search, with directions of its own."""
    explorer = Explorer(quotient, starts, np.random.default_rng(0))
    explorer.run(Budget(), silent)
    return explorer


def _copied(record: CornerRecord) -> CornerRecord:
    return replace(record, edges=dict(record.edges))
