"""Minima of generated landscapes and the energies at which they are joined.

In two coordinates: the stationary points of the energy, of its restrictions to curves, and the
points where curves meet are found by Newton's method from all cells of a grid that may hold one; a
minimum is one of them that no point of the set beside it is below; floods (:mod:`.flooding`) say
which of these values can be the height at which two minima are joined.  On a curve: roots between
samples.  On products: from the axes.  Nothing here is of the package.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise, product

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from benchmarks.trials.flooding import TINY, Array, Chart, Flood, Grid, Tree, implicit, joined

NODES = 300  # of a side of a flood
COARSE = 80  # of a side of the grid from whose cells Newton's method starts
STEPS = 40  # of Newton's method
EXACT = 1e-10  # of its last step, of functions that vanish, of energies that are equal
BESIDE = (1e-3, 1e-4, 1e-5)  # distances at which points beside one are compared with it
AWAY = 1e-4  # from a pole
CLEARLY = 1e-3  # how much higher or lower they must be, of the square of the distance


Heights = dict[tuple[int, int], tuple[float, ...]]


class DegenerateError(ValueError):
    """A problem whose answer the oracle cannot say."""


@dataclass(frozen=True)
class Truth:
    """Minima and how they are joined.

    Attributes
    ----------
    points : (k, d) array
        Minima; of a set of them, the coordinates that it has in common.
    energies : (k,) array
    heights : mapping from (int, int) to tuple of float
        The energies at which two minima may be joined, ``a < b``; usually one, inf if never; the
        outside of the region is ``k``.
    turns : (d,) array
        Periods of coordinates, inf of those on lines.
    within : mapping from (int, int) to tuple of float
        The same for paths that stay in the region.
    values : (m,) array or None
        The energies of all points that can be stationary.
    saddles : sequence of (d,) arrays
        Points that are passes for certain, loops among them.
    chart : Chart or None
        A set in two coordinates that the sublevel sets retract to.
    """

    points: Array
    energies: Array
    heights: Heights
    turns: Array
    within: Heights = field(default_factory=dict)
    values: Array | None = None
    saddles: Sequence[Array] = ()
    chart: Chart | None = None

    def euler(self, cap: float) -> int | None:
        """Return the Euler characteristic up to an energy, if it is known."""
        known = self.chart is not None and not self.chart.region
        return Grid(self.chart, NODES).euler(cap) if known else None

    def height(self, a: int, b: int) -> tuple[float, ...]:
        """Return the energies at which two minima may be joined."""
        if a == b:
            return (float(self.energies[a]),)
        return self.heights[min(a, b), max(a, b)]


# ------------------------------------------------------------------------------- two coordinates


def _newton(step: Callable[[Array], Array], starts: Array, longest: Array) -> Array:
    """Return where Newton's method has come to rest."""
    q = starts.copy()
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            s = step(q)
            s = np.clip(np.nan_to_num(s, nan=1.0), -longest, longest)
            q = q - s
    return q[abs(s).max(axis=1) <= EXACT]


def _solved(a: Array, b: Array, c: Array, d: Array, p: Array, r: Array) -> Array:
    """Return the solutions of ``a s + b t = p``, ``c s + d t = r``."""
    det = a * d - b * c
    return np.stack([(p * d - b * r) / det, (a * r - p * c) / det], axis=-1)


def _critical(j: Array) -> Array:
    """Return the step to where the energy is stationary."""
    return _solved(j[0, 3], j[0, 4], j[0, 4], j[0, 5], j[0, 1], j[0, 2])


def _along(j: Array) -> Array:
    """Return the step to where the energy is stationary along the zeros of a function."""
    (_, eu, ev, euu, euv, evv), (f, fu, fv, fuu, fuv, fvv) = j
    t = eu * fv - ev * fu
    tu = euu * fv + eu * fuv - euv * fu - ev * fuu
    tv = euv * fv + eu * fvv - evv * fu - ev * fuv
    return _solved(fu, fv, tu, tv, f, t)


def _crossing(j: Array) -> Array:
    """Return the step to where two functions vanish."""
    return _solved(j[0, 1], j[0, 2], j[1, 1], j[1, 2], j[0, 0], j[1, 0])


