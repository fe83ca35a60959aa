"""The problems of bench_sparse.py solved by Ipopt, through casadi, which has it in its wheel.

``python benchmarks/sparse_ipopt.py cable:500 beam:1000 discs:150`` prints processor times, steps,
energies and peak memory.  Derivatives are exact and sparse, the linear solver is MUMPS, and the
tolerance 1e-10.  It needs casadi, which is not among the requirements of this repository.
"""

import json
import math
import resource
import sys
import time
from typing import Any

import casadi as ca
import numpy as np


def cable(count: int) -> tuple[Any, Any, Any, np.ndarray]:
    """Return variables, energy, functions that are not negative, and a start."""
    x, y = ca.SX.sym("x", count), ca.SX.sym("y", count)
    width = 0.8 * (count + 1)
    wide, high = ca.vertcat(0, x, width), ca.vertcat(0, y, 0)
    links = 1 - (wide[1:] - wide[:-1]) ** 2 - (high[1:] - high[:-1]) ** 2
    a = 0.8 * np.arange(1, count + 1)
    return ca.vertcat(x, y), ca.sum1(y), links, np.append(a, -0.8 * a * (width - a) / width)


def beam(count: int) -> tuple[Any, Any, Any, np.ndarray]:
    """Return variables, energy, functions that are not negative, and a start."""
    x = ca.SX.sym("x", count)
    energy = ca.sumsqr(x[1:] - x[:-1]) + ca.sumsqr(x) / 100 + 0.004 * ca.sum1(x)
    return x, energy, x + 0.3 * np.cos(7 * np.arange(count) / count), np.ones(count)


def discs(count: int, seed: int = 1) -> tuple[Any, Any, Any, np.ndarray]:
    """Return variables, energy, functions that are not negative, and a start."""
    from scipy.spatial import cKDTree

    radii, row = 1 - 0.2 * np.random.default_rng(seed).random(count), int(math.sqrt(count))
    i, width = np.arange(count), 2.1 * row + 0.2
    places = np.column_stack([1.1 + 2.1 * (i % row), 1.1 + 2.1 * (i // row)])
    x, y = ca.SX.sym("x", count), ca.SX.sym("y", count)
    j, k = np.array(sorted(cKDTree(places).query_pairs(6.0))).T.tolist()
    sums = radii[j] + radii[k]
    gaps = ca.sqrt((x[j] - x[k]) ** 2 + (y[j] - y[k]) ** 2) - sums
    functions = ca.vertcat(y - radii, x - radii, width - radii - x, gaps)
    return ca.vertcat(x, y), ca.sum1(y), functions, places.T.ravel()


MODELS = {"cable": cable, "beam": beam, "discs": discs}


def main() -> None:
    for size in sys.argv[1:]:
        kind, count = size.split(":")
        begin = time.process_time()
        q, energy, functions, start = MODELS[kind](int(count))
        options = {"print_level": 0, "tol": 1e-10, "max_iter": 3000, "max_cpu_time": 600.0}
        solver = ca.nlpsol(
            "solver",
            "ipopt",
            {"x": q, "f": energy, "g": functions},
            {"ipopt": options, "print_time": False},
        )
        ready = time.process_time()
        found = solver(x0=start, lbg=0, ubg=ca.inf)
        row = {
            "kind": kind,
            "count": int(count),
            "statement, s": ready - begin,
            "ipopt, s": time.process_time() - ready,
            "steps": solver.stats()["iter_count"],
            "status": solver.stats()["return_status"],
            "energy": float(found["f"]),
            "deepest violation": float(max(0.0, -np.min(found["g"]))),
            "memory, MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
