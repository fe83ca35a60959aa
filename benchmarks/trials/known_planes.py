"""Planar problems with lines and circles, whose stationary points algebra finds."""

from collections.abc import Sequence
from fractions import Fraction as Q
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.trials.exact import Vector, integral, real_roots, value, with_roots
from benchmarks.trials.known import Known, Posed
from benchmarks.trials.planar import Curve, Energy, PlanarProblem, disc, line, separable
from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.formulas.functions import SmoothFunction

Generator = np.random.Generator
PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDES = ((-5.03125, 5.0625), (-5.046875, 5.078125))
IDENTITY = ((Q(1), Q(0)), (Q(0), Q(1)))
NEAR = (6, 8, 9, 9, 9, 10, 12)  # decimal places of small numbers


def rational(rng: Generator, most: int = 3) -> Q:
    """Return a number between ``-most`` and ``most`` with a small denominator."""
    d = int(rng.choice([1, 2, 3, 4, 5, 7, 8, 10]))
    return Q(int(rng.integers(-most * d, most * d + 1)), d)


def size(rng: Generator) -> Q:
    """Return a positive number between 1/2 and 3."""
    return Q(int(rng.integers(4, 25)), 8)


def faint(rng: Generator) -> Q:
    return Q(int(rng.integers(1, 10)), 10 ** int(rng.choice(NEAR)))


def sign(rng: Generator) -> int:
    return int(rng.choice([-1, 1]))


def distinct(rng: Generator, count: int, apart: Q = Q(1, 4)) -> list[Q]:
    """Return some numbers, no two of them near each other."""
    found: list[Q] = []
    while len(found) < count:
        x = rational(rng)
        if all(abs(x - y) >= apart for y in found):
            found.append(x)
    return found


def turned(rng: Generator) -> tuple[tuple[Q, Q], tuple[Q, Q]]:
    """Return a regular matrix of small whole numbers."""
    if not rng.integers(3):
        return IDENTITY
    while True:
        (a, b), (c, d) = rng.integers(-2, 3, (2, 2)).tolist()
        if a * d - b * c:
            return (Q(a), Q(b)), (Q(c), Q(d))


def energy(rng: Generator, most: int = 3) -> Energy:
    """Return a sum or a product of polynomials of one coordinate each."""
    roots = [distinct(rng, int(rng.integers(1, most + 1))) for _ in range(2)]
    slopes = [with_roots(r, sign(rng) * Q(1, int(rng.integers(1, 5)))) for r in roots]
    turn, shift = turned(rng), (rational(rng, 1), rational(rng, 1))
    if rng.integers(3):
        return separable(slopes, roots, turn, shift)
    p, q = (integral(s) for s in slopes)
    p[0], q[0] = rational(rng), rational(rng)
    if any(not value(f, x) for f, r in ((p, roots[0]), (q, roots[1])) for x in r):
        msg = "a product with a line of critical points"
        raise ValueError(msg)
    zeros = [[x for x, _ in real_roots(f)] for f in (p, q)]
    return Energy(((tuple(p), tuple(q)),), turn, shift, (*product(*roots), *product(*zeros)))


def posed(
    rng: Generator,
    kind: str,
    problem: PlanarProblem,
    tree: Any,
    sides: Sequence[tuple[float, float]] = SIDES,
    outer: bool = True,
) -> Posed:
    """Return a problem for the library: ``tree`` holds numbers of curves, in AllOf and AnyOf."""
    functions = [
        SmoothFunction(f"f{i}", c.written(X, Y) * _factor(rng), PLANE)
        for i, c in enumerate(problem.curves)
    ]
    formula = problem.energy.written(X, Y)
    if outer and not rng.integers(4):  # a growing function of it has the same stationary points
        unit = 1 + int(max(abs(formula.subs({X: a, Y: b})) for a, b in product((-5, 5), repeat=2)))
        formula = [sp.atan, sp.exp, sp.sinh][rng.integers(3)](formula / unit)
    inside, beside = known(problem, sides)
    if not problem.curves:
        functions = [SmoothFunction("everywhere", 1 + X**2, PLANE)]
    polyhedron = Polyhedron(PLANE, _tree(tree, functions))
    return Posed(kind, polyhedron, formula, list(sides), inside, beside=beside)


