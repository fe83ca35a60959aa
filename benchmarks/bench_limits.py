"""Limits on velocities: steps a second with them, beside the same system without.

The two-link arm of ``bench_arm.py``, with bounds on the rates of both joints that act for a part of
the time, that never act, and none; and a point in the plane under a force that turns, with a speed
limit that depends on the place and acts all the time, and with none.  Forces without limits do not
depend on velocities: a step is solved once.  Time is that of the processor, one thread.
"""

import math
from collections.abc import Callable
from time import process_time

import numpy as np
import sympy
from side_by_side import interleave, print_table, ratio, write

from polycorner import Manifold, Polyhedron, System, Trajectory, simulate, velocities
from polycorner.bodies import Arrangement, HalfSpace, Hinge, Motor, capsule
from polycorner.motion import time_symbol

STEPS, DT, ROUNDS = 20_000, 1e-3, 5
LIMIT, NEVER = 4.0, 1e3  # of rates, in radians per second
START = {"shoulder": 0.3, "elbow": 0.5}

Task = Callable[[], Trajectory]


def arm(rate: float | None) -> Task:
    """Return the motion of an arm whose joints have a largest rate, or none."""
    link = capsule([0, 0], [1, 0], 0.05)
    joints = {
        "shoulder": Hinge("world", "upper"),
        "elbow": Hinge("upper", "lower", at=[1, 0], limits=(-2.5, 2.5)),
    }
    floor = {"floor": HalfSpace([0, 1], [0, -1.2])}
    a = Arrangement({"upper": link, "lower": link}, floor, joints=joints)
    drives = {"motor": Motor("shoulder", 3 * sympy.sin(2 * time_symbol()))}
    rates = None if rate is None else dict.fromkeys(joints, rate)
    system = a.system(gravity=[0, -9.81], friction=0.3, drives=drives, rates=rates)
    start = system.state(a.point(joints=START))
    return lambda: simulate(system, start, STEPS * DT, DT)


def turned(*, limited: bool) -> Task:
    """Return the motion of a point under a turning force, with a speed limit or without."""
    plane, t = Manifold.euclidean("x y"), time_symbol()
    (x, _), (vx, vy) = plane.symbols, velocities(plane)
    c = 1 + sympy.Rational(3, 10) * sympy.sin(x)
    system = System(
        Polyhedron(plane, {"far": x + 1000}),
        (vx**2 + vy**2) / 2,
        forces={"x": 2 * sympy.cos(t), "y": 2 * sympy.sin(t)},
        limits={"speed": (c**2 - vx**2 - vy**2) / 2} if limited else {},
    )
    start = system.state([0, 0], [1, 0])
    return lambda: simulate(system, start, STEPS * DT, DT)


def acting(path: Trajectory) -> float:
    """Return the share of recorded instants at which a limit acts."""
    known = path.system.bodies.limit_names
    return math.fsum(any(t[1] in known for t in some) for some in path.touching) / len(path)


def main() -> None:
    cases = {
        "arm": {"none": arm(None), "never acting": arm(NEVER), "acting": arm(LIMIT)},
        "point": {"none": turned(limited=False), "acting": turned(limited=True)},
    }
    found, rows = {}, []
    for case, tasks in cases.items():
        shares = {name: acting(task()) for name, task in tasks.items()}
        times = interleave(tasks, ROUNDS, process_time)
        found[case] = {"seconds": times, "acting": shares}
        for name, taken in times.items():
            speed = f"{STEPS / np.median(taken):,.0f}"
            rows.append([case, name, f"{shares[name]:.0%}", speed, ratio(taken, times["none"])])
    rows = [[*row[:-1], f"{row[-1]:.2f}"] for row in rows]
    print_table("limits", ["", "limits", "acting", "steps a second", "time"], rows)
    write("limits", {"steps": STEPS, **found})


if __name__ == "__main__":
    main()
