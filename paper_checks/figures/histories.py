"""Histories of single dumbbells and of dyads in the turning drum, simulated."""

import math
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from paper_checks.figures.style import minus
from polycorner.dumbbells.dynamics.dyads import DyadPaths, follow_dyads
from polycorner.dumbbells.dynamics.singles import Zigzag, follow, zigzags
from polycorner.dumbbells.pair import Chirality
from polycorner.motion import Noise, Trajectory

STEP = 2e-3  # s
EARLY = 60.0  # s, duration shown enlarged
LONG = 240.0  # s, whole duration
NOISE = Noise(chatter=0.275, correlation_time=0.05, seed=2)
SINGLES = (15.0, -15.0)  # headings in degrees
DYADS: tuple[tuple[Chirality, float], ...]  # and the heading in degrees
DYADS = (("R", 10.0), ("R", -8.0), ("L", 8.0), ("L", -10.0))
PANELS = (
    r"azimuth $\varphi$ (degrees)",
    r"position $\eta - \eta_0$ (mm)",
    r"heading $\theta$ (degrees)",
)
DARK, LIGHT = 0, 1
SMALL = {"ncols": 4, "fontsize": 8.5, "columnspacing": 0.9, "handlelength": 1.1, "borderpad": 0.2}


@cache
def singles() -> Trajectory:
    """Return the motion of two single dumbbells of opposite headings, far apart."""
    headings = np.radians(SINGLES)
    return follow(style.SHORT_DRUM, headings, LONG, noise=NOISE, dt=STEP)


@cache
def quiet() -> Trajectory:
    """Return the early motion of the first of them without noise."""
    return follow(style.SHORT_DRUM, math.radians(SINGLES[0]), EARLY, dt=STEP)


@cache
def dyads() -> DyadPaths:
    """Return the motion of four dyads, far apart: two of either chirality."""
    starts = [(hand, math.radians(heading)) for hand, heading in DYADS]
    return follow_dyads(style.DRUM, starts, LONG, noise=NOISE, dt=STEP)


def shown(q: Any) -> tuple[Any, Any, Any]:
    """Return azimuth and heading in degrees and the rise along the axis in mm of ``(T, ...)``."""
    return np.degrees(q[..., 0]), q[..., 1] - q[0, ..., 1], np.degrees(q[..., 2])


# ----------------------------------------------------------------------------------- single


@style.styled()
def draw_single_history() -> Drawing:
    """Draw the early motion of one dumbbell, and the whole motion of both."""
    path = singles()
    figure = style.canvas(style.WIDE, 4.7)
    grid = figure.add_gridspec(6, 2, width_ratios=[1, 1.05])
    left = [figure.add_subplot(grid[2 * k : 2 * k + 2, 0]) for k in range(3)]
    right = [figure.add_subplot(grid[3 * k : 3 * k + 3, 1]) for k in range(2)]
    early = path.times <= EARLY
    curves, calm = shown(path.q), quiet()
    for axes, values, still, words in zip(left, curves, shown(calm.q), PANELS, strict=True):
        axes.plot(calm.times, still[:, 0], color=style.RIGHT[LIGHT], lw=0.9, label="no noise")
        axes.plot(path.times[early], values[early, 0], color=style.RIGHT[DARK], label="noise")
        axes.set_ylabel(words)
    for axes, values, words in zip(right, curves[1:], PANELS[1:], strict=True):
        for body, colours in enumerate((style.RIGHT, style.LEFT)):
            label = rf"$\theta_0 = {SINGLES[body]:+g}°$"
            axes.plot(path.times, values[:, body], color=colours[DARK], lw=1.0, label=label)
        axes.set_ylabel(words)
    _finish(left, EARLY, "abc")
    _finish(right, LONG, "de")
    left[0].legend(loc="upper right", **SMALL)
    right[1].legend(loc="upper right", **SMALL)
    return figure


def _finish(panels: list[Axes], until: float, letters: str) -> None:
    """Give the panels letters, space for a legend, and a common time axis."""
    for axes, name in zip(panels, letters, strict=True):
        style.grid(axes)
        low, high = axes.get_ylim()
        room = 0.16 if len(panels) == 2 else 0.24
        axes.set(xlim=(0, until), ylim=(low, high + room * (high - low)))
        place: dict[str, Any] = {
            "xy": (0, 1),
            "xycoords": "axes fraction",
            "textcoords": "offset points",
        }
        axes.annotate(rf"$\bf({name})$", xytext=(5, -5), va="top", **place)
        axes.tick_params(labelbottom=axes is panels[-1])
    panels[-1].set_xlabel("time (s)")
    panels[0].figure.align_ylabels(panels)


