"""Random energies on random polyhedra, such as strangers might write: seeded, so reproducible.

Formulas are trees of sums, products, quotients, powers, roots, exponentials, logarithms, circular
functions, ``Abs``, ``Max``, ``Min`` and ``Piecewise``, in one to four variables on lines and
circles.  A quarter of the problems is degenerate by construction: vanishing gradients, repeated and
redundant contacts, flat energies, starts on singular points.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from sympy import Abs, Integer, Max, Min, Piecewise, Rational, atan, cos, exp, log, sin, sqrt, tanh

from polycorner import AllOf, AnyOf, Manifold, Polyhedron

Expr = sympy.Expr
Generator = np.random.Generator
Point = tuple[float, ...]
# Energy, inequalities, equations, start, special point.
Posed = tuple[Expr, tuple[Any, ...], tuple[Expr, ...], Point, Point]


@dataclass(frozen=True)
class Problem:
    """Formulas; a tuple among the inequalities is a union of its members.

    Attributes
    ----------
    name : str
        Seed and number.
    symbols : tuple of sympy.Symbol
        The coordinates.
    circles : tuple of bool
        Which of them have the period ``2 pi``.
    energy : sympy.Expr
        What is to be minimised.
    inequalities, equations : tuple
        ``g >= 0`` and ``h = 0``.
    start : tuple of float
        Where the search starts.
    special : tuple of float
        A point with simple coordinates, to be certified as it is.
    """

    name: str
    symbols: tuple[sympy.Symbol, ...]
    circles: tuple[bool, ...]
    energy: Expr
    inequalities: tuple[Any, ...]
    equations: tuple[Expr, ...]
    start: Point
    special: Point

    @cached_property
    def manifold(self) -> Manifold:
        """Lines and circles, without scales."""
        periods = tuple(2 * math.pi if circle else math.inf for circle in self.circles)
        return Manifold(tuple(map(str, self.symbols)), periods=periods)

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The feasible set."""
        parts = [AnyOf(*g) if isinstance(g, tuple) else g for g in self.inequalities]
        return Polyhedron(self.manifold, AllOf(*parts), list(self.equations))

    @property
    def flat_inequalities(self) -> list[Expr]:
        """Every union as one expression, with ``Max``."""
        return [Max(*g) if isinstance(g, tuple) else g for g in self.inequalities]

    def __repr__(self) -> str:
        """Return everything needed to pose it again."""
        kinds = ["circle" if circle else "line" for circle in self.circles]
        return (
            f"{self.name}: {dict(zip(map(str, self.symbols), kinds, strict=True))}, "
            f"energy {self.energy}, g {list(self.inequalities)}, h {list(self.equations)}, "
            f"start {self.start}, special {self.special}"
        )


def problems(count: int, seed: int = 1) -> Iterator[Problem]:
    """Yield the first problems of a seed; every problem has a generator of its own."""
    for number in range(count):
        yield problem(seed, number)


def problem(seed: int, number: int) -> Problem:
    """Return one problem by its number."""
    g = np.random.default_rng([seed, number])
    n = int(g.choice([1, 2, 3, 4], p=[0.15, 0.45, 0.25, 0.15]))
    circles = tuple(bool(g.random() < 0.2) for _ in range(n))
    x = tuple(sympy.symbols(list("xyzw"[:n]), real=True))
    start = tuple(float(v) for v in g.integers(-8, 9, n) / 4)
    make = _degenerate if g.random() < 0.35 and not any(circles) else _generic
    return Problem(f"{seed}/{number}", x, circles, *make(g, x, circles, start))


# ------------------------------------------------------------------------------------ generic ones


