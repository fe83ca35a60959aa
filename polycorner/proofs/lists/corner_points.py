"""Corners among the points of regions: which lie in the set, and which are the same.

The point of a region with the functions ``S`` is a corner if it lies in the set and all of ``S``
matter there; others may vanish as well.  The points of two regions are the same if one lies in
the other's box and the other's functions vanish at it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from polycorner.intervals.balls import ball, precision
from polycorner.proofs.lists.acceptance import Region
from polycorner.proofs.lists.coincidences import OPEN, ZERO, Place, active_at, signs
from polycorner.proofs.lists.corner_search import CornerSearch
from polycorner.proofs.lists.members import RegionPoint, full, image, placed, same
from polycorner.proofs.lists.operators import BITS
from polycorner.proofs.lists.tips import TipRegion

MOST_OPEN = 6  # functions of unknown sign at a point, all of whose signs are gone through

Names = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Candidate(RegionPoint):
    """A point that may be a corner.

    Attributes
    ----------
    number : int
        Of its region in the search.
    active : tuple of int or None
        Those that vanish and matter; None where that is not decided.
    """

    number: int
    active: Names | None


def candidates(search: CornerSearch) -> list[Candidate]:
    """Return the points that are corners or may be, each once; regular ones first."""
    order = sorted(enumerate(search.regions), key=lambda pair: isinstance(pair[1], TipRegion))
    found: list[Candidate] = []
    for number, region in order:
        new = _candidate(search, number, region)
        if new is None:
            continue
        alike = [same(search, new, other) for other in found]
        if True in alike:
            continue
        found.append(replace(new, active=None) if None in alike else new)
    return found


def _candidate(search: CornerSearch, number: int, region: Region) -> Candidate | None:
    """Return the point of a region, or None if it is no corner."""
    lower, upper = full(search, region)
    if search.domain.misses(lower, upper, range(len(lower))):
        return None
    found = signs(search.vertices, _place(search, region), search.problem.inequalities)
    unknown = [i for i, sign in enumerate(found) if sign == OPEN]
    zeros = frozenset(i for i, sign in enumerate(found) if sign == ZERO)
    possible: set[Names | None] = set()
    sole = False  # whether a function without a gradient may be active, but not all of the region
    if len(unknown) <= MOST_OPEN:
        for choice in product((-1, 0, 1), repeat=len(unknown)):
            for i, sign in zip(unknown, choice, strict=True):
                found[i] = sign
            active = active_at(search.conj, found)
            corner = active is not None and set(region.active) <= set(active)
            possible.add(active if corner else None)
            if active is not None and not corner and isinstance(region, TipRegion):
                sole |= not set(region.critical).isdisjoint(active)
        if possible == {None} and not sole:
            return None
    decided = possible.pop() if len(possible) == 1 and not sole else None
    return Candidate(region, zeros, frozenset(unknown), number, decided)


def _place(search: CornerSearch, region: Region) -> Place:
    """Return the point of a region, enclosed as well as its kind allows."""
    if not isinstance(region, TipRegion):
        return placed(search, region)
    with precision(BITS):
        point, rows = [ball(x) for x in region.exact], search.vertices.rows(region.active)
        return Place(point, region.lower, region.upper, rows)


def with_images(
    search: CornerSearch, found: Sequence[Candidate]
) -> Iterator[tuple[Candidate, int]]:
    """Yield corners and their images under the symmetries, with the numbers of their orbits.

    Those that may be others again are not decided to be active anywhere.
    """
    listed: list[Candidate] = []
    orbit = 0
    for one in found:
        if one.active is None or any(same(search, one, other) for other in listed):
            continue
        new = [one]
        for g, p in zip(search.motions, search.maps, strict=True):
            inverse = {there: i for i, there in enumerate(p)}
            region = image(search, one.region, g, p)
            parts = [tuple(sorted(inverse[i] for i in s)) for s in (one.zeros, one.active)]
            moved = Candidate(region, frozenset(parts[0]), frozenset(), one.number, parts[1])
            alike = [same(search, moved, other) for other in (*listed, *new)]
            if True not in alike:
                new.append(replace(moved, active=None) if None in alike else moved)
        listed += new
        for each in new:
            yield each, orbit
        orbit += 1
