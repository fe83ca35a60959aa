"""Figures of a dyad: the pair at its minimum, and its heading against length."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import contact_point, rod_outlines
from polycorner.dumbbells.pictures.symbols import multiplier_unit, sizes_in_words
from polycorner.dumbbells.statics.minima import DyadMinimum, heading_curve
from polycorner.toolkit import BODIES, SHADES, Array, bridged, checked, real, refuse


@checked
def draw_pair(entry: DyadMinimum) -> Figure:
    """Draw a pair in the drum (in perspective) and in the developed plane with its contacts."""
    pair = entry.pair
    figure = Figure(figsize=(5.5 if pair.is_plane else 10, 5.5), layout="constrained")
    if pair.is_plane:
        _draw_developed(figure.add_subplot(), entry)
    else:
        solid: Any = figure.add_subplot(1, 2, 1, projection="3d")
        _draw_drum(solid, entry)
        _draw_developed(figure.add_subplot(1, 2, 2), entry)
    headings = " and ".join(f"{h:.3f}°" for h in entry.headings)
    figure.suptitle(f"{_label(entry.name)}:  {sizes_in_words(pair)},  headings {headings}")
    return figure


@checked
def draw_heading(pair: DumbbellPair, lengths: Sequence[float], rods: Sequence[float]) -> Figure:
    """Draw the heading of both chiralities against length for several rod radii.

    Computed curves are drawn full where the corner is a certified minimum and dotted where it is
    not; the paper's ``+-arctan(r/l)`` is dashed.
    """
    if not len(lengths):
        refuse("lengths", "at least one", lengths)
    for rod in rods:
        real("rods", rod, above=0, below=pair.ball_radius, unit="mm")
    figure = Figure(figsize=(7, 6), layout="constrained")
    axes = figure.add_subplot()
    lengths_array = np.asarray(lengths, dtype=np.float64)
    for colour, rod in zip(cycle(SHADES), rods, strict=False):
        for chirality in ("R", "L"):
            model = replace(pair, rod_radius=float(rod))
            headings, certified = heading_curve(model, lengths, chirality)
            label = f"computed, t = {rod:g} mm" if chirality == "R" else None
            axes.plot(
                lengths_array, np.where(certified, headings, np.nan), color=colour, label=label
            )
            others = np.where(bridged(certified == 0), headings, np.nan)
            axes.plot(lengths_array, others, ":", color=colour)
    paper = np.degrees(np.arctan2(pair.ball_radius, lengths_array))
    axes.plot(lengths_array, paper, "k--", label="paper, ±arctan(r/l)")
    axes.plot(lengths_array, -paper, "k--")
    axes.plot([], [], ":", color="0.4", label="corner is no minimum")
    axes.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    axes.text(lengths_array[-1], 1.0, "right-handed", ha="right", color="0.4")
    axes.text(lengths_array[-1], -1.0, "left-handed", ha="right", va="top", color="0.4")
    axes.set(xlabel="length l (mm)", ylabel="heading at rest (degrees)")
    where = "plane" if pair.is_plane else f"drum of radius {pair.drum_radius:g} mm"
    axes.set_title(f"Heading of a dyad against length, r = {pair.ball_radius:g} mm, {where}")
    axes.legend(frameon=False, loc="upper right")
    return figure


def _label(name: str) -> str:
    return {"delta_R": "$\\delta_R$", "delta_L": "$\\delta_L$", "G": "$G$"}.get(name, name)


def _draw_drum(axes: Any, entry: DyadMinimum) -> None:
    pair, centres = entry.pair, entry.pair.ball_centres(entry.point)
    middle = centres.mean(axis=0)
    reach = float(abs(centres - middle).max()) + 2 * pair.ball_radius
    # Bodies always lie above the wall, so the wall is drawn first in every view.
    axes.computed_zorder = False
    _draw_wall(axes, pair, middle, reach)
    for body, colour in zip((centres[:2], centres[2:]), BODIES, strict=True):
        _surface(axes, _tube(body[0], body[1], pair.rod_radius), colour)
    # Far balls before near ones, as seen from the front of the drum.
    for k in np.argsort(-centres[:, 1]):
        _surface(axes, _ball(centres[k], pair.ball_radius), BODIES[k // 2])
    floor = float(-pair.drum_radius)
    axes.set_box_aspect((1, 1, 0.4), zoom=1.15)
    axes.set(
        xlim=(middle[0] - reach, middle[0] + reach),
        ylim=(middle[1] - reach, middle[1] + reach),
        zlim=(floor, floor + 0.8 * reach),
    )
    axes.set(xlabel="across (mm)", ylabel="along the axis (mm)", zticks=[])
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.fill = False
    axes.grid(visible=False)
    axes.view_init(elev=42, azim=-70)
    axes.set_title("in the drum")


def _draw_wall(axes: Any, pair: DumbbellPair, middle: Array, reach: float) -> None:
    span = math.asin(min(1.0, reach / pair.drum_radius))
    angle, along = np.meshgrid(
        np.linspace(-span, span, 25), np.linspace(middle[1] - reach, middle[1] + reach, 9)
    )
    wall = (pair.drum_radius * np.sin(angle), along, -pair.drum_radius * np.cos(angle))
    axes.plot_surface(*wall, color="0.92", linewidth=0, shade=False, zorder=0)
    axes.plot_wireframe(*wall, color="0.75", linewidth=0.6, rstride=4, cstride=6, zorder=0.5)


def _surface(axes: Any, points: tuple[Array, Array, Array], colour: str) -> None:
    axes.plot_surface(*points, color=colour, linewidth=0, rcount=30, ccount=30, zorder=1)


def _ball(centre: Array, radius: float) -> tuple[Array, Array, Array]:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.linspace(0, np.pi, 20))
    x, y, z = np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)
    return centre[0] + radius * x, centre[1] + radius * y, centre[2] + radius * z


def _tube(start: Array, end: Array, radius: float) -> tuple[Array, Array, Array]:
    axis = (end - start) / np.linalg.norm(end - start)
    side = np.cross(axis, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    turn, along = np.meshgrid(np.linspace(0, 2 * np.pi, 24), np.array([0.0, 1.0]))
    ring = np.cos(turn)[..., None] * side + np.sin(turn)[..., None] * other
    points = start + along[..., None] * (end - start) + radius * ring
    return points[..., 0], points[..., 1], points[..., 2]


def _draw_developed(axes: Axes, entry: DyadMinimum) -> None:
    pair = entry.pair
    centres = pair.developed(entry.point)
    centres = centres - centres.mean(axis=0)
    margin = 1.6 * pair.ball_radius
    low, high = centres.min(axis=0) - margin, centres.max(axis=0) + margin
    half = max(-low[0], high[0], 4.2 * margin)
    for body, colour in zip((centres[:2], centres[2:]), BODIES, strict=True):
        outline = rod_outlines(body, pair.rod_radius)
        axes.add_patch(Polygon(outline, color=colour, alpha=0.55, lw=0))
        for centre in body:
            axes.add_patch(Circle(tuple(centre), pair.ball_radius, color=colour, lw=0))
    places = {name: contact_point(pair, centres, name) for name in entry.multipliers}
    contacts = sorted(places, key=lambda name: -places[name][1])
    for rank, name in enumerate(contacts):
        axes.plot(*places[name], "o", color="white", markeredgecolor="black", ms=5, zorder=5)
        row = pair.ball_radius * ((len(contacts) - 1) / 2 - rank)
        axes.annotate(
            f"{name}:  {entry.multipliers[name]:.4g}",
            (places[name][0], places[name][1]),
            xytext=(0.95 * half, places[name][1] + 1.2 * row),
            fontsize=9,
            ha="right",
            va="center",
            arrowprops={"arrowstyle": "-", "color": "black", "lw": 0.8},
            zorder=6,
        )
    for name, centre in zip(("A1", "A2", "B1", "B2"), centres, strict=True):
        axes.text(centre[0], centre[1], name, ha="center", va="center", color="white", fontsize=9)
    axes.axvline(0, color="0.5", linewidth=0.8, linestyle="--", zorder=0)
    axes.set_xlim(-half, half)
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set(xlabel="lateral position (mm)", ylabel="axial position (mm)")
    unit = multiplier_unit(pair)
    axes.set_title(f"developed; contacts with multipliers ({unit})" if contacts else "developed")
