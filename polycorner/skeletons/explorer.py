"""Search for the skeleton of a polyhedron: descents, edges, crossings of faces, in this order.

Near a point an algebraic set is a cone over its link, its intersection with a sphere that is
small enough ([Mil] sec. 2): the corners of the link are the edges at the point, its edges the
two-dimensional faces there, and a closed edge without a corner is a face around an apex.
The link is a polyhedron of one dimension less, so its own skeleton is searched for; two radii must
agree.  This holds whatever the order of contact: for crossings, cusps and apexes alike.
At folds the link is known from first and second derivatives and not searched, and where there are
several relations its corners are.
"""

import copy
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, combinations, islice

import numpy as np

from polycorner.polyhedra.cones import unit_rows
from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import VICINITY, EvaluatedPoint, Quotient, Sample
from polycorner.progress import Progress, silent
from polycorner.searches import Clock, Ending, Task, Told, work_through
from polycorner.skeletons.branched_corners import branched_figure
from polycorner.skeletons.curves import Curve, FaceCrossing, Flag
from polycorner.skeletons.folds import fold_figure
from polycorner.skeletons.parts import Completeness
from polycorner.skeletons.probing import ISLAND, ROUNDS, Anchor, Prober
from polycorner.skeletons.singularities import singular_point, singular_points
from polycorner.skeletons.spheres_about import SAMPLED, Link, link_about
from polycorner.skeletons.states import Budget, SearchState, copied
from polycorner.skeletons.tracing import FIGURE, EdgeTracer
from polycorner.skeletons.vertex_figures import (
    Ray,
    Sector,
    VertexFigure,
    faces_beside,
    singular_rays,
)
from polycorner.skeletons.walks import End, follow
from polycorner.spaces.manifold import Array
from polycorner.workers import Lookahead, Workers

# Random directions of a descent.
DIRECTIONS = 6
# Points of a closed edge that a face is crossed from.
ACROSS = 6
# Points of a face from which its singular points are sought.
TRIES = 4
# The first walks of a descent end after this part of the extent.
SHORT = 20
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


