"""One curve of equilibria, followed by three programs: a beam that is lifted off a floor.

    python benchmarks/bench_branches.py [--nodes N] [--rounds R]

Nodes a unit apart with weights 1 bend with the energy ``d^2/2 + d^4/1000`` of their second
differences, and the first is pulled up by ``P``.  Node ``j`` leaves the floor at ``P = j/2 + 1``,
whatever the law of bending, as the moment over the next one vanishes there.  Compared are

- ``branches``, which locates the contacts that open and tells that the equilibrium persists;
- SciPy by hand: ``scipy.optimize.root`` with the exact Jacobian on a grid of values of ``P``, from
  the last solution; where a gap or a multiplier is negative its contact is exchanged;
- POUNCE's follower of minima (``pounce.Continuation.follow``, where ``pounce-solver`` is
  installed), with a pinned parameter, exact Hessians and its monitor.

Errors are those of the values of ``P`` at which contacts open: of the two others, between points.
"""

import argparse
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.optimize import root
from side_by_side import interleave, print_table, ratio, write

from polycorner import Manifold, Polyhedron, SmoothFunction, stationary_on
from polycorner.branches import branches

Array = NDArray[np.float64]
FIRST, LAST = 1.8, 5.2  # of P: seven contacts open
GRID = 200
STIFF = 1e-3


@dataclass(frozen=True)
class Beam:
    """The beam's energy without its pull, with derivatives."""

    nodes: int

    @property
    def second(self) -> Array:
        """Matrix of the second differences."""
        return np.asarray(np.diff(np.eye(self.nodes), 2, axis=0))

    def slope(self, w: Array) -> Array:
        """Return the gradient."""
        d = self.second @ w
        return np.asarray(self.second.T @ (d + 4 * STIFF * d**3) + 1.0)

    def curvature(self, w: Array) -> Array:
        """Return the Hessian."""
        d = self.second @ w
        return np.asarray(self.second.T @ ((1 + 12 * STIFF * d**2)[:, None] * self.second))

    def energy(self, w: Array) -> float:
        """Return the energy."""
        d = self.second @ w
        return float((d**2 / 2 + STIFF * d**4).sum() + w.sum())

    def on(self, free: int, force: float, start: Array) -> Array:
        """Return the equilibrium with the first nodes free, by SciPy."""
        pull = np.zeros(self.nodes)
        pull[0] = force

        def left(v: Array) -> Array:
            return (self.slope(np.append(v, np.zeros(self.nodes - free))) - pull)[:free]

        def slope(v: Array) -> Array:
            return self.curvature(np.append(v, np.zeros(self.nodes - free)))[:free, :free]

        found = root(left, start[:free], jac=slope, tol=1e-12)
        return np.append(found.x, np.zeros(self.nodes - free))


def start(beam: Beam) -> tuple[int, Array]:
    """Return the number of free nodes at the first force, and the equilibrium."""
    free = int(np.floor(2 * FIRST - 2)) + 1
    return free, beam.on(free, FIRST, np.ones(beam.nodes))


def ours(beam: Beam) -> Callable[[], list[float]]:
    """Return a task that gives the forces at which contacts open."""
    M = Manifold.euclidean([f"w{i}" for i in range(beam.nodes)], scale=20.0)
    w = M.symbols
    second = [a - 2 * b + c for a, b, c in zip(w, w[1:], w[2:], strict=False)]
    pull = sympy.Symbol("P") * w[0]
    energy = sum(d**2 / 2 + STIFF * d**4 for d in second) + sum(w) - pull
    D = Polyhedron(M, {f"on{i}": v for i, v in enumerate(w)})
    E = SmoothFunction("energy", energy, M, parameters={"P": FIRST})
    free, place = start(beam)

    def task() -> list[float]:
        at = stationary_on(D, E, place, [f"on{i}" for i in range(free, beam.nodes)])
        found = branches(at, "P", (FIRST, LAST))
        return [e.parameter for e in found.events if e.kind.name == "OPENS"]

    return task


def by_hand(beam: Beam) -> Callable[[], list[float]]:
    """Return a task that gives the middles of the steps in which contacts open."""
    forces = np.linspace(FIRST, LAST, GRID)

    def task() -> list[float]:
        free, w = start(beam)
        opened = []
        for before, force in pairwise(forces):
            for _ in range(beam.nodes):
                w = beam.on(free, force, w)
                pressed = beam.slope(w)
                if pressed[free] < 0:
                    opened.append((before + force) / 2)
                    free += 1
                elif w[:free].min() < 0:
                    free -= 1
                else:
                    break
        return opened

    return task


