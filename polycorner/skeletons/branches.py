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

A form that vanishes on a plane says nothing; then the weighted sum is of third order or more, and
``d`` is where it changes sign on a small circle, beside which the other functions stay zero.  Sums
below ``1e-11`` at ``1e-3`` (by default) count as zero along a whole surface.

Where the form of a set with one relation is semidefinite and has one null direction, that is the
direction of an edge along which the relation persists, or of a cusp; ``N + 1 - k`` functions with
one relation leave ``k`` dimensions.

Common zeros of ``k - 1`` quadratic forms of ``k`` variables, ``k`` at most 3.

On the projective line a form has two zeros, none, or a double one where it is semidefinite.  Two
conics that do not touch meet in up to four points.  Three conics of their pencil are degenerate;
where real points are common to all of it, one of these three consists of two real lines, and the
points are the zeros of another conic on them.
"""

import math
from collections.abc import Iterator
from functools import partial
from itertools import combinations
from math import comb

import numpy as np

from polycorner.polyhedra.cones import Rows, extreme_rays, null_space, rank
from polycorner.polyhedra.faces import projected
from polycorner.polyhedra.quotients import EvaluatedPoint
from polycorner.skeletons.dependence import unit_hessians
from polycorner.skeletons.spheres_about import Link
from polycorner.skeletons.walks import sign_change
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

# Members of the pencil of two conics, of which the least degenerate one is taken.
ANGLES = (0.3, 1.1, 1.9, 2.7)
# Largest number of functions with slopes that open along an edge on which a relation persists.
OPENING = 3
# Most sets of functions that are tried, of those in a span.
MAX_SETS = 20_000
# Radius in scale units of a circle on which sums of higher order change sign, its points, and the
# part of the largest sum that may be a zero.
ROUND, AROUND, NEARLY = 3e-3, 72, 1e-2
# A unit direction in the quotient, and functions that stay zero along it.
Branch = tuple[Array, frozenset[int]]


def common_zeros(forms: Array, limit: float) -> list[Array] | None:
    """Return the common zeros of quadratic forms, up to their signs.

    Parameters
    ----------
    forms : (k - 1, k, k) array
        Symmetric matrices, of the order of 1.
    limit : float
        Size of a form or of its eigenvalues, and distance of roots, that count as zero.

    Returns
    -------
    list of (k,) arrays, or None
        Unit vectors; None if a zero is not isolated or not simple, or ``k`` above 3.
    """
    k = forms.shape[-1]
    if k > 3:
        return None
    if k == 1:
        return [np.ones(1)]
    return _on_line(forms[0], limit) if k == 2 else _of_conics(forms[0], forms[1], limit)


def _on_line(form: Array, limit: float) -> list[Array] | None:
    values, axes = np.linalg.eigh(form)
    if abs(values).min() <= limit:
        return None
    if values[0] * values[1] > 0:
        return []
    low, high = math.sqrt(-values[0]), math.sqrt(values[1])
    lines = [high * axes[:, 0] + sign * low * axes[:, 1] for sign in (1, -1)]
    return [line / np.linalg.norm(line) for line in lines]


def _of_conics(first: Array, second: Array, limit: float) -> list[Array] | None:
    pencil = [
        (math.cos(a) * first + math.sin(a) * second, math.cos(a) * second - math.sin(a) * first)
        for a in ANGLES
    ]
    regular, other = max(pencil, key=lambda both: abs(np.linalg.det(both[0])))
    if abs(np.linalg.det(regular)) <= limit:
        return None
    roots = np.linalg.eigvals(-np.linalg.solve(regular, other))
    apart = abs(roots[:, None] - roots[None]) + np.eye(3)
    if apart.min() <= limit * max(1.0, abs(roots).max()):
        return None
    found = []
    real = [x.real for x in roots if abs(x.imag) <= limit]
    for line in _lines([other + x * regular for x in real], limit):
        zeros = _on_line(line.T @ regular @ line, limit)
        if zeros is None:
            return None
        found += [line @ zero for zero in zeros]
    return found


def _lines(conics: list[Array], limit: float) -> list[Array]:
    """Return the lines, as planes ``(3, 2)``, of the clearest of the conics that has real ones."""
    clearest, found = limit, []
    for conic in conics:
        values, axes = np.linalg.eigh(conic)
        if min(-values[0], values[2]) > clearest:
            clearest = min(-values[0], values[2])
            normals = (
                math.sqrt(values[2]) * axes[:, 2] + sign * math.sqrt(-values[0]) * axes[:, 0]
                for sign in (1, -1)
            )
            found = [null_space(normal[None], limit) for normal in normals]
    return found


class Branches:
    """The curves of functions that vanish at a corner.

    Attributes
    ----------
    full, free : int
        Dimension of the quotient, and of the directions along which all slopes vanish.
    unclear : list of frozenset of int
        Sets of ``N - 1`` functions whose forms do not tell their branches.
    """

    def __init__(self, point: EvaluatedPoint, rows: list[int]) -> None:
        self.point, self.rows = point, rows
        self.tolerances, self.frame = point.quotient.tolerances, point.frame
        self.limit = self.tolerances.rank
        self.slopes = point.slopes(rows)
        self.full = int(self.frame.shape[1])
        every = Rows(self.slopes, self.limit)
        self.relations, self.free = every.relations, self.full - every.rank
        # Second derivatives shrink with a link's radius.
        sphere = self.point.quotient.polyhedron
        self.scale = 1 / sphere.radius if isinstance(sphere, Link) else 1.0
        self.unclear: list[frozenset[int]] = []

    @cached_property
    def bends(self) -> Array:
        """Hessians of the functions in the quotient, ``(m, full, full)``, of unit slope."""
        return np.asarray(self.frame.T @ unit_hessians(self.point, self.rows) @ self.frame)

    def simple(self, least: int = 1) -> Iterator[Branch]:
        """Yield the directions of branches with independent gradients, of both signs.

        Only of functions that leave at least ``least`` dimensions to first order.  All is unclear
        where there are too many sets of functions.
        """
        count = len(self.rows)
        if comb(count, self.full - 1) > MAX_SETS:
            self.unclear.append(frozenset())
            return
        for opened in combinations(range(count), count - self.full + 1):
            held, some = self._held(opened)
            if some.null_space.shape[1] < least:
                continue
            if some.null_space.shape[1] > 1 and not self._enters(opened, some):
                continue
            forms = self._forms(held, some)
            zeros = common_zeros(forms, self.limit)
            lines = [d for zero in zeros or () for d in (zero, -zero)]
            if zeros is None and not self._is_explained(forms, held, some):
                found = self._of_higher_order(forms, held, some)
                if found is None:
                    self.unclear.append(frozenset(held))
                lines = found or []
            for d in lines:
                yield from self._entering(some.null_space @ d, opened, held)

    def double(self) -> Iterator[Branch]:
        """Yield the null directions of semidefinite forms, of both signs."""
        least = len(self.rows) - self.full + 1
        for opened in self._semidefinite(least + self.free + OPENING - 1):
            held, some = self._held(opened)
            if len(opened) < least:
                continue
            values, axes = _positive(self._forms(held, some)[0])
            clear = max(self.limit, self.point.quotient.options.definite * values[-1])
            if values[1] > clear and abs(values[0]) <= self.limit:
                for d in (axes[:, 0], -axes[:, 0]):
                    yield from self._entering(some.null_space @ d, opened, held)

    def excludes(self, held: frozenset[int], there: EvaluatedPoint) -> bool:
        """Whether higher orders exclude an edge, seen at a point where its other equations hold.

        The weighted sum of a form that is positive beside its null direction would have to be zero.
        Where it is positive, nothing nearby makes up for it; where it is negative and the form has
        two positive directions or more, whole surfaces do.
        """
        rows = sorted(held)
        some = Rows(self.slopes[[self.rows.index(i) for i in rows]], self.limit)
        form = self._forms(rows, some)[0]
        away = some.relations[:, 0] @ there.distances[rows]
        rest = float(away * np.sign(np.trace(form)))
        rounding = self.tolerances.rounding
        return rest > rounding or (len(form) > 2 and rest < -rounding)

    def _semidefinite(self, most: int) -> Iterator[tuple[int, ...]]:
        """Yield sets of up to ``most`` functions without which there is one relation.

        Only those whose form is semidefinite: opening more functions leaves more directions, on
        which an indefinite form stays so.  Too many sets are unclear.
        """
        lost = self.relations.shape[1] - 1
        for span in self._spans(lost):
            level = {some for some in combinations(span, lost) if self._leaves_one(some)}
            tried = 0
            while level and tried <= MAX_SETS:
                kept = [opened for opened in sorted(level) if self._is_semidefinite(opened)]
                tried += len(level)
                yield from kept
                small = (opened for opened in kept if len(opened) < most)
                level = {
                    tuple(sorted((*opened, j))) for opened in small for j in span if j not in opened
                }
            if level:
                self.unclear.append(frozenset())

    def _spans(self, lost: int) -> list[tuple[int, ...]]:
        """Return the largest sets of functions whose weights span ``lost`` relations.

        Weights of what opens in the relations have this rank if one relation is left: they lie in
        the span of those of some ``lost`` of the functions.
        """
        spans = set()
        for base in combinations(range(len(self.rows)), lost):
            axes = self.relations[list(base)]
            if lost and rank(axes, self.limit) < lost:
                continue
            across = null_space(axes, self.limit) if lost else np.eye(1)
            inside = abs(self.relations @ across).max(axis=1) <= self.limit
            spans.add(tuple(np.flatnonzero(inside).tolist()))
        return sorted(spans)

    def _leaves_one(self, opened: tuple[int, ...]) -> bool:
        """Whether one relation is left without some functions, as few as relations are lost."""
        weights = self.relations[list(opened)]
        clear = weights[abs(weights).max(axis=1, initial=0.0) > self.limit]
        return not opened or rank(clear, self.limit) == len(opened)

    def _is_semidefinite(self, opened: tuple[int, ...]) -> bool:
        """Whether the form of what is left is nowhere negative, or nowhere positive."""
        values = _positive(self._forms(*self._held(opened))[0])[0]
        return bool(values.min(initial=0.0) >= -self.limit)

    def _held(self, opened: tuple[int, ...]) -> tuple[list[int], Rows]:
        """Return the functions that stay zero, and their gradients."""
        left = [i for i in range(len(self.rows)) if i not in opened]
        return [self.rows[i] for i in left], Rows(self.slopes[left], self.limit)

    def _forms(self, held: list[int], some: Rows) -> Array:
        rows = [self.rows.index(i) for i in held]
        sums = np.tensordot(some.relations.T, self.bends[rows], 1)
        return np.asarray(some.null_space.T @ sums @ some.null_space * self.scale)

    def _is_explained(self, forms: Array, held: list[int], some: Rows) -> bool:
        """Whether there is one double zero, or the functions leave more than curves.

        The first is that of :meth:`double`.
        """
        values = _positive(forms[0])[0]
        if len(forms) == 1 and abs(values[0]) <= self.limit < values[1]:
            return True
        way = some.null_space @ np.random.default_rng(0).standard_normal(some.null_space.shape[1])
        quotient, kept = self.point.quotient, self.point.basis(held)
        scales = quotient.scales
        beside = self.tolerances.beside  # where a relation is seen to persist
        q = self.point.q + beside * scales * (self.frame @ (way / np.linalg.norm(way)))
        there = projected(quotient, q, kept, beside / 2)
        return there is not None and abs(there.distances[held]).max() <= self.tolerances.held

    def _enters(self, opened: tuple[int, ...], some: Rows) -> bool:
        """Whether the others have a null direction along which no function falls to first order."""
        slopes = self.slopes[list(opened)] @ some.null_space
        size = np.linalg.norm(slopes, axis=1)
        slopes = slopes[size > self.limit]
        whole = rank(slopes, self.limit) == slopes.shape[1]
        return not whole or bool(extreme_rays(slopes, self.limit))

    def _of_higher_order(self, forms: Array, held: list[int], some: Rows) -> list[Array] | None:
        """Return where a weighted sum whose form vanishes on a plane changes sign, on a circle.

        The others stay zero there.  None where there is no such plane, and where the sum may have
        zeros without a change of sign.
        """
        if forms.shape != (1, 2, 2) or abs(forms).max() > self.limit:
            return None
        weights, kept = some.relations[:, 0], self.point.basis(held)
        scales = self.point.quotient.scales

        def total(start: float, step: float, part: float = 0.0) -> tuple[float, Array]:
            angle = start + part * step
            d = np.array([math.cos(angle), math.sin(angle)])
            q = self.point.q + ROUND * scales * (self.frame @ some.null_space @ d)
            there = projected(self.point.quotient, q, kept, ROUND / 2)
            return math.nan if there is None else float(weights @ there.distances[held]), d

        angles = np.linspace(0.0, math.tau, AROUND + 1)
        sums = np.array([total(angle, 0.0)[0] for angle in angles])
        low = abs(sums) < NEARLY * abs(sums).max()
        changes = np.flatnonzero(sums[:-1] * sums[1:] < 0)
        beside = {k + i for k in changes.tolist() for i in (-1, 0, 1, 2)}
        if np.isnan(sums).any() or not beside.issuperset(np.flatnonzero(low).tolist()):
            return None
        arcs = ((float(angles[k]), float(angles[k + 1] - angles[k])) for k in changes)
        return [sign_change(partial(total, start, step))[1] for start, step in arcs]

    def _entering(self, d: Array, opened: tuple[int, ...], held: list[int]) -> Iterator[Branch]:
        """Yield a direction if no function falls along it to first order."""
        if (self.slopes[list(opened)] @ d > -self.limit).all():
            yield d, frozenset(held)


def _positive(form: Array) -> tuple[Array, Array]:
    """Return eigenvalues and axes of a form or of its negative, whichever has the larger trace."""
    values, axes = np.linalg.eigh(form)
    return (values, axes) if values.sum() > 0 else (-values[::-1], axes[:, ::-1])