def candidates(chart: Chart) -> list[Array]:
    """Return all points at which the energy may be a minimum, or two parts of the set may meet."""
    grid = Grid(chart, COARSE)
    half = grid.steps
    j, c = grid.jets, grid.curved
    least = abs(j[0, 1:3]) - [
        c[0, 0] * half[0] + c[0, 1] * half[1], c[0, 1] * half[0] + c[0, 2] * half[1],
    ]  # fmt: skip
    room = abs(j[:, 1]) * half[0] + abs(j[:, 2]) * half[1] + grid.bend(half) / 2
    near = abs(j[:, 0]) <= room
    allowed = chart.inside((j[:, 0] + room)[1 : len(j)])
    of = range(1, len(j))
    ways = [(_critical, (0,), (least <= 0).all(axis=0))]
    ways += [(_along, (0, i), near[i]) for i in of]
    ways += [(_crossing, pair, near[pair[0]] & near[pair[1]]) for pair in combinations(of, 2)]
    found: list[Array] = []
    for way, parts, cells in ways:
        starts = np.stack([axis[cells & allowed] for axis in grid.nodes], axis=-1)
        if len(starts):
            ends = _newton(
                lambda q, way=way, of=parts: way(chart.jets(*q.T, of)), starts, 4 * grid.steps
            )
            found += _inside(chart, ends)
    return _distinct(chart, found)


def _inside(chart: Chart, points: Array) -> list[Array]:
    """Return those points that lie in the set, functions within their errors of zero."""
    low, high = np.array(chart.sides).T
    # What is stationary at a pole is the chart.
    low, high = low + chart.poles * np.array([0, AWAY]), high - chart.poles * np.array([0, AWAY])
    kept = ((points >= low) & (points <= high) | np.array(chart.around)).all(axis=1)
    points = points[kept]
    if not len(points):
        return []
    values = chart.values(*points.T)[1:]
    kept = chart.inside(values, tolerance=EXACT)
    turn = high - low
    points = np.where(chart.around, low + (points - low) % turn, points)
    return list(points[kept])


def _distinct(chart: Chart, points: Sequence[Array]) -> list[Array]:
    kept: list[Array] = []
    for q in points:
        if not kept or abs(chart.unrolled(q, np.array(kept)) - q).max(axis=1).min() > 1e-7:
            kept.append(q)
    return kept


def is_minimum(chart: Chart, q: Array) -> bool:
    """Whether no point of the set beside a point is below it.

    Beside it are points of small circles: in all directions, and on curves through the point.
    """
    answers = {_rise(chart, q, radius) > 0 for radius in BESIDE}
    if len(answers) > 1:
        msg = "two stationary points beside each other"
        raise DegenerateError(msg)
    return answers.pop()


def _rise(chart: Chart, q: Array, radius: float) -> float:
    """Return how much higher the lowest point at a distance is."""
    here = chart.jets(q[0], q[1])
    angles = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    beside = [q + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)]
    for i in np.flatnonzero(abs(here[1 : 1 + len(chart.functions), 0]) <= EXACT) + 1:
        normal = here[i, 1:3]
        tangent = np.array([-normal[1], normal[0]]) / np.hypot(*normal)
        on = q + radius * np.array([tangent, -tangent])
        for _ in range(6):
            (j,) = chart.jets(*on.T, [i])
            on = on - (j[0] * j[1:3] / (j[1] ** 2 + j[2] ** 2)).T
        beside.append(on)
    around = np.concatenate(beside)
    values = chart.values(*around.T)
    kept = chart.inside(values[1:], tolerance=1e-13)
    if not kept.any():
        msg = "an isolated point of the set"
        raise DegenerateError(msg)
    rise = float((values[0, kept] - here[0, 0]).min())
    if abs(rise) < CLEARLY * radius**2:
        msg = "it is not clear whether a point is a minimum"
        raise DegenerateError(msg)
    return rise