def known(
    problem: PlanarProblem, box: Sequence[tuple[float, float]]
) -> tuple[tuple[Known, ...], tuple[Known, ...]]:
    """Return the stationary points in a box and those outside."""
    parts: tuple[list[Known], list[Known]] = [], []
    alike = {f"f{i}": f"f{j}" for i, j in enumerate(problem.firsts()) if j != i}
    for place in problem.places():
        inside = all(Q(a) <= x <= Q(b) for x, (a, b) in zip(place.point, box, strict=True))
        ways = {_named(face): index for face, index in place.ways.items()}
        parts[not inside].append(Known(place.point, _named(place.active), place.index, ways, alike))
    return tuple(parts[0]), tuple(parts[1])


def _named(functions: frozenset[int]) -> frozenset[str]:
    return frozenset(f"f{i}" for i in functions)


def _factor(rng: Generator) -> Any:
    """Return a positive function."""
    choice = [sp.Integer(1)] * 4 + [sp.Rational(3, 2), 1 + X**2 / 9, sp.exp(Y / 5), 2 + sp.sin(X)]
    return choice[rng.integers(len(choice))]


def _tree(tree: Any, functions: Sequence[SmoothFunction]) -> Any:
    if isinstance(tree, AllOf | AnyOf):
        return type(tree)(*(_tree(part, functions) for part in tree.parts))
    if isinstance(tree, list):
        return [_tree(part, functions) for part in tree] or list(functions)
    return functions[tree]


def branches(tree: Any) -> list[frozenset[int]]:
    """Return a tree as a union of intersections."""
    if isinstance(tree, int):
        return [frozenset([tree])]
    parts = tree if isinstance(tree, list) else tree.parts
    if isinstance(tree, AnyOf):
        return [b for part in parts for b in branches(part)]
    return [frozenset().union(*choice) for choice in product(*map(branches, parts))]


def curve(rng: Generator, straight: float = 0.5) -> Curve:
    if rng.random() < straight:
        a, b = int(rng.integers(-3, 4)), int(rng.integers(-3, 4))
        return line(Q(a), Q(b or (not a)), rational(rng))
    return disc(rational(rng, 2), rational(rng, 2), size(rng), bool(rng.integers(2)))


def through(rng: Generator, point: Vector, inside: bool | None = None) -> Curve:
    """Return a line or a circle through a point."""
    if rng.integers(2) and inside is None:
        a, b = Q(int(rng.integers(-3, 4))), Q(int(rng.integers(1, 4)))
        return line(a, b, -a * point[0] - b * point[1])
    radius, (c, s) = size(rng), slanted(rng)
    kept = bool(rng.integers(2)) if inside is None else inside
    return disc(point[0] + radius * c, point[1] + radius * s, radius, kept)


def slanted(rng: Generator) -> Vector:
    """Return a rational unit vector."""
    t = rational(rng)
    way = (1 - t**2) / (1 + t**2), 2 * t / (1 + t**2)
    return way if rng.integers(2) else (way[1], -way[0])


def simple(
    rng: Generator, kind: str, curves: Sequence[Curve], found: Energy, tree: Any = None
) -> Posed:
    """Pose the intersection of some sets, or another tree of them."""
    tree = list(range(len(curves))) if tree is None else tree
    unions = tuple(dict.fromkeys(branches(tree)))
    return posed(rng, kind, PlanarProblem(found, tuple(curves), unions), tree)


# --------------------------------------------------------------------------------- regular problems


def whole_plane(rng: Generator) -> Posed:
    return simple(rng, "no constraint", [], energy(rng))


def half_planes(rng: Generator) -> Posed:
    curves = [curve(rng, 1.0) for _ in range(int(rng.integers(1, 5)))]
    return simple(rng, "half-planes", curves, energy(rng))


def discs(rng: Generator) -> Posed:
    curves = [curve(rng, 0.0) for _ in range(int(rng.integers(1, 4)))]
    return simple(rng, "discs, inside and outside", curves, energy(rng))


def lines_and_circles(rng: Generator) -> Posed:
    curves = [curve(rng) for _ in range(int(rng.integers(2, 5)))]
    return simple(rng, "lines and circles", curves, energy(rng, 2))


