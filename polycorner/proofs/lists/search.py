"""Branch and bound for all stationary points of an energy on a polyhedron.

A box is discarded where no point of the set lies in it, or where each of its branches has a
direction along which the energy decreases (:mod:`~polycorner.proofs.lists.directions`), or lies in
a region whose only stationary point is known (:mod:`~polycorner.proofs.lists.acceptance`); all
others are bisected.
"""

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Formulas
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.acceptance import Faces, Region
from polycorner.proofs.lists.branches import Mask, conjunctions, items
from polycorner.proofs.lists.candidates import active_set, newton
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.entry_points import covered, directions
from polycorner.proofs.lists.images import Motion, dropped, weights
from polycorner.proofs.lists.loci import Locus, locus, met, read_coordinates
from polycorner.proofs.lists.tree import Tree
from polycorner.spaces.manifold import Array

LOG = logging.getLogger("polycorner.lists")
CHUNK = 4096  # boxes that are treated together
ATTEMPTS = 64  # candidates that are tried in one chunk
WIDER = 64.0  # sides of the largest region that is tried, over those of the box it is tried for
EVERY = 2  # bisections of every coordinate between two attempts at a box


@dataclass
class Boxes:
    """Boxes that wait, ``(B, n)`` each.

    With their numbers in the tree, and the bisections since a candidate was tried there.
    """

    lower: Array
    upper: Array
    nodes: NDArray[np.int64]
    since: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.lower)

    def part(self, keep: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Boxes":
        """Return some of them."""
        return Boxes(self.lower[keep], self.upper[keep], self.nodes[keep], self.since[keep])

    def with_others(self, other: "Boxes") -> "Boxes":
        """Return these and others."""
        return Boxes(
            np.concatenate([self.lower, other.lower]),
            np.concatenate([self.upper, other.upper]),
            np.concatenate([self.nodes, other.nodes]),
            np.concatenate([self.since, other.since]),
        )


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
        return (
            self.outside
            + self.descending
            + self.covered
            + self.images
            + self.split
            + self.undecided
        )


@dataclass
class Search:
    """One run: what is to be treated and what was found."""

    problem: Problem
    domain: Domain
    resolution: float
    functions: BoxFunctions = field(init=False)
    faces: Faces = field(init=False)
    conj: Mask = field(init=False)
    motions: tuple[Motion, ...] = ()
    maps: tuple[tuple[int, ...], ...] = ()
    regions: list[Region] = field(default_factory=list)
    loci: list[Locus] = field(default_factory=list)
    missed: list[Locus] = field(default_factory=list)
    tally: Tally = field(default_factory=Tally)
    tree: Tree = field(default_factory=Tree)
    undecided: list[Boxes] = field(default_factory=list)

    def __post_init__(self) -> None:
        manifold = self.problem.polyhedron.manifold
        self.functions = BoxFunctions(self.problem.functions, manifold)
        formulas = Formulas(self.problem.functions, manifold)
        free = self.domain.free
        self.faces = Faces(formulas, self.problem.inequalities, free, self.problem.scales)
        self.conj = conjunctions(self.problem.polyhedron)
        self.reads = read_coordinates(formulas, free)
        self.weights = weights(self.domain)
        self._equations = len(self.problem.polyhedron.equations)
        lower, upper = self.domain.lower[None].copy(), self.domain.upper[None].copy()
        start = np.zeros(1, dtype=np.int64)
        self._treated: Boxes | None = None
        self._sides: tuple[Array, Array, Mask] | None = None  # of the regions, and active functions
        self.waiting = Boxes(lower, upper, start, start)

    def run(self, most: int, seconds: float, report: Callable[["Search"], None]) -> None:
        """Treat boxes until none waits, ``most`` were treated, or the time is used up."""
        end = time.monotonic() + seconds
        while len(self.waiting) and self.tally.boxes < most and time.monotonic() < end:
            last = self.waiting.part(slice(-CHUNK, None))
            self.waiting = self.waiting.part(slice(None, -CHUNK))
            self._treated = last
            self.waiting = self.waiting.with_others(self.step(last))
            self._treated = None
            report(self)

    def recover(self) -> None:
        """Put boxes back whose treatment was interrupted."""
        if self._treated is not None:
            self.waiting = self.waiting.with_others(self._treated)
            self._treated = None

    def _without_images(self, boxes: Boxes) -> Boxes:
        """Return the boxes that no symmetry carries to others."""
        if not self.motions:
            return boxes
        gone = dropped(boxes.lower, boxes.upper, self.motions, self.weights, self.domain)
        self.tally.images += int(gone.sum())
        nothing = np.zeros((0, boxes.lower.shape[1]))
        self.tree.close(boxes.nodes[gone], boxes.nodes[:0], nothing)
        return boxes.part(~gone)

    def step(self, boxes: Boxes) -> Boxes:
        """Treat some boxes; return the halves of those that are left."""
        boxes = self._without_images(boxes)
        m, rows = self.problem.inequalities, self.problem.rows
        v_lo, v_hi, g_lo, g_hi = self.functions.gradients(boxes.lower, boxes.upper)
        meets: Mask = np.all((v_lo[:, m : rows - 1] <= 0) & (v_hi[:, m : rows - 1] >= 0), axis=1)
        where, masks = items(self.conj, v_hi[:, :m] < 0, v_lo[:, :m] > 0)
        where, masks = where[meets[where]], masks[meets[where]]
        found, v, weights = directions(
            g_lo, g_hi, where, masks, rows - 1 - m, self.domain.units, -1.0
        )
        continuous = self.functions.continuous(boxes.lower, boxes.upper)[where]
        smooth: Mask = np.all(continuous[:, :m] | ~masks, axis=1)
        smooth &= np.all(continuous[:, m:], axis=1)
        found &= smooth
        done = found | self._covered(boxes, where, masks)
        self._on_loci(boxes, where, masks, (g_lo, g_hi), (done, found, smooth, v))
        since = boxes.since.copy()
        if not done.all():
            rest = np.flatnonzero(~done)
            self._attempt(boxes, where[rest], weights[rest], g_lo, g_hi, since)
            done |= self._covered(boxes, where, masks)
            self._on_loci(boxes, where, masks, (g_lo, g_hi), (done, found, smooth, v))
        count = len(boxes)
        seen, left, known = (np.zeros(count, dtype=np.bool_) for _ in range(3))
        seen[where], left[where[~done]], known[where[done & ~found]] = True, True, True
        self.tally.outside += int((~seen).sum())
        self.tally.covered += int((known & ~left).sum())
        self.tally.descending += int((seen & ~known & ~left).sum())
        used = found & ~left[where]
        self.tree.close(boxes.nodes[~left], boxes.nodes[where[used]], v[used])
        return self._halves(Boxes(boxes.lower, boxes.upper, boxes.nodes, since).part(left))

    def _covered(self, boxes: Boxes, where: NDArray[np.intp], masks: Mask) -> Mask:
        """Whether items lie in regions whose only stationary point is known."""
        count, m = len(self.regions), masks.shape[1]
        if self._sides is None or len(self._sides[0]) < count:
            active = np.zeros((count, m), dtype=np.bool_)
            for k, region in enumerate(self.regions):
                active[k, list(region.active)] = True
            lower, upper = ([getattr(r, end) for r in self.regions] for end in ("lower", "upper"))
            n = boxes.lower.shape[1]
            self._sides = np.reshape(lower, (count, n)), np.reshape(upper, (count, n)), active
        found: Mask = covered(boxes.lower, boxes.upper, where, masks, *self._sides)
        return found

    def _on_loci(
        self,
        boxes: Boxes,
        where: NDArray[np.intp],
        masks: Mask,
        gradients: tuple[Array, Array],
        state: tuple[Mask, Mask, Mask, Array],
    ) -> None:
        """Close items near loci that have a direction into the set along the other coordinates."""
        done, found, smooth, v = state
        z = list(self.reads)
        units = self.domain.units.copy()
        units[z] = 0.0
        for place in self.loci:
            near: Mask = np.all(boxes.lower[:, z] > place.lower, axis=1)
            near &= np.all(boxes.upper[:, z] < place.upper, axis=1)
            rest = np.flatnonzero(near[where] & ~done & smooth)
            if rest.size:
                into, u, _ = directions(
                    *gradients, where[rest], masks[rest], self._equations, units, 0.0
                )
                done[rest[into]] = True
                some = rest[into & masks[rest].any(axis=1)]
                found[some], v[some] = True, u[into & masks[rest].any(axis=1)]

    def _attempt(
        self,
        boxes: Boxes,
        where: NDArray[np.intp],
        weights: Array,
        g_lo: Array,
        g_hi: Array,
        since: NDArray[np.int64],
    ) -> None:
        """Try to find stationary points near boxes where none was tried for some bisections."""
        n = len(self.domain.free)
        ripe = np.flatnonzero(since[where] >= EVERY * n)
        ripe = ripe[np.argsort(-since[where[ripe]], kind="stable")]
        tried = 0
        for item in ripe:
            if tried >= ATTEMPTS:
                break
            box = where[item]
            if since[box] == 0:
                continue
            since[box] = 0
            tried += 1
            with np.errstate(all="ignore"):
                steep = 0.5 * (g_lo[box] + g_hi[box]) * self.problem.scales
                pulls = np.linalg.norm(steep, axis=1)
            m = self.problem.inequalities
            active = active_set(weights[item], np.r_[pulls[:m], pulls[-1]])
            widths = boxes.upper[box] - boxes.lower[box]
            size = max((widths / self.problem.scales)[list(self.domain.free)])
            self._try(0.5 * (boxes.lower[box] + boxes.upper[box]), active, WIDER * size)

    def _try(self, q: Array, active: list[int], widest: float) -> None:
        if not active and self.reads != self.domain.free:
            place = locus(self.problem, self.faces.formulas, self.reads, q)
            if place is not None and not self._known_locus(place):
                shown = met(place, self.functions, self.conj, self.domain)
                (self.missed if shown is None else self.loci).append(shown or place)
        found = newton(self.problem, q, active, self.domain.free)
        if found is None:
            return
        point, multipliers = found
        k = len(active)
        if (multipliers[:k] <= 0).any() or self._known(point, active):
            return
        slack = self.domain.units
        if ((point < self.domain.lower - slack) | (point > self.domain.upper + slack)).any():
            return
        region = self.faces.region(point, active, widest)
        if region is not None:
            self.regions.append(region)

    def _known_locus(self, place: Locus) -> bool:
        return any(
            (place.sharp_lower >= other.lower).all() and (place.sharp_upper <= other.upper).all()
            for other in (*self.loci, *self.missed)
        )

    def _known(self, q: Array, active: list[int]) -> bool:
        return any(
            set(r.active) == set(active) and (q >= r.lower).all() and (q <= r.upper).all()
            for r in self.regions
        )

    def _halves(self, boxes: Boxes) -> Boxes:
        widths = boxes.upper - boxes.lower
        units = np.where(self.domain.units > 0, self.domain.units, np.inf)
        relative = widths / units
        small = relative.max(axis=1, initial=0.0) <= self.resolution
        if small.any():
            self.undecided.append(boxes.part(small))
            self.tally.undecided += int(small.sum())
            boxes, relative = boxes.part(~small), relative[~small]
        self.tally.split += len(boxes)
        axis = relative.argmax(axis=1)
        each = np.arange(len(boxes))
        middle = 0.5 * (boxes.lower[each, axis] + boxes.upper[each, axis])
        first, second = boxes.upper.copy(), boxes.lower.copy()
        first[each, axis] = middle
        second[each, axis] = middle
        nodes, since = self.tree.split(boxes.nodes, axis, middle), boxes.since + 1
        return Boxes(boxes.lower, first, nodes, since).with_others(
            Boxes(second, boxes.upper, nodes + 1, since)
        )