def _generic(g: Generator, x: tuple[Any, ...], circles: tuple[bool, ...], start: Point) -> Posed:
    leaves = _Leaves(g, x, circles)
    energy = leaves.tree(3)
    if g.random() < 0.6:
        energy += sum((xi - Rational(int(g.integers(-4, 5)), 4)) ** 2 for xi in leaves.lines)
    start = _inside(energy, x, start, g.spawn(1)[0])
    inequalities = [_constraint(leaves, start) for _ in range(g.integers(0, 5))]
    if g.random() < 0.3:
        size = int(g.integers(1, 4))
        inequalities += [part for xi in leaves.lines for part in (xi + size, size - xi)]
    if len(inequalities) > 1 and g.random() < 0.15:
        inequalities = [tuple(inequalities[:2]), *inequalities[2:]]
    equations: tuple[Expr, ...] = ()
    if (len(x) > 1 and g.random() < 0.15) or not inequalities:
        equations = (_through(leaves.tree(2), x, start, Integer(0)),) if len(x) > 1 else ()
    if not inequalities and not equations:
        inequalities = [4 - x[0] ** 2 if not circles[0] else cos(x[0]) + Rational(1, 2)]
    special = start if g.random() < 0.5 else tuple(float(v) for v in g.integers(-1, 2, len(x)))
    return energy, tuple(inequalities), equations, start, special


def _constraint(leaves: "_Leaves", start: Point) -> Expr:
    g, x = leaves.generator, leaves.symbols
    slack = Rational(int(g.integers(0, 5)), 2) if g.random() < 0.75 else -Rational(1, 2)
    kind = g.random()
    if kind < 0.3:
        form = sum(
            (int(c) * xi for c, xi in zip(g.integers(-3, 4, len(x)), leaves.safe, strict=True)),
            Integer(0),
        )
        form = form if form.free_symbols else leaves.safe[0]
        return _through(form, x, start, slack)
    if kind < 0.5:
        centre = [Rational(int(c), 2) for c in g.integers(-2, 3, len(x))]
        distance = sum((xi - c) ** 2 for xi, c in zip(leaves.safe, centre, strict=True))
        return _through(distance if g.random() < 0.4 else -distance, x, start, slack)
    return _through(leaves.tree(2), x, start, slack)


def _through(form: Expr, x: tuple[Any, ...], start: Point, value: Expr) -> Expr:
    """Return the form plus a constant, with about the given value at the start."""
    here = _value(form, x, start)
    return form - (Rational(round(here * 4), 4) if abs(here) < 1e4 else 0) + value


def _value(form: Expr, x: tuple[Any, ...], q: Point) -> float:
    """Return a value, or nan where it is not real."""
    try:
        here = complex(sympy.N(form.subs(dict(zip(x, map(sympy.Rational, q), strict=True)))))
    except (ValueError, TypeError):  # a comparison of numbers that are not real
        return math.nan
    return here.real if abs(here.imag) < 1e-12 else math.nan


def _inside(energy: Expr, x: tuple[Any, ...], start: Point, g: Generator) -> Point:
    """Return a start in the energy's domain, if one is found."""
    for _ in range(20):
        if math.isfinite(_value(energy, x, start)):
            break
        start = tuple(float(v) for v in g.integers(-8, 9, len(x)) / 4)
    return start


class _Leaves:
    """Random expressions in the coordinates, periodic in those on circles."""

    def __init__(self, g: Generator, x: tuple[Any, ...], circles: tuple[bool, ...]) -> None:
        self.generator, self.symbols = g, x
        self.lines = [xi for xi, circle in zip(x, circles, strict=True) if not circle]
        self.safe = [sin(xi) if circle else xi for xi, circle in zip(x, circles, strict=True)]
        self.cosines = [cos(xi) for xi in x]

    def leaf(self) -> Expr:
        g = self.generator
        kind = g.random()
        if kind < 0.2:
            return Rational(int(g.integers(-6, 7)), int(g.integers(1, 4)))
        if kind < 0.3:
            return g.choice(np.array(self.cosines, dtype=object))
        return g.choice(np.array(self.safe, dtype=object))

    def tree(self, depth: int) -> Expr:
        g = self.generator
        if depth == 0 or (depth < 3 and g.random() < 0.15):
            return self.leaf()
        name = g.choice(list(_NODES), p=_WEIGHTS)
        a, b = self.tree(depth - 1), self.tree(depth - 1)
        made = _NODES[name](g, a, b)
        usable = made.is_extended_real is not False and not made.has(
            sympy.zoo, sympy.nan, sympy.oo, sympy.I
        )
        return made if usable else a


