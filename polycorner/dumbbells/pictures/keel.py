"""Figures of the keel effect: regions of rest in a tilted drum, and the torque while sliding."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polycorner.dumbbells.statics.keel import Keel, RestRegion
from polycorner.dumbbells.statics.keel_formulas import net_torque, s_curve
from polycorner.toolkit import Array, checked

CURVE, POSITIVE, NEGATIVE = "#D55E00", "#0072B2", "#009E73"
OUTER, INNER, GROWING = "#F3DFB8", "#DDBB77", "#D7B5D8"
HEADINGS = (-25.0, -15.0, -5.0, 5.0, 15.0, 25.0)  # of the zigzags that are drawn, in degrees
SAMPLES = 1441
RESOLUTION = 721  # of the torque, in both directions


@checked
def draw_keel(keel: Keel, *, friction: float | None = None) -> Figure:
    """Draw the plane of azimuth and heading: regions of rest, and regions of growing headings.

    The first panel has ``A`` and ``B``, the curve ``S`` and the eastern boundary of ``A``, in blue
    for positive and in green for negative headings as in [GMBN] app. A.  Arrows lead from the
    azimuth at which a carried dumbbell starts to roll to the one at which it stops.  In the hatched
    region of the second panel the torque on a dumbbell that slides down the slope increases
    ``|theta|``; ``friction`` is its coefficient, by default the dynamic one of sliding.
    """
    friction = keel.sliding_dynamic if friction is None else friction
    figure = Figure(figsize=(12.5, 6.2), layout="constrained")
    first, second = figure.subplots(1, 2)
    place_regions(first, keel)
    first.set_title("(a) regions of rest, turning points")
    place_torque(second, keel, friction)
    second.set_title(f"(b) torque while sliding down the slope, friction {friction:g}")
    for axes in (first, second):
        axes.set(ylim=(-90, 90), yticks=range(-90, 91, 30), ylabel="heading θ (degrees)")
        axes.set_xlabel("azimuth φ (degrees)")
        axes.legend(loc="upper left", fontsize=9, framealpha=1.0)
        axes.axhline(0, color="0.75", linewidth=0.6, zorder=0.5)
        axes.axvline(0, color="0.75", linewidth=0.6, zorder=0.5)
    tilt = f"α = {math.degrees(keel.tilt):g}°"
    static = f"static μ$_r$ = {keel.rolling:g}, μ$_s$ = {keel.sliding:g}"
    dynamic = f"dynamic {keel.rolling_dynamic:g}, {keel.sliding_dynamic:g}"
    figure.suptitle(f"Keel effect, {tilt};  {static};  {dynamic}")
    return figure


def _headings() -> Array:
    return np.radians(np.linspace(-90, 90, SAMPLES))


def place_regions(axes: Axes, keel: Keel) -> None:
    """Draw ``A`` with its eastern boundary, ``B``, ``S`` and zigzags, in degrees, on given axes."""
    _fill(axes, keel.onset, OUTER, "A: stays at rest")
    _fill(axes, keel.arrest, INNER, "B: even when nudged")
    _draw_boundary(axes, keel.onset)
    _draw_zigzags(axes, keel)


def place_region(axes: Axes, region: RestRegion) -> None:
    """Draw a region ``A`` with its eastern boundary and ``S``, in degrees, on given axes."""
    _fill(axes, region, OUTER, "A: stays at rest")
    _draw_boundary(axes, region)


def _draw_boundary(axes: Axes, region: RestRegion) -> None:
    theta = _headings()
    east = np.degrees(region.eastern_boundary(theta))
    for colour, side, sign in ((POSITIVE, theta >= 0, ">"), (NEGATIVE, theta <= 0, "<")):
        label = rf"eastern boundary of A, $\theta {sign} 0$"
        along = np.degrees(theta[side])
        axes.plot(east[side], along, color=colour, linewidth=2.6, label=label, zorder=3)
    limit = 30.0 if math.isnan(region.limit) else 1.55 * math.degrees(region.limit)
    _draw_curve(axes, region.tilt, limit)
    axes.set_xlim(-limit, limit)


def _fill(axes: Axes, region: RestRegion, colour: str, label: str) -> None:
    theta = _headings()
    west, east = (np.degrees(end) for end in region.azimuths(theta))
    axes.fill_betweenx(
        np.degrees(theta), west, east, color=colour, linewidth=0, label=label, zorder=1
    )


def _draw_curve(axes: Axes, tilt: float, limit: float) -> None:
    phi = np.radians(np.linspace(-limit, limit, SAMPLES))
    heading = np.degrees(s_curve(phi, tilt))
    axes.plot(np.degrees(phi), heading, color=CURVE, linewidth=1.6, label="S", zorder=2.5)


def _draw_zigzags(axes: Axes, keel: Keel) -> None:
    """Mark the azimuths at which dumbbells of some headings start to roll and stop."""
    turning = keel.turning(np.radians(HEADINGS))
    found = np.degrees([turning.upper, turning.coasting])
    for heading, start, stop in zip(HEADINGS, *found, strict=True):
        if math.isnan(stop):
            continue
        arrow = {"arrowstyle": "-|>", "color": "black", "lw": 1.1, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (stop, heading), xytext=(start, heading), arrowprops=arrow, zorder=4)
    axes.plot([], [], "-k", linewidth=1.1, marker="<", markersize=5, label="rolls back, stops")


def place_torque(axes: Axes, keel: Keel, friction: float) -> None:
    """Draw ``S``, and hatch where the torque on a dumbbell that slides increases ``|theta|``."""
    edge = 89.999  # at 90 degrees the normal force vanishes
    phi = np.radians(np.linspace(-edge, edge, RESOLUTION))
    theta = np.radians(np.linspace(-90, 90, RESOLUTION))
    torque = net_torque(phi, theta[:, None], keel.tilt, friction)
    growing = np.where(theta[:, None] < 0, -torque, torque)
    if growing.max() > 1e-12:
        degrees = np.degrees(phi), np.degrees(theta), growing
        axes.contourf(*degrees, levels=[0, np.inf], colors=[GROWING], hatches=["////"], zorder=1)
        axes.contour(*degrees, levels=[0], colors=["black"], linewidths=0.9, zorder=1.5)
    _draw_curve(axes, keel.tilt, 90.0)
    axes.fill_between(
        [], [], color=GROWING, hatch="////", ec="black", linewidth=0, label=r"$|\theta|$ grows"
    )
    if not math.isnan(keel.onset.limit):
        limit = math.degrees(keel.onset.limit)
        axes.axvspan(-limit, limit, color="0.93", zorder=0, label=r"$|\varphi| \leq \varphi_s$")
    axes.set(xlim=(-90, 90), xticks=range(-90, 91, 30))
