"""Lists made of searches that have ended: points, loci and undecided boxes.

A set that is a union of pieces with equations of their own has a list made of what the searches in
these found.  The tangent cone of a finite union of closed sets is the union of their tangent cones.
A point is therefore stationary in the union, or a strict local minimum of it, if and only if it is
in each piece that contains it.

Let ``p`` be the point of a region of one piece.  It solves the KKT equations of all functions of
its face, equations included, whatever the signs of multipliers; so it is the point of a region of
another piece if that carries the same functions and its box contains ``p``, and it is not
stationary in another piece that contains it if nothing of that piece's list is near.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.domains import ROUNDING, Domain
from polycorner.proofs.lists.images import Motion
from polycorner.proofs.lists.loci import LocusRegion
from polycorner.proofs.lists.members import (
    IN,
    OPEN,
    OUT,
    Listed,
    Member,
    full,
    images,
    inside,
    moved,
    settled,
)
from polycorner.proofs.lists.records import record
from polycorner.proofs.lists.search import BoxSearch, Tally
from polycorner.proofs.lists.stationary import (
    StationaryList,
    StationaryLocus,
    StationaryPoint,
    locus_of,
)
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array

Names = frozenset[str]


def each(search: BoxSearch, members: Iterable[Member]) -> Iterator[tuple[Member, int, bool]]:
    """Yield members and their images, each once, with their orbits, and whether they are open."""
    known, orbits = Listed(search), 0
    for member in members:
        before = known.has(member)
        if before:
            continue  # an image of one before
        known.add(member)
        is_open = member.place == OPEN or before is None
        yield member, orbits, is_open
        if is_open:
            continue
        for image in images(search, member):
            # An image that is not decided to be another point is told as one that may be.
            alike = known.has(image)
            if not alike:
                known.add(image)
                yield image, orbits, alike is None
        orbits += 1


def listed(search: BoxSearch, problem: Problem) -> StationaryList:
    """Return what a search found for a problem, in whose coordinates parameters are left out."""
    points: list[StationaryPoint] = []
    open_points: list[StationaryPoint] = []
    members, ways = settled(search)
    for member, orbit, is_open in each(search, (member for _, member in members)):
        (open_points if is_open else points).append(point_of(search, member, orbit))
    return StationaryList(
        problem,
        *box_of(search, problem),
        tuple(points),
        tuple(locus_of(search, place) for place in loci_of(search)),
        undecided(search)[:, :, : problem.dimension],
        tuple(open_points),
        search.tally,
        record(
            search,
            (k for k, member in members if member.place == IN),
            (k for k, member in members if member.place == OPEN),
            ways=ways,
        ),
        search.minima_only,
    )


def box_of(search: BoxSearch, problem: Problem) -> tuple[Domain, dict[str, tuple[float, float]]]:
    """Return the box in the coordinates of a problem, and the sides of parameters by name."""
    n, names, domain = problem.dimension, search.domain.manifold.names, search.domain
    box = Domain(problem.polyhedron.manifold, domain.lower[:n], domain.upper[:n])
    return box, {names[i]: side for i, side in domain.held.items()}


def undecided(search: BoxSearch) -> Array:
    """Return the boxes that are left or wait, ``(k, 2, n)``."""
    parts: list[Boxes] = [*search.undecided, search.waiting]
    lower = np.concatenate([p.lower for p in parts])
    upper = np.concatenate([p.upper for p in parts])
    return np.stack([lower, upper], axis=1)


def loci_of(search: BoxSearch) -> list[LocusRegion]:
    """Return the loci that were found, or those of minima, and their images, each once."""
    domain, z = search.domain, search.reads
    found: list[LocusRegion] = []
    for place in search.loci:
        if search.minima_only and place.index != 0:
            continue
        for g in (None, *search.motions):
            image = place if g is None else _locus_image(search, place, g)
            sharp = image.sharp_lower, image.sharp_upper
            if not domain.misses(*sharp, z) and not any(
                domain.within(*sharp, other.lower, other.upper, z) for other in found
            ):
                found.append(image if _is_held(domain, image) else replace(image, sample=None))
    return found


def _is_held(domain: Domain, place: LocusRegion) -> bool:
    """Whether a locus is in the domain for all values of the parameters, but for rounding."""
    return domain.holds(*place.sides(domain), ROUNDING)


def _locus_image(search: BoxSearch, place: LocusRegion, g: Motion) -> LocusRegion:
    z, ends = list(place.z), []
    for lower, upper in ((place.lower, place.upper), (place.sharp_lower, place.sharp_upper)):
        sides = search.domain.lower.copy(), search.domain.upper.copy()
        sides[0][z], sides[1][z] = lower, upper
        ends += [side[z] for side in moved(g, *sides, search.domain.manifold)]
    sample = None if place.sample is None else g(place.sample, search.domain.manifold)
    return LocusRegion(place.z, ends[0], ends[1], ends[2], ends[3], place.index, sample)


def point_of(search: BoxSearch, member: Member, orbit: int) -> StationaryPoint:
    """Return a member as it is told in a list."""
    region = member.region
    lower, upper = full(search, region)
    n, d = len(search.domain.free), search.problem.polyhedron
    more = tuple(d.names[i] for i in sorted(member.zeros.difference(region.active)))
    active = tuple(d.names[i] for i in region.active)
    ends = zip(region.sharp_lower[n:].tolist(), region.sharp_upper[n:].tolist(), strict=True)
    multipliers = dict(zip((*active, *d.equation_names), ends, strict=True))
    some = slice(0, len(lower) - len(search.domain.parameters))
    index = region.index if region.index == 0 or not more else None
    return StationaryPoint(lower[some], upper[some], active, multipliers, index, orbit, more)


@dataclass(frozen=True, eq=False)
class _Searched:
    """A search that has ended, its members by the functions of their faces, and its loci."""

    search: BoxSearch
    members: tuple[Member, ...]
    loci: tuple[LocusRegion, ...]
    alike: Mapping[str, str]

    def face(self, member: Member) -> Names:
        """Return the functions that carry the point of a region, by their names in all pieces."""
        d = self.search.problem.polyhedron
        names = (*(d.names[i] for i in member.region.active), *d.equation_names)
        return frozenset(self.alike[name] for name in names)

    def zeros(self, member: Member) -> Names:
        """Return the functions that vanish at the point of a region."""
        names = self.search.problem.polyhedron.names
        return self.face(member) | {self.alike[names[i]] for i in member.zeros}

    def place(self, lower: Array, upper: Array, zeros: Names) -> str:
        """Return whether points of a box at which some functions vanish lie in the piece."""
        d, m = self.search.problem.polyhedron, self.search.problem.inequalities
        low, high = self.search.functions.values(lower[None], upper[None])
        names = (*d.names, *d.equation_names)
        zero = np.array([self.alike[name] in zeros for name in names], dtype=np.bool_)
        below, above = (high[0, : len(names)] < 0) & ~zero, (low[0, : len(names)] > 0) & ~zero
        possible = [c for c in self.search.conj if not (below[:m] & c).any()]
        if not possible or (below | above)[m:].any():
            return OUT
        sure = any(not (c & ~(above | zero)[:m]).any() for c in possible)
        return IN if sure and zero[m:].all() else OPEN

    def is_empty_near(self, lower: Array, upper: Array) -> bool:
        """Whether nothing that may be stationary in the piece lies near the points of a box."""
        domain = self.search.domain
        boxes = [full(self.search, member.region) for member in self.members]
        boxes += [(box[0], box[1]) for box in undecided(self.search)]
        boxes += [place.sides(domain) for place in self.loci]
        return all(domain.apart(lower, upper, *box) for box in boxes)


def united(
    problem: Problem, searches: Sequence[BoxSearch], alike: Mapping[str, str]
) -> StationaryList:
    """Return the list of a union from the searches in its pieces, which have ended."""
    every = []
    for search in searches:
        members = tuple(member for _, member in settled(search)[0])
        every.append(_Searched(search, members, tuple(loci_of(search)), alike))
    points: list[StationaryPoint] = []
    open_points: list[StationaryPoint] = []
    loci: list[StationaryLocus] = []
    rest = [undecided(piece.search) for piece in every]
    for k, piece in enumerate(every):
        others = (every[:k], every[k + 1 :])
        for member in piece.members:
            where, minimum = _judged(piece, member, others)
            if where != OUT:
                to = points if where == IN else open_points
                point = point_of(piece.search, member, len(to))
                to.append(point if minimum else replace(point, index=None))
        for place in piece.loci:
            sides = place.sides(piece.search.domain)
            if all(p.place(*sides, frozenset()) == OUT for p in every if p is not piece):
                loci.append(locus_of(piece.search, place))
            else:
                rest.append(np.array([sides]))
    return StationaryList(
        problem,
        *box_of(searches[0], problem),
        tuple(points),
        tuple(loci),
        np.concatenate(rest)[:, :, : problem.dimension],
        tuple(open_points),
        _total([piece.search.tally for piece in every]),
        None,
        searches[0].minima_only,
    )


def _judged(
    piece: _Searched, member: Member, others: tuple[Sequence[_Searched], Sequence[_Searched]]
) -> tuple[str, bool]:
    """Return whether a point of a piece is stationary in the union, and whether its index counts.

    In a point of several pieces it does if it is 0 in all of them.
    """
    place, several = member.place, [member]
    zeros, (lower, upper) = piece.zeros(member), full(piece.search, member.region)
    for earlier, pieces in zip((True, False), others, strict=True):
        for other in pieces:
            there = other.place(lower, upper, zeros)
            if there == OUT:
                continue
            same = _same(piece, member, other)
            if same is not None and there == IN:
                if earlier:
                    return OUT, False  # it is told with the other piece
                place = same.place if place == IN else place
                several.append(same)
            elif same is None and there == IN and other.is_empty_near(lower, upper):
                return OUT, False
            else:
                place = OPEN
    return place, len(several) == 1 or all(one.region.index == 0 for one in several)


def _same(piece: _Searched, member: Member, other: _Searched) -> Member | None:
    """Return the member of another piece whose point is that of a region."""
    face = piece.face(member)
    alike = (one for one in other.members if other.face(one) == face)
    return next((o for o in alike if inside(other.search, member.region, o.region)), None)


def _total(tallies: Sequence[Tally]) -> Tally:
    return Tally(*(sum(getattr(t, f.name) for t in tallies) for f in fields(Tally)))
