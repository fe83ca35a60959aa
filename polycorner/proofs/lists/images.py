"""Boxes that need not be searched, because a symmetry carries them to others.

A symmetry is a signed permutation of the coordinates with shifts by half a period.  Of each orbit
in the domain a point with the largest ``w . q`` is kept: a box is dropped if some symmetry carries
it into the domain and makes ``w . q`` larger at each of its points, circles being cut at half a
period.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.intermediate import carried
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

MOST_ELEMENTS = 4096


@dataclass(frozen=True)
class Motion:
    """A symmetry ``q -> signs * q[order] + turns * periods``.

    ``signs`` are 1 or -1; ``halves`` are half periods that are added, 0 or 1, and 0 on lines.
    """

    order: tuple[int, ...]
    signs: tuple[int, ...]
    halves: tuple[int, ...]

    def shifts(self, manifold: Manifold) -> Array:
        """Return what is added, ``(n,)``."""
        pairs = zip(self.halves, manifold.periods, strict=True)
        return np.array([half * period / 2 if half else 0.0 for half, period in pairs])

    def __call__(self, q: Array, manifold: Manifold) -> Array:
        """Return the image of points ``(..., n)``."""
        moved = np.array(self.signs) * q[..., list(self.order)] + self.shifts(manifold)
        return manifold.wrap(moved)

    def then(self, other: "Motion") -> "Motion":
        """Return this motion followed by another one."""
        order = tuple(self.order[i] for i in other.order)
        signs = tuple(s * self.signs[i] for s, i in zip(other.signs, other.order, strict=True))
        halves = tuple(
            (h + self.halves[i]) % 2 for h, i in zip(other.halves, other.order, strict=True)
        )
        return Motion(order, signs, halves)


def motion(manifold: Manifold, apply: Callable[[Array], Array], argument: str) -> Motion:
    """Recognise a signed permutation with shifts by half periods.

    Raises
    ------
    ValueError
        For any other map.
    """
    n = manifold.dimension
    at = np.asarray(apply(np.zeros(n)), dtype=np.float64)
    periods = np.array(manifold.periods)
    circle = np.isfinite(periods)
    halves = np.zeros(n, dtype=int)
    with np.errstate(invalid="ignore"):
        turns = np.where(circle, 2 * at / np.where(circle, periods, 1.0), 0.0)
    halves = np.round(turns).astype(int) % 2
    # An eighth of a period: the shortest difference of two images is that of the step itself.
    steps = 0.125 * np.where(circle, periods, 1.0)
    columns = np.array(
        [manifold.difference(np.asarray(apply(step * unit)), at) / step
         for step, unit in zip(steps, np.eye(n), strict=True)]
    )  # fmt: skip
    # Whatever the map is, this is the signed permutation nearest to it; the probe below decides.
    order = abs(columns).argmax(axis=0)
    signs = np.sign(columns[order, np.arange(n)]).astype(int)
    found = Motion(tuple(order.tolist()), tuple(signs.tolist()), tuple(halves.tolist()))
    # Coordinates that differ from each other: a wrong order or sign shows.
    probe = np.array([0.1 * (k + 1) / n for k in range(n)]) * steps
    error = abs(manifold.difference(np.asarray(apply(probe)), found(probe, manifold)))
    # A circle goes to a circle of its period, and no coordinate is used twice.
    same = bool((periods[order] == periods).all()) and sorted(order.tolist()) == list(range(n))
    if not same or error.max() > DEFAULT.alike * max(1.0, abs(probe).max()):
        checks.refuse(
            argument, "a signed permutation of the coordinates with shifts by half periods", apply
        )
    return found


def closed(
    generating: Mapping[Motion, tuple[int, ...]], n: int, functions: int
) -> dict[Motion, tuple[int, ...]]:
    """Return the group that motions generate, without the identity, and its permutations.

    ``f_i(g q) = f_{p(i)}(q)`` for the permutation ``p`` of ``g``; those of products are products.
    """
    identity = Motion(tuple(range(n)), (1,) * n, (0,) * n)
    found, waiting = {identity: tuple(range(functions))}, [identity]
    while waiting:
        element = waiting.pop()
        for g, p in generating.items():
            new = element.then(g)
            if new not in found:
                found[new] = tuple(found[element][i] for i in p)
                waiting.append(new)
        # Checked as it grows: generators without a finite group would never end.
        if len(found) > MOST_ELEMENTS:
            checks.refuse("symmetry", f"a group of at most {MOST_ELEMENTS} elements", "more")
    # An order of its own: saved searches must not depend on that of generators.
    ordered = sorted(found, key=lambda g: (g.order, g.signs, g.halves))
    return {g: found[g] for g in ordered if g != identity}


def permutation(problem: Problem, g: Motion) -> tuple[int, ...] | None:
    """Return where a motion takes each inequality, if formulas show that it is a symmetry.

    The energy stays the same, inequalities go to inequalities and their tree to itself; an
    equation may change its sign.  ``f_i(g q) = f_{p(i)}(q)``.  None where expanding the formulas
    does not show this.
    """
    moved, d = functions_moved(problem, g), problem.polyhedron
    names = moved[0] if moved else (-1,)
    if -1 in names:
        return None
    # The tree counts, too: the same functions may be joined by and, or by or.
    pieces = set(d.signs_to_pieces([0] * len(names)))
    return names if {frozenset(names[i] for i in piece) for piece in pieces} == pieces else None


def functions_moved(
    problem: Problem, g: Motion
) -> tuple[tuple[int, ...], tuple[tuple[int, int], ...]] | None:
    """Return where a motion that keeps energy and equations takes each inequality and equation.

    ``f_i(g q) = f_{p(i)}(q)``, and ``p(i) = -1`` if that is not shown to be a function of the set;
    ``h_j(g q) = s h_k(q)`` for the pairs ``(k, s)``.  None where expanding the formulas does not
    show that energy and equations are kept.
    """
    import sympy

    d = problem.polyhedron
    symbols = d.manifold.symbols
    moved = {}
    for k, symbol in enumerate(symbols):
        shift = g.halves[k] * _exact_half(d.manifold.periods[k])
        moved[symbol] = g.signs[k] * symbols[g.order[k]] + shift
    before = _normal_forms(problem)
    after = {f: _normal(_bound(f).xreplace(moved)) for f in problem.functions}
    if sympy.expand(before[problem.energy] - after[problem.energy]) != 0:
        return None
    equations = []
    for h in d.equations:
        # The zero set of -h is that of h, but -f >= 0 is another set than f >= 0.
        pairs = product(enumerate(d.equations), (1, -1))
        fits = [(k, s) for (k, f), s in pairs if sympy.expand(after[h] - s * before[f]) == 0]
        if not fits:
            return None
        equations.append(fits[0])
    images = ([j for j, k in enumerate(d.functions) if before[k] == after[f]] for f in d.functions)
    return tuple([found[0] if found else -1 for found in images]), tuple(equations)


def expanded(f: SmoothFunction) -> "sympy.Expr":
    """Return a function's expression with its parameters, expanded."""
    return _normal(_bound(f))


