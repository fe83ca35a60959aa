"""Products of axes, and quadratic functions on balls and spheres."""

from collections.abc import Sequence
from fractions import Fraction as Q
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.trials.exact import Poly, added, power, real_roots, sign, times, with_roots
from benchmarks.trials.grids import TURN, Axis, Grid, circle, kinked, line, number, sheets
from benchmarks.trials.known import Known, Posed
from benchmarks.trials.known_planes import distinct, faint, rational, size
from benchmarks.trials.known_planes import sign as either
from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.formulas.functions import SmoothFunction

Generator = np.random.Generator
WIDE = 64.0


def slope(rng: Generator, roots: Sequence[Q]) -> Poly:
    return with_roots(roots, either(rng) * Q(1, int(rng.integers(1, 5))))


def axis(rng: Generator, pieces: int, most: int = 3) -> Axis:
    """Return an axis of up to three critical points on some intervals."""
    roots = distinct(rng, int(rng.integers(1, most + 1)))
    ends = sorted(distinct(rng, 2 * pieces))
    intervals = [(ends[2 * k], ends[2 * k + 1]) for k in range(pieces)]
    return line(slope(rng, roots), roots, intervals)


def unimodular(rng: Generator, n: int) -> tuple[tuple[int, ...], ...]:
    drawn = rng.integers(-1, 2, (n, n))
    lower, upper = (
        np.tril(drawn, -1) + np.eye(n, dtype=int),
        np.triu(drawn, 1) + np.eye(n, dtype=int),
    )
    return tuple(map(tuple, (lower @ upper).tolist())) if rng.integers(2) else tuple(
        map(tuple, np.eye(n, dtype=int).tolist())
    )  # fmt: skip


def posed(kind: str, grid: Grid, box: Any = None, names: str = "x y z w") -> Posed:
    """Return the problem of a grid; ``box`` is found where it is not given."""
    n = len(grid.axes)
    around = [a.circle for a in grid.axes]
    periods = tuple(2 * np.pi if c else np.inf for c in around)
    M = Manifold(tuple(names.split()[:n]), periods)
    groups = []
    for i, (axis_, functions) in enumerate(zip(grid.axes, grid.functions(M.symbols), strict=True)):
        named = [SmoothFunction(f"f{i}{j}", f, M) for j, f in enumerate(functions)]
        if named:
            groups.append(AnyOf(*(AllOf(*(named[j] for j in b)) for b in axis_.branches)))
    equations = grid.equations(M.symbols)
    if not groups and not equations:
        groups = [SmoothFunction("everywhere", 1 + sum(sp.cos(x) ** 2 for x in M.symbols), M)]
    known = tuple(grid.points())
    if box is None:
        reach = max([float(max(map(abs, k.point))) for k in known] + [3.0]) + 0.84375
        box = [None if c else (-reach, reach + 0.03125) for c in around]
    inside = tuple(k for k in known if _inside(k.point, box, around))
    beside = tuple(k for k in known if k not in inside)
    circles = {i: TURN for i, c in enumerate(around) if c}
    polyhedron = Polyhedron(M, groups, equations)
    return Posed(
        kind, polyhedron, grid.energy(M.symbols), box, inside, beside=beside, circles=circles
    )


def _inside(point: Sequence[Q], box: Any, around: Sequence[bool]) -> bool:
    for x, side, whole in zip(point, box, around, strict=True):
        if side is None:
            continue
        low, high = Q(side[0]), Q(side[1])
        turns = range(-3, 4) if whole else [0]
        if not any(low <= x + k * TURN <= high for k in turns):
            return False
    return True


def shift(rng: Generator, n: int) -> tuple[Q, ...]:
    return tuple(rational(rng, 1) for _ in range(n)) if rng.integers(2) else (Q(0),) * n


# --------------------------------------------------------------------------------- regular problems


def boxes(rng: Generator) -> Posed:
    n = int(rng.integers(1, 4))
    axes = tuple(axis(rng, int(rng.integers(0, 2)), 3 if n < 3 else 2) for _ in range(n))
    return posed("boxes and parallelepipeds", Grid(axes, unimodular(rng, n), shift(rng, n)))