def distances(rng: Generator) -> Posed:
    found = _bowl(rational(rng), rational(rng))
    return simple(rng, "lines and circles", [curve(rng) for _ in range(3)], found)


# ---------------------------------------------------------------------------- and/or trees, kinks


def trees(rng: Generator) -> Posed:
    shapes: list[Any] = [
        [AnyOf(0, 1)], [AnyOf(0, 1, 2)], [0, AnyOf(1, 2)], [AnyOf(AllOf(0, 1), 2)],
        [AnyOf(0, 1), AnyOf(2, 3)], [AnyOf(AllOf(0, AnyOf(1, 2)), 3)],
        [AnyOf(AllOf(0, 1), AllOf(0, 2))], [AnyOf(AllOf(0, 1), AllOf(2, 3))],
    ]  # fmt: skip
    tree = shapes[rng.integers(len(shapes))]
    count = 1 + max(i for b in branches(tree) for i in b)
    return simple(rng, "and/or trees", [curve(rng) for _ in range(count)], energy(rng, 2), tree)


def near_kinks(rng: Generator) -> Posed:
    """Put a critical point of the energy near a kink of a union, or in it."""
    found = energy(rng, 2)
    problem = PlanarProblem(found, (), (frozenset(),))
    critical = list(problem.candidates())
    x, y = critical[rng.integers(len(critical))]
    off = faint(rng) * int(rng.integers(-1, 2)), faint(rng) * int(rng.integers(-1, 2))
    kink = x + off[0], y + off[1]
    tree: Any = [[AnyOf(0, 1)], [AnyOf(0, 1), 2]][rng.integers(2)]
    curves = [through(rng, kink), through(rng, kink), curve(rng)][
        : 1 + max(max(b) for b in branches(tree))
    ]
    return simple(rng, "critical points at kinks", curves, found, tree)


def constrained_kinks(rng: Generator) -> Posed:
    """Put a point that rests on a face in the kink of a union of others, or near it."""
    base, found = curve(rng), energy(rng, 2)
    places = [
        p.point for p in PlanarProblem(found, (base,), (frozenset([0]),)).places() if p.active
    ]
    if not places:
        msg = "nothing rests on the curve"
        raise ValueError(msg)
    x, y = places[rng.integers(len(places))]
    at = _rounded((x, y), rng)
    tree: Any = [[0, AnyOf(1, 2)], [AnyOf(AllOf(0, 1), AllOf(0, 2))], [AnyOf(0, 1), 0]][
        rng.integers(3)
    ]
    curves = [base, through(rng, at), through(rng, at)][: 1 + max(max(b) for b in branches(tree))]
    return simple(rng, "faces at kinks", curves, found, tree)


def _rounded(q: Vector, rng: Generator) -> Vector:
    """Return a rational point with a small denominator near another one."""
    digits = 10 ** int(rng.choice(NEAR))
    return Q(round(q[0] * digits), digits), Q(round(q[1] * digits), digits)


# -------------------------------------------------------------------------- degenerate contacts


def touching(rng: Generator) -> Posed:
    """Two curves that touch, or miss or cut each other by little."""
    a, b = rational(rng, 1), rational(rng, 1)
    (c, s), r, t = slanted(rng), size(rng), size(rng)
    off = int(rng.integers(-1, 2)) * faint(rng)
    kept = [bool(k) for k in rng.integers(2, size=2)]
    first = disc(a, b, r, kept[0])
    if rng.integers(2):
        way = Q(sign(rng))
        second = line(way * c, way * s, -way * (c * a + s * b + r + off))
    else:
        apart = r + off + (t if rng.integers(2) else -t)
        second = disc(a + apart * c, b + apart * s, t, kept[1])
    found = energy(rng, 2)
    if rng.integers(2):  # which rests at the contact, if nothing else does
        far = r + rational(rng)
        found = _bowl(a + far * c, b + far * s)
    return simple(rng, "tangential contacts", [first, second], found)


def _bowl(x: Q, y: Q) -> Energy:
    return separable([[-x, Q(1)], [-y, Q(1)]], [[x], [y]], IDENTITY, (Q(0), Q(0)))


