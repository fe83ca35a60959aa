"""Members of a list: the regions of a search whose points are stationary, each point once."""

from dataclasses import dataclass, replace

import numpy as np

from polycorner.intervals.balls import ball, precision
from polycorner.proofs.lists.coincidences import ZERO, Place, signs
from polycorner.proofs.lists.domains import ROUNDING
from polycorner.proofs.lists.examination import without_minima
from polycorner.proofs.lists.faces import BITS, Region, enclosing
from polycorner.proofs.lists.images import Motion
from polycorner.proofs.lists.known import Sides
from polycorner.proofs.lists.search import BoxSearch
from polycorner.proofs.lists.tips import TipRegion
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array, Manifold

IN, OUT, OPEN = "in", "out", "open"


@dataclass(frozen=True, eq=False)
class RegionPoint:
    """The point of a region.

    Inequalities are ``zeros`` if they vanish there, and ``unknown`` if they may.
    """

    region: Region
    zeros: frozenset[int]
    unknown: frozenset[int]


@dataclass(frozen=True, eq=False)
class Member(RegionPoint):
    """A point that may be stationary.

    It is stationary in the set (``IN``), or not (``OUT``), or that is ``OPEN``; it is ``free`` if
    in some branch that contains it all functions but those of the region are positive.
    """

    place: str
    free: bool

    @property
    def is_plain(self) -> bool:
        """Whether no functions vanish there but those of the region."""
        return not self.unknown and len(self.zeros) == len(self.region.active)


class Listed:
    """Regions by their active sets, with the question whether a point is the one of a region."""

    def __init__(self, search: BoxSearch) -> None:
        self.search, self.free = search, list(search.domain.free)
        self.top = len(self.free) - search.equations
        self.boxes = Sides(len(self.free))
        self.every, self.special = list[Member](), list[Member]()

    def add(self, member: Member) -> None:
        """Add a region."""
        region = member.region
        self.boxes.add(frozenset(region.active), region.lower[self.free], region.upper[self.free])
        self.every.append(member)
        if not member.is_plain:
            self.special.append(member)

    def holds(self, region: Region) -> bool:
        """Whether the point of a region lies in a known one of the same functions."""
        sides = self.boxes.of(frozenset(region.active))
        lower, upper = region.sharp_lower[: len(self.free)], region.sharp_upper[: len(self.free)]
        domain = self.search.domain
        return bool(domain.within(lower, upper, *sides, self.free).any())

    def has(self, member: Member) -> bool | None:
        """Whether the point of a region is that of a known one; None where it is not decided."""
        if self.holds(member.region):
            return True
        # Two plain members are one point only if their functions are the same, which was asked.
        others = self.special if member.is_plain else self.every
        found = [same(self.search, member, other, self.top) for other in others]
        return True if True in found else None if None in found else False


def same(search: BoxSearch, one: RegionPoint, other: RegionPoint, least: int = 0) -> bool | None:
    """Whether the points of two regions are the same; None where that is not decided.

    Regions of ``least`` functions or more have one common zero of these.
    """
    if apart(search, one.region, other.region):
        return False
    # From both sides: either box may be the narrower one, or have more functions known.
    for here, there in ((one, other), (other, one)):
        rows = frozenset(there.region.active)
        # A function of the other point is not zero here: they differ.
        if rows - here.zeros - here.unknown:
            return False
        known = len(rows) >= least and rows <= here.zeros
        if known and inside(search, here.region, there.region):
            return True
    return None


def inside(search: BoxSearch, region: Region, other: Region) -> bool:
    """Whether the point of a region lies in the box of another one."""
    free = list(search.domain.free)
    lower, upper = region.sharp_lower[: len(free)], region.sharp_upper[: len(free)]
    return bool(search.domain.within(lower, upper, other.lower[free], other.upper[free], free))


def apart(search: BoxSearch, region: Region, other: Region) -> bool:
    """Whether the enclosures of two points are disjoint."""
    return search.domain.apart(*full(search, region), *full(search, other))


