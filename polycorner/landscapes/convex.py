"""Landscapes of unions of flat pieces, in exact numbers.

Where all functions and the energy are affine, ``D`` is a union of convex pieces, and the part of a
piece where ``E <= c`` is connected or empty.  A connected set is no disjoint union of finitely many
closed ones: the components of ``{E <= c}`` are those of the graph of pieces whose least energy is
at most ``c``, joined in pairs if the least energy on their common part is at most ``c``.

``D`` is an intersection of unions; a piece takes one part of each.  Pairs that differ in one part
are enough: a point that two pieces have in common is in all that take each part from one of them,
and these lead from one to the other by such pairs.

Least energies are those of linear programmes (:mod:`~polycorner.landscapes.programmes`).
"""

import threading
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from heapq import heappop, heappush
from itertools import groupby, pairwise, product
from math import inf
from time import monotonic
from typing import Any

import numpy as np
from scipy.cluster.hierarchy import DisjointSet

from polycorner.formulas.ranges import outward
from polycorner.interrupts import first_interrupt
from polycorner.intervals.enclosures import Formulas
from polycorner.landscapes.barriers import Landscape, Minimum, Pass, Side
from polycorner.landscapes.programmes import Dictionary, ExactProgrammes, Point
from polycorner.landscapes.routes import Route
from polycorner.minimisation.problem import Problem
from polycorner.printing import number
from polycorner.progress import Progress, silent
from polycorner.proofs.lists.domains import domain
from polycorner.proofs.symbols import Symbols, evaluate, opened
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH

Choice = tuple[int, ...]  # the part of each union that a piece takes
Link = tuple[Fraction, Choice, Choice]


class ConvexPieces:
    """The pieces of a polyhedron of affine functions in a box, and an energy that is affine.

    ``rows`` ``(m, n + 1)`` are values at zero and derivatives of inequalities, equations, and the
    energy; the box is ``(n, 2)``.
    """

    def __init__(self, problem: Problem, rows: Array, box: Array) -> None:
        self.polyhedron = problem.polyhedron
        m = problem.inequalities
        equations = rows[m:-1]
        self.programmes = ExactProgrammes(np.vstack([rows[:-1], -equations]), rows[-1], box)
        self._held = range(m, m + 2 * len(equations))
        always, self.unions = self.polyhedron.unions
        self._always = sorted(always)

    def least(self, *choices: Choice) -> Dictionary | None:
        """Return the least energy on the common part of pieces, or None where there is none."""
        parts = {(k, j) for choice in choices for k, j in enumerate(choice)}
        some = {i for k, j in parts for i in self.unions[k][j]}
        return self.programmes.start.holding([*self._held, *self._always, *sorted(some)])

    def touch(self, one: Choice, two: Choice) -> Point:
        """Return a point of the least energy on the common part of two pieces that meet."""
        found = self.least(one, two)
        assert found is not None
        return self.programmes.point(found)

    def examined(
        self, cap: float, going: Callable[[int], bool], progress: Progress
    ) -> tuple[dict[Choice, Fraction], list[Link], Fraction | None]:
        """Return the least energies on pieces and on common parts of pairs, up to a cap.

        Parts of unions are taken one after the other, those of the least energies first, while it
        is ``going`` on with their number.  The last value is a lower bound of all that is left.
        """
        value, heights, links = self.programmes.value, dict[Choice, Fraction](), list[Link]()
        start, always = self.programmes.start, [*self._held, *self._always]
        waiting: list[tuple[Fraction, int, Choice, Dictionary, Iterable[int]]]
        waiting, taken = [(value(start), 0, (), start, always)], 0
        while waiting and going(taken):
            _, _, choice, before, part = heappop(waiting)
            taken += 1
            here = before.holding(part)
            if here is None or value(here) > cap:
                continue
            k = len(choice)
            if k < len(self.unions):
                for j, more in enumerate(self.unions[k]):
                    heappush(waiting, (value(here), -1 - k, (*choice, j), here, more))
                continue
            heights[choice] = value(here)
            for k, j in enumerate(choice):
                for other in range(j + 1, len(self.unions[k])):
                    both = here.holding(self.unions[k][other])
                    if both is not None and value(both) <= cap:
                        links.append((value(both), choice, (*choice[:k], other, *choice[k + 1 :])))
            note = f"{len(heights)} pieces, {len(links)} pairs that meet, {len(waiting)} wait"
            progress(float(taken), None, note)
        return heights, links, waiting[0][0] if waiting else None

    def values(self, point: Point) -> list[Fraction]:
        """Return the exact values of the inequalities."""
        m = len(self.polyhedron.functions)
        return list(self.programmes.rows[:m] @ np.array([Fraction(1), *point], dtype=object))

    def around(self, point: Point) -> Iterator[Choice]:
        """Yield the pieces that contain a point of the polyhedron."""
        values = self.values(point)
        holding = [
            [j for j, piece in enumerate(union) if all(values[i] >= 0 for i in piece)]
            for union in self.unions
        ]
        yield from product(*holding)

    def active(self, point: Point) -> tuple[str, ...]:
        """Return the names of the functions that vanish at a point and matter."""
        signs = [(x > 0) - (x < 0) for x in self.values(point)]
        found = frozenset[int]().union(*self.polyhedron.signs_to_pieces(signs))
        return tuple([self.polyhedron.names[i] for i in sorted(found)])