def early_slips(path: Trajectory) -> Zigzag:
    """Return the slips of the first dumbbell that end within the early motion."""
    found = zigzags(path, style.SHORT_DRUM.spin)[0]
    early = found.stops <= EARLY
    kept = {name: values[early] for name, values in vars(found).items()}
    return Zigzag(**kept)


def noise() -> str:
    """Return the noise in words."""
    return (
        f"the loads on the balls chatter with amplitude {NOISE.chatter:g}, drawn anew every "
        f"{NOISE.correlation_time:g} s (seed {NOISE.seed}); step {1e3 * STEP:g} ms. Noise, its "
        "seed and the dynamic coefficients are chosen so that motions look like those observed; "
        "the paper does not give them"
    )


def _single_caption() -> str:
    path, drum = singles(), style.SHORT_DRUM
    calm = np.degrees(zigzags(quiet(), drum.spin)[0].width)
    slips = early_slips(path)
    widths = np.degrees(slips.width)
    _, rise, heading = shown(path.q)
    top = int(np.argmax(rise[:, 0]))
    return minus(
        f"Simulated single dumbbells, {style.sizes(drum)}, in a drum tilted by "
        f"{math.degrees(drum.tilt):g}° that turns with {drum.spin:g} rad/s; "
        f"{style.friction(drum)}; {noise()}. (a)–(c) The first {EARLY:g} s of one with an initial "
        f"heading of {SINGLES[0]:+g}°. Without noise (light) zigzags are {calm.mean():.2f}° wide "
        f"and the heading stays; with noise (dark) {len(slips)} slips are {widths.mean():.1f}° "
        f"wide in the mean and {widths.max():.1f}° at most, and the heading changes in them. (d), "
        f"(e) The same dumbbell for {LONG:g} s (blue) and one that starts with {SINGLES[1]:+g}° "
        f"(green): at the end headings are {heading[-1, 0]:+.1f}° and {heading[-1, 1]:+.1f}°; the "
        f"first has climbed by {rise[top, 0]:.1f} mm after {path.times[top]:.0f} s and then comes "
        f"down, the second ends {rise[-1, 1]:+.1f} mm from its start."
    )


def _single_alt() -> str:
    _, rise, heading = shown(singles().q)
    return minus(
        "Five panels against time. Azimuth of a single dumbbell: a regular saw-tooth of slow "
        "rises and almost vertical drops without noise, a smaller and irregular one with it. Its "
        "position along the axis rises in steps at the drops; its heading is constant without "
        "noise, and with it changes at the drops and falls. In the long run the positive heading "
        f"falls and the negative one rises to near zero, {heading[-1, 0]:.1f} and "
        f"{heading[-1, 1]:.1f} degrees; the dumbbell that started positive climbs, turns round "
        f"and ends at {rise[-1, 0]:.0f} mm, the other descends and is at {rise[-1, 1]:.0f} mm."
    )


# ------------------------------------------------------------------------------------- dyad


@style.styled()
def draw_dyad_history() -> Drawing:
    """Draw dyads of either hand and a pair without, early motion of one, and four histories."""
    paths = dyads()
    figure = style.canvas(style.WIDE, 4.9)
    grid = figure.add_gridspec(6, 3, width_ratios=[0.44, 1, 1])
    pictures = [figure.add_subplot(grid[2 * k : 2 * k + 2, 0]) for k in range(3)]
    left = [figure.add_subplot(grid[2 * k : 2 * k + 2, 1]) for k in range(3)]
    right = [figure.add_subplot(grid[3 * k : 3 * k + 3, 2]) for k in range(2)]
    _draw_kinds(pictures)
    early = paths.times <= EARLY
    azimuth, _, heading = shown(paths.q[:, 0])
    one = (azimuth, paths.q[:, 0, :, 1] - paths.eta[0, 0], heading)
    for axes, values, words in zip(left, one, PANELS, strict=True):
        for body, colour in enumerate(style.RIGHT):
            label = "AB"[body]
            axes.plot(paths.times[early], values[early, body], color=colour, lw=1.0, label=label)
        mean = values[early].mean(axis=1)
        axes.plot(paths.times[early], mean, color="black", lw=1.0, label="average")
        axes.set_ylabel(words)
    left[0].legend(loc="upper right", **SMALL)
    for axes, values, words in zip(
        right, (paths.eta - paths.eta[0], np.degrees(paths.heading)), PANELS[1:], strict=True
    ):
        for k, (hand, heading) in enumerate(DYADS):
            colour = style.HANDS[hand][DARK if heading * (1 if hand == "R" else -1) > 0 else LIGHT]
            axes.plot(
                paths.times,
                values[:, k],
                color=colour,
                lw=1.0,
                label=f"{hand} {heading:+g}°".replace("-", "−"),
            )
        axes.set_ylabel(words)
    _finish(left, EARLY, "bcd")
    _finish(right, LONG, "ef")
    right[0].legend(loc="lower left", **(SMALL | {"ncols": 2}))
    return figure


