"""Stationary points that are not isolated: along coordinates, walls, lines, circles and spheres."""

from collections.abc import Sequence
from fractions import Fraction as Q
from itertools import pairwise
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.trials.exact import Vector, derivative, integral, root, sign, value
from benchmarks.trials.grids import TURN, number, polynomial
from benchmarks.trials.grids import S as SYMBOL
from benchmarks.trials.known import KnownLocus, Posed
from benchmarks.trials.known_grids import slope
from benchmarks.trials.known_planes import (
    IDENTITY,
    PLANE,
    SIDES,
    X,
    Y,
    branches,
    curve,
    distinct,
    faint,
    known,
    rational,
    size,
    slanted,
)
from benchmarks.trials.planar import Curve, Energy, PlanarProblem, disc, line
from polycorner import AnyOf, Manifold, Polyhedron
from polycorner.formulas.functions import SmoothFunction

Generator = np.random.Generator
ZERO, ONE = Q(0), Q(1)


def _sections(problem: PlanarProblem, x: Q) -> list[Vector]:
    """Return points of the set on a vertical line, one at least of each of its parts."""
    ends = {ZERO}
    for f in problem.curves:
        b, c = f.b, f.bent * x**2 + f.a * x + f.c
        if f.bent:
            square = b**2 - 4 * f.bent * c
            if square >= 0:
                ends |= {(-b + s * root(square)) / (2 * f.bent) for s in (1, -1)}
        elif b:
            ends.add(-c / b)
    order = sorted(ends)
    trial = [*order, *((p + q) / 2 for p, q in pairwise(order))]
    trial += [order[0] - 1, order[-1] + 1]
    low, high = map(Q, SIDES[1])
    return [
        (x, y)
        for y in sorted(trial)
        if low <= y <= high
        and any(all(sign(problem.curves[i].at((x, y))) >= 0 for i in b) for b in problem.branches)
    ]


def _posed(
    kind: str,
    roots: Sequence[Q],
    steep: Sequence[Q],
    curves: Sequence[Curve],
    tree: Any,
    samples: Sequence[Vector] = (),
) -> Posed:
    """Return the problem of an energy of x alone in the plane."""
    p = tuple(integral(steep))
    energy = Energy(((p, (ONE,)),), IDENTITY, (ZERO, ZERO), ())
    unions = tuple(dict.fromkeys(branches(tree)))
    problem = PlanarProblem(energy, tuple(curves), unions, constant_allowed=bool(samples))
    loci = []
    for x in sorted(set(roots)):
        parts = _sections(problem, x)
        if parts and Q(SIDES[0][0]) <= x <= Q(SIDES[0][1]):
            curved = sign(value(derivative(steep), x))
            loci.append(KnownLocus({"x": x}, 0 if curved > 0 else 1, tuple(parts)))
    isolated = [
        tuple(k for k in part if sign(value(steep, k.point[0]))) for part in known(problem, SIDES)
    ]
    if samples:
        isolated = [tuple(k for k in part if k.index is not None) for part in isolated]
    functions = [SmoothFunction(f"f{i}", c.written(X, Y), PLANE) for i, c in enumerate(curves)]
    parts_ = [
        AnyOf(*(functions[i] for i in g.parts)) if isinstance(g, AnyOf) else functions[g]
        for g in tree
    ]
    formula = polynomial(p).subs(SYMBOL, X)
    D = Polyhedron(PLANE, parts_)
    return Posed(
        kind, D, formula, list(SIDES), isolated[0], tuple(loci), tuple(samples), isolated[1]
    )


def loci(rng: Generator) -> Posed:
    """Take a function of x on sets bounded by lines that are not vertical, and circles."""
    roots = distinct(rng, int(rng.integers(1, 4)))
    curves = [c for c in (curve(rng, 0.4) for _ in range(int(rng.integers(1, 4)))) if c.bent or c.b]
    tree: Any = list(range(len(curves)))
    if len(curves) > 1 and not rng.integers(3):
        tree = [AnyOf(*tree)]
    if not curves:
        raise ValueError
    return _posed("loci", roots, slope(rng, roots), curves, tree)


def faint_loci(rng: Generator) -> Posed:
    """Let a locus touch the set, or miss it by little, or meet it in a short piece."""
    roots = distinct(rng, int(rng.integers(1, 3)))
    (off, radius) = int(rng.integers(-1, 2)) * faint(rng), size(rng)
    curves = [disc(roots[0] - radius + off, rational(rng, 1), radius)]
    return _posed("loci at the edge", roots, slope(rng, roots), curves, [0])