def settled(search: BoxSearch) -> tuple[list[tuple[int, Member]], dict[int, Array]]:
    """Return the regions whose points are in the list or may be, each once, with numbers.

    And directions of negative curvature, by the numbers of regions whose points are no minima for
    their sake.
    """
    seen, members, ways = Listed(search), list[tuple[int, Member]](), dict[int, Array]()
    for k, region in enumerate(search.regions):
        # A point beyond the end of a circle is in the box, too, carried around it, and found there.
        beyond = search.critical and search.domain.is_beyond(*full(search, region))
        member = None if beyond or seen.holds(region) else judged(search, region)
        if member is not None and search.minima_only and region.index != 0:
            plain = region.index is not None and member.free  # no others can make it a minimum
            way = None if plain or member.place == OUT else _bent(search, member)
            if way is not None:
                ways[k] = way
            shown = plain or way is not None or member.place == OUT
            member = replace(member, place=OUT if shown else OPEN)
        if member is not None and member.place != OUT:
            seen.add(member)
            members.append((k, member))
    known, found = Listed(search), list[tuple[int, Member]]()
    # A point may be that of several regions: the one that decides most is listed.
    for k, member in sorted(members, key=_order):
        before = known.has(member)
        if not before:
            decided = replace(member, place=OPEN) if before is None else member
            known.add(decided)
            found.append((k, decided))
    return found, ways


def _bent(search: BoxSearch, member: Member) -> Array | None:
    """Return a direction of negative curvature at a point, tangent to all that may vanish there.

    It shows that the point is no minimum of any branch (:mod:`~polycorner.proofs.lists.curvature`).
    """
    lower, upper = full(search, member.region)
    nodes = np.zeros(1, dtype=np.int64)
    mask = np.zeros((1, search.problem.inequalities), dtype=np.bool_)
    mask[0, list(member.zeros | member.unknown)] = True
    found, ways = without_minima(search, Boxes(lower[None], upper[None], nodes, nodes), nodes, mask)
    return ways[0] if found[0] else None


def _order(pair: tuple[int, Member]) -> tuple[bool, bool]:
    """Members first, and points that are no minima by the functions of their region alone last."""
    member = pair[1]
    return member.place == OPEN, not member.is_plain and member.region.index != 0


def full(search: BoxSearch, region: Region) -> tuple[Array, Array]:
    """Return the enclosure of a region's point in all coordinates."""
    lower, upper = search.domain.lower.copy(), search.domain.upper.copy()
    free = list(search.domain.free)
    lower[free], upper[free] = region.sharp_lower[: len(free)], region.sharp_upper[: len(free)]
    return lower, upper


def judged(search: BoxSearch, region: Region) -> Member:
    """Return the point of a region, and whether it is a stationary point of the set in the domain.

    The signs of the other functions at the point say in which branches of the tree it lies.  As
    all multipliers are positive, it is stationary in each branch that asks for all of the active
    functions, whatever else that asks for, and in none that asks for some of them and for no other
    one that vanishes.
    """
    lower, upper = full(search, region)
    m = search.problem.inequalities
    with precision(BITS):
        values = search.faces.formulas.values(enclosing(lower, upper), range(m))
        below = np.array([bool(v < ball(0)) for v in values], dtype=np.bool_)
        above = np.array([bool(v > ball(0)) for v in values], dtype=np.bool_)
    # Balls give up square roots that may reach 0, as of the distance of centres that coincide.
    low, high = search.functions.values(lower[None], upper[None])
    below |= high[0, :m] < 0
    above |= low[0, :m] > 0
    held = np.zeros(m, dtype=np.bool_)
    held[list(region.active)] = True
    zeros = held.copy()
    outside = search.domain.misses(lower, upper, range(len(lower)))
    # Exact algebra is slow: only for points in the domain with signs that are open.
    if not outside and (~below & ~above & ~held).any():
        found = signs(search.faces, placed(search, region), m)
        zeros |= np.array([sign == ZERO for sign in found])
    below, above = below & ~zeros, above & ~zeros
    unknown = ~below & ~above & ~zeros
    sets = frozenset(np.flatnonzero(zeros).tolist()), frozenset(np.flatnonzero(unknown).tolist())
    possible = [c for c in search.conj if not (below & c).any()]
    free = any(not (c & (zeros | unknown) & ~held).any() for c in possible)
    if outside or not possible:
        return Member(region, *sets, OUT, free)
    sure = [not (c & unknown).any() for c in possible]
    some = [bool((held & ~c).any()) for c in possible]
    fewer = [less and not (c & zeros & ~held).any() for c, less in zip(possible, some, strict=True)]
    # With parameters a point may be in the domain for some of their values and not for others.
    held_in = search.domain.holds(lower, upper, ROUNDING)
    if search.critical:
        return Member(region, *sets, IN if held_in and any(sure) else OPEN, free)
    if any(a and b for a, b in zip(sure, fewer, strict=True)):
        return Member(region, *sets, OUT, free)
    return Member(region, *sets, IN if held_in and any(sure) and not any(some) else OPEN, free)


