"""Figures of the bifurcation at which the dyad's corner ceases to be a minimum."""

import math
from collections.abc import Iterable, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.statics.critical import Branch, branches, critical_rod_radius
from polycorner.dumbbells.statics.minima import paper_heading
from polycorner.toolkit import BODIES, SHADES, Array, checked, instance, real, refuse

CORNER_COLOUR, PASS_COLOUR, ENDS_COLOUR = (*BODIES, SHADES[-1])
SAMPLES = 60
BESIDE = 1e-7  # distance from the critical radius, in ball radii, at which branches are cut


@checked
def draw_bifurcation(pair: DumbbellPair, rods: tuple[float, float] | None = None) -> Figure:
    """Draw heading, ball-rod gap and energy of corner and pass against the rod radius.

    Minima are full lines, saddles dashed; dotted is the corner where it is stationary on its face
    only, multipliers being negative.  ``rods`` is the range in mm, by default from 0.3 to 1 ball
    radius.
    """
    r = pair.ball_radius
    low, high = (0.3 * r, 0.9995 * r) if rods is None else rods
    if not 0 < low < high < r:
        refuse("rods", f"two increasing radii > 0 and < {r:g} mm", rods)
    found = critical_rod_radius(pair)
    critical = [found] if found is not None and low < found < high else []
    cuts = [side for t in critical for side in (t - BESIDE * r, t + BESIDE * r)]
    spans = zip([low, *cuts[1::2]], [*cuts[::2], high], strict=True)
    parts = [branches(pair, np.linspace(start, end, SAMPLES)) for start, end in spans]
    figure = Figure(figsize=(11, 3.9), layout="constrained")
    panels: Sequence[Axes] = figure.subplots(1, 3)
    for axes, name in zip(panels, ("headings", "gaps", "energies"), strict=True):
        for corner, over in parts:
            _draw_branch(axes, over, name, PASS_COLOUR)
            _draw_branch(axes, corner, name, CORNER_COLOUR, unheld=True)
        for t in critical:
            axes.axvline(t, color="0.8", linewidth=0.8, zorder=0)
        axes.set(xlabel="rod radius t (mm)", xlim=(low, high))
    _finish_heading(panels[0], pair, critical)
    _finish_gap(panels[1])
    _finish_energy(panels[2], pair, parts[0])
    where = "the plane" if pair.is_plane else f"a drum of radius {pair.drum_radius:g} mm"
    at = f"; critical t = {critical[0]:.4f} mm" if critical else ""
    figure.suptitle(f"Right-handed dyad, l = {pair.length:g}, r = {r:g} mm, in {where}{at}")
    return figure


def _draw_branch(
    axes: Axes, branch: Branch, name: str, colour: str, *, unheld: bool = False
) -> None:
    values: Array = getattr(branch, name)
    saddle = branch.equilibrium & ~branch.minimum
    lines = [(branch.minimum, "-"), (saddle, "--"), (~branch.equilibrium & unheld, ":")]
    for kept, style in lines:
        axes.plot(branch.rods, np.where(kept, values, np.nan), style, color=colour, linewidth=1.8)


def _finish_heading(axes: Axes, pair: DumbbellPair, critical: Sequence[float]) -> None:
    paper = paper_heading(pair)
    axes.axhline(paper, color="0.55", linewidth=0.8, zorder=0)
    axes.axhline(0, color=ENDS_COLOUR, linewidth=1.8)
    axes.set(ylabel="heading (degrees)", title="(a) heading", ylim=(-0.05 * paper, 1.3 * paper))
    _note(axes, 0.02, paper, "paper, arctan(r/l)", "0.4", below=True)
    _note(axes, 0.02, 0.0, "end to end, G", ENDS_COLOUR)
    for t in critical:
        arrow = {"arrowstyle": "->", "color": "0.3", "shrinkA": 0, "shrinkB": 2}
        axes.annotate("", (t, 0.0), xytext=(t, 0.97 * paper), arrowprops=arrow)
        axes.annotate(
            "falls apart",
            (t, 0.4 * paper),
            xytext=(-4, 0),
            textcoords="offset points",
            ha="right",
            fontsize=8,
            color="0.3",
        )
    axes.plot([], [], "-", color=CORNER_COLOUR, label="corner: minimum")
    axes.plot([], [], ":", color=CORNER_COLOUR, label="corner: negative multipliers")
    axes.plot([], [], "--", color=PASS_COLOUR, label="pass: saddle")
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(0.0, 0.32))


def _finish_gap(axes: Axes) -> None:
    bottom = -0.12 * axes.get_ylim()[1]
    axes.axhspan(bottom, 0, color="0.93", zorder=0)
    _note(axes, 0.02, 0.0, "overlap", "0.4", below=True)
    axes.set(ylabel="gap between ball and rod (mm)", title="(b) contacts A2b, aB1")
    axes.set_ylim(bottom=bottom)


