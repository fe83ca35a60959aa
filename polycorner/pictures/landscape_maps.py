"""Landscapes over the plane: contours of the energy, minima, passes and routes between them."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from polycorner.checks import MOST, instance, whole
from polycorner.kinds import checked
from polycorner.landscapes import Landscape
from polycorner.pictures.landscapes import MARKS, OPEN, named
from polycorner.pictures.regions import LENGTH, MINIMA, OFF, SIDE, check_planar, drawn_bounds, shade
from polycorner.spaces.manifold import Array

LEVELS = 18  # contours of the energy
FINE: dict[str, Any] = {"colors": ["0.6"], "linewidths": 0.6, "zorder": 2}
BOLD: dict[str, Any] = {"colors": ["#56B4E9"], "linewidths": 1.3, "zorder": 3}
HALO = [withStroke(linewidth=2.5, foreground="white")]


@checked
def draw_landscape_map(
    landscape: Landscape,
    bounds: tuple[float, float, float, float],
    *,
    names: Sequence[str] | None = None,
    pass_names: Sequence[str] | None = None,
    title: str = "",
    resolution: int = 600,
) -> Figure:
    """Draw a landscape over the plane.

    The set is grey, with contours of the energy; those at which components merge are light blue.
    Dots are minima, those of one orbit in one colour; passes have the marks of
    :func:`draw_landscape`, hollow where a side is not verified; routes lead from passes down to
    minima, dashed where they are not verified.  Crosses are the middles of boxes that are not
    decided.

    Parameters
    ----------
    landscape : Landscape
        With two coordinates and no equations.
    bounds : (left, right, bottom, top)
        The part of the plane that is drawn.
    names, pass_names : sequence of str, optional
        For each minimum and each pass; default the numbers of minima, and none for passes.
    title : str, optional
    resolution : int, optional
        Points along the longer side at which functions are evaluated.

    Raises
    ------
    TypeError, ValueError
        For a landscape that is not over a plane, bounds of another form, or another number of
        names.
    """
    d = instance("landscape", landscape, Landscape).problem.polyhedron
    check_planar(d)
    left, right, bottom, top = sides = drawn_bounds(bounds)
    resolution = whole("resolution", resolution, least=2, most=MOST)
    labels = named("names", names, landscape.minima, "{}")
    beside = named("pass_names", pass_names, landscape.passes, "")
    unit = max(right - left, top - bottom)
    size = (LENGTH * (right - left) / unit, LENGTH * (top - bottom) / unit)
    figure = Figure(figsize=(size[0] + 0.6, size[1] + 0.8), layout="constrained")
    axes = figure.add_subplot()
    shade(axes, d, sides, resolution, outline=True)
    _draw_contours(axes, landscape, sides, resolution)
    for p, name in zip(landscape.passes, beside, strict=True):
        for side in p.sides:
            if side.route is not None:
                x, y = side.route.vertices.T
                line = "-" if side.verified else "--"
                axes.plot(x, y, line, color="0.15", lw=1.6, zorder=4)
        if p.kind == "undecided":
            continue
        verified = bool(p.sides) and all(side.verified for side in p.sides)
        face = SIDE if verified else "white"
        axes.plot(*p.point, MARKS[p.kind], mec=SIDE, mfc=face, mew=1.2, ms=7, zorder=5)
        _write(axes, name, p.point)
    undecided = [p.point for p in landscape.passes if p.kind == "undecided"]
    axes.plot(*np.reshape(undecided, (-1, 2)).T, "x", color=OPEN, ms=6, zorder=5)
    for one, name in zip(landscape.minima, labels, strict=True):
        colour = MINIMA[one.orbit % len(MINIMA)]
        axes.plot(*one.point, "o", color=colour, mec="white", mew=0.6, ms=9, zorder=6)
        _write(axes, name, one.point)
    x_name, y_name = d.manifold.names
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel=x_name, ylabel=y_name, title=title)
    axes.set_aspect("equal")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_contours(
    axes: Axes, landscape: Landscape, bounds: tuple[float, float, float, float], resolution: int
) -> None:
    """Draw contours of the energy inside the set, and those at the energies of passes."""
    left, right, bottom, top = bounds
    step = max(right - left, top - bottom) / resolution
    x, y = np.meshgrid(
        np.linspace(left, right, math.ceil((right - left) / step) + 1),
        np.linspace(bottom, top, math.ceil((top - bottom) / step) + 1),
    )
    points = np.stack([x, y], axis=-1)
    problem = landscape.problem
    energy = np.where(problem.polyhedron.contains(points), problem.energy.value(points), np.nan)
    inside = energy[np.isfinite(energy)]
    if not inside.size:
        return
    # As much of the set between one contour and the next: wells have several, steep slopes few.
    shares = np.quantile(inside, np.linspace(0, 1, LEVELS))
    merged = [merge.energy[1] for merge in landscape.merges]
    for levels, style in ((shares, FINE), (merged, BOLD)):
        between = sorted({float(e) for e in levels if inside.min() < e < inside.max()})
        if between:
            axes.contour(x, y, energy, levels=between, **style)


def _write(axes: Axes, name: str, point: Array) -> None:
    if name:
        axes.annotate(
            name, (point[0], point[1]), (OFF * 0.8, OFF * 0.6), textcoords="offset points",
            zorder=7, path_effects=HALO,
        )  # fmt: skip
