"""
A tippe top turns over
======================

A ball that is spun about its axis turns upside down, and lifts its centre of mass.

The centre of mass is ``a R`` below the middle of the ball; ``I1`` and ``I3`` are the moments of
inertia across and along the axis.  All forces but the weight act at the point of contact, so
*Jellett's integral* ``lam = -L . r`` does not change, whatever the law of friction: ``L`` is the
angular momentum about the centre of mass and ``r`` leads from there to the contact.  With given
``lam`` the least energy at the inclination ``theta`` is

    ``W = lam^2 / (2 R^2 J) + m g R (1 - a cos(theta))``
    with ``J = I1 sin(theta)^2 + I3 (cos(theta) - a)^2``,

that of a precession without slip.  Sliding costs energy until the inclination is that of the least
``W`` ([BMR], [RR]).  There the top is upright after a slow spin, tilted after a faster one, and
upside down if ``lam`` is above ``(1 + a)^2 sqrt(m g R^3 I3 a / (1 + a - I1 / I3))``.

On a film of oil, with a drag in proportion to the slip, the top gets there.  Dry friction costs
nothing once the ball rolls.  On a slippery table (coefficient 0.01) a fast top rolls a little short
of the least ``W``; on a rough one (0.3) it does so within a second, and does not rise at all.

Run it to draw the figure: ``python examples/ex24_tippe_top.py [FOLDER]``.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import sympy
from scipy.optimize import brentq

from polycorner import System, Trajectory, simulate, velocities
from polycorner.bodies import Arrangement, HalfSpace, Mass, sphere
from polycorner.motion import angular_velocity
from polycorner.toolkit import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

M, R, A, GRAVITY = 0.02, 0.02, 0.3, 9.81  # kg, m, of R, m/s^2
I1, I3 = 131 / 350 * M * R**2, 2 / 5 * M * R**2
DRAG = 0.06  # of the oil, N s/m
TILT = 0.3  # at the start
SPINS = (20, 45, 70, 100)  # rad/s


def main() -> dict[str, list[Trajectory]]:
    """Return the motions on each table, in the order of ``SPINS``."""
    tables = {"oil": (oiled(), 15), "slippery": (dry(0.01), 25), "rough": (dry(0.3), 10)}  # s
    return {
        name: [spun(top, spin, seconds=seconds) for spin in SPINS]
        for name, (top, seconds) in tables.items()
    }


def dry(friction: float) -> System:
    """Return the top on a table with dry friction."""
    table = {"table": HalfSpace([0, 0, 1], [0, 0, 0])}
    ball = Arrangement({"top": sphere(R)}, table, orientations="all", unit="m")
    mass = Mass(M, [0, 0, -A * R], [I1, I1, I3])
    return ball.system(gravity=[0, 0, -GRAVITY], masses={"top": mass}, friction=friction)


def oiled() -> System:
    """Return the top on oil, whose forces are derivatives of half the power of the drag."""
    top = dry(1.0)
    half = DRAG / 2 * sum(slip**2 for slip in top.friction[0].formulas)
    rates = zip(top.manifold.names, velocities(top.manifold), strict=True)
    return replace(top, friction=(), forces={name: -sympy.diff(half, v) for name, v in rates})


def spun(
    top: System, spin: float, tilt: float = TILT, *, seconds: float, dt: float = 1e-3
) -> Trajectory:
    """Let go of the top, inclined and spinning about its axis."""
    c, s = math.cos(tilt / 2), math.sin(tilt / 2)
    start = top.state([0, 0, R, c, 0, s, 0], [0, 0, 0, 0, spin * s / 2, 0, spin * c / 2])
    return simulate(top, start, seconds, dt)


def inclinations(path: Trajectory) -> Array:
    """Return the angle between the axis and the vertical at each instant."""
    w, x, y, z = path.q[:, 0, 3:].T
    return 2 * np.arctan2(np.hypot(x, y), np.hypot(w, z))


def jellett(path: Trajectory) -> Array:
    """Return Jellett's integral at each instant."""
    space = path.system.manifold
    momentum = sympy.diag(I1, I1, I3) * angular_velocity(space)
    from_centre = sympy.Matrix([0, 0, A * R]) - R * space.matrix()[2, :].T  # axes of the top
    formula = -momentum.dot(from_centre)
    told = sympy.lambdify([*space.symbols, *velocities(space)], formula)
    return told(*path.q[:, 0].T, *path.v[:, 0].T)