@dataclass(frozen=True, eq=False)
class _Join:
    """Where components merge: the way from a point on through pieces, to each of them."""

    height: Fraction
    point: Point
    ways: list[list[Choice]]


class ConvexTree:
    """The tree in which components of ``{E <= c}`` are born and merge as ``c`` rises.

    ``minima`` are the pieces that have the set of each local minimum in common, and ``joins`` are
    where components merge; the lowest are first in both.
    """

    def __init__(
        self, pieces: ConvexPieces, heights: Mapping[Choice, Fraction], links: Iterable[Link]
    ) -> None:
        self.minima: list[list[Choice]] = []
        self.joins: list[_Join] = []
        self._pieces, self._heights = pieces, heights
        self._lower: dict[Choice, Choice | None] = {}  # where descents go on from the minimum
        self._components: Any = DisjointSet()
        levels: defaultdict[Fraction, tuple[list[Choice], list[tuple[Choice, Choice]]]]
        levels = defaultdict(lambda: ([], []))
        for choice, height in sorted(heights.items()):
            levels[height][0].append(choice)
        for height, a, b in sorted(links):
            levels[height][1].append((a, b))
        for height in sorted(levels):
            self._rise(height, *levels[height])

    def _rise(
        self, height: Fraction, fresh: list[Choice], pairs: list[tuple[Choice, Choice]]
    ) -> None:
        """Let pieces and pairs of one height appear."""
        near: dict[Choice, list[Choice]] = {choice: [] for choice in fresh}
        flat: Any = DisjointSet(fresh)
        for a, b in pairs:
            for one, other in ((a, b), (b, a)):
                if one in near:
                    near[one].append(other)
            if a in near and b in near:
                flat.merge(a, b)
        merged: Any = DisjointSet()  # of the components below this height
        for some in flat.subsets() if fresh else ():
            self._plateau(height, sorted(some), near, merged)
        for a, b in pairs:
            if a not in near and b not in near:
                self._join(height, a, b, {a: [], b: []}, merged)
        for choice in fresh:
            self._components.add(choice)
        for a, b in pairs:
            self._components.merge(a, b)

    def _plateau(
        self, height: Fraction, some: list[Choice], near: dict[Choice, list[Choice]], merged: Any
    ) -> None:
        """Let pieces appear that are joined at their least energies."""
        exits = [(one, other) for one in some for other in near[one] if other not in near]
        if not exits:
            self.minima.append(some)
            self._lower |= _spread({some[0]: None}, near)
            return
        self._lower |= _spread(dict(reversed(exits)), near)
        back = _spread({exits[0][0]: None}, near)
        farther = {
            other: [*reversed(_followed(back, one)), *_followed(self._lower, other)]
            for one, other in reversed(exits)
        }
        self._join(height, *exits[0], farther, merged)

    def _join(
        self,
        height: Fraction,
        a: Choice,
        b: Choice,
        farther: Mapping[Choice, list[Choice]],
        merged: Any,
    ) -> None:
        """Join the components at a point where two pieces meet, and those farther along it.

        Nothing is noted if all that are farther along, the two among them, are joined already.
        """
        for choice in farther:
            merged.add(self._components[choice])
        if len({merged[self._components[choice]] for choice in farther}) < 2:
            return
        point = self._pieces.touch(a, b)
        near = (c for c in self._pieces.around(point) if self._heights[c] < height)
        ways: dict[Choice, list[Choice]] = {}
        for choice in near:
            ways.setdefault(self._components[choice], _followed(self._lower, choice))
        for choice, way in farther.items():
            ways.setdefault(self._components[choice], way)
        first = next(iter(ways))
        for component in ways:
            merged.add(component)
            merged.merge(first, component)
        self.joins.append(_Join(height, point, list(ways.values())))


def _spread(
    sources: Mapping[Choice, Choice | None], near: Mapping[Choice, list[Choice]]
) -> dict[Choice, Choice | None]:
    """Return the way back to the sources, and on, from all that are joined to them."""
    before, waiting = dict(sources), list(sources)
    for here in waiting:
        for there in near[here]:
            if there in near and there not in before:
                before[there] = here
                waiting.append(there)
    return before


def _followed(after: Mapping[Choice, Choice | None], start: Choice) -> list[Choice]:
    """Return a way from its start to its end."""
    way, there = [start], after[start]
    while there is not None:
        way.append(there)
        there = after[there]
    return way


