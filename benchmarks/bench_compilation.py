"""First and later answers as problems grow: how much of the time is compilation.

Every case runs in a fresh interpreter with an empty cache of compiled formulas; the compiled
descent and the engine of motion, which are made once for an installation, are loaded before the
clock starts.  The clock runs from the polyhedron to the verdict of a certificate, or to the
skeleton; SymPy's own work on the user's formulas comes before.  For blocks, a rounded polyhedron of
``n`` corners that falls on a rounded brick, with friction, it runs from the bodies to the end of
ten steps.  A second process does the same with the cache that the first has filled.  ``warm`` is
the median of the same search repeated in a process, up to seven times in about two seconds.

Before that, unless only some ``--cases`` are asked for, the processor time of small programs that
do one thing for the first time, with an empty cache and with that of the run before.
"""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from itertools import combinations
from typing import Any

from side_by_side import ROOT, print_table, seconds, write

POSES = 7  # coordinates of a body in space
ROUNDS, WARM, ENOUGH = 3, 7, 2.0  # rounds, repetitions, seconds of repetition
CASES = {
    "bounds": (10, 30, 50, 100, 200),
    "bounds and 100 quadratics": (10, 30, 50),
    "half-planes, minimum": (50, 500),
    "half-planes, skeleton": (50, 500),
    "discs, all distances": (10, 20),
    "blocks": (4, 8),
}


DISC = """
from polycorner import Manifold, Polyhedron, minimise
from polycorner.proofs import stationary_points
M = Manifold.euclidean("x y")
x, y = M.symbols
disc = Polyhedron(M, {"disc": 36 - x**2 - y**2})
"""
PROGRAMS = {
    "minimisation": DISC + "minimise(disc, (x - 1)**2 + y**2, [0.5, 0.5])",
    "complete list": DISC + "stationary_points(disc, x + y**2, box=[(-7, 7), (-7, 7)])",
    "motion of a ball": """
from polycorner import simulate
from polycorner.models.textbook import bouncing_ball
ball = bouncing_ball(0.7)
simulate(ball, ball.state([1.0]), 0.1, 1e-3)
""",
}


def problem(case: str, n: int) -> tuple[Any, Any, Any, Any]:
    """Return manifold, inequalities, energy and start of a case of one size."""
    import numpy as np
    import sympy

    from polycorner import Manifold

    rng = np.random.default_rng(0)
    if case.startswith("half-planes"):
        plane = Manifold.euclidean("x y")
        x, y = plane.symbols
        angles = np.sort(rng.uniform(0, 2 * np.pi, n)).tolist()
        parts = [1 - sympy.Float(np.cos(a)) * x - sympy.Float(np.sin(a)) * y for a in angles]
        return plane, parts, x + 2 * y, np.zeros(2)
    discs = case.startswith("discs")
    count = 2 * n if discs else n
    space = Manifold.euclidean([f"x{i}" for i in range(count)])
    q = space.symbols
    if discs:
        parts = [
            (q[2 * i] - q[2 * j]) ** 2 + (q[2 * i + 1] - q[2 * j + 1]) ** 2 - 1
            for i, j in combinations(range(n), 2)
        ]
        start = 1.5 * np.column_stack([np.arange(n), rng.random(n)]).ravel()
        return space, parts, sum(x**2 for x in q), start
    parts = [x + 1 for x in q] + [2 - x for x in q]
    if "quadratics" in case:
        for _ in range(100):
            a = rng.standard_normal((n, n))
            a = -a @ a.T / n
            pairs = [(i, j) for i in range(n) for j in range(i + 1)]
            terms = [sympy.Float(a[i, j]) * (q[i] * q[j]) for i, j in pairs]
            slopes = [sympy.Float(b) * x for b, x in zip(rng.standard_normal(n), q, strict=True)]
            parts.append(sympy.Add(*terms, *slopes, 10))
    energy = sum((x - sympy.Float(c)) ** 2 for x, c in zip(q, 3 * rng.random(n), strict=True))
    return space, parts, energy, 0.1 * rng.random(n)


