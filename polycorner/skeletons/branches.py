"""Branches: curves that cross at a corner where gradients have relations.

Let ``N`` be the dimension of the quotient, and ``H`` be ``N - 1`` of the functions ``f_i`` that
vanish at a corner.  Where their gradients vanish together on a space ``D`` of dimension ``k``, they
have ``k - 1`` relations ``w``.  A branch of the curve on which all of ``H`` stays zero leaves the
corner in a direction ``d`` in ``D`` with

    sum w_i d' H_i d = 0   for every relation ``w`` of ``H``:

``k - 1`` quadratic equations for a point of the projective space of ``D``.  Through every simple
zero goes one branch, by the implicit function theorem: divide the functions by the distance from
the corner, and their weighted sums by its square ([CW] sec. 3 has the same forms).  So every edge
along which gradients are independent leaves along such a zero, simple or not, for some ``H``.

Where the form of a set with one relation is semidefinite and has one null direction, that is the
direction of an edge along which the relation persists, or of a cusp; ``N + 1 - k`` functions with
one relation leave ``k`` dimensions.
"""

from collections.abc import Iterator
from itertools import combinations, islice

import numpy as np

from polycorner.polyhedra.cones import Rows, null_space, rank, unit_rows
from polycorner.polyhedra.strata import RANK_TOLERANCE
from polycorner.skeletons.dependence import curvature
from polycorner.skeletons.points import EvaluatedPoint, projected
from polycorner.skeletons.quadrics import FLAT, common_zeros
from polycorner.spaces.manifold import Array

# Least eigenvalue of a semidefinite form relative to the largest that counts as positive.
CLEAR = 1e-3
# Largest number of functions with slopes that open along an edge on which a relation persists.
OPENING = 3
# Most sets of functions that are tried, of those in a span.
MAX_SETS = 20_000
# Distance in scale units at which, and from zero to which, a relation is seen to persist.
BESIDE, PERSISTS = 1e-3, 1e-11
# Weighted sum of functions, some of which are farther from zero than that, which has a sign.
ROUNDING = 1e-13

# A unit direction in the quotient, and functions that stay zero along it.
Branch = tuple[Array, frozenset[int]]