def weakly_active(rng: Generator) -> Posed:
    """Put a critical point of the energy on a curve, or next to it."""
    found = energy(rng, 2)
    critical = list(PlanarProblem(found, (), (frozenset(),)).candidates())
    x, y = critical[rng.integers(len(critical))]
    off = int(rng.integers(-1, 2)) * faint(rng)
    curves = [through(rng, (x + off, y)), curve(rng)][: int(rng.integers(1, 3))]
    return simple(rng, "weakly active", curves, found)


def weak_corners(rng: Generator) -> Posed:
    """Let one multiplier at a corner be zero, or small."""
    x, y = rational(rng, 2), rational(rng, 2)
    (c, s), off = slanted(rng), int(rng.integers(-1, 2)) * faint(rng)
    first = line(c, s, -c * x - s * y)
    way = rational(rng)
    found = _bowl(x - c + s * off, y - s - c * off)
    second = line(-s + way * c, c + way * s, -(-s + way * c) * x - (c + way * s) * y)
    return simple(rng, "weakly active", [first, second], found)


def redundant(rng: Generator) -> Posed:
    """Three or four curves through one point, or nearly."""
    at = rational(rng, 2), rational(rng, 2)
    count, off = int(rng.integers(3, 5)), int(rng.integers(-1, 2)) * faint(rng)
    curves = [through(rng, at) for _ in range(count - 1)]
    curves.append(through(rng, (at[0] + off, at[1])))
    tree: Any = [None, None, [AnyOf(0, 1), 2]][rng.integers(3)]
    curves = curves[:3] if tree else curves
    found = energy(rng, 2) if rng.integers(2) else _bowl(rational(rng), rational(rng))
    return simple(rng, "redundant contacts", curves, found, tree)


def carried(rng: Generator) -> Posed:
    """Let one of three or four curves through a point carry the force alone, or nearly."""
    x, y = rational(rng, 2), rational(rng, 2)
    curves = [through(rng, (x, y)) for _ in range(int(rng.integers(3, 5)))]
    g, share = curves[0].gradient((x, y)), size(rng) / int(rng.choice([1, 1, 100]))
    off = int(rng.integers(-1, 2)) * faint(rng)
    found = _bowl(x - share * g[0] + off * g[1], y - share * g[1] - off * g[0])
    return simple(rng, "carried by one contact", curves, found)


def same_zeros(rng: Generator) -> Posed:
    """Functions that vanish on one curve, or nearly."""
    base, off = curve(rng), int(rng.integers(-1, 2)) * faint(rng)
    k = Q(int(rng.integers(2, 5)), int(rng.integers(1, 4))) * (1 if rng.integers(4) else -1)
    other = Curve(k * base.bent, k * base.a, k * base.b, k * base.c + (0 if base.bent else off))
    tree: Any = [None, [AnyOf(0, 1)]][rng.integers(2)]
    return simple(rng, "equal zeros", [base, other], energy(rng, 2), tree)


# -------------------------------------------------------------------------- sides of the domain


def sides(rng: Generator) -> Posed:
    """Let the sides of the domain pass through stationary points, or by them."""
    found = energy(rng, 2)
    curves = [curve(rng) for _ in range(int(rng.integers(1, 3)))]
    problem = PlanarProblem(found, tuple(curves), (frozenset(range(len(curves))),))
    places = problem.places()
    if not places:
        msg = "nothing rests"
        raise ValueError(msg)
    x, y = places[rng.integers(len(places))].point
    near = [float(x), float(y)]
    steps = rng.integers(-1, 2, 2)
    near = [
        float(np.nextafter(t, np.inf * s)) if s else t for t, s in zip(near, steps, strict=True)
    ]
    box = [(near[0], near[0] + 4.0), (near[1] - 3.0, near[1] + 2.5)]
    if rng.integers(2):
        box = [(near[0] - 4.0, near[0]), (near[1], near[1] + 3.0)]
    return posed(rng, "on sides of the box", problem, list(range(len(curves))), box)


DRAWS = (
    whole_plane, half_planes, discs, lines_and_circles, distances, trees, near_kinks,
    constrained_kinks, touching, weakly_active, weak_corners, redundant, carried,
    same_zeros, sides,
)  # fmt: skip
