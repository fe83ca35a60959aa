"""Landscapes as they are posed, and the pieces that they are made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.trials.flooding import Array, Chart, Tree
from benchmarks.trials.known_trees import DegenerateError, Truth, candidates, known_on
from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry
from polycorner.formulas.functions import SmoothFunction

Generator = np.random.Generator
X, Y = sp.symbols("x y", real=True)
TURN = 2 * np.pi
ROOM = 0.125  # of sides around a set


@dataclass(frozen=True)
class Posed:
    """A problem and its answer.

    Attributes
    ----------
    kind : str
    polyhedron, energy, box, region, symmetry
        The problem; see :func:`polycorner.landscapes.landscape`.
    answer : callable
        Returns the answer.
    place : callable
        From a point ``(n,)`` to coordinates of the answer; those that must vanish come after them.
    """

    kind: str
    polyhedron: Polyhedron
    energy: Any
    box: Any
    answer: Callable[[], Truth]
    place: Callable[[Array], Array] = field(default=np.asarray)
    region: tuple[Any, ...] = ()
    symmetry: Symmetry | None = None

    @cached_property
    def truth(self) -> Truth:
        """The answer."""
        return self.answer()


# ----------------------------------------------------------------------------------- small pieces


def number(rng: Generator, low: float, high: float, parts: int = 64) -> sp.Rational:
    """Return a number between two with a small denominator."""
    return sp.Rational(int(rng.integers(round(low * parts), round(high * parts) + 1)), parts)


def unit(rng: Generator) -> tuple[sp.Rational, sp.Rational]:
    """Return a rational unit vector."""
    t = number(rng, -1, 1, 16)
    c, s = (1 - t**2) / (1 + t**2), 2 * t / (1 + t**2)
    turn = int(rng.integers(4))
    return [(c, s), (-s, c), (-c, -s), (s, -c)][turn]


def gaussians(rng: Generator, count: int, reach: float = 1.25) -> sp.Expr:
    """Return wells of different depths and widths in a shallow bowl."""
    total = number(rng, 0.02, 0.2) * (X**2 + Y**2)
    for _ in range(count):
        a, b = number(rng, -reach, reach), number(rng, -reach, reach)
        sharp = number(rng, 1, 5, 8)
        total -= number(rng, 0.4, 1.5) * sp.exp(-sharp * ((X - a) ** 2 + (Y - b) ** 2))
    return total


def quartic(rng: Generator) -> sp.Expr:
    p = (X**2 - number(rng, 0.5, 1.5)) ** 2
    q = number(rng, 0.3, 1) * (Y**2 - number(rng, -0.5, 1.25)) ** 2
    return p + q + number(rng, -0.5, 0.5) * X * Y + tilt(rng)


def polynomial(rng: Generator) -> sp.Expr:
    """Return two polynomials whose derivatives have known roots, coupled."""
    total = number(rng, -0.25, 0.25) * X * Y
    for s in (X, Y):
        roots = np.sort(rng.permutation(9)[:3] - 4) / 3
        slope = sp.prod([s - sp.Rational(round(24 * float(r)), 24) for r in roots])
        total += sp.integrate(sp.expand(number(rng, 1, 4) * slope), s)
    return total


def cosines(rng: Generator) -> sp.Expr:
    k, m = number(rng, 2, 4, 8), number(rng, 2, 4, 8)
    total = number(rng, 0.3, 1) * sp.cos(k * X + number(rng, -2, 2))
    total += number(rng, 0.3, 1) * sp.cos(m * Y + number(rng, -2, 2))
    return total + number(rng, -0.3, 0.3) * sp.cos(X + 2 * Y) + tilt(rng)


def tilt(rng: Generator) -> sp.Expr:
    return number(rng, -0.3, 0.3) * X + number(rng, -0.3, 0.3) * Y


def wells(rng: Generator) -> sp.Expr:
    makers = (partial(gaussians, count=int(rng.integers(2, 6))), quartic, polynomial, cosines)
    return makers[rng.integers(4)](rng)


def box(rng: Generator) -> list[sp.Expr]:
    a, b = number(rng, 1.25, 2), number(rng, 1.25, 2)
    return [a - X, a + X, b - Y, b + Y]


def disc(rng: Generator) -> list[sp.Expr]:
    return [number(rng, 1.5, 2) ** 2 - (X - number(rng, -0.25, 0.25)) ** 2 - Y**2]


def container(rng: Generator) -> list[sp.Expr]:
    return (box, disc)[rng.integers(2)](rng)


def outside_disc(centre: Sequence[Any], radius: Any) -> sp.Expr:
    return (X - centre[0]) ** 2 + (Y - centre[1]) ** 2 - radius**2


def outside_polygon(rng: Generator, centre: Sequence[Any], size: float) -> list[sp.Expr]:
    """Return half-planes, one of which must hold, so that a polygon is left out."""
    count = int(rng.integers(3, 6))
    start = rng.uniform(0, TURN)
    found = []
    for k in range(count):
        angle = start + TURN * (k + rng.uniform(-0.25, 0.25)) / count
        t = sp.Rational(round(16 * float(np.tan((angle % TURN - np.pi) / 2.0001))), 16)
        c, s = -(1 - t**2) / (1 + t**2), -2 * t / (1 + t**2)
        found.append(c * (X - centre[0]) + s * (Y - centre[1]) - number(rng, size / 2, size))
    return found


def saddles(energy: sp.Expr, reach: float = 2.0) -> list[tuple[sp.Rational, sp.Rational]]:
    """Return rational points near the saddles of an energy."""
    chart = Chart((X, Y), energy, (), ("and",), ((-reach, reach),) * 2)
    found = []
    for q in candidates(chart):
        j = chart.jets(q[0], q[1])[0]
        if j[3] * j[5] < j[4] ** 2 and abs(q).max() < 1.2:
            found.append(tuple(sp.Rational(round(64 * float(x)), 64) for x in q))
    if not found:
        msg = "no saddle"
        raise DegenerateError(msg)
    return found


@dataclass
class Set:
    """Functions and a tree, as it is put together."""

    functions: list[sp.Expr]
    parts: list[Tree]

    @classmethod
    def of(cls, functions: Sequence[sp.Expr]) -> "Set":
        """Return where some functions are not negative."""
        return cls(list(functions), list(range(len(functions))))

    def add(self, *functions: sp.Expr) -> None:
        """Add an alternative: one of some functions must hold."""
        first = len(self.functions)
        self.functions += functions
        numbers = tuple(range(first, first + len(functions)))
        self.parts.append(numbers[0] if len(numbers) == 1 else ("or", *numbers))

    def chart(self, energy: sp.Expr, region: Sequence[sp.Expr] = ()) -> Chart:
        """Return an energy on the set."""
        reach = 2.0 + ROOM
        sides = ((-reach - ROOM, reach), (-reach, reach + ROOM))
        tree = ("and", *self.parts)
        return Chart((X, Y), energy, tuple(self.functions), tree, sides, region=tuple(region))


# ----------------------------------------------------------------------- from charts to problems


def polyhedron(M: Manifold, functions: Sequence[sp.Expr], tree: Tree, equations: Any = ()) -> Any:
    """Return a polyhedron of a tree of numbers."""
    named = [SmoothFunction(f"f{k}", f, M) for k, f in enumerate(functions)]

    def made(part: Tree) -> Any:
        if isinstance(part, int):
            return named[part]
        return (AllOf if part[0] == "and" else AnyOf)(*(made(p) for p in part[1:]))

    return Polyhedron(M, made(tree) if named else [], list(equations))


def planar(kind: str, chart: Chart, region: Sequence[sp.Expr] = ()) -> Posed:
    """Pose a chart as it is."""
    periods = tuple(TURN if circle else np.inf for circle in chart.around)
    M = Manifold(("x", "y"), periods)
    D = polyhedron(M, chart.functions, chart.tree)
    sides = [
        None if circle else side for side, circle in zip(chart.sides, chart.around, strict=True)
    ]
    return Posed(kind, D, chart.energy, sides, partial(known_on, chart), region=tuple(region))
