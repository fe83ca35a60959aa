"""First steps: from starting an interpreter to the tenth step, with an empty cache.

Every scene runs in a fresh interpreter, first with an empty cache and then with the one that this
has filled; times are those of the whole process, of the processor and by the clock.  With
``--against CHECKOUT`` another checkout of polycorner runs the same scenes in turn, and placements
after the tenth step have to be the same to the last bit.  Rounds are interleaved, as other
processes slow both alike; the table has medians.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

from side_by_side import ROOT, print_table, write

ROUNDS, STEPS, DT = 5, 10, 1e-3
GRAVITY, FRICTION, SPEED = 9.81, 0.4, 20.0
Run = tuple[float, float, str]  # seconds of the processor and by the clock, and what is printed


def thrown(bodies: dict[str, Any], count: Any, dimension: int, height: float) -> tuple[Any, Any]:
    """Return bodies that are thrown at a floor in loose rows, and how they start."""
    import numpy as np

    from polycorner.bodies import Arrangement, HalfSpace

    up = np.eye(dimension)[-1]
    a = Arrangement(bodies, {"floor": HalfSpace(up, 0 * up)}, orientations="all")
    system = a.system(gravity=-GRAVITY * up, friction=FRICTION, count=count)
    rows = np.array(list(product(range(5), repeat=dimension)))[:, ::-1]
    places = iter(2.5 * rows + height * up)
    numbers = count if isinstance(count, dict) else dict.fromkeys(bodies, count)
    start = {
        name: np.array([_placed(a, name, next(places)) for _ in range(n)])
        for name, n in numbers.items()
    }
    fast = {
        name: np.zeros(q.shape) - SPEED * np.eye(q.shape[1])[dimension - 1]
        for name, q in start.items()
    }
    if isinstance(count, dict):
        return system, system.state(start, fast)
    return system, system.state(start["A"], fast["A"])


def _placed(a: Any, name: str, place: Any) -> Any:
    p = next(p for p in a.placements if p.name == name)
    turn = [0.3] if p.body.dimension == 2 else [0.8, 0.6, 0.0, 0.0]
    return [*place.tolist(), *turn]


def balls() -> tuple[Any, Any]:
    from polycorner.bodies import sphere

    return thrown({"A": sphere(1.0)}, 10, 3, 1.1)


def boxes(dimension: int) -> tuple[Any, Any]:
    from polycorner.bodies import polygon, polytope

    corners = list(product((-0.5, 0.5), repeat=dimension))
    body = polytope(corners) if dimension == 3 else polygon([corners[i] for i in (0, 2, 3, 1)])
    return thrown({"A": body}, 10, dimension, 0.7)


def discs() -> tuple[Any, Any]:
    from polycorner.bodies import disc

    return thrown({"large": disc(1.0), "small": disc(0.6)}, {"large": 5, "small": 5}, 2, 1.1)


def dominoes() -> tuple[Any, Any]:
    import numpy as np

    from polycorner.bodies import Arrangement, HalfSpace, polygon

    tile = polygon([[-0.1, -0.5], [0.1, -0.5], [0.1, 0.5], [-0.1, 0.5]])
    a = Arrangement({"A": tile}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all")
    system = a.system(gravity=[0, -GRAVITY], friction=FRICTION, count=8)
    start = np.array([[0.45 * i, 0.5, 0.0] for i in range(8)])
    start[0] = [-0.05, 0.55, -0.1]
    return system, system.state(start)


def arch() -> tuple[Any, Any]:
    import numpy as np

    from polycorner.bodies import Arrangement, HalfSpace, polygon

    count, inner, outer = 8, 1.0, 1.2
    half = np.pi / (2 * count)
    sides = [(r, s * half) for r, s in ((inner, -1), (outer, -1), (outer, 1), (inner, 1))]
    corners = np.array([[r * np.cos(angle), r * np.sin(angle)] for r, angle in sides])
    middle = 2 * np.sin(half) / (3 * half) * (outer**3 - inner**3) / (outer**2 - inner**2)
    stone = polygon(corners - [middle, 0.0])
    a = Arrangement({"A": stone}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all")
    system = a.system(gravity=[0, -GRAVITY], friction=0.9, count=count)
    angles = np.pi * (np.arange(count) + 0.5) / count
    start = np.column_stack([middle * np.cos(angles), middle * np.sin(angles), angles])
    return system, system.state(start)


def arm() -> tuple[Any, Any]:
    from polycorner.bodies import Arrangement, HalfSpace, Hinge, capsule

    link = capsule([0, 0], [1, 0], 0.06)
    joints = {
        "shoulder": Hinge("world", "upper", at=[0, 1.5]),
        "elbow": Hinge("upper", "lower", at=[1, 0], limits=(-2.5, 2.5)),
    }
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    a = Arrangement({"upper": link, "lower": link}, floor, joints=joints)
    system = a.system(gravity=[0, -GRAVITY], friction=FRICTION)
    return system, system.state(a.point(joints={"shoulder": 0.3, "elbow": -0.4}))


SCENES: dict[str, Callable[[], tuple[Any, Any]]] = {
    "10 boxes in the plane": lambda: boxes(2),
    "10 boxes in space": lambda: boxes(3),
    "10 balls in space": balls,
    "10 discs of two sizes": discs,
    "8 dominoes": dominoes,
    "arch of 8 stones": arch,
    "arm of two links": arm,
}


def ten_steps(scene: str) -> None:
    """Print a digest of where a scene is after ten steps."""
    from hashlib import sha256

    from polycorner import simulate

    system, state = SCENES[scene]()
    last = simulate(system, state, STEPS * DT, DT).last
    parts = last.parts if hasattr(last, "parts") else (last,)
    content = b"".join(x.tobytes() for s in parts for x in (s.q, s.v))
    print(sha256(content).hexdigest())


def process(scene: str, checkout: Path, cache: str) -> Run:
    """Run a scene in a process of its own."""
    variables = {"PYTHONPATH": str(checkout), "POLYCORNER_CACHE_DIR": cache}
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    before, clock = os.times(), time.perf_counter()
    command = [sys.executable, __file__, "--scene", scene]
    done = subprocess.run(
        command,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | variables | single,
    )
    wall, after = time.perf_counter() - clock, os.times()
    spent = after.children_user - before.children_user
    return spent + after.children_system - before.children_system, wall, done.stdout


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=[*SCENES])
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--against", type=Path, metavar="CHECKOUT")
    parser.add_argument("--scene", choices=SCENES, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.scene:
        ten_steps(chosen.scene)
        return
    checkouts = {"now": ROOT} | ({"before": chosen.against} if chosen.against else {})
    columns = ["empty, processor", "empty, clock", "filled, processor", "filled, clock"]
    figures: dict[str, dict[str, dict[str, float]]] = {}
    for scene in chosen.scenes:
        rows: dict[str, list[list[float]]] = {name: [] for name in checkouts}
        places = set()
        for _ in range(chosen.rounds):
            for name, checkout in checkouts.items():
                with tempfile.TemporaryDirectory() as cache:
                    runs = [process(scene, checkout, cache) for _ in range(2)]
                rows[name].append([x for run in runs for x in run[:2]])
                places |= {run[2] for run in runs}
        if len(places) > 1:
            msg = f"{scene}: placements after ten steps are not always the same"
            raise AssertionError(msg)
        figures[scene] = {
            name: {
                c: round(statistics.median(x), 2)
                for c, x in zip(columns, zip(*found, strict=True), strict=True)
            }
            for name, found in rows.items()
        }
        print(scene, figures[scene], flush=True)
    table = [[f"{s}, {n}", *f.values()] for s, by in figures.items() for n, f in by.items()]
    print_table("To the tenth step, in s", ["", *columns], table)
    write("first", {"rounds": chosen.rounds, "scenes": figures})


if __name__ == "__main__":
    main()
