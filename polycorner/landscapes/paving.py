"""Barriers from below, where no list can be had: boxes that touch, each with its least energy.

Let closed boxes cover the part of ``D`` in a box, on circles modulo their periods, each with a
lower bound of ``E`` on the part of ``D`` in it (:mod:`~polycorner.landscapes.heights`); boxes
without points of ``D`` are left out, and sides are drawn in to where its points may lie.  Two boxes
are linked where they touch, in a face, an edge or a corner.

*The bottleneck is a lower bound.*  Let ``C`` be a connected subset of ``D_c`` in the box that
contains points of ``start`` and of ``end``.  Every point of ``C`` lies in a box of weight at most
``c``.  The classes of linked boxes among these have unions that are closed, of which no two meet:
``C``, being connected, lies in one of them.  So boxes of weight at most ``c`` lead from one that
meets ``start`` to one that meets ``end``.

*Leaving.*  If ``C`` contains a point outside of ``{g >= 0}``, or beyond the sides of the box, its
component in ``{g >= 0}`` that meets the start contains a point where some ``g`` vanishes, or of a
side (boundary bumping, [Nadler] 5.4).  So paths may be sought in ``{g >= 0}``, and a box is an end
with the weight of its energy on ``{g = 0}``, or on the side.

*Refinement.*  A box may rise to the greatest value of the bound's Lagrangian; the bottleneck of
these is what the bound may rise to.  Boxes are *gates* if they are lower than the middle between
both, and may rise to it: those are divided that lie on ways with the fewest gates.  Around a pass
whose height grows like the square of the distance, boxes of a constant share of the distance do,
and each halving of the gap takes about as many boxes.  Where heights say no more, the set may be
narrower than the boxes show: then gates are boxes that are cut by walls, among those a little above
the bottleneck at first, and among ever more of them while ways are found to be closed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from sys import float_info
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, dijkstra, minimum_spanning_tree

from polycorner import checks
from polycorner.kinds import checked
from polycorner.landscapes.heights import Heights
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.progress import Progress, silent
from polycorner.proofs.lists.domains import Domain, domain
from polycorner.searches import Ending, Task, Told, work_through
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH
from polycorner.values import Checked

FIRST = 1024  # boxes, from which on those alone are divided that block a way
OFTEN = 8  # one of so many boxes is new when the bottleneck is sought again
LEAST = 16  # boxes that are divided at a time, where there are as many gates
ROUND = 4096  # boxes that are divided at a time, at most
FEW = 1 / 64  # share of the boxes above the bottleneck, among which gaps are sought first
AIM = 0.5  # share of the way from the bound to what it may rise to, that is aimed at
Mask = NDArray[np.bool_]
Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Paving(Checked):
    """A lower bound of the energy at which two places are in one component, proved by boxes.

    Attributes
    ----------
    lower : float
        The bound; infinite where it is proved that they are not connected at any energy.
    boxes : int
        How many boxes were treated.
    ending : Ending
        Whether boxes were divided to the end, or budget and time were used up before.
    way : (k, n) array
        Middles of the boxes of a way of least height, which no box blocks yet: where the bound
        could be raised, and where a path may be sought.  Empty where there is none.
    """

    lower: float
    boxes: int
    ending: Ending
    way: Array

    def __repr__(self) -> str:
        """Return the bound and the number of boxes."""
        return f"Paving(at least {self.lower:.10g}, {self.boxes} boxes)"


@checked
def paved_barrier(
    problem: Problem,
    box: Any,
    start: Any,
    ends: Sequence[Any] = (),
    *,
    region: Any = (),
    walled: bool = False,
    until: float = inf,
    resolution: float = SEARCH.resolution,
    max_boxes: int = 100_000,
    max_seconds: float = inf,
    progress: Progress = silent,
) -> Paving:
    """Return a lower bound of the barrier around a point, proved by a paving.

    The least ``c`` such that a component of ``{q in D : E(q) <= c}`` contains a point near
    ``start`` and a point near one of the ``ends``, or one that is not in the interior of the
    region or of the box.

    Parameters
    ----------
    problem : Problem
        ``D``, on lines and circles, and ``E``.
    box : sequence or mapping
        Sides, as :func:`~polycorner.proofs.stationary_points` takes them.  Coordinates that are
        fixed are so along all paths.
    start : (n,) or (2, n) array
        A point of ``D``, which stands for all within ``Tolerances.same`` of it in each coordinate,
        in scale units; or the lower and the upper sides of a box.
    ends : sequence of (n,) or (2, n) arrays
        Ends, likewise.
    region : parts of a polyhedron
        Inequalities ``g >= 0`` of a region: where one of them vanishes is an end.
    walled : bool
        Whether the sides of the box are walls; otherwise what reaches them is at an end.
    until : float
        A bound that is high enough.
    resolution : float
        Sides of boxes, in scale units, up to which they are not divided.
    max_boxes, max_seconds : optional
        Where the search ends at the latest.
    progress : callable, optional
        Called with the number of boxes treated, None, and the bound in words.

    Returns
    -------
    Paving
        After an interruption (Ctrl-C) with the bound so far.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind, spheres and rotations, a box without some side, and a start
        that is shown not to be in the set, the region and the box.

    Examples
    --------
    Two wells, joined over a saddle of height 1:

    >>> from polycorner import Manifold, Polyhedron
    >>> from polycorner.landscapes import paved_barrier
    >>> from polycorner.minimisation.problem import pose
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> wells = pose(Polyhedron(M, {"disc": 9 - x**2 - y**2}), (x**2 - 1) ** 2 + y**2)
    >>> found = paved_barrier(wells, [(-4, 4), (-4, 4)], [-1, 0], [[1, 0]], until=0.999)
    >>> bool(0.999 <= found.lower <= 1)
    True
    """
    checks.real("until", until, infinite=True)
    checks.real("resolution", resolution, above=0)
    checks.whole("max_boxes", max_boxes, least=1)
    checks.real("max_seconds", max_seconds, above=0, infinite=True)
    d = problem.polyhedron
    found = domain(d.manifold, box)
    with checks.about("region"):
        limited = d.intersected(region)
    exits = len(limited.functions) - len(d.functions)
    if walled and not (ends or exits):
        checks.refuse("ends", "an end, or a region or a box that can be left", "none")
    places = [_place(d, found, "start", start)]
    places += [_place(d, found, "ends", end) for end in ends]
    heights = Heights(pose(limited, problem.energy), exits)
    search = _Refinement(heights, found, places, walled, until, resolution)
    ending = work_through(search.tasks(max_boxes), search.told, progress, seconds=max_seconds)
    search.find()
    return Paving(search.bound, search.treated, ending, search.way)


def _place(d: Polyhedron, found: Domain, argument: str, given: Any) -> Array:
    """Return a box ``(2, n)``, carried around circles to where it is nearest to the domain."""
    n = len(found.lower)
    place = checks.reals(argument, given)
    if place.shape not in ((n,), (2, n)) or not np.isfinite(place).all():
        checks.refuse(argument, f"{n} finite numbers, or two sides of a box of as many", given)
    if place.ndim == 1:
        if not d.contains(place, tolerance=DEFAULT.same):
            checks.refuse(argument, "a point of the set", given)
        room = DEFAULT.same * found.manifold.scale_array
        place = np.array([place - room, place + room])
    periods = np.array(found.manifold.periods)
    circles = np.where(np.isfinite(periods), periods, 1.0)
    turns = np.round(0.5 * (found.lower + found.upper - place.sum(axis=0)) / circles)
    place = place + np.where(np.isfinite(periods), turns * circles, 0.0)
    if found.misses(place[0], place[1], range(n)):
        checks.refuse(argument, "a place in the box", given)
    return np.asarray(place)


@dataclass(frozen=True)
class _Cells:
    """Boxes, ``(B, n)``, what is known of them, and which touch, ``(L, 2)``."""

    lower: Array
    upper: Array
    weight: Array  # (2, B): lower bounds of the energy, and what they may rise to
    leaving: Array  # (2, B): the same where the box is an end
    flags: Mask  # (3, B): whether the start is there, functions may vanish, it may be divided
    links: Numbers

    def __len__(self) -> int:
        return len(self.lower)

    @property
    def middles(self) -> Array:
        return 0.5 * self.lower + 0.5 * self.upper


class _Refinement:
    """Boxes and the bottleneck of the ways through them."""

    def __init__(
        self,
        heights: Heights,
        found: Domain,
        places: Sequence[Array],
        walled: bool,
        until: float,
        resolution: float,
    ) -> None:
        self.heights, self.domain, self.places = heights, found, places
        self.until, self.resolution = until, resolution
        self.periods = np.array(found.manifold.periods)
        turn = np.where(np.isfinite(self.periods), self.periods, 0.0)
        largest = np.max([abs(found.lower), abs(found.upper), turn], axis=0)
        self.slack = DEFAULT.rounding * largest  # of sides that are carried around circles
        whole = found.upper - found.lower >= self.periods
        self.joined = np.where(whole, self.periods, inf)
        self.sides = [] if walled else [k for k in found.free if not whole[k]]
        self.units = np.where(found.units > 0, found.units, inf)
        self.treated, self.bound, self.hoped = 1, -inf, inf
        self.share = FEW
        self.way = np.zeros((0, len(whole)))
        # A circle is covered twice at its seam rather than not quite once.
        upper = found.upper + np.where(whole, self.slack, 0.0)
        self.cells = self.known(found.lower[None], upper[None])[1]

    # ------------------------------------------------------------------------------------ a search

    def tasks(self, most: int) -> Iterator[Task]:
        """Yield rounds until nothing is left to divide."""
        while True:
            before = self.bound, self.hoped
            self.find()
            if self.bound >= self.until or not len(self.way):
                return
            chosen, due = self.chosen(), self.treated + len(self.cells) // OFTEN
            if not chosen.size and (self.bound, self.hoped) == before:
                return
            # Between two searches for the bottleneck the share of new boxes is small.
            while chosen.size and self.treated <= due:
                yield self.treated + 2 * len(chosen) <= most, partial(self.divide, chosen)
                chosen = self.chosen()

    def told(self) -> Told:
        """Return how far the search has come, for progress."""
        return float(self.treated), None, f"at least {self.bound:.8g}, {len(self.cells)} boxes"

    def find(self) -> None:
        """Find the bottleneck, and a way through it."""
        c = self.cells
        if not c.flags[0].any():
            checks.refuse("start", "a point of the set in the region and the box", "one outside")
        self.bound, way = self._bottleneck(0)
        self.way = c.middles[way]
        self.hoped, _ = self._bottleneck(1)

    def _graph(self, limit: float) -> tuple[Numbers, Numbers, Array, Numbers]:
        """Return links below a limit, weights of nodes, and the boxes of nodes.

        Nodes are boxes, then boxes as ends, then the start, then where all ends lead.
        """
        c = self.cells
        count = len(c)
        low, ends = c.weight[0] < limit, np.flatnonzero(c.leaving[0] < limit)
        links = c.links[low[c.links].all(axis=1)]
        first, last = np.flatnonzero(c.flags[0] & low), count + np.arange(len(ends))
        start = count + len(ends)
        i = np.concatenate([links[:, 0], np.full(len(first), start), ends, last])
        j = np.concatenate([links[:, 1], first, last, np.full(len(ends), start + 1)])
        weights = np.hstack([c.weight, c.leaving[:, ends], np.full((2, 2), -inf)])
        return i, j, weights, np.concatenate([np.arange(count), ends])

    def _bottleneck(self, row: int) -> tuple[float, Numbers]:
        """Return the bottleneck by one of the weights, and the boxes of a way."""
        i, j, weights, boxes = self._graph(inf)
        size, weight = weights.shape[1], weights[row]
        # Ranks, since a weight 0 would be no link.
        cost = np.unique(weight, return_inverse=True)[1] + 1.0
        links = np.maximum(cost[i], cost[j])
        graph: Any = coo_array((links, (i, j)), shape=(size, size)).tocsr()
        tree = minimum_spanning_tree(graph)
        _, before = breadth_first_order(tree, size - 2, directed=False)
        way, at = [], size - 1
        while before[at] >= 0:
            at = before[at]
            way.append(at)
        nodes = np.array(way[-2::-1], dtype=np.intp)
        return float(weight[nodes].max(initial=-inf)) if nodes.size else inf, boxes[nodes[:-1]]

    def chosen(self) -> Numbers:
        """Return the boxes to be divided; none if there is no way, or one that nothing blocks."""
        c = self.cells
        if len(c) < FIRST and self.treated < 8 * FIRST:
            return np.flatnonzero(c.flags[2])
        # Where heights say no more, the set may be narrower than the boxes show.
        close = self.hoped - self.bound <= DEFAULT.level * abs(self.bound) < inf
        if close or self.share > FEW:
            above = np.sort(c.weight[0, c.weight[0] > self.hoped])
            place = int(self.share * len(above))
            limit = above[place] if place < len(above) else inf
            fewest, found = self._blocking(limit, c.flags[1] & c.flags[2])
            if fewest == inf:
                self.share = min(2 * self.share, 1.0)
            elif not found.size:
                self.share = FEW
            if close or fewest == inf or found.size:
                return found
        limit = AIM * self.hoped + (1 - AIM) * self.bound
        return self._blocking(limit if self.bound > -inf else -float_info.max, None)[1]

    def _blocking(self, limit: float, gates: Mask | None) -> tuple[float, Numbers]:
        """Return how many gates are on a way below a limit, and those on ways with few of them.

        If none are given, gates are the boxes whose weights may rise to the limit.
        """
        i, j, weights, boxes = self._graph(limit)
        size = weights.shape[1]
        blocks = weights[1] >= limit if gates is None else np.append(gates[boxes], [False] * 2)
        # What is no gate costs a little, all of it together less than a gate.
        cost = blocks + 0.5 / size
        i, j = np.concatenate([i, j]), np.concatenate([j, i])
        graph: Any = coo_array((cost[j], (i, j)), shape=(size, size)).tocsr()
        there, back = (dijkstra(graph, indices=size - k) for k in (2, 1))
        fewest = float(there[-1])
        if not 1 <= fewest < inf:
            return fewest, np.zeros(0, dtype=np.intp)
        found = np.flatnonzero(blocks)
        through = (there + back - cost)[found]
        count = max(LEAST, np.count_nonzero(through < fewest + 0.5))
        best = found[np.argsort(through, kind="stable")[: min(count, ROUND)]]
        return fewest, np.unique(boxes[best])

    # --------------------------------------------------------------------------------- subdivision

    def divide(self, at: Numbers) -> None:
        """Divide some boxes, and find what touches their halves."""
        c = self.cells
        axis = ((c.upper[at] - c.lower[at]) / self.units).argmax(axis=1)
        rows = np.arange(len(at))
        lower, upper = np.repeat(c.lower[at], 2, axis=0), np.repeat(c.upper[at], 2, axis=0)
        middle = c.middles[at, axis]
        upper[2 * rows, axis], lower[2 * rows + 1, axis] = middle, middle
        parents = np.repeat(at, 2)
        kept, new = self.known(lower, upper, c.weight[0, parents])
        stay = np.ones(len(c), dtype=np.bool_)
        stay[at] = False
        # Numbers of what is left of each box: itself, or up to two halves, at the end.
        count = stay + np.bincount(parents[kept], minlength=len(c))
        first = np.cumsum(stay) - 1
        first[at] = stay.sum() + np.searchsorted(parents[kept], at)
        lower, upper = (
            np.concatenate([old[stay], halves])
            for old, halves in ((c.lower, new.lower), (c.upper, new.upper))
        )
        # Halves of one box touch like any other two.
        links = np.concatenate([c.links, np.stack([at, at], axis=1)])
        self.cells = _Cells(
            lower,
            upper,
            np.hstack([c.weight[:, stay], new.weight]),
            np.hstack([c.leaving[:, stay], new.leaving]),
            np.hstack([c.flags[:, stay], new.flags]),
            self._linked(links, stay, first, count, lower, upper),
        )
        self.treated += 2 * len(at)

    def _linked(
        self, links: Numbers, stay: Mask, first: Numbers, count: Numbers, lower: Array, upper: Array
    ) -> Numbers:
        """Return the links of what is left of boxes."""
        same = stay[links].all(axis=1)
        changed = links[~same]
        a, b = changed.T
        pairs = count[a] * count[b]
        which = np.repeat(np.arange(len(changed)), pairs)
        number = np.arange(len(which)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
        i = first[a[which]] + number // count[b[which]]
        j = first[b[which]] + number % count[b[which]]
        once = (a[which] != b[which]) | (i < j)
        i, j = i[once], j[once]
        near = _touch((lower[i], upper[i]), (lower[j], upper[j]), self.joined, self.slack)
        return np.concatenate([first[links[same]], np.stack([i[near], j[near]], axis=1)])

    def known(self, lower: Array, upper: Array, least: Any = -inf) -> tuple[Numbers, _Cells]:
        """Return which boxes meet the set, and these, with weights of at least ``least``."""
        kept, low, high = self.heights.narrowed(lower, upper)
        weight, leaving, cut = self.heights.least(low, high, leaving=True)
        weight = np.maximum(weight, np.broadcast_to(least, len(lower))[kept])
        for k in self.sides:
            for side, reached in (
                (self.domain.lower[k], low[:, k] <= self.domain.lower[k]),
                (self.domain.upper[k], high[:, k] >= self.domain.upper[k]),
            ):
                faces = low[reached], high[reached]
                faces[0][:, k] = faces[1][:, k] = side
                beyond = self.heights.least(*faces)[0]
                leaving[:, reached] = np.minimum(leaving[:, reached], beyond)
        starts, *ends = [
            _touch((low, high), (place[0], place[1]), self.periods, self.slack)
            for place in self.places
        ]
        for reached in ends:
            leaving[:, reached] = -inf
        leaving = np.maximum(leaving, weight)
        wide = ((high - low) / self.units).max(axis=1) > self.resolution
        for rows in (weight, leaving):
            rows[1] = np.where(wide, rows[1], rows[0])
        some = weight[0] < inf
        flags = np.stack([starts, cut, wide])[:, some]
        none = np.zeros((0, 2), dtype=np.intp)
        weights = weight[:, some], leaving[:, some]
        return kept[some], _Cells(low[some], high[some], *weights, flags, none)


def _touch(
    one: tuple[Array, Array], two: tuple[Array, Array], periods: Array, slack: Array
) -> Mask:
    """Return which of the first boxes touch those of the second, around circles as well."""
    (a, b), (left, right) = one, two
    near = (a <= right) & (left <= b)
    for turn in (-periods, periods):
        near |= (a <= right + turn + slack) & (left + turn <= b + slack)
    return np.asarray(near.all(axis=-1))
