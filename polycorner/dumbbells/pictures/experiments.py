"""Figures of experiments in the drum: headings of dyads, what turns them, climbing, exits, keel."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import KINDS, BunchRun
from polycorner.dumbbells.dynamics.dyads import Steady, heading_at_shift
from polycorner.dumbbells.dynamics.singles import Zigzag
from polycorner.dumbbells.statics.keel import Keel, RestRegion, net_torque, s_curve
from polycorner.toolkit import SHADES, Array, checked, refuse

if TYPE_CHECKING:
    import xarray as xr

COLOURS = {"right": "#0072B2", "left": "#009E73", "single": "#8A6D3B"}
MINIMISER, PAPER, OTHER_END = "#333333", "#C1272D", "#7B3294"
TILTED, LEVEL = "#0072B2", "#E69F00"


@checked
def draw_steady_headings(found: Sequence[Steady]) -> Figure:
    """Draw steady headings and shifts of right-handed pairs against length.

    First panel: means with twice their standard errors, filled for a tilted and open for a level
    drum; the energy's minimiser, ``arctan(r/l)``, and the heading of least energy at the other end
    of the edge along the rods.  Second panel: the shift along the axis, between the ends of that
    edge.
    """
    if not found:
        refuse("found", "at least one", found)
    figure, drum = Figure(figsize=(12.5, 5.6), layout="constrained"), found[0].drum
    first, second = figure.subplots(1, 2)
    lengths = np.array([one.drum.length for one in found])
    span = np.linspace(lengths.min() - 1, lengths.max() + 1, 200)
    p = drum.ball_radius + drum.rod_radius
    waist = float(np.sqrt(4 * drum.ball_radius**2 - p**2))
    first.plot(span, np.degrees(np.arctan2(drum.ball_radius, span)), color=PAPER, ls="--")
    first.plot(span, _at_shift(drum, span, span - waist), color=MINIMISER)
    first.plot(span, _at_shift(drum, span, np.full_like(span, waist)), color=OTHER_END, ls=":")
    second.plot(span, span - waist, color=MINIMISER, label="inner balls touch: the corner δ")
    second.plot(
        span, np.full_like(span, waist), color=OTHER_END, ls=":", label="balls side by side"
    )
    _points(first, found, "heading")
    _points(second, found, "shift")
    curves = ("arctan(r/l)", "least energy (plane)", "least energy, balls side by side")
    for line, label in zip(first.lines[:3], curves, strict=True):
        line.set_label(label)
    chatters = sorted({one.chatter for one in found})
    noise = ", ".join(f"{value:g}" for value in chatters)
    first.set(title="(a) heading", ylabel="heading of right-handed pairs (degrees)", ylim=(0, None))
    second.set(title="(b) shift along the axis", ylabel="shift (mm)", ylim=(0, None))
    for axes in (first, second):
        axes.set_xlabel("length l (mm)")
        axes.legend(fontsize=9)
    figure.suptitle(
        f"Driven pairs, r = {drum.ball_radius:g} mm, t = {drum.rod_radius:g} mm, "
        f"R = {drum.drum_radius:g} mm;  chatter {noise};  bars: two standard errors"
    )
    return figure


def _at_shift(drum: DumbbellDrum, lengths: Array, shifts: Array) -> Array:
    pairs = zip(lengths, shifts, strict=True)
    return np.array([heading_at_shift(replace(drum, length=float(x)), float(s)) for x, s in pairs])


def _points(axes: Axes, found: Sequence[Steady], what: str) -> None:
    for tilted in (True, False):
        some = [one for one in found if (one.drum.tilt != 0) == tilted]
        if not some:
            continue
        means = [getattr(one, what) for one in some]
        axes.errorbar(
            [one.drum.length for one in some],
            [mean.value for mean in means],
            yerr=[2 * mean.error for mean in means],
            fmt="o" if tilted else "s",
            color=TILTED if tilted else LEVEL,
            mfc=TILTED if tilted else "white",
            capsize=3,
            label=f"simulated, tilt {np.degrees(some[0].drum.tilt):.3g}°",
        )


def draw_balance(found: "xr.Dataset") -> Figure:
    """Draw how fast pairs turn against their heading, a panel for each hand, with the prediction.

    Of the study ``turning`` over ``heading``, ``part``, ``hand`` and ``strength``: rates under all
    kicks with twice their standard errors; dotted, those under rolling kicks alone; solid, these
    plus the rate due to the weight, from single dumbbells under all kicks.
    """
    figure = Figure(figsize=(12.5, 5.2), layout="constrained")
    panels = np.atleast_1d(figure.subplots(1, found.sizes["hand"], sharey=True))
    for axes, hand in zip(panels, found["hand"].values.tolist(), strict=True):
        for colour, strength in zip(SHADES, found["strength"].values.tolist(), strict=False):
            one = found.sel(hand=hand, strength=strength)
            both, rolling = one.sel(part="all"), one.sel(part="rolling")
            x, bars = both["at"].values, 2 * both["rate_error"].values
            axes.errorbar(x, both["rate"].values, bars, fmt="o", ms=5, color=colour, capsize=3)
            alone = np.interp(x, rolling["at"].values, rolling["rate"].values)
            axes.plot(rolling["at"].values, rolling["rate"].values, ":", color=colour, lw=1.2)
            predicted = alone + both["weight"].values
            axes.plot(x, predicted, "-", color=colour, label=f"strength {strength:g}")
        axes.axhline(0, color="0.8", lw=0.8, zorder=0)
        axes.set(title=f"{hand}-handed pairs", xlabel="heading, away from zero (degrees)")
    panels[0].set_ylabel("rate of the heading (degrees/s)")
    panels[0].plot([], [], "k:", lw=1.2, label="rolling kicks alone")
    panels[0].plot([], [], "k-", label="and the weight: predicted")
    panels[0].plot([], [], "ko", ms=5, label="all kicks")
    panels[0].legend(fontsize=9, frameon=False)
    return figure


@checked
def draw_climbing(
    zigzags: Sequence[Zigzag], drum: DumbbellDrum, found: Sequence[Steady] = ()
) -> Figure:
    """Draw climb rates of single dumbbells and driven pairs against headings, with the law.

    The law of a perfect keel is ``omega rho tan(theta)``.
    """
    figure = Figure(figsize=(7.5, 5.4), layout="constrained")
    axes = figure.subplots()
    headings = [float(np.degrees(one.heading.mean())) for one in zigzags]
    reach = max([1.0, *np.abs(headings), *(abs(one.heading.value) for one in found)])
    span = np.linspace(-1.05 * reach, 1.05 * reach, 300)
    law = drum.spin * drum.centre_radius * np.tan(np.radians(span))
    axes.plot(span, law, color=MINIMISER, label="ω ρ tan θ")
    rates = [one.climb_rate for one in zigzags]
    axes.plot(headings, rates, "o", color=TILTED, label="single dumbbells, no noise")
    for level in (False, True):
        some = [one for one in found if (one.drum.tilt == 0) == level]
        if some:
            axes.errorbar(
                [one.heading.value for one in some],
                [one.climb_rate.value for one in some],
                xerr=[2 * one.heading.error for one in some],
                yerr=[2 * one.climb_rate.error for one in some],
                fmt="s" if level else "D",
                color=LEVEL if level else COLOURS["left"],
                capsize=3,
                label=f"right-handed pairs with noise, tilt {np.degrees(some[0].drum.tilt):.3g}°",
            )
    axes.axhline(0, color="0.8", linewidth=0.7, zorder=0.5)
    axes.set(xlabel="heading θ (degrees)", ylabel="climb rate (mm/s)")
    axes.legend(fontsize=9)
    return figure


@checked
def draw_exits(runs: Mapping[str, BunchRun]) -> Figure:
    """Draw the cumulative exits of each named bunch by kind, against time.

    Below: the numbers in right and left dyads and of single dumbbells in the drum.
    """
    if not runs:
        refuse("runs", "at least one", runs)
    figure = Figure(figsize=(6.2 * len(runs), 7.2), layout="constrained")
    grid = figure.subplots(2, len(runs), squeeze=False)
    for (above, below), (name, one) in zip(grid.T, runs.items(), strict=True):
        for kind in KINDS:
            left = [t for (t, _), k in zip(one.exits, one.exit_kinds, strict=True) if k == kind]
            times, counts = [0.0, *left, float(one.times[-1])], [*range(len(left) + 1), len(left)]
            above.step(times, counts, where="post", color=COLOURS[kind], label=kind)
        above.set(title=name, ylabel="have left", xlabel="time (s)")
        above.set_ylim(0, max(1.0, 1.05 * len(one.exits)))
        chosen = np.unique(np.linspace(0, len(one.times) - 1, 80).round().astype(int))
        census = [one.census(int(index)) for index in chosen]
        for kind in KINDS:
            numbers = [entry[kind] for entry in census]
            below.plot(one.times[chosen], numbers, color=COLOURS[kind], label=kind)
        below.set(ylabel="in the drum", xlabel="time (s)", ylim=(0, one.drum.count))
        above.legend(fontsize=9)
    return figure


# ---------------------------------------------------------------------------------- the keel effect

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