def cylinders(rng: Generator) -> Posed:
    """Take a function of x on arcs of circles."""
    M = Manifold(("x", "t"), (np.inf, 2 * np.pi))
    x, t = M.symbols
    roots, middle = distinct(rng, int(rng.integers(1, 4))), rational(rng)
    steep = slope(rng, roots)
    D = Polyhedron(
        M, {"arc": sp.cos(t - number(middle)) - number(Q(int(rng.integers(-9, 10)), 10))}
    )
    found = [
        KnownLocus({"x": r}, 0 if value(derivative(steep), r) > 0 else 1, ((r, middle),))
        for r in roots
    ]
    formula = polynomial(integral(steep)).subs(SYMBOL, x)
    return Posed("loci", D, formula, [SIDES[0], None], loci=tuple(found), circles={1: TURN})


def loci_apart(rng: Generator) -> Posed:
    """Loci of which some do not meet the set, or in two parts, or in one point of a corner."""
    roots = distinct(rng, 3)
    y, off = rational(rng, 1), int(rng.integers(-1, 2)) * faint(rng)
    corner = [line(ONE, ONE, -roots[0] - off - y), line(ONE, -ONE, y - roots[0] - off)]
    curves = (
        corner
        if rng.integers(2)
        else [disc(roots[0], y, Q(1), inside=False), disc(roots[0], y, Q(2))]
    )
    return _posed("loci at the edge", roots, slope(rng, roots), curves, [0, 1])


def walls(rng: Generator) -> Posed:
    """Take a function of x that rests all along a vertical wall."""
    roots = distinct(rng, int(rng.integers(1, 4)))
    steep = slope(rng, roots)
    wall = rational(rng)
    pull = sign(value(steep, wall))
    if not pull:
        raise ValueError
    other = disc(wall, rational(rng, 1), size(rng))
    y = other.centre[1]
    curves = [line(Q(pull), ZERO, -pull * wall), other]
    kind = "walls and circles of minima"
    return _posed(kind, roots, steep, curves, [0, 1], ((wall, y), (wall, y + Q(1, 7))))


def rings(rng: Generator) -> Posed:
    """Circles or spheres of minima, whole or cut."""
    n = int(rng.integers(2, 4))
    M = Manifold.euclidean("x y z"[: 2 * n - 1])
    q = M.symbols
    centre, radius = [rational(rng, 1) for _ in range(n)], size(rng)
    away = sum((s - number(c)) ** 2 for s, c in zip(q, centre, strict=True))
    energy = (away - number(radius) ** 2) ** 2
    if rng.integers(2):
        energy = sp.cos(away / number(radius) ** 2 * sp.pi)
    samples = []
    for _ in range(3):
        c, s = slanted(rng)
        samples.append((centre[0] + radius * c, centre[1] + radius * s, *centre[2:]))
    walls_ = (
        [(samples[0][1] - centre[1]) * (q[1] - number(centre[1])) + 1] if rng.integers(2) else []
    )
    kept = [
        p for p in samples if not walls_ or (samples[0][1] - centre[1]) * (p[1] - centre[1]) + 1 > 0
    ]
    D = Polyhedron(M, walls_ or [50 - away])
    return Posed(
        "walls and circles of minima",
        D,
        energy,
        [(-5.03125, 5.0625)] * n,
        samples=tuple(kept),
        partial=True,
    )


def lines_of_minima(rng: Generator) -> Posed:
    """Take an energy of one combination of the coordinates, which the formulas do not show."""
    a, b = int(rng.integers(1, 4)), int(rng.integers(-3, 4)) or 1
    roots = distinct(rng, int(rng.integers(1, 3)))
    steep = slope(rng, roots)
    p = tuple(integral(steep))
    turn = ((Q(a), Q(b)), (Q(-b), Q(a)))
    energy = Energy(((p, (ONE,)),), turn, (ZERO, ZERO), ())
    problem = PlanarProblem(energy, (disc(ZERO, ZERO, Q(5)),), (frozenset([0]),))
    on, beside = (
        tuple(k for k in part if sign(value(steep, energy.local(k.point)[0])))
        for part in known(problem, SIDES)
    )
    c, s, x = Q(a, a * a + b * b), Q(b, a * a + b * b), roots[0]
    samples = tuple((c * x - t * b, s * x + t * a) for t in (ZERO, Q(1, 4), Q(-1, 3)))
    D = Polyhedron(PLANE, {"f0": 25 - X**2 - Y**2})
    formula = sp.expand(energy.written(X, Y))
    kind = "walls and circles of minima"
    return Posed(kind, D, formula, list(SIDES), on, samples=samples, beside=beside)


DRAWS = (loci, cylinders, faint_loci, loci_apart, walls, rings, lines_of_minima)