def expected(lam: float) -> float:
    """Return the inclination of the least ``W``."""

    def slope(x: float) -> float:
        """Return the derivative of ``W`` with respect to ``x = cos(theta)``."""
        J, dJ = I1 * (1 - x**2) + I3 * (x - A) ** 2, 2 * I3 * (x - A) - 2 * I1 * x
        return -(lam**2) * dJ / (2 * R**2 * J**2) - M * GRAVITY * A * R

    if slope(1) <= 0:
        return 0.0
    return math.pi if slope(-1) >= 0 else math.acos(brentq(slope, -1, 1))


def draw(motions: dict[str, list[Trajectory]], path: Path) -> Path:
    """Draw the inclinations, in time and in the end, and the top that turns over."""
    from matplotlib.figure import Figure

    from polycorner.pictures import save

    figure = Figure(figsize=(9, 6), layout="constrained")
    places = figure.subplot_mosaic([["left", "right"], ["below"] * 2], height_ratios=[5, 2])
    oil = dict(zip(SPINS, motions["oil"], strict=True))
    for spin, color in {20: "#009E73", 70: "#0072B2", 100: "#D55E00"}.items():
        places["left"].plot(oil[spin].times, np.degrees(inclinations(oil[spin])), color=color)
        end = math.degrees(expected(jellett(oil[spin])[0]))
        places["left"].axhline(end, color=color, linestyle="--", linewidth=0.8)
        places["left"].text(9.8, end - 3, f"{spin} rad/s", color=color, ha="right", va="top")
    rough = motions["rough"][-1]
    places["left"].plot(rough.times, np.degrees(inclinations(rough)), color="0.7", linewidth=0.8)
    places["left"].text(9.8, 13, "100 rad/s, rough", color="0.5", ha="right")
    places["left"].set(xlim=(0, 10), xlabel="time (s)", title="on oil, and on a rough table")
    spins = np.linspace(0, 110, 500)
    ends = [math.degrees(expected(lam)) for lam in R * I3 * spins * (math.cos(TILT) - A)]
    places["right"].plot(spins, ends, color="#E69F00", zorder=0, label="least $W$")
    for name, mark in {"oil": "ko", "slippery": "k+", "rough": "kx"}.items():
        last = [math.degrees(inclinations(motion)[-1]) for motion in motions[name]]
        places["right"].plot(SPINS, last, mark, markersize=8, fillstyle="none", label=name)
    places["right"].set(xlabel="spin (rad/s)", title="in the end")
    places["right"].legend()
    for name in ("left", "right"):
        places[name].set(ylim=(-15, 195), yticks=range(0, 181, 45), ylabel="inclination (degrees)")
    draw_tops(places["below"], oil[100])
    places["below"].set_title("on oil, 100 rad/s")
    return save(figure, path)


def draw_tops(axes: "Axes", path: Trajectory) -> None:
    """Draw the top from the side, with its centre of mass; what is above at first is red."""
    from matplotlib.patches import Circle, Wedge

    for time in range(8):
        theta, x = inclinations(path)[path.at(time)], 2.6 * time
        right = -math.degrees(theta)
        axes.add_patch(Wedge((x, 1), 1, right, right + 180, facecolor="#D55E00"))
        axes.add_patch(Circle((x, 1), 1, fill=False))
        axes.plot(x - A * math.sin(theta), 1 - A * math.cos(theta), "ko", markersize=4)
        axes.text(x, 2.2, f"{time} s", ha="center")
    axes.axhline(0, color="k", linewidth=1)
    axes.set(aspect="equal", xlim=(-1.6, 19.8), ylim=(-0.1, 2.8))
    axes.set_axis_off()


if __name__ == "__main__":
    motions = main()
    print("on oil: spin (rad/s), inclination in the end, expected, change of Jellett's integral")
    for spin, path in zip(SPINS, motions["oil"], strict=True):
        lam, last = jellett(path), inclinations(path)[-1]
        print(f"{spin:4} {last:9.4f} {expected(lam[0]):9.4f} {np.ptp(lam) / lam[0]:9.1e}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(motions, folder / 'ex24_tippe_top.png')}")
