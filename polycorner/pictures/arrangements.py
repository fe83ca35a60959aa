"""Figures of rigid bodies in their places, in the plane and in space."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LightSource, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from numpy.typing import ArrayLike

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.frames import AXES
from polycorner.bodies.lattices import Lattice
from polycorner.bodies.motions import Poses
from polycorner.bodies.posed import poses_in
from polycorner.bodies.robots import Robot
from polycorner.bodies.shapes import Body
from polycorner.bodies.sizes import Resized
from polycorner.bodies.surfaces import outline, surface
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.checks import refuse, whole
from polycorner.kinds import checked
from polycorner.pictures import arguments
from polycorner.polyhedra.strata import stratum_at
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

# Okabe and Ito's colours, which stay apart for colour-blind readers.
COLOURS = ("#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#F0E442", "#0072B2", "#D55E00")
FIXED, OUTSIDE, OUTLINE, MARK = "0.55", "0.85", "0.2", "#C00000"
CELL, ALONE = 2.4, 5.5  # width of a picture in inches, beside others and alone
MOST_NAMES = 20  # bodies whose names are written
MARGIN = 0.15  # around bodies, of their extent
ROOM = 2.0  # a round wall that is larger than this many times what is in it is not seen whole
WALL = 360  # points of the inside of a circle or cylinder
ARROW = 0.3  # length of that of the largest force, of half the window
LIGHT = LightSource(azdeg=315, altdeg=50)


@checked
def draw_arrangement(
    arrangement: Arrangement | Resized | Robot,
    points: ArrayLike,
    *,
    titles: Sequence[str] | None = None,
    columns: int = 4,
    axes: bool | None = None,
    names: bool | None = None,
    contacts: bool | ArrayLike | None = None,
    forces: ArrayLike | None = None,
) -> Figure:
    """Draw the bodies at one point or several, side by side at the same scale.

    Bodies have different colours, fixed ones are grey.  In the plane the outside of walls is grey,
    and discs whose rotation is a coordinate have a radius; in space walls are outlines.  A periodic
    box has dashed sides; in the plane all images are drawn that are seen, in space those whose
    origins are in the box.

    Parameters
    ----------
    arrangement : Arrangement, Robot, or Resized
        The last of :func:`~polycorner.bodies.thinned` or `scaled`.
    points : (N,), (T, N) or (T, n, k) array
        The last for ``n`` bodies like one, such as ``path.q[[-1]]`` of a motion.
    titles : sequence of str, optional
        One for each picture.
    columns : int, optional
        Largest number side by side.
    axes, names : bool, optional
        Whether there are coordinates around a picture, and names on bodies; default where there is
        one picture, and names for up to 20 bodies.
    contacts : bool or (m, d) array, optional
        Points that are marked.  True for those of the contacts that are closed at the points; they
        have to be ``(N,)`` or ``(T, N)`` then.
    forces : (m, d) array, optional
        Forces at the contacts of a single picture, drawn as arrows.

    Raises
    ------
    TypeError, ValueError
        For points of another manifold, another number of titles, or forces that do not belong to
        contacts.
    """
    if isinstance(arrangement, Resized):
        places = np.atleast_2d(arrangement.manifold.points(points, "points"))
        each: list[Any] = [(arrangement.at(q), q[:-1]) for q in places]
    else:
        each = [(arrangement, points)]
    several = [poses_in(model, q, "points") for model, q in each]
    marks = [
        mark
        for poses, (model, q) in zip(several, each, strict=True)
        for mark in _marks(poses, model, q, contacts)
    ]
    count, poses = len(marks), several[0]
    if titles is not None and len(titles) != count:
        refuse("titles", f"{count} titles, one for each point", len(titles))
    pushes = None
    if forces is not None:
        d = poses.arrangement.dimension
        pushes = finite(arguments.points("forces", forces, d), "forces")
        if count > 1 or pushes.shape != marks[0].shape:
            refuse("forces", "one for each of the contacts of a single picture", forces)
    columns = min(whole("columns", columns, least=1), count)
    named = count == 1 and len(poses.kinds) <= MOST_NAMES if names is None else names
    framed = count == 1 if axes is None else axes
    return grid_of(several, marks, titles, columns, framed=framed, named=named, forces=pushes)


def grid_of(
    several: Sequence[Poses],
    marks: Sequence[Array],
    titles: Sequence[str] | None,
    columns: int,
    *,
    framed: bool = False,
    named: bool = False,
    forces: Array | None = None,
) -> Figure:
    """Draw bodies at each instant side by side at the same scale, with marks ``(m, d)``."""
    shown = [(poses, k) for poses in several for k in range(len(poses))]
    count, space = len(shown), several[0].arrangement.dimension == 3
    rows, cell = math.ceil(count / columns), ALONE if count == 1 else CELL
    windows = np.array([window_of(poses) for poses in several])
    window = np.array([windows[:, 0].min(axis=0), windows[:, 1].max(axis=0)])
    lines = 0.2 + 0.25 * max((title.count("\n") for title in titles or ()), default=0)
    figure = Figure(figsize=(cell * columns, (cell + lines) * rows), layout="constrained")
    kind = {"projection": "3d", "computed_zorder": False} if space else {}
    grid = figure.subplots(rows, columns, squeeze=False, subplot_kw=kind)
    for k, pane in enumerate(grid.flat):
        if k >= count or not framed:
            pane.set_axis_off()
        else:
            _label(pane, several[0].arrangement)
        if k < count:
            poses, at = shown[k]
            (draw_space if space else draw_plane)(pane, poses, at, window)
            if space:
                pane.set_box_aspect((1, 1, 1), zoom=0.9 if framed else 1.15)
            _annotate(pane, poses.placed(at) if named else {}, marks[k], forces, window)
            if titles is not None:
                pane.set_title(titles[k], fontsize=9)
    return figure


def _marks(
    poses: Poses, model: Arrangement | Robot, points: ArrayLike, contacts: Any
) -> list[Array]:
    """Return the points ``(m, d)`` that are marked in each picture."""
    d, count = poses.arrangement.dimension, len(poses)
    if contacts is None or contacts is False:
        return [np.empty((0, d))] * count
    if contacts is not True:
        if count > 1:
            refuse("contacts", "True for several pictures, or points of a single one", contacts)
        return [finite(arguments.points("contacts", contacts, d), "contacts")]
    if np.ndim(points) > 2:
        refuse("contacts", "points (m, d), where bodies are repeated", contacts)
    places = np.atleast_2d(np.asarray(points, dtype=np.float64))
    closed = [stratum_at(model.polyhedron, q, tolerance=DEFAULT.same).active for q in places]
    touching = tuple(tuple(((0,), name, 0.0) for name in some) for some in closed)
    seen = poses.touched(touching)
    return [seen.marks(k) for k in range(count)]


# ------------------------------------------------------------------------------------- the window


def window_of(poses: Poses) -> Array:
    """Return two opposite corners ``(2, d)`` of a cube around all bodies, or the box around them.

    The box is that of periods, or of pairs of walls across an axis.
    """
    arrangement = poses.arrangement
    low, high = extent_of(poses)
    lengths = arrangement.lattice.lengths
    periodic = np.isfinite(lengths)
    low, high = np.where(periodic, 0.0, low), np.where(periodic, lengths, high)
    below, above = _between_walls(arrangement)
    boxed = np.isfinite(above - below)
    low = np.where(boxed, np.minimum(low, below), low)
    high = np.where(boxed, np.maximum(high, above), high)
    for wall in arrangement.walls.values():
        if isinstance(wall, Cylinder) and 2 * wall.radius < ROOM * (high - low).max():
            across = np.ones(len(low)) if wall.axis is None else np.sqrt(1 - wall.axis**2)
            low = np.minimum(low, np.where(across > 0, wall.point - across * wall.radius, low))
            high = np.maximum(high, np.where(across > 0, wall.point + across * wall.radius, high))
    half = (0.5 + MARGIN) * (high - low).max()
    return np.array([(low + high) / 2 - half, (low + high) / 2 + half])


def extent_of(poses: Poses) -> tuple[Array, Array]:
    """Return the lowest and highest coordinates of bodies that are there at any instant."""
    lows, highs = [], []
    for kind, body in enumerate(poses.arrangement.named.values()):
        own = poses.kinds == kind
        here = poses.present[:, own]
        origins, matrices = poses.boxed[:, own][here], poses.matrices[:, own][here]
        for part in body.parts.values() if len(origins) else ():
            places = origins[:, None] + np.einsum("mij,pj->mpi", matrices, part.points)
            lows.append(places.min(axis=(0, 1)) - part.radius)
            highs.append(places.max(axis=(0, 1)) + part.radius)
    for body in poses.arrangement.fixed.values():
        for part in body.parts.values():
            lows.append(part.points.min(axis=0) - part.radius)
            highs.append(part.points.max(axis=0) + part.radius)
    if not lows:
        refuse("motion", "at least one body that is there", "none")
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _between_walls(arrangement: Arrangement) -> tuple[Array, Array]:
    """Return where walls across each axis are, on either side; infinite where there is none."""
    d = arrangement.dimension
    below, above = np.full(d, -np.inf), np.full(d, np.inf)
    for wall in arrangement.walls.values():
        if isinstance(wall, HalfSpace) and np.abs(wall.normal).max() > 1 - DEFAULT.alike:
            axis = int(np.abs(wall.normal).argmax())
            if wall.normal[axis] > 0:
                below[axis] = max(below[axis], wall.point[axis])
            else:
                above[axis] = min(above[axis], wall.point[axis])
    return below, above


def colours_of(poses: Poses) -> dict[str, str]:
    """Return a colour for each body: one for each kind, and grey for fixed ones."""
    moving = {
        name: COLOURS[kind % len(COLOURS)]
        for name, kind in zip(poses.names, poses.kinds.tolist(), strict=True)
    }
    return moving | dict.fromkeys(poses.arrangement.fixed, FIXED)


# --------------------------------------------------------------------------------------- the plane


def draw_plane(axes: Axes, poses: Poses, k: int, window: Array) -> None:
    """Draw the bodies at an instant, and what is around them, in the plane."""
    low, high = window
    draw_around(axes, poses.arrangement, window)
    for colour, shapes, radii in outlines(poses, k, window):
        for shape in shapes:
            axes.add_patch(Polygon(shape, facecolor=colour, edgecolor=OUTLINE, linewidth=0.8))
        axes.add_collection(LineCollection([*radii], colors=OUTLINE, linewidths=0.8))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")


def draw_around(axes: Axes, arrangement: Arrangement, window: Array) -> None:
    """Draw walls and the sides of a periodic box in the plane."""
    for wall in arrangement.walls.values():
        _draw_wall(axes, wall, window)
    for axis in arrangement.lattice.axes:
        for place in (0.0, arrangement.lattice.lengths[axis]):
            draw = axes.axvline if axis == 0 else axes.axhline
            draw(place, color=OUTLINE, linestyle="--", linewidth=0.8)


def outlines(poses: Poses, k: int, window: Array) -> Iterator[tuple[str, Array, Array]]:
    """Yield the outlines that are seen at an instant, by parts: those of all bodies of a kind.

    Yields
    ------
    colour : str
    outlines : (m, c, 2) array
    radii : (m, 2, 2) or (0, 2, 2) array
        Which show how discs are turned, where that is a coordinate.
    """
    tints, turning, lattice = colours_of(poses), turns(poses), poses.arrangement.lattice
    for kind, body in enumerate(poses.arrangement.named.values()):
        there = np.flatnonzero((poses.kinds == kind) & poses.present[k])
        if not len(there):
            continue
        first = poses.names[there[0]]
        places = [poses.boxed[k, there] + shift for shift in _shifts(lattice, body, window)]
        origins = np.concatenate(places)
        matrices = np.tile(poses.matrices[k, there], (len(places), 1, 1))
        for part in body.parts.values():
            shapes = _carried(origins, matrices, outline(part))
            radii = _carried(origins, matrices, part.points[0] + np.diag([0, part.radius])[:, ::-1])
            low, high = shapes.min(axis=1), shapes.max(axis=1)
            seen = ((high >= window[0]) & (low <= window[1])).all(axis=1)
            yield tints[first], shapes[seen], radii[seen & (first in turning)]
    for name, body in poses.arrangement.fixed.items():
        for image in lattice.copies(body, *window):
            for part in image.parts.values():
                yield tints[name], outline(part)[None], np.empty((0, 2, 2))


def _carried(origins: Array, matrices: Array, points: Array) -> Array:
    """Return points ``(c, d)`` of several bodies in their places, ``(m, c, d)``."""
    return np.asarray(origins[:, None] + np.einsum("mij,cj->mci", matrices, points))


def _shifts(lattice: Lattice, body: Body, window: Array) -> Iterator[Array]:
    """Yield displacements of images that may be seen of a body in the box."""
    ranges = [range(1)] * len(lattice.lengths)
    for axis in lattice.axes:
        length, reach = lattice.lengths[axis], 2 * body.size
        least = math.floor((window[0, axis] - length - reach) / length)
        ranges[axis] = range(least, math.ceil((window[1, axis] + reach) / length) + 1)
    for whole_periods in product(*ranges):
        yield lattice.shift(whole_periods)


def turns(poses: Poses) -> dict[str, int]:
    """Return the numbers of the bodies that are round and turn, by name."""
    spins = [p.spins and p.is_round for p in poses.arrangement.placements]
    kinds = poses.kinds.tolist()
    return {name: k for k, name in enumerate(poses.names) if spins[kinds[k]]}


def _draw_wall(axes: Axes, wall: Wall, window: Array) -> None:
    """Draw the outside of a wall in grey."""
    middle, size = window.mean(axis=0), 2 * float(np.ptp(window[:, 0]))
    if isinstance(wall, HalfSpace):
        along = np.array([-wall.normal[1], wall.normal[0]])
        foot = middle - ((middle - wall.point) @ wall.normal) * wall.normal
        ends = np.array([foot - size * along, foot + size * along])
        area = np.concatenate([ends, ends[::-1] - size * wall.normal])
        axes.add_patch(Polygon(area, facecolor=OUTSIDE, edgecolor=OUTLINE, linewidth=0.8))
        return
    corners = middle + size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    axes.add_patch(Polygon(corners, facecolor=OUTSIDE))
    axes.add_patch(Polygon(circle_of(wall), facecolor="white", edgecolor=OUTLINE, linewidth=0.8))


def circle_of(wall: Cylinder) -> Array:
    """Return the points ``(k, d)`` of a round wall across its axis, all around once."""
    azimuth = np.linspace(0, math.tau, WALL, endpoint=False)
    radius = wall.radius + sum(
        (a * np.cos(k * azimuth + p) for k, (a, p) in wall.waves.items()), np.zeros(WALL)
    )
    first, second = wall.around if wall.dimension == 2 or wall.axis is not None else np.eye(3)[:2]
    around = np.cos(azimuth)[:, None] * first + np.sin(azimuth)[:, None] * second
    return np.asarray(wall.point + radius[:, None] * around)


# ----------------------------------------------------------------------------------------- space


def draw_space(axes: Any, poses: Poses, k: int, window: Array) -> None:
    """Draw the bodies at an instant, and outlines of walls, in space."""
    low, high = window
    tints, shades = colours_of(poses), []
    triangles: list[Array] = []
    for name, body in poses.placed(k).items():
        for part in body.parts.values():
            vertices, faces, normals = surface(part)
            seen = normals[faces].mean(axis=1)
            shade = LIGHT.shade_normals(seen, fraction=1.0)[:, None]
            triangles.append(vertices[faces])
            shades.append(np.array(to_rgb(tints[name])) * (0.35 + 0.65 * shade))
    # One collection, since matplotlib sorts by depth within collections only.
    drawn = Poly3DCollection(
        np.concatenate(triangles), facecolors=np.concatenate(shades), edgecolors="none", zorder=2
    )
    axes.add_collection3d(drawn)
    # matplotlib takes the limits of a collection from its lines and refuses to have none.
    if lines := wall_lines(poses.arrangement, window):
        axes.add_collection3d(Line3DCollection(lines, colors=FIXED, linewidths=0.7, zorder=1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))


def wall_lines(arrangement: Arrangement, window: Array) -> list[Array]:
    """Return outlines ``(k, 3)`` of walls and of a periodic box in space, within a window."""
    low, high = window
    below, above = _between_walls(arrangement)
    lengths = arrangement.lattice.lengths
    below = np.where(np.isfinite(lengths), 0.0, np.maximum(below, low))
    above = np.where(np.isfinite(lengths), lengths, np.minimum(above, high))
    found = []
    for wall in arrangement.walls.values():
        if isinstance(wall, HalfSpace):
            found.append(_section(wall, below, above))
        elif wall.axis is None:
            for turned in np.eye(3):
                circle = circle_of(Cylinder(wall.radius, axis=turned, point=wall.point))
                found.append(np.concatenate([circle, circle[:1]]))
        else:
            found += _tube(wall, low, high)
    for axis in arrangement.lattice.axes:
        for sign in (1.0, -1.0):
            normal = sign * np.eye(3)[axis]
            found.append(_section(HalfSpace(normal, below if sign > 0 else above), below, above))
    return [line for line in found if len(line)]


def _section(wall: HalfSpace, low: Array, high: Array) -> Array:
    """Return the closed polygon in which a plane cuts a box."""
    corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])
    heights = (corners - wall.point) @ wall.normal
    on = abs(heights) <= DEFAULT.alike * np.ptp(corners)
    found = [*corners[on]]
    for i in range(8):
        for j in (i | 1, i | 2, i | 4):
            if i < j and not (on[i] or on[j]) and heights[i] * heights[j] < 0:
                share = heights[i] / (heights[i] - heights[j])
                found.append(corners[i] + share * (corners[j] - corners[i]))
    if len(found) < 3:
        return np.empty((0, 3))
    points = np.array(found)
    away = points - points.mean(axis=0)
    first = away[0] / np.linalg.norm(away[0])
    order = np.argsort(np.arctan2(away @ np.cross(wall.normal, first), away @ first))
    return np.asarray(points[[*order, order[0]]])


def _tube(wall: Cylinder, low: Array, high: Array) -> Iterator[Array]:
    """Yield two circles of a cylinder, where it leaves a box, and four lines between them."""
    assert wall.axis is not None
    reach = abs(wall.axis) @ (high - low) / 2
    middle = ((low + high) / 2 - wall.point) @ wall.axis
    ends = [circle_of(wall) + (middle + side * reach) * wall.axis for side in (-1, 1)]
    yield from (np.concatenate([end, end[:1]]) for end in ends)
    yield from np.stack(ends, axis=1)[:: WALL // 4]


# ------------------------------------------------------------------------------- what is beside it


def _label(axes: Any, arrangement: Arrangement) -> None:
    unit = f" ({arrangement.unit})" if arrangement.unit else ""
    letters = AXES[: arrangement.dimension]
    axes.set(**{f"{letter}label": f"{letter}{unit}" for letter in letters})


def _annotate(
    axes: Any, named: Mapping[str, Body], marks: Array, forces: Array | None, window: Array
) -> None:
    """Write names on bodies, mark contacts, and draw forces as arrows."""
    halo = [withStroke(linewidth=2.5, foreground="white", alpha=0.8)]
    words: dict[str, Any] = {"ha": "center", "va": "center", "path_effects": halo, "zorder": 8}
    for name, body in named.items():
        axes.text(*body.markers.mean(axis=0), name, fontsize=10, **words)
    if len(marks):
        axes.plot(*marks.T, "o", color=MARK, mec="white", mew=0.6, ms=5, ls="", zorder=7)
    if forces is None or not len(forces) or not (largest := np.linalg.norm(forces, axis=1).max()):
        return
    arrows = ARROW * float(np.ptp(window[:, 0])) / 2 / largest * forces
    if len(window[0]) == 3:
        axes.quiver(*marks.T, *arrows.T, color=MARK, linewidth=1.6, zorder=9)
    else:
        style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "zorder": 9}
        axes.quiver(*marks.T, *arrows.T, color=MARK, width=0.006, **style)
