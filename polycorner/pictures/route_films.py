"""Films of routes: the configuration along a way, and its energy beside it."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from polycorner.checks import whole
from polycorner.kinds import checked
from polycorner.landscapes import Landscape, Route
from polycorner.pictures.films import Picture, write_frames
from polycorner.pictures.landscapes import Draw, Height, checked_height, draw_into
from polycorner.pictures.regions import MINIMA, SIDE
from polycorner.spaces.manifold import Array, Manifold

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
