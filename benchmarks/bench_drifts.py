"""A crowd of discs before a door: the cost of a step, and of the same programme by cvxpy.

``--counts`` lists numbers of discs.  Each crowd presses for ``--steps`` steps; then the programme
of one step, linearised where ours is, is posed to cvxpy and solved, and solved again, which leaves
out what posing costs.
"""

import argparse
import math
from itertools import combinations
from statistics import median
from time import perf_counter, process_time

import cvxpy
import numpy as np
import sympy
from side_by_side import print_table, write

from polycorner import Drift, Manifold, Polyhedron, Trajectory, simulate
from polycorner.motion import ContactFamily, pair_coordinates

RADIUS, DOOR, STEP, REPEATS = 0.2, 0.6, 0.01, 5


def crowd(count: int) -> Drift:
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    (x1, y1), (x2, y2) = pair_coordinates(M)
    s = 1 / math.sqrt(2)
    funnel = Polyhedron(M, {"up": (DOOR - x - y) * s, "down": (DOOR - x + y) * s})
    gap = sympy.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2) - 2 * RADIUS
    apart = ContactFamily({"apart": gap}, 2 * RADIUS, ["x", "y"])
    return Drift(funnel, {"x": 1, "y": -y}, count=count, between=apart)


def start(count: int) -> np.ndarray:
    side = math.ceil(math.sqrt(count))
    at = np.array([(i, j) for i in range(side) for j in range(side)][:count], dtype=np.float64)
    shaken = np.random.default_rng(0).uniform(-0.1, 0.1, (count, 2))
    q = RADIUS * (2.3 * (at - [0, side / 2]) + shaken)
    return q * [-1, 1] - [1.6 * RADIUS * side + 0.3, 0]


def by_cvxpy(path: Trajectory) -> tuple[float, float, float]:
    """Return seconds of posing and solving, of solving alone, and the largest difference."""
    q, end = path.q[-2], path.q[-1]
    n, middle, d = len(q), (q + end) / 2, cvxpy.Variable(q.shape)
    wish = cvxpy.Parameter(q.shape, value=STEP * np.column_stack([np.ones(n), -middle[:, 1]]))
    near = [p for p in combinations(range(n), 2) if np.linalg.norm(q[p[0]] - q[p[1]]) < 3 * RADIUS]
    rows, shift = np.zeros((len(near), 2 * n)), np.zeros(len(near))
    for r, (i, j) in enumerate(near):
        u = (middle[j] - middle[i]) / np.linalg.norm(middle[j] - middle[i])
        rows[r, 2 * i : 2 * i + 2], rows[r, 2 * j : 2 * j + 2] = -u, u
        gap = np.linalg.norm(end[j] - end[i]) - 2 * RADIUS
        shift[r] = gap - u @ ((end - q)[j] - (end - q)[i])
    flat = cvxpy.vec(d, order="C")
    walls = [DOOR - (q + d)[:, 0] - sign * (q + d)[:, 1] >= 0 for sign in (1, -1)]
    begin = perf_counter()
    problem = cvxpy.Problem(
        cvxpy.Minimize(cvxpy.sum_squares(d - wish)), [rows @ flat + shift >= 0, *walls]
    )
    problem.solve(solver="CLARABEL")
    posed, solved = perf_counter() - begin, []
    for _ in range(REPEATS):
        begin = perf_counter()
        problem.solve(solver="CLARABEL")
        solved.append(perf_counter() - begin)
    return posed, median(solved), float(np.abs(d.value - (end - q)).max())


def measured(count: int, steps: int) -> dict[str, float]:
    drift = crowd(count)
    begun = drift.state(start(count))
    simulate(drift, begun, STEP, STEP)
    path = simulate(drift, begun, steps * STEP, STEP, every=steps)
    wall, cpu = perf_counter(), process_time()
    pressed = simulate(drift, path.last, (steps + 50) * STEP, STEP, every=1)
    wall, cpu = (perf_counter() - wall) / 50, (process_time() - cpu) / 50
    touching = sum(len(touch[0]) == 2 for touch in pressed.touching[-1])
    posed, solved, away = by_cvxpy(pressed)
    return {
        "discs": count, "touching": touching, "step_s": wall, "step_cpu_s": cpu,
        "cvxpy_posed_s": posed, "cvxpy_solved_s": solved, "posed_ratio": posed / wall,
        "solved_ratio": solved / wall, "difference": away,
        "unsolved": pressed.effort.unconverged,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--counts", type=int, nargs="*", default=[10, 50, 200])
    parser.add_argument("--steps", type=int, default=300)
    given = parser.parse_args()
    rows = [measured(count, given.steps) for count in given.counts]
    print_table("crowds", list(rows[0]), [[f"{v:.4g}" for v in row.values()] for row in rows])
    write("drifts", {"crowds": rows})


if __name__ == "__main__":
    main()
