"""Branch and bound for all corners of a polyhedron.

A box is discarded where no point of the set lies in it, and where
:mod:`~polycorner.proofs.lists.levels` shows that the corners in it are known; all others are
bisected.  Corners become known by Newton's method where the gradients of enough functions are
independent on a box, and by the search for a singular one in small boxes where they are not.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polycorner.proofs.lists.acceptance import Region
from polycorner.proofs.lists.branches import Mask, items
from polycorner.proofs.lists.dependence import Enclosures, Places, Truths
from polycorner.proofs.lists.levels import Levels, Rows, levels
from polycorner.proofs.lists.search import Boxes, Search
from polycorner.proofs.lists.tips import Tip, tips
from polycorner.proofs.lists.vertices import Vertices
from polycorner.spaces.manifold import Array

ATTEMPTS, RARE = 64, 8  # candidates that are tried in one batch, regular and singular ones
WIDER = 64.0  # sides of the largest region that is tried, over those of the box it is tried for
SMALL = 0.05  # side in scale units of boxes in which singular corners are sought
NEWTON = 12
STRAY = 4.0  # sides of a box that a vertex may be away from its middle


@dataclass
class CornerSearch(Search):
    """One run: what is to be treated, and the regions in which one corner may be."""

    regions: list[Region] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.vertices = Vertices(
            self.faces.formulas,
            self.problem.inequalities,
            len(self.problem.polyhedron.equations),
            self.domain.free,
            self.problem.scales,
        )

    def step(self, boxes: Boxes) -> Boxes:
        """Treat some boxes; return the halves of those that are left."""
        boxes = self._without_images(boxes)
        m, k = self.problem.inequalities, self.vertices.equations
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
        known = _Known(self.regions, part, self.domain.lower < self.domain.upper)
        result = levels(found, masks[at], k, known.zero, known.critical)
        left = np.zeros(len(boxes), dtype=np.bool_)
        left[at[result.left]] = True
        since = boxes.since.copy()
        since[at] = self._seek(part, masks[at], found, result)
        self.tally.outside += int((~inside).sum())
        self.tally.covered += int((inside & ~left).sum())
        nothing = np.zeros((0, boxes.lower.shape[1]))
        self.tree.close(boxes.nodes[~left], boxes.nodes[:0], nothing)
        return self._halves(Boxes(boxes.lower, boxes.upper, boxes.nodes, since).part(left))

    def _seek(
        self, boxes: Boxes, masks: Mask, found: Enclosures, result: Levels
    ) -> NDArray[np.int64]:
        """Try to find corners in boxes that are left; return the bisections since an attempt."""
        m, k = self.problem.inequalities, self.vertices.equations
        since = boxes.since.copy()
        widths = (boxes.upper - boxes.lower) / self.problem.scales
        sizes = widths[:, list(self.domain.free)].max(axis=1, initial=0.0)
        middles = 0.5 * (boxes.lower + boxes.upper)
        rest, tried = result.left.copy(), 0
        for rows, at in result.largest:
            regular = found.independent(at, (*rows, *range(m, m + k)))
            for box in at[regular]:
                rest[box] = False
                if tried < ATTEMPTS:
                    tried += self._vertex(middles[box], rows, sizes[box])
        every = len(self.domain.free)
        for box in np.flatnonzero(rest & (sizes < SMALL) & (since >= every))[:RARE]:
            since[box] = 0
            open_ = np.flatnonzero(masks[box]).tolist()
            for tip in tips(self.vertices, middles[box], open_, 2 * sizes[box]):
                if not self._known(0.5 * (tip.lower + tip.upper), list(tip.active)):
                    self.regions.append(tip)
        return since

    def _vertex(self, q: Array, rows: Rows, size: float) -> bool:
        """Seek the common zero of functions near a point; return whether a region was tried."""
        point = self._newton(q, rows, STRAY * size)
        if point is None or self._known(point, list(rows)):
            return False
        region = self.vertices.region(point, rows, WIDER * size)
        if region is not None:
            self.regions.append(region)
        return True

    def _newton(self, q: Array, rows: Rows, reach: float) -> Array | None:
        """Return a common zero within some scale units of a point, or None."""
        free, at = list(self.domain.free), list(self.vertices.rows(rows))
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


class _Known:
    """Regions around boxes, with questions about sets of functions."""

    def __init__(self, regions: list[Region], boxes: Boxes, free: Truths) -> None:
        self.zeros: dict[Rows, Truths] = {}
        self.criticals: dict[Rows, Truths] = {}
        for region in regions:
            within: Truths = (region.lower < boxes.lower) & (boxes.upper < region.upper)
            inside: Truths = np.all(within | ~free, axis=1)
            if inside.any():
                self._add(self.zeros, tuple(sorted(region.active)), inside)
                for i in region.critical if isinstance(region, Tip) else ():
                    self._add(self.criticals, (i,), inside)

    @staticmethod
    def _add(known: dict[Rows, Truths], rows: Rows, inside: Truths) -> None:
        inside = inside.copy()
        inside |= known.get(rows, inside)
        known[rows] = inside

    def zero(self, rows: Rows, at: Places) -> Truths:
        """Whether the common zero of functions, and the equations, is known in some boxes."""
        return self._found(self.zeros, rows, at)

    def critical(self, rows: Rows, at: Places) -> Truths:
        """Whether the point where the gradient of a function vanishes is known in some boxes."""
        return self._found(self.criticals, rows, at)

    @staticmethod
    def _found(known: dict[Rows, Truths], rows: Rows, at: Places) -> Truths:
        found = known.get(rows)
        return np.zeros(len(at), dtype=np.bool_) if found is None else found[at]
