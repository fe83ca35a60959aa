"""Branch and bound for all corners of a polyhedron.

A box is discarded where no point of the set lies in it, and where no point of it is a corner but
the known ones, by the sets of functions that may vanish there; all others are bisected.  Corners
become known by Newton's method where the gradients of enough functions are independent on a box,
and by the search for a singular one in small boxes where they are not.

Whether functions can vanish together, and whether their gradients are independent, is shown for
many boxes at a time, in double precision with bounds of all rounding errors: a sum of ``n``
products is off by at most ``(n + 2) 2^-52`` times the sum of their magnitudes, underflow excluded,
which a summand of ``2^-1000`` covers ([Higham] sec. 3.1).

Let ``[G]`` enclose the gradients of ``r`` functions on a box ``X`` with the middle ``c``, and
``Y`` be near a right inverse of its middle.

- If ``|I - [G] Y| < 1`` in a maximum norm, every matrix in ``[G]`` has rank ``r``.  Where ``[G]``
  contains Clarke's generalised gradients and ``r < N``, the functions' common zeros in ``X`` are
  then a Lipschitz manifold of dimension ``N - r``, in which no point is isolated; where ``r = N``
  there is at most one ([Clarke] sec. 7.1, [Neumaier] sec. 5.1).
- If ``0`` is not in ``sum_i l_i (f_i(c) + [G_i] (X - c))`` for some numbers ``l_i``, the
  functions do not vanish together in ``X``, by the mean value theorem.  Combinations that nearly
  cancel all but one direction, and those with which a gradient is nearly orthogonal to the others,
  are tried.

Let ``U`` be the inequalities that may vanish in a box ``X`` and matter for the set there, ``h`` the
``k`` equations and ``N`` the number of coordinates.  A corner ``q`` in ``X`` is isolated among the
common zeros of ``h`` and a subset ``A(q)`` of ``U``.  Suppose that each set ``T`` in ``U`` with at
most ``N - k`` elements

1. has no common zero with ``h`` in ``X``; or
2. has only one, which is known; or
3. has fewer than ``N - k`` elements, and the gradients of ``T`` and ``h`` are independent on ``X``,
   except at a known point; or
4. contains a set with one of the first two properties; or
5. contains a function that is a linear combination of others of ``T`` and of ``h``.

Then all corners in ``X`` are known.  ``A(q)`` contains no set as in 1, since it vanishes at ``q``,
and if it contains one as in 2, ``q`` is the known point.  Otherwise leave out functions that are
combinations of others until there is none: the common zeros are the same.  All subsets of what is
left, of at most ``N - k`` elements, are as in 3, so that it has fewer than ``N - k`` elements, and
its common zeros are a manifold of positive dimension near ``q``, unless ``q`` is the known point.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.proofs.lists.attempts import Mapped
from polycorner.proofs.lists.branches import Mask, items
from polycorner.proofs.lists.contraction import narrowed
from polycorner.proofs.lists.entries import TINY, UNIT
from polycorner.proofs.lists.examination import without_images
from polycorner.proofs.lists.faces import Region
from polycorner.proofs.lists.redundancy import STRAY
from polycorner.proofs.lists.relations import Relation, relation
from polycorner.proofs.lists.search import BoxSearch, Treated
from polycorner.proofs.lists.tips import TipRegion, tips
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH
from polycorner.values import cached_property

ATTEMPTS, RARE = 64, 8  # candidates that are tried in a chunk, regular and singular ones
NEWTON = 12
MOST_RELATED = 200  # sets of one size that relations are sought in
LARGE = 2.0**200
MOST_DEFECT = 0.99
Truths = NDArray[np.bool_]
Places = NDArray[np.intp]
MOST_SETS = 2000  # of one size that are looked at in a batch of boxes
Rows = tuple[int, ...]
Question = Callable[[Rows, Places], Truths]


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Enclosures of ``M`` functions on ``B`` boxes in the ``N`` coordinates that are free.

    Attributes
    ----------
    low, high : (B, M, N) arrays
        Bounds of the gradients.
    least, most : (B, M) arrays
        Bounds of the values in the middles.
    reach : (B, N) array
        Bound of the distance of a point of a box from its middle.
    usable : (B, M) array
        Whether a function is continuous on a box, so that the mean value theorem holds.
    """

    low: Array
    high: Array
    least: Array
    most: Array
    reach: Array
    usable: Truths

    @classmethod
    def of(
        cls,
        functions: BoxFunctions,
        lower: Array,
        upper: Array,
        gradients: tuple[Array, Array],
        free: Sequence[int],
    ) -> "Enclosures":
        """Return those of functions on boxes ``(B, n)``, whose gradients are given."""
        # The middle as rounded: values are taken there, and the reach covers both sides from it.
        middle = 0.5 * (lower + upper)
        least, most = functions.values(middle, middle)
        at = list(free)
        reach = np.maximum(upper - middle, middle - lower)[:, at] * (1 + UNIT)
        low, high = (side[:, :, at] for side in gradients)
        return cls(low, high, least, most, reach, functions.continuous(lower, upper))

    @cached_property
    def middles(self) -> Array:
        """Middles of the gradients, 0 where these may be large, ``(B, M, N)``."""
        with np.errstate(invalid="ignore"):
            middle = 0.5 * (self.low + self.high)
        # Beyond, products overflow; with the middle 0 the radius is honest, and nothing is shown.
        usual = (abs(self.low) < LARGE) & (abs(self.high) < LARGE)
        return np.where(usual, middle, 0.0)

    @cached_property
    def radii(self) -> Array:
        """Bounds of the distance of gradients from their middles, ``(B, M, N)``."""
        with np.errstate(invalid="ignore"):
            apart = np.maximum(self.high - self.middles, self.middles - self.low)
        return np.where(np.isfinite(apart), apart, np.inf) * (1 + UNIT)

    def independent(self, at: Places, rows: Sequence[int]) -> Truths:
        """Return whether the gradients of functions are independent on all of some boxes."""
        places = np.array(rows, dtype=np.intp)
        middle, radius = self.middles[np.ix_(at, places)], self.radii[np.ix_(at, places)]
        # Rows of about one length: pinv treats small singular values as zero, relative to the
        # largest.
        units = np.linalg.norm(middle, axis=2) + 1 / LARGE
        inverse = np.linalg.pinv(middle / units[:, :, None]) / units[:, None, :]
        identity = np.eye(len(places))
        size = abs(inverse)
        with np.errstate(invalid="ignore", over="ignore"):
            defect = abs(identity - middle @ inverse) + radius @ size
            defect += (
                (inverse.shape[1] + 4) * UNIT * (identity + abs(middle) @ size + radius @ size)
            )
            # Any scaled maximum norm proves it; in this one long and short gradients count alike.
            scaled = (defect * units[:, None, :] / units[:, :, None]).sum(axis=2)
        found = np.asarray((scaled < MOST_DEFECT).all(axis=1))  # False for NaN
        return np.asarray(found & self.usable[np.ix_(at, places)].all(axis=1), dtype=np.bool_)

    def incompatible(self, at: Places, rows: Sequence[int]) -> Truths:
        """Return whether functions do not vanish together anywhere in some boxes."""
        places = np.array(rows, dtype=np.intp)
        middle, radius = self.middles[np.ix_(at, places)], self.radii[np.ix_(at, places)]
        least, most = self.least[np.ix_(at, places)], self.most[np.ix_(at, places)]
        weights = _combinations(middle, self.reach[at])
        with np.errstate(invalid="ignore", over="ignore"):
            value, spread = 0.5 * (least + most), 0.5 * (most - least) * (1 + 4 * UNIT)
            size = abs(weights)
            # Each combination may show it by itself: one of many is enough.
            centre = abs((weights @ value[:, :, None])[:, :, 0])
            away = (size @ spread[:, :, None])[:, :, 0]
            slopes = abs(weights @ middle) + size @ radius
            moved = (slopes @ self.reach[at][:, :, None])[:, :, 0]
            most_of = size @ (abs(value) + spread)[:, :, None]
            whole = (
                most_of[:, :, 0]
                + ((size @ (abs(middle) + radius)) @ self.reach[at][:, :, None])[:, :, 0]
            )
            error = (2 * len(places) + 2 * middle.shape[2] + 16) * UNIT * whole + TINY
            found = np.asarray((centre > away + moved + error).any(axis=1))  # False for NaN
        return np.asarray(found & self.usable[np.ix_(at, places)].all(axis=1), dtype=np.bool_)


