"""
An arm that pushes a block
==========================

A two-link arm lays its hand on the floor and pushes a block along.

Two motors hold the angles of the joints by their torques: those of a proportional controller with a
damper, about angles that move.  The arm, the block and the floor rub.  Where the hand would go
through the floor, the floor holds it, and the motors press on it.  What the motors did is what is
left in kinetic and potential energy and what friction took.

Where the arm hangs without motors, with its hand on the floor, is a minimum of the height, and
proved to be one.

Run it to draw the figure: ``python examples/ex34_two_link_arm.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sympy

from polycorner import Trajectory, minimise, prove, simulate
from polycorner.bodies import Arrangement, HalfSpace, Hinge, Motor, capsule, polygon
from polycorner.motion import time_symbol

HEIGHT, GRAVITY = 1.5, [0.0, -9.81]
STIFF, DAMPED = 60.0, 8.0
FROM, TO = (-2.0, 1.5), (-1.2, 0.6)  # angles of shoulder and elbow, in radians


@dataclass(frozen=True)
class Result:
    """The arm, its motion, how far it moved the block in m, and whether its rest is proved."""

    arm: Arrangement
    path: Trajectory
    moved: float
    proved: bool


def arm() -> Arrangement:
    link = capsule([0, 0], [1, 0], 0.06)
    block = polygon([[-0.12, -0.12], [0.12, -0.12], [0.12, 0.12], [-0.12, 0.12]], 0.03)
    joints = {
        "shoulder": Hinge("world", "upper", at=[0, HEIGHT]),
        "elbow": Hinge("upper", "lower", at=[1, 0], limits=(-2.5, 2.5)),
    }
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    return Arrangement({"upper": link, "lower": link, "block": block}, floor, joints=joints)


def servo(a: Arrangement, joint: str, before: float, after: float) -> Motor:
    """Return a motor that turns a joint from one angle to another in a second and a half."""
    share = sympy.Min(time_symbol() / 1.5, 1)
    wanted = before + (after - before) * share
    angle, rate = a.joint_function(joint), a.joint_rate(joint)
    return Motor(joint, -STIFF * (angle - wanted) - DAMPED * rate)


def main() -> Result:
    a = arm()
    names = ("shoulder", "elbow")
    motors = {
        n: servo(a, n, *ends) for n, ends in zip(names, zip(FROM, TO, strict=True), strict=True)
    }
    system = a.system(gravity=GRAVITY, friction=0.3, drives=motors)
    q = a.point({"block": ([0.75, 0.15], 0.0)}, joints=dict(zip(names, FROM, strict=True)))
    path = simulate(system, system.state(q), 2.5, 1e-3, every=5)
    x = a.manifold.names.index("xblock")
    moved = float(path.q[-1, 0, x] - path.q[0, 0, x])
    return Result(a, path, moved, hangs())


def hangs() -> bool:
    """Whether the arm is proved to hang with its hand on the floor."""
    a = arm()
    x, y = (a.manifold.names.index(f"{axis}lower") for axis in "xy")
    bodies = {n: a.named[n] for n in ("upper", "lower")}
    alone = Arrangement(bodies, a.walls, joints=a.joints)
    s = alone.manifold.symbols
    height = s[1] + sympy.sin(s[2]) / 2 + s[y] + sympy.sin(s[x + 2]) / 2
    found = minimise(
        alone.polyhedron, height, alone.point(joints={"shoulder": -1.2, "elbow": -0.9})
    )
    return found.active == ("lower.v2-floor",) and "minimum: proved" in str(prove(found))


def draw(result: Result, path: Path) -> Path:
    """Draw the arm at six instants."""
    from polycorner.pictures import draw_arrangement, save

    at = np.linspace(0, len(result.path) - 1, 6).astype(int)
    titles = [f"{t:.1f} s" for t in result.path.times[at]]
    figure = draw_arrangement(result.arm, result.path.q[at, 0], titles=titles, columns=3)
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(f"the block moved by {result.moved:.3f} m; audit {result.path.audit:.1e}")
    print(f"work of the motors {result.path.work['applied'][-1]:.3f} J")
    print("at rest without motors: " + ("a proved minimum" if result.proved else "not proved"))
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex34_two_link_arm.png')}")
