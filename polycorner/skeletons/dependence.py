"""Curves along which the gradients of the functions that vanish have one relation.

Let the rows of ``A(q)`` be the gradients of the functions ``f``, and ``u(q)`` its left singular
vector of the smallest singular value.  The rows are dependent where ``A' u = 0``.  Nearby, the
derivative of ``A' u`` along the null directions of ``A`` is the form ``B = sum u_i H_i``.  Where
``B`` has one null direction on these, ``f`` and the components of ``A' u`` along the other ones,
the *flaps*, vanish together on a curve in this direction, and one of the ``f`` follows from the
other functions, whose gradients are independent ([Gov] sec. 4.1).  Where several relations persist
along a curve, all but one of them are lost with as many functions, which follow from those that are
left: walks watch that they stay zero.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, islice

import numpy as np

from polycorner.formulas.bundles import Bundle
from polycorner.polyhedra.cones import Rows, rank
from polycorner.polyhedra.faces import HeldPoint
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient
from polycorner.skeletons.walks import End, Walk, follow
from polycorner.spaces.manifold import Array

# Most sets of functions with one relation that are tried.
MAX_SETS = 100
# Length in scale units after which a walk takes its flaps anew: they turn with the curve.
SEGMENT = 0.3


class _Dependent(Bundle):
    """A bundle's functions, then components of ``A' u``."""

    def __init__(
        self, ambient: Bundle, rows: list[int], units: Array, weights: Array, flaps: Array
    ) -> None:
        self.ambient, self.rows, self.units = ambient, rows, units
        self.weights, self.flaps = weights, flaps

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values and derivatives; the components' second ones are not known: NaN."""
        if q.ndim > 1:
            each = [self.evaluate(p, order) for p in q.reshape(-1, q.shape[-1])]
            parts = [np.array(part) for part in zip(*each, strict=True)]
            return tuple(part.reshape(q.shape[:-1] + part.shape[1:]) for part in parts)
        found = self.ambient.evaluate(q, min(order + 1, 2))
        matrix = found[1][self.rows] * self.units
        left, _, right = np.linalg.svd(matrix)
        weights = left[:, -1] * (1.0 if left[:, -1] @ self.weights > 0 else -1.0)
        null = right[len(matrix) - 1 :]
        flaps = self.flaps @ null.T @ null
        more = [flaps @ (matrix.T @ weights)]
        if order > 0:
            # Per unit of scaled coordinates once, per coordinate once.
            bends = np.einsum("ij,ijk->jk", weights[:, None] * self.units, found[2][self.rows])
            more.append(flaps @ bends)
        if order > 1:
            more.append(np.full((len(flaps), len(q), len(q)), np.nan))
        return tuple(np.concatenate(both) for both in zip(found, more, strict=False))


class DependentSet(Polyhedron):
    """A polyhedron with equations for the points where gradients have one relation.

    Its attribute ``outer`` is the quotient without these equations.
    """

    def __init__(self, point: EvaluatedPoint, rows: list[int], flaps: Array) -> None:
        self.outer, base = point.quotient, point.quotient.polyhedron
        self.__setstate__(base.__getstate__())
        more = [f"relation {k}" for k in range(len(flaps))]
        self.equation_names = (*base.equation_names, *more)
        units = 1 / np.linalg.norm(point.gradients[rows], axis=1)
        weights = np.linalg.svd(point.gradients[rows] * units[:, None])[0][:, -1]
        scaled = units[:, None] * base.manifold.scale_array
        self._extended = _Dependent(base.bundle, rows, scaled, weights, flaps)

    @property
    def bundle(self) -> Bundle:
        """Inequalities first, equations after them, those of the relation last."""
        return self._extended


