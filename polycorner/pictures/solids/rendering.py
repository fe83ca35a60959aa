"""Figures of solids with curves and points on them, hidden parts drawn thin."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any, Protocol

import numpy as np
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import about, instance, refuse
from polycorner.kinds import checked
from polycorner.pictures import arguments
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]

# Red, green and blue of the solid and of the faces at which it is cut.
_SOLID, _CUT = (0.80, 0.84, 0.88), (0.97, 0.94, 0.86)
# Directions towards the lights: right, up, towards the eye.
_KEY_LIGHT, _FILL_LIGHT = (-0.7, 0.8, 0.9), (0.9, 0.1, 0.6)
CURVES = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


class Triangles(Protocol):
    """A triangulated surface: vertices ``(V, 3)`` and outward faces ``(F, 3)``."""

    vertices: Any
    faces: Any


@dataclass(frozen=True)
class View(Checked):
    """A direction of sight, and the units and proportions of the axes.

    Parameters
    ----------
    elevation, azimuth : float
        Position of the eye in degrees, as in matplotlib.
    factors : three float
        Factors of the coordinates on the axes, such as degrees per radian.
    height : float
        Length of the third axis on the page against the longer of the first two, which share
        one scale.
    """

    elevation: float = 22.0
    azimuth: float = -35.0
    factors: tuple[float, float, float] = (1.0, 1.0, math.degrees(1.0))
    height: float = 1.1


@checked
def draw_solid(
    mesh: Triangles,
    curves: Sequence[tuple[str, ArrayLike]] = (),
    points: ArrayLike = (),
    labels: Sequence[str] = (),
    *,
    caps: Mask | None = None,
    view: View | None = None,
    names: tuple[str, str, str] = ("x (mm)", "y (mm)", "relative heading (°)"),
    title: str = "",
) -> Figure:
    """Draw a solid, lit from the upper left and the right, with curves and points over it.

    Hidden curves are thin and dashed, hidden points hollow.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        Anything with ``vertices (V, 3)`` and outward ``faces (F, 3)``; shading is sharp between
        smooth parts, given as ``face_attributes["part"]`` ``(F,)``.
    curves : sequence of (label, (k, 3) array), optional
        Polylines, broken at rows of NaN; those with the same label share colour and key.
    points : (m, 3) array_like, optional
        Points in the coordinates of the mesh.
    labels : sequence of m str, optional
        Texts beside the points.
    caps : (F,) bool, optional
        Faces at which the solid was cut, drawn paler.
    view : View, optional
        Direction of sight, and units of the axes.
    names : three str, optional
        Labels of the axes with their units.
    title : str, optional
        Title of the figure.

    Raises
    ------
    ValueError
        If there are labels but not one for each point.
    """
    marks = arguments.points("points", points)
    if len(labels) not in {0, len(marks)}:
        refuse("labels", f"one for each of {len(marks)} points", list(labels))
    figure = Figure(figsize=(7.2, 7.2))
    axes: Any = figure.add_axes((-0.02, 0.0, 0.98, 0.96), projection="3d", computed_zorder=False)
    palette = dict(zip(dict.fromkeys(label for label, _ in curves), cycle(CURVES), strict=False))
    named = list(zip(labels or [""] * len(marks), marks, strict=True))
    place_solid(axes, mesh, curves, named, palette=palette, caps=caps, view=view, names=names)
    if title:
        figure.suptitle(title, y=0.97)
    if curves:
        axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.02, 1.0), fontsize=9)
    return figure


@checked
def place_solid(
    axes: Any,
    mesh: Triangles,
    curves: Sequence[tuple[str, ArrayLike]],
    marks: Sequence[tuple[str, ArrayLike]],
    *,
    palette: Mapping[str, str],
    caps: Mask | None = None,
    view: View | None = None,
    names: tuple[str, str, str] = ("x (mm)", "y (mm)", "relative heading (°)"),
) -> None:
    """Draw a solid with curves and points on given axes, see :func:`draw_solid`.

    Parameters
    ----------
    axes : Axes3D
        With ``computed_zorder=False``.
    marks : sequence of (label, point)
        Points ``(3,)`` in the coordinates of the mesh; an empty label leaves the mark alone.
    palette : mapping from str to str
        Colours of the curves by their labels.  The rest is as for :func:`draw_solid`.
    """
    instance("axes", axes, Axes3D)
    lines = [(label, arguments.points("curves", curve)) for label, curve in curves]
    places = arguments.points("marks", [point for _, point in marks])
    for label, line in lines:
        if not len(line):
            refuse("curves", "polylines of one point at least", line)
        if not is_color_like(palette.get(label)):
            refuse("palette", f"a colour for {label!r}", palette.get(label))
    with about("caps"):
        cut = np.zeros(len(mesh.faces), bool) if caps is None else np.asarray(caps)
    if cut.shape != (len(mesh.faces),) or cut.dtype != bool:
        refuse("caps", f"a truth value for each of {len(mesh.faces)} faces", caps)
    box = _Box(mesh, view or View())
    depth = _Depth(mesh, box)
    _frame(axes, box, names)
    _draw_faces(axes, mesh, cut, box)
    _draw_curves(axes, lines, palette, box, depth)
    _draw_points(axes, places, [label for label, _ in marks], box, depth)


@checked
def visible(mesh: Triangles, points: ArrayLike, view: View) -> Mask:
    """Return a mask of the points ``(m, 3)``, on or outside a solid, that it does not hide.

    Points may lie behind the mesh by 2.5 times the median side of a face (at most 0.05 of the
    longer horizontal side of the box), since the inverted edges of the true surface lie beneath
    it; by one side where the mesh has parts, and so edges.  Rows of NaN are not visible.
    """
    return _Depth(mesh, _Box(mesh, view)).sees(arguments.points("points", points))


class _Box:
    """The bounding box of a mesh in a view: from coordinates to places on the page."""

    def __init__(self, mesh: Triangles, view: View) -> None:
        vertices = np.asarray(mesh.vertices)
        self.view, self.low, self.high = view, vertices.min(axis=0), vertices.max(axis=0)
        self.factors = np.array(view.factors)
        sides = (self.high - self.low) * self.factors
        longest = max(sides[0], sides[1])
        self.proportions = np.array([sides[0] / longest, sides[1] / longest, view.height])
        e, a = math.radians(view.elevation), math.radians(view.azimuth)
        eye = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        self.frame = np.stack([right, np.cross(eye, right), eye], axis=1)

    def inside(self, points: Array) -> Array:
        """Return points in the box, the longer horizontal side being one."""
        return np.asarray((points - self.low) / (self.high - self.low) * self.proportions)

    def seen(self, points: Array) -> Array:
        """Return places to the right, upwards and towards the eye."""
        return np.asarray(self.inside(points) @ self.frame)


class _Depth:
    """A depth buffer of a mesh, with pixels finer than its faces."""

    def __init__(self, mesh: Triangles, box: _Box) -> None:
        self.box = box
        corners = box.seen(np.asarray(mesh.vertices))[np.asarray(mesh.faces)]
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
        sharp = _parts(mesh) is not None
        self.slack = min((1.0 if sharp else 2.5) * float(np.median(sides)), 0.05)
        self.pixel = self.slack / (3 if sharp else 6)
        # Large faces need many samples, small ones few; pixels at the border stay empty.
        counts = np.ceil(1.5 * sides.max(axis=1) / self.pixel).astype(int)
        self.low = corners[..., :2].min(axis=(0, 1)) - 1.5 * self.pixel
        reach = corners[..., :2].max(axis=(0, 1)) - self.low
        self.nearest = np.full(np.floor(reach / self.pixel).astype(int) + 2, -np.inf)
        for count in np.unique(counts):
            samples = np.einsum("sk,fki->fsi", _barycentric(count), corners[counts == count])
            flat = samples.reshape(-1, 3)
            np.maximum.at(self.nearest, self._pixels(flat), flat[:, 2])
        if sharp:  # beside an inverted edge, what is steep and near does not hide it
            from scipy.ndimage import minimum_filter

            self.nearest = minimum_filter(self.nearest, 3)

    def _pixels(self, seen: Array) -> tuple[Any, Any]:
        place = np.floor((seen[:, :2] - self.low) / self.pixel)
        within = np.clip(np.nan_to_num(place), 0, np.array(self.nearest.shape) - 1).astype(int)
        return within[:, 0], within[:, 1]

    def sees(self, points: Array) -> Mask:
        """Return which points are not hidden; see :func:`visible`."""
        seen = self.box.seen(points)
        return np.asarray(seen[:, 2] >= self.nearest[self._pixels(seen)] - self.slack)


def _barycentric(steps: int) -> Array:
    """Return evenly spread weights of three corners, ``(s, 3)``."""
    i, j = np.mgrid[0 : steps + 1, 0 : steps + 1].reshape(2, -1)
    inside = i + j <= steps
    return np.asarray(np.stack([i, j, steps - i - j], axis=1)[inside] / steps)


def _frame(axes: Any, box: _Box, names: Sequence[str]) -> None:
    from matplotlib.ticker import MaxNLocator, MultipleLocator

    axes.set_proj_type("ortho")
    axes.view_init(elev=box.view.elevation, azim=box.view.azimuth)
    axes.set_box_aspect(tuple(box.proportions), zoom=0.92)
    ends = zip((axes.xaxis, axes.yaxis, axes.zaxis), box.low, box.high, box.factors, strict=True)
    for (axis, low, high, factor), letter, name in zip(ends, "xyz", names, strict=True):
        axes.set(**{f"{letter}lim": (low * factor, high * factor), f"{letter}label": name})
        axis.labelpad = 6
        degrees = name.endswith("(°)")
        axis.set_major_locator(MultipleLocator(45) if degrees else MaxNLocator(5, steps=[1, 2, 5]))
        axis.pane.fill = False
        axis.pane.set_edgecolor("0.85")
    axes.grid(visible=False)


def _draw_faces(axes: Any, mesh: Triangles, cut: Mask, box: _Box) -> None:
    faces, vertices = np.asarray(mesh.faces), np.asarray(mesh.vertices)
    # A cap shares no vertex with what it cuts, nor a part with another: rims and edges are sharp.
    smooth = np.zeros(len(cut)) if (parts := _parts(mesh)) is None else parts
    piece = np.unique(np.stack([cut, smooth], axis=1), axis=0, return_inverse=True)[1].reshape(-1)
    own = np.unique(faces + len(vertices) * piece[:, None], return_inverse=True)[1]
    corners = box.seen(vertices)[faces]
    normals = _smooth_normals(corners, own.reshape(faces.shape))
    lights = np.array([_KEY_LIGHT, _FILL_LIGHT])
    directions = lights / np.linalg.norm(lights, axis=1)[:, None]
    shade = 0.5 + np.clip(normals @ directions.T, 0, 1) @ np.array([0.4, 0.2])
    colours = np.clip(shade[:, None] * np.where(cut[:, None], _CUT, _SOLID), 0, 1)
    front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0
    drawn = (vertices * box.factors)[faces[front]]
    shown = colours[front]
    surface = Poly3DCollection(drawn, facecolors=shown, edgecolors=shown, linewidths=0.3, zorder=1)
    surface.set_rasterized(True)  # of no effect but in vector graphics, where it keeps files small
    axes.add_collection3d(surface)


def _parts(mesh: Triangles) -> Indices | None:
    found: Indices | None = getattr(mesh, "face_attributes", {}).get("part")
    return found


def _smooth_normals(corners: Array, faces: Indices) -> Array:
    """Return unit normals of faces, averaged with those of neighbours that are nearly parallel.

    Faces of marching cubes are of very different sizes; each is shaded like its surroundings.
    """
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.maximum(np.linalg.norm(areas, axis=1), np.finfo(np.float64).tiny)[:, None]
    normals = np.asarray(areas / sizes)
    for _ in range(4):
        total = np.zeros((faces.max() + 1, 3))
        for k in range(3):
            np.add.at(total, faces[:, k], sizes * normals)
        mean = total[faces].sum(axis=1)
        length = np.linalg.norm(mean, axis=1)[:, None]
        alike = (mean * normals).sum(axis=1)[:, None] > 0.85 * length
        normals = np.where(alike, mean / np.where(alike, length, 1.0), normals)
    return normals


def _draw_curves(
    axes: Any,
    curves: Sequence[tuple[str, Array]],
    palette: Mapping[str, str],
    box: _Box,
    depth: _Depth,
) -> None:
    named = set[str]()
    for label, line in curves:
        key, colour = None if label in named else label, palette[label]
        named.add(label)
        seen = _settled(depth.sees(line))
        # Pieces in sight and out of sight share the points at which they meet.
        behind = ~seen
        behind[1:] |= ~seen[:-1]
        behind[:-1] |= ~seen[1:]
        drawn = line * box.factors
        front, back = (np.where(m[:, None], drawn, np.nan).T for m in (seen, behind))
        axes.plot(*back, color=colour, lw=0.7, ls=(0, (4, 3)), alpha=0.55, zorder=2)
        axes.plot(*front, color=colour, lw=1.7, label=key, zorder=3)


def _settled(seen: Mask) -> Mask:
    """Return visibility along a curve by the majority of a tenth of it, of five points at least."""
    side = max(2, len(seen) // 20)
    padded = np.pad(seen.astype(int), side, mode="reflect")
    return np.asarray(np.convolve(padded, np.ones(2 * side + 1), mode="valid") > side)


def _draw_points(axes: Any, marks: Array, labels: Sequence[str], box: _Box, depth: _Depth) -> None:
    drawn = marks * box.factors
    for k, seen in enumerate(depth.sees(marks)):
        face = "black" if seen else "white"
        style = {"ms": 4.5 if seen else 3.5, "mfc": face, "mec": "black", "mew": 0.7}
        axes.plot(*drawn[k][:, None], "o", alpha=1.0 if seen else 0.5, zorder=4, **style)
        if labels[k]:
            halo = [withStroke(linewidth=2, foreground="white", alpha=0.8)]
            words = {"fontsize": 10, "alpha": 1.0 if seen else 0.5, "zorder": 5}
            axes.text(*drawn[k], f"  {labels[k]}", path_effects=halo, **words)
