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
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.search import traced
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

Labelled = Sequence[tuple[str, ArrayLike]]
Edges = Sequence[ArrayLike | tuple[str, ArrayLike]]

SHADE, SIDE = "0.88", "#0072B2"
MINIMA = ("#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
CONVEX, CONCAVE, TANGENTIAL = range(3)
CORNERS = (
    ("locally convex corner", "black", "o"),
    ("locally concave corner", "white", "o"),
    ("sides that touch, or a cusp", "0.6", "D"),
)
CROWDED = 12  # corners above which a picture is clearer without names
MARGIN = 0.1  # around a skeleton, of its extent
LENGTH = 7.0  # inches of the longer side of the axes
OFF = 9.0  # points between a mark and its label
NEAR = 0.01  # radius, relative to the drawn part, of the circle that finds the region beside a mark
AROUND = 2 * np.pi * np.arange(360) / 360
ONE_WAY = 0.1  # least length of the mean of unit vectors into the region that has a direction


def draw_region(
    polyhedron: Polyhedron | Skeleton,
    bounds: tuple[float, float, float, float] | None = None,
    *,
    corners: Labelled = (),
    edges: Edges = (),
    minima: Labelled = (),
    title: str = "",
    resolution: int = 800,
) -> Figure:
    """Draw a polyhedron in the plane, ``{implicit >= 0}``.

    Corners at which the region is locally convex are filled, those at which it is a union of
    several pieces are hollow, and those at which sides touch or end in a cusp are grey diamonds;
    :func:`~polycorner.stratum_at` decides.  Labels of corners and edges stand outside the region.
    A legend below lists the labels of minima, one colour for each, and the kinds of corners where
    several occur.

    Parameters
    ----------
    polyhedron : Polyhedron or Skeleton
        With two coordinates and no equations.  A skeleton has its corners drawn, ``C0 C1 ...``,
        and its edges with the functions that vanish on them; more than twelve corners are drawn
        without names.
    bounds : (left, right, bottom, top)
        The part of the plane that is drawn; default of a skeleton what contains it.
    corners : sequence of (label, point), optional
        Points ``(2,)`` and their labels; an empty label writes none.  Default those of a skeleton.
    edges : sequence of polylines ``(k, 2)`` or of (label, polyline), optional
        The boundary; default that of a skeleton, else the zero contour of the implicit value.
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
    found = polyhedron if isinstance(polyhedron, Skeleton) else None
    region: Any = polyhedron if found is None else found.polyhedron
    check_planar(region)
    resolution = whole("resolution", resolution, least=2, most=MOST)
    instance("title", title, str)
    marked, held = _points("corners", corners), _points("minima", minima)
    lines = _polylines(edges)
    if found is not None:
        marked, lines = marked or _own_corners(found), lines or _own_edges(found)
    if found is None or bounds is not None:
        left, right, bottom, top = drawn_bounds(bounds)
    else:
        left, right, bottom, top = _around(lines, [*marked, *held])
    unit = max(right - left, top - bottom)
    size = (LENGTH * (right - left) / unit, LENGTH * (top - bottom) / unit)
    figure = Figure(figsize=(size[0] + 0.6, size[1] + 0.8), layout="constrained")
    axes = figure.add_subplot()
    shade(axes, region, (left, right, bottom, top), resolution, outline=not lines)
    for label, line in lines:
        axes.plot(line[:, 0], line[:, 1], color=SIDE, linewidth=2, solid_capstyle="round")
        middle = _middle(line)
        _label(axes, label, middle, -_inwards(region, middle, unit), SIDE)
    _draw_corners(axes, region, marked, unit)
    _draw_minima(axes, held)
    _, names = axes.get_legend_handles_labels()
    if names:
        figure.legend(loc="outside lower center", ncols=2, frameon=False)
    x, y = region.manifold.names
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


def _own_corners(found: Skeleton) -> list[tuple[str, Array]]:
    crowded = len(found.corners) > CROWDED
    names = ["" if crowded else f"C{k}" for k in range(len(found.corners))]
    return [(name, corner.point) for name, corner in zip(names, found.corners, strict=True)]


def _own_edges(found: Skeleton) -> list[tuple[str, Array]]:
    crowded = len(found.corners) > CROWDED
    names = ["" if crowded else ", ".join(edge.active) for edge in found.edges]
    curves = [traced(found, edge) if found.state else edge.polyline for edge in found.edges]
    return list(zip(names, curves, strict=True))


def _around(
    lines: list[tuple[str, Array]], points: list[tuple[str, Array]]
) -> tuple[float, float, float, float]:
    """Return the sides of a rectangle that contains lines and points."""
    if not lines and not points:
        refuse("bounds", "sides, where a skeleton has no corners and no edges", None)
    shown = np.concatenate([np.atleast_2d(place) for _, place in [*lines, *points]])
    low, high = shown.min(axis=0), shown.max(axis=0)
    margin = MARGIN * (float((high - low).max()) or 1.0)
    (left, bottom), (right, top) = (low - margin).tolist(), (high + margin).tolist()
    return left, right, bottom, top


def _draw_corners(
    axes: Axes, polyhedron: Polyhedron, corners: list[tuple[str, Array]], unit: float
) -> None:
    kinds = [_kind(polyhedron, point) for _, point in corners]
    for kind, (words, face, form) in enumerate(CORNERS):
        chosen = [point for (_, point), own in zip(corners, kinds, strict=True) if own == kind]
        if chosen:
            x, y = np.array(chosen).T
            name = words if len(set(kinds)) > 1 else None
            order = 4 if kind == CONVEX else 6  # a minimum may hide a filled corner, no other
            axes.plot(x, y, form, color=face, mec="black", ms=6, zorder=order, ls="", label=name)
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
    """Return a unit vector into the region: the mean over a small circle.

    Where there is no such direction, as between two cusps that face each other, or in a cusp too
    thin for the circle, it is opposite to the direction that leads farthest out of the region.
    """
    ring = np.stack([np.cos(AROUND), np.sin(AROUND)], axis=-1)
    inside = polyhedron.contains(point + NEAR * unit * ring)
    mean = ring[inside].sum(axis=0) / max(1, int(inside.sum()))
    size = math.hypot(*mean)
    if size > ONE_WAY:
        return np.asarray(mean / size)
    return np.asarray(-ring[np.argmin(polyhedron.implicit(point + NEAR * unit * ring))])


def _kind(polyhedron: Polyhedron, point: Array) -> int:
    local = stratum_at(polyhedron, point, tolerance=DEFAULT.same).local_type
    if local in {LocalType.DEGENERATE, LocalType.NOT_SMOOTH}:
        return TANGENTIAL
    return CONCAVE if local is LocalType.UNION else CONVEX


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
    if bounds is None:
        refuse("bounds", "left, right, bottom and top, but for a skeleton", bounds)
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
