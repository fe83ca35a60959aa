"""Figures of planar polyhedra: the region, its sides and corners, and minima of an energy."""

import math
from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from polycorner.checks import MOST, instance, reals, refuse, whole
from polycorner.pictures.arguments import labelled, pair, several
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import LocalType, stratum_at
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

Labelled = Sequence[tuple[str, ArrayLike]]
Edges = Sequence[ArrayLike | tuple[str, ArrayLike]]

SHADE, SIDE = "0.88", "#0072B2"
MINIMA = ("#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
CORNERS = (("locally convex corner", "black"), ("locally concave corner", "white"))
LENGTH = 7.0  # inches of the longer side of the axes
OFF = 9.0  # points between a mark and its label
NEAR = 0.01  # radius, relative to the drawn part, of the circle that finds the region beside a mark
AROUND = 2 * np.pi * np.arange(72) / 72


def draw_region(
    polyhedron: Polyhedron,
    bounds: tuple[float, float, float, float],
    *,
    corners: Labelled = (),
    edges: Edges = (),
    minima: Labelled = (),
    title: str = "",
    resolution: int = 800,
) -> Figure:
    """Draw a polyhedron in the plane, ``{implicit >= 0}``.

    Corners at which the region is locally convex are filled, those at which it is a union of
    several pieces are hollow; :func:`~polycorner.stratum_at` decides.  Labels of corners and
    edges stand outside the region.  A legend below lists the labels of minima, one colour for
    each, and both kinds of corners where both occur.

    Parameters
    ----------
    polyhedron : Polyhedron
        With two coordinates and no equations.
    bounds : (left, right, bottom, top)
        The part of the plane that is drawn.
    corners : sequence of (label, point), optional
        Points ``(2,)`` and their labels; an empty label writes none.
    edges : sequence of polylines ``(k, 2)`` or of (label, polyline), optional
        The boundary; default the zero contour of the implicit value.
    minima : sequence of (label, point), optional
        Points ``(2,)``; those that share a label share a colour.
    title : str, optional
        Above the figure.
    resolution : int, optional
        Points along the longer side at which the implicit value is taken.

    Raises
    ------
    TypeError, ValueError
        For a polyhedron that is not planar, or bounds, points, polylines or a resolution of
        another form.
    """
    check_planar(polyhedron)
    left, right, bottom, top = drawn_bounds(bounds)
    resolution = whole("resolution", resolution, least=2, most=MOST)
    instance("title", title, str)
    marked, held = _points("corners", corners), _points("minima", minima)
    lines = _polylines(edges)
    unit = max(right - left, top - bottom)
    size = (LENGTH * (right - left) / unit, LENGTH * (top - bottom) / unit)
    figure = Figure(figsize=(size[0] + 0.6, size[1] + 0.8), layout="constrained")
    axes = figure.add_subplot()
    shade(axes, polyhedron, (left, right, bottom, top), resolution, outline=not lines)
    for label, line in lines:
        axes.plot(line[:, 0], line[:, 1], color=SIDE, linewidth=2, solid_capstyle="round")
        middle = _middle(line)
        _label(axes, label, middle, -_inwards(polyhedron, middle, unit), SIDE)
    _draw_corners(axes, polyhedron, marked, unit)
    _draw_minima(axes, held)
    _, names = axes.get_legend_handles_labels()
    if names:
        figure.legend(loc="outside lower center", ncols=2, frameon=False)
    x, y = polyhedron.manifold.names
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel=x, ylabel=y, title=title)
    axes.set_aspect("equal")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def shade(
    axes: Axes,
    polyhedron: Polyhedron,
    bounds: tuple[float, float, float, float],
    resolution: int,
    *,
    outline: bool,
) -> None:
    """Shade a planar polyhedron, with its boundary if asked."""
    left, right, bottom, top = bounds
    step = max(right - left, top - bottom) / resolution
    columns, rows = math.ceil((right - left) / step) + 1, math.ceil((top - bottom) / step) + 1
    x, y = np.meshgrid(np.linspace(left, right, columns), np.linspace(bottom, top, rows))
    implicit = polyhedron.implicit(np.stack([x, y], axis=-1))
    if (implicit > 0).any():
        axes.contourf(x, y, implicit, levels=[0, implicit.max()], colors=[SHADE])
    if outline and (implicit > 0).any() and (implicit < 0).any():
        axes.contour(x, y, implicit, levels=[0], colors=[SIDE], linewidths=1.6)


