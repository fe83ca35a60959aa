"""Sectors: the two-dimensional faces between the rays of a corner."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from polycorner.polyhedra.cones import Rows
from polycorner.polyhedra.faces import HeldPoint
from polycorner.polyhedra.quotients import EvaluatedPoint, Sample
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances


@dataclass(frozen=True)
class Sector:
    """A two-dimensional face at a corner.

    Attributes
    ----------
    rays : tuple of int
        The two rays that bound it, by position; none where it goes all around an apex.
    held : tuple of int
        Functions that vanish on it, in ascending order: sets of the many sectors take ten times
        the memory.
    sample : Sample, optional
        A point of it near a singular corner.
    """

    rays: tuple[int, ...]
    held: tuple[int, ...]
    sample: Sample[HeldPoint] | None = None

    @property
    def active(self) -> frozenset[int]:
        """Functions that vanish on it."""
        return frozenset(self.held)


class Ranks:
    """Ranks of sets of rows, by duality from their relations, which are few.

    Of ``m`` rows of rank ``r``, a set ``S`` has rank ``|S| - (m - r) + rank R``, where ``R`` holds
    the weights of the rows outside ``S`` in the relations: those of ``S`` have no such weights.
    """

    def __init__(self, slopes: Array, tolerances: Tolerances) -> None:
        self.count, self.limit = len(slopes), tolerances.rank
        self.relations = Rows(slopes, self.limit).relations
        self._lost: dict[frozenset[int], int] = {}

    def of(self, some: frozenset[int]) -> int:
        """Return the rank of a set of rows."""
        related = int(self.relations.shape[1])
        if not related:
            return len(some)
        others = frozenset(range(self.count)).difference(some)
        if others not in self._lost:
            weights = np.linalg.svd(self.relations[sorted(others)], compute_uv=False)
            self._lost[others] = int((weights > self.limit).sum())
        return len(some) - related + self._lost[others]


def sectors_between(
    point: EvaluatedPoint, rows: list[int], slopes: Array, rays: list[Array]
) -> tuple[Sector, ...]:
    """Return the sectors between rays that lie in a common two-dimensional flat."""
    if not rays:
        return ()
    n = slopes.shape[1]
    tolerances = point.quotient.tolerances
    ranks = Ranks(slopes, tolerances)
    flats: dict[frozenset[int], set[int]] = {}
    every = np.array(rays)
    zero = abs(every @ slopes.T) <= tolerances.dependent
    many = zero.astype(np.int64) @ zero.T >= n - 2
    apart = abs(every @ every.T) < 1 - tolerances.dependent
    for i, j in np.argwhere(np.triu(many & apart, 1)).tolist():
        shared = frozenset(np.flatnonzero(zero[i] & zero[j]).tolist())
        if shared in flats or ranks.of(shared) == n - 2:
            flats.setdefault(shared, set()).update((i, j))
    sectors = []
    for shared, members in flats.items():
        if len(members) == 2 and not point.quotient.polyhedron.is_union:
            # Of a convex cone two extreme rays bound the sector, and both are tight on it.
            i, j = sorted(members)
            sectors.append(Sector((i, j), tuple(rows[k] for k in sorted(shared))))
            continue
        for i, j, middle in _arcs(rays, sorted(members)):
            active = active_along(point, rows, slopes @ middle)
            if active is None:
                continue
            if n == 2 or ranks.of(frozenset(map(rows.index, active))) == n - 2:
                sectors.append(Sector((i, j), tuple(sorted(active))))
    return tuple(sectors)


def _arcs(rays: list[Array], members: list[int]) -> Iterator[tuple[int, int, Array]]:
    """Yield neighbours by angle in the plane of some rays, and the direction halfway."""
    first = rays[members[0]]
    axis = max(
        (y - (y @ first) * first for y in map(rays.__getitem__, members)), key=np.linalg.norm
    )
    axis = axis / np.linalg.norm(axis)
    angles = {k: math.atan2(rays[k] @ axis, rays[k] @ first) % math.tau for k in members}
    ordered = sorted(members, key=angles.__getitem__)
    for i, j in zip(ordered, [*ordered[1:], ordered[0]], strict=True):
        gap = (angles[j] - angles[i]) % math.tau
        middle = angles[i] + gap / 2
        yield i, j, math.cos(middle) * first + math.sin(middle) * axis


def active_along(point: EvaluatedPoint, rows: list[int], rates: Array) -> frozenset[int] | None:
    """Return the functions active along a direction; None where it leaves the polyhedron."""
    away = point.distances[: point.quotient.count].copy()
    away[rows] = np.where(abs(rates) > point.quotient.tolerances.dependent, rates, 0.0)
    pieces = point.quotient.polyhedron.signs_to_pieces(np.sign(away).astype(int).tolist())
    return frozenset().union(*pieces) if pieces else None
