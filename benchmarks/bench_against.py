"""The rooms of this checkout beside those of another one, alternating: ratios of processor times.

``python benchmarks/bench_against.py FOLDER``, or without a folder this one alone; ``--cases`` names
some of them, ``--rounds`` says how often.  Every measurement is a process of its own, in which the
package of its folder is imported, on one thread.  What is compiled is compiled before, but for
first answers, whose caches are empty.  Both checkouts run the same lines, of public names that both
have; for the engine of motion see ``bench_engine.py``.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from bench_import import FIRST
from side_by_side import ROOT, print_table, write

WARM = """
def timed(task, count):
    task()
    begun = time.process_time()
    for _ in range(count):
        task()
    print((time.process_time() - begun) / count)
"""
PAIR = """
from polycorner import certify, minimise
from polycorner.dumbbells import DumbbellPair
pair = DumbbellPair(16, 3, 1.5, drum_radius=125)
D, E = pair.polyhedron, pair.energy
q = minimise(D, E, pair.nested("R")).point
rng = np.random.default_rng(1)
"""
HIMMELBLAU = """
from polycorner import Manifold, Polyhedron
from polycorner.proofs import stationary_points
M = Manifold.euclidean("x y")
x, y = M.symbols
energy = (x**2 + y - 11) ** 2 + (x + y**2 - 7) ** 2
disc = Polyhedron(M, {"disc": 36 - x**2 - y**2})
"""
DISCS = """
sys.path.append(root + "/benchmarks")
import sympy
from bench_lists import discs
from polycorner.proofs import stationary_points
problem = discs(4, 0.252, (2 - sympy.sqrt(3)) / 4)
"""
SPHERES = """
from polycorner import skeleton
from polycorner.models import SphereCluster
model = SphereCluster({})
task = lambda: skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
"""
WARMED: dict[
    str, tuple[str, str, int]
] = {  # what comes before the clock starts, the task, how often
    "values of the pair": (
        PAIR + "points = q + 0.1 * rng.standard_normal((100_000, 6))",
        "D.values(points)",
        20,
    ),
    "minimise, nested pair": (
        PAIR + "start = q + np.array([1, 5, 0.03, -1, -5, -0.03]) / 10",
        "minimise(D, E, start).point",
        500,
    ),
    "verdict of the pair": (PAIR, "certify(D, E, q).verdict", 3000),
    "skeleton, 7 spheres": (SPHERES.format(7), "task()", 1),
    "skeleton, 9 spheres": (SPHERES.format(9), "", 1),
    "list, Himmelblau": (
        HIMMELBLAU,
        "stationary_points(disc, energy, box=[(-6, 6)] * 2)",
        10,
    ),
    "list, four discs": (DISCS, "stationary_points(**problem)", 2),
    "proof of the pair": (
        PAIR + "from polycorner import prove\nc = certify(D, E, q)",
        "prove(c)",
        3,
    ),
}
COLD = {"import": "from polycorner import Manifold, Polyhedron, minimise, skeleton", **FIRST}
CASES = (*WARMED, *COLD)


def measured(root: Path, case: str) -> float:
    """Return the processor time of a case in a checkout, in s."""
    head = f"import sys, time\nroot = {str(root)!r}\nsys.path.insert(0, root)\n"
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    environment.pop("PYTHONPATH", None)
    with tempfile.TemporaryDirectory() as cache:
        if case in WARMED:
            setup, task, count = WARMED[case]
            # What takes minutes is not run twice: its first run is timed.
            last = (
                f"timed(lambda: {task}, {count})"
                if task
                else "begun = time.process_time(); task(); print(time.process_time() - begun)"
            )
            code = f"{head}import numpy as np\n{WARM}{setup}\n{last}\n"
        else:
            environment["POLYCORNER_CACHE_DIR"] = cache
            code = f"{head}{COLD[case]}\nprint(time.process_time())\n"
        code += (
            "import polycorner\nassert polycorner.__file__.startswith(root), polycorner.__file__\n"
        )
        command = [sys.executable, "-W", "ignore", "-c", code]
        run = subprocess.run(
            command, env=environment, stdout=subprocess.PIPE, check=True, text=True, cwd=cache
        )
    return float(run.stdout.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="another checkout")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), metavar="CASE")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    roots = {"this": ROOT} | ({"other": given.folder.resolve()} if given.folder else {})
    figures: dict[str, dict[str, Any]] = {}
    for case in given.cases:
        times: dict[str, list[float]] = {name: [] for name in roots}
        for k in range(given.rounds):
            for name in [*roots][:: 1 if k % 2 else -1]:  # neither always follows the other
                times[name].append(measured(roots[name], case))
        figures[case] = {
            f"{name}, ms": float(f"{1e3 * min(taken):.4g}") for name, taken in times.items()
        }
        if given.folder:
            ratios = [a / b for a, b in zip(times["this"], times["other"], strict=True)]
            figures[case] |= {
                "this over other": round(statistics.median(ratios), 2),
                "from": round(min(ratios), 2),
                "to": round(max(ratios), 2),
            }
        print(case, figures[case], flush=True)
    keys = list(next(iter(figures.values())))
    print_table(
        "Beside another checkout", ["", *keys], [[c, *f.values()] for c, f in figures.items()]
    )
    write("against", figures)


if __name__ == "__main__":
    main()
