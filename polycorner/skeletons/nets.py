"""Nets of points that cover a two-dimensional face.

Around every point of the net the surface is nearly flat within a radius; the net is complete when
rays from every point, up to its radius, end near another point of the net or at the boundary of the
face.  This is the continuation of implicit manifolds in several dimensions by overlapping discs
[Henderson].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.polyhedra.quotients import Quotient
from polycorner.skeletons.surfaces import Flags, Surface
from polycorner.spaces.manifold import Array
from polycorner.values import Value

RAYS = 12
LEVELS = 4
# Cosine of the angle that a normal may turn within the radius of a point.
TURN = 0.85
# Part of the radius within which a point covers others, and their height over its plane.
COVERED = 0.85
WITHIN = 1.1
HEIGHT = 0.35
FIRST = 0.5
# Longest radius as a part of the distance from the centre of a ball: rays do not pass beyond it.
BEFORE_BALLS = 0.5
GROWTH = 1.5
SHRINK = 0.7
# Longest radius as a part of a circle's circumference.
CIRCLE = 0.08
MOST = 3000
BISECTIONS = 20


class Net:
    """A growing net of points on a face.

    Attributes
    ----------
    points : (k, n) array
        The points, with frames of the tangent plane and radii in scale units.
    starts, ends : (l, n) arrays
        Points of the net, and points just outside the face where rays from them have left it.
    complete : bool
        Whether the face is covered.
    within : bool
        Whether it is covered up to the extent; looked at only ``up_to_extent``.
    """

    def __init__(
        self,
        surface: Surface,
        seeds: Array,
        extent: float = math.inf,
        levels: int = LEVELS,
        *,
        up_to_extent: bool = False,
    ) -> None:
        self.surface, self.extent, self.levels = surface, extent, levels
        n = len(surface.scales)
        circles = np.array(surface.manifold.periods) / surface.scales
        self.longest = CIRCLE * float(circles.min(initial=math.inf))
        self.points, self.frames = np.empty((0, n)), np.empty((0, n, 2))
        self.radii, self.normals = np.empty(0), np.empty((0, len(surface.held), n))
        self.where = np.empty((0, n))
        self.images = np.empty((0, n, 2))
        self.starts: Array = np.empty((0, n))
        self.ends: Array = np.empty((0, n))
        self._far, self._beyond = False, up_to_extent
        self.within = self._grow(seeds, np.full(len(seeds), min(FIRST, self.longest)))
        self.complete = self.within and not self._far

    def _grow(self, candidates: Array, radii: Array) -> bool:
        while len(candidates):
            known = len(self.points)
            if not self._add(candidates, radii) or len(self.points) > MOST:
                return False
            new = np.arange(known, len(self.points))
            moved = (self.points[new] - self.points[0]) / self.surface.scales
            far = (abs(moved) > self.extent).any(axis=1)
            self._far |= bool(far.any())
            if self._far and not self._beyond:
                return False
            candidates, radii = self._rays(new[~far])
            if np.isnan(radii).any():
                return False
        return True

    def _add(self, points: Array, radii: Array) -> bool:
        """Add those points that no other covers, one after another."""
        points, found = self.surface.projected(points)
        points, radii = points[found], radii[found]
        _, gradients = self.surface.evaluated(points)
        tangents = self.surface.tangents(points, gradients)
        if tangents is None:
            return False
        frames, images = self.surface.frames(points, tangents)
        normals = self.surface.across(gradients)
        where = self.surface.embedded(points)
        radii = np.minimum(radii, BEFORE_BALLS * self.surface.room(where))
        free = ~self.covers(where, normals)
        for k in np.flatnonzero(free):
            if not free[k]:
                continue
            one = slice(k, k + 1)
            free &= ~self._covered(
                where, normals, where[one], images[one], normals[one], radii[one]
            )
            if len(self.where) == 0:
                self.where, self.images = np.empty((0, where.shape[1])), images[:0]
            self.points = np.concatenate([self.points, points[one]])
            self.frames = np.concatenate([self.frames, frames[one]])
            self.images = np.concatenate([self.images, images[one]])
            self.normals = np.concatenate([self.normals, normals[one]])
            self.where = np.concatenate([self.where, where[one]])
            self.radii = np.concatenate([self.radii, radii[one]])
        return True

    def holds(self, q: Array) -> bool:
        """Whether a point of the surface lies on the net."""
        _, gradients = self.surface.evaluated(q[None])
        normals = self.surface.across(gradients)
        return bool(self.covers(self.surface.embedded(q[None]), normals, WITHIN)[0])

    def covers(self, where: Array, normals: Array, part: float = COVERED) -> Flags:
        """Whether embedded points with given normals lie near a point of the net."""
        if not len(self.points):
            return np.zeros(len(where), dtype=bool)
        chunks = range(0, len(where), 200)
        parts = [
            self._covered(
                where[k : k + 200], normals[k : k + 200],
                self.where, self.images, self.normals, part / COVERED * self.radii,
            )
            for k in chunks
        ]  # fmt: skip
        return np.concatenate(parts) if parts else np.zeros(0, dtype=bool)

    def _covered(
        self, p: Array, normals: Array, q: Array, images: Array, others: Array, radii: Array
    ) -> Flags:
        surface = self.surface
        apart = surface.apart(p[:, None], q[None])
        flat = np.einsum("abn,bnt->abt", apart, images)
        along = np.einsum("abt,abt->ab", flat, flat)
        height = np.einsum("abn,abn->ab", apart, apart) - along
        near = (along < (COVERED * radii) ** 2) & (height < (HEIGHT * radii) ** 2)
        if surface.quotient.symmetry.invariants is None and normals.shape[1]:
            if surface.polyhedron.normalised:
                signs = surface.manifold.factors.signs(p[:, None], q[None])
                turned = np.linalg.det(np.einsum("abn,arn,bsn->abrs", signs, normals, others))
                near &= turned > TURN - 0.15
            else:
                cosines = np.einsum("arn,brn->abr", normals, others)
                near &= (cosines > TURN - 0.15).all(axis=2)
        found: Flags = near.any(axis=1)
        return found

    def _rays(self, new: NDArray[np.intp]) -> tuple[Array, Array]:
        """Return ends of rays that nothing covers, and radii for them."""
        starts, radii = [], []
        angles = math.tau * np.arange(RAYS) / RAYS + self.levels  # any direction to begin with
        circle = np.array([np.cos(angles), np.sin(angles)])
        while len(new):
            rays = np.einsum("knt,tr->krn", self.frames[new], circle) * self.surface.scales
            levels = (np.arange(self.levels) + 1) / self.levels
            steps = self.radii[new][:, None, None, None] * levels[:, None] * rays[:, :, None]
            guess = self.points[new][:, None, None] + steps
            shape = guess.shape[:3]
            q, found = self.surface.projected(guess.reshape(-1, guess.shape[-1]))
            values, gradients = self.surface.evaluated(q)
            normals = self.surface.across(gradients)
            inside = (found & self.surface.contains(values)).reshape(shape)
            inside &= self._joined(new, values.reshape(*shape, -1))
            along = normals.reshape(len(new), RAYS * self.levels, *normals.shape[1:])
            if self.surface.polyhedron.normalised:
                cosines = np.linalg.det(np.einsum("kxrn,ksn->kxrs", along, self.normals[new]))
            else:
                cosines = np.einsum("kxrn,krn->kxr", along, self.normals[new])
                cosines = cosines.min(axis=2, initial=1.0)
            flat = (cosines > TURN).reshape(shape) & found.reshape(shape)
            reached = np.logical_and.accumulate(inside & flat, axis=2)
            # Levels up to the first outside the face must be seen without a doubt.
            before = np.logical_and.accumulate(inside, axis=2)[..., :-1]
            seen = np.concatenate([np.ones_like(before[..., :1]), before], axis=2)
            bent = (seen & ~flat).any(axis=(1, 2))
            if (self.radii[new][bent] < self.surface.quotient.options.least_patch).any():
                return np.empty((1, q.shape[1])), np.full(1, np.nan)
            self.radii[new[bent]] *= SHRINK
            good = ~bent
            q, normals = q.reshape(guess.shape), normals.reshape(*shape, *normals.shape[1:])
            whole = reached[..., -1] & good[:, None]
            starts.append(self._uncovered(q[whole][:, -1], normals[whole][:, -1]))
            length = np.broadcast_to(self.radii[new][:, None], whole.shape)[whole]
            radii.append(length)
            self._leave(new, guess, reached, good)
            new = new[bent]
        if not starts:
            return np.empty((0, self.points.shape[1])), np.empty(0)
        points = np.concatenate([p for p, _ in starts])
        found = np.concatenate([f for _, f in starts])
        allowed = np.minimum(GROWTH * np.concatenate(radii), self.longest)
        return points[found], allowed[found]

    def _joined(self, new: NDArray[np.intp], values: Array) -> Any:
        """Whether rays stay on the face between their levels: in a union they may pass a gap."""
        if not self.surface.polyhedron.is_union:
            return True
        here = self.surface.values(self.points[new])
        first = np.broadcast_to(here[:, None, None], (*values.shape[:2], 1, values.shape[-1]))
        before = np.concatenate([first, values[:, :, :-1]], axis=2)
        return self.surface.joins(before, values)

    def _uncovered(self, q: Array, normals: Array) -> tuple[Array, Flags]:
        return q, ~self.covers(self.surface.embedded(q), normals) if len(q) else np.zeros(0, bool)

    def _leave(self, new: NDArray[np.intp], guess: Array, reached: Flags, good: Flags) -> None:
        """Keep where rays leave the face, by bisection."""
        k, r = np.nonzero(~reached[..., -1] & good[:, None])
        count = reached[k, r].sum(axis=1)
        start = self.points[new][k]
        far = guess[k, r, count]
        low, high = count / (count + 1.0), np.ones(len(k))
        _, high = self.surface.leave(start, far, low, high, BISECTIONS)
        end, _ = self.surface.projected(start + high[:, None] * (far - start))
        self.starts = np.concatenate([self.starts, start])
        self.ends = np.concatenate([self.ends, end])


# ------------------------------------------------------------------------------------------ borders


@dataclass(frozen=True, eq=False)
class Tip(Value):
    """A corner of a face whose tangents there do not tell the face.

    Attributes
    ----------
    point : (n,) array
        The corner.
    near : (n,) array
        A point of the face, or of an edge around it, at a small distance.
    ways : tuple of (n,) arrays
        Scaled directions of the edges of the face there; none where it goes around.
    sampled : bool
        Whether ``near`` lies inside the face, so that it can be followed around the corner.
    pointed : bool
        Whether the gradients of the functions that vanish on the face are dependent there.
    """

    point: Array
    near: Array
    ways: tuple[Array, ...]
    sampled: bool
    pointed: bool


@dataclass(frozen=True, eq=False)
class Border(Value):
    """The boundary of a two-dimensional face.

    Attributes
    ----------
    quotient : Quotient
        The polyhedron modulo its symmetry.
    active : frozenset of int
        Functions that vanish on the face.
    seeds : (k, n) array
        Points of the face or of its boundary.
    edges : tuple of (frozenset of int, (k, n) array, bool)
        Active functions and points of every edge around it, and whether it closes by itself.
    corners : tuple of pairs of (frozenset of int, (2, n) array)
        For every corner of the face and both of its edges there, the active functions, and a point
        of the edge with the direction away from the corner.
    curves : int
        Number of boundary curves, without those that are one point.
    tips : tuple of Tip
        Corners that are not told by tangents.
    """

    quotient: Quotient
    active: frozenset[int]
    seeds: Array
    edges: tuple[tuple[frozenset[int], Array, bool], ...]
    corners: tuple[tuple[tuple[frozenset[int], Array], tuple[frozenset[int], Array]], ...]
    curves: int
    tips: tuple[Tip, ...] = ()


def balls_about(tips: Sequence[Tip]) -> list[tuple[Array, Array]]:
    """Return centres of balls about tips, and points outside them."""
    return [(tip.point, tip.near) for tip in tips]


def seeds_of(edges: Sequence[Array]) -> Array:
    """Return points of edges that a net starts from."""
    return np.concatenate([points[1:-1][:: max(1, len(points) // 40)] for points in edges])
