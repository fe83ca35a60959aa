"""Style shared by all figures: dumbbells, drums, colours, fonts, projected bodies."""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase, SubFigure
from matplotlib.patches import Circle, Polygon

from polycorner.dumbbells import DumbbellDrum, DumbbellPair

# Lengths in mm, as in the paper; the drum is tilted by 7 degrees and turns with 0.01 rad/s.
PLANE = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
DRUM = DumbbellDrum(length=16)
SHORT_DRUM = DumbbellDrum(length=14)

# Colours of Okabe and Ito, which stay apart for colour-blind readers: the first dumbbell of a pair
# is dark, the second light.  Right-handed pairs and positive headings are blue, left-handed pairs
# and negative headings green, in every figure.
RIGHT, LEFT, NEITHER = ("#0072B2", "#56B4E9"), ("#009E73", "#8AD6BF"), ("0.35", "0.68")
HANDS = {"R": RIGHT, "L": LEFT, None: NEITHER}
GRAVITY = "#D55E00"  # flow lines of gravity, and the curve S of dumbbells along them
PAPER = "#A0457E"  # statements of the paper that differ from the computation
MEASURED = "#D55E00"
LIT = "#F0E442"  # contacts
FAINT, LINE = "0.72", "0.45"

WIDE, NARROW = 7.1, 4.6  # inches

FONTS: dict[Any, Any] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 10.5,
    "axes.titlesize": 10.5,
    "axes.labelsize": 10.5,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "legend.fontsize": 9.5,
    "figure.titlesize": 11,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "lines.linewidth": 1.3,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "polycorner",  # the same figure is the same file
}


@contextmanager
def styled() -> Iterator[None]:
    """Draw and save with the fonts and lines of the paper's figures."""
    with rc_context(FONTS):
        yield


def canvas(width: float, height: float) -> Figure:
    """Return an empty figure, its size in inches."""
    return Figure(figsize=(width, height), layout="constrained")


def parts(figure: FigureBase, rows: int, columns: int, **options: Any) -> list[SubFigure]:
    """Return the parts of a figure that is divided into rows and columns, row by row."""
    found: Any = figure.subfigures(rows, columns, **options)
    return list(found.flat)


def letter(axes: Axes, name: str, words: str = "") -> None:
    """Write a panel's letter in bold and its subject above its left corner."""
    axes.set_title(rf"$\bf({name})$ {words}".rstrip(), loc="left", pad=5)


def sizes(body: DumbbellPair | DumbbellDrum) -> str:
    """Return the lengths of dumbbells and drum in words."""
    lengths = f"ℓ = {body.length:g}, r = {body.ball_radius:g}, t = {body.rod_radius:g} mm"
    return lengths if math.isinf(body.drum_radius) else f"{lengths}, R = {body.drum_radius:g} mm"


def friction(drum: DumbbellDrum) -> str:
    """Return the coefficients of friction in words."""
    (s, s_dynamic), (r, r_dynamic) = drum.sliding, drum.rolling
    return (
        f"friction static (dynamic): sliding {s:g} ({s_dynamic:g}), rolling {r:g} ({r_dynamic:g})"
    )


def minus(text: str) -> str:
    """Return a text with typographic minus signs before numbers."""
    return re.sub(r"(?<![\w.)])-(?=\d)", "−", text)


def bare(axes: Axes) -> None:
    """Remove axes and frame, and set equal scales."""
    axes.set_aspect("equal")
    axes.set_axis_off()


def grid(axes: Axes) -> None:
    """Draw faint grid lines behind the curves, and zero a little darker."""
    axes.grid(color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.axhline(0, color=FAINT, linewidth=0.7, zorder=0.9)


# ---------------------------------------------------------------------------------- bodies


def draw_dumbbell(
    axes: Axes,
    balls: Any,
    radii: tuple[float, float],
    colour: str,
    *,
    alpha: float = 1.0,
    zorder: float = 3.0,
) -> None:
    """Draw a dumbbell, centres ``(2, 2)``, radii of its balls and its rod, in the plane."""
    centres = np.asarray(balls, dtype=float)
    ball, rod = radii
    axis = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
    side = rod * np.array([-axis[1], axis[0]])
    outline = [centres[0] + side, centres[1] + side, centres[1] - side, centres[0] - side]
    kept: dict[str, Any] = {
        "facecolor": colour,
        "edgecolor": "white",
        "linewidth": 0.6,
        "alpha": alpha,
    }
    axes.add_patch(Polygon(outline, zorder=zorder, **kept))
    for centre in centres:
        axes.add_patch(Circle(tuple(centre), ball, zorder=zorder + 0.1, **kept))
        place = tuple(centre + ball * np.array([-0.3, 0.34]))
        glint = {"facecolor": "white", "linewidth": 0, "alpha": 0.35 * alpha}
        axes.add_patch(Circle(place, 0.3 * ball, zorder=zorder + 0.2, **glint))


def draw_pair(
    axes: Axes,
    pair: DumbbellPair,
    centres: Any,
    colours: tuple[str, str],
    *,
    alpha: float = 1.0,
    zorder: float = 3.0,
) -> None:
    """Draw two dumbbells, developed centres ``(4, 2)`` of A1, A2, B1, B2."""
    radii = (pair.ball_radius, pair.rod_radius)
    for body, colour in zip((centres[:2], centres[2:]), colours, strict=True):
        draw_dumbbell(axes, body, radii, colour, alpha=alpha, zorder=zorder)


def touching(pair: DumbbellPair, centres: Any, name: str) -> Any:
    """Return the point of contact of a named contact in the plane, ``(2,)``."""
    ball = dict(zip(("A1", "A2", "B1", "B2"), np.asarray(centres), strict=True))
    if len(name) == 4:
        return (ball[name[:2]] + ball[name[2:]]) / 2
    one, rod = (ball[name[:2]], "B") if name.endswith("b") else (ball[name[1:]], "A")
    start, axis = ball[f"{rod}1"], ball[f"{rod}2"] - ball[f"{rod}1"]
    foot = start + axis * np.clip((one - start) @ axis / (axis @ axis), 0, 1)
    share = pair.ball_radius / (pair.ball_radius + pair.rod_radius)
    return one + share * (foot - one)


def mark_contacts(axes: Axes, pair: DumbbellPair, centres: Any, names: Any) -> None:
    """Highlight the contacts of the given names."""
    for name in names:
        x, y = touching(pair, centres, name)
        axes.plot(x, y, "o", color=LIT, mec="black", mew=0.7, ms=4.2, zorder=6)