def one(case: str, n: int) -> None:
    """Print the times of one case, as JSON."""
    from polycorner import Manifold, Polyhedron, minimise, skeleton
    from polycorner.motion.engine.intermediate import compiled_advance

    line = Manifold.euclidean("t")
    (t,) = line.symbols
    minimise(Polyhedron(line, [t]), t, [1.0])  # loads the descent, from the usual cache
    if case == "blocks":
        compiled_advance(POSES)
        made_systems: list[Any] = []
        timed(lambda: made_systems.append(block_on_brick(n)), lambda: fall(*made_systems[0]))
        return
    space, parts, energy, start = problem(case, n)
    made: list[Any] = []

    def search() -> None:
        if case.endswith("skeleton"):  # every half-plane touches the unit circle: none is redundant
            assert len(skeleton(made[0], [start]).corners) == n
        else:
            assert minimise(made[0], energy, start).is_minimum

    timed(lambda: made.append(Polyhedron(space, parts)), search)


def block_on_brick(n: int) -> tuple[Any, Any]:
    """Return a polyhedron of 4 or 8 corners above a brick on a floor, and where they are."""
    from itertools import product

    from polycorner.bodies import Arrangement, HalfSpace, polytope

    cube = list(product((-1, 1), repeat=3))
    corners = cube if n == len(cube) else [c for c in cube if c[0] * c[1] * c[2] > 0]
    brick = list(product((-2, 2), (-2, 2), (-0.5, 0.5)))
    bodies = {"A": polytope(corners, 0.1), "B": polytope(brick, 0.1)}
    a = Arrangement(bodies, {"floor": HalfSpace([0, 0, 1], [0, 0, 0])})
    system = a.system(gravity=[0, 0, -10.0], friction=0.5)
    return system, system.state(a.point({"A": [0, 0, 3.0], "B": [0, 0, 0.6]}))


def fall(system: Any, state: Any) -> None:
    """Move bodies by ten steps."""
    from polycorner import simulate

    simulate(system, state, 0.01, 1e-3)


def timed(make: Callable[[], object], search: Callable[[], object]) -> None:
    """Print how long the first and later answers take, as JSON."""

    def first() -> None:
        make()
        search()

    cold = seconds(first)
    repeated = [seconds(search)]
    while len(repeated) < WARM and sum(repeated) < ENOUGH:
        repeated.append(seconds(search))
    print(json.dumps({"first": cold, "warm": statistics.median(repeated)}))


def run(*arguments: str, **environment: str) -> str:
    """Return what a fresh interpreter prints."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    done = subprocess.run(
        [sys.executable, *arguments],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": path} | environment,
    )
    return done.stdout


def measured(case: str, n: int) -> dict[str, float]:
    """Return the times of one case in a fresh process with an empty cache, and in the next one."""
    with tempfile.TemporaryDirectory() as folder:
        first, again = (
            json.loads(run(__file__, case, str(n), POLYCORNER_CACHE_DIR=folder).splitlines()[-1])
            for _ in range(2)
        )
    return {**first, "again": again["first"]}


def processor_times(program: str) -> list[float]:
    """Return the processor times of a program with an empty cache, and with its own."""

    def used() -> float:
        times = resource.getrusage(resource.RUSAGE_CHILDREN)
        return times.ru_utime + times.ru_stime

    found = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            begun = used()
            run("-c", program, POLYCORNER_CACHE_DIR=folder)
            found.append(used() - begun)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", nargs="+", choices=CASES)
    cases = parser.parse_args().cases
    rows: list[Any] = []
    figures: dict[str, Any] = {}
    for name, program in () if cases else PROGRAMS.items():
        runs = [processor_times(program) for _ in range(ROUNDS)]
        first, again = (statistics.median(times) for times in zip(*runs, strict=True))
        rows.append((name, round(first, 1), round(again, 1)))
        figures[f"first {name}"] = {"empty_s": round(first, 2), "kept_s": round(again, 2)}
        print(rows[-1], flush=True)
    if rows:
        print_table("Processor time", ["first", "empty cache (s)", "its own (s)"], rows)
    rows = []
    for case in cases or CASES:
        for n in CASES[case]:
            runs = [measured(case, n) for _ in range(ROUNDS)]
            keys = ("first", "again", "warm")
            first, again, warm = (statistics.median(r[k] for r in runs) for k in keys)
            rows.append((case, n, round(first, 2), round(again, 2), round(1e3 * warm, 2)))
            names = ("first_s", "again_s", "warm_ms")
            values = [round(x, 3) for x in (first, again, 1e3 * warm)]
            figures[f"{case}, {n}"] = dict(zip(names, values, strict=True))
            print(rows[-1], flush=True)
    print_table(
        "First and later answers", ["case", "n", "first (s)", "next process (s)", "warm (ms)"], rows
    )
    write("compilation", figures)


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] in CASES:
        one(sys.argv[1], int(sys.argv[2]))
    else:
        main()
