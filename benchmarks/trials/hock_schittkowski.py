"""The problems of Hock and Schittkowski as polyhedra and energies.

W. Hock, K. Schittkowski, *Test Examples for Nonlinear Programming Codes*, Lecture Notes in
Economics and Mathematical Systems 187, Springer 1981, nos. 1 to 119.  Left out are those without
a closed formula (67 iterates, 88 to 92 need the roots of a transcendental equation) and the
numbers that the book does not use (58, 82, 94, 115).

The formulas are in `hs_001_050.py` and `hs_051_119.py`.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from benchmarks.trials import hs_001_050, hs_051_119
from benchmarks.trials.statements import Statement
from polycorner import Manifold, Polyhedron


@dataclass(frozen=True)
class Problem:
    """A problem of the collection.

    Attributes
    ----------
    name : str
        ``"HS1"`` to ``"HS119"``.
    symbols : tuple of sympy.Symbol
        The variables ``x1``, ``x2``, ...
    energy : sympy.Expr
        What is to be minimised.
    inequalities, equations : tuple of sympy.Expr
        ``g >= 0`` and ``h = 0``, without the bounds.
    bounds : tuple of (float or None, float or None)
        Bounds of the variables.
    start : tuple of float
        The standard start.
    best : float
        The best known value of the energy.
    """

    name: str
    symbols: tuple[sympy.Symbol, ...]
    energy: sympy.Expr
    inequalities: tuple[sympy.Expr, ...]
    equations: tuple[sympy.Expr, ...]
    bounds: tuple[tuple[float | None, float | None], ...]
    start: tuple[float, ...]
    best: float

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The feasible set, bounds included, on a Euclidean space without scales."""
        return Polyhedron(
            Manifold.euclidean([str(x) for x in self.symbols]),
            {**_named("g", self.inequalities), **self._walls()},
            _named("h", self.equations),
        )

    def _walls(self) -> dict[str, sympy.Expr]:
        walls = {}
        for x, (low, high) in zip(self.symbols, self.bounds, strict=True):
            if low is not None:
                walls[f"low_{x}"] = x - low
            if high is not None:
                walls[f"high_{x}"] = high - x
        return walls


def _named(letter: str, expressions: tuple[sympy.Expr, ...]) -> dict[str, sympy.Expr]:
    return {f"{letter}{i}": expression for i, expression in enumerate(expressions, 1)}


def problems(*names: str) -> Iterator[Problem]:
    """Yield the problems in the order of the book, or those named."""
    statements = {s.name: s for module in (hs_001_050, hs_051_119) for s in module.STATEMENTS}
    for name in sorted(names or statements, key=_number):
        yield _problem(statements[name])


def _number(name: str) -> int:
    return int(re.sub(r"\D", "", name))


def _problem(statement: Statement) -> Problem:
    n = len(statement.start)
    symbols = sympy.symbols([f"x{i}" for i in range(1, n + 1)], real=True)
    energy, inequalities, equations = statement.formulas(*symbols)
    lower, upper = (_each(bound, n) for bound in (statement.lower, statement.upper))
    return Problem(
        statement.name,
        tuple(symbols),
        sympy.sympify(energy),
        tuple(map(sympy.sympify, inequalities)),
        tuple(map(sympy.sympify, equations)),
        tuple(zip(lower, upper, strict=True)),
        tuple(map(float, statement.start)),
        float(statement.best),
    )


def _each(bound: Any, n: int) -> list[float | None]:
    if bound is None or isinstance(bound, int | float):
        return [bound] * n
    return [None if b is None or np.isinf(b) else b for b in bound]
