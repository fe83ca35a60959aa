"""Branch and bound over boxes, and the search for all stationary points of an energy.

A box is discarded where no point of the set lies in it, or where each of its branches has a
direction along which the energy decreases (:mod:`~polycorner.proofs.lists.directions`), or lies in
a region whose only stationary point is known (:mod:`~polycorner.proofs.lists.faces`), with
redundant functions perhaps (:mod:`~polycorner.proofs.lists.redundancy`,
:mod:`~polycorner.proofs.lists.pinned`); all others are bisected, once what lies outside of the set
is cut off (:mod:`~polycorner.proofs.lists.contraction`).

The search goes in rounds.  In each, some boxes that wait are examined, in chunks that read the same
state and change nothing, by as many threads as there are; then candidates are tried near what is
left, and the results are put together in the order of the boxes.  What a round does depends on the
state before it alone, so that neither the number of threads nor an interruption between two rounds
changes the result.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import astuple, dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.kernels import MANY
from polycorner.proofs.lists.attempts import Attempts, Mapped, Starts
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.examination import Examined, examine, reconsider
from polycorner.proofs.lists.faces import Region
from polycorner.proofs.lists.known import Setting
from polycorner.proofs.lists.loci import LocusRegion
from polycorner.proofs.lists.redundancy import close_redundant, pin
from polycorner.proofs.lists.tree import Boxes, Tree, bisected
from polycorner.spaces.manifold import Array

CHUNKS = 8  # that a round consists of
CHUNK = 4096  # boxes in a chunk, at most
LEAST = 256  # boxes in a chunk, if there are as many
SHARP = 20_000  # boxes after which second derivatives are used, if not before for small boxes
LEAST_CUT = 0.1  # of a side, that is cut off before a box is bisected
NUMBERS = 1 << 20  # bounds of derivatives in a chunk, at most


@dataclass
class Tally:
    """How boxes ended."""

    outside: int = 0
    descending: int = 0
    covered: int = 0
    images: int = 0
    split: int = 0
    undecided: int = 0

    @property
    def boxes(self) -> int:
        """All boxes that were treated."""
        return sum(astuple(self))


@dataclass
class Treated:
    """Boxes that were treated, and how they ended.

    Attributes
    ----------
    images : (I,) array of int
        Numbers in the tree of boxes that a symmetry carries to others; they are left out below.
    boxes : Boxes
    outside, left : (B,) arrays of bool
        Whether they miss the set, and whether they are not closed.
    inner : (2, B, n) array
        Narrower sides of the boxes, beyond which no point of the set lies.
    descending : int
        How many are closed by directions.
    owners, vectors : (V,) array of int, (V, n) array
        Directions, and the boxes that they close.
    """

    images: NDArray[np.int64]
    boxes: Boxes
    outside: Mask
    left: Mask
    inner: Array
    descending: int = 0
    owners: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    vectors: Array | None = None


@dataclass
class BoxSearch(Setting, ABC):
    """One run: what is to be treated and what was found.

    What is searched for decides how boxes are closed: :meth:`treat`.
    """

    attempts: Attempts = field(init=False)
    waiting: Boxes = field(init=False)
    tally: Tally = field(default_factory=Tally)
    tree: Tree = field(default_factory=Tree)
    undecided: list[Boxes] = field(default_factory=list)
    sharp: bool = True  # whether all tests are used, so that small boxes are left undecided

    def __post_init__(self) -> None:
        super().__post_init__()
        self.attempts = Attempts(self)
        lower, upper = self.domain.lower[None].copy(), self.domain.upper[None].copy()
        start = np.zeros(1, dtype=np.int64)
        self.waiting = Boxes(lower, upper, start, start)

    @property
    def regions(self) -> list[Region]:
        """Regions with one point each that is sought, on a face."""
        return self.known.regions

    @property
    def loci(self) -> list[LocusRegion]:
        """Loci that were found."""
        return self.known.loci

    @abstractmethod
    def treat(self, chunks: list[Boxes], mapped: Mapped) -> list[Treated]:
        """Close what can be closed in some boxes, and find what is in them."""

    @abstractmethod
    def prepare(self, boxes: Boxes) -> None:
        """Compile or load what threads would each compile by themselves."""

    def run(
        self,
        most: int,
        seconds: float,
        report: Callable[[], None],
        *,
        workers: int = 1,
        stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        """Treat boxes until none waits, ``most`` were treated, or time is up; or until stopped."""
        # Time is looked at between rounds alone, so that it never changes what a round does.
        end = time.monotonic() + seconds
        with pool(workers) as executor:
            mapped: Mapped = map
            if executor:
                self.prepare(self.waiting.part(slice(0, 1)))
                mapped = executor.map
            while len(self.waiting) and self.tally.boxes < most and time.monotonic() < end:
                if stopped():
                    break
                self.round(mapped)
                report()

    def round(self, mapped: Mapped = map) -> None:
        """Treat the last boxes that wait; ``mapped`` is like ``map``."""
        chunks = self._chunks()
        found = self.treat(chunks, mapped)
        taken = sum(map(len, chunks))
        before = self.waiting.part(slice(None, len(self.waiting) - taken))
        self.waiting = Boxes.joined([before, *map(self._finish, found)])

    def _chunks(self) -> list[Boxes]:
        """Return the last boxes that wait, in chunks of a size that the problem determines."""
        numbers = self.problem.rows * self.problem.dimension
        # By the problem and not by the number of threads: results must not depend on these.
        largest = max(LEAST, min(CHUNK, NUMBERS // numbers))
        count = min(len(self.waiting), CHUNKS * largest)
        size = min(largest, max(LEAST, -(-count // CHUNKS)))
        # The last boxes first, as in a search by depth: few boxes wait then, and what is found in
        # one of them closes its neighbours.
        last = self.waiting.part(slice(len(self.waiting) - count, None))
        return [last.part(slice(i, i + size)) for i in range(0, count, size)]

    def _finish(self, t: Treated) -> Boxes:
        """Record how boxes are closed; return the halves of those that are left."""
        closed = int((~t.outside & ~t.left).sum())
        self.tally.images += len(t.images)
        self.tally.outside += int(t.outside.sum())
        self.tally.covered += closed - t.descending
        self.tally.descending += t.descending
        nothing = np.zeros((0, t.boxes.lower.shape[1]))
        # Images of other boxes are closed without a reason of their own: the symmetry is one.
        self.tree.close(t.images, t.images[:0], nothing)
        vectors = nothing if t.vectors is None else t.vectors
        self.tree.close(t.boxes.nodes[~t.left], t.boxes.nodes[t.owners], vectors)
        rest, inner = t.boxes.part(t.left), t.inner[:, t.left]
        # Small boxes wait for the sharper tests, if these were not used.
        again = self._small(rest) & (not self.sharp)
        return Boxes.joined([self._halves(rest.part(~again), inner[:, ~again]), rest.part(again)])

    def _relative(self, boxes: Boxes) -> Array:
        """Return the sides of boxes in the units of the domain."""
        units = np.where(self.domain.units > 0, self.domain.units, np.inf)
        return (boxes.upper - boxes.lower) / units

    def _small(self, boxes: Boxes) -> NDArray[np.bool_]:
        """Return which boxes are not divided any more."""
        small: NDArray[np.bool_] = self._relative(boxes).max(axis=1, initial=0.0) <= self.resolution
        return small

    def _halves(self, boxes: Boxes, inner: Array) -> Boxes:
        """Return the halves of boxes, without what lies beyond narrower sides ``(2, B, n)``."""
        small = self._small(boxes)
        if small.any():
            self.undecided.append(boxes.part(small))
            self.tally.undecided += int(small.sum())
            boxes, inner = boxes.part(~small), inner[:, ~small]
        boxes = self._cut(boxes, inner)
        self.tally.split += len(boxes)
        # Sides in scale units: a coordinate that is measured in small units is not preferred.
        axis = self._relative(boxes).argmax(axis=1)
        middle = boxes.middles[np.arange(len(boxes)), axis]
        nodes, since = self.tree.split(boxes.nodes, axis, middle), boxes.since + 1
        halves = bisected(boxes.lower, boxes.upper, axis)
        return Boxes(*halves, np.concatenate([nodes, nodes + 1]), np.tile(since, 2))

    def _cut(self, boxes: Boxes, inner: Array) -> Boxes:
        """Cut off and close what lies beyond narrower sides, where that is worth a cut.

        Parameters are cut as well: what is left then are some of their values.
        """
        lower, upper, nodes = boxes.lower.copy(), boxes.upper.copy(), boxes.nodes.copy()
        nothing = nodes[:0], np.zeros((0, lower.shape[1]))
        for axis in np.flatnonzero(self.domain.lower < self.domain.upper).tolist():
            for side, (ends, others) in enumerate(((lower, upper), (upper, lower))):
                place = inner[side][:, axis]
                share = (place - ends[:, axis]) / (others[:, axis] - ends[:, axis])
                # A cut is a split whose outer part is closed at once: the checker sees splits only.
                at = np.flatnonzero((share > LEAST_CUT) & (share < 1))
                first = self.tree.split(nodes[at], np.full(len(at), axis), place[at])
                self.tree.close(first + side, *nothing)
                ends[at, axis], nodes[at] = place[at], first + 1 - side
                self.tally.split += len(at)
                self.tally.outside += len(at)
        return Boxes(lower, upper, nodes, boxes.since)


class StationarySearch(BoxSearch):
    """A search for stationary points."""

    def prepare(self, boxes: Boxes) -> None:
        """Compile or load what threads would each compile by themselves."""
        examine(self, False, boxes)
        for count in (1, MANY):
            self.problem.evaluate(np.repeat(boxes.middles, count, axis=0), 2)

    def treat(self, chunks: list[Boxes], mapped: Mapped) -> list[Treated]:
        """Examine boxes, then try candidates near what is left."""
        late = self.tally.boxes >= SHARP or self.tally.undecided > 0
        # Second derivatives are dear: most boxes of easy problems are closed without them.
        self.sharp = late or any(self._small(boxes).any() for boxes in chunks)
        self.attempts.sharp = self.sharp
        found = list(mapped(partial(examine, self, self.sharp), chunks))
        # Boxes of this round may lie in regions that it finds itself: they are looked at again, at
        # those regions only.
        regions, loci = len(self.regions), len(self.loci)
        self.attempts.at(found, mapped)
        if len(self.regions) > regions or len(self.loci) > loci:
            for e in found:
                reconsider(self, e, regions, loci)
        # After all regions of the round are known, since a region of a face closes the item at
        # once.
        starts = [start for e in found for start in close_redundant(self, e)]
        if starts:
            self.attempts.run(Starts.joined(starts), mapped)
        for e in found:
            pin(self, e, self.attempts)
        return list(map(_treated, found))


def _treated(e: Examined) -> Treated:
    """Return how boxes ended, from their items."""
    where, count = e.where, len(e.boxes)
    seen, left, by_region = (np.zeros(count, dtype=np.bool_) for _ in range(3))
    seen[where], left[where[~e.done]], by_region[where[e.done & ~e.directed]] = True, True, True
    used = e.directed & ~left[where]
    # Of an item that is not closed, or shares its box with such a one, no directions are stored.
    further = [(box, v) for box, v in e.further if not left[box]]
    owners = np.concatenate([where[used], *(np.full(len(v), box) for box, v in further)])
    vectors = np.concatenate([e.v[used], *(v for _, v in further)])
    descending = int((seen & ~by_region & ~left).sum())
    return Treated(e.images, e.boxes, ~seen, left, e.inner, descending, owners, vectors)


@contextmanager
def pool(workers: int) -> Iterator[Executor | None]:
    """Yield threads, which work at a time on compiled code and large arrays; None for one."""
    if workers == 1:
        yield None
        return
    with ThreadPoolExecutor(workers) as executor:
        yield executor