def kinks_of_energies(rng: Generator) -> Posed:
    """Energies with ``|x - a|``, on the side of a wall or of the domain now and then."""
    n, at, pull = int(rng.integers(1, 3)), rational(rng, 2), either(rng) * size(rng)
    roots = distinct(rng, int(rng.integers(1, 3)))
    way = [None, at, rational(rng)][rng.integers(3)]
    intervals = [] if way is None else [(way, way + size(rng))]
    first = kinked(slope(rng, roots), at, pull, intervals)
    axes = (first, *(axis(rng, int(rng.integers(0, 2)), 2) for _ in range(n - 1)))
    grid = Grid(axes, unimodular(rng, n), (Q(0),) * n)
    box = None
    if n == 1 and rng.integers(2):
        box = [(float(at), float(at) + 7.0) if rng.integers(2) else (float(at) - 7.0, float(at))]
    return posed("kinks of the energy", grid, box)


def unions_of_boxes(rng: Generator) -> Posed:
    n = int(rng.integers(1, 3))
    axes = tuple(axis(rng, int(rng.integers(1, 3)), 3) for _ in range(n))
    return posed("unions of boxes", Grid(axes, unimodular(rng, n), shift(rng, n)))


def circles(rng: Generator) -> Posed:
    """Functions on tori and cylinders."""
    axes = []
    for k in range(int(rng.integers(1, 3))):
        arc = (rational(rng), Q(int(rng.integers(-9, 10)), 10)) if rng.integers(2) else None
        phase = rational(rng) if rng.integers(2) else Q(0)
        axes.append(circle(either(rng) * size(rng), int(rng.integers(1, 4 - k)), phase, arc))
    if rng.integers(2):
        axes.append(axis(rng, int(rng.integers(0, 2)), 2))
    n = len(axes)
    whole = np.eye(n, dtype=int)
    if n > 1 and axes[1].circle and rng.integers(2):
        whole[1, 0] = int(rng.integers(-2, 3))
    return posed("circles", Grid(tuple(axes), tuple(map(tuple, whole.tolist())), (Q(0),) * n))


def seams(rng: Generator) -> Posed:
    """Circles whose domain begins, or begins and ends, where the energy is stationary."""
    first = circle(
        either(rng) * size(rng), int(rng.integers(1, 4)), rational(rng) * int(rng.integers(2))
    )
    grid = Grid((first, axis(rng, 0, 2)), ((1, 0), (0, 1)), (Q(0), Q(0)))
    start = float(next(grid.points()).point[0]) - 2 * np.pi * int(rng.integers(2))
    start = float(np.nextafter(start, start + int(rng.integers(-1, 2))))
    width = [2 * np.pi, np.pi, 2.0][rng.integers(3)]
    return posed("circles", grid, [(start, start + width), (-4.0, 4.0)])


def equations(rng: Generator) -> Posed:
    n = int(rng.integers(2, 4))
    axes = [axis(rng, int(rng.integers(0, 2)), 2) for _ in range(n)]
    places = distinct(rng, int(rng.integers(1, 4)))
    if not rng.integers(4):
        places += places[:1]  # a double root, where the equation has no gradient
    roots = distinct(rng, 2)
    axes[0] = sheets(slope(rng, roots), places)
    return posed("equations", Grid(tuple(axes), unimodular(rng, n), shift(rng, n)))


# ---------------------------------------------------------------------------- near and double roots


def split_roots(rng: Generator) -> Posed:
    """Two critical points, or a critical point and a wall, at a small distance."""
    n = int(rng.integers(1, 3))
    roots, off = distinct(rng, int(rng.integers(1, 3))), faint(rng)
    if rng.integers(2):
        first = line(slope(rng, [*roots, roots[0] + off]), [*roots, roots[0] + off])
    else:
        first = line(slope(rng, roots), roots, [(roots[0] + either(rng) * off, roots[0] + 3)])
    axes = (first, *(axis(rng, int(rng.integers(0, 2)), 2) for _ in range(n - 1)))
    return posed("pairs at 1e-6 to 1e-12", Grid(axes, unimodular(rng, n), shift(rng, n)))


def double_roots(rng: Generator) -> Posed:
    n = int(rng.integers(1, 3))
    roots = distinct(rng, int(rng.integers(1, 3)))
    many = [*roots, *roots[:1] * int(rng.integers(1, 3))]
    axes = (
        line(slope(rng, many), roots),
        *(axis(rng, int(rng.integers(0, 2)), 2) for _ in range(n - 1)),
    )
    return posed("double roots", Grid(axes, unimodular(rng, n), shift(rng, n)))


def split_intervals(rng: Generator) -> Posed:
    """Intervals that meet at a critical point of the energy, or end a small distance apart."""
    roots = distinct(rng, int(rng.integers(1, 3)))
    at = roots[0] + int(rng.integers(-1, 2)) * faint(rng) * int(rng.integers(2))
    gap = faint(rng) * int(rng.integers(2))
    first = line(slope(rng, roots), roots, [(at - 1, at), (at + gap, at + 2)])
    axes = (first, *(axis(rng, 1, 2) for _ in range(int(rng.integers(0, 2)))))
    return posed(
        "critical points at kinks", Grid(axes, unimodular(rng, len(axes)), shift(rng, len(axes)))
    )