def _draw_kinds(panels: list[Axes]) -> None:
    """Draw a dyad of either hand at the corner, and two dumbbells side by side."""
    pair = style.PAIR
    kinds = (
        ("R", pair.nested("R", clearance=0.0)),
        ("L", pair.nested("L", clearance=0.0)),
        (None, pair.side_by_side()),
    )
    words = ("R", "L", "NC")
    for axes, (hand, q), name in zip(panels, kinds, words, strict=True):
        centres = pair.developed(q)
        centres = centres - centres.mean(axis=0)
        style.draw_pair(axes, pair, centres, style.HANDS[hand])
        axes.axvline(0, color=style.FAINT, lw=0.7, ls=(0, (3, 2)), zorder=0)
        style.bare(axes)
        axes.set(xlim=(-8.5, 8.5), ylim=(-18, 18))
        axes.text(-8.5, 12.5, name, fontsize=11.5, color=style.HANDS[hand][DARK])
    panels[0].set_title(r"$\bf(a)$", loc="left")


def _dyad_caption() -> str:
    paths, drum = dyads(), style.DRUM
    end = np.degrees(paths.heading[-1])
    rise = paths.eta[-1] - paths.eta[0]
    ends = "; ".join(
        f"{hand} from {start:+g}°: {now:+.1f}°, {up:+.1f} mm"
        for (hand, start), now, up in zip(DYADS, end, rise, strict=True)
    )
    held = int(np.isinf(paths.lifetimes).sum())
    return minus(
        "(a) A right-handed dyad (R), a left-handed one (L) and a pair without chirality (NC) in "
        "the developed wall, the drum's axis (dashed) upwards. Simulated dyads, "
        f"{style.sizes(drum)}, α = {math.degrees(drum.tilt):g}°, ω = {drum.spin:g} rad/s, "
        f"{style.friction(drum)}, between dumbbells {drum.rubbing[0]:g}; {noise()}. (b)–(d) The "
        f"first {EARLY:g} s of a right-handed dyad from θ = {DYADS[0][1]:+g}°: both dumbbells and "
        f"their average. (e), (f) Averages of four dyads for {LONG:g} s, two of either hand and "
        f"of either initial sign. At the end, heading and rise: {ends}. {held} of {len(DYADS)} "
        "hold together to the end. Headings drift towards the sign that goes with the hand; "
        "unlike those of the experiment they do not settle at a common value in this time."
    )


def _dyad_alt() -> str:
    paths = dyads()
    rise = paths.eta[-1] - paths.eta[0]
    return minus(
        "Left: a right-handed dyad, its mirror image, and two dumbbells side by side. Middle: "
        "azimuth, position and heading of a right-handed dyad; both dumbbells rise and drop in "
        "azimuth together in a saw-tooth, their positions climb in parallel steps and their "
        "headings stay close. Right: of four dyads, the right-handed headings drift to positive "
        "values and the left-handed ones to negative values, also from the wrong sign; positions "
        "at the end are "
        + ", ".join(
            f"{value:+.0f} mm for {hand} from {start:+g} degrees"
            for (hand, start), value in zip(DYADS, rise, strict=True)
        )
        + "."
    )


FIGURES = (
    Figure(
        "single_history",
        "Single dumbbells lose their heading",
        _single_caption,
        _single_alt,
        draw_single_history,
        slow=True,
    ),
    Figure(
        "dyad_history",
        "Dyads and their histories",
        _dyad_caption,
        _dyad_alt,
        draw_dyad_history,
        slow=True,
    ),
)
