"""Which regions of a search carry points of the list, each point once."""

import numpy as np

from polycorner.intervals.balls import ball, between, precision
from polycorner.intervals.tapes import Box
from polycorner.proofs.lists.acceptance import BITS, Region
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.search import Search
from polycorner.spaces.manifold import Array

IN, OUT, OPEN = "in", "out", "open"
ROUNDING = 1e-12  # of enclosures that are carried around circles, in scale units


class Known:
    """Regions by their active sets, with the question whether a point is the one of a region."""

    def __init__(self, search: Search) -> None:
        self.search, self.boxes = search, dict[frozenset[int], list[tuple[Array, Array]]]()
        self.free = list(search.domain.free)
        self.periods = np.array(search.domain.manifold.periods)[self.free]

    def add(self, region: Region) -> None:
        """Add a region."""
        sides = region.lower[self.free], region.upper[self.free]
        self.boxes.setdefault(frozenset(region.active), []).append(sides)

    def has(self, region: Region) -> bool:
        """Whether the point of a region lies in a known one, where there is only one."""
        known = self.boxes.get(frozenset(region.active))
        if not known:
            return False
        sides = np.array(known)
        lower, upper = region.sharp_lower[: len(self.free)], region.sharp_upper[: len(self.free)]
        apart = sides.mean(axis=1) - 0.5 * (lower + upper)
        circles = np.where(np.isfinite(self.periods), self.periods, 1.0)
        turn = np.where(np.isfinite(self.periods), np.round(apart / circles) * circles, 0.0)
        slack = ROUNDING * self.search.problem.scales[self.free]
        inside = (lower + turn - slack >= sides[:, 0]) & (upper + turn + slack <= sides[:, 1])
        return bool(inside.all(axis=1).any())


def full(search: Search, region: Region) -> tuple[Array, Array]:
    """Return the enclosure of a region's point in all coordinates."""
    lower, upper = search.domain.lower.copy(), search.domain.upper.copy()
    free = list(search.domain.free)
    lower[free], upper[free] = region.sharp_lower[: len(free)], region.sharp_upper[: len(free)]
    return lower, upper


def membership(search: Search, region: Region) -> str:
    """Decide whether a region's point is a stationary point of the set in the domain.

    The signs of the other functions at the point say in which branches of the tree it lies.  It
    is stationary if each of these asks for all active functions and for no other function that
    may vanish there; it is not if one asks for fewer of them, as all multipliers are positive.
    """
    lower, upper = full(search, region)
    m = search.problem.inequalities
    with precision(BITS):
        hull = [between(a, b) for a, b in zip(lower.tolist(), upper.tolist(), strict=True)]
        values = search.faces.formulas.values(Box(hull), range(m))
        below = np.array([bool(v < ball(0)) for v in values])
        above = np.array([bool(v > ball(0)) for v in values])
    held = np.zeros(m, dtype=np.bool_)
    held[list(region.active)] = True
    below &= ~held
    above &= ~held
    if _outside(search.domain, lower, upper):
        return OUT
    possible = [c for c in search.conj if not (below & c).any()]
    if not possible:
        return OUT
    decided = [c for c in possible if not (c & ~above & ~held).any()]
    if any((held & ~c).any() for c in decided):
        return OUT
    if len(decided) == len(possible):
        return IN
    return OPEN


def _outside(found: Domain, lower: Array, upper: Array) -> bool:
    periods = np.array(found.manifold.periods)
    whole = found.upper - found.lower >= periods
    away = (upper < found.lower) | (lower > found.upper)
    return bool((away & ~whole).any())