def is_saddle(chart: Chart, q: Array) -> bool:
    """Whether a point is a saddle inside the set, or one of a smooth side that carries it."""
    j = chart.jets(q[0], q[1])[: 1 + len(chart.functions)]
    (zeros,) = np.nonzero(abs(j[1:, 0]) <= EXACT)
    if not len(zeros):
        return bool(j[0, 3] * j[0, 5] < j[0, 4] ** 2 - CLEARLY)
    (i, *more), signs = zeros, np.sign(j[1:, 0])
    inner, outer = signs.copy(), signs.copy()
    inner[i], outer[i] = 1, -1
    if more or not chart.inside(inner) or chart.inside(outer):
        return False
    E, f = j[0], j[1 + i]
    lam = (E[1] * f[1] + E[2] * f[2]) / (f[1] ** 2 + f[2] ** 2)
    if abs(E[1:3] - lam * f[1:3]).max() > TINY or lam < CLEARLY:
        return False
    t = np.array([-f[2], f[1]]) / np.hypot(f[1], f[2])
    L = E - lam * f
    return bool(t[0] ** 2 * L[3] + 2 * t[0] * t[1] * L[4] + t[1] ** 2 * L[5] < -CLEARLY)


def known_on(chart: Chart, nodes: int = NODES) -> Truth:
    """Return minima and heights of an energy on a set in two coordinates."""
    points = candidates(chart)
    m = len(chart.functions)
    values = np.array([chart.values(*q) for q in points])
    kept = [k for k, q in enumerate(points) if is_minimum(chart, q)]
    if chart.region:
        kept = [k for k in kept if (values[k, 1 + m :] > 1e-6).all()]
    kept.sort(key=lambda k: values[k, 0])
    if not kept or len(kept) > 40:
        msg = f"{len(kept)} minima"
        raise DegenerateError(msg)
    minima, energies = [points[k] for k in kept], values[kept, 0]
    inside = np.sort(values[:, 0])
    heights, within = _heights(chart, nodes, minima, inside), {}
    if chart.region:
        k = len(minima)
        within = _heights(chart, nodes, minima, inside, stay=True)
        left = _heights(chart, nodes, minima, inside, leave=True)
        heights |= {pair: found for pair, found in left.items() if pair[1] == k}
    low, high = np.array(chart.sides).T
    turns = np.where(chart.around, high - low, np.inf)
    saddles = () if chart.region else [q for q in points if is_saddle(chart, q)]
    return Truth(np.array(minima), energies, heights, turns, within, inside, saddles, chart)


def floods(grid: Grid, minima: Sequence[Array], **how: bool) -> tuple[Flood, Flood]:
    """Return bounds of heights from both sides; they have to be in order."""
    below, above = grid.below(minima, **how), grid.above(minima, **how)
    if not (below.heights <= above.heights + EXACT).all():
        msg = "a lower bound is above an upper one"
        raise AssertionError(msg)
    return below, above


def _heights(
    chart: Chart, nodes: int, minima: Sequence[Array], values: Array, **how: bool
) -> Heights:
    """Return the values of candidates between the bounds, infinity among them.

    Where there are several, the grid is refined once.
    """
    found: Heights = {}
    for n in (nodes, 2 * nodes):
        below, above = floods(Grid(chart, n), minima, **how)
        for a, b in combinations(range(len(below.heights)), 2):
            low, high = below.heights[a, b], above.heights[a, b]
            known = np.array(found.get((a, b), (*values, np.inf)))
            some = known[(known >= low - EXACT) & (known <= high + EXACT)]
            found[a, b] = tuple(
                float(x) for k, x in enumerate(some) if not k or x > some[k - 1] + EXACT
            )
            if not found[a, b]:
                msg = f"no stationary value in [{low}, {high}]"
                raise AssertionError(msg)
        if all(len(some) == 1 for some in found.values()):
            break
    return found


# ------------------------------------------------------------------------------------- on curves


@dataclass(frozen=True)
class Curve:
    """An energy and a set on a line or a circle; ``sides`` are those of :class:`Chart`."""

    symbol: sp.Symbol
    energy: sp.Expr
    functions: tuple[sp.Expr, ...]
    tree: Tree
    sides: tuple[float, float]
    around: bool = False


FINE = 4001  # samples of a curve


