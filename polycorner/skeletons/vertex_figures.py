"""Vertex figures: the edges at a corner and the two-dimensional sectors between them.

At a regular corner, where the active gradients have full rank in the quotient by the symmetry,
edges leave along lines on which all but one dimension of the gradients vanishes: the extreme rays
of the tangent cone where the polyhedron is locally an intersection, lines of the arrangement
that stay in the set where it is a union.  At a singular corner, where the rank falls short,
breaking one contact leaves the null directions of the others; its figure is that of its link.
Every candidate is tested: a point a little way along it must lie in the polyhedron,
and the functions that vanish there are the edge's active set.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np

from polycorner.polyhedra.cones import Rows, extreme_rays, null_space, rank, unit_rows
from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient, Sample
from polycorner.skeletons.branches import common_zeros
from polycorner.skeletons.dependence import curvature, held_at
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


MAX_CANDIDATES = 20_000
MAX_BASES = 64
# Distance from zero of functions that vanish along a curve, over the size of the coordinates.
RELATIVE_ROUNDING = 64 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Ray:
    """The beginning of an edge at a corner.

    Attributes
    ----------
    direction : (n,) array
        Scaled unit tangent, orthogonal to the orbit of the symmetry.
    active : frozenset of int
        Functions that vanish along the edge.
    sample : Sample
        A point of the edge ``distance`` scale units away, holding a basis of ``active``.
    dependent : bool
        Whether the gradients of ``active`` have a relation all along.
    """

    direction: Array
    active: frozenset[int]
    sample: Sample[HeldPoint]
    distance: float
    dependent: bool = False

    def start(self, quotient: Quotient) -> HeldPoint:
        """Return the sample with its values and frame."""
        if self.dependent:
            return held_at(quotient, self.sample.q, self.active, self.sample.kept)
        return self.sample.at(quotient)


@dataclass(frozen=True)
class VertexFigure:
    """The rays and sectors at a corner.

    Attributes
    ----------
    rank, full : int
        Rank of the active gradients in the quotient, and the dimension of the quotient.
    rays : tuple of Ray
    sectors : tuple of Sector
    """

    rank: int
    full: int
    rays: tuple[Ray, ...]
    sectors: tuple[Sector, ...]
    notes: tuple[str, ...]

    @property
    def singular(self) -> bool:
        """Whether the point is isolated by second-order terms only."""
        return self.rank < self.full

    def is_thin(self, tolerances: Tolerances) -> bool:
        """Whether first derivatives do not tell the faces: edges touch, or surfaces do."""
        pairs, parallel = combinations(self.rays, 2), 1 - tolerances.dependent
        touching = any(one.direction @ other.direction > parallel for one, other in pairs)
        return touching or any(len(s.held) > self.full - 2 for s in self.sectors)


def corner_rank(point: EvaluatedPoint, active: frozenset[int]) -> tuple[int, int]:
    """Return the rank of the active gradients in the quotient, and the quotient's dimension."""
    slopes = point.slopes(sorted(active))
    return rank(slopes, point.quotient.tolerances.rank), int(slopes.shape[1])


def vertex_figure(point: EvaluatedPoint, active: frozenset[int]) -> VertexFigure:
    """Return the rays and sectors at a regular corner with the given active functions."""
    tolerances, frame = point.quotient.tolerances, point.frame
    rows = sorted(active)
    slopes = point.slopes(rows)
    full = frame.shape[1]
    notes: list[str] = []
    rays: list[Ray] = []
    for y, tight in _regular(point, rows, slopes):
        known, way = len(rays), frame @ y
        for base in _bases(point, rows, slopes, tight):
            covered = [x for x in rays if x.direction @ way > 1 - tolerances.dependent]
            if not any(x.active >= base for x in covered):
                ray = _tested(point, active, way, base)
                if ray is not None and all(x.active != ray.active for x in covered):
                    rays.append(ray)
        if len(rows) == full and len(rays) == known:
            notes.append(
                f"an edge out of the corner {point.quotient.written(rows)} is shorter than "
                f"{10 * tolerances.zero:g} scale units: not followed"
            )
    sectors = sectors_between(point, rows, slopes, [x.direction @ frame for x in rays])
    return VertexFigure(full, full, tuple(rays), sectors, tuple(notes))


Candidate = tuple[Array, frozenset[int]]


def faces_beside(point: EvaluatedPoint, active: frozenset[int]) -> list[Ray]:
    """Return the two-dimensional faces that meet an edge, as rays across it.

    Modulo the direction of the edge they are what edges are at a corner.
    """
    rows = sorted(active)
    limit = point.quotient.tolerances.rank
    along = null_space(point.matrix(rows), limit)
    across = null_space(np.vstack([point.matrix([]), along.T]), limit)
    slopes = unit_rows(point.gradients[rows]) @ across
    if across.shape[1] == 0 or along.shape[1] != 1:
        return []
    found: list[Ray] = []
    for y, tight in _regular(point, rows, slopes):
        for base in _bases(point, rows, slopes, tight):
            ray = _tested(point, active, across @ y, base)
            if ray is not None and all(ray.active != other.active for other in found):
                found.append(ray)
    return found