def _combinations(middle: Array, reach: Array) -> Array:
    """Return weights ``(B, C, r)`` of combinations of functions with gradients ``(B, r, N)``."""
    scaled = middle * reach[:, None, :]
    units = np.linalg.norm(scaled, axis=2, keepdims=True)
    units = np.where(units > 0, units, 1.0)
    rows = scaled / units
    count = rows.shape[1]
    # The shift makes the products of unit gradients regular where these are dependent.
    inverse = np.linalg.inv(rows @ rows.transpose(0, 2, 1) + 1e-10 * np.eye(count))
    # The former are nearly orthogonal to all gradients but one, the latter cancel all but one
    # coordinate.
    every = np.concatenate([inverse, rows.transpose(0, 2, 1) @ inverse], axis=1)
    return np.asarray(every / units[:, None, :, 0])


@dataclass(frozen=True, eq=False)
class Levels:
    """What is shown of a batch of boxes.

    ``left`` are the boxes in which there may be other corners, ``largest`` the sets of ``N - k``
    functions that may vanish together, and their boxes.
    """

    left: Truths
    largest: list[tuple[Rows, Places]]


def levels(
    found: Enclosures,
    masks: Mask,
    equations: int,
    known: Question,
    except_at_known: Question,
    related: Sequence[frozenset[int]] = (),
) -> Levels:
    """Return the boxes in which there may be corners that are not known.

    Parameters
    ----------
    found : Enclosures
        Of inequalities, then equations.
    masks : (B, m) array
        ``U`` for each box.
    equations : int
        ``k``.
    known, except_at_known : callable
        Whether the common zero of a set, or the point where its gradients are dependent, is known.
    related : sequence of frozenset of int
        Sets of functions in which one is a combination of others.
    """
    count, m = masks.shape
    top = found.reach.shape[1] - equations
    left = np.zeros(count, dtype=np.bool_)
    alive: dict[Rows, Truths] = {(): np.ones(count, dtype=np.bool_)}
    largest: list[tuple[Rows, Places]] = []
    for size in range(top + 1):
        survivors: dict[Rows, Truths] = {}
        for rows, where in alive.items():
            at = np.flatnonzero(where & ~left)
            # Case 5: the set says no more than its other members.
            if any(some.issubset(rows) for some in related):
                continue
            every = (*rows, *range(m, m + equations))
            if not at.size:
                continue
            if every:
                at = at[~(known(rows, at) | found.incompatible(at, every))]
            # As many functions as coordinates: none of the later cases can hold any more.
            if size == top:
                left[at] = True
                largest.append((rows, at))
                continue
            if every:
                left[at] = ~(found.independent(at, every) | except_at_known(rows, at))
            survivors[rows] = np.zeros(count, dtype=np.bool_)
            survivors[rows][at] = True
        # A set has to be looked at if all its subsets may vanish: of the others 4 or 5 is true.
        alive = dict(_larger(survivors, masks & ~left[:, None]))
        # Too many sets for a batch: what they may vanish in is left, and bisected.
        if len(alive) > MOST_SETS:
            for where in alive.values():
                left |= where
            return Levels(left, largest)
    if top < 0:
        left[:] = True
    return Levels(left, largest)