class Explorer(Prober):
    """A search in progress."""

    def __init__(
        self, quotient: Quotient, starts: Iterable[Array], rng: np.random.Generator
    ) -> None:
        probes = not isinstance(quotient.polyhedron, Link)
        super().__init__(quotient, partial(singular_figure, _searched), rng, probes=probes)
        self.starts: deque[tuple[int, Array]] = deque(enumerate(starts))
        self.crossings: list[FaceCrossing] = []
        self.tried: set[Flag] = set()
        self._beside: dict[int, Mapping[frozenset[int], Ray]] = {}
        self._tries: Counter[frozenset[int]] = Counter()  # singular points, by face
        self._finished = 0  # edges beside which every face was crossed

    @classmethod
    def resumed(cls, state: SearchState) -> "Explorer":
        """Return a search in a given state; the state stays as it is."""
        explorer = cls(state.quotient, (), copy.deepcopy(state.rng))
        explorer.registry.records += map(copied, state.records)
        explorer.registry.notes.update(dict.fromkeys(state.notes))
        explorer.registry.lost = state.lost
        explorer.curves += state.curves
        explorer.crossings += state.crossings
        explorer.starts.extend(state.starts)
        explorer.pending.extend(state.pending)
        explorer.tried |= state.tried
        explorer.patches += state.patches
        explorer.links += state.links
        explorer.origins += state.origins
        explorer.least.update(state.least)
        explorer.sought = state.sought
        return explorer

    @property
    def state(self) -> SearchState:
        """The state of the search, independent of what it does next."""
        return SearchState(
            quotient=self.quotient,
            records=tuple(map(copied, self.records)),
            curves=tuple(self.curves),
            crossings=tuple(self.crossings),
            starts=tuple(self.starts),
            pending=tuple(self.pending),
            tried=frozenset(self.tried),
            patches=tuple(self.patches),
            links=tuple(self.links),
            origins=tuple(self.origins),
            least=dict(self.least),
            sought=self.sought,
            notes=tuple(self.notes),
            lost=self.registry.lost,
            rng=copy.deepcopy(self.rng),
        )

    def run(
        self,
        budget: Budget,
        progress: Progress,
        workers: Workers | None = None,
        clock: Clock | None = None,
    ) -> Completeness:
        """Work until nothing is left, budget or time is used up, or Ctrl-C.

        At least one edge, descent or crossing is done, however short the time.  Workers walk along
        the edges that are pending and compute vertex figures; they are put together here, in the
        order in which they were found, so that the result is the same for any workers.
        """
        self.lookahead = None if workers is None else Lookahead(workers)
        tasks = self._work(budget.edges)
        try:
            ending = work_through(tasks, self._told, progress, seconds=budget.seconds, clock=clock)
            self.expand()
        except KeyboardInterrupt:
            ending = Ending.INTERRUPTED
            self.expand()
        finally:
            if self.lookahead is not None:
                self.lookahead.close()
            self.lookahead = None
        if ending is not Ending.FINISHED:
            return Completeness[ending.name]
        if not self.curves and not self.records and not self.patches:
            return Completeness.SEEDS
        return Completeness.GAPS if self.registry.lost else Completeness.EXHAUSTED

    def _told(self) -> Told:
        count = len(self.curves)
        return count, count + len(self.pending), f"{len(self.records)} corners"

    def _work(self, budget: int) -> Iterator[Task]:
        """Yield what to do next, and whether the budget allows it.

        Work leaves the lists only once it is done, so that an interruption loses nothing.
        """
        edges, crossings, descents = len(self.curves) + budget, len(self.tried) + budget, budget
        while True:
            if self.pending and self.pending[0][1] == FIGURE:
                self.expand(1)
            elif self.pending:
                if not self._is_traced(self.pending[0]):
                    yield len(self.curves) < edges, partial(self._trace, self.pending[0])
                done = self.pending.popleft()
                if self.lookahead is not None and done in self.lookahead:
                    self.lookahead.drop(done)
            elif self.starts:
                allowed = len(self.curves) < edges and descents > 0
                yield allowed, partial(self._descend, *self.starts[0])
                self.starts.popleft()
                descents -= 1
            else:
                way = next(self._uncrossed(), None)
                if way is not None:
                    yield len(self.tried) < crossings, partial(self._cross, *way)
                    self.tried.add(way[0])
                elif self.sought[0] < ROUNDS and self.sought[1] != self._found:
                    yield descents > 0, self._seek
                else:
                    return

    def _seek(self) -> None:
        """Seek islands; those that may be new become starts."""
        self.starts.extend((ISLAND, q) for q in self.seek())
        self.sought = (self.sought[0] + 1, self._found)

    @property
    def _found(self) -> int:
        return len(self.records) + len(self.curves) + len(self.patches)

    # ------------------------------------------------------------------------------------- descents

    def _descend(self, number: int, start: Array) -> None:
        """Walk straight ahead in random directions, from face to smaller face, to corners."""
        point = self.entered(number, start)
        if point is None:
            return
        active = point.active() or frozenset()
        known, whole = self._found, self._free(point, frozenset()) == 3
        found = self._descend_from(point, active, both=number != ISLAND)
        if not found and number != ISLAND:
            self.registry.note(
                f"start {number}: straight walks in {DIRECTIONS} directions, forth and back, met "
                f"nothing within {self.quotient.extent:g} scale units"
            )
        through = whole and not self.polyhedron.is_union and not self.symmetry.relabels
        if through and len(active) == 1 and self._found > known:
            for there, beyond in self.inside(point, active):
                found |= self._descend_from(there, beyond, both=False)
        if through and len(active) < 2 and len(found) > 1:
            self.links.append(found)

    def _descend_from(
        self, point: EvaluatedPoint, active: frozenset[int], *, both: bool
    ) -> frozenset[Anchor]:
        """Descend from a point of a face; return the edges and closed faces that were found."""
        undirected = self._undirected(point, active)
        free = self._free(point, active.difference(undirected))
        if free > 0 and undirected:
            return self._singular(point, active, undirected)
        if free == 0 or (free == 1 and not self._on_curve(point, active)):
            found = self.corner(point)
            return frozenset() if found is None else frozenset([("corner", found[0])])
        if free == 1:
            edge = self._edge_at(point, active)
            return frozenset() if edge is None else frozenset([edge])
        patch = self.patch_at(point, active) if free == 2 else None
        if patch is not None:
            return frozenset([("patch", patch)])
        apexes = self._find_singular(point, active)
        return apexes | self._descend_across(point, active, free, 2 if both else 1)

    def _singular(
        self, point: EvaluatedPoint, active: frozenset[int], undirected: list[int]
    ) -> frozenset[Anchor]:
        """Record the singular corner at a point where gradients have no direction, if it is one."""
        reach = VICINITY * self.quotient.tolerances.zero
        corner = singular_point(self.quotient, point.q, sorted(active), reach)
        if corner is None or corner.active() is None:
            self._note_undirected(point, undirected)
            return frozenset()
        found = self.corner(corner)
        return frozenset() if found is None else frozenset([("corner", found[0])])

    def _find_singular(self, point: EvaluatedPoint, face: frozenset[int]) -> frozenset[Anchor]:
        """Record the singular corners that a point of a face leads to."""
        self._tries[face] += 1
        if not self.probes or self._tries[face] > TRIES:
            return frozenset()
        corners = [self.corner(found) for found in singular_points(point, face)]
        return frozenset(("corner", corner[0]) for corner in corners if corner is not None)

    def _descend_across(
        self, point: EvaluatedPoint, active: frozenset[int], free: int, most: int
    ) -> frozenset[Anchor]:
        """Descend along straight walks; where they meet nothing, by a net or by long walks."""

        def descended(
            ends: Iterable[tuple[EvaluatedPoint, frozenset[int]]],
        ) -> frozenset[Anchor]:
            every = (self._descend_from(q, there, both=False) for q, there in islice(ends, most))
            return frozenset().union(*every)

        found = descended(self._straight(point, active, self.quotient.extent / SHORT))
        if not found and free == 2:
            known = len(self.patches)
            found = descended(self.explored(point, active))
            if len(self.patches) > known:
                return frozenset([("patch", known)])
        return found or descended(self._straight(point, active, self.quotient.extent))

    def _straight(
        self, point: EvaluatedPoint, active: frozenset[int], extent: float
    ) -> Iterator[tuple[EvaluatedPoint, frozenset[int]]]:
        """Yield the ends of straight walks in random directions and their opposites."""
        point = HeldPoint(self.quotient, point.q, point.basis(active))
        for _ in range(DIRECTIONS):
            v = point.tangent(self.rng.standard_normal(len(point.q)))
            for way in (v, -v):
                walk = follow(point, way, passive=active, home=True, extent=extent)
                there = walk.last.active() if walk.end is End.CORNER else None
                if there is not None:
                    yield walk.last, there

    # ------------------------------------------------------------------------------------ crossings

    def _uncrossed(self) -> Iterator[tuple[Flag, HeldPoint, Array]]:
        """Yield ways into faces that were not crossed yet: from edges, then from apexes."""
        if self.symmetry.relabels or (
            isinstance(self.polyhedron, Link) and self.polyhedron.is_large
        ):
            return
        while self._finished < len(self.curves):
            for face, ray in self.faces_beside(self._finished).items():
                flag = self.flag(self._finished, face)
                if flag not in self.tried:
                    yield flag, ray.start(self.quotient), ray.direction
            self._finished += 1
        for k, record in enumerate(self.records):
            for i, sector in enumerate(record.figure.sectors):
                flag = ("apex", (k, i), self.registry.names(sector.held))
                if not sector.rays and sector.sample is not None and flag not in self.tried:
                    way = self.manifold.chord(sector.sample.q, record.point.q) / self.scales
                    yield flag, sector.sample.at(self.quotient), way

    def faces_beside(self, k: int) -> Mapping[frozenset[int], Ray]:
        """Return the two-dimensional faces that meet an edge, and a ray into each."""
        if k not in self._beside:
            curve = self.curves[k]
            found = faces_beside(self._vantage(curve), curve.active)
            self._beside[k] = {ray.active: ray for ray in found}
        return self._beside[k]

    def _vantage(self, curve: Curve) -> EvaluatedPoint:
        """Return a point of a curve near its middle where gradients have a direction.

        Not the middle itself, from where straight ways across symmetric faces go through points
        where others touch.
        """
        middle = 3 * len(curve.points) // 7
        for k in sorted(range(len(curve.points)), key=lambda k: abs(k - middle)):
            point = self.quotient.at(curve.points[k])
            if not self._undirected(point, curve.active):
                return point
        return self.quotient.at(curve.middle)

    def _cross(self, start: Flag, sample: HeldPoint, direction: Array) -> None:
        """Walk straight across a face, from several points if it starts at a closed edge."""
        self._cross_along(start, sample, direction)
        face = sample.active() or frozenset()
        curve = self.curves[start[1]] if start[0] == "curve" else None
        for q in curve.points[:: max(1, len(curve.points) // ACROSS)] if curve else ():
            for ray in faces_beside(self.quotient.at(q), curve.active if curve else face):
                if ray.active == face:
                    self._cross_along(start, ray.start(self.quotient), ray.direction)

    def _cross_along(self, start: Flag, sample: HeldPoint, direction: Array) -> None:
        """Walk straight across a face and record the edge at the end; look for its apexes."""
        face = sample.active() or frozenset()
        walk = follow(sample, direction, passive=face)
        middle = self.quotient.at(walk.points[len(walk.points) // 2])
        self._find_singular(middle, face)
        active = walk.last.active() if walk.end is End.CORNER else None
        if start[0] == "apex" and active is None and self.patch_at(middle, face) is None:
            self._descend_across(middle, face, self._free(middle, face), 2)
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
            self.crossings.append(FaceCrossing(start, (*edge, names)))

    def flag(self, k: int, face: frozenset[int]) -> Flag:
        """Return the flag of an edge and a face beside it."""
        start = self.curves[k].start
        names = self.registry.names(face)
        return ("half", start, names) if start is not None else ("curve", k, names)


def _searched(quotient: Quotient, starts: Sequence[Array]) -> Explorer:
    """Return a finished search, with directions of its own."""
    explorer = Explorer(quotient, starts, np.random.default_rng(0))
    explorer.run(Budget(), silent)
    return explorer
