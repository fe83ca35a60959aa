"""The landscape of an energy on a polyhedron: from lists with proof, or from a search."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.formulas.periodicity import check_function
from polycorner.interrupts import first_interrupt
from polycorner.intervals.boxes import BoxFunctions
from polycorner.kinds import checked
from polycorner.landscapes.barriers import Landscape
from polycorner.landscapes.convex import convex_landscape
from polycorner.landscapes.curves import Curves
from polycorner.landscapes.passes import Sorted
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra import Polyhedron, Symmetry
from polycorner.progress import Progress, silent
from polycorner.proofs.lists.critical import critical_points, minima_on
from polycorner.proofs.lists.domains import Domain, domain
from polycorner.proofs.lists.enumeration import Limits
from polycorner.proofs.lists.tree import bisected
from polycorner.tolerances import SEARCH

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

MOST_BOXES = 20_000  # with which a side of a box is shown to miss the set
BEYOND = 1 / 64  # of a side that is a wall, by which boxes reach beyond it


@checked
def landscape(
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    box: Any,
    region: Any = (),
    symmetry: Symmetry | None = None,
    cap: float = inf,
    resolution: float = SEARCH.resolution,
    max_boxes: int = SEARCH.max_boxes,
    max_seconds: float = inf,
    workers: int = 1,
    progress: Progress = silent,
) -> Landscape:
    """Find all minima and passes of an energy on a polyhedron in a box, with proof.

    Critical points are listed by branch and bound
    (:mod:`~polycorner.proofs.lists.critical`), sorted into minima, passes and others
    (:mod:`~polycorner.landscapes.passes`), and from each pass verified routes lead down to the
    minima on its sides (:mod:`~polycorner.landscapes.descents`).

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``, on lines and circles; and/or trees and equations are allowed.
    energy : SmoothFunction or SymPy expression
        The energy ``E``.
    box : sequence or mapping
        As for :func:`.stationary_points`.  A side is a wall, called ``x > 0`` or ``x < 1``, unless
        it is shown that ``D`` does not meet it.
    region : sequence or mapping, optional
        Inequalities ``g >= 0`` that all hold in a region, which is left where one of them is 0: see
        :meth:`.Landscape.escape`.  The landscape is the one of ``D`` in this region.
    symmetry : Symmetry, optional
        As for :func:`.stationary_points`.
    cap : float, optional
        An energy above which nothing is asked.
    resolution, max_boxes, max_seconds, workers, progress : optional
        As for :func:`.stationary_points`, for each list.

    Returns
    -------
    Landscape
        What is not decided is among the passes, so that bounds from below are proved in any case.

    Raises
    ------
    TypeError, ValueError
        As :func:`.stationary_points` does.

    Examples
    --------
    >>> from polycorner import Manifold
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"disc": 9 - x**2 - y**2})
    >>> found = landscape(D, (x**2 - 1) ** 2 + y**2 + x / 10, box=[(-3, 3), (-3, 3)])
    >>> found.complete, len(found.minima), len(found.passes)
    (True, 2, 1)
    >>> [round(x, 9) for x in found.barrier(1, 0).rise]
    [0.901883406, 0.901883406]
    """
    checks.real("cap", cap, above=-inf, infinite=True)
    posed = pose(polyhedron, energy)
    whole = domain(polyhedron.manifold, box)
    checks.real("resolution", resolution, above=0)
    limits = Limits(max_boxes, max_seconds, workers, progress)
    limited = _limited(polyhedron, region)
    exits = _exits(polyhedron, limited, region)
    walls, sides, notes = _walls(pose(limited, posed.energy), whole, symmetry, cap)
    bounded = limited.intersected(walls) if walls else limited
    if not exits and symmetry is None:
        flat = convex_landscape(
            pose(bounded, posed.energy), box=sides, cap=cap, max_seconds=max_seconds,
            progress=progress,
        )  # fmt: skip
        if flat is not None:
            return replace(flat, problem=posed, notes=(*notes, *flat.notes))
    options: dict[str, Any] = {"box": sides, "resolution": resolution, "cap": cap, "limits": limits}
    with first_interrupt(limits.stop.set):
        found = critical_points(bounded, posed.energy, symmetry=symmetry, kept=exits, **options)
        ordered = Sorted(found, frozenset(exits), Curves(found.problem), cap)
        for name in exits:
            d = found.problem.polyhedron
            wall = d.functions[d.names.index(name)]
            on = d.intersected(equations=[wall], without=[name])
            ordered.leave(minima_on(on, posed.energy, **options), name)
        passes = tuple(ordered.passes(limits.stop.is_set))
    return Landscape(
        posed,
        tuple(node.minimum for node in ordered.nodes),
        passes,
        True,
        float(cap),
        bool(exits),
        (*notes, *_sections(whole)),
        ordered.euler,
    )


def _limited(polyhedron: Polyhedron, region: Any) -> Polyhedron:
    try:
        return polyhedron.intersected(region)
    except (TypeError, ValueError) as error:
        msg = f"region: {error}"
        raise type(error)(msg) from None


def _exits(polyhedron: Polyhedron, limited: Polyhedron, region: Any) -> tuple[str, ...]:
    """Return the names of the inequalities of a region."""
    given = region.values() if isinstance(region, Mapping) else region
    several = given if isinstance(given, Iterable) else [given]
    own = {id(f) for f in polyhedron.functions}
    again = [part.name for part in several if id(part) in own]
    if again:
        checks.refuse("region", "inequalities that the polyhedron does not have", again[0])
    for function in limited.functions[len(polyhedron.functions) :]:
        if not function.expression.free_symbols:
            checks.refuse("region", "inequalities of coordinates", function.expression)
        check_function(function, periodic=True)
    names = limited.names[len(polyhedron.functions) :]
    always, _ = limited.unions
    inside = frozenset(limited.names[i] for i in always)
    parted = [name for name in names if name not in inside]
    if parted:
        checks.refuse("region", "inequalities that all hold", f"a union with {parted[0]}")
    return names


def _sections(box: Domain) -> tuple[str, ...]:
    """Return what is said of circles on which a coordinate is fixed."""
    manifold = box.manifold
    names = [manifold.names[i] for i in box.fixed if math.isfinite(manifold.periods[i])]
    if not names:
        return ()
    given = ", ".join(f"{name} = {box.lower[manifold.names.index(name)]:g}" for name in names)
    note = (
        f"All is said of the section {given}: where an orbit of the symmetry meets it in several "
        "points, these are told apart."
    )
    return (note,)


def _walls(
    problem: Problem, box: Domain, symmetry: Symmetry | None, cap: float
) -> tuple[dict[str, Any], list[Any], tuple[str, ...]]:
    """Return the sides of a box that the set meets as inequalities, and sides to search in."""
    manifold = problem.polyhedron.manifold
    functions = BoxFunctions(problem.functions, manifold)
    lined = [i for i in box.free if box.upper[i] - box.lower[i] < manifold.periods[i]]
    met = {
        (i, k) for i in lined for k in (0, 1)
        if not _misses(problem, functions, box, i, (box.lower, box.upper)[k][i], cap)
    }  # fmt: skip
    if met and symmetry is not None:
        met = {(i, k) for i in lined for k in (0, 1)}  # the same ones at the images of each
    walls: dict[str, Any] = {}
    ends = zip(box.lower.tolist(), box.upper.tolist(), strict=True)
    # Whole circles are rounded outwards, and None stands for them.
    sides: list[Any] = [
        None if b - a > period else [a, b] if a < b else a
        for (a, b), period in zip(ends, manifold.periods, strict=True)
    ]
    for i, k in sorted(met):
        name, value = manifold.names[i], float((box.lower, box.upper)[k][i])
        q = manifold.symbols[i]
        walls[f"{name} {'<' if k else '>'} {value:g}"] = value - q if k else q - value
        width = box.upper[i] - box.lower[i]
        more = min(BEYOND * width, 0.45 * (manifold.periods[i] - width))
        sides[i][k] += more if k else -more
    note = f"Sides of the box are walls: {', '.join(walls)}." if walls else ""
    return walls, sides, (note,) if note else ()


def _misses(
    problem: Problem, functions: BoxFunctions, box: Domain, axis: int, value: float, cap: float
) -> bool:
    """Whether it is shown that the set, up to an energy, does not meet a side of a box."""
    m, treated = problem.inequalities, 0
    lower, upper = box.lower[None].copy(), box.upper[None].copy()
    lower[:, axis] = upper[:, axis] = value
    units = np.where(box.units > 0, box.units, np.inf)
    while len(lower) and treated < MOST_BOXES:
        treated += len(lower)
        low, high = functions.values(lower, upper)
        left = problem.polyhedron.implicit_of(high[:, :m]) >= 0
        zeros = (low[:, m:-1] <= 0) & (high[:, m:-1] >= 0)
        left &= zeros.all(axis=1) & (low[:, -1] <= cap)
        lower, upper = lower[left], upper[left]
        sides = (upper - lower) / units
        if len(lower) and (sides.max(axis=1) <= 0).any():
            return False  # a point that may be in the set
        lower, upper = bisected(lower, upper, sides.argmax(axis=1))
    return not len(lower)