def convex_landscape(
    problem: Problem,
    *,
    box: Any,
    cap: float = inf,
    max_pieces: int = SEARCH.max_boxes,
    max_seconds: float = inf,
    progress: Progress = silent,
) -> Landscape | None:
    """Return the landscape of an energy on a union of flat pieces, in exact numbers.

    Minima, passes and heights are exact; energies are the tightest doubles about them.  Passes
    are the points, or one point of each set, at which components merge; at several that are
    equally high, as many as it takes.  Routes are straight in each piece, and their vertices are
    the doubles next to rational ones.

    It is None where the manifold has other factors than lines, where a function or the energy is
    not affine with rational coefficients (doubles are rational).  The sides of the box are walls.
    A search that ends early, as after ``max_pieces`` pieces or at Ctrl-C, leaves what is known up
    to a lower cap.  Progress is called with the number of pieces that were examined, those with
    parts of the first unions only among them, None, and what was found in words.

    Examples
    --------
    Two valleys, one of which a wall divides, and the heights at which they are joined:

    >>> from polycorner import AllOf, AnyOf, Manifold, Polyhedron
    >>> from polycorner.minimisation.problem import pose
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> valleys = AnyOf(AllOf(y - x, y + x), AllOf(y - x + 3, y + x - 3))
    >>> wall = AnyOf(-x, x - 1 / 4, y - 1 / 2)
    >>> D = Polyhedron(M, AllOf(valleys, wall))
    >>> found = convex_landscape(pose(D, y), box=[(-4, 6), (0, 4)])
    >>> [one.point.tolist() for one in found.minima], [one.energy for one in found.merges]
    ([[0.0, 0.0], [3.0, 0.0], [0.25, 0.25]], [(0.5, 0.5), (1.5, 1.5)])
    """
    manifold = problem.polyhedron.manifold
    if manifold.factors or np.isfinite(manifold.periods).any():
        return None
    whole = domain(manifold, box)
    rows = _affine(problem)
    if rows is None:
        return None
    sides = [[*map(Fraction, side)] for side in zip(whole.lower, whole.upper, strict=True)]
    pieces = ConvexPieces(problem, rows, np.array(sides, dtype=object))
    stop, deadline = threading.Event(), monotonic() + max_seconds

    def going(taken: int) -> bool:
        return taken < max_pieces and monotonic() < deadline and not stop.is_set()

    with first_interrupt(stop.set):
        heights, links, left = pieces.examined(cap, going, progress)
    notes: tuple[str, ...] = ()
    if left is not None:
        heights = {choice: height for choice, height in heights.items() if height < left}
        links = [link for link in links if link[0] < left]
        cap = outward(left)[0]
        notes = (f"The search ended early; nothing is known above the energy {number(cap)}.",)
    tree = ConvexTree(pieces, heights, links)
    numbers = {some[0]: k for k, some in enumerate(tree.minima)}
    return Landscape(
        problem,
        tuple([_minimum(pieces, k, some) for k, some in enumerate(tree.minima)]),
        tuple([_pass(pieces, k, join, numbers) for k, join in enumerate(tree.joins)]),
        proved=True,
        cap=cap,
        notes=notes,
    )


def _affine(problem: Problem) -> Array | None:
    """Return values at zero and derivatives of affine functions; None if there are others."""
    symbols = Symbols()
    formulas = Formulas(problem.functions, problem.polyhedron.manifold)
    inputs = opened(formulas, symbols)
    monomials = [(), *(next(iter(p)) for p in inputs)]
    rows = []
    for p in evaluate(formulas.graph, formulas.outputs, inputs, symbols):
        if p is None or not set(p) <= set(monomials):
            return None
        rows.append([p.get(monomial, Fraction(0)) for monomial in monomials])
    return np.array(rows, dtype=object)


def _minimum(pieces: ConvexPieces, orbit: int, some: list[Choice]) -> Minimum:
    found = [one for choice in some if (one := pieces.least(choice)) is not None]
    point = pieces.programmes.point(found[0])
    # Connected sets of one point each are one point.
    isolated = all(map(pieces.programmes.isolated, found))
    return Minimum(
        _rounded(point),
        outward(pieces.programmes.value(found[0])),
        pieces.active(point) if isolated else (),
        "isolated" if isolated else "locus",
        orbit,
    )


def _pass(pieces: ConvexPieces, orbit: int, join: _Join, numbers: Mapping[Choice, int]) -> Pass:
    sides = [Side(numbers[way[-1]], _route(pieces, join.point, way)) for way in join.ways]
    return Pass(
        _rounded(join.point),
        outward(join.height),
        pieces.active(join.point),
        0,
        "tip",
        tuple(sides),
        orbit,
    )


def _route(pieces: ConvexPieces, start: Point, way: list[Choice]) -> Route:
    """Return the way down from a point through pieces to the minimum on the last one.

    Each step is within one convex piece, and its ends are at most as high as the start.
    """
    last = pieces.least(way[-1])
    assert last is not None
    touching = [pieces.touch(a, b) for a, b in pairwise(way)]
    points = [k for k, _ in groupby([start, *touching, pieces.programmes.point(last)])]
    energies = [pieces.programmes.height(point) for point in points]
    return Route(
        np.array([_rounded(point) for point in points]),
        _rounded(energies),
        outward(max(energies))[1],
        verified=True,
    )


def _rounded(numbers: Iterable[Fraction]) -> Array:
    return np.array([float(x) for x in numbers])
