"""Registry of the corners found so far.

With relabellings only one corner of each orbit is kept, and of its rays one of each orbit under
the relabellings that leave the corner in record stands for all of them.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from polycorner.polyhedra.faces import projected
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient, Sample
from polycorner.polyhedra.symmetry import Relabelling, renamed
from polycorner.skeletons.branched_corners import with_branches
from polycorner.skeletons.singularities import SingularPoint, refined
from polycorner.skeletons.spheres_about import SAMPLED
from polycorner.skeletons.vertex_figures import VertexFigure, corner_rank, vertex_figure
from polycorner.spaces.manifold import Array
from polycorner.workers import Shared

Names = frozenset[str]
# Rays and sectors at a singular corner, from its active functions and their rank.
SingularFigure = Callable[[EvaluatedPoint, frozenset[int], int], VertexFigure]


NO_FIGURE = VertexFigure(0, 0, (), (), ())


@dataclass
class FoundCorner:
    """A corner while the skeleton grows.

    ``orbit[k]`` is the ray that stands for ray ``k``; ``edges`` the edges by such rays.  The figure
    comes after the corner: see :meth:`CornerRegistry.furnish`.
    """

    point: EvaluatedPoint
    active: frozenset[int]
    key: Array
    stabiliser: list[Relabelling]
    figure: VertexFigure = NO_FIGURE
    orbit: list[int] = field(default_factory=list)
    edges: dict[int, int] = field(default_factory=dict)


class CornerRegistry:
    """The corners found so far, and notes for the user."""

    def __init__(self, quotient: Quotient, singular: SingularFigure) -> None:
        self.singular_figure = singular
        self.quotient, self.symmetry = quotient, quotient.symmetry
        self.tolerances = quotient.tolerances
        self.polyhedron, self.manifold = quotient.polyhedron, quotient.manifold
        self.records: list[FoundCorner] = []
        self.notes: dict[str, None] = {}
        self.lost = False
        self._named: dict[frozenset[int], Names] = {}
        self._keys: Array = np.empty((0, 0))
        self._filled = 0

    def names(self, rows: Iterable[int]) -> Names:
        """Return the names of functions."""
        key = frozenset(rows)
        if key not in self._named:
            self._named[key] = frozenset(self.polyhedron.names[i] for i in key)
        return self._named[key]

    def written(self, rows: Iterable[int]) -> str:
        """Return the names of functions for a sentence."""
        return self.quotient.written(rows)

    def note(self, sentence: str, *, lost: bool = False) -> None:
        """Keep a sentence for the user once; ``lost`` if something could not be traced."""
        self.notes.setdefault(sentence)
        self.lost |= lost

    def find(self, point: EvaluatedPoint) -> tuple[int, list[Relabelling]] | None:
        """Return the position of the corner at a point, new or known, and the relabellings to it.

        The relabellings carry the names at the point to the names at the corner.
        """
        active = point.active()
        if active is None:
            self.note(f"a walk ended outside the polyhedron at {written_point(point.q)}", lost=True)
            return None
        point = self._polished(point, active)
        # Functions that vanish to rounding now may have been out of tolerance before.
        here = point.active() or active
        active = here if self.polyhedron.is_union or here > active else active
        key = self._key(point.q)
        for k in self._alike(point.q, key):
            record = self.records[k]
            carried = self._carried(point.q, record.point.q)
            there = self.names(record.active)
            same = [p for p in carried if renamed(self.names(active), p) == there]
            if same:
                return k, same
            if carried:
                self.note(
                    f"corners {self.written(record.active)} and {self.written(active)} "
                    f"are closer than {self.tolerances.corner:g} scale units: kept apart"
                )
        return self._add(point, active, key)

    def _alike(self, q: Array, key: Array) -> list[int]:
        """Return the positions of the corners that a point may be."""
        if not self.records:
            return []
        limits = self.tolerances
        alike = np.flatnonzero(abs(self._known_keys() - key).max(axis=1) <= limits.near)
        points = np.array([self.records[k].point.q for k in alike]).reshape(-1, len(q))
        possible = self.symmetry.possible(self.manifold, q, points, limits.corner)
        found: list[int] = alike[possible].tolist()
        return found

    def _carried(self, q: Array, to: Array) -> list[Relabelling]:
        """Return the relabellings that carry one point to another."""
        return self.symmetry.relabellings(self.manifold, q, to, self.tolerances.corner)

    def _known_keys(self) -> Array:
        """Return the keys of all corners, ``(k, m)``, in an array that doubles as it fills."""
        count = len(self.records)
        if count > len(self._keys):
            self._keys = np.array([record.key for record in self.records for _ in range(2)])
            self._filled = 0
        for k in range(self._filled, count):
            self._keys[k] = self.records[k].key
        self._filled = count
        return self._keys[:count]

    def _polished(self, point: EvaluatedPoint, active: frozenset[int]) -> EvaluatedPoint:
        basis = point.basis(active)
        if len(basis) + len(point.matrix([])) < len(point.q):
            return self._refined(point, active)
        limits = self.tolerances
        exact = projected(self.quotient, point.q, basis, limits.near)
        if exact is None:
            return point
        away = exact.distances
        if abs(away[sorted(active)]).max(initial=0.0) > limits.feasible:
            self.note(
                f"{self.written(active)} meet within the tolerance but not in one "
                f"point: corners closer together than it count as one"
            )
        gaps = {i: away[i] for i in range(self.quotient.count) if i not in active}
        near = [i for i, gap in gaps.items() if abs(gap) < limits.corner]
        for i in near if not self.polyhedron.is_union else ():
            self.note(
                f"at the corner {self.written(active)} {self.written([i])} is only "
                f"{abs(gaps[i]):.1g} scale units away: not counted as active"
            )
        return exact

    def _refined(self, point: EvaluatedPoint, active: frozenset[int]) -> EvaluatedPoint:
        """Return a singular corner to rounding, with what vanishes there as well if it is near.

        Functions that close with slope zero vanish to the square root of the tolerance only.
        """
        limits = self.tolerances
        found = refined(point, active, limits.near)
        away = abs(found.distances[: self.quotient.count])
        near = frozenset(np.flatnonzero(away < limits.corner).tolist()) - active
        if near and not self.polyhedron.is_union:
            whole = refined(found, active | near, math.sqrt(limits.corner))
            if abs(whole.distances[sorted(active | near)]).max() < limits.feasible:
                return whole
        return found

    def _key(self, q: Array) -> Array:
        key = self.symmetry.key
        return np.zeros(1) if key is None else np.asarray(key(q))

    def restore(self, q: Array, active: frozenset[int]) -> None:
        """Add a corner at the point of a saved one."""
        self._add(self.quotient.at(q), active, self._key(q))
        k = len(self.records) - 1
        self.furnish(k, self.figure(self.records[k].point, active))

    def _add(
        self, point: EvaluatedPoint, active: frozenset[int], key: Array
    ) -> tuple[int, list[Relabelling]]:
        stabiliser = self._carried(point.q, point.q)
        self.records.append(FoundCorner(point, active, key, stabiliser))
        return len(self.records) - 1, list(stabiliser)

    def figure(self, point: EvaluatedPoint, active: frozenset[int]) -> VertexFigure:
        """Return the vertex figure of a corner; of one where a function has no slopes, none."""
        slopes = point.slopes(sorted(active))
        if not np.isfinite(slopes).all():
            rows = zip(sorted(active), slopes, strict=True)
            lost = [g for g, row in rows if not np.isfinite(row).all()]
            names = ", ".join(self.polyhedron.names[g] for g in lost)
            note = f"{names} has no derivative at the corner {written_point(point.q)}"
            return VertexFigure(0, slopes.shape[1], (), (), (note,))
        rank, full = corner_rank(point, active)
        if rank == full:
            found = whole = vertex_figure(point, active)
            if len(active) > full and not self.polyhedron.is_union:
                whole = with_branches(found, point, active)
            if full > SAMPLED or (
                len(whole.rays) == len(found.rays) and not whole.is_thin(self.tolerances)
            ):
                return whole
            linked = self.singular_figure(point, active, rank)
            return whole if linked.notes else linked
        point = SingularPoint(self.quotient, point.q, sorted(active))
        return self.singular_figure(point, active, corner_rank(point, active)[0])

    def furnish(self, k: int, figure: VertexFigure) -> None:
        """Give a corner its vertex figure, and its point the values that are exact there."""
        record = self.records[k]
        for sentence in figure.notes:
            self.note(sentence, lost=True)
        if figure.singular:
            record.point = SingularPoint(self.quotient, record.point.q, sorted(record.active))
        record.figure, record.orbit = figure, []
        for i, ray in enumerate(figure.rays):
            twin = self.match(record, ray.sample.q, ray.active, record.stabiliser, range(i))
            record.orbit.append(i if twin is None else record.orbit[twin[0]])

    def match(
        self,
        record: FoundCorner,
        sample: Array | None,
        active: frozenset[int],
        relabellings: Iterable[Relabelling],
        among: Iterable[int],
    ) -> tuple[int, Relabelling] | None:
        """Return the ray of a corner that a relabelling carries a ray to, and the relabelling.

        The ray has given active functions; where these do not tell, a point of it decides.
        """
        alike: dict[Names, list[int]] = {}
        for i in among:
            alike.setdefault(self.names(record.figure.rays[i].active), []).append(i)
        names = self.names(active)
        possible = [(i, p) for p in relabellings for i in alike.get(renamed(names, p), [])]
        single = max(map(len, alike.values()), default=0) == 1 and not self.polyhedron.is_union
        if possible and single and not record.figure.singular:
            return possible[0]
        for i, p in possible:
            other = record.figure.rays[i]
            near = 0.2 * self._room(record.figure, i)
            if sample is not None and p in self.symmetry.relabellings(
                self.manifold, sample, other.sample.q, near
            ):
                return i, p
        return None

    def _room(self, figure: VertexFigure, i: int) -> float:
        """Return how far a ray's sample is from those of rays with the same functions."""
        ray = figure.rays[i]
        others = (
            self.symmetry.separation(self.manifold, ray.sample.q, other.sample.q)
            for k, other in enumerate(figure.rays)
            if k != i and other.active == ray.active
        )
        return min(ray.distance, *others, math.inf)


def figured(
    quotient: Shared,
    singular: SingularFigure,
    corner: Sample[EvaluatedPoint],
    active: frozenset[int],
) -> VertexFigure:
    """Return the vertex figure of a corner; called in a worker."""
    registry = CornerRegistry(quotient.value, singular)
    return registry.figure(corner.at(quotient.value), active)


def written_point(q: Array) -> str:
    """Return a point for a sentence."""
    return "(" + ", ".join(f"{x:.6g}" for x in q) + ")"
