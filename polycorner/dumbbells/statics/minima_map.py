"""Which minima a pair of dumbbells has, over its proportions.

At each ``l/R`` the plane of ``t/r`` and ``l/r`` is divided by curves of events
(:mod:`polycorner.dumbbells.statics.minima_curves`).  In each region the minima are listed once, at
the place farthest from curves.  Every minimum of a list is followed in turn, until no curve
and no region is new; what a list has missed is looked for from the minima of the regions beside.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import permutations, product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from polycorner.branches import BranchKind, Diagram, EventCurve
from polycorner.dumbbells.pair import LONGEST, DumbbellPair
from polycorner.dumbbells.statics.minima import kind_of, pair_minima
from polycorner.dumbbells.statics.minima_curves import (
    Rectangle,
    change_curves,
    change_events,
    isolated,
)
from polycorner.dumbbells.statics.regions import Plane, deepest, filled, joined, near
from polycorner.minimisation import Certificate, certify, minimise
from polycorner.toolkit import Array, Checked, Progress, cached_property, checked, checks, silent

CURVATURES = (0.128, 0.5, 1.0, 1.5)
RODS = (0.02, 0.9)
LENGTHS = (2.2, 24.0)
FITTING = 0.995  # largest chord of the cylinder of ball centres that a dumbbell may be


@dataclass(frozen=True)
class _Resolution:
    """How finely a plane is divided.

    Attributes
    ----------
    nodes : int
        Of the grid along either side.
    least : int
        Nodes of a region that counts.
    shortest : int
        Nodes along a border that counts.
    alike : float
        Distance of lines that are one, on the grid.
    first : tuple of float
        Places of the first lists, as parts of either side.
    tries : int
        Places in succession from which a kind leads to no new curve, before it is left.
    steps : int
        In which a minimum is moved to the place of another list.
    same : float
        Difference of the energies of one minimum, in ball radii.
    """

    nodes: int = 161
    least: int = 12
    shortest: int = 6
    alike: float = 0.5
    first: tuple[float, ...] = (0.1, 0.37, 0.63, 0.9)
    tries: int = 3
    steps: int = 8
    same: float = 1e-7


RESOLUTION = _Resolution()


@dataclass(frozen=True, eq=False)
class MinimaRegion(Checked):
    """A part of the plane in which a pair has the same minima.

    Attributes
    ----------
    place : (float, float)
        ``t/r`` and ``l/r`` at which they were listed.
    kinds : mapping from str to int
        The number of minima of each kind, mirror images and relabelled ones counted once.
    minima : tuple of Certificate
        For balls of radius 1, the dumbbells close together.
    """

    place: tuple[float, float]
    kinds: Mapping[str, int]
    minima: tuple[Certificate, ...]


@dataclass(frozen=True, eq=False)
class MinimaBorder(Checked):
    """A curve with different minima on its sides.

    Attributes
    ----------
    kind : BranchKind
        What happens to an equilibrium there; UNDECIDED where what is beyond was not followed.
    active, functions : tuple of str
        Contacts of both sides, and those that open or close.
    parameters : (k, 2) array
        ``t/r`` and ``l/r``.
    """

    kind: BranchKind
    active: tuple[str, ...]
    functions: tuple[str, ...]
    parameters: Array


@dataclass(frozen=True, eq=False)
class MinimaSheet(Checked):
    """The minima at one ``l/R``.

    Attributes
    ----------
    curvature : float
        ``l/R``; 0 is the plane.
    within : Rectangle or None
        What fits in the drum; None if nothing does.
    labels : (n, n) array of int
        Number of the region at each node of a grid that is even in logarithms; -1 in regions
        smaller than it resolves.
    regions : tuple of MinimaRegion
    borders : tuple of MinimaBorder
    """

    curvature: float
    within: Rectangle | None
    labels: NDArray[np.int64]
    regions: tuple[MinimaRegion, ...]
    borders: tuple[MinimaBorder, ...]

    @checked
    def region(self, rod: float, length: float) -> MinimaRegion | None:
        """Return the region of ``t/r`` and ``l/r``.

        None outside, and where a border passes between the place and all nodes beside it.
        """
        sides = [checks.real(*given, above=0) for given in (("rod", rod), ("length", length))]
        if self.within is None or not self.within.contains(rod, length):
            return None
        plane = Plane((self.within.rods, self.within.lengths), len(self.labels))
        place = plane.placed(np.array([sides]))[0]
        lines = [plane.placed(border.parameters) for border in self.borders]
        for corner in product((0, 1), (0, 1)):
            node = plane.around(np.floor(place) + corner)
            label = int(self.labels[node[0], node[1]])
            if label >= 0 and joined(place, node.astype(float), lines):
                return self.regions[label]
        return None


@dataclass(frozen=True, eq=False)
class MinimaMap(Checked):
    """Regions of the proportions of a pair in which it has the same minima.

    Attributes
    ----------
    rods, lengths : (float, float)
        Least and largest ``t/r`` and ``l/r``.
    sheets : tuple of MinimaSheet
        One for each ``l/R``.
    kinds : tuple of str
        All kinds found, the most frequent first.
    examples : mapping from str to (DumbbellPair, Certificate)
        For each kind that of its largest region, with the dumbbells close together.
    starts : int
        Number of starts for each list.
    """

    rods: tuple[float, float]
    lengths: tuple[float, float]
    sheets: tuple[MinimaSheet, ...]
    kinds: tuple[str, ...]
    examples: Mapping[str, tuple[DumbbellPair, Certificate]]
    starts: int

    @checked
    def has(self, kind: str) -> NDArray[np.bool_]:
        """Whether a kind was found at each ``l/R``, ``(k,)``."""
        found = [any(kind in region.kinds for region in sheet.regions) for sheet in self.sheets]
        return np.array(found, dtype=bool)


@checked
def minima_map(
    *,
    curvatures: ArrayLike = CURVATURES,
    rods: ArrayLike = RODS,
    lengths: ArrayLike = LENGTHS,
    starts: int = 250,
    rng: np.random.Generator | int | None = None,
    progress: Progress = silent,
) -> MinimaMap:
    """Map the minima over ``l/R``, ``t/r`` and ``l/r``; mirror images count as one.

    Borders are curves of events, which are followed from the minima that were found; in each region
    there is one list, from random starts.  Minima that no list contains are missing, and so are
    regions smaller than a grid of 161 by 161 places resolves.

    Parameters
    ----------
    curvatures : (k,) array, optional
        ``l/R``, increasing, at least 0 (the plane) and below 2.
    rods : (2,) array, optional
        Least and largest ``t/r``, strictly between 0 and 1.
    lengths : (2,) array, optional
        Least and largest ``l/r``, at least 2 and below 1e8.
    starts : int, optional
        Number of starts for each list.
    rng : Generator or int, optional
        Source of the starts; default a generator with seed 0.
    progress : callable, optional
        Called as ``progress(done, None, note)`` after every list.

    Returns
    -------
    MinimaMap
        Also after an interruption (Ctrl-C), without the sheets that were not finished.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind, shape or range.
    """
    axis = checks.increasing("curvatures", curvatures, least=0, below=2)
    sides = (
        _side("rods", checks.increasing("rods", rods, above=0, below=1)),
        _side("lengths", checks.increasing("lengths", lengths, least=2, below=LONGEST)),
    )
    checks.whole("starts", starts, least=1, most=checks.MOST)
    generator = checks.generator("rng", rng)
    sheets: list[MinimaSheet] = []
    lists = 0
    try:
        for curvature in axis.tolist():
            within = _fitting(curvature, *sides)
            if within is None:
                sheets.append(MinimaSheet(curvature, None, np.zeros((0, 0), np.int64), (), ()))
                continue
            search = _SheetSearch(within, starts, generator)
            for _ in search.lists_made():
                lists += 1
                progress(lists, None, "lists")
            sheets.append(search.sheet())
    except KeyboardInterrupt:
        pass  # the sheets that are finished are the answer
    return _joined(sides, tuple(sheets), starts)


def _side(name: str, ends: Array) -> tuple[float, float]:
    if len(ends) != 2:
        checks.refuse(name, "two numbers, the least and the largest", ends)
    return float(ends[0]), float(ends[1])


def _fitting(
    curvature: float, rods: tuple[float, float], lengths: tuple[float, float]
) -> Rectangle | None:
    """Return the rectangle of the pairs that fit in their drum; None if none does."""
    # l <= 2 FITTING (l / curvature - 1)
    room = 2 * FITTING - curvature
    least = 2 * FITTING * curvature / room if room > 0 else np.inf
    low, high = max(lengths[0], least * (1 + 1e-12)), lengths[1]
    return Rectangle(curvature, rods, (low, high)) if low < high else None


@dataclass
class _List:
    """The minima at a node."""

    node: tuple[int, int]
    pair: DumbbellPair
    minima: list[Certificate] = field(default_factory=list)

    def kinds(self) -> tuple[tuple[str, int], ...]:
        return tuple(sorted(Counter(map(kind_of, self.minima)).items()))

    def lacks_kind(self, other: Certificate) -> bool:
        """Whether no minimum of the list is of the kind of another."""
        return kind_of(other) not in map(kind_of, self.minima)

    def lacks(self, other: Certificate) -> bool:
        """Whether a minimum is none of the list."""
        return all(
            kind_of(one) != kind_of(other) or abs(one.energy - other.energy) > RESOLUTION.same
            for one in self.minima
        )


class _SheetSearch:
    """The search for all regions at one ``l/R``."""

    def __init__(self, within: Rectangle, starts: int, generator: np.random.Generator) -> None:
        self.within, self.starts, self.generator = within, starts, generator
        self.curves: list[EventCurve] = []
        self.lines: list[Array] = []
        self.lists: list[_List] = []
        self.vain: Counter[str] = Counter()  # places in succession, by kind

    @cached_property
    def plane(self) -> Plane:
        return Plane((self.within.rods, self.within.lengths), RESOLUTION.nodes)

    def lists_made(self) -> Iterator[_List]:
        """Yield lists of minima until every region has one, and nothing is missed beside."""
        for i, j in product(RESOLUTION.first, RESOLUTION.first):
            yield self._list((int(i * RESOLUTION.nodes), int(j * RESOLUTION.nodes)))
        while True:
            labels = self.plane.labels(self.lines)
            known = [labels[one.node] for one in self.lists]
            counts = np.bincount(labels.ravel())
            counts[known] = 0
            if counts.max() >= RESOLUTION.least:
                yield self._list(deepest(labels == int(np.argmax(counts))))
            elif not self._look_beside(labels):
                return

    def _list(self, node: tuple[int, int]) -> _List:
        pair = self._pair(node)
        found = pair_minima(pair, starts=self.starts, rng=self.generator, mirror=True)
        if found.interrupted:
            raise KeyboardInterrupt
        made = _List(node, pair)
        for points in found.points:
            closest = min(points, key=lambda q: abs(q[4] - q[1]))
            made.minima.append(certify(pair.polyhedron, pair.energy, closest))
        labels = self.plane.labels(self.lines)
        alike = [one for one in self.lists if labels[one.node] == labels[node]]
        self.lists.append(made)
        for minimum in made.minima:
            if all(one.lacks_kind(minimum) for one in alike):
                self._follow(pair, minimum)
        return made

    def _pair(self, node: tuple[int, int]) -> DumbbellPair:
        return _sized(self.within.curvature, *self.plane.at(node))

    def _follow(self, pair: DumbbellPair, minimum: Certificate) -> None:
        """Add the curves on which a minimum changes."""
        kind, known = kind_of(minimum), len(self.lines)
        if not minimum.active or self.vain[kind] >= RESOLUTION.tries:
            return
        for start in isolated(pair, minimum):
            if start.is_minimum and start.analysis.independent:
                self._add(change_events(start, self.within), pair.length)
        self.vain[kind] = self.vain[kind] + 1 if len(self.lines) == known else 0

    def _add(self, found: Diagram, length: float) -> None:
        """Add the curves of the events of a diagram that are on none yet."""
        events = [e.parameter for e in found.events if e.kind is not BranchKind.END]
        places = np.array([(rod, length) for rod in events]).reshape(-1, 2)
        if near(self.plane.placed(places), self.lines, RESOLUTION.alike):
            return
        for curve in change_curves(found, length, self.within):
            line = self.plane.smooth(curve.parameters)
            if len(line) and not near(line, self.lines, RESOLUTION.alike):
                self.curves.append(curve)
                self.lines.append(line)

    def _look_beside(self, labels: NDArray[np.int64]) -> bool:
        """Look in every region for the minima of those beside it; return whether one was missed."""
        there = [int(labels[one.node]) for one in self.lists]
        steps = ((labels[1:], labels[:-1]), (labels[:, 1:], labels[:, :-1]))
        beside = {
            (int(a), int(b)) for ends in steps for a, b in zip(*map(np.ravel, ends), strict=True)
        }
        beside |= {(b, a) for a, b in beside}
        missed = False
        for (a, one), (b, two) in permutations(zip(there, self.lists, strict=True), 2):
            if (a, b) not in beside:
                continue
            fewer = dict(one.kinds()).items() - dict(two.kinds()).items()
            for minimum in [m for m in one.minima if kind_of(m) in dict(fewer)]:
                moved = self._moved(one, two, minimum)
                if moved is not None and two.lacks(moved):
                    two.minima.append(moved)
                    self._follow(two.pair, moved)
                    missed = True
        return missed

    def _moved(self, one: _List, two: _List, minimum: Certificate) -> Certificate | None:
        """Return what a minimum of one place is at another, if it is a minimum there."""
        ends = np.log([self.plane.at(one.node), self.plane.at(two.node)])
        for part in np.linspace(0, 1, RESOLUTION.steps + 1)[1:]:
            sizes = np.exp((1 - part) * ends[0] + part * ends[1])
            pair = _sized(self.within.curvature, *sizes.tolist()) if part < 1 else two.pair
            minimum = minimise(pair.polyhedron, pair.energy, minimum.point)
        return minimum if minimum.is_minimum else None

    def sheet(self) -> MinimaSheet:
        """Return regions with the same minima as one, and the curves between different ones."""
        nodes = self.plane.labels(self.lines)
        lists = {int(nodes[one.node]): one for one in reversed(self.lists)}
        kinds = [lists[k].kinds() if k in lists else () for k in range(int(nodes.max()) + 1)]
        words = sorted({*kinds} - {()})
        alike = np.array([words.index(some) if some else -1 for some in kinds])[nodes]
        labels, regions = np.full_like(nodes, -1), list[MinimaRegion]()
        for k in range(len(words)):
            parts, count = ndimage.label(alike == k)
            for part in range(1, count + 1):
                here = parts == part
                if here.sum() >= RESOLUTION.least:
                    labels[here] = len(regions)
                    one = lists[int(nodes[deepest(here)])]
                    place, found = self.plane.at(one.node), tuple(one.minima)
                    regions.append(MinimaRegion(place, dict(one.kinds()), found))
        borders = [
            MinimaBorder(curve.kind, curve.active, curve.functions, self.plane.points(part))
            for curve, line in zip(self.curves, self.lines, strict=True)
            for part in self._parts(line, filled(labels))
        ]
        return MinimaSheet(
            self.within.curvature, self.within, labels, tuple(regions), tuple(borders)
        )

    def _parts(self, line: Array, labels: NDArray[np.int64]) -> Iterator[Array]:
        """Yield the parts of a line with different minima on its sides."""
        way, middle = np.diff(line, axis=0), (line[1:] + line[:-1]) / 2
        aside = np.stack([-way[:, 1], way[:, 0]], axis=1)
        aside /= np.maximum(np.linalg.norm(aside, axis=1), np.finfo(float).tiny)[:, None]
        left, right = (
            labels[tuple(self.plane.around(middle + side * aside).T)] for side in (1, -1)
        )
        differ = np.concatenate([[False], left != right, [False]])
        ends = np.flatnonzero(differ[1:] != differ[:-1]).reshape(-1, 2)
        for start, stop in ends.tolist():
            if stop - start >= RESOLUTION.shortest:
                yield line[start : stop + 1]


def _joined(
    sides: tuple[tuple[float, float], tuple[float, float]],
    sheets: tuple[MinimaSheet, ...],
    starts: int,
) -> MinimaMap:
    """Return a map with an example of each kind, from its largest region."""
    sizes: Counter[str] = Counter()
    examples: dict[str, tuple[int, DumbbellPair, Certificate]] = {}
    for sheet in sheets:
        for k, region in enumerate(sheet.regions):
            size = int((sheet.labels == k).sum())
            pair = _sized(sheet.curvature, *region.place)
            sizes.update(dict.fromkeys(region.kinds, size))
            for one in region.minima:
                if size > examples.get(kind_of(one), (0,))[0]:
                    examples[kind_of(one)] = (size, pair, one)
    kinds = tuple(sorted(sizes, key=lambda kind: -sizes[kind]))
    of = {kind: examples[kind][1:] for kind in kinds}
    return MinimaMap(*sides, sheets, kinds, of, starts)


def _sized(curvature: float, rod: float, length: float) -> DumbbellPair:
    return DumbbellPair(length, 1.0, rod, length / curvature if curvature else np.inf)
