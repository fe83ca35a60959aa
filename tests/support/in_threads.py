"""What threads find that do the same, or different things, at once.

``python in_threads.py FOLDER ACTS...`` lets eight threads start at once, which share out the acts
of the first group, named in one word or in several, then those of the next.  Code is compiled anew
for each group, into the folder.  The status is 1, with a message, where a thread found anything
else than it does alone.
"""

import os
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, is_dataclass
from enum import Enum
from threading import Barrier

import numpy as np
import sympy as sp

from polycorner import (
    Friction,
    Manifold,
    Polyhedron,
    System,
    minima,
    minimise,
    prove,
    simulate,
    skeleton,
    velocities,
)
from polycorner.formulas.cache import VARIABLE
from polycorner.formulas.shapes import forget
from polycorner.motion import Interval, time_symbol
from polycorner.proofs import corners, stationary_points
from polycorner.sweeps import sweep

THREADS = 8
M = Manifold.euclidean("x y")
x, y = M.symbols
BOX = [(-2.0, 2.0), (-1.0, 2.5)]
ENERGY = y + x / 3 + sp.sin(3 * x) / 5


class Models:
    """What threads share: a polyhedron that they all ask for, and a system."""

    def __init__(self):
        walls = {"bowl": y - sp.cosh(x) + 1, "lid": 2 - y - sp.sin(x) / 3, "side": x + 1}
        self.polyhedron = Polyhedron(M, walls)
        v, w = velocities(M)
        self.system = System(
            Polyhedron(M, {"floor": y - sp.sin(x) / 5, "wall": 3 - x + sp.cos(y) / 9}),
            (v**2 + w**2) * (1 + x**2 / 50) / 2,
            9.81 * y,
            forces={"x": 20 * sp.sin(9 * time_symbol()) - v / 9},
            friction=(Friction("sole", (v,), Interval(0.3), "floor"),),
            restitution=0.5,
        )

    def simulate(self):
        path = simulate(self.system, self.system.state([0.1, 1.0], [1.0, 0.0]), 1.0, 1e-2)
        return path.times, path.q, path.v, list(path.events), path.touching

    def minimise(self):
        return minimise(self.polyhedron, ENERGY, [0.3, 1.0])

    def convex(self):
        return minimise(self.polyhedron, ENERGY, [0.3, 1.0], method="scp")

    def minima(self):
        return list(minima(self.polyhedron, ENERGY, starts=20, box=BOX, rng=0))

    def prove(self):
        found = prove(minimise(self.polyhedron, ENERGY, [0.3, 1.0]), digits=20)
        return found, found.enclose(sp.exp(x))

    def skeleton(self):
        found = skeleton(self.polyhedron, [[0.3, 1.0]])
        return found.corners, found.edges, found.faces

    def stationary(self):
        return stationary_points(self.polyhedron, ENERGY, box=BOX)

    def corners(self):
        return corners(self.polyhedron, box=BOX)

    def sweep(self):
        def lowest(a):
            found = minimise(self.polyhedron, ENERGY + a * sp.sin(x), [0.3, 1.0])
            return {"at": found.point}

        return sweep(lowest, {"a": [0.1, 0.2]})["at"].values


ACTS = [name for name in vars(Models) if not name.startswith("_")]


def content(value):
    """Return all numbers and texts of a result, arrays bit for bit."""
    if isinstance(value, Enum):
        return value.name
    if is_dataclass(value) and not isinstance(value, type):
        held = [getattr(value, f.name) for f in fields(value)]
        return type(value).__name__, content(held)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, dict):
        return [(key, content(part)) for key, part in value.items()]
    if isinstance(value, (list, tuple)):
        return [content(part) for part in value]
    return value.hex() if isinstance(value, float) else repr(value).partition(" at 0x")[0]


def differences(*acts):
    """Let threads act; yield what differs from what one thread finds with models of its own."""
    shared, started = Models(), Barrier(THREADS)

    def found(k):
        started.wait()
        return content(getattr(shared, acts[k % len(acts)])())

    with ThreadPoolExecutor(THREADS) as pool:
        rounds = {name: list(pool.map(found, range(THREADS))) for name in ("first", "second")}
    for act in dict.fromkeys(acts):
        alone = content(getattr(Models(), act)())
        for k in range(acts.index(act), THREADS, len(acts)):
            for name, results in rounds.items():
                if results[k] != alone:
                    yield f"{name} {act} of thread {k}: {results[k]}\nalone: {alone}"


def main(folder, *groups):
    sys.setswitchinterval(1e-5)  # threads are interrupted everywhere
    filters = []  # of warnings, once everything is imported
    for k, group in enumerate(groups):
        print(group, flush=True)
        os.environ[VARIABLE] = f"{folder}/{k}"  # where nothing is compiled yet
        forget()
        for difference in differences(*group.split()):
            sys.exit(difference)
        filters = filters or list(warnings.filters)
        if filters != warnings.filters:
            sys.exit(f"{warnings.filters}\nbefore: {filters}")


if __name__ == "__main__":
    main(*sys.argv[1:])