class Branches:
    """The curves of functions that vanish at a corner.

    Parameters
    ----------
    point : EvaluatedPoint
        The corner.
    rows : list of int
        Functions that vanish there.

    Attributes
    ----------
    full, free : int
        Dimension of the quotient, and of the directions along which all slopes vanish.
    unclear : list of frozenset of int
        Sets of ``N - 1`` functions whose forms do not tell their branches.
    """

    def __init__(self, point: EvaluatedPoint, rows: list[int]) -> None:
        self.point, self.rows = point, rows
        self.frame = null_space(point.matrix([]), RANK_TOLERANCE)
        self.slopes = unit_rows(point.gradients[rows]) @ self.frame
        self.full = int(self.frame.shape[1])
        every = Rows(self.slopes, RANK_TOLERANCE)
        self.relations, self.free = every.relations, self.full - every.rank
        self.unclear: list[frozenset[int]] = []

    def simple(self) -> Iterator[Branch]:
        """Yield the directions of branches with independent gradients, of both signs."""
        for opened in combinations(range(len(self.rows)), len(self.rows) - self.full + 1):
            held, some = self._held(opened)
            forms = self._forms(held, some)
            zeros = common_zeros(forms)
            if zeros is None and not self._is_explained(forms, held, some):
                self.unclear.append(frozenset(held))
            for d in zeros or ():
                yield from self._entering(some.null_space @ d, opened, held)

    def double(self) -> Iterator[Branch]:
        """Yield the null directions of semidefinite forms, of both signs."""
        least = len(self.rows) - self.full + 1
        for opened in self._with_one_relation(range(least, least + self.free + OPENING)):
            held, some = self._held(opened)
            values, axes = _positive(self._forms(held, some)[0])
            if values[1] > max(FLAT, CLEAR * values[-1]) and abs(values[0]) <= FLAT:
                yield from self._entering(some.null_space @ axes[:, 0], opened, held)

    def excludes(self, held: frozenset[int], there: EvaluatedPoint) -> bool:
        """Whether higher orders exclude an edge, seen at a point where its other equations hold.

        The weighted sum of a form that is positive beside its null direction would have to be zero.
        Where it is positive, nothing nearby makes up for it; where it is negative and the form has
        two positive directions or more, whole surfaces do.
        """
        rows = sorted(held)
        some = Rows(self.slopes[[self.rows.index(i) for i in rows]], RANK_TOLERANCE)
        form = self._forms(rows, some)[0]
        away = some.relations[:, 0] @ there.distances[rows]
        rest = float(away * np.sign(np.trace(form)))
        return rest > ROUNDING or (len(form) > 2 and rest < -ROUNDING)

    def _with_one_relation(self, sizes: range) -> Iterator[tuple[int, ...]]:
        """Yield what opens where the others have one relation.

        Weights of what opens in the relations then have rank ``s - 1``: it lies in the span of some
        ``s - 1`` of the functions.
        """
        lost, spans = self.relations.shape[1] - 1, set()
        for base in combinations(range(len(self.rows)), lost):
            axes = self.relations[list(base)]
            if lost and rank(axes, RANK_TOLERANCE) < lost:
                continue
            across = null_space(axes, RANK_TOLERANCE) if lost else np.eye(1)
            inside = abs(self.relations @ across).max(axis=1) <= RANK_TOLERANCE
            spans.add(tuple(np.flatnonzero(inside).tolist()))
        for span in sorted(spans):
            sets = (some for size in sizes for some in combinations(span, size))
            for opened in islice(sets, MAX_SETS):
                weights = self.relations[list(opened)]
                if not lost or rank(weights[abs(weights).max(axis=1) > FLAT], FLAT) == lost:
                    yield opened

    def _held(self, opened: tuple[int, ...]) -> tuple[list[int], Rows]:
        """Return the functions that stay zero, and their gradients."""
        left = [i for i in range(len(self.rows)) if i not in opened]
        return [self.rows[i] for i in left], Rows(self.slopes[left], RANK_TOLERANCE)

    def _forms(self, held: list[int], some: Rows) -> Array:
        k = some.null_space.shape[1]
        forms = [curvature(self.point, held, w, some.null_space) for w in some.relations.T]
        return np.array(forms).reshape(-1, k, k)

    def _is_explained(self, forms: Array, held: list[int], some: Rows) -> bool:
        """Whether there is one double zero, or the functions leave more than curves.

        The first is that of :meth:`double`.
        """
        values = _positive(forms[0])[0]
        if len(forms) == 1 and abs(values[0]) <= FLAT < values[1]:
            return True
        way = some.null_space @ np.random.default_rng(0).standard_normal(some.null_space.shape[1])
        quotient, kept = self.point.quotient, self.point.basis(held)
        scales = quotient.polyhedron.manifold.scale_array
        q = self.point.q + BESIDE * scales * (self.frame @ (way / np.linalg.norm(way)))
        there = projected(quotient, q, kept, BESIDE / 2)
        return there is not None and abs(there.distances[held]).max() <= PERSISTS

    def _entering(self, d: Array, opened: tuple[int, ...], held: list[int]) -> Iterator[Branch]:
        """Yield those of a line's two directions along which no function falls to first order."""
        for way in (d, -d):
            if (self.slopes[list(opened)] @ way > -RANK_TOLERANCE).all():
                yield way, frozenset(held)


def _positive(form: Array) -> tuple[Array, Array]:
    """Return eigenvalues and axes of a form or of its negative, whichever has the larger trace."""
    values, axes = np.linalg.eigh(form)
    return (values, axes) if values.sum() > 0 else (-values[::-1], axes[:, ::-1])
