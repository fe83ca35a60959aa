"""Descents from passes to minima, inside the set, as verified routes.

A route begins on a curve that is shown to go down from the pass (:mod:`.curves`).  From its end it
goes on by steps that are guessed in floating point and verified one by one: a convex quadratic
model of the energy, with the Lagrangian's Hessian made positive, is minimised subject to linearised
inequalities that keep a margin from all walls.  The margin is a small part of what the energy has
fallen, so that the route stays below the pass along walls as well; a wall may curve by as much as
the margin.  A route ends with a straight piece to a point a little above a minimum, which a curve
from the minimum reaches.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise

import numpy as np
from scipy.optimize import nnls

from polycorner.intervals.balls import Ball, ball, precision
from polycorner.landscapes.components import Component
from polycorner.landscapes.curves import BITS, Curves, Spot, above, under
from polycorner.landscapes.routes import Route
from polycorner.polyhedra.cones import least_distance
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Value


@dataclass(frozen=True)
class DescentOptions:
    """Steps of a descent, in scale units of the manifold.

    Attributes
    ----------
    first, least : float
        Lengths of the first curve from a pass, the longest and the shortest that are tried.
    longest : float
        Longest straight piece.
    margin : float
        Largest margin from walls.
    spent : float
        Part of what the energy has fallen that margins may cost.
    most : int
        Steps.
    stalled : float
        Part of the longest step allowed, below which a descent is at rest.
    stiff : float
        Least curvature of the model, over the largest, or over the pull by the longest step.
    """

    first: float = 0.1
    least: float = 1e-7
    longest: float = 0.3
    margin: float = 0.02
    spent: float = 0.1
    most: int = 600
    stalled: float = 1e-3
    stiff: float = 1e-6


@dataclass(frozen=True, eq=False)
class Target(Value):
    """A minimum, and points above it from which a way down to it is verified.

    Attributes
    ----------
    spot : Spot
    energy : float
        An upper bound.
    lifted : tuple of Spot
        The ends of curves from the minimum, the highest first.
    part : Component or None
        The component of a locus, along which the energy is the same.
    """

    spot: Spot
    energy: float
    lifted: tuple[Spot, ...]
    part: Component | None = None

    @property
    def along(self) -> list[int]:
        """Coordinates that may have several values."""
        return list(self.part.free) if self.part else []


class Descents:
    """Descents to some minima of a problem; ``free`` are the coordinates that may change."""

    def __init__(self, curves: Curves, free: Sequence[int]) -> None:
        self.curves, self.options = curves, DescentOptions()
        self.problem = curves.problem
        self.free = np.zeros(self.problem.dimension, dtype=np.bool_)
        self.free[list(free)] = True
        self.scales = self.problem.scales
        self.manifold = self.problem.polyhedron.manifold

    # ------------------------------------------------------------------------------------- minima

    def target(self, spot: Spot, part: Component | None = None) -> Target:
        """Return a minimum with points above it."""
        with precision(BITS):
            energy = self.curves.value(spot.box)
            top = above(energy)
        lifted: list[Spot] = []
        if spot.zeros:
            into = self.into(spot.middle, spot.zeros)
            tried = (self._lift(spot, into, h) for h in self._lengths(6) if into is not None)
            lifted = list(islice((end for end in tried if end is not None), 4))
        elif all(float(x.rad()) <= off for x, off in zip(spot.box, self.curves.off, strict=True)):
            lifted = [replace(spot, top=top)]
        return Target(spot, top, tuple(lifted), part)

    def _lengths(self, ratio: float) -> Iterator[float]:
        """Yield lengths that are tried, the longest first."""
        length = self.options.first
        while length > self.options.least:
            yield length
            length /= ratio

    def _lift(self, spot: Spot, into: Array, length: float) -> Spot | None:
        """Return the end of a curve into the set, off all walls, whatever the energy does."""
        with precision(BITS):
            high = ball(float("inf"))
        return self.curves.curve(
            spot, frozenset(), into * self.scales, length, rising=spot.zeros, ceiling=high
        )

    def into(self, q: Array, zeros: frozenset[int]) -> Array | None:
        """Return a unit vector along which functions that vanish grow at equal rates, if any.

        Along the equations, in scaled coordinates.
        """
        slopes = self.problem.evaluate(q, 1)[1]
        held, rows = slopes[sorted(zeros)], slopes[list(self.curves.equations)]
        sizes = np.linalg.norm(held, axis=1)
        if not np.isfinite(held).all() or (sizes == 0).any():
            return None
        both = np.vstack([held / sizes[:, None], rows]) * self.free
        right = np.concatenate([np.ones(len(held)), np.zeros(len(rows))])
        found = np.linalg.lstsq(both, right, rcond=None)[0] * self.free
        # More functions than can be independent: any vector along which all of them grow.
        if len(held) and not (both[: len(held)] @ found > 0.1).all():
            found = _least_norm(
                np.eye(len(q)),
                np.zeros(len(q)),
                both[: len(held)],
                np.ones(len(held)),
                rows * self.free,
                np.zeros(len(rows)),
            )
            if found is None:
                return None
            found = found * self.free
        size = np.linalg.norm(found)
        return None if not size > 0 else np.asarray(found / size)

    # ------------------------------------------------------------------------------------- routes

    def begin(self, start: Spot, held: frozenset[int], along: Array) -> list[Spot]:
        """Return points on the way down from a KKT point of index 1, off all walls at last.

        Empty if none is verified.  ``along`` is a direction of negative curvature, scaled.
        """
        for length in self._lengths(3):
            end = self.curves.curve(start, held, along * self.scales, length, bent=True)
            if end is not None:
                if not (held or self.curves.equations):
                    return [end]
                with precision(BITS):
                    ceiling = self.curves.value(start.box).lower()
                off = self._off(end, held, ceiling)
                if off is not None:
                    return [end, off]
        return []

    def _off(self, spot: Spot, zeros: frozenset[int], ceiling: "Ball") -> Spot | None:
        """Return a point off the walls, below a ceiling."""
        if not zeros:
            return spot
        into = self.into(spot.middle, zeros)
        if into is None:
            return None
        gradient = self.problem.evaluate(spot.middle, 1)[1][-1]
        with precision(BITS):
            budget = float((ceiling - self.curves.value(spot.box)).lower())
        climb = float(gradient @ into)
        length = self.options.margin
        if climb > 0:
            length = min(length, 2 * self.options.spent * budget / climb)
        for _ in range(6):
            if length <= 0:
                return None
            end = self.curves.curve(
                spot, frozenset(), into * self.scales, length, rising=zeros, ceiling=ceiling
            )
            if end is not None:
                return end
            length /= 4
        return None

    def fall(self, start: Spot, rising: frozenset[int], along: Array) -> list[Spot]:
        """Return a point on the way down from a tip, along a direction of descent, scaled."""
        for length in self._lengths(3):
            end = self.curves.curve(start, frozenset(), along * self.scales, length, rising=rising)
            if end is not None:
                return [end]
        return []

    def route(
        self, begun: Sequence[Spot], start: Spot, targets: Sequence[Target]
    ) -> tuple[int, Route] | None:
        """Return the minimum that a descent ends in, by its number, and the way; None if none.

        The first points of the way have begun at the pass ``start``, below which it has to stay,
        and the last of them is off all walls.
        """
        with precision(BITS):
            height = self.curves.value(start.box)
            ceiling, top = height.lower(), above(height)
            below = under(height)
        points = [start.middle, *(spot.middle for spot in begun)]
        q, step = begun[-1].middle, self.options.first
        rng, stalled = np.random.default_rng(0), 0
        for count in range(self.options.most):
            found = self._arrived(q, step, targets, ceiling, below, eager=count % 5 == 0)
            if found is not None:
                number, ways = found
                return number, self._told([*points, *ways], top)
            moved = self._moved(q, step, below, ceiling)
            if moved is None:
                step /= 4
                if step < self.options.least:
                    return None
                continue
            on, length = moved
            if length < self.options.stalled * step:
                # At rest beside a minimum, or on the way to a saddle: off it by chance.
                stalled += 1
                if stalled > 8:
                    return None
                kick = rng.standard_normal(len(q)) * self.free
                trial = q + step * kick / np.linalg.norm(kick) * self.scales
                if self.curves.equations:
                    trial = self.curves.restored(trial)
                on = self.curves.straight(q, trial, ceiling, 2) or on
            points.extend(on)
            # Functions of images in a periodic arrangement are meant near the principal interval.
            q = self.manifold.wrap(on[-1])
            step = min(self.options.longest, 1.7 * step)
        return None

    def _told(self, points: Sequence[Array], top: float) -> Route:
        vertices = unwound(self.manifold, np.array(points))
        energies = self.problem.energy.value(np.array(points))
        return Route(vertices, np.asarray(energies, dtype=np.float64), top, True)

    def _arrived(
        self,
        q: Array,
        step: float,
        targets: Sequence[Target],
        ceiling: "Ball",
        below: float,
        *,
        eager: bool,
    ) -> tuple[int, list[Array]] | None:
        """Return the number of a minimum to which a straight piece leads, and the last points."""
        away = []
        for number, target in enumerate(targets):
            if target.energy < below:
                d = self.manifold.difference(q, target.spot.middle) / self.scales
                d[target.along] = 0.0
                away.append((float(np.linalg.norm(d)), number))
        for distance, number in sorted(away)[:2]:
            if not (eager or distance < 3 * step):
                continue
            target = targets[number]
            for lifted in target.lifted:
                way = self._last(q, lifted.middle, target)
                if lifted.top < below and self._likely(q, way[0], below):
                    points = self.curves.straight(q, way[0], ceiling, 3)
                    if points:
                        return number, [*points, *way[1:]]
        return None

    def _last(self, q: Array, lifted: Array, target: Target) -> list[Array]:
        """Return the last points of a route from ``q``: one above a minimum, and the minimum."""
        turn = self.manifold.difference(q, lifted)  # q - lifted, the short way
        near = q - turn
        if target.part:
            near[target.along] = q[target.along]
            return target.part.way(near)
        end = target.spot.middle + (near - lifted)
        return [near] if (lifted == target.spot.middle).all() else [near, end]

    def _likely(self, a: Array, b: Array, below: float) -> bool:
        """Whether a straight piece seems to lie in the set and below an energy."""
        points = a + np.linspace(0, 1, 9)[:, None] * (b - a)
        if self.curves.equations:
            return True
        values = self.problem.polyhedron.implicit(points)
        energies = self.problem.energy.value(points)
        return bool((np.asarray(values) >= 0).all() and (np.asarray(energies) < below).all())

    def _moved(
        self, q: Array, step: float, below: float, ceiling: "Ball"
    ) -> tuple[list[Array], float] | None:
        """Return points to a lower one, how far it is in scale units; None if none is verified."""
        values, slopes, bends = self.problem.evaluate(q, 2)
        if not all(np.isfinite(x).all() for x in (values, slopes, bends)):
            return None
        m, energy = self.problem.inequalities, float(values[-1])
        g = slopes[-1] * self.free
        pull = float(np.linalg.norm(g))
        margin = min(self.options.margin, self.options.spent * (below - energy) / max(pull, 1e-300))
        if not margin > 0:
            return None
        piece = sorted(self.problem.polyhedron.selections(values[:m].tolist())[0])
        sizes = np.linalg.norm(slopes[piece], axis=1)
        near = [i for i, s in zip(piece, sizes, strict=True) if s > 0 and values[i] < 2 * step * s]
        a, f = slopes[near] * self.free, values[near]
        rows = list(self.curves.equations)
        jac, gaps = slopes[rows] * self.free, -values[rows]
        wanted = np.minimum(margin, step / 2) * np.linalg.norm(slopes[near], axis=1)
        # Half of the margin is kept; where less is left, all of it is restored.
        short = f < 0.5 * wanted
        goal = np.where(short, wanted, 0.5 * wanted)
        d = self._step(step, (g, a, goal - f, jac, gaps), bends[-1], bends[near])
        if d is None:
            return None
        d = d * self.free * min(1.0, step / max(float(np.linalg.norm(d)), 1e-300))
        trial = self._corrected(q + d * self.scales, near, 0.4 * wanted)
        # Where walls are too near for the margin the energy may rise a little.
        more = 0.1 * (below - energy) if short.any() else 0.0
        if not self.problem.energy.value(trial) < energy + more:
            return None
        points = self.curves.straight(q, trial, ceiling, 1)
        return None if points is None else (points, float(np.linalg.norm(d)))

    def _step(
        self, step: float, linear: tuple[Array, ...], bend: Array, bends: Array
    ) -> Array | None:
        """Return a step of a convex model, no longer than ``step`` if that is possible.

        ``linear`` are the gradient, inequalities ``a d >= b`` and equations ``jac d = gaps``.
        """
        g, a, b, jac, gaps = linear
        pull, lam, free = float(np.linalg.norm(g)), np.zeros(len(a)), self.free
        found: Array | None = None
        for _ in range(2):  # without multipliers, then with those of the first step
            form = (bend - np.einsum("i,ijk->jk", lam, bends))[np.ix_(free, free)]
            w, v = np.linalg.eigh(0.5 * (form + form.T))
            w = abs(w)
            w = np.maximum(w, self.options.stiff * max(pull / step, w.max(initial=0.0)))
            metric, tau = np.eye(len(g)), 0.0
            for _ in range(8):
                metric[np.ix_(free, free)] = (v * (w + tau)) @ v.T
                found = _least_norm(metric, g, a, b, jac, gaps)
                if found is None:
                    return None
                if np.linalg.norm(found) <= step:
                    break
                tau = max(2.5 * tau, 0.5 * pull / step)
            if found is not None:
                lam = _multipliers(metric, g, a, jac, found)
        return found

    def _corrected(self, q: Array, near: Sequence[int], least: Array) -> Array:
        """Return a point nearby on the equations, at least so far from the walls."""
        rows = [*near, *self.curves.equations]
        for _ in range(3 if rows else 0):
            values, slopes = self.problem.evaluate(q, 1)
            gaps = least - values[list(near)]
            held = [k for k, gap in enumerate(gaps) if gap > 0]
            which = [*(near[k] for k in held), *self.curves.equations]
            if not which:
                break
            right = np.concatenate([gaps[held], -values[list(self.curves.equations)]])
            q = q + (np.linalg.pinv(slopes[which] * self.free) @ right) * self.scales
        return q


def _least_norm(
    metric: Array, g: Array, a: Array, b: Array, jac: Array, gaps: Array
) -> Array | None:
    """Return the ``d`` of least ``g d + d M d / 2`` with ``a d >= b`` and ``jac d = gaps``.

    None if nothing satisfies the conditions.
    """
    n = len(g)
    base, null = np.zeros(n), np.eye(n)
    if len(jac):
        u, s, vt = np.linalg.svd(jac)
        rank = int((s > DEFAULT.rank * s.max(initial=0.0)).sum())
        base = vt[:rank].T @ ((u.T @ gaps)[:rank] / s[:rank])
        null = vt[rank:].T
    reduced = null.T @ metric @ null
    right = null.T @ (g + metric @ base)
    chol = np.linalg.cholesky(reduced)
    free = -np.linalg.solve(chol, right)  # the minimiser without conditions, in the new variables
    if not len(a):
        return np.asarray(base + null @ np.linalg.solve(chol.T, free))
    rows = np.linalg.solve(chol, (a @ null).T).T
    bound = b - a @ base - rows @ free
    z = least_distance(rows, bound)
    return None if z is None else np.asarray(base + null @ np.linalg.solve(chol.T, free + z))


def _multipliers(metric: Array, g: Array, a: Array, jac: Array, d: Array) -> Array:
    """Return multipliers of the inequalities of a quadratic programme, from its solution."""
    if not len(a):
        return np.zeros(0)
    right = g + metric @ d
    if len(jac):
        right = right - jac.T @ np.linalg.lstsq(jac.T, right, rcond=None)[0]
    try:
        return np.asarray(nnls(a.T, right)[0])
    except RuntimeError:
        return np.zeros(len(a))


def unwound(manifold: Manifold, path: Array) -> Array:
    """Return a path whose steps around circles are the short ones."""
    steps = [manifold.difference(b, a) for a, b in pairwise(path)]
    return np.vstack([path[:1], path[0] + np.cumsum(steps, axis=0)])
