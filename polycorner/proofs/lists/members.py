"""Members of a list: the regions of a search whose points are stationary, each point once."""

import numpy as np

from polycorner.intervals.balls import ball, between, precision
from polycorner.intervals.tapes import Box
from polycorner.proofs.lists.acceptance import BITS, Region
from polycorner.proofs.lists.known import Sides
from polycorner.proofs.lists.search import Search
from polycorner.spaces.manifold import Array

IN, OUT, OPEN = "in", "out", "open"


class Listed:
    """Regions by their active sets, with the question whether a point is the one of a region."""

    def __init__(self, search: Search) -> None:
        self.search, self.free = search, list(search.domain.free)
        self.boxes = Sides(len(self.free))

    def add(self, region: Region) -> None:
        """Add a region."""
        self.boxes.add(frozenset(region.active), region.lower[self.free], region.upper[self.free])

    def has(self, region: Region) -> bool:
        """Whether the point of a region lies in a known one, where there is only one."""
        sides = self.boxes.of(frozenset(region.active))
        lower, upper = region.sharp_lower[: len(self.free)], region.sharp_upper[: len(self.free)]
        domain = self.search.domain
        return bool(domain.within(lower, upper, *sides, self.free).any())


def settled(search: Search) -> list[tuple[int, str]]:
    """Return the regions whose points are in the list or may be (``IN``, ``OPEN``), each once."""
    known, found = Listed(search), list[tuple[int, str]]()
    for k, region in enumerate(search.regions):
        place = OUT if known.has(region) else membership(search, region)
        if search.minima_only and region.index != 0:
            place = OPEN if place == IN and region.index is None else OUT
        if place != OUT:
            known.add(region)
            found.append((k, place))
    return found


def full(search: Search, region: Region) -> tuple[Array, Array]:
    """Return the enclosure of a region's point in all coordinates."""
    lower, upper = search.domain.lower.copy(), search.domain.upper.copy()
    free = list(search.domain.free)
    lower[free], upper[free] = region.sharp_lower[: len(free)], region.sharp_upper[: len(free)]
    return lower, upper


def membership(search: Search, region: Region) -> str:
    """Decide whether a region's point is a stationary point of the set in the domain.

    The signs of the other functions at the point say in which branches of the tree it lies.  As
    all multipliers are positive, it is not stationary if a branch that contains it asks for fewer
    than the active functions.  If every branch that may contain it asks for all of them it is
    stationary, whatever else they ask for; it is in the set if one of them asks for no more.
    """
    lower, upper = full(search, region)
    m = search.problem.inequalities
    with precision(BITS):
        hull = [between(a, b) for a, b in zip(lower.tolist(), upper.tolist(), strict=True)]
        values = search.faces.formulas.values(Box(hull), range(m))
        below = np.array([bool(v < ball(0)) for v in values], dtype=np.bool_)
        above = np.array([bool(v > ball(0)) for v in values], dtype=np.bool_)
    # Balls give up square roots that may reach 0, as of the distance of centres that coincide.
    low, high = search.functions.values(lower[None], upper[None])
    below |= high[0, :m] < 0
    above |= low[0, :m] > 0
    held = np.zeros(m, dtype=np.bool_)
    held[list(region.active)] = True
    below &= ~held
    above &= ~held
    if search.domain.misses(lower, upper, range(len(lower))):
        return OUT
    possible = [c for c in search.conj if not (below & c).any()]
    if not possible:
        return OUT
    decided = [not (c & ~above & ~held).any() for c in possible]
    fewer = [bool((held & ~c).any()) for c in possible]
    if any(sure and less for sure, less in zip(decided, fewer, strict=True)):
        return OUT
    return IN if any(decided) and not any(fewer) else OPEN
