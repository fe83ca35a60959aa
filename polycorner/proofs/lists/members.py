"""Members of a list: the regions of a search whose points are stationary, each point once."""

import numpy as np

from polycorner.intervals.balls import ball, between, precision
from polycorner.intervals.tapes import Box
from polycorner.proofs.lists.acceptance import BITS, Region
from polycorner.proofs.lists.images import Motion
from polycorner.proofs.lists.known import Sides
from polycorner.proofs.lists.search import Search
from polycorner.spaces.manifold import Array, Manifold

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
        below = np.array([bool(v < ball(0)) for v in values])
        above = np.array([bool(v > ball(0)) for v in values])
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


def images(search: Search, region: Region) -> list[Region]:
    """Return a region carried along by all symmetries of a search."""
    pairs = zip(search.motions, search.maps, strict=True)
    return [image(search, region, g, p) for g, p in pairs]


def image(search: Search, region: Region, g: Motion, p: tuple[int, ...]) -> Region:
    """Return a region carried along by a symmetry, which takes inequalities to ``p``."""
    manifold = search.domain.manifold
    free, n = list(search.domain.free), len(search.domain.free)
    inverse = {there: i for i, there in enumerate(p)}
    lower, upper = moved(g, *full(search, region), manifold)
    wide = moved(g, region.lower, region.upper, manifold)
    turn = manifold.wrap(0.5 * (lower + upper)) - 0.5 * (lower + upper)
    active = tuple(inverse[i] for i in region.active)
    sharp = [
        np.concatenate([(side + turn)[free], rest[n:]])
        for side, rest in ((lower, region.sharp_lower), (upper, region.sharp_upper))
    ]
    return Region(wide[0] + turn, wide[1] + turn, active, sharp[0], sharp[1], region.index)


def moved(g: Motion, lower: Array, upper: Array, manifold: Manifold) -> tuple[Array, Array]:
    """Return the sides of a box's image, shifts rounded outwards."""
    ends = g.signs * np.array([lower, upper])[:, list(g.order)]
    shifted = np.sort(ends, axis=0) + g.shifts(manifold)
    some = np.array(g.halves) != 0
    return (
        np.where(some, np.nextafter(shifted[0], -np.inf), shifted[0]),
        np.where(some, np.nextafter(shifted[1], np.inf), shifted[1]),
    )
