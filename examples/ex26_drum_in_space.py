"""
The drum in space
=================

Rigid dumbbells in a turning, tilted cylinder, beside the model of a developed drum.

``DumbbellDrum`` presses dumbbells on the wall with their weight at rest.  ``RigidDumbbells`` lets
them move in space: loads follow from the motion, and balls may lift.  Single dumbbells begin to
roll at the same azimuth, up to a correction of the order ``r / R``, and a nested pair climbs or
descends as its hand tells.  That a single dumbbell can stay at rest is decided once more without
any simulation: forces in the sets of sliding friction and rolling resistance must balance its
weight, a convex problem.

Run it to draw the figure: ``python examples/ex26_drum_in_space.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import cvxpy as cp
import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.dumbbells import DumbbellDrum, RigidDumbbells
from polycorner.dumbbells.dynamics.dyads import DyadPaths, follow_dyads
from polycorner.dumbbells.dynamics.singles import onset_azimuths
from polycorner.dumbbells.dynamics.starts import nested_pair
from polycorner.toolkit import Array

DRUM = DumbbellDrum(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
HEADINGS = (-25.0, -8.0, 0.0, 8.0, 20.0)  # degrees
PAIRS = (("R", 8.0), ("L", -8.0))  # hands and headings of nested pairs
DURATION, STEP, EVERY = 20.0, 2e-3, 10


@dataclass(frozen=True)
class Result:
    """Onsets of single dumbbells in degrees, and placements of pairs every 0.02 s.

    ``onsets`` in space, ``rest`` by convex programmes, ``formula`` that of the developed drum.
    """

    onsets: Array
    rest: Array
    formula: Array
    times: Array
    pairs: Array
    lift: float
    planar: DyadPaths


def main() -> Result:
    headings = np.radians(HEADINGS)
    one = RigidDumbbells(DRUM)
    onsets = [onset(one, theta) for theta in headings]
    rest = [rest_limit(one, theta) for theta in headings]
    two = RigidDumbbells(replace(DRUM, count=2))
    paths, lifts = [], []
    for hand, heading in PAIRS:
        start = two.state(nested_pair(DRUM, hand, heading=math.radians(heading)))
        path = simulate(two.system, start, DURATION, STEP, every=EVERY)
        paths.append(two.placements(path.q, path.times[:, None]))
        lifts.append(two.lifts(path.q).max())
    planar = follow_dyads(DRUM, [(hand, math.radians(h)) for hand, h in PAIRS], DURATION)
    formula = np.degrees(onset_azimuths(DRUM, headings))
    found = np.degrees(onsets), np.degrees(rest), formula
    return Result(*found, path.times, np.stack(paths, axis=1), max(lifts), planar)


def onset(rigid: RigidDumbbells, heading: float) -> float:
    """Return the azimuth at which a dumbbell that the drum carries begins to roll back."""
    path = simulate(rigid.system, rigid.state([0.0, 0.0, heading]), 17.0, STEP)
    phi = rigid.placements(path.q[:, 0], path.times)[:, 0]
    return float(phi[np.argmax(np.diff(phi) < 0)])


def rest_limit(rigid: RigidDumbbells, heading: float) -> float:
    """Return the azimuth up to which forces can hold a dumbbell at rest."""
    return float(brentq(lambda phi: shortage(rigid, phi, heading), 0.0, 0.3, xtol=1e-7))


def shortage(rigid: RigidDumbbells, phi: float, heading: float) -> float:
    """Return how much rolling resistance a dumbbell at rest lacks, over weight and radius."""
    drum, q = rigid.drum, rigid.state([phi, 0.0, heading]).q
    rod = Rotation.from_quat(q[3:], scalar_first=True).apply([0.0, drum.length / 2, 0.0])
    load, grip, twist = cp.Variable(2), cp.Variable((2, 3)), cp.Variable((2, 3))
    lacking = cp.Variable()
    force: cp.Expression = -np.array([0.0, math.sin(drum.tilt), math.cos(drum.tilt)])
    torque: cp.Expression = np.zeros(3)
    limits = []
    for k, arm in enumerate((-rod, rod)):
        ball = q[:3] + arm
        inward = -np.array([ball[0], 0.0, ball[2]]) / math.hypot(ball[0], ball[2])
        there = arm - drum.ball_radius * inward
        push = load[k] * inward + grip[k]
        force = force + push
        torque = torque + np.cross(there, np.eye(3)).T @ push + drum.ball_radius * twist[k]
        limits += [inward @ grip[k] == 0, inward @ twist[k] == 0]
        limits += [cp.norm(grip[k]) <= drum.sliding[0] * load[k]]
        limits += [cp.norm(twist[k]) <= drum.rolling[0] * load[k] + lacking]
    problem = cp.Problem(cp.Minimize(lacking), [*limits, force == 0, torque / drum.length == 0])
    return float(problem.solve(solver=cp.CLARABEL))


def draw(result: Result, path: Path) -> Path:
    """Draw axial positions and headings of the pairs against time."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(8.5, 6.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    for k, (name, colour) in enumerate((("right", "#0072B2"), ("left", "#009E73"))):
        eta, theta = (result.pairs[:, k, :, i].mean(axis=1) for i in (1, 2))
        above.plot(result.times, eta - eta[0], color=colour, label=f"{name}-handed, in space")
        below.plot(result.times, np.degrees(abs(theta)), color=colour)
        planar = result.planar
        above.plot(planar.times, planar.eta[:, k], "--", color=colour, label="developed drum")
        heading = abs(planar.q[:, k, :, 2].mean(axis=-1))
        below.plot(planar.times, np.degrees(heading), "--", color=colour)
    above.set(ylabel="axial position η (mm)")
    below.set(ylabel="|heading θ| (degrees)", xlabel="time (s)")
    above.legend()
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    for row in zip(HEADINGS, result.onsets, result.rest, result.formula, strict=True):
        print("heading {:5.1f}: onset {:.3f}, rest up to {:.3f}, formula {:.3f}".format(*row))
    rates = np.diff(result.pairs[[0, -1], :, :, 1].mean(axis=-1), axis=0)[0] / DURATION
    print("pairs climb at", rates.round(3), "mm/s; lift", f"{result.lift:.1e} mm")
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out") / "drum_in_space"
    print(draw(result, folder / "drum_in_space.png"))
