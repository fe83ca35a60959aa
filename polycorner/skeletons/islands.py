"""Islands: boundary that no walk along faces and edges leads to.

Chains of random chords fill the polyhedron from points that are known (hit and run, [Smith]); the
ends of the chords lie on the boundary.  A function that no chord meets is minimised over the
polyhedron from the samples where it is smallest.  Neither proves that there is nothing else.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from polycorner.skeletons.points import EvaluatedPoint, Quotient, projected
from polycorner.skeletons.surfaces import Surface
from polycorner.spaces.manifold import Array

CHAINS = 32
STEPS = 16
PARTS = 16
# Shortest chord, as a part of the longest.
SHORTEST = 0.01
BISECTIONS = 24
# Samples that a function is minimised from.
DESCENTS = 3
ITERATIONS = 60
# Distance in scale units from zero that minimisation reaches, and at which a start was moved in.
REACHED = 1e-5
SELECTIONS = 4


class Cloud:
    """Points inside a polyhedron, and points of its boundary with the functions that end there.

    Attributes
    ----------
    points, values : (k, n) and (k, m) arrays
        Samples inside, and the functions there.
    hits : list of (frozenset of int, (n,) array)
        Functions whose sign changes at the end of a chord, and the end.
    """

    def __init__(
        self, quotient: Quotient, seeds: Array, span: Array, rng: np.random.Generator
    ) -> None:
        self.surface = Surface(quotient, frozenset(), seeds[0])
        self.span, self.rng = span, rng
        self.hits: list[tuple[frozenset[int], Array]] = []
        here = seeds[np.arange(max(CHAINS, len(seeds))) % len(seeds)]
        points, ends = [], []
        for _ in range(STEPS):
            here, inside, outside = self._step(here)
            points.append(here)
            ends.append((inside, outside))
        self.points = np.concatenate(points)
        self.values = self.surface.values(self.points)
        within = self.surface.contains(self.values)
        self.points, self.values = self.points[within], self.values[within]
        self._keep(*(np.concatenate(parts) for parts in zip(*ends, strict=True)))

    def _step(self, here: Array) -> tuple[Array, Array, Array]:
        """Move every chain along a random chord; return brackets of where chords end too."""
        k, n = here.shape
        length = SHORTEST ** self.rng.uniform(0, 1, k)
        way = self.rng.standard_normal((k, n)) * self.span * length[:, None]
        way /= np.sqrt(n)
        parts = np.sort(self.rng.uniform(0, 1, (k, PARTS)), axis=1)
        chords = here[:, None] + parts[..., None] * way[:, None]
        q, found = self.surface.projected(chords.reshape(-1, n))
        inside = found & self.surface.contains(self.surface.values(q))
        q, inside = q.reshape(chords.shape), inside.reshape(k, PARTS)
        reached = np.logical_and.accumulate(inside, axis=1).sum(axis=1)
        moved = np.flatnonzero(reached)
        ended = np.flatnonzero((reached > 0) & (reached < PARTS))
        chosen = (self.rng.uniform(0, 1, k) * reached).astype(int)
        here = here.copy()
        here[moved] = q[moved, chosen[moved]]
        return here, q[ended, reached[ended] - 1], q[ended, reached[ended]]

    def _keep(self, inside: Array, outside: Array) -> None:
        """Keep where chords from inside to outside leave the polyhedron."""
        surface = self.surface
        low, high = np.zeros(len(inside)), np.ones(len(inside))
        for _ in range(BISECTIONS if len(inside) else 0):
            middle = (low + high) / 2
            q, found = surface.projected(inside + middle[:, None] * (outside - inside))
            within = found & surface.contains(surface.values(q))
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        first, last = (
            surface.values(surface.projected(inside + s[:, None] * (outside - inside))[0])
            for s in (low, high)
        )
        count = surface.quotient.count
        changed = (first[:, :count] > 0) != (last[:, :count] > 0)
        for k, rows in enumerate(changed):
            functions = frozenset(np.flatnonzero(rows).tolist())
            self.hits.append((functions, inside[k] + low[k] * (outside[k] - inside[k])))


def minimised(cloud: Cloud, row: int) -> tuple[float, Array | None]:
    """Return the least value of a function that was found, and a zero.

    The zero is None where the function stays positive.
    """
    quotient = cloud.surface.quotient
    least = float("inf")
    for k in np.argsort(cloud.values[:, row])[:DESCENTS]:
        q = _solved(quotient, cloud.points[k], cloud.values[k], row)
        point = quotient.at(q)
        near = (
            np.isfinite(point.values).all() and (abs(point.values[quotient.count :]) < 1e-6).all()
        )
        if not near:
            continue
        distance = float(point.distances[row])
        if abs(distance) < REACHED:
            zero = on_zero(quotient, q, frozenset([row]))
            if zero is not None:
                return 0.0, zero.q
        if quotient.polyhedron.contains(q, tolerance=1e-6):
            least = min(least, float(point.values[row]))
    return min(least, float(cloud.values[:, row].min())), None


def _solved(quotient: Quotient, q: Array, values: Array, row: int) -> Array:
    """Minimise a function, or the distance from ``q``, over a branch of the polyhedron."""
    selection = quotient.polyhedron.selections(values[: quotient.count].tolist())[0]
    return _programme(quotient, q, sorted(selection | {row}), row)


def _programme(quotient: Quotient, q: Array, rows: Sequence[int], row: int | None) -> Array:
    from scipy.optimize import minimize

    bundle, scales = quotient.polyhedron.bundle, quotient.polyhedron.manifold.scale_array
    equations = quotient.equations

    def rated(which: Sequence[int], order: int) -> Any:
        def evaluate(u: Array) -> Array:
            found = bundle.evaluate(u * scales, order)[order][list(which)]
            return found if order == 0 else found * scales

        return evaluate

    def conditions(kind: str, which: Sequence[int]) -> dict[str, Any]:
        return {"type": kind, "fun": rated(which, 0), "jac": rated(which, 1)}

    start = q / scales
    constraints: Any = [conditions("ineq", rows)] if rows else []
    constraints += [conditions("eq", equations)] if equations else []

    def objective(u: Array) -> float:
        return float((u - start) @ (u - start)) if row is None else float(rated([row], 0)(u)[0])

    def slope(u: Array) -> Array:
        return 2 * (u - start) if row is None else np.asarray(rated([row], 1)(u)[0])

    with np.errstate(all="ignore"):
        found = minimize(
            objective, start, jac=slope, constraints=constraints, method="SLSQP",
            options={"maxiter": ITERATIONS, "ftol": 1e-12},
        )  # fmt: skip
    return np.asarray(found.x * scales)


def on_zero(quotient: Quotient, q: Array, rows: frozenset[int]) -> EvaluatedPoint | None:
    """Return a point of the polyhedron near ``q`` where given functions vanish."""
    point = quotient.at(q)
    if not np.isfinite(point.values).all():
        return None
    distances = point.distances[: quotient.count]
    close = {i for i in range(quotient.count) if abs(distances[i]) < REACHED}
    for some in (close | rows, rows, frozenset[int]()):
        there = projected(quotient, q, point.basis(some), 100 * REACHED)
        active = None if there is None else there.active()
        if there is not None and active is not None and rows <= active:
            return quotient.at(there.q)
    return None


def moved_in(quotient: Quotient, q: Array) -> EvaluatedPoint | None:
    """Return a point of the polyhedron near a point outside, by the least displacement."""
    values = quotient.at(q).values
    if not np.isfinite(values).all():
        return None
    for selection in quotient.polyhedron.selections(values[: quotient.count].tolist())[:SELECTIONS]:
        there = _programme(quotient, q, sorted(selection), None)
        found = on_zero(quotient, there, frozenset()) if np.isfinite(there).all() else None
        if found is not None:
            return found
    return None


def violated(quotient: Quotient, values: Array) -> Iterator[str]:
    """Yield what a point outside violates, in words."""
    polyhedron = quotient.polyhedron
    for name, value in zip(polyhedron.names, values[: quotient.count], strict=True):
        if not value >= 0:
            yield f"{name} = {value:.3g}"
    for name, value in zip(polyhedron.equation_names, values[quotient.count :], strict=True):
        if not abs(value) <= quotient.tolerances.zero:
            yield f"{name} = {value:.3g}"
