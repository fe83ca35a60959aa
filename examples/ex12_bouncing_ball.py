"""
A bouncing ball
===============

A bouncing ball that comes to rest after infinitely many bounces in finite time.

Dropped from the height 1, the ball lands after ``t = sqrt(2 h / g)`` and comes to rest after
``t (1 + e) / (1 - e)``.  Bounces are located within the steps: in free fall their times have no
error but that of the gap at which bodies touch.  Where the ball would bounce off no faster than it
is brought back within a step, it comes to rest; the error of the time of rest is of the order of
the step.  The energy lost is accounted for.

Run it to draw the figure: ``python examples/ex12_bouncing_ball.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner import Trajectory, simulate
from polycorner.models.textbook import GRAVITY, bouncing_ball
from polycorner.motion import EventKind

RESTITUTION, HEIGHT = 0.7, 1.0
FALL = math.sqrt(2 * HEIGHT / GRAVITY)
STEP = 1e-3


@dataclass(frozen=True)
class Result:
    """The motion, and its times against their closed forms, in s.

    ``impact`` and ``rest`` are errors of the worst of the first five impacts and of the rest at the
    step ``STEP``; ``order`` the power of the step with which the latter vanishes; ``lost`` the
    energy lost in impacts, in units of ``g h``; ``bounces`` how many were resolved.
    """

    path: Trajectory
    impact: float
    rest: float
    order: float
    lost: float
    bounces: int


def main() -> Result:
    path = dropped(STEP)
    impact, rest = errors(STEP)
    return Result(
        path=path,
        impact=impact,
        rest=rest,
        order=order(),
        lost=float(path.dissipated["impact"][-1]) / (GRAVITY * HEIGHT),
        bounces=len(path.of_kind(EventKind.IMPACT)),
    )


def dropped(dt: float, every: int = 3) -> Trajectory:
    """Let the ball fall until it has come to rest, and record every so many steps."""
    ball = bouncing_ball(RESTITUTION)
    return simulate(ball, ball.state([HEIGHT]), 3.0, dt, every=every)


def errors(dt: float) -> tuple[float, float]:
    """Return the worst error of the first five impacts, and the delay of the state of rest."""
    path = dropped(dt, every=10_000)
    rest = FALL * (1 + RESTITUTION) / (1 - RESTITUTION)
    flights = np.array([1.0, *(2 * RESTITUTION**n for n in range(1, 5))])
    found = [event.time for event in path.of_kind(EventKind.IMPACT)[:5]]
    late = float(np.abs(found - FALL * np.cumsum(flights)).max())
    return late, path.of_kind(EventKind.REST)[0].time - rest


def order() -> float:
    """Fit the power of the step; among several steps of similar length the worst counts."""
    steps = STEP * 2.0 ** np.arange(3, -1, -1)
    nearby = 1 + np.arange(6) / 12
    worst = [max(abs(errors(dt * factor)[1]) for factor in nearby) for dt in steps]
    return float(np.polyfit(np.log(steps), np.log(worst), 1)[0])


def draw(result: Result, path: Path) -> Path:
    """Draw height and energies against time."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    motion, unit = result.path, GRAVITY * HEIGHT
    figure = Figure(figsize=(8, 5.6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(motion.times, motion.q[:, 0, 0], color="#0072B2")
    zeno = FALL * (1 + RESTITUTION) / (1 - RESTITUTION)
    for axes in (above, below):
        axes.axvline(zeno, color="0.6", linewidth=0.8)
    shares = (motion.kinetic, motion.potential, motion.dissipated["impact"])
    labels = ("kinetic", "potential", "lost in impacts")
    colours = ("#E69F00", "#56B4E9", "0.8")
    below.stackplot(motion.times, *(s / unit for s in shares), labels=labels, colors=colours)
    above.set(ylabel="height (m)", title="at rest after infinitely many bounces")
    below.set(ylabel="energy", xlabel="time (s)", ylim=(0, 1.02))
    below.legend(loc="center right")
    return save(figure, path)


if __name__ == "__main__":
    result = main()
    print(f"{result.bounces} bounces resolved, then rest")
    print(f"first five impacts off by {result.impact:.1e} s")
    print(f"rest off by {result.rest:.1e} s, order {result.order:.2f}")
    print(f"lost {result.lost:.12f} of the energy; audit {result.path.audit:.1e}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex12_bouncing_ball.png')}")
