"""Branch and bound for all corners of a polyhedron.

A box is discarded where no point of the set lies in it, and where
:mod:`~polycorner.proofs.lists.levels` shows that the corners in it are known; all others are
bisected.  Corners become known by Newton's method where the gradients of enough functions are
independent on a box, and by the search for a singular one in small boxes where they are not.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations, islice

import numpy as np

from polycorner.proofs.lists.attempts import Mapped
from polycorner.proofs.lists.branches import Mask, items
from polycorner.proofs.lists.contraction import narrowed
from polycorner.proofs.lists.examination import without_images
from polycorner.proofs.lists.faces import Region
from polycorner.proofs.lists.levels import Enclosures, Levels, Places, Rows, Truths, levels
from polycorner.proofs.lists.redundancy import STRAY
from polycorner.proofs.lists.relations import Relation, relation
from polycorner.proofs.lists.search import BoxSearch, Treated
from polycorner.proofs.lists.tips import TipRegion, tips
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH

ATTEMPTS, RARE = 64, 8  # candidates that are tried in a chunk, regular and singular ones
NEWTON = 12
MOST_SETS = 200  # of one size that relations are sought in


@dataclass
class Chunk(Treated):
    """Boxes, and the sets of functions that may vanish in those that are left.

    Attributes
    ----------
    regular : list of (tuple of int, array of int)
        Sets of functions that may have a common zero in some boxes, where they are independent.
    singular : list of (int, list of int)
        Boxes in which no such set is, and the functions that may vanish there.
    """

    regular: list[tuple[Rows, Places]] = field(default_factory=list)
    singular: list[tuple[int, list[int]]] = field(default_factory=list)


@dataclass
class CornerSearch(BoxSearch):
    """One run: what is to be treated, and the regions in which one corner may be.

    Attributes
    ----------
    relations : mapping from tuple of int to Relation or None
        Linear relations between functions, by the sets in which they were sought.
    """

    relations: dict[Rows, Relation | None] = field(default_factory=dict)

    def prepare(self, boxes: Boxes) -> None:
        """Compile or load what threads would each compile by themselves."""
        self._examined(boxes)

    def treat(self, chunks: list[Boxes], mapped: Mapped) -> list[Treated]:
        """Look at the functions that may vanish in boxes, then try to find corners."""
        found: list[Chunk] = list(mapped(self._examined, chunks))
        for chunk in found:
            self._attempt(chunk)
        return list(found)

    def _examined(self, boxes: Boxes) -> Chunk:
        """Return what is shown of some boxes; nothing is changed."""
        images, boxes = without_images(self, boxes)
        m, k = self.problem.inequalities, self.equations
        v_lo, v_hi, *gradients = self.functions.gradients(boxes.lower, boxes.upper, mean_value=True)
        meets: Mask = np.all((v_lo[:, m : m + k] <= 0) & (v_hi[:, m : m + k] >= 0), axis=1)
        where, branches = items(self.conj, v_hi[:, :m] < 0, v_lo[:, :m] > 0)
        inside = np.zeros(len(boxes), dtype=np.bool_)
        inside[where] = True
        inside &= meets
        masks = np.zeros((len(boxes), m), dtype=np.bool_)
        np.logical_or.at(masks, where, branches)
        at = np.flatnonzero(inside)
        part = boxes.part(at)
        sides = gradients[0][at], gradients[1][at]
        found = Enclosures.of(self.functions, part.lower, part.upper, sides, self.domain.free)
        zero, critical = _around(self.regions, part, self.domain.lower < self.domain.upper)
        related = [frozenset(r.rows) for r in self.relations.values() if r]
        result = levels(found, masks[at], k, zero, critical, related)
        left = np.zeros(len(boxes), dtype=np.bool_)
        left[at[result.left]] = True
        regular = self._regular(found, result)
        rest = result.left.copy()
        # Boxes with a regular candidate are left to Newton; where none is, the gradients of all
        # sets may be dependent, and a singular corner is looked for once the boxes are small.
        for _, places in regular:
            rest[places] = False
        singular = [
            (int(at[i]), np.flatnonzero(masks[at[i]]).tolist()) for i in np.flatnonzero(rest)
        ]
        located = [(rows, at[places]) for rows, places in regular]
        inner = np.stack([boxes.lower, boxes.upper])
        part, kept = boxes.part(left), np.flatnonzero(left)
        inner[:, left] = narrowed(
            part, [side[kept] for side in (v_lo, v_hi, *gradients)],
            self.functions.continuous(part.lower, part.upper), self.conj, k,
        )  # fmt: skip
        return Chunk(images, boxes, ~inside, left, inner, regular=located, singular=singular)

    def _regular(self, found: Enclosures, result: Levels) -> list[tuple[Rows, Places]]:
        """Return the largest sets and the boxes in which their gradients are independent."""
        chosen = []
        for rows, at in result.largest:
            independent = found.independent(at, self.faces.rows(rows))
            if independent.any():
                chosen.append((rows, at[independent]))
        return chosen

    def _attempt(self, chunk: Chunk) -> None:
        """Try to find corners in boxes that are left."""
        boxes = chunk.boxes
        widths = (boxes.upper - boxes.lower) / self.problem.scales
        sizes = widths[:, list(self.domain.free)].max(axis=1, initial=0.0)
        tried = 0
        for rows, at in chunk.regular:
            for box in at:
                if tried < ATTEMPTS:
                    tried += self._vertex(boxes.middles[box], rows, sizes[box])
        # Not again before each coordinate was bisected once.
        every = len(self.domain.free)
        ripe = [(box, rows) for box, rows in chunk.singular if boxes.since[box] >= every]
        for _, open_ in ripe[:RARE]:
            self._relate(open_)
        small = [(box, rows) for box, rows in ripe if sizes[box] < SEARCH.small_box]
        for box, open_ in small[:RARE]:
            boxes.since[box] = 0
            for tip in tips(self.faces, boxes.middles[box], open_, 2 * sizes[box]):
                if not self.known.has(0.5 * (tip.lower + tip.upper), frozenset(tip.active)):
                    self.known.add(tip)

    def _relate(self, open_: list[int]) -> None:
        """Seek linear relations between functions, in small sets first."""
        top = len(self.domain.free) - self.equations
        for size in range(1, top + 1):
            for rows in islice(combinations(open_, size), MOST_SETS):
                parts = (self.relations.get(part) for part in combinations(rows, size - 1))
                if rows not in self.relations and not any(parts):
                    self.relations[rows] = relation(self.problem, rows)

    def _vertex(self, q: Array, rows: Rows, size: float) -> bool:
        """Seek the common zero of functions near a point; return whether a region was tried."""
        point = self._newton(q, rows, STRAY * size)
        if point is None or self.known.has(point, frozenset(rows)):
            return False
        region = self.faces.vertex(point, rows, SEARCH.surroundings * size)
        if region is not None:
            self.known.add(region)
        return True

    def _newton(self, q: Array, rows: Rows, reach: float) -> Array | None:
        """Return a common zero within some scale units of a point, or None."""
        free, at = list(self.domain.free), list(self.faces.rows(rows))
        start, scales = q, self.problem.scales[free]
        q = q.copy()
        for _ in range(NEWTON):
            values, gradients = self.problem.evaluate(q, 1)
            try:
                step = np.linalg.solve(gradients[at][:, free], -values[at])
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(step).all():
                return None
            q[free] += step * scales
            if (abs(q - start)[free] > reach * scales).any():
                return None
        return q


def _around(
    regions: list[Region], boxes: Boxes, free: Truths
) -> tuple[Callable[[Rows, Places], Truths], Callable[[Rows, Places], Truths]]:
    """Return two questions about sets of functions in some boxes, answered by regions around them.

    Whether their common zero, with the equations, is known; and whether the point where the
    gradient of a single function vanishes is.
    """
    zeros, criticals = dict[Rows, Truths](), dict[Rows, Truths]()
    for region in regions:
        within: Truths = (region.lower < boxes.lower) & (boxes.upper < region.upper)
        inside: Truths = np.all(within | ~free, axis=1)
        at = [(zeros, tuple(sorted(region.active)))]
        if isinstance(region, TipRegion):
            at += [(criticals, (i,)) for i in region.critical]
        for known, rows in at:
            known[rows] = known.get(rows, np.zeros_like(inside)) | inside

    def asked(known: dict[Rows, Truths]) -> Callable[[Rows, Places], Truths]:
        nothing = np.zeros(len(boxes), dtype=np.bool_)
        return lambda rows, at: known.get(rows, nothing)[at]

    return asked(zeros), asked(criticals)
