"""Linear relations between functions: planes through a line, circles of a pencil, opposite signs.

Where ``sum c_i f_i + sum d_j h_j = 0`` everywhere and ``c_i`` is not 0, ``f_i`` vanishes wherever
the other functions and the equations do: it takes no part in isolating a point.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.images import expanded
from polycorner.tolerances import DEFAULT
from polycorner.values import Value

MORE = 6  # points at which values are compared, beyond the number of functions
MOST_DENOMINATOR = 10_000


@dataclass(frozen=True)
class Relation(Value):
    """Weights with which inequalities and equations add up to nothing.

    Attributes
    ----------
    rows : tuple of int
        Inequalities, all with weights that are not 0.
    weights : tuple of Fraction
        Theirs, then those of the equations.
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
        values = np.array([problem.evaluate(q, 0)[0][every] for q in points])
    if not np.isfinite(values).all():
        return None
    sizes, vectors = np.linalg.svd(values)[1:]
    if not sizes[-1] <= DEFAULT.alike / 10 * sizes[0]:
        return None
    guess = vectors[-1] / vectors[-1][abs(vectors[-1]).argmax()]
    weights = [Fraction(x).limit_denominator(MOST_DENOMINATOR) for x in guess.tolist()]
    held = tuple([i for i, w in zip(rows, weights, strict=False) if w])
    functions = problem.functions
    total = sum(
        sympy.Rational(w.numerator, w.denominator) * expanded(functions[i])
        for i, w in zip(every, weights, strict=True)
    )
    if not held or sympy.expand(total, deep=True) != 0:
        return None
    own = [w for w in weights[: len(rows)] if w]
    return Relation(held, (*own, *weights[len(rows) :]))
