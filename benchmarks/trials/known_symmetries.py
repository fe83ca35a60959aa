"""Problems with symmetries, declared rightly and wrongly."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction as Q
from functools import partial
from typing import Any

import numpy as np

from benchmarks.trials.exact import Vector, with_roots
from benchmarks.trials.grids import TURN, Axis, Grid, S, circle, line
from benchmarks.trials.known import Known, Posed
from benchmarks.trials.known_grids import posed, slope
from benchmarks.trials.known_planes import PLANE, X, Y, distinct, faint, rational, size
from benchmarks.trials.known_planes import sign as either
from polycorner import Polyhedron, Symmetry
from polycorner.polyhedra.symmetry import Element

Generator = np.random.Generator
Map = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]  # order, signs, half turns


def carried(g: Map, q: Any) -> Any:
    """Return the image of a point in doubles."""
    order, signs, halves = (np.array(part) for part in g)
    return signs * np.asarray(q)[order] + halves * np.pi


def exactly(g: Map, q: Vector) -> Vector:
    return tuple(s * q[i] + h * TURN / 2 for i, s, h in zip(*g, strict=True))


def after(g: Map, h: Map) -> Map:
    """Return ``g`` after ``h``."""
    order = tuple(h[0][i] for i in g[0])
    signs = tuple(s * h[1][i] for i, s in zip(g[0], g[1], strict=True))
    halves = tuple((k + h[2][i]) % 2 for i, k in zip(g[0], g[2], strict=True))
    return order, signs, halves


def group(generators: Sequence[Map]) -> list[Map]:
    n = len(generators[0][0])
    found: list[Map] = [(tuple(range(n)), (1,) * n, (0,) * n)]
    for g in found:
        for h in generators:
            if (new := after(h, g)) not in found:
                found.append(new)
    return found[1:]


def declared(problem: Posed, generators: Sequence[Map], true: bool = True) -> Posed:
    symmetry = Symmetry(elements=[Element(partial(carried, g), {}) for g in generators])
    images = tuple(partial(exactly, g) for g in group(generators)) if true else ()
    kind = "symmetries" if true else "false symmetries"
    return replace(problem, kind=kind, group=images, symmetry=symmetry, refused=not true)


def even(rng: Generator, walls: bool) -> Axis:
    """Return an even function of one coordinate on an even interval."""
    roots = [abs(x) for x in distinct(rng, int(rng.integers(1, 3))) if x]
    both = [Q(0), *roots, *(-x for x in roots)]
    if len(set(both)) < len(both):
        raise ValueError
    end = size(rng)
    return line(slope(rng, both), both, [(-end, end)] if walls else [])


def mirrors(rng: Generator) -> Posed:
    """Even functions: mirrors, a swap where the axes are alike, the point reflection."""
    walls, alike = bool(rng.integers(2)), bool(rng.integers(2))
    first = even(rng, walls)
    second = first if alike else even(rng, walls)
    grid = Grid((first, second), ((1, 0), (0, 1)), (Q(0), Q(0)))
    reach = max([float(abs(x)) for k in grid.points() for x in k.point] + [3.0]) + 0.5
    problem = posed("", grid, [(-reach, reach)] * 2)
    maps: list[Map] = [
        ((0, 1), (-1, 1), (0, 0)),
        ((0, 1), (1, -1), (0, 0)),
        ((0, 1), (-1, -1), (0, 0)),
    ]
    if alike:
        maps += [((1, 0), (1, 1), (0, 0)), ((1, 0), (-1, 1), (0, 0))]
    some = rng.choice(len(maps), int(rng.integers(1, 3)), replace=False)
    return declared(problem, [maps[i] for i in some])


def half_turns(rng: Generator) -> Posed:
    """Functions of an even multiple of an angle, and an even function."""
    first = circle(
        either(rng) * size(rng), 2 * int(rng.integers(1, 3)), rational(rng) * int(rng.integers(2))
    )
    grid = Grid((first, even(rng, walls=False)), ((1, 0), (0, 1)), (Q(0), Q(0)))
    reach = max([float(abs(k.point[1])) for k in grid.points()] + [3.0]) + 0.5
    problem = posed("", grid, [None, (-reach, reach)])
    maps: list[Map] = [
        ((0, 1), (1, 1), (1, 0)),
        ((0, 1), (1, -1), (0, 0)),
        ((0, 1), (1, -1), (1, 0)),
    ]
    some = rng.choice(3, int(rng.integers(1, 3)), replace=False)
    return declared(problem, [maps[i] for i in some])


def false_mirrors(rng: Generator) -> Posed:
    """Declare a mirror that the energy, or a wall, or the box misses by little."""
    which, off = int(rng.integers(3)), faint(rng)
    first = even(rng, walls=False)
    points = sorted({r.at for r in first.rests})
    moved = [*points[:-1], points[-1] + (off if which == 0 else 0)]
    end = size(rng)
    walls = [(-end, end + (off if which == 1 else 0))]
    grid = Grid(
        (line(slope(rng, moved), moved, walls), even(rng, walls=False)),
        ((1, 0), (0, 1)),
        (Q(0),) * 2,
    )
    box = [(-5.0, 5.0 if which < 2 else float(np.nextafter(5.0, 6.0))), (-4.0, 4.0)]
    return declared(posed("", grid, box), [((0, 1), (-1, 1), (0, 0))], true=False)


def false_sections(rng: Generator) -> Posed:
    """Fix a coordinate without a symmetry, or with one of the set or the energy alone."""
    at, off = rational(rng), faint(rng)
    a, b = (int(k) for k in rng.integers(1, 4, 2))
    square = (a * X + b * Y - 1) ** 2
    D = Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2})
    energy = square
    if rng.integers(2):
        D = Polyhedron(PLANE, {"strip": 9 - square})
        small = float(off)
        energy = square + small * X
    field = Symmetry(fields=[{"x": -b, "y": a}])
    return Posed(
        "false symmetries", D, energy, [float(at), (-4.0, 4.0)], symmetry=field, refused=True
    )


def sections(rng: Generator) -> Posed:
    """Fix a coordinate that a translation moves: the list is that of the other one."""
    a, b = (int(k) for k in rng.integers(1, 4, 2))
    roots = [Q(round(4 * x), 4) for x in distinct(rng, int(rng.integers(1, 4)), Q(1, 2))]
    ends = sorted(distinct(rng, 2))
    inner = line(with_roots(roots, Q(either(rng))), roots, [tuple(ends)])
    at = Q(int(rng.integers(-8, 9)), 4)
    combined = (a * X + b * Y) if rng.integers(2) else (b * Y - a * X)
    way = 1 if combined == a * X + b * Y else -1
    D = Polyhedron(PLANE, {f"f{i}": f.subs(S, combined) for i, f in enumerate(inner.functions)})
    reach = 16.0
    names = [frozenset(f"f{i}" for i in r.active) for r in inner.rests]
    points = tuple(
        Known((at, (r.at - way * a * at) / b), active if r.index is not None else None, r.index)
        for r, active in zip(inner.rests, names, strict=True)
    )
    energy = inner.energy.subs(S, combined)
    return Posed("sections", D, energy, [float(at), (-reach, reach)], points)


DRAWS: tuple[Callable[[Generator], Posed], ...] = (
    mirrors, half_turns, false_mirrors, false_sections, sections,
)  # fmt: skip
