"""Nine gaps and their 54 derivatives of random pairs: polycorner's kernels against plain C.

The references are ``gaps.c``, written by hand with branches, and ``gaps_vector.c``, the same for
several pairs at once.  Both must agree with polycorner before they are timed.  One thread.
"""

import ctypes
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from side_by_side import interleave, print_table, ratio, write

from polycorner.dumbbells import DumbbellPair

PAIRS, BLOCK, ROUNDS, SINGLE = 1_000_000, 1000, 7, 2000
AGREEMENT = 1e-9
OURS = "polycorner"
EXISTING = "into arrays that exist"
CACHED = f"in blocks of {BLOCK}, which stay in cache"
NEW = "into new arrays, as Polyhedron.evaluate does"
SOURCES = {"C, scalar": "gaps.c", "C, vectorised by hand": "gaps_vector.c"}
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-shared", "-fPIC")

# Fills values (N, 9) and gradients (N, 9, 6) at points (N, 6).
Routine = Callable[[np.ndarray, np.ndarray, np.ndarray], object]


def random_pairs(count: int, length: float, generator: np.random.Generator) -> np.ndarray:
    """Return pairs anywhere in the drum, B within one and a half lengths of A each way."""
    q = np.empty((count, 6))
    q[:, 0] = generator.uniform(-np.pi, np.pi, count)
    q[:, 1] = generator.uniform(-100.0, 100.0, count)
    q[:, 3] = q[:, 0] + generator.uniform(-0.2, 0.2, count)
    q[:, 4] = q[:, 1] + generator.uniform(-1.5, 1.5, count) * length
    q[:, [2, 5]] = generator.uniform(-np.pi, np.pi, (count, 2))
    return q


def compiled_c(source: str, folder: Path) -> ctypes.CDLL | None:
    """Return the library of a C file, or None, with a message, if it cannot be compiled."""
    here = Path(__file__).parent
    library = folder / f"{source}.so"
    command = ["gcc", *FLAGS, str(here / source), "-o", str(library), "-lm"]
    if shutil.which("gcc") is None:
        print(f"{source} is left out: there is no gcc here.")
        return None
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if made.returncode:
        print(f"{source} is left out: gcc cannot compile it here.\n{made.stderr}")
        return None
    return ctypes.CDLL(str(library))


def routine_of(library: ctypes.CDLL, parameters: np.ndarray) -> Routine:
    """Return the function ``gaps`` of a library as a routine."""
    gaps = library.gaps
    gaps.argtypes, gaps.restype = [ctypes.c_int64, *[ctypes.c_void_p] * 4], None

    def routine(q: np.ndarray, f: np.ndarray, J: np.ndarray) -> None:
        gaps(len(q), q.ctypes.data, parameters.ctypes.data, f.ctypes.data, J.ctypes.data)

    return routine


def check(name: str, routine: Routine, pair: DumbbellPair, q: np.ndarray) -> float:
    """Return the largest difference from polycorner, in mm per unit of the manifold's scales."""
    f, J = np.empty((len(q), 9)), np.empty((len(q), 9, 6))
    routine(q, f, J)
    values, gradients = pair.polyhedron.evaluate(q, 1)
    scaled = (J - gradients) * pair.manifold.scale_array
    worst = float(max(abs(f - values).max(), abs(scaled).max()))
    if not worst <= AGREEMENT:
        msg = f"{name}: expected agreement with polycorner to {AGREEMENT:g}; got {worst:.1e}"
        raise ArithmeticError(msg)
    return worst


def in_cache(routine: Routine, q: np.ndarray, f: np.ndarray, J: np.ndarray) -> None:
    """Evaluate all points in blocks whose results stay in the processor's cache."""
    f, J = f[:BLOCK], J[:BLOCK]
    for start in range(0, len(q), BLOCK):
        routine(q[start : start + BLOCK], f, J)


def with_new_arrays(routine: Routine, q: np.ndarray) -> None:
    """Evaluate into arrays allocated for this call, as a function that returns them has to."""
    routine(q, np.empty((len(q), 9)), np.empty((len(q), 9, 6)))


def batches(pair: DumbbellPair, routines: dict[str, Routine], q: np.ndarray) -> dict[str, Any]:
    """Time all pairs in the three ways and print one table each."""
    f, J = np.zeros((len(q), 9)), np.zeros((len(q), 9, 6))
    kinds: dict[str, dict[str, Callable[[], object]]] = {
        EXISTING: {n: lambda r=r: r(q, f, J) for n, r in routines.items()},
        CACHED: {n: lambda r=r: in_cache(r, q, f, J) for n, r in routines.items()},
        NEW: {n: lambda r=r: with_new_arrays(r, q) for n, r in routines.items()},
    }
    kinds[NEW][OURS] = lambda: pair.polyhedron.evaluate(q, 1)
    figures: dict[str, Any] = {}
    for kind, tasks in kinds.items():
        times = interleave(tasks, ROUNDS)
        rows = {
            name: {
                "ns per pair": round(1e9 * statistics.median(taken) / len(q), 1),
                "time over ours": round(ratio(taken, times[OURS]), 2),
            }
            for name, taken in times.items()
        }
        columns = ["", "ns per pair", "time over ours"]
        print_table(f"{len(q)} pairs, {kind}", columns, [[n, *r.values()] for n, r in rows.items()])
        figures[kind] = rows
    return figures


def single(pair: DumbbellPair, q: np.ndarray) -> dict[str, float]:
    """Time one pair from Python."""
    D = pair.polyhedron

    def repeated(call: Callable[[], object]) -> Callable[[], None]:
        def run() -> None:
            for _ in range(SINGLE):
                call()

        return run

    tasks = {
        "values": repeated(lambda: D.values(q)),
        "values and gradients": repeated(lambda: D.evaluate(q, 1)),
        "values, gradients and Hessians": repeated(lambda: D.evaluate(q, 2)),
    }
    times = interleave(tasks, ROUNDS)
    figures = {n: round(1e6 * statistics.median(t) / SINGLE, 2) for n, t in times.items()}
    print_table("One pair from Python", ["", "microseconds"], list(figures.items()))
    return figures


def main() -> None:
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
    first = pair.polyhedron.functions[0]
    parameters = np.array(first.parameters)
    kernel = first.family.kernel.compiled(1)

    def ours(q: np.ndarray, f: np.ndarray, J: np.ndarray) -> None:
        kernel.fill(q, parameters.ctypes.data, (f, J))

    q = random_pairs(PAIRS, pair.length, np.random.default_rng(1))
    routines: dict[str, Routine] = {OURS: ours}
    agreement = {}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for name, source in SOURCES.items():
            library = compiled_c(source, Path(folder))
            if library is not None:
                routine = routine_of(library, parameters)
                agreement[name] = check(name, routine, pair, q)
                routines[name] = routine
        for name, worst in agreement.items():
            print(f"{name}: agrees with polycorner to {worst:.1e} on {len(q)} pairs")
        figures = batches(pair, routines, q)
    one = single(pair, pair.nested("R"))
    write("kernels", {"agreement": agreement, **figures, "one pair, microseconds": one})


if __name__ == "__main__":
    main()
