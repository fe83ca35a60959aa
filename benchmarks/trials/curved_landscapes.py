"""Landscapes in more coordinates, on curves, spheres and tori, and on products."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.trials.flooding import Array, Chart, Tree
from benchmarks.trials.known_trees import (
    Curve,
    DegenerateError,
    Truth,
    known_along,
    known_on,
    known_product,
)
from benchmarks.trials.posed_landscapes import (
    ROOM,
    TURN,
    Generator,
    Posed,
    Set,
    X,
    Y,
    container,
    number,
    outside_disc,
    planar,
    polyhedron,
    unit,
    wells,
)
from polycorner import Manifold

Z, W = sp.symbols("z w", real=True)
T = sp.Symbol("t", real=True)

# ----------------------------------------------------------------------------- more coordinates


def small(rng: Generator) -> sp.Expr:
    """Return a function of two coordinates between -1 and 1 or so."""
    a, b = number(rng, -0.3, 0.3), number(rng, -0.3, 0.3)
    return [a * X + b * Y, a * X * Y + b * X, a * sp.sin(2 * X) + b * Y, a * X**2 - b * Y**2][
        rng.integers(4)
    ]


def any_chart(rng: Generator) -> Chart:
    """Return a chart in the plane with or without an obstacle."""
    energy, D = wells(rng), Set.of(container(rng))
    if rng.integers(2):
        at = number(rng, -0.5, 0.5), number(rng, -0.5, 0.5)
        D.add(outside_disc(at, number(rng, 0.2, 0.5)))
    return D.chart(energy)


def differing(functions: Sequence[Any], count: int, q: Array) -> Array:
    """Return the first coordinates, and what functions say that has to vanish."""
    return np.array([*q[:count], *(float(f(*q)) for f in functions)])


def lifted(rng: Generator, how: int) -> Posed:
    """Add coordinates that springs, floors or equations hold to functions of the others."""
    chart = any_chart(rng)
    kind = ("springs", "floors", "equations")[how]
    more = [Z] if how == 2 or rng.integers(3) else [Z, W]
    names = ["x", "y", "z", "w"][: 2 + len(more)]
    energy, functions, equations, off = chart.energy, list(chart.functions), [], []
    tree, box_ = [chart.tree], list(chart.sides)
    for s in more:
        g = small(rng)
        away = s - g
        off.append(sp.lambdify([X, Y, *more], away, "numpy"))
        box_.append((-3.25, 3.125))
        if how == 2:
            equations.append(away)
            continue
        first = len(functions)
        if how == 0:
            energy += number(rng, 0.5, 3) * away**2
            functions += [s + 3, 3 - s]
        else:
            energy += number(rng, 0.5, 2) * away
            functions += [away, 3 - s]
        tree += [first, first + 1]
    M = Manifold.euclidean(" ".join(names))
    D = polyhedron(M, functions, ("and", *tree), equations)
    return Posed(
        f"{len(names)} coordinates, {kind}", D, energy, box_, partial(known_on, chart),
        partial(differing, off, 2),
    )  # fmt: skip


def springs(rng: Generator) -> Posed:
    return lifted(rng, 0)


def floors(rng: Generator) -> Posed:
    return lifted(rng, 1)


def graphs(rng: Generator) -> Posed:
    return lifted(rng, 2)


def first_two(q: Array) -> Array:
    return np.asarray(q)[:2]


def loci(rng: Generator) -> Posed:
    """Let a third coordinate, in an interval or on a circle, be free."""
    chart = any_chart(rng)
    circle = bool(rng.integers(2))
    M = Manifold(("x", "y", "z"), (np.inf, np.inf, TURN if circle else np.inf))
    more = [] if circle else [Z, 1 - Z - small(rng) / 2]
    count = len(chart.functions)
    tree = ("and", chart.tree, *range(count, count + len(more)))
    D = polyhedron(M, [*chart.functions, *more], tree)
    sides = [*chart.sides, None if circle else (-0.5, 2.0625)]
    return Posed("loci", D, chart.energy, sides, partial(known_on, chart), first_two)


def sheet_of(q: Array) -> Array:
    return np.array([q[0], q[1], np.sign(q[2])])


def doubled(chart: Chart) -> Truth:
    """Return two copies of a landscape that never meet."""
    sheets = Truth(np.array([[-1.0], [1.0]]), np.zeros(2), {(0, 1): (np.inf,)}, np.array([np.inf]))
    return known_product([known_on(chart), sheets])


def loci_in_two(rng: Generator) -> Posed:
    """Let loci fall apart in two parts, which are two minima."""
    chart = any_chart(rng)
    M = Manifold.euclidean("x y z")
    count = len(chart.functions)
    gap = Z**2 - number(rng, 0.1, 0.5)
    D = polyhedron(M, [*chart.functions, gap, 4 - Z**2], ("and", chart.tree, count, count + 1))
    box_ = [*chart.sides, (-2.5, 2.5625)]
    return Posed("loci in two parts", D, chart.energy, box_, partial(doubled, chart), sheet_of)


# ------------------------------------------------------------------------------------------ curves


def on_ellipse(centre: Array, axes: Array, q: Array) -> Array:
    c, s = (np.asarray(q)[:2] - centre) / axes
    return np.array([np.arctan2(s, c) % TURN])


def curves(rng: Generator) -> Posed:
    """Take a circle or an ellipse in the plane or in space, whole or cut, with wells on it."""
    centre = [number(rng, -0.3, 0.3) for _ in range(2)]
    axes = [number(rng, 0.6, 1.4) for _ in range(2)]
    energy = wells(rng)
    at = {X: centre[0] + axes[0] * sp.cos(T), Y: centre[1] + axes[1] * sp.sin(T)}
    equations = [((X - centre[0]) / axes[0]) ** 2 + ((Y - centre[1]) / axes[1]) ** 2 - 1]
    names, sides = "x y", [(-2.25, 2.3125), (-2.25, 2.3125)]
    if rng.integers(2):
        g = small(rng)
        equations.append(Z - g)
        names, sides = "x y z", [*sides, (-3.0, 3.0625)]
        energy += number(rng, -0.5, 0.5) * Z
        at[Z] = g.subs(at)
    functions, tree = [sp.Integer(9) - X**2 - Y**2], ("and", 0)
    cut = int(rng.integers(3))
    if cut:
        c, s = unit(rng)
        functions += [
            c * X + s * Y - number(rng, -0.5, 0.5),
            s * X - c * Y - number(rng, -0.5, 0.5),
        ]
        tree = ("and", 0, 1) if cut == 1 else ("and", 0, ("or", 1, 2))
        functions = functions[: 1 + cut]
    D = polyhedron(Manifold.euclidean(names), functions, tree, equations)
    on = tuple(f.subs(at) for f in functions)
    curve = Curve(T, energy.subs(at), on, tree, (0.0, TURN), around=True)
    place = partial(on_ellipse, np.array(centre, float), np.array(axes, float))
    return Posed("curves", D, energy, sides, partial(known_along, curve), place)


# ------------------------------------------------------------------------- spheres, tori, cylinders


def geographic(q: Array) -> Array:
    x, y, z = np.asarray(q)
    return np.array(
        [np.arctan2(y, x) % TURN, np.arcsin(np.clip(z, -1, 1)), x * x + y * y + z * z - 1]
    )


def with_length(chart: Chart) -> Truth:
    found = known_on(chart)
    if (abs(found.points[:, 1]) > 1.45).any():
        msg = "a minimum near a pole"
        raise DegenerateError(msg)
    return found


def spheres(rng: Generator) -> Posed:
    """Put wells on a sphere, and caps that are left out."""
    ball = Manifold.euclidean("x y z") if rng.integers(8) else Manifold.sphere("x y z")
    x, y, z = ball.symbols
    energy = number(rng, -0.3, 0.3) * x * z + number(rng, -0.3, 0.3) * y
    functions = []
    for _ in range(int(rng.integers(2, 6))):
        n = rng.normal(size=3)
        n = [sp.Rational(round(32 * float(c)), 32) for c in n / np.linalg.norm(n)]
        along = n[0] * x + n[1] * y + n[2] * z
        energy -= number(rng, 0.3, 1) * sp.exp(number(rng, 2, 6, 8) * (along - 1))
        if len(functions) < 2 and not rng.integers(3):
            functions.append(number(rng, 0.6, 0.9) - (n[1] * x + n[2] * y + n[0] * z))
    functions = functions or [sp.Integer(2) - z]
    tree = ("and", *range(len(functions)))
    equations = [] if ball.spheres else [x**2 + y**2 + z**2 - 1]
    D = polyhedron(ball, functions, tree, equations)
    at = {x: sp.cos(Y) * sp.cos(X), y: sp.cos(Y) * sp.sin(X), z: sp.sin(Y)}
    on = [sp.sympify(f).subs(at, simultaneous=True) for f in (energy, *functions)]
    sides = ((0.0, TURN), (-np.pi / 2, np.pi / 2))
    chart = Chart((X, Y), on[0], tuple(on[1:]), tree, sides, (True, False), poles=True)
    return Posed(
        "spheres", D, energy, [(-1.25, 1.25)] * 3, partial(with_length, chart), geographic
    )  # fmt: skip


def waves(rng: Generator) -> sp.Expr:
    """Return periodic wells."""
    if rng.integers(2):
        total = number(rng, 0.3, 1) * sp.cos(X - number(rng, -3, 3))
        total += number(rng, 0.3, 1) * sp.cos(Y) + number(rng, -0.6, 0.6) * sp.cos(X + Y)
        return total + number(rng, -0.6, 0.6) * sp.cos(2 * X - number(rng, -3, 3))
    total = number(rng, -0.2, 0.2) * sp.sin(X) + number(rng, -0.2, 0.2) * sp.cos(Y)
    for _ in range(int(rng.integers(2, 5))):
        a, b, k = number(rng, -3, 3), number(rng, -3, 3), number(rng, 1, 3, 8)
        total -= number(rng, 0.3, 1) * sp.exp(k * (sp.cos(X - a) + sp.cos(Y - b) - 2))
    return total


def tori(rng: Generator) -> Posed:
    """Take periodic wells on the torus, a hole left out now and then."""
    functions = [sp.Integer(3) - sp.cos(X)]
    for _ in range(int(rng.integers(0, 3))):
        a, b = number(rng, -3, 3), number(rng, -3, 3)
        functions.append(number(rng, 0.5, 1.75) - sp.cos(X - a) - sp.cos(Y - b))
    tree = ("and", *range(len(functions)))
    sides = ((0.0, TURN), (0.0, TURN))
    chart = Chart((X, Y), waves(rng), tuple(functions), tree, sides, (True, True))
    return planar("tori", chart)


def cylinders(rng: Generator) -> Posed:
    """Take a circle times an interval."""
    a, b = number(rng, 1, 1.75), number(rng, 1, 1.75)
    functions = [a - Y, Y + b + number(rng, 0, 0.3) * sp.sin(X)]
    energy = waves(rng) + number(rng, -0.3, 0.3) * Y**2
    chart = Chart(
        (X, Y), energy, tuple(functions), ("and", 0, 1), ((0.0, TURN), (-2.25, 2.0)), (True, False)
    )
    return planar("cylinders", chart)


# ---------------------------------------------------------------------------------------- products


def axis(rng: Generator, s: sp.Symbol, circle: bool) -> Curve:
    """Return a polynomial on one or two intervals, or waves on a circle."""
    if circle:
        k = int(rng.integers(1, 3))
        energy = number(rng, 0.3, 1) * sp.cos(k * s) + number(rng, -0.2, 0.2) * sp.sin(s)
        return Curve(s, energy, (), ("and",), (0.3, 0.3 + TURN), around=True)
    roots = np.sort(rng.permutation(9)[: int(rng.integers(1, 4))] - 4) / 3
    slope = sp.prod([s - sp.Rational(round(24 * float(r)), 24) for r in roots])
    energy = sp.integrate(sp.expand(number(rng, 0.5, 2) * int(rng.choice([-1, 1])) * slope), s)
    a, b = number(rng, 1, 1.75), number(rng, 1, 1.75)
    functions, tree = [a - s, s + b], ("and", 0, 1)
    if not rng.integers(3):
        c, d = number(rng, -0.5, 0), number(rng, 0.1, 0.5)
        functions += [c - s, s - d]
        tree = ("and", 0, 1, ("or", 2, 3))
    return Curve(s, energy, tuple(functions), tree, (-2.0, 2.0))


def shifted(tree: Tree, by: int) -> Tree:
    if isinstance(tree, int):
        return tree + by
    return (tree[0], *(shifted(part, by) for part in tree[1:]))


def turned(A: Array, q: Array) -> Array:
    return A @ np.asarray(q)


def answer_of(axes: Sequence[Curve]) -> Truth:
    found = known_product([known_along(a) for a in axes])
    if len(found.energies) > 40:
        msg = "too many minima"
        raise DegenerateError(msg)
    return found


def products(rng: Generator, n: int) -> Posed:
    """Take sums of functions of one coordinate each on products, slanted now and then."""
    symbols = (X, Y, Z, W)[:n]
    round_ = [not rng.integers(4) for _ in symbols]
    axes = [axis(rng, s, c) for s, c in zip(symbols, round_, strict=True)]
    A = np.eye(n, dtype=int)
    if not any(round_) and rng.integers(2):
        A = A + np.triu(rng.integers(-1, 2, (n, n)), 1)
    image = sp.Matrix(A) * sp.Matrix(symbols)
    at = dict(zip(symbols, image, strict=True))
    functions, parts = [], []
    for a in axes:
        parts.append(shifted(a.tree, len(functions)))
        functions += [f.subs(at, simultaneous=True) for f in a.functions]
    functions = functions or [3 - sp.cos(X)]
    parts = parts if any(a.functions for a in axes) else [0]
    energy = sum(a.energy for a in axes).subs(at, simultaneous=True)
    M = Manifold(tuple(s.name for s in symbols), tuple(TURN if c else np.inf for c in round_))
    D = polyhedron(M, functions, ("and", *parts))
    reach = float(abs(np.linalg.inv(A)).sum(axis=1).max()) * 2
    box_ = [None if c else (-reach, reach + ROOM) for c in round_]
    place = partial(turned, A)
    return Posed(f"products of {n} axes", D, energy, box_, partial(answer_of, axes), place)


def planes(rng: Generator) -> Posed:
    return products(rng, 2)


def solids(rng: Generator) -> Posed:
    return products(rng, 3)


def fours(rng: Generator) -> Posed:
    return products(rng, 4)


DRAWS: tuple[Callable[[Generator], Posed], ...] = (
    springs, floors, graphs, loci, loci_in_two, curves, spheres, tori, cylinders, planes, solids,
    fours,
)  # fmt: skip
