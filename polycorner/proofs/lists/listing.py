"""What is made of a search that has ended: its points, loci and undecided boxes."""

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.boxes import Boxes
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.images import Motion
from polycorner.proofs.lists.loci import LocusRegion
from polycorner.proofs.lists.members import OPEN, Listed, Member, full, images, moved, settled
from polycorner.proofs.lists.records import record
from polycorner.proofs.lists.search import Search
from polycorner.proofs.lists.stationary import StationaryList, StationaryPoint, locus_of
from polycorner.spaces.manifold import Array


def listed(search: Search, problem: Problem) -> StationaryList:
    """Return what a search found for a problem, in whose coordinates parameters are left out."""
    points: list[StationaryPoint] = []
    open_points: list[StationaryPoint] = []
    known, orbits, (members, ways) = Listed(search), 0, settled(search)
    for _, member in members:
        before = known.has(member)
        if before:
            continue  # an image of one before
        known.add(member)
        if member.place == OPEN or before is None:
            open_points.append(point_of(search, member, orbits))
            continue
        points.append(point_of(search, member, orbits))
        for image in images(search, member):
            alike = known.has(image)
            if not alike:
                known.add(image)
                (points if alike is False else open_points).append(point_of(search, image, orbits))
        orbits += 1
    return StationaryList(
        problem,
        *box_of(search, problem),
        tuple(points),
        tuple(locus_of(search, place) for place in loci_of(search)),
        undecided(search)[:, :, : problem.dimension],
        tuple(open_points),
        search.tally,
        record(search, members, ways),
        search.minima_only,
    )


def box_of(search: Search, problem: Problem) -> tuple[Domain, dict[str, tuple[float, float]]]:
    """Return the box in the coordinates of a problem, and the sides of parameters by name."""
    n, names, domain = problem.dimension, search.domain.manifold.names, search.domain
    box = Domain(problem.polyhedron.manifold, domain.lower[:n], domain.upper[:n])
    return box, {names[i]: side for i, side in domain.held.items()}


def undecided(search: Search) -> Array:
    """Return the boxes that are left or wait, ``(k, 2, n)``."""
    parts: list[Boxes] = [*search.undecided, search.waiting]
    lower = np.concatenate([p.lower for p in parts])
    upper = np.concatenate([p.upper for p in parts])
    return np.stack([lower, upper], axis=1)


def loci_of(search: Search) -> list[LocusRegion]:
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
                found.append(image)
    return found


def _locus_image(search: Search, place: LocusRegion, g: Motion) -> LocusRegion:
    z, ends = list(place.z), []
    for lower, upper in ((place.lower, place.upper), (place.sharp_lower, place.sharp_upper)):
        sides = search.domain.lower.copy(), search.domain.upper.copy()
        sides[0][z], sides[1][z] = lower, upper
        ends += [side[z] for side in moved(g, *sides, search.domain.manifold)]
    sample = None if place.sample is None else g(place.sample, search.domain.manifold)
    return LocusRegion(place.z, ends[0], ends[1], ends[2], ends[3], place.index, sample)


def point_of(search: Search, member: Member, orbit: int) -> StationaryPoint:
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