def faint_walls(rng: Generator) -> Posed:
    """Multipliers of exactly zero."""
    roots = distinct(rng, 2)
    first = line(
        slope(rng, roots), roots, [tuple(sorted((roots[0], roots[0] + either(rng) * size(rng))))]
    )
    axes = (first, axis(rng, 1, 2))
    return posed("weakly active", Grid(axes, unimodular(rng, 2), shift(rng, 2)))


def domain_sides(rng: Generator) -> Posed:
    """Let the domain end where points rest, in one to three dimensions."""
    n = int(rng.integers(1, 4))
    grid = Grid(tuple(axis(rng, int(rng.integers(0, 2)), 2) for _ in range(n)), tuple(
        map(tuple, np.eye(n, dtype=int).tolist())), (Q(0),) * n)  # fmt: skip
    box = []
    for a in grid.axes:
        at = [float(r.at) for r in a.rests] or [0.0]
        x = at[rng.integers(len(at))]
        x = float(np.nextafter(x, np.inf * (k - 1))) if (k := int(rng.integers(3))) != 1 else x
        box.append((x, x + 5.0) if rng.integers(2) else (x - 5.0, x))
    return posed("on sides of the box", grid, box)


# ------------------------------------------------------------------------------ balls and spheres


def balls(rng: Generator) -> Posed:
    """``sum (a_i x_i^2 / 2 - b_i x_i)`` in a ball, outside of it, or on the sphere."""
    n = int(rng.integers(2, 5))
    a = [rational(rng) or Q(1) for _ in range(n)]
    b = [rational(rng) or Q(1, 2) for _ in range(n)]
    radius = Q(int(rng.integers(2, 9)), 4)
    where = ["inside", "outside", "on"][rng.integers(3)]
    M = Manifold.euclidean("x y z w"[: 2 * n - 1])
    q = M.symbols
    formula = sum(number(c) * x**2 / 2 - number(d) * x for c, d, x in zip(a, b, q, strict=True))
    f = number(radius) ** 2 - sum(x**2 for x in q)
    found = []
    centre = tuple(d / c for c, d in zip(a, b, strict=True))
    level = sign(radius**2 - sum((x**2 for x in centre), Q(0)))
    negative = sum(c < 0 for c in a)
    if where != "on" and level == (1 if where == "inside" else -1):
        found.append(Known(centre, frozenset(), negative))
    way = -1 if where == "outside" else 1
    for lam, _ in real_roots(_secular(a, b, radius)):  # dE = lam d(radius^2 - q^2)
        if where != "on" and way * sign(lam) <= 0:
            continue
        bent = [c + 2 * lam for c in a]
        at = tuple(d / h for d, h in zip(b, bent, strict=True))
        turned = sum((x**2 / h for x, h in zip(at, bent, strict=True)), Q(0))
        index = sum(h < 0 for h in bent) - (turned < 0)
        active = frozenset() if where == "on" else frozenset(["ball"])
        found.append(Known(at, active, index if sign(turned) else None))
    reach = max([float(max(map(abs, k.point))) for k in found] + [float(radius)]) + 0.53125
    polyhedron = (
        Polyhedron(M, [], {"ball": f}) if where == "on" else Polyhedron(M, {"ball": way * f})
    )
    return Posed("balls and spheres", polyhedron, formula, [(-reach, reach)] * n, tuple(found))


def _secular(a: Sequence[Q], b: Sequence[Q], radius: Q) -> Poly:
    """Return the numerator of ``sum b_i^2 / (a_i + 2 lam)^2 - radius^2`` for numbers ``lam``."""
    squares: dict[Q, Q] = {}
    for c, d in zip(a, b, strict=True):
        squares[c] = squares.get(c, Q(0)) + d**2
    total: Poly = [-(radius**2)]
    for c in squares:
        total = times(total, power([c, Q(2)], 2))
    for c, d in squares.items():
        part: Poly = [d]
        for other in squares:
            part = times(part, power([other, Q(2)], 2)) if other != c else part
        total = added(total, part)
    return total


DRAWS = (
    boxes, kinks_of_energies, unions_of_boxes, circles, seams, equations, split_roots,
    double_roots, split_intervals, faint_walls, domain_sides, balls,
)  # fmt: skip
