"""Faces without edges, starts outside, and islands while a skeleton grows.

Islands: boundary that no walk along faces and edges leads to.

Chains of random chords fill the polyhedron from points that are known (hit and run, [Smith]); the
ends of the chords lie on the boundary.  A function that no chord meets is minimised over the
polyhedron from the samples where it is smallest.  Neither proves that there is nothing else.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner.polyhedra.faces import HeldPoint, projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient
from polycorner.polyhedra.symmetry import renamed
from polycorner.skeletons.curves import Curve, EdgeEnd
from polycorner.skeletons.nets import Net
from polycorner.skeletons.registry import SingularFigure, written_point
from polycorner.skeletons.surfaces import Surface
from polycorner.skeletons.tracing import EdgeTracer
from polycorner.skeletons.walks import End, follow
from polycorner.spaces.manifold import Array
from polycorner.values import Value

CHAINS = 32
STEPS = 16
PARTS = 16
# Shortest chord, as a part of the longest.
SHORTEST = 0.01
BISECTIONS = 24
# Samples that a function is minimised from.
DESCENTS = 3
ITERATIONS = 60
SELECTIONS = 4
# Starts that a function met by chords gives, chords looked at for them, and how often islands are
# sought.
TARGETS = 2
HITS = 6
ROUNDS = 3
# Points that chains start from.
SEEDS = 64
# Part of a chord of an edge within which a point lies on the edge.
ASIDE = 0.25
# Walks inside from a point of a face.
WALKS = 6
# Edges that a point of a face is joined to by straight ways.
SEEN = 12
ISLAND = -1
# What a descent arrives at: the end of an edge at a corner, an edge or a closed face by position.
Anchor = tuple[str, EdgeEnd | int]


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
        q, inside = self.surface.placed(chords.reshape(-1, n))
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
        ends = np.zeros(len(inside)), np.ones(len(inside))
        low, high = surface.leave(inside, outside, *ends, BISECTIONS)
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
        if abs(distance) < quotient.options.reached:
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

    bundle, scales = quotient.polyhedron.bundle, quotient.scales
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
    reached = quotient.options.reached
    close = {i for i in range(quotient.count) if abs(distances[i]) < reached}
    for some in (close | rows, rows, frozenset[int]()):
        there = projected(quotient, q, point.basis(some), 100 * reached)
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


@dataclass(frozen=True, eq=False)
class Patch(Value):
    """A closed face without edges, by its functions and one of its points."""

    active: frozenset[int]
    point: Array


class Prober(EdgeTracer):
    """Closed faces, links through the interior, and what the search for islands found."""

    def __init__(
        self,
        quotient: Quotient,
        singular: SingularFigure,
        rng: np.random.Generator,
        *,
        probes: bool,
    ) -> None:
        super().__init__(quotient, singular)
        self.rng, self.probes = rng, probes
        self.patches: list[Patch] = []
        self.links: list[frozenset[Anchor]] = []
        self.origins: list[Array] = []
        self.least: dict[str, float] = {}
        self.sought = (0, -1)  # how often islands were sought, and what was known then
        self._nets: dict[int, Net] = {}
        self._open: list[tuple[frozenset[int], Net]] = []

    # ----------------------------------------------------------------------------------- starts

    def entered(self, number: int, start: Array) -> EvaluatedPoint | None:
        """Return a start, moved in if it lies outside; None if it cannot be, which is noted."""
        point = self.quotient.at(start)
        finite = bool(np.isfinite(point.values).all())
        if finite and point.active() is not None:
            self.origins.append(start)
            return point
        words = ", ".join(violated(self.quotient, point.values))
        label = f"start {number} lies outside the polyhedron ({words})"
        inside = moved_in(self.quotient, start) if self.probes else None
        if inside is None:
            self.registry.note(f"{label}: left out, no point of the polyhedron was found from it")
            return None
        away = np.linalg.norm((inside.q - start) / self.scales)
        self.registry.note(
            f"{label}: moved in by {away:.3g} scale units, to {written_point(inside.q)}"
        )
        self.origins.append(inside.q)
        return inside

    # ----------------------------------------------------------------------------- closed faces

    def patch_at(self, point: EvaluatedPoint, active: frozenset[int]) -> int | None:
        """Return the position of the closed face that a point lies on, among those known."""
        for k, patch in enumerate(self.patches):
            for g in self.symmetry.group:
                names = renamed(self.registry.names(active), g.names)
                if names == self.registry.names(patch.active) and self._on_net(k, g.apply(point.q)):
                    return k
        return None

    def _on_net(self, k: int, q: Array) -> bool:
        if k not in self._nets:
            self._nets[k] = self._net(self.patches[k].active, self.patches[k].point)
        return self._nets[k].holds(q)

    def _is_open(self, point: EvaluatedPoint, active: frozenset[int]) -> bool:
        """Whether a point lies on a face that a net could not cover."""
        return any(there == active and net.holds(point.q) for there, net in self._open)

    def _net(self, active: frozenset[int], q: Array) -> Net:
        surface = Surface(self.quotient, active, q)
        return Net(surface, q[None], extent=self.quotient.extent)

    def explored(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> Iterator[tuple[EvaluatedPoint, frozenset[int]]]:
        """Cover a face by a net: yield where it ends; if it closes, keep it as a closed face."""
        symmetry = self.symmetry
        orbits = len(symmetry.directions(self.manifold, point.q))
        if not self.probes or symmetry.relabels or (orbits and symmetry.invariants is None):
            return
        if self._is_open(point, active):
            return
        net = self._net(active, point.q)
        if not net.complete:
            self._open.append((active, net))
        if net.complete and not len(net.ends):
            self._nets[len(self.patches)] = net
            self.patches.append(Patch(active, point.q))
        kept = point.basis(active)
        for k in range(0, len(net.ends), max(1, len(net.ends) // WALKS)):
            start = HeldPoint(self.quotient, net.starts[k], kept)
            ahead = (net.ends[k] - start.q) / self.scales
            yield from follow(start, ahead, passive=active).arrival

    def inside(
        self, point: EvaluatedPoint, active: frozenset[int]
    ) -> Iterator[tuple[EvaluatedPoint, frozenset[int]]]:
        """Yield what walks through the interior from a point of a facet arrive at."""
        (row,) = active
        size = np.linalg.norm(point.gradients[row])
        if not size > 0:
            return
        normal = point.gradients[row] / size
        inside = self.quotient.tolerances.corner * self.scales * normal
        start = HeldPoint(self.quotient, point.q + inside, [])
        if start.active():
            return
        for way in self._ways_inside(start, normal):
            yield from follow(start, way).arrival

    def _ways_inside(self, start: EvaluatedPoint, normal: Array) -> Iterator[Array]:
        """Yield the normal of a facet, random ways inwards, and ways to boundary that is known.

        Random ways alone may miss a small void; what is not joined counts as a component.
        """
        yield normal
        for _ in range(WALKS - 1):
            way = self.rng.standard_normal(len(normal))
            yield way - 2 * min(0.0, float(way @ normal)) * normal
        targets = [patch.point for patch in self.patches[:: 1 + len(self.patches) // WALKS]]
        targets += [curve.middle for curve in self.curves[:: 1 + len(self.curves) // WALKS]]
        for target in targets:
            way = self.manifold.chord(target, start.q) / self.scales
            if way @ normal > 0:
                yield way

    # ---------------------------------------------------------------------------------- islands

    def met(self) -> frozenset[int]:
        """Return the functions that vanish at a corner, along an edge or on a closed face."""
        sets = [record.active for record in self.records]
        sets += [curve.active for curve in self.curves]
        sets += [patch.active for patch in self.patches]
        return frozenset().union(*sets)

    def seek(self) -> list[Array]:
        """Return points on boundary that may be new."""
        if self.symmetry.relabels or not self.origins or not self.probes:
            return []
        cloud = Cloud(self.quotient, self._seeds(), self._span(), self.rng)
        met, targets = self.met(), list[Array]()
        for row in range(self.quotient.count):
            found = list(self._targets(cloud, row)) if len(cloud.points) else []
            if not found and row not in met and len(cloud.points):
                least, zero = minimised(cloud, row)
                self.least[self.polyhedron.names[row]] = least
                found = [] if zero is None else [zero]
            targets += found
        return targets

    def _known(self) -> Array:
        parts = [np.array(self.origins)]
        parts += [record.point.q[None] for record in self.records]
        parts += [curve.points for curve in self.curves]
        parts += [net.points for net in self._nets.values()]
        return np.concatenate(parts)

    def _seeds(self) -> Array:
        known = self._known()
        first = known[: min(len(self.origins), SEEDS // 2)]
        return np.concatenate([first, self.rng.choice(known, SEEDS // 2)])

    def _span(self) -> Array:
        """Return how far chords may reach in every coordinate."""
        known = self._known()
        wide = known.max(axis=0) - known.min(axis=0) + self.scales
        return np.asarray(np.minimum(2 * wide, np.array(self.manifold.periods)))

    def _targets(self, cloud: Cloud, row: int) -> Iterable[Array]:
        """Yield ends of chords at a function that lie on no known edge or closed face."""
        count = seen = 0
        low, high = self._limits()
        curves = [curve for curve in self.curves if row in curve.active]
        for rows, q in cloud.hits:
            if count == TARGETS or seen == HITS:
                break
            if row not in rows or (q < low).any() or (q > high).any():
                continue
            if any(self._near(q, curve.points) for curve in curves):
                continue
            seen += 1
            point = on_zero(self.quotient, q, frozenset([row]))
            active = point.active() if point is not None else None
            if point is None or active is None or self._is_known(point, active, curves):
                continue
            count += 1
            yield point.q

    def _limits(self) -> tuple[Array, Array]:
        """Return where islands are sought: if edges are open, in the box of what is known."""
        known = self._known()
        if any(End.INFINITY in curve.kinds for curve in self.curves):
            return known.min(axis=0), known.max(axis=0)
        return np.full_like(known[0], -np.inf), np.full_like(known[0], np.inf)

    def _is_known(self, point: EvaluatedPoint, active: frozenset[int], curves: list[Curve]) -> bool:
        """Whether a point lies on a closed face, or straight ways on its face lead to an edge."""
        if self._is_open(point, active) or self.patch_at(point, active) is not None:
            return True
        middles = [curve.middle for curve in curves if active < curve.active][:SEEN]
        if not middles:
            return False
        surface = Surface(self.quotient, active, point.q)
        return bool(surface.sees(point.q, np.array(middles)).any())

    def _near(self, q: Array, points: Array) -> bool:
        """Whether a point lies near the chords of an edge."""
        apart = self.manifold.chord(q, points) / self.scales
        chords = np.diff(points, axis=0) / self.scales
        lengths = np.einsum("kn,kn->k", chords, chords)
        parts = np.einsum("kn,kn->k", apart[:-1], chords) / np.maximum(lengths, 1e-300)
        off = apart[:-1] - np.clip(parts, 0, 1)[:, None] * chords
        return bool((np.einsum("kn,kn->k", off, off) < ASIDE**2 * lengths).any())
