"""Landscapes over the plane: contours of the energy, minima, passes, routes, and films of these."""

import math
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from polycorner.checks import MOST, instance, whole
from polycorner.kinds import checked
from polycorner.landscapes import Landscape, Route
from polycorner.pictures.films import Picture, write_frames
from polycorner.pictures.landscapes import (
    MARKS,
    OPEN,
    Draw,
    Height,
    checked_height,
    draw_into,
    named,
)
from polycorner.pictures.regions import LENGTH, MINIMA, OFF, SIDE, check_planar, drawn_bounds, shade
from polycorner.spaces.manifold import Array, Manifold

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


# ---------------------------------------------------------------------------------- films of routes

FRAMES = 120
SIZE = (7.0, 3.5)  # inches
DOTS = 100  # per inch


@checked
def film_route(
    landscape: Landscape,
    route: Route,
    path: str | os.PathLike[str],
    pictures: Draw,
    *,
    height: Height | None = None,
    label: str = "energy",
    frames: int = FRAMES,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a film of a route, at even speed in units of the manifold's scales.

    Parameters
    ----------
    landscape : Landscape
        To which the route belongs.
    route : Route
        Such as ``landscape.barrier(0, 1).route``.
    path : path
        Ends in ``.mp4`` or ``.gif``; MP4 needs the extra ``movies``.
    pictures : callable
        ``pictures(axes, point)`` draws the configuration at a point ``(n,)``, as for
        :func:`draw_landscape`.
    height : callable, optional
        The height at which an energy is drawn; default the energy.
    label : str, optional
        What the height is, with its unit.
    frames : int, optional
        How many, of which 20 are shown in a second.
    progress : callable, optional
        Called with the number of frames drawn and of all.

    Raises
    ------
    TypeError, ValueError
        For another suffix, numbers of frames that are none, or MP4 without imageio-ffmpeg.
    OSError
        If the file cannot be written.
    """
    points = evenly(route, landscape.problem.polyhedron.manifold, whole("frames", frames, least=2))
    energies = np.atleast_1d(landscape.problem.energy.value(points)).tolist()
    heights = list(map(checked_height(height), energies))
    shown = _frames(points, np.array(heights), pictures, label)
    return write_frames(shown, frames, path, progress=progress)


def evenly(route: Route, manifold: Manifold, count: int) -> Array:
    """Return ``count`` points of a route ``(count, n)`` at equal distances along it."""
    vertices = route.vertices
    steps = np.linalg.norm(np.diff(vertices, axis=0) / manifold.scale_array, axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, travelled[-1], count)
    columns = [np.interp(at, travelled, column) for column in vertices.T]
    return np.asarray(manifold.onto(np.stack(columns, axis=-1)))


def _frames(points: Array, heights: Array, pictures: Draw, label: str) -> Iterator[Picture]:
    figure = Figure(figsize=SIZE, dpi=DOTS, layout="constrained")
    canvas: Any = FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    way = np.linspace(0.0, 1.0, len(heights))
    right.plot(way, heights, color=SIDE, lw=1.5)
    (dot,) = right.plot([], [], "o", color=MINIMA[0], ms=8)
    right.set(xlabel="share of the way", ylabel=label, xlim=(0, 1))
    right.spines[["top", "right"]].set_visible(False)
    for k, point in enumerate(points):
        left.clear()
        draw_into(left, pictures, point)
        dot.set_data([way[k]], [heights[k]])
        canvas.draw()
        figure.set_layout_engine("none")  # of the first picture, so that the axes stay
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()
