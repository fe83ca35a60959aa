"""Walks to saddles and down to minima on faces of a polyhedron, many points at a time, in doubles.

A step is one of Newton's method for the Lagrangian on the face of the contacts that are closed,
with the signs of its curvatures chosen: uphill along the softest directions, downhill along the
others ([CM]).  Where no curvature is negative yet, a walk to a saddle is pushed along
and relaxed across its way.  A wall that is met is closed, and a contact is opened if its
multiplier is negative and the step without it leads inward.  Directions of a symmetry are left
out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.problem import Problem
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

Mask = NDArray[np.bool_]
Numbers = NDArray[np.intp]
Aim = TypeVar("Aim", bound=tuple[NDArray[Any], ...])  # steps, and what belongs to them
Orbits = Callable[[Array], Array]  # of points (B, n): scaled tangent vectors (B, g, n)
STRIDE = 0.2  # longest step of a walk uphill at most, in scale units
FALL = 0.1  # the same downhill, where a longer one may miss a basin
PUSH = 0.5  # length of a step where no curvature is negative, over the longest
LOST = 0.1  # part of a way that lies along the face, below which another one is taken
CLIMBS = 120  # steps of a walk uphill, at most
FALLS = 400
PLACED = 3  # corrections of a step downhill
ACROSS = 2.0  # what stands for curvatures across the face, over the norm of the Hessian


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """Second-order models of the energy on faces at points, in scaled coordinates.

    Attributes
    ----------
    values : (B, m) array
        Of the inequalities.
    slopes : (B, m, n) array
        Their gradients.
    energy : (B,) array
    held : (B, m) array
        Multipliers of the closed contacts as of unit gradients, 0 for the others.
    back : (B, n) array
        The shortest step onto the face.
    along : (B, n, n) array
        Projections onto the tangent space of the face, without orbits.
    curvatures, ways : (B, n), (B, n, n) arrays
        Eigenvalues of the Lagrangian's Hessian, those along the face first, and its eigenvectors
        as columns.
    pulls : (B, n) array
        The energy's derivatives along these.
    flat : (B,) array
        The size up to which a curvature counts as zero.
    """

    values: Array
    slopes: Array
    energy: Array
    held: Array
    back: Array
    along: Array
    curvatures: Array
    ways: Array
    pulls: Array
    flat: Array


@dataclass(frozen=True, eq=False)
class Walks:
    """What walks need to know of a problem."""

    problem: Problem
    orbits: Orbits
    tolerances: Tolerances

    def model(self, q: Array, closed: Mask) -> tuple[Numbers, QuadraticModel]:
        """Return models at points with some contacts closed, and at which points there is one."""
        problem, m = self.problem, self.problem.inequalities
        values, slopes, bends = problem.evaluate(q, 2)
        fine = np.isfinite(values[:, -1]) & np.isfinite(slopes[:, -1]).all(axis=1)
        fine &= np.isfinite(bends).all(axis=(1, 2, 3)) & np.isfinite(slopes).all(axis=(1, 2))
        some = np.flatnonzero(fine)
        q, values, slopes, bends = q[some], values[some], slopes[some], bends[some]
        held = _first(closed[some], problem.rows - 1)
        rows, every = np.take_along_axis(slopes, held[:, :, None], 1), np.arange(len(some))
        filled = held < 0
        rows[filled] = 0.0
        sizes = np.linalg.norm(rows, axis=2)
        sizes[sizes == 0] = 1.0
        turned = self.orbits(q) if len(q) else np.zeros((0, 0, q.shape[1]))
        lengths = np.linalg.norm(turned, axis=2, keepdims=True)
        units = np.concatenate([rows / sizes[:, :, None], turned / np.maximum(lengths, 1e-300)], 1)
        left = np.linalg.pinv(units, rcond=self.tolerances.rank)
        k, pull = rows.shape[1], slopes[:, -1]
        shares = np.einsum("bi,bik->bk", pull, left)[:, :k]
        bent = bends[:, -1].copy()
        for j in range(k):
            bent -= (shares[:, j] / sizes[:, j])[:, None, None] * bends[every, held[:, j]]
        across = left @ units
        along = np.eye(q.shape[1]) - across
        inner = along @ bent @ along
        size = np.linalg.norm(bent, axis=(1, 2))
        stiff = ACROSS * np.where(size > 0, size, 1.0)
        inner = 0.5 * (inner + inner.transpose(0, 2, 1)) + stiff[:, None, None] * across
        curvatures, ways = np.linalg.eigh(inner)
        multipliers = np.zeros((len(some), problem.rows))
        np.put_along_axis(multipliers, held, shares, axis=1)
        return some, QuadraticModel(
            values=values[:, :m],
            slopes=slopes[:, :m],
            energy=values[:, -1],
            held=multipliers[:, :m],
            back=-np.einsum(
                "bik,bk->bi", left[:, :, :k], np.take_along_axis(values, held, 1) / sizes
            ),
            along=along,
            curvatures=curvatures,
            ways=ways,
            pulls=np.einsum("bin,bij,bj->bn", ways, along, pull),
            flat=self.tolerances.curvature * stiff,
        )

    def climb(
        self,
        q: Array,
        allowed: Mask,
        closed: Mask,
        way: Array,
        rising: Numbers,
        longest: Array,
    ) -> tuple[Array, Mask, Mask]:
        """Walk to stationary points with negative curvatures along the face.

        Parameters
        ----------
        q : (B, n) array
        allowed : (B, m) array of bool
            Inequalities that hold on the branch of each walk.
        closed : (B, m) array of bool
            Contacts that are closed at the start.
        way : (B, n) array
            Where to go while the curvatures are positive, in scaled coordinates.
        rising : (B,) array of int
            How many curvatures are to be negative at the end.
        longest : (B,) array
            The longest step of each walk: barriers that are narrower are missed.

        Returns
        -------
        points, closed, found
            Ends of walks, contacts closed there, and which of the walks have settled.
        """
        q, closed, way = q.copy(), closed.copy(), way.copy()
        found = np.zeros(len(q), dtype=np.bool_)
        going = np.arange(len(q))
        for _ in range(CLIMBS):
            closed[going] |= self._missed(q[going], allowed[going])
            some, model = self.model(q[going], closed[going])
            going = going[some]
            aims = _uphill(model, way[going], rising[going], longest[going])
            step, new, up = self._freed(
                model,
                q[going],
                closed,
                going,
                aims,
                lambda m, k: _uphill(m, way[k], rising[k], longest[k]),
            )
            part, met = _reach(model, step, allowed[going] & ~closed[going])
            closed[going] |= met
            step *= part[:, None]
            way[going] = new
            q[going] += step * self.problem.scales
            length = abs(step).max(axis=1, initial=0.0)
            done = up & (part == 1) & (length < self.tolerances.settled)
            found[going[done]] = True
            going = going[~done & np.isfinite(new).all(axis=1)]
            if not going.size:
                break
        return q, closed, found

    def fall(self, q: Array, allowed: Mask, closed: Mask) -> tuple[list[Array], Mask, Mask]:
        """Walk down in short steps, each of which is lower than the one before.

        Parameters
        ----------
        q, allowed, closed
            As of :meth:`climb`.

        Returns
        -------
        paths : list of (k, n) arrays
            The points of each walk.
        closed : (B, m) array of bool
        found : (B,) array of bool
            Which of the walks have settled.
        """
        q, closed = q.copy(), closed.copy()
        found, longest = np.zeros(len(q), dtype=np.bool_), np.full(len(q), FALL)
        paths, going = [[x.copy()] for x in q], np.arange(len(q))
        for _ in range(FALLS):
            some, model = self.model(q[going], closed[going])
            going = going[some]
            aims = _downhill(model, longest[going])
            step = self._freed(
                model, q[going], closed, going, aims, lambda m, k: _downhill(m, longest[k])
            )[0]
            part, met = _reach(model, step, allowed[going] & ~closed[going])
            step *= part[:, None]
            ahead = q[going] + step * self.problem.scales
            reached, ahead = self.placed(ahead, allowed[going], closed[going] | met)
            energy = self.problem.energy.value(ahead)
            # Contacts are closed up to a tolerance, at the price of their multipliers.
            noise = self.tolerances.rounding * abs(model.energy)
            pull = abs(model.held).sum(axis=1) + abs(model.pulls).sum(axis=1)
            noise += self.tolerances.zero * pull
            length = abs(step).max(axis=1, initial=0.0)
            done = (part == 1) & (length < self.tolerances.settled)
            with np.errstate(invalid="ignore"):
                lower = done | (reached & (energy <= model.energy + noise))
            q[going[lower]], closed[going[lower]] = ahead[lower], closed[going[lower]] | met[lower]
            for k in going[lower]:
                paths[k].append(q[k].copy())
            longest[going] = np.where(lower, np.minimum(FALL, 2 * longest[going]), length / 2)
            found[going[done]] = True
            going = going[~done & (longest[going] > self.tolerances.settled)]
            if not going.size:
                break
        return [np.array(path) for path in paths], closed, found

    def placed(self, q: Array, allowed: Mask, closed: Mask) -> tuple[Mask, Array]:
        """Move points onto their contacts and into the set; return where that succeeds."""
        m, zero, q = self.problem.inequalities, self.tolerances.zero, q.copy()
        for _ in range(PLACED):
            held = closed | self._missed(q, allowed)
            bound = held.any(axis=1) | (self.problem.rows - 1 > m)
            which = np.flatnonzero(bound)
            if not which.size:
                break
            some, model = self.model(q[which], held[which])
            q[which[some]] += model.back * self.problem.scales
        values, slopes = self.problem.evaluate(q, 1)
        sizes = np.linalg.norm(slopes[:, :-1], axis=2)
        with np.errstate(invalid="ignore"):
            inside = (values[:, :m] >= -zero * sizes[:, :m]) | ~allowed
            held = abs(values[:, m:-1]) <= zero * sizes[:, m:]
        return inside.all(axis=1) & held.all(axis=1), q

    def _freed(
        self,
        model: QuadraticModel,
        q: Array,
        closed: Mask,
        going: Numbers,
        aims: Aim,
        aim: Callable[[QuadraticModel, Numbers], Aim],
    ) -> Aim:
        """Open a contact of each walk where its multiplier is negative and the step leads inward.

        Changed are ``closed`` and the aims of those walks, which are returned.
        """
        opened = self._opened(model, closed[going])
        tried = np.flatnonzero(opened >= 0)
        less = closed[going[tried]]
        less[np.arange(len(tried)), opened[tried]] = False
        if tried.size:
            some, other = self.model(q[tried], less)
            tried, less = tried[some], less[some]
            freed = aim(other, going[tried])
            rows = other.slopes[np.arange(len(tried)), opened[tried]]
            inward = np.einsum("bn,bn->b", rows, freed[0]) > 0
            for old, new in zip(aims, freed, strict=True):
                old[tried[inward]] = new[inward]
            closed[going[tried[inward]]] = less[inward]
        return aims

    def _missed(self, q: Array, allowed: Mask) -> Mask:
        """Return which of the allowed functions are violated."""
        values, slopes = self.problem.evaluate(q, 1)
        m = self.problem.inequalities
        sizes = np.linalg.norm(slopes[:, :m], axis=2)
        with np.errstate(invalid="ignore"):
            return np.asarray(allowed & (values[:, :m] < -self.tolerances.zero * sizes))

    def _opened(self, model: QuadraticModel, closed: Mask) -> Numbers:
        """Return the contact of the most negative multiplier at each point, -1 where none is."""
        if not closed.shape[1]:
            return np.full(len(closed), -1)
        small = self.tolerances.stationary * abs(model.held).max(axis=1, initial=0.0)
        least = np.where(closed, model.held, 0.0)
        k = least.argmin(axis=1)
        return np.where(least[np.arange(len(k)), k] < -small, k, -1)


def _first(closed: Mask, rows: int) -> Numbers:
    """Return the rows of closed contacts and of all equations at each point, filled up by -1."""
    counts, m = closed.sum(axis=1), closed.shape[1]
    most = int(counts.max(initial=0))
    first = np.argsort(~closed, axis=1, kind="stable")[:, :most]
    first[np.arange(most) >= counts[:, None]] = -1
    return np.hstack([first, np.broadcast_to(np.arange(m, rows), (len(closed), rows - m))])


def _uphill(
    model: QuadraticModel, way: Array, rising: Numbers, longest: Array
) -> tuple[Array, Array, Mask]:
    """Return steps, the ways to go on along (NaN for none), and where curvatures are negative."""
    w, every = model.curvatures, np.arange(len(way))
    firm = abs(w) > model.flat[:, None]
    moves = np.where(firm, -model.pulls / np.where(firm, abs(w), 1.0), 0.0)
    up = w[every, rising - 1] < -model.flat
    moves[up[:, None] & (np.arange(w.shape[1]) < rising[:, None])] *= -1
    step = np.einsum("bij,bj->bi", model.ways, moves)
    # Of a curvature that is negative the way is the softest direction, upward.
    soft = model.ways[:, :, 0] * np.where(moves[:, 0] < 0, -1.0, 1.0)[:, None]
    pushed = np.einsum("bij,bj->bi", model.along, way)
    size = np.linalg.norm(pushed, axis=1)
    lost = size < LOST * np.linalg.norm(way, axis=1)
    pushed[lost] = np.einsum("bij,bj->bi", model.along[lost], soft[lost])
    size[lost] = np.linalg.norm(pushed[lost], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        pushed = np.where(size[:, None] > LOST, pushed / size[:, None], np.nan)
    across = step - np.einsum("bi,bi->b", step, pushed)[:, None] * pushed
    step = np.where(up[:, None], step, _limited(across, longest) + PUSH * longest[:, None] * pushed)
    step = _limited(step, longest) + _limited(model.back, STRIDE)
    new = np.where(up[:, None], soft, pushed)
    return np.where(np.isfinite(step), step, 0.0), new, up


def _downhill(model: QuadraticModel, longest: Array) -> tuple[Array, ...]:
    """Return steps downhill; where nothing is curved, along the gradient."""
    curved = np.maximum(abs(model.curvatures), model.flat[:, None])
    step = np.einsum("bij,bj->bi", model.ways, -model.pulls / curved)
    return (_limited(step, longest) + _limited(model.back, FALL),)


def _limited(step: Array, longest: float | Array) -> Array:
    size: Array = np.linalg.norm(step, axis=1)
    return step * np.minimum(1.0, longest / np.maximum(size, 1e-300))[:, None]


def _reach(model: QuadraticModel, step: Array, open_: Mask) -> tuple[Array, Mask]:
    """Return the part of each step up to the first wall, and the walls that are met there."""
    rates = np.einsum("bmn,bn->bm", model.slopes, step)
    hits = open_ & (model.values + rates < 0) & (rates < 0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        parts = np.where(hits, np.maximum(model.values, 0.0) / -rates, np.inf)
    part = np.minimum(1.0, parts.min(axis=1, initial=np.inf))
    return part, hits & (parts <= part[:, None])
