"""Symmetries of the equations of a face: images, and involutions on unknowns and equations.

An involution ``g`` divides the unknowns into even and odd parts, ``x = s + u`` with ``g s = s`` and
``g u = -u``, and so it does with the equations: the even parts of ``F(s + e u)`` are even in ``e``,
the odd ones are odd.  In *adapted* coordinates ``y`` each of the two is a place: of ``x_i`` and
``x_j``, which ``g`` exchanges with a sign, ``y_i`` is the even part and ``y_j`` the odd one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, islice
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.branches.diagram import Arc, BranchKind, Diagram
from polycorner.branches.system import Face
from polycorner.intervals.balls import Ball, ball
from polycorner.minimisation.methods import stationary_on
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.proofs.lists.images import Motion, functions_moved, motion, permutation
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import cached_property


@dataclass(frozen=True)
class Image:
    """A symmetry ``g``: a signed permutation of coordinates that keeps energy and parameters.

    Attributes
    ----------
    order, signs : tuple of int
        ``(g q)_i = signs_i q_{order_i}``.
    functions : tuple of int
        ``f_i(g q) = f_{functions_i}(q)``; these have equal weights.  -1 where ``g`` takes a
        function to none of the set.
    equations : tuple of (int, int)
        ``h_j(g q) = s h_k(q)`` for the pairs ``(k, s)``; of ``h_j`` and ``h_k`` weights are equal.
    """

    order: tuple[int, ...]
    signs: tuple[int, ...]
    functions: tuple[int, ...]
    equations: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Mirror:
    """An involution on the unknowns and on the equations of a face.

    Attributes
    ----------
    unknowns, equations : tuple of (int, int, int)
        ``(i, j, s)`` where ``i`` and ``j`` are exchanged with the sign ``s``, and ``(j, j, -1)``
        where the sign of ``j`` changes.  Equations correspond to unknowns, and come in their order.
    """

    unknowns: tuple[tuple[int, int, int], ...]
    equations: tuple[tuple[int, int, int], ...]

    @classmethod
    def of(
        cls, g: Image, face: Face, dimension: int, equations: Sequence[int] = ()
    ) -> "Mirror | None":
        """Return what an image is on a face; None unless it is an involution there.

        ``dimension`` coordinates and parameters come before the multipliers; ``equations`` are the
        numbers of those that are held.
        """
        n, moved = len(g.order), [g.functions[i] for i in face]
        turned = [g.equations[j] for j in equations]
        if set(moved) != set(face) or {k for k, _ in turned} != set(equations):
            return None
        places = {j: n + len(face) + k for k, j in enumerate(equations)}
        order = [*g.order, *(n + face.index(i) for i in moved), *(places[k] for k, _ in turned)]
        signs = [*g.signs, *[1] * len(face), *(s for _, s in turned)]
        if not all(order[j] == i and signs[i] == signs[j] for i, j in enumerate(order)):
            return None
        pairs = [(i, j, s) for i, (j, s) in enumerate(zip(order, signs, strict=True))
                 if i < j or (i == j and s < 0)]  # fmt: skip
        past = dimension - n
        return cls(
            tuple((i + past * (i >= n), j + past * (j >= n), s) for i, j, s in pairs), tuple(pairs)
        )

    @cached_property
    def odd(self) -> frozenset[int]:
        """The places of the odd unknowns."""
        return frozenset(j for _, j, _ in self.unknowns)

    @cached_property
    def odd_equations(self) -> frozenset[int]:
        """The places of the odd equations."""
        return frozenset(j for _, j, _ in self.equations)

    def point(self, y: "Sequence[Ball]", eps: Any) -> "list[Ball]":
        """Return ``s + eps u`` for adapted coordinates."""
        x = list(y)
        for i, j, s in self.unknowns:
            x[i], x[j] = y[i] + eps * y[j], s * (y[i] - eps * y[j])
            if i == j:
                x[j] = eps * y[j]
        return x

    def vector(self, y: "Sequence[Ball]") -> "list[Ball]":
        """Return ``u`` for adapted coordinates."""
        u = [ball(0)] * len(y)
        for i, j, s in self.unknowns:
            u[i], u[j] = y[j], y[j] if i == j else -s * y[j]
        return u

    def parts(self, x: "Sequence[Ball]") -> "list[Ball]":
        """Return adapted coordinates."""
        return _halved(x, self.unknowns)

    def sides(self, left: "Sequence[Ball]") -> "list[Ball]":
        """Return even and odd parts of the equations, at their places."""
        return _halved(left, self.equations)

    def adapted(self, rows: "list[list[Ball]]") -> "list[list[Ball]]":
        """Return the derivatives of even and odd equations by adapted coordinates."""
        turned = [list(row) for row in rows]
        for row, old in zip(turned, rows, strict=True):
            for i, j, s in self.unknowns:
                if i != j:
                    row[i], row[j] = old[i] + s * old[j], old[i] - s * old[j]
        columns = [self.sides(column) for column in zip(*turned, strict=True)]
        return [list(row) for row in zip(*columns, strict=True)]


def _halved(x: "Sequence[Ball]", pairs: tuple[tuple[int, int, int], ...]) -> "list[Ball]":
    y = list(x)
    for i, j, s in pairs:
        if i != j:
            y[i], y[j] = (x[i] + s * x[j]) / 2, (x[i] - s * x[j]) / 2
    return y


def images(lifted: Problem, symmetry: Symmetry, diagram: Diagram, most: int) -> list[Image]:
    """Return finite symmetries for all values of the parameters: those given, those found.

    ``lifted`` has the formulas' parameters as further coordinates.  Branch points of the diagram
    suggest what is found, by ``most`` signed permutations for two arcs at most.

    Raises
    ------
    ValueError
        If elements of the symmetry are no signed permutations, or not shown to be symmetries.
    """
    manifold, n = lifted.polyhedron.manifold, diagram.problem.dimension
    kept, found = tuple(range(n, manifold.size)), dict[Motion, Any]()
    for element in symmetry.elements:

        def carried(q: Array, apply: Any = element.apply) -> Array:
            return np.concatenate([np.asarray(apply(q[:n])), q[n:]])

        g = motion(manifold, carried, "symmetry")
        found[g] = functions_moved(lifted, g)
        if permutation(lifted, g) is None:
            checks.refuse("symmetry", "elements that expanded formulas show to be symmetries", g)
    for order, signs in _exchanges(diagram, most):
        g = Motion((*order, *kept), (*signs, *[1] * len(kept)), (0,) * manifold.size)
        if g not in found:
            found[g] = functions_moved(lifted, g)
    return [
        Image(g.order[:n], g.signs[:n], *moved)
        for g, moved in found.items() if moved is not None and not any(g.halves)
    ]  # fmt: skip


def _exchanges(diagram: Diagram, most: int) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Yield signed permutations that seem to exchange two arcs at a branch point and keep others.

    As pairs of ``order`` and ``signs``, ``(g q)_i = signs_i q_{order_i}``; each is its own inverse.
    """
    problem, value = diagram.problem, diagram.problem.energy.value
    for k in (k for k, e in enumerate(diagram.events) if e.kind is BranchKind.BRANCH):
        arcs = [arc for arc in diagram.arcs if k in arc.events]
        for one, two in combinations(arcs, 2):
            low = max(one.parameters[0], two.parameters[0])
            high = min(one.parameters[-1], two.parameters[-1])
            if not low < high:
                continue
            some = (0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high)
            places = [[_place(diagram, arc, v) for arc in (one, two)] for v in some]
            other = [
                _place(diagram, arc, arc.parameters.mean())
                for arc in arcs if arc not in (one, two)
            ]  # fmt: skip
            before = np.array([*(x for pair in places for x in pair), *other])
            after = np.array([*(x for pair in places for x in pair[::-1]), *other])
            # Beside the arc the energy tells apart what exchanges these points.
            probe = before[0] + problem.scales * np.linspace(0.01, 0.02, len(problem.scales))
            for g in islice(_exchanging(before / problem.scales, after / problem.scales), most):
                image = np.array(g[1]) * probe[list(g[0])]
                if np.isclose(value(image), value(probe), rtol=DEFAULT.alike, atol=DEFAULT.alike):
                    yield g


def _place(diagram: Diagram, arc: Arc, value: float) -> Array:
    """Return the point of an arc at a value of the parameter, by Newton's method."""
    problem, near = diagram.problem_at(value), arc.at(value)
    return stationary_on(problem.polyhedron, problem.energy, near, arc.active).point


def _exchanging(before: Array, after: Array) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Yield the involutions that take points ``(k, n)`` to others, those that move least first."""
    n, near = before.shape[1], DEFAULT.near
    taken = np.array([
        [[np.allclose(y, s * x, rtol=near, atol=near) for s in (1, -1)] for x in before.T]
        for y in after.T
    ])  # fmt: skip
    taken &= taken.transpose(1, 0, 2)
    waiting = [(tuple(range(n)), (1,) * n, frozenset(range(n)))]
    while waiting:
        order, signs, left = waiting.pop()
        if not left:
            yield order, signs
            continue
        i = min(left)
        fits = [(j, k) for j in sorted(left) for k in (0, 1) if taken[i, j, k]]
        for j, k in reversed(fits):
            moved, turned = list(order), list(signs)
            moved[i], moved[j] = j, i
            turned[i] = turned[j] = 1 - 2 * k
            waiting.append((tuple(moved), tuple(turned), left - {i, j}))