def unit_hessians(point: EvaluatedPoint, rows: list[int]) -> Array:
    """Return the scaled Hessians ``(m, n, n)`` of functions, each divided by its slope.

    Equations count with the multipliers that cancel what is left of sums of gradients.
    """
    solved, hessians = list(point.quotient.equations), point.quotient.bent(point.q)[2]
    sizes = np.linalg.norm(point.gradients[rows], axis=1)
    sizes[sizes == 0] = 1.0  # a vanishing gradient is a relation by itself
    units = point.gradients[rows] / sizes[:, None]
    multipliers = np.linalg.lstsq(point.gradients[solved].T, -units.T, rcond=None)[0]
    own = hessians[rows] / sizes[:, None, None]
    return np.asarray(own + np.tensordot(multipliers.T, hessians[solved], 1))


def curvature(point: EvaluatedPoint, rows: list[int], weights: Array, plane: Array) -> Array:
    """Return the weighted sum of the Hessians of unit-slope functions on a subspace."""
    frame = point.frame @ plane
    return np.asarray(frame.T @ np.tensordot(weights, unit_hessians(point, rows), 1) @ frame)


def dependent_at(point: EvaluatedPoint, active: frozenset[int]) -> tuple[HeldPoint, Array] | None:
    """Return a point as one of a curve of dependent gradients, and the scaled unit tangent there.

    None if the gradients have no relation, or do not leave one null direction.
    """
    quotient, rows = point.quotient, sorted(active)
    if not point.sizes[quotient.held(rows)].all():
        return None  # a relation of one gradient: there is no curve that it follows
    frame, limit = point.frame, quotient.tolerances.rank
    slopes = point.slopes(rows)
    for some in islice(_with_one_relation(slopes, limit), MAX_SETS):
        related, held = [rows[i] for i in some], Rows(slopes[some], limit)
        form = curvature(point, related, held.relations[:, 0], held.null_space)
        values, axes = np.linalg.eigh(form)
        order = np.argsort(abs(values))
        flat = quotient.options.definite
        if len(values) < 2 or not abs(values[order[0]]) < flat * abs(values[order[1]]):
            continue
        ways = (frame @ held.null_space @ axes[:, order]).T
        curve = DependentSet(point, quotient.held(related), ways[1:])
        extra = range(len(point.values), len(point.values) + len(ways) - 1)
        along = replace(quotient, polyhedron=curve, equations=(*quotient.equations, *extra))
        return HeldPoint(along, point.q, point.basis(active)), ways[0]
    return None


def _with_one_relation(slopes: Array, limit: float) -> Iterator[list[int]]:
    """Yield the largest sets of rows that have one relation."""
    relations = Rows(slopes, limit).relations
    more = relations.shape[1] - 1
    related = np.flatnonzero(abs(relations).max(axis=1, initial=0.0) > limit)
    for lost in combinations(related.tolist(), max(more, 0)):
        if more >= 0 and (more == 0 or rank(relations[list(lost)], limit) == more):
            yield [i for i in range(len(slopes)) if i not in lost]


def held_at(outer: Quotient, q: Array, active: frozenset[int], kept: Sequence[int]) -> HeldPoint:
    """Return a point of a curve of dependent gradients; where they are not, with what is kept."""
    found = dependent_at(outer.at(q), active)
    return HeldPoint(outer, q, kept) if found is None else found[0]


def is_dependent(point: HeldPoint) -> bool:
    """Whether a point is held on a curve of dependent gradients."""
    return isinstance(point.quotient.polyhedron, DependentSet)


def follow_edge(start: HeldPoint, direction: Array, active: frozenset[int]) -> Walk:
    """Walk along an edge to its end; see :func:`~polycorner.skeletons.walks.follow`."""
    curve = start.quotient.polyhedron
    if not isinstance(curve, DependentSet):
        return follow(start, direction, passive=active)
    parts, length = [start.q[None]], 0.0
    while True:
        walk = follow(start, direction, passive=active, extent=SEGMENT)
        parts.append(walk.points[1:])
        length, direction, end = length + walk.length, walk.tangent, walk.end
        start = held_at(curve.outer, walk.last.q, active, walk.last.kept)
        if end is End.INFINITY and not is_dependent(start):
            end = End.SINGULAR
        if end is not End.INFINITY or length > curve.outer.extent:
            return Walk(np.concatenate(parts), start, direction, end, length)