def placed(search: BoxSearch, region: Region) -> Place:
    """Return the point of a region, enclosed as well as its kind allows."""
    rows = search.faces.rows(region.active)
    if isinstance(region, TipRegion):
        with precision(BITS):
            return Place([ball(x) for x in region.exact], region.lower, region.upper, rows)
    unique = len(rows) == len(search.domain.free) and not search.domain.parameters
    lower, upper = full(search, region)
    with precision(BITS):
        point = list(enclosing(lower, upper).hull)
        sides = region.lower, region.upper
        zero = search.faces.zero(*sides, rows) if unique else None
        for i, x in zip(search.domain.free, zero or (), strict=bool(zero)):
            point[i] = x
        return Place(point, *sides, rows, unique)


def images(search: BoxSearch, member: Member) -> list[Member]:
    """Return a member carried along by all symmetries of a search."""
    pairs = zip(search.motions, search.maps, strict=True)
    return [image_of(search, member, g, p) for g, p in pairs]


def image(search: BoxSearch, region: Region, g: Motion, p: tuple[int, ...]) -> Region:
    """Return a region carried along by a symmetry, which takes inequalities to ``p``."""
    manifold = search.domain.manifold
    free, n = list(search.domain.free), len(search.domain.free)
    inverse = {there: i for i, there in enumerate(p)}
    lower, upper = moved(g, *full(search, region), manifold)
    wide = moved(g, region.lower, region.upper, manifold)
    turn = _turn(0.5 * (lower + upper), manifold)
    active = tuple(inverse[i] for i in region.active)
    sides = _shifted(lower, upper, turn)
    sharp = [
        np.concatenate([side[free], rest[n:]])
        for side, rest in zip(sides, (region.sharp_lower, region.sharp_upper), strict=True)
    ]
    return Region(*_shifted(*wide, turn), active, sharp[0], sharp[1], region.index)


def moved(g: Motion, lower: Array, upper: Array, manifold: Manifold) -> tuple[Array, Array]:
    """Return the sides of a box's image, shifts rounded outwards."""
    ends = g.signs * np.array([lower, upper])[:, list(g.order)]
    # A sign of -1 exchanges the ends.
    lower, upper = np.sort(ends, axis=0)
    return _shifted(lower, upper, g.shifts(manifold))


def _turn(q: Array, manifold: Manifold) -> Array:
    """Return the multiples of periods that bring a point into the principal intervals."""
    periods = np.array(manifold.periods)
    whole = np.where(np.isfinite(periods), periods, 1.0)
    turn = np.round((manifold.wrap(q) - q) / whole) * whole
    # At the end of the interval a point stays: functions need not be the same at the other one.
    slack = ROUNDING * manifold.scale_array
    return np.asarray(np.where(abs(q) <= 0.5 * periods + slack, 0.0, turn))


def _shifted(lower: Array, upper: Array, shift: Array) -> tuple[Array, Array]:
    """Return a box moved by the multiples of half periods that a shift rounds, outward."""
    # A multiple of pi as a double is off by half a unit, and so is the sum.
    slack = np.where(shift != 0, np.spacing(abs(shift)), 0.0)
    below, above = lower + shift - slack, upper + shift + slack
    return (
        np.where(shift != 0, np.nextafter(below, -np.inf), lower),
        np.where(shift != 0, np.nextafter(above, np.inf), upper),
    )


def image_of(search: BoxSearch, member: Member, g: Motion, p: tuple[int, ...]) -> Member:
    """Return a member carried along by a symmetry, as :func:`image` does a region."""
    inverse = {there: i for i, there in enumerate(p)}
    zeros, unknown = (
        frozenset(inverse[i] for i in rows) for rows in (member.zeros, member.unknown)
    )
    return Member(image(search, member.region, g, p), zeros, unknown, member.place, member.free)
