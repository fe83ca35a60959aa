"""Connected components of the points of a set with given values of some coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.boxes import BoxFunctions
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.domains import Domain
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH
from polycorner.values import Value

MOST_BOXES = 4096
FINEST = 1 / 256  # of the sides of the domain, for boxes that are left


@dataclass(frozen=True, eq=False)
class Components(Value):
    """Components, by boxes that lie in the set and boxes that may meet it.

    Attributes
    ----------
    lower, upper : (B, n) arrays
        The boxes.
    sure : (B,) array of bool
        Those that lie in the set.
    labels : (B,) array of int
        The component of each.
    samples : tuple of (n,) arrays
        A point of each component.
    open : bool
        Whether a component may be several, or some without a sample may be missing.
    free : tuple of int
    periods : (n,) array
    """

    lower: Array
    upper: Array
    sure: NDArray[np.bool_]
    labels: NDArray[np.int64]
    samples: tuple[Array, ...]
    open: bool
    free: tuple[int, ...]
    periods: Array

    def part(self, component: int) -> "Component":
        """Return one of the components."""
        own = self.sure & (self.labels == component)
        return Component(self.lower[own], self.upper[own], self.free, self.periods)


@dataclass(frozen=True, eq=False)
class Component(Value):
    """A component, by boxes that lie in it, of coordinates ``free``."""

    lower: Array
    upper: Array
    free: tuple[int, ...]
    periods: Array

    def nearest(self, q: Array) -> Array:
        """Return the point of the boxes that is nearest to ``q`` along the free coordinates.

        With the other coordinates of ``q``, and on circles in the turn of ``q``.
        """
        at, period = list(self.free), self.periods[list(self.free)]
        middle = 0.5 * (self.lower + self.upper)[:, at]
        turns = np.zeros_like(middle)
        circles = np.isfinite(period)
        apart = (q[at] - middle)[:, circles]
        turns[:, circles] = np.rint(apart / period[circles]) * period[circles]
        points = np.clip(q[at], self.lower[:, at] + turns, self.upper[:, at] + turns)
        best = abs(points - q[at]).sum(axis=1).argmin()
        found = q.copy()
        found[at] = points[best]
        return found

    def has(self, q: Array) -> bool:
        """Whether a point lies in one of the boxes, along the free coordinates."""
        return bool((self.nearest(q) == q).all())


def components(
    problem: Problem, domain: Domain, z: Sequence[int], lower: Array, upper: Array
) -> Components:
    """Return the components of the points of a set in a box that is thin along ``z``."""
    functions = BoxFunctions(problem.polyhedron.functions, problem.polyhedron.manifold)
    d = problem.polyhedron
    along = np.array([i for i in domain.free if i not in z], dtype=int)
    low, high = lower[None].copy(), upper[None].copy()
    sure: list[tuple[Array, Array]] = []
    rest: list[tuple[Array, Array]] = []
    width = (upper - lower)[along]
    treated = 0
    while len(low):
        treated += len(low)
        least, most = functions.values(low, high)
        inside = d.implicit_of(least) > 0
        outside = d.implicit_of(most) < 0
        sure.append((low[inside], high[inside]))
        left = ~inside & ~outside
        low, high = low[left], high[left]
        sides = (high - low)[:, along] / width if len(along) else np.zeros((len(low), 1))
        small = sides.max(axis=1, initial=0.0) <= FINEST
        if treated > MOST_BOXES:
            small[:] = True
        rest.append((low[small], high[small]))
        low, high = low[~small], high[~small]
        each = np.arange(len(low))
        axis = along[sides[~small].argmax(axis=1)] if len(low) else along[:0]
        middle = 0.5 * (low + high)[each, axis]
        first, second = high.copy(), low.copy()
        first[each, axis] = second[each, axis] = middle
        low, high = np.concatenate([low, second]), np.concatenate([first, high])
    parts = [*sure, *rest]
    los, his = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    certain = np.concatenate([np.full(len(part[0]), k < len(sure)) for k, part in enumerate(parts)])
    periods = np.array(d.manifold.periods)
    outer = _joined(los, his, along, periods)
    inner = np.full(len(los), -1)
    inner[certain] = _joined(los[certain], his[certain], along, periods)
    labels, samples, open_ = np.full(len(los), -1), list[Array](), False
    for label in np.unique(outer):
        members = outer == label
        kinds = np.unique(inner[members & certain])
        if not len(kinds):
            open_ = True  # boxes that may meet the set, without a point of it
            continue
        labels[members] = len(samples)
        first = int(np.flatnonzero(members & certain)[0])
        samples.append(0.5 * (los[first] + his[first]))
        vague = np.flatnonzero(members & ~certain)
        beside = _beside(los, his, along, vague, members & certain)
        whole = len(kinds) == 1 and bool(
            (beside & _monotone(problem, functions, los[vague], his[vague], along)).all()
        )
        open_ = open_ or not whole
    return Components(
        los, his, certain, labels, tuple(samples), open_, tuple(along.tolist()), periods
    )


def _monotone(
    problem: Problem, functions: BoxFunctions, lower: Array, upper: Array, along: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return the boxes in which the points of the set are connected, along one coordinate.

    All functions that may vanish there are monotone: where one branch has to hold the points are an
    interval; of a union they are one if all functions increase, or all decrease.
    """
    if len(along) != 1:
        return np.zeros(len(lower), dtype=np.bool_)
    v_lo, v_hi, g_lo, g_hi = functions.gradients(lower, upper)
    decided = (v_lo > 0) | (v_hi < 0)
    up, down = g_lo[:, :, along[0]] > 0, g_hi[:, :, along[0]] < 0
    same = (up | decided).all(axis=1) | (down | decided).all(axis=1)
    if problem.polyhedron.is_union:
        return np.asarray(same)
    return np.asarray(same | (up | down | decided).all(axis=1))


def _beside(
    lower: Array,
    upper: Array,
    along: NDArray[np.int64],
    vague: NDArray[np.int64],
    inside: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return which boxes share an end with one that lies in the set, along one coordinate."""
    if len(along) != 1:
        return np.zeros(len(vague), dtype=np.bool_)
    i = along[0]
    after, before = (
        np.isin(lower[vague, i], upper[inside, i]),
        np.isin(upper[vague, i], lower[inside, i]),
    )
    return np.asarray(after | before)


def _joined(
    lower: Array, upper: Array, along: NDArray[np.int64], periods: Array
) -> NDArray[np.int64]:
    """Return labels of classes of boxes that touch, on circles as well."""
    count = len(lower)
    root = np.arange(count)
    slack = 1e-3 * SEARCH.resolution
    low, high = lower[:, along], upper[:, along]
    period = periods[along]
    for a in range(count):
        d = 0.5 * (low + high) - 0.5 * (low[a] + high[a])
        round_ = np.isfinite(period)
        d[:, round_] -= np.rint(d[:, round_] / period[round_]) * period[round_]
        reach = 0.5 * (high - low) + 0.5 * (high[a] - low[a])
        for b in np.flatnonzero((abs(d) <= reach + slack).all(axis=1)):
            while root[a] != root[b]:
                new, old = sorted((root[a], root[b]))
                root[root == old] = new
    return root
