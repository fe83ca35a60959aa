"""Complete lists of stationary points: time, boxes a second, threads; balls and Codac beside them.

Seven problems: Himmelblau's function on a disc, the six-hump camel and Shubert's function on
squares, the pair of dumbbells in the plane and in the drum, three and four discs on the square
torus, with radii above 0.2505 and 0.252.  Two references:

- ball arithmetic (python-flint, 53 bits) enclosing the same functions and gradients on boxes of
  the same problems from Python, one at a time;
- Codac, where it is installed (``pip install codac``): its paver, with a contractor for the zeros
  of the gradient in the rectangle.  It answers a part of the question, of the first three problems:
  without constraints and multipliers, without types of points, without proof that a box has a zero.

Times are of processors, which other jobs slow least; those of threads are of the wall clock.
"""

import json
import math
import statistics
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from time import process_time
from typing import Any

import numpy as np
import sympy
from side_by_side import ROOT, interleave, print_table, ratio, seconds, write
from trials.torus_discs import several_discs, symmetries

from polycorner import Manifold, Polyhedron
from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.intervals.balls import between, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms
from polycorner.intervals.tapes import Box
from polycorner.proofs import stationary_points

ROUNDS, FEW, BITS, WORKERS, EPSILON = 3, 300, 53, 2, 1e-6
WIDTH = 1e-2  # of the domain: sides of the boxes that balls enclose on
PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols

Problem = dict[str, Any]


def rectangle(a: float, b: float) -> Polyhedron:
    """Return a rectangle about the origin."""
    return Polyhedron(PLANE, [a - X, a + X, b - Y, b + Y])


def himmelblau() -> Problem:
    """Return Himmelblau's function on a disc."""
    energy = (X**2 + Y - 11) ** 2 + (X + Y**2 - 7) ** 2
    disc = Polyhedron(PLANE, {"disc": 36 - X**2 - Y**2})
    return {"polyhedron": disc, "energy": energy, "box": [(-6, 6)] * 2}


def camel() -> Problem:
    """Return the six-hump camel function."""
    energy = (4 - sympy.Rational(21, 10) * X**2 + X**4 / 3) * X**2 + X * Y + (4 * Y**2 - 4) * Y**2
    return {"polyhedron": rectangle(3, 2), "energy": energy, "box": [(-3, 3), (-2, 2)]}


def shubert() -> Problem:
    """Return Shubert's function."""
    wave, other = (sum(j * sympy.cos((j + 1) * u + j) for j in range(1, 6)) for u in (X, Y))
    return {"polyhedron": rectangle(10, 10), "energy": wave * other, "box": [(-10, 10)] * 2}


def dumbbells(radius: float) -> Problem:
    """Return the relative placements of a pair."""
    model = RelativePlacements(DumbbellPair(16, 3, 1.5, radius))
    given = {"polyhedron": model.polyhedron, "energy": model.energy}
    return {**given, "box": model.box, "symmetry": model.symmetry}


def discs(count: int, least: float, unit: object = 1) -> Problem:
    """Return discs on the square torus; the square of the unit of the radius is given."""
    polyhedron, energy, box = several_discs(count, "square", (least, 0.6), unit)
    symmetry = symmetries(count, "square")
    return {"polyhedron": polyhedron, "energy": energy, "box": box, "symmetry": symmetry}


PROBLEMS: dict[str, Callable[[], Problem]] = {
    "Himmelblau": himmelblau,
    "six-hump camel": camel,
    "Shubert": shubert,
    "dumbbells in the plane": partial(dumbbells, math.inf),
    "dumbbells in the drum": partial(dumbbells, 125.0),
    "three discs": partial(discs, 3, 0.2505),
    "four discs": partial(discs, 4, 0.252, (2 - sympy.sqrt(3)) / 4),
}


def worked(task: Callable[[], object]) -> float:
    """Return the processor time of one call, in seconds."""
    start = process_time()
    task()
    return process_time() - start


def figures(problem: Problem) -> dict[str, Any]:
    """Return the figures of a problem."""
    first = seconds(lambda: stationary_points(**problem))
    found = stationary_points(**problem)
    tasks: dict[str, Callable[[], object]] = {
        "one thread": partial(stationary_points, **problem),
        f"{WORKERS} threads": partial(stationary_points, **problem, workers=WORKERS),
    }
    ours = statistics.median(worked(tasks["one thread"]) for _ in range(ROUNDS))
    walls = interleave(tasks, ROUNDS)
    one, many = walls["one thread"], walls[f"{WORKERS} threads"]
    boxes = found.tally.boxes
    balls = balls_a_second(problem)
    result = {
        "complete": found.complete,
        "points": len(found),
        "minima": len(found.minima),
        "loci": len(found.loci),
        "boxes": boxes,
        "first call, s": round(first, 2),
        "processor time, s": round(ours, 3),
        "boxes a second, all included": round(boxes / ours),
        "wall time, s": round(statistics.median(one), 3),
        f"wall time of {WORKERS} threads over that of one": round(ratio(many, one), 2),
        "boxes a second that balls enclose on": round(balls),
        "times faster than balls": round(boxes / ours / balls, 1),
    }
    zeros = codac(problem)
    if zeros is not None:
        theirs, left = zeros
        result |= {
            "Codac, processor time, s": round(theirs, 4),
            "Codac, boxes left": left,
            "times slower than Codac": round(ours / theirs, 1),
        }
    return result


def balls_a_second(problem: Problem) -> float:
    """Return on how many boxes a second balls enclose all functions and gradients."""
    begun = stationary_points(**problem, max_boxes=1)
    functions, domain = begun.problem.functions, begun.domain
    formulas, rows = Formulas(functions, domain.manifold), range(len(functions))
    half = 0.5 * WIDTH * (domain.upper - domain.lower)
    middles = np.random.default_rng(1).uniform(domain.lower, domain.upper, (FEW, len(half)))

    def enclose() -> None:
        for middle in middles:
            sides = zip((middle - half).tolist(), (middle + half).tolist(), strict=True)
            box = Box([between(*side) for side in sides])
            forms = formulas.smooth(box, rows)
            if isinstance(forms, SmoothForms):
                forms.evaluate(box, 1)

    with precision(BITS):
        return FEW / statistics.median(worked(enclose) for _ in range(ROUNDS))


def codac(problem: Problem) -> tuple[float, int] | None:
    """Return Codac's median time for the zeros of the gradient, and how many boxes are left."""
    names = problem["polyhedron"].manifold.names
    if find_spec("codac") is None or names != PLANE.names:
        return None
    task = {
        "slopes": [str(sympy.diff(problem["energy"], u)) for u in (X, Y)],
        "box": [list(map(float, side)) for side in problem["box"]],
        "epsilon": EPSILON,
        "rounds": ROUNDS,
    }
    program = ROOT / "benchmarks" / "codac_paving.py"
    command = [sys.executable, str(program), json.dumps(task)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    found = json.loads(run.stdout.splitlines()[-1])
    return statistics.median(found["seconds"]), found["boxes"]


def main() -> None:
    """Measure all problems."""
    found = {name: figures(problem()) for name, problem in PROBLEMS.items()}
    heads = list(dict.fromkeys(head for content in found.values() for head in content))
    rows = [(head, *(content.get(head, "-") for content in found.values())) for head in heads]
    print_table("lists", ["", *found], rows)
    write("lists", found)


if __name__ == "__main__":
    main()
