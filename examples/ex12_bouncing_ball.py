"""
A bouncing ball
===============

A bouncing ball that comes to rest after infinitely many bounces in finite time.

Dropped from the height 1, the ball lands after ``t = sqrt(2 h / g)`` and comes to rest after
``t (1 + e) / (1 - e)``.  Time stepping with impulses does not stop at single bounces: those shorter
than a step end in a state of exact rest.  The error of the time of the first impact is of second
order in the step; each bounce then adds an error of first order, so that the error of the time of
rest is of order ``dt log(1 / dt)``.  The energy lost is accounted for to rounding.

Run it to draw the figure: ``python examples/ex12_bouncing_ball.py [FOLDER]``.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner.models.textbook import GRAVITY, bouncing_ball
from polycorner.motion.events import EventKind
from polycorner.motion.simulation import simulate
from polycorner.motion.trajectory import Trajectory

RESTITUTION, HEIGHT = 0.7, 1.0
FALL = math.sqrt(2 * HEIGHT / GRAVITY)
STEP = 1e-3


@dataclass(frozen=True)
class Result:
    """The motion, and its times against their closed forms, in s.

    ``impact`` and ``rest`` are errors of the first impact and of the rest at the step ``STEP``;
    ``orders`` the powers of the step with which they vanish; ``lost`` the energy lost in impacts,
    in units of ``g h``; ``bounces`` how many were resolved.
    """

    path: Trajectory
    impact: float
    rest: float
    orders: tuple[float, float]
    lost: float
    bounces: int


def main() -> Result:
    path = dropped(STEP)
    impact, rest = errors(STEP)
    return Result(
        path=path,
        impact=impact,
        rest=rest,
        orders=orders(),
        lost=float(path.dissipated["impact"][-1]) / (GRAVITY * HEIGHT),
        bounces=len(path.of_kind(EventKind.IMPACT)),
    )


def dropped(dt: float, every: int = 3) -> Trajectory:
    """Let the ball fall until it has come to rest, and record every so many steps."""
    ball = bouncing_ball(RESTITUTION)
    return simulate(ball, ball.state([HEIGHT]), 3.0, dt, every=every)


def errors(dt: float) -> tuple[float, float]:
    """Return the delays of the first impact and of the state of rest."""
    path = dropped(dt, every=10_000)
    rest = FALL * (1 + RESTITUTION) / (1 - RESTITUTION)
    first = path.of_kind(EventKind.IMPACT)[0].time
    return first - FALL, path.of_kind(EventKind.REST)[0].time - rest


def orders() -> tuple[float, float]:
    """Fit the power of the step; among several steps of similar length the worst counts."""
    steps = STEP * 2.0 ** np.arange(3, -1, -1)
    nearby = 1 + np.arange(6) / 12
    worst = [np.abs([errors(dt * factor) for factor in nearby]).max(axis=0) for dt in steps]
    impact, rest = np.polyfit(np.log(steps), np.log(worst), 1)[0]
    return float(impact), float(rest)


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
    print(f"first impact off by {result.impact:.1e} s, order {result.orders[0]:.2f}")
    print(f"rest off by {result.rest:.1e} s, order {result.orders[1]:.2f}")
    print(f"lost {result.lost:.12f} of the energy; audit {result.path.audit:.1e}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(result, folder / 'ex12_bouncing_ball.png')}")