def _draw_corners(
    axes: Axes, polyhedron: Polyhedron, corners: list[tuple[str, Array]], unit: float
) -> None:
    unions = [_is_union(polyhedron, point) for _, point in corners]
    for union, (kind, face) in enumerate(CORNERS):
        chosen = [
            point for point, is_union in zip(corners, unions, strict=True) if is_union == union
        ]
        if chosen:
            x, y = np.array([point for _, point in chosen]).T
            name = kind if len(set(unions)) == 2 else None
            order = 6 if union else 4  # a minimum may hide a filled corner, not a hollow one
            axes.plot(x, y, "o", color=face, mec="black", ms=6, zorder=order, ls="", label=name)
    for label, point in corners:
        _label(axes, label, point, -_inwards(polyhedron, point, unit), "black")


def _draw_minima(axes: Axes, minima: list[tuple[str, Array]]) -> None:
    for colour, label in zip(
        cycle(MINIMA), dict.fromkeys(name for name, _ in minima), strict=False
    ):
        x, y = np.array([point for name, point in minima if name == label]).T
        style: dict[str, Any] = {"mec": "white", "mew": 0.5, "ms": 7, "zorder": 5, "ls": ""}
        axes.plot(x, y, "o", color=colour, label=label or None, **style)


def _label(axes: Axes, label: str, point: Array, direction: Array, colour: str) -> None:
    """Write a label beside a point, aligned so that the text extends away from it."""
    if not label:
        return
    across = {-1: "right", 0: "center", 1: "left"}[round(direction[0])]
    upright = {-1: "top", 0: "center", 1: "bottom"}[round(direction[1])]
    axes.annotate(
        label,
        (point[0], point[1]),
        xytext=(OFF * direction[0], OFF * direction[1]),
        textcoords="offset points",
        ha=across,
        va=upright,
        color=colour,
        zorder=5,
        path_effects=[withStroke(linewidth=3, foreground="white")],
    )


def _inwards(polyhedron: Polyhedron, point: Array, unit: float) -> Array:
    """Return the unit vector from a point into the region, the mean over a small circle."""
    ring = np.stack([np.cos(AROUND), np.sin(AROUND)], axis=-1)
    mean = ring[polyhedron.contains(point + NEAR * unit * ring)].sum(axis=0)
    size = math.hypot(*mean)
    return mean / size if size > 1e-6 else np.array([0.0, 1.0])


def _is_union(polyhedron: Polyhedron, point: Array) -> bool:
    stratum = stratum_at(polyhedron, point, tolerance=DEFAULT.same)
    return stratum.local_type is LocalType.UNION


def _middle(line: Array) -> Array:
    """Return the point halfway along a polyline."""
    lengths = np.hypot(*np.diff(line, axis=0).T)
    travelled = np.concatenate([[0.0], np.cumsum(lengths)])
    half = travelled[-1] / 2
    return np.array([np.interp(half, travelled, line[:, k]) for k in (0, 1)])


def check_planar(polyhedron: Polyhedron) -> None:
    """Raise ValueError for a polyhedron that is not a region of the plane."""
    instance("polyhedron", polyhedron, Polyhedron)
    if polyhedron.dimension != 2 or polyhedron.equations:
        msg = (
            "polyhedron: expected two coordinates and no equations; got "
            f"{', '.join(polyhedron.manifold.names)} and {len(polyhedron.equations)} equations"
        )
        raise ValueError(msg)


def drawn_bounds(bounds: Any) -> tuple[float, float, float, float]:
    """Return the sides of the part of the plane that is drawn."""
    array = finite(reals("bounds", bounds), "bounds")
    if array.shape != (4,) or not (array[0] < array[1] and array[2] < array[3]):
        refuse("bounds", "left < right and bottom < top", bounds)
    left, right, bottom, top = array.tolist()
    return left, right, bottom, top


def _points(argument: str, given: Labelled) -> list[tuple[str, Array]]:
    marked = []
    for label, point in labelled(argument, given):
        if point.shape != (2,):
            refuse(argument, "points of shape (2,)", point.shape)
        marked.append((label, point))
    return marked


def _polylines(edges: Edges) -> list[tuple[str, Array]]:
    lines = []
    for entry in several("edges", edges):
        named = isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[0], str)
        label, line = pair("edges", entry if named else ("", entry))
        if line.ndim != 2 or line.shape[1] != 2 or len(line) < 2:
            refuse("edges", "polylines of shape (k, 2) with k >= 2", line.shape)
        lines.append((label, line))
    return lines