def _finish_energy(axes: Axes, pair: DumbbellPair, thin: tuple[Branch, Branch]) -> None:
    corner, over = thin
    k = int(0.25 * len(corner.rods))
    place, rest, top = corner.rods[k], corner.energies[k], over.energies[k]
    axes.annotate(
        "",
        (place, top),
        xytext=(place, rest),
        arrowprops={"arrowstyle": "<->", "color": "0.3", "shrinkA": 0, "shrinkB": 0},
    )
    unit = "mm²" if pair.is_plane else "mm"
    axes.annotate(
        f"barrier {top - rest:.3g} {unit}",
        (place, rest + 0.8 * (top - rest)),
        xytext=(4, 0),
        textcoords="offset points",
        fontsize=8,
        color="0.3",
        va="top",
    )
    axes.set(ylabel=f"energy above G, in ball weights × {unit}", title="(c) energy")
    if pair.is_plane:
        axes.set_ylabel("trough energy (mm²)")


def _note(
    axes: Axes, share: float, height: float, text: str, colour: str, *, below: bool = False
) -> None:
    """Write a text above or below a horizontal line, at a fraction of the panel's width."""
    axes.annotate(
        text,
        (share, height),
        xycoords=("axes fraction", "data"),
        xytext=(0, -3 if below else 3),
        textcoords="offset points",
        va="top" if below else "bottom",
        fontsize=8,
        color=colour,
    )


@checked
def draw_critical(
    ball_radius: float,
    drums: Sequence[float] = (math.inf,),
    *,
    longest: float = 10.0,
    pairs: Iterable[DumbbellPair] = (),
) -> Figure:
    """Draw the critical rod radius against length, both in ball radii, for several drums.

    The full line is ``2 sqrt(1 - (r/l)^2) - 1``; every marker is a critical radius computed in a
    drum of that radius (in mm; ``inf`` is the plane).  Left of the dashed line the corner is not in
    ``D``: a ball touches both balls of the other dumbbell before it reaches the rod.  ``pairs`` are
    marked with stars.
    """
    real("ball_radius", ball_radius, above=0, unit="mm")
    real("longest", longest, above=3)
    if math.isinf(longest * ball_radius):
        refuse("longest", f"a finite length, in units of ball_radius = {ball_radius:g} mm", longest)
    for drum in drums:
        real("drums", drum, above=ball_radius, infinite=True, unit="mm")
    pairs = [instance("pairs", pair, DumbbellPair) for pair in pairs]
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.add_subplot()
    lengths = np.linspace(2.0, longest, 400)
    exact = 2 * np.sqrt(1 - 1 / lengths**2) - 1
    least = np.sqrt(np.maximum(4 - lengths**2 / 4, 1.0)) - 1
    axes.fill_between(lengths, least, exact, color=CORNER_COLOUR, alpha=0.13, linewidth=0)
    axes.plot(lengths, exact, color="black", linewidth=1.5, label="2 √(1 − r²/l²) − 1")
    axes.plot(lengths, np.where(least > 0, least, np.nan), "--", color="0.4", linewidth=1.2)
    # Markers of different drums are staggered, since their critical radii nearly coincide.
    places = np.linspace(2.15, longest - 1, 8)
    styles = zip(drums, cycle(SHADES), cycle("o^sDv"), strict=False)
    for k, (drum, colour, marker) in enumerate(styles):
        shares = [_critical_share(ball_radius, x, drum) for x in places + 0.15 * k]
        label = "plane" if math.isinf(drum) else f"drum, R = {drum / ball_radius:.3g} r"
        axes.plot(places + 0.15 * k, shares, marker, color=colour, linestyle="", label=label)
    for pair in pairs:
        r = pair.ball_radius
        axes.plot(pair.length / r, pair.rod_radius / r, "*", color="black", markersize=11)
        axes.annotate(
            f"l = {pair.length:g}, r = {r:g}, t = {pair.rod_radius:g} mm",
            (pair.length / r, pair.rod_radius / r),
            xytext=(8, -3),
            textcoords="offset points",
            fontsize=8,
        )
    axes.set(xlim=(2, longest), ylim=(0, 1.08), xlabel="length l / r", ylabel="rod radius t / r")
    axes.text(0.62 * longest, 0.7, "the corner is a minimum", ha="center")
    axes.text(2.06, 1.0, "the pair falls apart", fontsize=9)
    axes.text(2.08, 0.12, "corner\nnot in D", fontsize=9)
    axes.legend(frameon=False, loc="lower right", fontsize=9)
    axes.set_title("Where the corner of a dyad stops being a minimum")
    return figure


def _critical_share(ball_radius: float, length: float, drum: float) -> float:
    """Return the critical rod radius for a length, both in ball radii; nan where there is none."""
    if length * ball_radius > 2 * (drum - ball_radius):
        return math.nan
    pair = DumbbellPair(length * ball_radius, ball_radius, ball_radius / 2, drum)
    found = critical_rod_radius(pair)
    return math.nan if found is None else found / ball_radius