def _larger(alive: dict[Rows, Truths], masks: Mask) -> Iterator[tuple[Rows, Truths]]:
    """Yield the sets with one more element all of whose subsets are alive, and their boxes."""
    present = np.flatnonzero(masks.any(axis=0)).tolist()
    for rows, where in alive.items():
        for j in present:
            if rows and j <= rows[-1]:
                continue
            new = (*rows, j)
            # All subsets but the one this set grew from, which is alive in `where`.
            parts = [alive.get((*new[:i], *new[i + 1 :])) for i in range(len(rows))]
            boxes = where & masks[:, j]
            for part in parts:
                boxes = boxes & part if part is not None else np.zeros_like(boxes)
            if boxes.any():
                yield new, boxes


@dataclass
class Chunk(Treated):
    """Boxes, and the sets of functions that may vanish in those that are left.

    ``regular`` are sets of functions that may have a common zero in some boxes, where they are
    independent; ``singular`` are boxes in which no such set is, and the functions that may vanish
    there.
    """

    regular: list[tuple[Rows, Places]] = field(default_factory=list)
    singular: list[tuple[int, list[int]]] = field(default_factory=list)


@dataclass
class CornerSearch(BoxSearch):
    """One run: what is to be treated, and the regions in which one corner may be.

    ``relations`` are linear ones between functions, by the sets in which they were sought.
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
        # A box has a row for each branch: what matters in any of them may vanish.
        np.logical_or.at(masks, where, branches)
        at = np.flatnonzero(inside)
        part = boxes.part(at)
        sides = gradients[0][at], gradients[1][at]
        found = Enclosures.of(self.functions, part.lower, part.upper, sides, self.domain.free)
        zero, critical = _around(self.regions, part, self.domain.lower < self.domain.upper)
        # As known before the round: threads of one round must see the same.
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
            # Whatever comes of it: the next attempt is some bisections away.
            boxes.since[box] = 0
            for tip in tips(self.faces, boxes.middles[box], open_, 2 * sizes[box]):
                if not self.known.has(0.5 * (tip.lower + tip.upper), frozenset(tip.active)):
                    self.known.add(tip)

    def _relate(self, open_: list[int]) -> None:
        """Seek linear relations between functions, in small sets first."""
        top = len(self.domain.free) - self.equations
        for size in range(1, top + 1):
            for rows in islice(combinations(open_, size), MOST_RELATED):
                parts = (self.relations.get(part) for part in combinations(rows, size - 1))
                # A set that contains a related one tells nothing new.
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
