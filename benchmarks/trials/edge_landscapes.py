"""Landscapes on the edge: walls and tips exactly on passes, ways of no width, repeated walls."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import sympy as sp

from benchmarks.trials.flooding import Chart, Tree
from benchmarks.trials.known_trees import Truth, known_on
from benchmarks.trials.planar_landscapes import polygons_on_passes, rooms, slits, wells_in_boxes
from benchmarks.trials.posed_landscapes import (
    Generator,
    Posed,
    Set,
    X,
    Y,
    number,
    outside_disc,
    planar,
    polyhedron,
    unit,
)

WIDTHS = (0, 0, 1, -1)  # of ways, in units of ``FAINT``
FAINT = (sp.Rational(1, 10**9), sp.Rational(1, 10**12))


def pair_of_wells(rng: Generator) -> tuple[sp.Expr, Set]:
    """Return an energy with wells near (-1, 0) and (1, 0) and a saddle at the origin, in a box."""
    k = number(rng, 0.5, 2)
    energy = (X**2 - 1) ** 2 + k * Y**2 + number(rng, 0.02, 0.1) * X**3
    return energy, Set.of([2 - X, X + 2, 2 - Y, Y + 2])


def exact_walls(rng: Generator) -> Posed:
    """Let a line, or a circle, run through the saddle, and carry nothing there."""
    energy, D = pair_of_wells(rng)
    c, s = unit(rng)
    if rng.integers(2):
        D.add(c * X + s * Y)
    else:
        r = number(rng, 0.25, 0.5)
        D.add(outside_disc((r * c, r * s), r))
    return planar("walls through saddles", D.chart(energy))


def exact_tips(rng: Generator) -> Posed:
    """Let the tip of a wedge be the saddle."""
    energy, D = pair_of_wells(rng)
    first, second = number(rng, 0.25, 4), number(rng, -4, -0.25)
    way = int(rng.choice([-1, 1]))
    D.add(way * (Y - first * X), way * (Y - second * X))
    return planar("tips on saddles", D.chart(energy))


def through(energy: sp.Expr, at: sp.Expr, open_: bool) -> Truth:
    """Return two minima, joined at an energy or never."""
    truth = known_on(Set.of([2 - X, X + 2, 2 - Y, Y + 2]).chart(energy))
    height = float(at) if open_ else np.inf
    return Truth(truth.points, truth.energies, {(0, 1): (height,)}, truth.turns)


def width(rng: Generator) -> sp.Rational:
    """Return half a width, which may be zero or negative."""
    return WIDTHS[rng.integers(len(WIDTHS))] * FAINT[rng.integers(len(FAINT))]


def thin_slits(rng: Generator) -> Posed:
    """Put a wall between the wells, whose hole has no width, or little, or less than none."""
    energy, D = pair_of_wells(rng)
    s, t, w = number(rng, -0.5, 0.5), number(rng, 0.05, 0.3), width(rng)
    D.functions += [X - t, -t - X, Y - s + w, s + w - Y]
    D.parts.append(("or", 4, 5, ("and", 6, 7)))
    return posed("slits of no width", D.chart(energy), energy.subs({X: 0, Y: s}), w >= 0)


def touching_discs(rng: Generator) -> Posed:
    """Leave two discs out that touch each other, or miss or overlap each other by little."""
    energy, D = pair_of_wells(rng)
    s, w, r = number(rng, -0.2, 0.2), width(rng), number(rng, 2, 2.125)
    D.add(outside_disc((0, s + r + w), r))
    D.add(outside_disc((0, s - r - w), r))
    return posed("discs that touch", D.chart(energy), energy.subs({X: 0, Y: s}), w >= 0)


def posed(kind: str, chart: Chart, height: sp.Expr, open_: bool) -> Posed:
    """Pose a chart whose answer is known."""
    answer = partial(through, chart.energy, height, open_)
    return replace(planar(kind, chart), answer=answer)


def repeated_walls(rng: Generator) -> Posed:
    """State some of the functions twice, times a positive function."""
    draws: Sequence[Callable[[Generator], Posed]] = (
        wells_in_boxes, slits, rooms, polygons_on_passes,
    )  # fmt: skip
    given = draws[rng.integers(len(draws))](rng)
    chart = given.answer.args[0]
    count = len(chart.functions)
    copied = [k for k in range(count) if rng.integers(2)] or [0]
    factors = [sp.Integer(1), sp.Rational(3, 2), 1 + X**2 / 9, sp.exp(Y / 5)]
    more = [chart.functions[k] * factors[rng.integers(len(factors))] for k in copied]
    place = {k: count + i for i, k in enumerate(copied)}

    def doubled(tree: Tree) -> Tree:
        if isinstance(tree, int):
            return ("and", tree, place[tree]) if tree in place else tree
        return (tree[0], *(doubled(part) for part in tree[1:]))

    D = polyhedron(given.polyhedron.manifold, [*chart.functions, *more], doubled(chart.tree))
    return Posed("repeated walls", D, given.energy, given.box, given.answer)


DRAWS: tuple[Callable[[Generator], Posed], ...] = (
    exact_walls, exact_tips, thin_slits, touching_discs, repeated_walls,
)  # fmt: skip