Node = Callable[[Generator, Expr, Expr], Expr]
_COMMON: dict[str, Node] = {
    "sum": lambda _, a, b: a + b,
    "difference": lambda _, a, b: a - b,
    "product": lambda _, a, b: a * b,
    "power": lambda g, a, _: a ** int(g.integers(2, 5)),
}
_SMOOTH: dict[str, Node] = {
    "sin": lambda _, a, b: sin(a) + b,
    "cos": lambda _, a, b: cos(a) * b,
    "exp": lambda _, a, b: exp(a / 2) - b,
    "tanh": lambda _, a, b: tanh(a) + b,
    "atan": lambda _, a, b: atan(a) * b,
    "over": lambda _, a, b: a / (1 + b**2),
    "log1": lambda _, a, b: log(1 + a**2) + b,
}
_EDGED: dict[str, Node] = {
    "quotient": lambda _, a, b: a / b if b != 0 else a,
    "log": lambda _, a, b: b + (log(a) if a.free_symbols else a),
    "sqrt": lambda _, a, b: b - (sqrt(a) if a.free_symbols else a),
    "root": lambda g, a, b: (
        b + (a ** Rational(int(g.choice([1, 3, 5])), 2) if a.free_symbols else a)
    ),
}
_KINKED: dict[str, Node] = {
    "abs": lambda _, a, b: Abs(a) + b,
    "max": lambda _, a, b: Max(a, b),
    "min": lambda _, a, b: Min(a, b),
    "piecewise": lambda _, a, b: Piecewise((a**2, a > 0), (b, True)) if a.free_symbols else b,
    "smooth pieces": lambda _, a, b: (
        b + (Piecewise((a**3, a > 0), (0, True)) if a.free_symbols else 0)
    ),
}
_NODES: dict[str, Node] = {**_COMMON, **_SMOOTH, **_EDGED, **_KINKED}
_WEIGHTS = np.repeat(
    [0.45 / len(_COMMON), 0.3 / len(_SMOOTH), 0.12 / len(_EDGED), 0.13 / len(_KINKED)],
    [len(_COMMON), len(_SMOOTH), len(_EDGED), len(_KINKED)],
)


# --------------------------------------------------------------------------------- degenerate ones


def _degenerate(g: Generator, x: tuple[Any, ...], circles: tuple[bool, ...], start: Point) -> Posed:
    del circles
    point = tuple(float(v) for v in g.integers(-1, 2, len(x)))
    u = [xi - int(p) for xi, p in zip(x, point, strict=True)]
    energy = sum(_flat_term(g, u) for _ in range(g.integers(1, 4)))
    energy += g.integers(0, 2) * sum(ui**2 for ui in u[1:])
    walls = [_touching(g, u) for _ in range(g.integers(0, 4))]
    if walls and g.random() < 0.3:
        walls.append(int(g.integers(1, 4)) * walls[0])
    if walls and g.random() < 0.2:
        walls.append(walls[0] + _flat_term(g, u) ** 2)
    equations = (_touching(g, u),) if len(x) > 1 and g.random() < 0.15 else ()
    if not walls and not equations:
        walls = [9 - sum(ui**2 for ui in u)]
    return energy, tuple(walls), equations, start, point


def _flat_term(g: Generator, u: list[Expr]) -> Expr:
    a, b = (u[int(g.integers(len(u)))] for _ in range(2))
    sign = 1 if g.random() < 0.7 else -1
    k, m = (int(v) for v in g.integers(1, 5, 2))
    choices = [
        a**k * b**m,
        a ** (2 * k),
        a**k,
        a * Abs(a),
        Abs(a) ** k,
        (a - b**2) ** k,
        (a * b) ** 2,
    ]
    choices += [(b - a**2) * (b - 2 * a**2), a**3 - 3 * a * b**2, (a**2 + b**2) ** k]
    return sign * choices[int(g.integers(len(choices)))]


def _touching(g: Generator, u: list[Expr]) -> Expr:
    a, b = (u[int(g.integers(len(u)))] for _ in range(2))
    sign = 1 if g.random() < 0.5 else -1
    choices = [a, a**2, a**3, a - b**2, b**2 - a**3, a * b, a + b + a**2, 1 - (a - 1) ** 2 - b**2]
    return sign * choices[int(g.integers(len(choices)))]