def roots(f: Callable[[Array], Array], low: float, high: float) -> list[float]:
    """Return the roots between which samples change their sign."""
    t = np.linspace(low, high, FINE)
    values = np.broadcast_to(f(t), t.shape)
    found = [
        brentq(lambda x: float(f(np.float64(x))), a, b, xtol=1e-15, rtol=1e-15)
        for a, b, p, q in zip(t, t[1:], values, values[1:], strict=False)
        if p * q < 0
    ]
    return sorted([*found, *t[values == 0]])


def known_along(curve: Curve) -> Truth:
    """Return minima and heights of an energy on a set on a curve."""
    s, (low, high) = curve.symbol, curve.sides
    E, slope, *fs = (
        sp.lambdify(s, f, "numpy")
        for f in (curve.energy, sp.diff(curve.energy, s), *curve.functions)
    )

    def inside(t: float) -> bool:
        values = np.array([float(f(t)) for f in fs]).reshape(-1)
        return bool(implicit(curve.tree, values) >= 0) if fs else True

    cuts = sorted({low, high, *(x for f in fs for x in roots(f, low, high))})
    stops = sorted({*cuts, *roots(slope, low, high)})
    pieces = [(a, b) for a, b in pairwise(stops) if inside((a + b) / 2)]
    if not pieces:
        msg = "an empty set"
        raise DegenerateError(msg)
    # Heights of stops, and links between those that are next to each other in the set.
    index = {x: k for k, x in enumerate(sorted({x for piece in pieces for x in piece}))}
    if curve.around and low in index and high in index:
        index[high] = index[low]
    heights = {k: float(E(x)) for x, k in index.items()}
    count = max(index.values()) + 1
    beside: dict[int, list[int]] = {k: [] for k in range(count)}
    for a, b in pieces:
        beside[index[a]].append(index[b])
        beside[index[b]].append(index[a])
    points = {k: x for x, k in reversed(index.items())}
    minima = [k for k in beside if beside[k] and all(heights[k] < heights[o] for o in beside[k])]
    if any(abs(heights[k] - heights[o]) < TINY for k in beside for o in beside[k]):
        msg = "a flat piece"
        raise DegenerateError(msg)
    minima.sort(key=lambda k: heights[k])
    links = sorted(
        (max(heights[a], heights[b]), a, b) for a, others in beside.items() for b in others
    )
    merged = joined(count, ((a, b, w) for w, a, b in links))
    turn = high - low if curve.around else np.inf
    return Truth(
        np.array([[points[k]] for k in minima]),
        np.array([heights[k] for k in minima]),
        {
            (a, b): (float(merged[minima[a], minima[b]]),)
            for a, b in combinations(range(len(minima)), 2)
        },
        np.array([turn]),
    )


# ----------------------------------------------------------------------------------- on products


def known_product(axes: Sequence[Truth]) -> Truth:
    """Return minima and heights of a sum of energies, each of coordinates of its own.

    A path on which one part climbs while the others rest at minima is the lowest: all parts of a
    path that is lower could be carried down to minima one after the other.
    """
    places = list(product(*(range(len(axis.energies)) for axis in axes)))
    number = {place: k for k, place in enumerate(places)}
    energies = [
        sum(float(a.energies[i]) for a, i in zip(axes, place, strict=True)) for place in places
    ]
    links = []
    for place in places:
        for k, axis in enumerate(axes):
            for i in range(place[k] + 1, len(axis.energies)):
                other = (*place[:k], i, *place[k + 1 :])
                top, *others = axis.height(place[k], i)
                if others:
                    msg = "an axis whose heights are not known"
                    raise DegenerateError(msg)
                height = top + energies[number[place]] - float(axis.energies[place[k]])
                links.append((height, number[place], number[other]))
    merged = joined(len(places), ((a, b, w) for w, a, b in sorted(links) if w < np.inf))
    order = np.argsort(energies, kind="stable")
    return Truth(
        np.array(
            [
                np.concatenate([a.points[i] for a, i in zip(axes, places[k], strict=True)])
                for k in order
            ]
        ),
        np.array(energies)[order],
        {
            (a, b): (float(merged[order[a], order[b]]),)
            for a, b in combinations(range(len(order)), 2)
        },
        np.concatenate([a.turns for a in axes]),
    )