@lru_cache(maxsize=8)
def _normal_forms(problem: Problem) -> "dict[SmoothFunction, sympy.Expr]":
    return {f: _normal(_bound(f)) for f in problem.functions}


def _exact_half(period: float) -> "sympy.Expr":
    import sympy

    if not np.isfinite(period):
        return sympy.Integer(0)
    turns = period / np.pi
    # The double nearest to 2 pi stands for 2 pi; else sin(q + period) would not simplify.
    whole = sympy.pi * round(turns) if turns == round(turns) else sympy.Rational(period)
    return whole / 2


def _bound(f: SmoothFunction) -> "sympy.Expr":
    """Return a function's expression with its parameters."""
    import sympy

    expression = f.expression
    pairs = zip(f.family.parameters, f.parameters, strict=True)
    # Exact values of doubles: decimals of SymPy would be compared up to rounding.
    known = {name: sympy.Rational(value) for name, value in pairs}
    found = {s: known[s.name] for s in expression.free_symbols if s.name in known}
    return expression.xreplace(found)


def _normal(expression: "sympy.Expr") -> "sympy.Expr":
    """Return a normal form: arguments of all functions expanded."""
    import sympy

    return sympy.expand(expression, deep=True)


def dropped(
    lower: Array,
    upper: Array,
    motions: Sequence[Motion],
    weights: Array,
    domain: Domain,
) -> NDArray[np.bool_]:
    """Return which boxes ``(B, n)`` a symmetry carries to others, see the module."""
    manifold = domain.manifold
    half = np.array(manifold.periods) / 2
    orders = np.array([g.order for g in motions])
    signs = np.array([g.signs for g in motions], dtype=np.float64)
    back = np.zeros(signs.shape)  # w . (g q) = back . q + w . shifts
    np.put_along_axis(back, orders, weights * signs, axis=1)
    shifts = np.array([g.shifts(manifold) for g in motions])
    sides = np.maximum(domain.lower, -half), np.minimum(domain.upper, half)
    return carried(
        (lower, upper),
        (orders, signs, shifts, back - weights),
        weights,
        (np.array(manifold.periods), *sides),
        1e-9,  # scale units by which w . q has to grow, so that no chain of images is endless
    )


def weights(domain: Domain) -> Array:
    """Return weights whose sums tell images apart: decreasing, without common multiples."""
    n = len(domain.lower)
    units = np.where(domain.units > 0, domain.units, np.inf)
    return np.array([0.6180339887498949**k for k in range(n)]) / units
