"""The drum unrolled: heights, flow lines of gravity, and the zigzags of single dumbbells."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Rectangle

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from polycorner.dumbbells.dynamics.singles import keel_of
from polycorner.dumbbells.statics.keel import Turning

DRUM = style.DRUM
RHO = DRUM.centre_radius  # radius of the cylinder of ball centres
LONG = 300.0  # mm, length of the drum as drawn
HEADING = 12.0  # degrees, heading of the zigzags
START = 150.0  # mm, axial position at which they begin
STEP = 20.0  # mm between level curves
NEAR = (-4.0, 10.0, 21.0)  # second panel: least and largest azimuth (degrees), mm up and down
COLOURS = {1: style.RIGHT[0], -1: style.LEFT[0]}


def height(phi: Any, eta: Any) -> Any:
    """Return ``z = eta sin(alpha) - rho cos(alpha) cos(phi)`` in mm."""
    return eta * math.sin(DRUM.tilt) - RHO * math.cos(DRUM.tilt) * np.cos(phi)


def flow_line(phi: float, fall: Any) -> Any:
    """Return the azimuth of a flow line of ``-grad z`` that has come down the axis by ``fall`` mm.

    ``d phi / d eta = sin(phi) / (rho tan alpha)`` is solved by ``tan(phi/2)`` times an exponential.
    """
    decay = np.exp(-np.asarray(fall) / (RHO * math.tan(DRUM.tilt)))
    return 2 * np.arctan(math.tan(phi / 2) * decay)


def turning(sign: int) -> Turning:
    """Return the turning points of a single dumbbell of heading ``HEADING`` times a sign."""
    return keel_of(DRUM).turning(math.radians(sign * HEADING))


def zigzag(sign: int, rise: float) -> Any:
    """Return a path of azimuths and axial positions ``(k, 2)`` that ends ``rise`` mm away.

    The dumbbell is carried along a latitude from its stop to the onset of rolling, then rolls back
    across its axis; the path begins on the lowest line.
    """
    found = turning(sign)
    gain = RHO * math.tan(math.radians(sign * HEADING)) * (found.upper - found.coasting)
    path = [[0.0, 0.0]]
    while abs(path[-1][1]) < rise:
        eta = path[-1][1]
        path += [[found.upper, eta], [found.coasting, eta + gain]]
    return np.array(path) + np.array([0.0, START])


@style.styled()
def draw_flow_lines() -> Drawing:
    """Draw the lower half of the drum, and its middle enlarged."""
    figure = style.canvas(style.WIDE, 4.15)
    left, right = figure.subplots(1, 2, width_ratios=[1.83, 1])
    west, east, reach = NEAR
    _draw_field(left, (-90.0, 90.0), (0.0, LONG), np.arange(0.0, LONG + 240, 25.0), 89.0)
    near = (START - reach, START + reach)
    _draw_field(right, (west, east), near, START + np.arange(-reach, 120.0, 6.0), 40.0)
    _draw_zigzags(left, LONG, 0.5)
    _draw_zigzags(right, reach - 1.0, 1.4)
    box: dict[str, Any] = {"fill": False, "ec": "0.1", "lw": 0.9, "zorder": 5}
    left.add_patch(Rectangle((west, START - reach), east - west, 2 * reach, **box))
    left.set_xticks(range(-90, 91, 30))
    left.set_ylabel(r"axial position $\eta$ (mm)")
    for axes in (left, right):
        axes.set_xlabel(r"azimuth $\varphi$ (degrees)")
        axes.set_aspect(1 / (RHO * math.radians(1)))
    style.letter(left, "a", "the lower half of the drum")
    style.letter(right, "b", "the framed part")
    handles = [
        *right.plot([], [], color=style.FAINT, lw=0.9, label="equal height"),
        *right.plot([], [], color=style.GRAVITY, lw=0.9, label=r"flow of $-\mathrm{grad}\,z$"),
        *right.plot([], [], color=COLOURS[1], label=rf"$\theta = +{HEADING:g}°$"),
        *right.plot([], [], color=COLOURS[-1], label=rf"$\theta = -{HEADING:g}°$"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure


def _draw_field(
    axes: Axes, azimuths: tuple[float, float], span: tuple[float, float], tops: Any, edge: float
) -> None:
    """Draw level curves, and flow lines that begin at azimuths ``edge`` and heights ``tops``."""
    phi, eta = np.linspace(*azimuths, 241), np.linspace(*span, 241)
    z = height(np.radians(phi), eta[:, None])
    step = STEP if np.ptp(z) > 3 * STEP else STEP / 20
    levels = step * np.arange(math.floor(z.min() / step), math.ceil(z.max() / step))
    shown: dict[str, Any] = {
        "colors": style.FAINT,
        "linewidths": 0.9,
        "linestyles": "solid",
        "zorder": 1,
    }
    axes.contour(phi, eta, z, levels=levels, **shown)
    fall = np.linspace(0.0, 300.0, 1201)
    for top in tops:
        for side in (-1, 1):
            line = side * np.degrees(flow_line(math.radians(edge), fall))
            line[abs(line) < (azimuths[1] - azimuths[0]) / 75] = np.nan  # where lines would merge
            axes.plot(line, top - fall, color=style.GRAVITY, lw=0.7, zorder=2)
    axes.plot([0, 0], span, color=style.GRAVITY, lw=0.9, zorder=2)
    axes.set(xlim=azimuths, ylim=span)


def _draw_zigzags(axes: Axes, rise: float, width: float) -> None:
    for sign, colour in COLOURS.items():
        path = zigzag(sign, rise)
        axes.plot(np.degrees(path[:, 0]), path[:, 1], color=colour, lw=width, zorder=4)
    axes.plot(0.0, START, "o", color="0.1", ms=1.5 + 1.8 * width, zorder=4.5)


def _caption() -> str:
    up, down = turning(1), turning(-1)
    widths = [math.degrees(one.upper - one.coasting) for one in (up, down)]
    gain = RHO * math.tan(math.radians(HEADING)) * (up.upper - up.coasting)
    return (
        "The wall of the drum unrolled, both axes at the same scale in mm, on the cylinder of "
        f"the centres of the balls, ρ = R − r = {RHO:g} mm; α = {math.degrees(DRUM.tilt):g}°. "
        f"Grey: curves of equal height, every {STEP:g} mm in (a) and {STEP / 20:g} mm in (b). "
        "Vermilion: flow lines of −grad z, which cross them at right angles and come down to the "
        f"lowest line within a few times ρ tan α = {RHO * math.tan(DRUM.tilt):.1f} mm. Zigzags of "
        f"single dumbbells with constant headings ±{HEADING:g}°: carried to φ = "
        f"{math.degrees(up.upper):.2f}° and {math.degrees(down.upper):.2f}°, they roll back by "
        f"{widths[0]:.2f}° and {widths[1]:.2f}°, so that each zigzag changes η by {gain:.2f} mm; "
        f"computed from the law of friction with inertia, {style.friction(DRUM)}, and drawn to "
        "scale."
    )


FLOW_LINES = Figure(
    "flow_lines",
    "Flow lines of gravity and zigzags",
    _caption,
    "Two panels with azimuth to the right and position along the drum's axis upwards. Level curves "
    "are arches, lowest on the middle line. Flow lines come from both edges, nearly level at "
    "first, and bend down to join the vertical middle line, steeply. Enlarged, two zigzags start "
    "from one point: that of positive heading runs right along a level line, then rolls back left "
    "and slightly up, again and again, and climbs; that of negative heading does the same "
    "downwards, a little further to the left.",
    draw_flow_lines,
)
FIGURES = (FLOW_LINES,)
