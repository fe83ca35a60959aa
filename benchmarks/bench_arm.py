"""A two-link arm with contacts: steps of a millisecond a second, beside MuJoCo where it is there.

Two capsules on hinges, driven by a torque that swings at the shoulder, over a floor that the lower
one strikes and rubs on; the elbow has limits.  Time is that of the processor, one thread.

MuJoCo has the same bodies, hinges, limits, torques, friction and step, and Newton's method; its
contacts are soft, and the depth of the worst overlap is told for both.
"""

import math
from collections.abc import Callable
from time import process_time

import numpy as np
import sympy
from mujoco_drum import load_mujoco
from side_by_side import interleave, print_table, ratio, write

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, Hinge, Motor, capsule, mass_of
from polycorner.motion import time_symbol

STEPS, DT, ROUNDS = 20_000, 1e-3, 5
FLOOR, RADIUS, LIMIT, MU, TORQUE, TURN = -1.2, 0.05, 2.5, 0.3, 3.0, 2.0
START = {"shoulder": 0.3, "elbow": 0.5}


def ours() -> tuple[Callable[[], object], Callable[[], float]]:
    """Return the task, and what tells the worst overlap of its last run."""
    link = capsule([0, 0], [1, 0], RADIUS)
    joints = {
        "shoulder": Hinge("world", "upper"),
        "elbow": Hinge("upper", "lower", at=[1, 0], limits=(-LIMIT, LIMIT)),
    }
    floor = {"floor": HalfSpace([0, 1], [0, FLOOR])}
    a = Arrangement({"upper": link, "lower": link}, floor, joints=joints)
    torque = TORQUE * sympy.sin(TURN * time_symbol())
    drives = {"motor": Motor("shoulder", torque)}
    system = a.system(gravity=[0, -9.81], friction=MU, drives=drives)
    start, deepest = system.state(a.point(joints=START)), [0.0]

    def task() -> None:
        path = simulate(system, start, STEPS * DT, DT, every=STEPS)
        deepest[0] = path.max_penetration

    return task, lambda: deepest[0]


def theirs() -> tuple[Callable[[], object], Callable[[], float]]:
    """Return the same for MuJoCo, in the plane of ``x`` and ``z``."""
    mujoco = load_mujoco()
    mass = mass_of(capsule([0, 0], [1, 0], RADIUS))
    inertia = f"{mass.inertia:.17g} {mass.inertia:.17g} {mass.inertia:.17g}"
    inertial = f'<inertial pos="0.5 0 0" mass="{mass.mass:.17g}" diaginertia="{inertia}"/>'
    geom = f'<geom type="capsule" fromto="0 0 0 1 0 0" size="{RADIUS}" friction="{MU} 0 0"/>'
    text = f"""<mujoco><compiler angle="radian" autolimits="true"/>
    <option timestep="{DT}" gravity="0 0 -9.81" solver="Newton"/><worldbody>
    <geom type="plane" pos="0 0 {FLOOR}" size="9 9 1" friction="{MU} 0 0"/>
    <body><joint name="shoulder" axis="0 -1 0"/>{inertial}{geom}
    <body pos="1 0 0"><joint axis="0 -1 0" range="{-LIMIT} {LIMIT}"/>{inertial}{geom}</body></body>
    </worldbody><actuator><motor joint="shoulder"/></actuator></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data, deepest = mujoco.MjData(model), [0.0]

    def task() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[:], worst = list(START.values()), 0.0
        for k in range(STEPS):
            data.ctrl[0] = TORQUE * math.sin(TURN * k * DT)
            mujoco.mj_step(model, data)
            if data.ncon:
                worst = min(worst, float(np.min(data.contact.dist)))
        deepest[0] = -worst

    return task, lambda: deepest[0]


def main() -> None:
    tasks = {"polycorner": ours()}
    try:
        tasks["MuJoCo"] = theirs()
    except ImportError as missing:
        print(missing)
    times = interleave({name: task for name, (task, _) in tasks.items()}, ROUNDS, process_time)
    rows = []
    for name, taken in times.items():
        beside = ratio(taken, times["polycorner"])
        rows.append(
            [name, f"{STEPS / np.median(taken):,.0f}", f"{beside:.2f}", f"{tasks[name][1]():.1e}"]
        )
    print_table("a two-link arm", ["", "steps a second", "time", "deepest overlap"], rows)
    write("arm", {"steps": STEPS, "seconds": times})


if __name__ == "__main__":
    main()
