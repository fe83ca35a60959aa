"""Landscapes in the plane: wells in boxes and discs, walls, obstacles, slits, copies, regions."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from benchmarks.trials.flooding import Array, Chart, Tree
from benchmarks.trials.posed_landscapes import (
    Generator,
    Posed,
    Set,
    X,
    Y,
    box,
    container,
    disc,
    gaussians,
    number,
    outside_disc,
    outside_polygon,
    planar,
    saddles,
    tilt,
    unit,
    wells,
)
from polycorner import Symmetry
from polycorner.polyhedra.symmetry import Element

# --------------------------------------------------------------------------------------- the plane


def wells_in_boxes(rng: Generator) -> Posed:
    return planar("wells in boxes", Set.of(box(rng)).chart(wells(rng)))


def wells_in_discs(rng: Generator) -> Posed:
    return planar("wells in discs", Set.of(disc(rng)).chart(wells(rng)))


def gaussian_wells(rng: Generator) -> Posed:
    energy = gaussians(rng, int(rng.integers(4, 9)), 1.5)
    return planar("many wells", Set.of(container(rng)).chart(energy))


def cut_passes(rng: Generator) -> Posed:
    """Let a wall run through a saddle, or by it, along the way down."""
    energy, D = wells(rng), Set.of(container(rng))
    at = saddles(energy)[0]
    c, s = unit(rng)
    D.add(c * (X - at[0]) + s * (Y - at[1]) - number(rng, -0.25, 0.25))
    return planar("walls across passes", D.chart(energy))


def discs_on_passes(rng: Generator) -> Posed:
    """Put discs on saddles, so that passes lie on their edges."""
    energy, D = wells(rng), Set.of(container(rng))
    for at in saddles(energy)[: int(rng.integers(1, 4))]:
        shift = [x + number(rng, -0.25, 0.25) for x in at]
        D.add(outside_disc(shift, number(rng, 0.15, 0.5)))
    return planar("discs on passes", D.chart(energy))


def polygons_on_passes(rng: Generator) -> Posed:
    """Put a polygon on saddles, so that passes lie at its corners."""
    energy, D = wells(rng), Set.of(container(rng))
    for at in saddles(energy)[: int(rng.integers(1, 3))]:
        shift = [x + number(rng, -0.2, 0.2) for x in at]
        D.add(*outside_polygon(rng, shift, 0.5))
    return planar("polygons on passes", D.chart(energy))


def obstacles(rng: Generator) -> Posed:
    """Put discs and polygons anywhere."""
    energy, D = wells(rng), Set.of(container(rng))
    for _ in range(int(rng.integers(1, 4))):
        at = number(rng, -1, 1), number(rng, -1, 1)
        if rng.integers(2):
            D.add(outside_disc(at, number(rng, 0.15, 0.5)))
        else:
            D.add(*outside_polygon(rng, at, 0.5))
    return planar("obstacles", D.chart(energy))


def slit_wall(rng: Generator, D: Set, holes: int, least: float = 0.1) -> None:
    """Add a wall with holes."""
    c, s = unit(rng)
    across, along = c * X + s * Y, c * Y - s * X
    middle, thick = number(rng, -0.25, 0.25), number(rng, 0.05, 0.25)
    first = len(D.functions)
    D.functions += [middle - thick - across, across - middle - thick]
    parts: list[Tree] = [first, first + 1]
    for k in range(holes):
        low = number(rng, -1, 0.8) if holes == 1 else number(rng, -1 + k, -0.6 + k)
        D.functions += [along - low, low + number(rng, least, 0.3) - along]
        parts.append(("and", first + 2 * k + 2, first + 2 * k + 3))
    D.parts.append(("or", *parts))


def slits(rng: Generator) -> Posed:
    """Put a wall with a hole or two between wells."""
    D = Set.of(container(rng))
    slit_wall(rng, D, int(rng.integers(1, 3)))
    return planar("slits", D.chart(wells(rng)))


def rooms(rng: Generator) -> Posed:
    """Take the union of overlapping boxes and discs."""
    D = Set([], [])
    at, alternatives = (number(rng, -1, -0.5), number(rng, -1, -0.5)), []
    for _ in range(int(rng.integers(2, 5))):
        first = len(D.functions)
        if rng.integers(2):
            D.functions.append(-outside_disc(at, number(rng, 0.4, 0.7)))
        else:
            a, b = number(rng, 0.3, 0.7), number(rng, 0.3, 0.7)
            D.functions += [at[0] + a - X, X - at[0] + a, at[1] + b - Y, Y - at[1] + b]
        alternatives.append(("and", *range(first, len(D.functions))))
        step = [(0.7, 0.1), (0.1, 0.7), (0.6, 0.6)][rng.integers(3)]
        at = tuple(
            min(x + number(rng, d - 0.1, d), sp.Rational(5, 4))
            for x, d in zip(at, step, strict=True)
        )
    D.parts.append(("or", *alternatives))
    energy = tilt(rng) + (
        gaussians(rng, int(rng.integers(1, 4)), 1) if rng.integers(2) else X * Y / 2
    )
    return planar("rooms at concave corners", D.chart(energy))


# ------------------------------------------------------------------------------------- symmetries


def symmetric(rng: Generator) -> tuple[Chart, list[Any]]:
    """Return a chart with the symmetry of a mirror, a half turn, or two mirrors, and their maps."""
    maps = [[(-1, 1)], [(-1, -1)], [(-1, 1), (1, -1), (-1, -1)]][rng.integers(3)]
    base = wells(rng)

    def image(f: sp.Expr, g: tuple[int, int]) -> sp.Expr:
        return f.subs({X: g[0] * X, Y: g[1] * Y}, simultaneous=True)

    energy = (base + sum(image(base, g) for g in maps)) / (1 + len(maps))
    reach = number(rng, 1.25, 2)
    D = Set.of([reach - X, reach + X, reach - Y, reach + Y] if rng.integers(2) else
               [reach**2 - X**2 - Y**2])  # fmt: skip
    at = number(rng, -1, 1), number(rng, -1, 1)
    chosen = int(rng.integers(3))
    if chosen:
        one = [outside_disc(at, number(rng, 0.15, 0.4))]
        one = one if chosen == 1 else outside_polygon(rng, at, 0.4)
        seen: list[list[sp.Expr]] = []
        for g in [(1, 1), *maps]:
            copy = [sp.expand(image(f, g)) for f in one]
            if not any(set(copy) == set(other) for other in seen):
                seen.append(copy)
                D.add(*copy)
    return D.chart(energy), maps


def moved(signs: tuple[int, int], q: Array) -> Array:
    return np.asarray(q) * signs


def renamed(chart: Chart, g: tuple[int, int]) -> dict[str, str]:
    """Return which function takes at the image of a point the value of a function at the point."""
    found = {}
    there = [
        sp.expand(f.subs({X: g[0] * X, Y: g[1] * Y}, simultaneous=True)) for f in chart.functions
    ]
    for i, f in enumerate(chart.functions):
        j = there.index(sp.expand(f))
        if i != j:
            found[f"f{i}"] = f"f{j}"
    return found


def undeclared_copies(rng: Generator) -> Posed:
    return centred(planar("symmetric copies, not declared", symmetric(rng)[0]))


def declared_copies(rng: Generator) -> Posed:
    chart, maps = symmetric(rng)
    elements = [Element(partial(moved, g), renamed(chart, g)) for g in maps]
    posed = centred(planar("symmetric copies, declared", chart))
    return replace(posed, symmetry=Symmetry(elements=elements))


def centred(posed: Posed) -> Posed:
    """Return a problem in a box that its symmetry maps to itself."""
    return replace(posed, box=[(-2.25, 2.25)] * 2)


# ---------------------------------------------------------------------------------------- regions


def escapes(rng: Generator) -> Posed:
    """Take a region around one or two wells."""
    energy, D = wells(rng), Set.of(container(rng))
    if rng.integers(2):
        slit_wall(rng, D, 1)
    c, s = unit(rng)
    regions = [
        [number(rng, -0.5, 1) - c * X - s * Y],
        [-outside_disc((number(rng, -0.5, 0.5), 0), number(rng, 0.6, 1.2))],
        [c * X + s * Y + number(rng, 0, 1), s * X - c * Y + number(rng, 0, 1)],
    ]
    region = regions[rng.integers(3)]
    return planar("escapes", D.chart(energy, region), region)


def cages(rng: Generator) -> Posed:
    """Take a region whose side is behind a wall without holes, or in part."""
    energy, D = wells(rng), Set.of(container(rng))
    slit_wall(rng, D, 0)
    across = D.functions[-1] - number(rng, -0.04, 0.04)
    region = [across if rng.integers(2) else -across]
    return planar("cages", D.chart(energy, region), region)


DRAWS: tuple[Callable[[Generator], Posed], ...] = (
    wells_in_boxes, wells_in_discs, gaussian_wells, cut_passes, discs_on_passes,
    polygons_on_passes, obstacles, slits, rooms, undeclared_copies, declared_copies,
)  # fmt: skip
REGIONS = (escapes, cages)
