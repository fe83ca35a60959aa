"""Enclosures of values, gradients and Hessians on boxes: compiled intervals against balls.

Three systems: the six-hump camel function; nine gaps and the energy of a pair of dumbbells in the
plane; the same in the drum.  The reference is the same formulas in ball arithmetic (python-flint,
53 bits), one box at a time from Python.  Both must contain each other's values at the middles of
the boxes before they are timed.  One thread.
"""

import math
import statistics
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from side_by_side import Times, interleave, print_table, ratio, seconds, write

from polycorner import Manifold, SmoothFunction
from polycorner.dumbbells import DumbbellPair
from polycorner.formulas.interval_kernels import best_rounding
from polycorner.formulas.rounding import ROUNDINGS
from polycorner.intervals.balls import between, bounds, precision
from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Formulas, SmoothForms
from polycorner.intervals.tapes import Box

BOXES, FEW, ROUNDS, WIDTH = 40_000, 40, 7, 1e-3
ORDERS = ("values", "gradients", "hessians")
FORMS = ("mean_value", "monotone")
BITS = 53

System = tuple[Sequence[SmoothFunction], Manifold, Sequence[float]]


def camel() -> System:
    """Return the six-hump camel function, and the reach of its boxes."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    f = (4 - 2.1 * x**2 + x**4 / 3) * x**2 + x * y + (-4 + 4 * y**2) * y**2
    return [SmoothFunction("camel", f, M)], M, [3, 2]


def pair(radius: float) -> System:
    """Return ten functions of a pair of dumbbells, and the reach of its boxes."""
    model = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=radius)
    across = 20 if radius == math.inf else 20 / radius
    return [*model.polyhedron.functions, model.energy], model.manifold, [across, 20, 3] * 2


def boxes(reach: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return random boxes, ``2 WIDTH`` of the reach wide."""
    size = np.array(reach, dtype=float)
    middle = np.random.default_rng(1).uniform(-1, 1, (BOXES, len(size))) * size
    return middle - WIDTH * size, middle + WIDTH * size


def smooth_boxes(
    formulas: Formulas, lo: np.ndarray, hi: np.ndarray
) -> "list[tuple[SmoothForms, Box]]":
    """Return boxes on which all branches are decided, which is what balls differentiate."""
    rows, found = range(len(formulas.names)), []
    for sides in zip(lo, hi, strict=True):
        box = Box([between(*side) for side in zip(*sides, strict=True)])
        forms = formulas.smooth(box, rows)
        if isinstance(forms, SmoothForms):
            found.append((forms, box))
        if len(found) == FEW:
            break
    return found


def agree(F: BoxFunctions, formulas: Formulas, lo: np.ndarray, hi: np.ndarray) -> None:
    """Check that enclosures of a few boxes meet enclosures in balls of the middles."""
    low, high = F.values(lo[:FEW], hi[:FEW])
    for i in range(FEW):
        middle = Box([between(m, m) for m in (lo[i] + hi[i]) / 2])
        for j, value in enumerate(formulas.values(middle, range(len(formulas.names)))):
            if value.is_finite():
                below, above = (float(bound) for bound in bounds(value))
                assert low[i, j] <= above
                assert below <= high[i, j]


def figures(system: System) -> dict[str, Any]:
    """Return boxes a second, with what differs between roundings and forms."""
    functions, manifold, reach = system
    lo, hi = boxes(reach)
    routines = {kind: BoxFunctions(functions, manifold, rounding=kind) for kind in kinds()}
    formulas = Formulas(functions, manifold)
    best = routines[best_rounding()]
    agree(best, formulas, lo, hi)
    smooth = smooth_boxes(formulas, lo, hi)
    result: dict[str, Any] = {"functions": len(functions), "coordinates": manifold.dimension}
    for order, name in enumerate(ORDERS):
        tasks = {kind: partial(getattr(F, name), lo, hi) for kind, F in routines.items()}
        first = {
            kind: seconds(partial(getattr(F, name), lo[:8], hi[:8])) for kind, F in routines.items()
        }
        if order == 1:
            tasks |= {
                f"with {form}": partial(best.gradients, lo, hi, **{form: True}) for form in FORMS
            }
        times = interleave(tasks | {"balls": partial(evaluate, smooth, order)}, ROUNDS)
        result[name] = compared(times, len(smooth))
        result[name]["first call, s"] = {kind: round(t, 2) for kind, t in first.items()}
    return result


def evaluate(smooth: "list[tuple[SmoothForms, Box]]", order: int) -> None:
    """Evaluate in balls."""
    for forms, box in smooth:
        forms.evaluate(box, order)


def compared(times: Times, count: int) -> dict[str, Any]:
    """Return boxes a second of every task, ``count`` in balls, and ratios to balls."""
    balls = [t / count for t in times.pop("balls")]
    ours = {task: [t / BOXES for t in each] for task, each in times.items()}
    result: dict[str, Any] = {
        task: {
            "boxes a second": round(1 / statistics.median(each)),
            "times faster than balls": round(ratio(balls, each)),
        }
        for task, each in ours.items()
    }
    return result | {"balls": {"boxes a second": round(1 / statistics.median(balls))}}


def kinds() -> list[str]:
    """Return the ways of rounding that this processor has."""
    return ["stepped"] if best_rounding() == "stepped" else list(ROUNDINGS)


def main() -> None:
    """Measure three systems."""
    systems = {
        "six-hump camel": camel(),
        "pair in the plane": pair(math.inf),
        "pair in the drum": pair(125.0),
    }
    with precision(BITS):
        found = {name: figures(system) for name, system in systems.items()}
    rows = [
        (
            f"{system}: {name}, {task}",
            f"{numbers['boxes a second']:,}",
            numbers.get("times faster than balls", "-"),
        )
        for system, content in found.items()
        for name in ORDERS
        for task, numbers in content[name].items()
        if task != "first call, s"
    ]
    print_table("boxes", ["", "boxes a second", "times faster than balls"], rows)
    write("boxes", found)


if __name__ == "__main__":
    main()
