"""
Sliding, rolling, sticking
==========================

Sliding, rolling and sticking of a ball that is pushed, or released on an incline.

Sliding friction acts on the slip ``v - r w`` of the lowest point, rolling resistance on the spin:
two contacts with separate friction sets and known load.  Without resistance the ball ends its slide
at ``5/7`` of its speed, with it a little slower; it rolls with the deceleration ``5/7 mu_r g``, and
stops.  Down an incline it stays while ``tan(angle) <= mu_r`` and rolls without slip while
``tan(angle) <= 7/2 mu - 5/2 mu_r``.

On a moving belt, a block on a spring alternately sticks and slips: static friction is larger than
dynamic friction.

Run it to draw the figure: ``python examples/ex13_rolling.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner import Trajectory, simulate
from polycorner.models.textbook import GRAVITY, ball_on_plane, sliding_block
from polycorner.motion import Disc, EventKind
from polycorner.toolkit import Array

SLIDING, ROLLING = 0.2, 0.02
PUSH = (3.0, 1.0)  # m/s, without spin
SLOPES = np.round(np.tan([0.01, 0.03, 0.2, 0.5, 0.7]), 3)
BELT, STIFFNESS, STATIC, DYNAMIC = 0.1, 50.0, 0.4, 0.25


@dataclass(frozen=True)
class Result:
    """A pushed ball, balls on inclines, and a block on a belt.

    ``share`` is the speed at which sliding ended, in units of that of the push; ``rests`` when the
    ball stopped, and ``expected`` when it should, in s; ``accelerations`` along and ``slips`` of
    the balls on inclines of ``SLOPES``, in m/s^2; ``period`` of stick and slip, and by the formula.
    """

    ball: Trajectory
    share: float
    rests: float
    expected: float
    accelerations: Array
    slips: Array
    block: Trajectory
    period: tuple[float, float]


def main() -> Result:
    ball, block = pushed(), on_belt()
    slip = np.linalg.norm(ball.v[:, 0, :2] - ball.v[:, 0, 2:], axis=1)
    rolls = int(np.argmax(slip < 1e-9))
    down = np.array([released(slope) for slope in SLOPES])
    slips = [event.time for event in block.of_kind(EventKind.MOTION)]
    return Result(
        ball=ball,
        share=float(np.linalg.norm(ball.v[rolls, 0, :2]) / np.linalg.norm(PUSH)),
        rests=ball.of_kind(EventKind.REST)[0].time,
        expected=stopping_time(),
        accelerations=down[:, 0],
        slips=down[:, 0] - down[:, 1],
        block=block,
        period=(float(np.diff(slips).mean()), stick_slip_period()),
    )


def pushed() -> Trajectory:
    """Push the ball and wait until it stops."""
    plane = ball_on_plane(Disc(SLIDING), Disc(ROLLING))
    return simulate(plane, plane.state([0] * 4, [*PUSH, 0, 0]), 18.0, 1e-3, every=10)


def stopping_time() -> float:
    """Return the time of sliding and that of rolling.

    While it slides the spin gains ``5/2 (mu - mu_r) g / r``: slip is gone after ``v`` over
    ``(7/2 mu - 5/2 mu_r) g``.
    """
    speed = math.hypot(*PUSH)
    slides = speed / (GRAVITY * (7 / 2 * SLIDING - 5 / 2 * ROLLING))
    left = speed - SLIDING * GRAVITY * slides
    return slides + left / (5 / 7 * ROLLING * GRAVITY)


def released(slope: float) -> tuple[float, float]:
    """Return the accelerations of a ball released on an incline, along it and of its rotation."""
    plane = ball_on_plane(Disc(SLIDING), Disc(ROLLING), angle=math.atan(slope))
    path = simulate(plane, plane.state([0] * 4), 1.0, 1e-2)
    return float(path.v[-1, 0, 0]), float(path.v[-1, 0, 2])


def on_belt() -> Trajectory:
    """Let the belt take the block along, against the spring."""
    block = sliding_block(Disc(STATIC), Disc(DYNAMIC), belt=BELT, stiffness=STIFFNESS)
    return simulate(block, block.state([0, 0], [BELT, 0]), 6.0, 1e-3, every=4)


def stick_slip_period() -> float:
    """Return the time of sticking and that of the slip, part of an oscillation of the spring."""
    frequency, half = math.sqrt(STIFFNESS), (STATIC - DYNAMIC) * GRAVITY / STIFFNESS
    slip = 2 * (math.pi - math.atan(half * frequency / BELT)) / frequency
    return 2 * half / BELT + slip


def draw(result: Result, path: Path) -> Path:
    """Draw the speeds of the ball, and the motion of the block in phase space."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    ball, block = result.ball, result.block
    left.plot(ball.times, np.linalg.norm(ball.v[:, 0, :2], axis=1), color="#0072B2", label="speed")
    turn = np.linalg.norm(ball.v[:, 0, 2:], axis=1)
    left.plot(ball.times, turn, "--", color="#D55E00", label="spin times radius")
    left.axhline(5 / 7 * math.hypot(*PUSH), color="0.7", linewidth=0.8, zorder=0)
    left.set(xlabel="time (s)", ylabel="m/s", title="slides, rolls, stops")
    left.legend()
    right.plot(block.q[:, 0, 0], block.v[:, 0, 0], color="#0072B2")
    right.set(xlabel="extension of the spring (m)", ylabel="velocity (m/s)", title="stick and slip")
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(f"sliding ends at {result.share:.4f} of the speed, rest after {result.rests:.3f} s")
    print(f"    (closed form {result.expected:.3f} s)")
    print("slope    along    slip (m/s^2)")
    for slope, along, slip in zip(SLOPES, result.accelerations, result.slips, strict=True):
        print(f"{slope:5.3f}  {along:7.4f}  {slip:7.4f}")
    print("stick and slip every {:.4f} s, by the formula {:.4f} s".format(*result.period))
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex13_rolling.png')}")
