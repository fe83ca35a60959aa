"""The heading of a dyad against its length: computed, in closed form, as stated, as observed."""

from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from polycorner.dumbbells import heading_curve, plane_heading_formula
from polycorner.dumbbells.pair import Chirality

PAIR = style.PAIR
LENGTHS = np.linspace(8.0, 30.0, 23)  # mm
# Numbers in the paper's text: for l = 16 mm the heading is about 15 degrees, and a dyad keeps it
# to within 2 degrees.  The points of the paper's figure are not given as numbers.
OBSERVED = (16.0, 15.0, 2.0)


@cache
def computed(hand: Chirality) -> Any:
    """Return headings in degrees of the certified minimisers in the drum; nan if there is none."""
    headings, rests = heading_curve(PAIR, LENGTHS, hand)
    return np.where(rests, headings, np.nan)


def closed_form(lengths: Any) -> Any:
    """Return the heading in the plane, in degrees, from the symbolic formula."""
    import sympy

    formula = plane_heading_formula()
    length, r, t = sympy.symbols("l r t", positive=True)
    one = sympy.lambdify(length, formula.subs({r: PAIR.ball_radius, t: PAIR.rod_radius}), "numpy")
    return np.degrees(one(np.asarray(lengths, dtype=float)))


def stated(lengths: Any) -> Any:
    """Return the paper's ``arctan(r/l)`` in degrees."""
    return np.degrees(np.arctan2(PAIR.ball_radius, lengths))


@style.styled()
def draw_heading_length() -> Drawing:
    """Draw the headings of dyads of either hand, and the small effect of the drum's curvature."""
    figure = style.canvas(style.NARROW + 0.9, 5.0)
    upper, lower = figure.subplots(2, 1, height_ratios=[3.4, 1], sharex=True)
    _draw_headings(upper)
    _draw_difference(lower)
    upper.tick_params(labelbottom=False)
    lower.set_xticks(range(8, 31, 2))
    lower.set(xlabel=r"length $\ell$ (mm)", xlim=(LENGTHS[0], LENGTHS[-1]))
    figure.align_ylabels([upper, lower])
    handles, labels = upper.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda k: "drum" not in labels[k])
    chosen = [handles[k] for k in order], [labels[k] for k in order]
    figure.legend(*chosen, loc="outside upper center", ncols=2)
    return figure


def _draw_headings(axes: Axes) -> None:
    some = LENGTHS[1::2]
    hands: tuple[tuple[Chirality, int, str], ...]
    hands = (("R", 1, "right-handed"), ("L", -1, "left-handed"))
    for hand, sign, word in hands:
        colour = style.HANDS[hand][0]
        label: str | None = f"least energy in the drum, {word}"
        axes.plot(LENGTHS, computed(hand), color=colour, lw=2.0, label=label, zorder=3)
        mark: dict[str, Any] = {
            "color": "white",
            "mec": "0.15",
            "mew": 0.8,
            "ms": 3.6,
            "ls": "",
            "zorder": 4,
        }
        label = "closed form in the plane" if sign > 0 else None
        axes.plot(some, sign * closed_form(some), "o", label=label, **mark)
        label = r"stated: $\pm\arctan(r/\ell)$" if sign > 0 else None
        axes.plot(LENGTHS, sign * stated(LENGTHS), "--", color=style.PAPER, label=label)
        length, heading, spread = OBSERVED
        bar: dict[str, Any] = {
            "color": style.MEASURED,
            "ms": 5.5,
            "capsize": 3,
            "lw": 1.2,
            "zorder": 5,
        }
        label = "observed, as given in the text" if sign > 0 else None
        axes.errorbar(length, sign * heading, yerr=spread, fmt="D", label=label, **bar)
    style.grid(axes)
    axes.set(ylabel=r"heading at rest $\theta_s$ (degrees)", ylim=(-24, 24))
    axes.set_yticks(range(-20, 21, 10))
    style.letter(axes, "a")


def _draw_difference(axes: Axes) -> None:
    """Draw the distance of the drum's minimiser from the plane's, in thousandths of a degree."""
    difference = 1e3 * (computed("R") - closed_form(LENGTHS))
    axes.plot(LENGTHS, difference, color=style.RIGHT[0])
    style.grid(axes)
    axes.set_ylabel("drum − plane\n(0.001 degrees)")
    style.letter(axes, "b")


def _numbers() -> tuple[float, float, float, float]:
    """Return the headings of the experiment's dyad, and the largest error of the plane."""
    at = int(np.argmin(abs(LENGTHS - PAIR.length)))
    worst = float(np.nanmax(abs(computed("R") - closed_form(LENGTHS))))
    return float(computed("R")[at]), float(closed_form(PAIR.length)), float(stated(16.0)), worst


def _caption() -> str:
    drum, plane, paper, worst = _numbers()
    length, heading, spread = OBSERVED
    return (
        "Heading at which a dyad's energy is least, against the length of its dumbbells, r = "
        f"{PAIR.ball_radius:g}, t = {PAIR.rod_radius:g} mm, horizontal drum with R = "
        f"{PAIR.drum_radius:g} mm, weightless rods. (a) Curves: certified minimisers at the "
        "corner with three contacts. Circles: closed form in the plane, tan 2θ = 2Dp/(D² + ℓ² − "
        "p²), p = r + t, D = ℓ − √(4r² − p²). Dashed: the formula that the paper states. "
        f"Diamonds: what the paper's text reports for ℓ = {length:g} mm, about {heading:g}°, with "
        f"bars of the ±{spread:g}° within which it says headings stay; the sign for the "
        "left-handed dyad is the text's, too. Its other measured points are not given as "
        f"numbers. At ℓ = {PAIR.length:g} mm the minimiser is {drum:.3f}°, the closed form "
        f"{plane:.3f}°, arctan(r/ℓ) {paper:.3f}°. (b) Minimiser in the drum less closed form: at "
        f"most {worst:.4f}° between {LENGTHS[0]:g} and {LENGTHS[-1]:g} mm."
    )


def _alt() -> str:
    drum, _, paper, _ = _numbers()
    return (
        f"Heading against length from {LENGTHS[0]:g} to {LENGTHS[-1]:g} millimetres, positive for "
        "right-handed and mirrored to negative for left-handed dyads. All curves fall towards "
        "zero with growing length. Computed curves and circles of the closed form coincide; the "
        f"dashed curve of the paper lies further out: at 16 millimetres {drum:.1f} degrees "
        f"computed, {paper:.1f} stated, about {OBSERVED[1]:g} observed. Below, the difference "
        "between drum and plane is thousandths of a degree."
    )


FIGURES = (Figure("heading_length", "Heading against length", _caption, _alt, draw_heading_length),)
