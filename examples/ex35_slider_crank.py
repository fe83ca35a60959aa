"""
A slider-crank
==============

A crank turns at a prescribed rate and drives a piston, a closed loop of three hinges and a slider.

The position of the piston is known by heart, ``r cos a + sqrt(l^2 - r^2 sin^2 a)`` at the angle
``a`` of the crank.  At a constant rate the power of the motor is that which moving parts take up
and give back, twice a turn, and what a spring on the piston and its damper take.

Run it to draw the figure: ``python examples/ex35_slider_crank.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner import Trajectory, simulate
from polycorner.bodies import Arrangement, Hinge, Prescribed, Slider, Spring, capsule, disc
from polycorner.motion import time_symbol
from polycorner.spaces.manifold import Array

CRANK, ROD = 1.0, 2.5
RATE = 2 * math.pi  # a turn in a second


@dataclass(frozen=True)
class Result:
    """The linkage and its motion, the piston's positions, and the largest error of one."""

    linkage: Arrangement
    path: Trajectory
    piston: Array
    error: float


def linkage() -> Arrangement:
    bodies = {
        "crank": capsule([0, 0], [CRANK, 0], 0.1),
        "rod": capsule([0, 0], [ROD, 0], 0.07),
        "piston": disc(0.35),
    }
    joints = {
        "shaft": Hinge("world", "crank"),
        "big end": Hinge("crank", "rod", at=[CRANK, 0]),
        "small end": Hinge("rod", "piston", at=[ROD, 0]),
        "cylinder": Slider("world", "piston", axis=[1, 0]),
    }
    return Arrangement(bodies, joints=joints)


def main() -> Result:
    a = linkage()
    drives = {
        "motor": Prescribed("shaft", RATE * time_symbol()),
        "gas": Spring("cylinder", stiffness=5.0, length=ROD, damping=0.2),
    }
    system = a.system(drives=drives)
    q = a.point()
    start = system.state(q, a.velocity(q, joints={"shaft": RATE}))
    path = simulate(system, start, 2.0, 5e-4, every=10)
    piston = a.joint_values(path.q[:, 0])["cylinder"]
    angle = RATE * path.times
    exact = CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    return Result(a, path, piston, float(abs(piston - exact).max()))


def draw(result: Result, path: Path) -> Path:
    """Draw the piston, the energies and the work of the motor in time."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    motion = result.path
    figure = Figure(figsize=(8, 5.6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(motion.times, result.piston, color="#0072B2")
    above.set(ylabel="piston (m)", title="a slider-crank at a turn a second")
    below.plot(motion.times, motion.kinetic, color="#E69F00", label="kinetic")
    below.plot(motion.times, motion.potential, color="#56B4E9", label="in the spring")
    below.plot(motion.times, motion.work["drive"], color="0.3", label="work of the motor")
    below.set(ylabel="energy (J)", xlabel="time (s)")
    below.legend(loc="upper left")
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(f"the piston is off by {result.error:.1e}; audit {result.path.audit:.1e}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex35_slider_crank.png')}")