def _regular(point: EvaluatedPoint, rows: list[int], slopes: Array) -> Iterator[Candidate]:
    """Yield directions in the quotient and the functions that vanish along them."""
    quotient, tolerances = point.quotient, point.quotient.tolerances
    if not quotient.polyhedron.is_union:
        for d, tight in extreme_rays(slopes, tolerances.dependent):
            yield d, frozenset(rows[k] for k in tight)
        return
    n = slopes.shape[1]
    for chosen in islice(combinations(range(len(rows)), n - 1), MAX_CANDIDATES):
        lines = Rows(slopes[list(chosen)], tolerances.rank) if chosen else None
        if lines is not None and lines.rank < n - 1:
            continue
        line = np.ones((1, 1)) if lines is None else lines.null_space
        for d in (line[:, 0], -line[:, 0]):
            along = active_along(point, rows, slopes @ d)
            if along is not None and _rank_of(point, rows, slopes, along) == n - 1:
                yield d, along


def _rank_of(point: EvaluatedPoint, rows: list[int], slopes: Array, some: frozenset[int]) -> int:
    chosen = slopes[[rows.index(i) for i in sorted(some)]]
    return rank(chosen, point.quotient.tolerances.rank)


def singular_rays(
    point: EvaluatedPoint, active: frozenset[int], notes: list[str]
) -> Iterator[Candidate]:
    """Yield the null directions that breaking one contact leaves, to second order if need be.

    Where the others still have a null plane and one relation ``sum w_i a_i = 0``, their common
    zeros are, to second order, the null directions ``d`` of ``sum w_i d' H_i d``.
    """
    rows = sorted(active)
    slopes = point.slopes(rows)
    if not _isolated(point, rows, slopes):
        notes.append(
            f"{point.quotient.written(rows)}: rank too low, and second order does not show an "
            f"isolated point"
        )
    for k in range(len(rows)):
        rest = [i for i in range(len(rows)) if i != k]
        held = Rows(slopes[rest], point.quotient.tolerances.rank)
        plane = held.null_space if rest else np.eye(slopes.shape[1])
        tight = frozenset(rows[i] for i in rest)
        if plane.shape[1] == 1:
            yield plane[:, 0], tight
            yield -plane[:, 0], tight
        elif plane.shape[1] == 2 and held.relations.shape[1] == 1:
            form = curvature(point, [rows[i] for i in rest], held.relations[:, 0], plane)
            for zero in common_zeros(form[None], 0.0) or ():
                yield plane @ zero, tight
                yield -(plane @ zero), tight
        else:
            notes.append(
                f"breaking {point.quotient.polyhedron.names[rows[k]]} leaves "
                f"{plane.shape[1]} free directions to first order: not followed"
            )


def _isolated(point: EvaluatedPoint, rows: list[int], slopes: Array) -> bool:
    """Whether second-order terms isolate the common zeros of the active functions.

    The test of prestress stability ([CW] sec. 3): along every null direction ``d`` of the
    gradients ``a_i`` some relation ``sum w_i a_i = 0`` has ``sum w_i d' H_i d`` not zero.
    It suffices that one relation is definite on the null directions: tried for those of an
    orthonormal basis.  False: not shown.
    """
    limit = point.quotient.tolerances.rank
    held = Rows(slopes, limit)
    for weights in held.relations.T:
        values = np.linalg.eigvalsh(curvature(point, rows, weights, held.null_space))
        if values[0] > limit or values[-1] < -limit:
            return True
    return False


def _bases(
    point: EvaluatedPoint, rows: list[int], slopes: Array, tight: frozenset[int]
) -> Iterator[frozenset[int]]:
    """Yield the independent subsets that may define the curve: just one where all are needed."""
    n = slopes.shape[1]
    if len(tight) <= n - 1:
        yield tight
        return
    for some in islice(combinations(sorted(tight), n - 1), MAX_BASES):
        if _rank_of(point, rows, slopes, frozenset(some)) == n - 1:
            yield frozenset(some)


def rounding(point: EvaluatedPoint) -> float:
    """Return the distance from zero, in scale units, up to which a function vanishes near a point.

    Far from the origin rounding errors of the coordinates count.
    """
    size = abs(point.q / point.quotient.scales).max()
    return max(10 * point.quotient.tolerances.rounding, RELATIVE_ROUNDING * float(size))


def _tested(
    point: EvaluatedPoint, active: frozenset[int], direction: Array, base: frozenset[int]
) -> Ray | None:
    """Return the ray if a point a little along the curve lies in the polyhedron.

    A function that opens to higher order is within the tolerance of zero near the corner: one that
    is not zero to rounding farther out does not vanish along the curve.
    """
    quotient, union = point.quotient, point.quotient.polyhedron.is_union
    scales = quotient.scales
    kept, rows = sorted(base), np.array(sorted(active.difference(base)), dtype=np.int64)
    least = 10 * quotient.tolerances.zero
    opened = np.zeros(len(rows))  # signs of the functions farther out
    farther = [h for h in quotient.options.samples if h > least]
    for h in [*(farther or [10 * least]), least]:
        sample = projected(quotient, point.q + h * scales * direction, kept, 0.5 * h)
        if sample is None:
            continue
        there, away = sample.active(), sample.distances[rows]
        opened = np.where(opened == 0, np.sign(away) * (abs(away) > rounding(point)), opened)
        if there is not None and not union:
            if there.intersection(rows[opened < 0].tolist()):
                return None
            there = there.difference(rows[opened > 0].tolist())
        if there is not None and there < active and there >= base:
            return Ray(direction, there, Sample.of(sample), h)
        if there is not None and there < active and union:
            kept_there = sample.basis(there)
            if len(kept_there) == len(kept):
                return Ray(direction, there, Sample(sample.q, tuple(kept_there), HeldPoint), h)
    return None