class Pinned:
    """The beam in the manner of Ipopt, with the force as a last variable that is pinned."""

    def __init__(self, beam: Beam) -> None:
        self.beam, n = beam, beam.nodes
        self.rows, self.columns = np.tril_indices(n + 1)

    def objective(self, x: Array) -> float:
        """Return the energy."""
        return self.beam.energy(x[:-1]) - x[-1] * x[0]

    def gradient(self, x: Array) -> Array:
        """Return its gradient."""
        slope = self.beam.slope(x[:-1])
        slope[0] -= x[-1]
        return np.append(slope, -x[0])

    def constraints(self, x: Array) -> Array:
        """Return the force."""
        return x[-1:]

    def jacobianstructure(self) -> tuple[Array, Array]:
        """Return where its derivatives are."""
        return np.array([0]), np.array([self.beam.nodes])

    def jacobian(self, x: Array) -> Array:  # noqa: ARG002 - as is asked for
        """Return them."""
        return np.ones(1)

    def hessianstructure(self) -> tuple[Any, Any]:
        """Return where second derivatives are."""
        return self.rows, self.columns

    def hessian(self, x: Array, lagrange: Array, factor: float) -> Array:  # noqa: ARG002 - as is asked for
        """Return them."""
        whole = np.zeros((self.beam.nodes + 1,) * 2)
        whole[:-1, :-1] = self.beam.curvature(x[:-1])
        whole[-1, 0] = whole[0, -1] = -1.0
        return np.asarray(factor * whole[self.rows, self.columns])


def pounce(beam: Beam) -> Callable[[], list[float]]:
    """Return a task that gives the middles of the steps in which contacts open."""
    import pounce as solver

    n, posed = beam.nodes, Pinned(beam)
    low, high = np.append(np.zeros(n), -1e3), np.full(n + 1, 1e3)
    place = np.append(start(beam)[1], FIRST)

    def bounds(theta: Array) -> tuple[Array, Array, Array, Array]:
        return low, high, np.atleast_1d(theta), np.atleast_1d(theta)

    def update(theta: Array) -> Any:
        value = np.atleast_1d(theta)
        problem = solver.Problem(
            n=n + 1, m=1, problem_obj=posed, lb=low, ub=high, cl=value, cu=value
        )
        problem.add_option("print_level", 0)
        problem.add_option("tol", 1e-10)
        return problem

    def task() -> list[float]:
        follower = solver.Continuation(
            update, pins=[0], bounds=bounds, monitor=solver.kkt_residual_monitor(posed, bounds)
        )
        trace = follower.follow(lambda s: np.array([s]), (FIRST, LAST), x0=place)
        if trace.status != "ok":
            raise RuntimeError(trace.status)
        opened, free, before = [], start(beam)[0], FIRST
        for step, x in zip(trace.steps, trace.x, strict=True):
            while free < n and x[free] > 1e-6:
                opened.append((before + step.s) / 2)
                free += 1
            before = step.s
        return opened

    return task


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nodes", type=int, default=14)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    beam = Beam(given.nodes)
    tasks = {"branches": ours(beam), "SciPy by hand": by_hand(beam)}
    if importlib.util.find_spec("pounce") is not None:
        tasks["POUNCE"] = pounce(beam)
    known = [j / 2 + 1 for j in range(given.nodes) if FIRST < j / 2 + 1 < LAST]
    times = interleave(tasks, given.rounds)
    rows, figures = [], {}
    for name, task in tasks.items():
        found = np.array(task())
        missed = len(known) - len(found)
        error = float(abs(found - known).max()) if not missed else float("nan")
        figures[name] = {
            "seconds": median(times[name]), "of branches": ratio(times[name], times["branches"]),
            "contacts missed": missed, "largest error": error,
        }  # fmt: skip
        figure = figures[name]
        rows.append([
            name, f"{figure['seconds']:.3f}", f"{figure['of branches']:.2f}", missed, f"{error:.1e}"
        ])  # fmt: skip
    columns = ["", "seconds", "ratio", "contacts missed", "largest error of P"]
    print_table(f"{len(known)} contacts open, {given.nodes} nodes", columns, rows)
    write("branches", {"nodes": given.nodes, "contacts": len(known), "programs": figures})


if __name__ == "__main__":
    main()
