"""Figures of rigid bodies in their places, in the plane and in space."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LightSource, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.shapes import Body, Part
from polycorner.bodies.walls import Cylinder, HalfSpace
from polycorner.checks import instance, refuse, whole
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

# Okabe and Ito's colours, which stay apart for colour-blind readers.
COLOURS = ("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#F0E442", "#0072B2", "#D55E00")
FIXED, OUTSIDE, OUTLINE = "0.55", "0.85", "0.2"
CELL = 2.4  # width of a picture in inches
MARGIN = 0.15  # around bodies, of their extent
ARC = 33  # points of a full circle of an outline
WALL = 360  # points of the inside of a circle or cylinder
BALL = 300  # points of a ball
LIGHT = LightSource(azdeg=315, altdeg=50)


@checked
def draw_arrangement(
    arrangement: Arrangement,
    points: ArrayLike,
    *,
    titles: Sequence[str] | None = None,
    columns: int = 4,
) -> Figure:
    """Draw the bodies at one point or several, side by side at the same scale.

    Bodies have different colours, fixed ones are grey.  In the plane the outside of walls is grey;
    in space walls are not drawn.  A periodic box has dashed sides; in the plane all images are
    drawn that are seen, in space those whose origins are in the box.

    Parameters
    ----------
    arrangement : Arrangement
    points : (N,) or (k, N) array
    titles : sequence of str, optional
        One for each point.
    columns : int, optional
        Largest number side by side.

    Raises
    ------
    TypeError, ValueError
        For points of another manifold, or another number of titles.
    """
    instance("arrangement", arrangement, Arrangement)
    places = np.atleast_2d(arrangement.manifold.points(points, "points"))
    if titles is not None and len(titles) != len(places):
        refuse("titles", f"{len(places)} titles, one for each point", len(titles))
    columns = min(whole("columns", columns, least=1), len(places))
    rows = math.ceil(len(places) / columns)
    figure = Figure(figsize=(CELL * columns, (CELL + 0.2) * rows), layout="constrained")
    space = {"projection": "3d"} if arrangement.dimension == 3 else {}
    grid = figure.subplots(rows, columns, squeeze=False, subplot_kw=space)
    placed = [_in_the_box(arrangement, arrangement.placed(q)) for q in places]
    window = _window(arrangement, [body for bodies in placed for body in bodies.values()])
    for k, axes in enumerate(grid.flat):
        axes.set_axis_off()
        if k < len(placed):
            draw = _draw_space if arrangement.dimension == 3 else _draw_plane
            draw(axes, arrangement, placed[k], window)
            if titles is not None:
                axes.set_title(titles[k], fontsize=9)
    return figure


def _in_the_box(arrangement: Arrangement, placed: dict[str, Body]) -> dict[str, Body]:
    """Return bodies displaced by whole periods so that the means of their points are in the box."""
    lattice = arrangement.lattice
    return {
        name: body.moved(
            lattice.shift(tuple(-np.floor(body.markers.mean(axis=0) / lattice.lengths)))
        )
        for name, body in placed.items()
    }


def _window(arrangement: Arrangement, bodies: Sequence[Body]) -> Array:
    """Return two opposite corners ``(2, d)`` of a cube around all bodies, or the box around them.

    The box is that of periods, or of pairs of walls across an axis, which are drawn in the plane.
    """
    parts = [part for body in bodies for part in body.parts.values()]
    low = np.min([part.points.min(axis=0) - part.radius for part in parts], axis=0)
    high = np.max([part.points.max(axis=0) + part.radius for part in parts], axis=0)
    lengths = arrangement.lattice.lengths
    periodic = np.isfinite(lengths)
    low, high = np.where(periodic, 0.0, low), np.where(periodic, lengths, high)
    if arrangement.dimension == 2:
        below, above = _between_walls(arrangement)
        boxed = np.isfinite(above - below)
        low = np.where(boxed, np.minimum(low, below), low)
        high = np.where(boxed, np.maximum(high, above), high)
    half = (0.5 + MARGIN) * (high - low).max()
    return np.array([(low + high) / 2 - half, (low + high) / 2 + half])


def _between_walls(arrangement: Arrangement) -> tuple[Array, Array]:
    """Return where walls across each axis are, on either side; infinite where there is none."""
    below, above = np.full(2, -np.inf), np.full(2, np.inf)
    for wall in arrangement.walls.values():
        if isinstance(wall, HalfSpace) and np.abs(wall.normal).max() > 1 - DEFAULT.alike:
            axis = int(np.abs(wall.normal).argmax())
            if wall.normal[axis] > 0:
                below[axis] = max(below[axis], wall.point[axis])
            else:
                above[axis] = min(above[axis], wall.point[axis])
    return below, above


def _colours(arrangement: Arrangement) -> dict[str, str]:
    moving = {name: COLOURS[k % len(COLOURS)] for k, name in enumerate(arrangement.named)}
    return moving | dict.fromkeys(arrangement.fixed, FIXED)


def _draw_plane(
    axes: Axes, arrangement: Arrangement, placed: dict[str, Body], window: Array
) -> None:
    low, high = window
    for wall in arrangement.walls.values():
        _draw_wall(axes, wall, window)
    for name, colour in _colours(arrangement).items():
        for image in arrangement.lattice.copies(placed[name], low, high):
            for part in image.parts.values():
                outline = _outline(part)
                axes.add_patch(Polygon(outline, facecolor=colour, edgecolor=OUTLINE, linewidth=0.8))
    for axis in arrangement.lattice.axes:
        for place in (0.0, arrangement.lattice.lengths[axis]):
            draw = axes.axvline if axis == 0 else axes.axhline
            draw(place, color=OUTLINE, linestyle="--", linewidth=0.8)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def _draw_wall(axes: Axes, wall: HalfSpace | Cylinder, window: Array) -> None:
    """Draw the outside of a wall in grey."""
    middle, size = window.mean(axis=0), 2 * float(np.ptp(window[:, 0]))
    if isinstance(wall, HalfSpace):
        along = np.array([-wall.normal[1], wall.normal[0]])
        foot = middle - ((middle - wall.point) @ wall.normal) * wall.normal
        ends = np.array([foot - size * along, foot + size * along])
        area = np.concatenate([ends, ends[::-1] - size * wall.normal])
        axes.add_patch(Polygon(area, facecolor=OUTSIDE, edgecolor=OUTLINE, linewidth=0.8))
        return
    axes.add_patch(Polygon(_corners(middle, size), facecolor=OUTSIDE))
    azimuth = np.linspace(0, math.tau, WALL, endpoint=False)
    waves = (a * np.cos(k * azimuth + p) for k, (a, p) in wall.waves.items())
    radius = wall.radius + sum(waves, np.zeros(WALL))
    curve = wall.point + radius[:, None] * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    axes.add_patch(Polygon(curve, facecolor="white", edgecolor=OUTLINE, linewidth=0.8))


def _corners(middle: Array, size: float) -> Array:
    return np.asarray(middle + size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]))


def _outline(part: Part) -> Array:
    """Return the hull of circles around the points, counterclockwise ``(k, 2)``."""
    if part.radius == 0:
        return part.points
    angles = np.linspace(0, math.tau, ARC)
    circle = part.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    cloud = (part.points[:, None] + circle).reshape(-1, 2)
    return np.asarray(cloud[ConvexHull(cloud).vertices])


def _draw_space(
    axes: Any, arrangement: Arrangement, placed: dict[str, Body], window: Array
) -> None:
    low, high = window
    for name, colour in _colours(arrangement).items():
        for part in placed[name].parts.values():
            triangles, normals = _surface(part)
            tint = np.array(to_rgb(colour))
            shade = LIGHT.shade_normals(normals, fraction=1.0)[:, None]
            faces = tint * (0.35 + 0.65 * shade)
            axes.add_collection3d(Poly3DCollection(triangles, facecolors=faces, edgecolors="none"))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect((1, 1, 1), zoom=1.5)


def _surface(part: Part) -> tuple[Array, Array]:
    """Return triangles ``(k, 3, 3)`` of the surface and their normals ``(k, 3)``."""
    cloud = part.points
    if part.radius > 0:
        cloud = (part.points[:, None] + part.radius * _ball()).reshape(-1, 3)
    hull = ConvexHull(cloud)
    return cloud[hull.simplices], hull.equations[:, :3]


def _ball() -> Array:
    """Return points of the unit sphere along a spiral."""
    k = np.arange(BALL) + 0.5
    height, angle = 1 - 2 * k / BALL, k * math.pi * (3 - math.sqrt(5))
    width = np.sqrt(1 - height**2)
    return np.column_stack([width * np.cos(angle), width * np.sin(angle), height])
