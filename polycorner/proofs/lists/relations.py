"""Linear relations between functions, and functions that are multiples of each other.

Planes through a line are related, and circles of a pencil.  Where ``sum c_i f_i + sum d_j h_j = 0``
everywhere and ``c_i`` is not 0, ``f_i`` vanishes wherever the other functions and the equations do:
it takes no part in isolating a point.

Multiples say the same, or together that a function vanishes.  Of positive multiples of each other
one is kept; a multiple of an equation holds wherever that does; and ``f >= 0`` with ``-f >= 0`` in
one branch is the equation ``f = 0``.  Where such functions vanish their gradients are dependent, on
whole faces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.proofs.lists.branches import conjunctions
from polycorner.proofs.lists.images import expanded
from polycorner.tolerances import DEFAULT
from polycorner.values import Value

MORE = 6  # points at which values are compared, beyond the number of functions
MOST_DENOMINATOR = 10_000
PROBES = 4  # points at which functions are compared before their formulas are
Literal = tuple[int, int]  # a function, equations after inequalities, and a sign


@dataclass(frozen=True)
class Relation(Value):
    """Weights with which inequalities and equations add up to nothing.

    No weight of an inequality is 0; those of the equations come last.
    """

    rows: tuple[int, ...]
    weights: tuple[Fraction, ...]


def relation(problem: Problem, rows: Sequence[int]) -> Relation | None:
    """Return a relation between some inequalities and the equations, or None if none is shown.

    It is guessed from values at some points and shown with expanded formulas.
    """
    import sympy

    m = problem.inequalities
    every = [*rows, *range(m, problem.rows - 1)]
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (len(every) + MORE, problem.dimension)) * problem.scales
    with np.errstate(all="ignore"):
        # More points than functions: a relation at all of them is hardly an accident.
        values = np.array([problem.evaluate(q, 0)[0][every] for q in points])
    if not np.isfinite(values).all():
        return None
    sizes, vectors = np.linalg.svd(values)[1:]
    # No relation in numbers: formulas are not expanded, which is slow.
    if not sizes[-1] <= DEFAULT.alike / 10 * sizes[0]:
        return None
    # The largest weight becomes 1, so that the others are likely to be small fractions.
    guess = vectors[-1] / vectors[-1][abs(vectors[-1]).argmax()]
    weights = [Fraction(x).limit_denominator(MOST_DENOMINATOR) for x in guess.tolist()]
    held = tuple([i for i, w in zip(rows, weights, strict=False) if w])
    functions = problem.functions
    total = sum(
        sympy.Rational(w.numerator, w.denominator) * expanded(functions[i])
        for i, w in zip(every, weights, strict=True)
    )
    # Expanding shows zero only, never that something is not: None says nothing.
    if not held or sympy.expand(total, deep=True) != 0:
        return None
    own = [w for w in weights[: len(rows)] if w]
    return Relation(held, (*own, *weights[len(rows) :]))


@dataclass(frozen=True, eq=False)
class Pieces:
    """A set as a union of polyhedra, in none of which functions are multiples of each other.

    Branches with the same equations are one part; ``alike`` has the name of the function of which
    each one is a multiple, by name.
    """

    parts: tuple[Polyhedron, ...]
    alike: Mapping[str, str]


def pieces(polyhedron: Polyhedron) -> Pieces:
    """Return a set as a union of polyhedra without multiples."""
    return _pieces(polyhedron, _literals(polyhedron))


def without_multiples(polyhedron: Polyhedron) -> Polyhedron:
    """Return the same set as one polyhedron, in which equations of single branches remain."""
    literals = _literals(polyhedron)
    found = _pieces(polyhedron, literals).parts
    return found[0] if len(found) == 1 else _of_the_first(polyhedron, literals)


def _pieces(polyhedron: Polyhedron, literals: list[Literal]) -> Pieces:
    m = len(polyhedron.functions)
    names = (*polyhedron.names, *polyhedron.equation_names)
    alike = {name: names[i] for name, (i, _) in zip(names, literals, strict=True)}
    if not _has_equations(literals, m):
        return Pieces((_of_the_first(polyhedron, literals),), alike)
    branches: dict[frozenset[int], list[frozenset[Literal]]] = {}
    for mask in conjunctions(polyhedron):
        required = {literals[i] for i in np.flatnonzero(mask)}
        # f >= 0 and -f >= 0 in one branch.
        held = frozenset(i for i, sign in required if i < m and (i, -sign) in required)
        rest = frozenset(one for one in required if one[0] < m and one[0] not in held)
        branches.setdefault(held, []).append(rest)
    parts = [_part(polyhedron, literals, held, rests) for held, rests in branches.items()]
    return Pieces(tuple(parts), alike)


def _has_equations(literals: list[Literal], m: int) -> bool:
    """Whether some inequality is a multiple of an equation, or the opposite of another one."""
    signs = dict.fromkeys(literals[:m])
    return any(i >= m or (i, -sign) in signs for i, sign in signs)


def _of_the_first(polyhedron: Polyhedron, literals: list[Literal]) -> Polyhedron:
    """Return the set with the first of positive multiples in the place of each of them."""
    # The first, so that names of a list do not depend on how multiples were found.
    first = [literals.index(one) for one in literals[: len(polyhedron.functions)]]
    if first == list(range(len(first))):
        return polyhedron

    def part(tree: Any) -> Any:
        if isinstance(tree, int):
            return polyhedron.functions[first[tree]]
        parts = list(dict.fromkeys(part(child) for child in tree.children))
        return AnyOf(*parts) if tree.union else AllOf(*parts)

    return Polyhedron(
        polyhedron.manifold,
        [part(polyhedron.tree)],
        list(polyhedron.stated),
        annotations=polyhedron.annotations,
    )


def _part(
    polyhedron: Polyhedron,
    literals: list[Literal],
    held: frozenset[int],
    rests: list[frozenset[Literal]],
) -> Polyhedron:
    """Return the union of branches that have the same equations."""
    functions = polyhedron.functions
    least = [rest for rest in dict.fromkeys(rests) if not any(other < rest for other in rests)]
    branches = [[functions[k] for k in sorted(map(literals.index, rest))] for rest in least]
    parts = [AnyOf(*(AllOf(*branch) for branch in branches))] if all(branches) else []
    equations = [*polyhedron.stated, *(functions[i] for i in sorted(held))]
    return Polyhedron(polyhedron.manifold, parts, equations, annotations=polyhedron.annotations)


def _literals(polyhedron: Polyhedron) -> list[Literal]:
    """Return for each function one of which it is a multiple, and the sign of the multiple.

    This is the first inequality, or an equation if there is such a one.
    """
    rng = np.random.default_rng(0)
    size = polyhedron.manifold.size
    points = rng.uniform(-1, 1, (PROBES, size)) * polyhedron.manifold.scale_array
    functions = (*polyhedron.functions, *polyhedron.equations)
    m, stated = len(polyhedron.functions), len(polyhedron.stated)
    with np.errstate(all="ignore"):
        values = np.vstack([polyhedron.values(points).T, polyhedron.equation_values(points).T])
        units = values / np.linalg.norm(values, axis=1, keepdims=True)
    found: dict[int, Literal] = {}
    # Equations first: a multiple of one is dropped for its sake, not the other way round.
    for j in (*range(m, m + stated), *range(m)):
        found[j] = (j, 1)
        for i in [i for i, (first, _) in found.items() if first == i and i != j]:
            near = [s for s in (1, -1) if abs(units[i] - s * units[j]).max() < DEFAULT.alike]
            if near and (sign := _multiple(functions[j], functions[i])):
                found[j] = (i, sign)
                break
    return [found.get(j, (j, 1)) for j in range(len(functions))]


def _multiple(f: SmoothFunction, g: SmoothFunction) -> int:
    """Return the sign of ``c`` if expanded formulas show that ``f = c g``, and 0 if not."""
    import sympy

    one, other = expanded(f), expanded(g)
    ratio = sympy.cancel(one / other) if other != 0 else sympy.Integer(0)
    # An unknown sign (None) is not good enough: the set would change with it.
    if not (ratio.is_number and (ratio.is_positive or ratio.is_negative)):
        return 0
    if sympy.expand(one - ratio * other, deep=True) != 0:
        return 0
    return 1 if ratio.is_positive else -1
