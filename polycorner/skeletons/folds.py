"""Folds: corners where the gradients of the functions that vanish have just one relation.

Let ``f_1, ..., f_m`` be these functions, ``sum w_i grad f_i = 0`` the relation, ``d_1, ..., d_F``
a basis of the *flaps*, the directions along which all their slopes vanish, in the quotient, and
``Q`` the quadratic form ``sum w_i v' H_i v / 2``.  If ``Q`` is definite on the flaps, say positive,
then the values ``y_i`` of ``f_i`` and coordinates ``t`` along the flaps satisfy, to leading order,

    sum w_i y_i = Q(t) + sum S_kl y_k y_l,

the sum on the right over the functions with ``w_k = w_l = 0``, and the set ``y >= 0`` is folded
along ``w . y = 0`` ([AGV] sec. 1).  Where every ``S_kk`` is at least zero, for one flap:

| functions that open | signs of their weights | what leaves the corner |
|---|---|---|
| ``k`` | + | an edge for each sign of ``t`` |
| ``k`` | 0, ``S_kk = 0`` | a dependent edge: ``t = 0``, and the relation persists along it |
| ``k, l`` | 0, 0, ``S_kl = -sqrt(S_kk S_ll) < 0`` | a dependent edge along which both open |
| ``j, k`` | +, + | for each sign of ``t`` a face between the edges of ``j`` and ``k`` |
| ``j, k`` | +, 0, ``S_kk = 0`` | the same, between an edge of ``j`` and that of ``k`` |
| ``j, k`` | +, another | a face between the two edges of ``j`` |
| ``k, l`` | 0, 0, ``S_kk = S_ll = 0 > S_kl`` | two faces between their edges |
| ``k, l`` | 0, 0, ``S_kk = 0 < S_ll``, ``S_kl < 0`` | a face around the edge of ``k`` |
| ``k, l`` | 0, 0, ``S_kl < -sqrt(S_kk S_ll) < 0`` | a face around the corner, with no edge |

On the functions ``T`` of weight zero let ``S`` be positive semidefinite.  A ray ``u >= 0`` on which
it vanishes is a dependent edge if no other ray on which it does opens only functions of its own:
with one function or two these are the edges above, and with three the null vector has to be
positive.  Where ``T`` is what opens along two of these edges ``u`` and ``v``, and along no other
one, and ``u' S v = 0``, a dependent face along which all of ``T`` open lies between them.

Equality is decided to second order.  A dependent edge that would be none to third order is none if
the sum stays positive there, and noted otherwise.  With two flaps, opening a function of positive
weight leaves a face around the corner, and with more a larger one; and so does opening one with
``S_kk < 0``, on a cone.  So a corner with several flaps is an end of dependent edges only.
Clusters of spheres that are rigid to second order only are of these kinds, and circles that touch.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from polycorner.polyhedra.cones import Rows
from polycorner.polyhedra.faces import projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Sample
from polycorner.skeletons.dependence import curvature, dependent_at
from polycorner.skeletons.vertex_figures import Ray, Sector, VertexFigure
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

# Parts of the distances at which dependent edges are looked for as well: some of them are short.
PARTS = (1.0, 0.1, 0.01)

# Functions that open along an edge, and the sign of ``t`` there.
Opening = tuple[int, ...]
Ends = tuple[Opening, int]


def fold_figure(
    point: EvaluatedPoint,
    active: frozenset[int],
    rank: int,
    full: int,
    distances: tuple[float, ...] | None = None,
) -> VertexFigure | None:
    """Return the rays and sectors at a fold; None where the corner is none, or not clearly.

    The rank is that of the active gradients in the quotient, whose dimension is ``full``; edges are
    looked for at the given distances, in scale units, by default those of the options.
    """
    if point.quotient.polyhedron.is_union or len(active) != rank + 1 or rank == full:
        return None
    fold = _Fold(point, sorted(active))
    if not fold.is_definite:
        return None
    for distance in distances or point.quotient.options.distances:
        rays = fold.rays(distance)
        if rays is not None:
            return VertexFigure(rank, full, *fold.figure(rays, distance))
    return None


class _Fold:
    """The weights of a relation, flaps and the form ``S``; functions by position in ``rows``.

    The sign is such that the form is positive on the flaps.
    """

    def __init__(self, point: EvaluatedPoint, rows: list[int]) -> None:
        self.point, self.rows = point, rows
        self.scales = point.quotient.scales
        # Distance of held functions from zero up to which a relation persists.
        self.limit, self.persists = point.quotient.tolerances.rank, point.quotient.tolerances.held
        frame = point.frame
        held = Rows(point.slopes(rows), self.limit)
        weights = held.relations[:, 0]
        weights = np.where(abs(weights) > self.limit, weights, 0.0)
        self.free = np.flatnonzero(weights == 0).tolist()
        self.flaps = (frame @ held.null_space).T
        self.openings = np.array([frame @ held.opening(k) for k in self.free])
        ways = np.array([*held.null_space.T, *map(held.opening, self.free)])
        self.form = curvature(point, rows, weights, ways.reshape(-1, frame.shape[1]).T)
        sign = np.sign(self.form[0, 0])
        self.weights, self.form = weights * sign, self.form * sign
        self.positive = np.flatnonzero(self.weights > 0).tolist()

    @cached_property
    def cross(self) -> Array:
        """The form ``S`` on the functions of weight zero."""
        f = len(self.flaps)
        flaps, mixed = self.form[:f, :f], self.form[:f, f:]
        return np.asarray(self.form[f:, f:] - mixed.T @ np.linalg.solve(flaps, mixed))

    @property
    def is_definite(self) -> bool:
        """Whether ``Q`` is positive on the flaps, and no ``S_kk`` negative if there is one flap."""
        f = len(self.flaps)
        values = np.linalg.eigvalsh(self.form[:f, :f])
        # At a cusp, which is known less exactly, a zero eigenvalue is not seen as zero.
        least = self.point.quotient.options.definite * values[-1]
        clear = values[0] > max(self.limit, least)
        return bool(clear and (f > 1 or (np.diagonal(self.cross) >= -self.limit).all()))

    @cached_property
    def dependent(self) -> list[Opening]:
        """What opens along dependent edges."""
        own = np.diagonal(self.cross)
        single = [(k,) for k, s in zip(self.free, own, strict=True) if abs(s) <= self.limit]
        found = [*single, *self.pairs]
        return [*found, *(some for some in combinations(self.free, 3) if self._null(some, found))]

    def _null(self, some: Opening, known: list[Opening]) -> bool:
        """Whether the form on some functions is semidefinite, with one null vector, positive."""
        if any(set(opening) <= set(some) for opening in known):
            return False
        values, axes = np.linalg.eigh(self._form_of(some))
        null = axes[:, 0] * np.sign(axes[0, 0])
        single = abs(values[0]) <= self.limit < values[1]
        return bool(single and null.min() > self.limit)

    def _form_of(self, some: Opening) -> Array:
        """Return the form ``S`` on some functions of weight zero."""
        at = [self.free.index(k) for k in some]
        return np.asarray(self.cross[np.ix_(at, at)])

    @property
    def pairs(self) -> list[Opening]:
        """Pairs that open along dependent edges."""
        return [pair for pair, excess in self._pairs() if excess <= self.limit]

    @property
    def thin(self) -> list[Opening]:
        """Pairs that open on a face around the corner."""
        return [pair for pair, excess in self._pairs() if excess > self.limit]

    def _pairs(self) -> Iterator[tuple[Opening, float]]:
        """Yield pairs with ``S_kl <= -sqrt(S_kk S_ll) < 0``, and the difference."""
        own = np.diagonal(self.cross)
        for i, j in combinations(np.flatnonzero(own > self.limit).tolist(), 2):
            excess = float(-self.cross[i, j] - np.sqrt(own[i] * own[j]))
            if excess >= -self.limit:
                yield (self.free[i], self.free[j]), excess

    def rays(self, distance: float) -> dict[Ends, Ray] | None:
        """Return rays by what opens and the sign of ``t``; None if one is not found."""
        found: dict[Ends, Ray] = {}
        for k in self.positive if len(self.flaps) == 1 else ():
            for side in (1, -1):
                ray = self._bent_ray(k, side * self.flaps[0], distance)
                if ray is None:
                    return None
                found[(k,), side] = ray
        for opening in tuple(self.dependent):
            ray, rest = self._nearest_dependent(opening, distance)
            if ray is not None:
                found[opening, 0] = ray
            elif rest > self.persists:
                self.dependent.remove(opening)
        return found

    def _without(self, opening: Opening) -> frozenset[int]:
        return frozenset(self.rows).difference(self.rows[k] for k in opening)

    def _ordered(self, opening: Opening) -> tuple[int, ...]:
        return tuple(sorted(self._without(opening)))

    def _bent_ray(self, k: int, way: Array, distance: float) -> Ray | None:
        point, held = self.point, self._without((k,))
        q = point.q + distance * self.scales * way
        sample = projected(point.quotient, q, sorted(held), distance / 2)
        if sample is None or sample.active() != held:
            return None
        return Ray(way, held, Sample.of(sample), distance)

    def _nearest_dependent(self, opening: Opening, distance: float) -> tuple[Ray | None, float]:
        """Return what :meth:`_dependent_ray` does, at a part of the distance if need be."""
        for part in PARTS:
            ray, rest = self._dependent_ray(opening, part * distance)
            if ray is not None or rest > self.persists:
                break
        return ray, rest

    def _dependent_ray(self, opening: Opening, distance: float) -> tuple[Ray | None, float]:
        """Return the ray of a dependent edge, or None, and what the weighted sum is along it."""
        point, held = self.point, self._without(opening)
        found = dependent_at(point, held)
        if found is None:
            return None, 0.0
        start, way = found
        slopes = point.gradients[[self.rows[k] for k in opening]] @ way
        q = point.q + distance * self.scales * way * np.sign(slopes[0])
        sample = projected(start.quotient, q, start.kept, distance / 2)
        if sample is None or (slopes * slopes[0] <= 0).any():
            return None, 0.0
        away = sample.distances[self.rows] * [row in held for row in self.rows]
        rest = float(self.weights @ away)
        placed = dependent_at(point.quotient.at(sample.q), held)
        if abs(away).max() > self.persists or sample.active() != held or placed is None:
            return None, rest
        there = Sample.of(placed[0])
        return Ray(way * np.sign(slopes[0]), held, there, distance, dependent=True), rest

    # ------------------------------------------------------------------------------------- sectors

    def figure(
        self, rays: dict[Ends, Ray], distance: float
    ) -> tuple[tuple[Ray, ...], tuple[Sector, ...], tuple[str, ...]]:
        """Return rays, sectors and notes."""
        place = {key: i for i, key in enumerate(rays)}
        faces = [(pair, e) for pair in combinations(range(len(self.rows)), 2)
                 for e in self._faces(pair)]  # fmt: skip
        sectors = [
            Sector(tuple(place[end] for end in ends), self._ordered(opening))
            for opening, ends in (*faces, *self._dependent_faces())
            if all(end in place for end in ends)
        ]
        if len(self.flaps) == 2:
            sectors += [self._around(k, self.flaps[0], distance) for k in self.positive]
            sectors += [self._around(k, way, distance) for k, way in self._cones()]
        if len(self.flaps) == 1:
            sectors += [Sector((), self._ordered(pair)) for pair in self.thin]
        return tuple(rays.values()), tuple(sectors), tuple(self._notes(rays))

    def _faces(self, pair: Opening) -> Iterator[tuple[Ends, ...]]:
        """Yield, for the faces on which two functions open, the rays that bound them."""
        j, k = sorted(pair, key=lambda i: (i not in self.positive, (i,) not in self.dependent))
        straight = [(i,) in self.dependent for i in (j, k)]
        single = len(self.flaps) == 1
        if j in self.positive and single:
            if k in self.positive:
                yield from ((((j,), side), ((k,), side)) for side in (1, -1))
            elif straight[1]:
                yield from ((((j,), side), ((k,), 0)) for side in (1, -1))
            else:
                yield ((j,), 1), ((j,), -1)
        elif straight[0] and self.weights[k] == 0:
            mixed = self.cross[self.free.index(j), self.free.index(k)]
            ends = ((j,), 0), ((k,) if straight[1] else (j,), 0)
            if mixed < -self.limit and single:
                yield from (ends,) * (1 + straight[1])

    def _dependent_faces(self) -> Iterator[tuple[Opening, tuple[Ends, ...]]]:
        """Yield what opens along dependent faces, and the edges that bound them."""
        for one, other in combinations(self.dependent, 2):
            some = tuple(sorted({*one, *other}))
            form, form_one, form_other = (self._form_of(part) for part in (some, one, other))
            if sum(set(opening) <= set(some) for opening in self.dependent) > 2:
                continue
            u, v = np.zeros((2, len(some)))
            for y, part, own in ((u, one, form_one), (v, other, form_other)):
                y[[some.index(k) for k in part]] = abs(np.linalg.eigh(own)[1][:, 0])
            values = np.linalg.eigvalsh(form)
            if values[0] >= -self.limit and abs(u @ form @ v) <= self.limit:
                yield some, ((one, 0), (other, 0))

    def _cones(self) -> Iterator[tuple[int, Array]]:
        """Yield functions with ``S_kk < 0``, which open on a cone, and a direction on it."""
        f = len(self.flaps)
        for i, k in enumerate(self.free):
            if self.cross[i, i] < -self.limit:
                t = -np.linalg.solve(self.form[:f, :f], self.form[:f, f + i])
                t[0] += np.sqrt(-self.cross[i, i] / self.form[0, 0])
                way = self.openings[i] + t @ self.flaps
                yield k, way / np.linalg.norm(way)

    def _around(self, k: int, way: Array, distance: float) -> Sector:
        """Return a face around the corner, which goes on in a direction."""
        held = self._ordered((k,))
        q = self.point.q + distance * self.scales * way
        there = projected(self.point.quotient, q, held, distance / 2)
        return Sector((), held, None if there is None else Sample.of(there))

    def _notes(self, rays: dict[Ends, Ray]) -> Iterator[str]:
        written = self.point.quotient.written
        for opening in self.dependent:
            if (opening, 0) not in rays:
                yield (
                    f"the edge that opens {written(self.rows[k] for k in opening)} out of "
                    f"the singular corner {written(self.rows)} has dependent gradients: "
                    f"not followed"
                )
