"""Films of bodies, as a page that needs nothing else, GIF and MP4, and rows of pictures."""

import os
import webbrowser
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from polycorner.atomic import write_atomically
from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.motions import Motion, Poses, poses_of
from polycorner.bodies.posed import poses_in
from polycorner.bodies.robots import Robot
from polycorner.checks import real, reals, refuse, whole
from polycorner.kinds import checked
from polycorner.models.spheres import SphereCluster
from polycorner.motion.trajectory import Trajectory
from polycorner.pictures.arguments import sampled
from polycorner.pictures.arrangements import (
    FIXED,
    MARK,
    OUTLINE,
    colours_of,
    draw_around,
    grid_of,
    outlines,
    turns,
    wall_lines,
    window_of,
)
from polycorner.pictures.clusters import cluster_strip
from polycorner.pictures.films import RATE, SUFFIXES, Picture, write_frames
from polycorner.pictures.motion_pages import motion_page
from polycorner.pictures.rasters import Raster
from polycorner.polyhedra.strata import stratum_at
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property

SIZE = 640  # pixels
DOTS = 100  # per inch
PAGE = ".html"
MARKED = 0.008  # radius of the mark of a contact, of the window


@dataclass(frozen=True, eq=False)
class MotionFilm(Checked):
    """A film of bodies, shown by notebooks; :func:`film` makes it.

    Attributes
    ----------
    poses : Poses
        Where bodies are at each instant.
    fps : int
    speed : float
    size : int
    contacts : bool
    title : str
    """

    poses: Poses
    fps: int
    speed: float
    size: int
    contacts: bool
    title: str

    @cached_property
    def page(self) -> str:
        """The film as an HTML page that asks for nothing from elsewhere."""
        return motion_page(self.poses, title=self.title, speed=self.speed, contacts=self.contacts)

    def _repr_html_(self) -> str:
        frame = 'width="100%" height="720" style="border: 0" sandbox="allow-scripts"'
        return f'<iframe {frame} srcdoc="{escape(self.page)}"></iframe>'

    def show(self) -> Path:
        """Open the page in the browser, and return its file, in a folder for temporary files."""
        path = self.save(Path(mkdtemp(prefix="polycorner-")) / f"film{PAGE}")
        webbrowser.open(path.as_uri())
        return path

    @checked
    def save(
        self, path: str | os.PathLike[str], *, progress: Callable[[int, int], None] | None = None
    ) -> Path:
        """Write the film into a file that ends in ``.html``, ``.gif`` or ``.mp4``.

        Parameters
        ----------
        path : path
            MP4 needs the extra ``movies``.
        progress : callable, optional
            Called with the number of frames drawn and of all.

        Raises
        ------
        ValueError
            For another suffix, or for MP4 without imageio-ffmpeg.
        OSError
            If the file cannot be written.
        """
        suffix = Path(path).suffix.lower()
        if suffix == PAGE:
            return write_atomically(path, self.page, suffix=PAGE)
        if suffix not in SUFFIXES:
            refuse("path", "a file name that ends in .html, .gif or .mp4", os.fspath(path))
        shown = self._shown
        return write_frames(
            self._pictures(shown), len(shown), path, rate=self.fps, progress=progress
        )

    @property
    def _shown(self) -> Poses:
        """The bodies at the instants of the frames."""
        poses = self.poses
        if not poses.timed or len(poses) == 1:
            return poses
        span = float(poses.times[-1] - poses.times[0])
        count = max(2, round(span / self.speed * self.fps) + 1)
        return poses.between(np.linspace(poses.times[0], poses.times[-1], count))

    def _pictures(self, poses: Poses) -> Iterator[Picture]:
        window = window_of(poses)
        side = self.size / DOTS
        figure = Figure(figsize=(side, side), dpi=DOTS)
        canvas: Any = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 0.94))
        axes.set_axis_off()
        clock = figure.text(0.985, 0.97, "", ha="right", va="center", fontsize=11)
        figure.text(0.015, 0.97, self.title, va="center", fontsize=11)
        stage = (_Space if len(window[0]) == 3 else _Plane)(axes, poses, window)
        unit = " s" if poses.timed else ""
        for k, time in enumerate(poses.times.tolist()):
            stage.show(k, poses.marks(k) if self.contacts else np.empty((0, len(window[0]))))
            clock.set_text(f"{time:.2f}{unit}" if poses.timed else f"{time:g}")
            canvas.draw()
            yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


class _Plane:
    """The bodies of the plane as polygons, which move."""

    def __init__(self, axes: Any, poses: Poses, window: Array) -> None:
        self.poses, self.window = poses, window
        draw_around(axes, poses.arrangement, window)
        self.shapes = PolyCollection([], edgecolors=OUTLINE, linewidths=0.7, zorder=2)
        self.radii = LineCollection([], colors=OUTLINE, linewidths=0.7, zorder=3)
        for moving in (self.shapes, self.radii):
            axes.add_collection(moving, autolim=False)
        (self.marks,) = axes.plot([], [], "o", color=MARK, ms=3, zorder=4)
        low, high = window
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")

    def show(self, k: int, marks: Array) -> None:
        seen = [*outlines(self.poses, k, self.window)]
        self.shapes.set_verts([shape for _, shapes, _ in seen for shape in shapes])
        self.shapes.set_facecolor([colour for colour, shapes, _ in seen for _ in shapes])
        self.radii.set_segments([radius for *_, radii in seen for radius in radii])
        self.marks.set_data(*marks.T)


class _Space:
    """The bodies of space as an image, drawn anew."""

    def __init__(self, axes: Any, poses: Poses, window: Array) -> None:
        self.poses, self.window = poses, window
        self.size = round(axes.get_window_extent().height)
        self.tints, self.turning = colours_of(poses), turns(poses)
        self.lines = wall_lines(poses.arrangement, window)
        self.image = axes.imshow(np.ones((self.size, self.size, 3)), interpolation="none")

    def show(self, k: int, marks: Array) -> None:
        raster = Raster(self.size, self.window)
        poses, bodies = self.poses, [*self.poses.arrangement.named.values()]
        for number in np.flatnonzero(poses.present[k]).tolist():
            name = poses.names[number]
            place = poses.boxed[k, number], poses.matrices[k, number], self.tints[name]
            for part in bodies[poses.kinds[number]].parts.values():
                raster.part(part, *place, band=name in self.turning)
        for body in poses.arrangement.fixed.values():
            for part in body.parts.values():
                raster.part(part, np.zeros(3), np.eye(3), FIXED)
        raster.lines(self.lines, FIXED)
        raster.mark(marks, MARKED * float(np.ptp(self.window[:, 0])), MARK)
        self.image.set_data(raster.picture())


@checked
def film(
    arrangement: Arrangement | Robot,
    motion: Motion,
    path: str | os.PathLike[str] | None = None,
    *,
    fps: int = RATE,
    speed: float = 1.0,
    size: int = SIZE,
    contacts: bool = True,
    title: str = "",
) -> MotionFilm:
    """Return a film of a motion, and write it if a path is given.

    A notebook shows the film; ``film(...).show()`` opens it in the browser.

    Parameters
    ----------
    arrangement : Arrangement or Robot
        That moves; its bodies may be repeated.
    motion : Trajectory or array
        A motion of its system, or points ``(T, N)``, of bodies like one ``(T, n, k)``, one in a
        frame.
    path : path, optional
        ``.html`` is a page with a timeline that can be turned and zoomed and needs no network;
        ``.gif``; ``.mp4`` with the extra ``movies``.
    fps : int, optional
        Frames per second of a GIF or MP4.
    speed : float, optional
        Seconds of the motion that are shown in one second: 0.1 is slow motion.
    size : int, optional
        Pixels of each side of a GIF or MP4, 16 to 8192.
    contacts : bool, optional
        Whether contacts that touch are marked.
    title : str, optional

    Raises
    ------
    TypeError, ValueError
        For a motion of another arrangement, another suffix, or MP4 without imageio-ffmpeg.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> from polycorner import simulate
    >>> from polycorner.bodies import Arrangement, box, disc
    >>> a = Arrangement({"A": disc(0.2)}, box([0, 0], [2, 1]))
    >>> s = a.system(gravity=[0, -9.81], count=3, restitution=0.5)
    >>> start = s.state([[0.3, 0.5], [1.0, 0.6], [1.7, 0.7]])
    >>> shown = film(a, simulate(s, start, 0.5, 1e-3, every=20))
    >>> len(shown.poses), shown.page[:15]
    (26, '<!DOCTYPE html>')
    """
    poses = poses_in(arrangement, motion)
    made = film_of(poses, fps=fps, speed=speed, size=size, contacts=contacts, title=title)
    if path is not None:
        made.save(Path(path))
    return made


def film_of(
    poses: Poses,
    *,
    fps: int = RATE,
    speed: float = 1.0,
    size: int = SIZE,
    contacts: bool = True,
    title: str = "",
) -> MotionFilm:
    """Return a film of bodies whose places are known; see :func:`film`."""
    return MotionFilm(
        poses,
        whole("fps", fps, least=1),
        real("speed", speed, above=0),
        whole("size", size, least=16, most=8192),
        contacts,
        title,
    )


# --------------------------------------------------------------------------------- rows of pictures

MOST_NAMES = 3  # contacts that a caption names


@checked
def draw_motion(model: SphereCluster | Arrangement, polyline: Motion, frames: int = 6) -> Figure:
    """Draw frames of a motion side by side, from one end to the other.

    Along a polyline frames are at equal steps of arc length.  Contacts that persist are marked,
    of clusters by dark bars; those that open at the beginning or close at the end are named in the
    caption, and have bars of another colour there.  Frames of a :class:`~polycorner.Trajectory`
    are at equal times, with the contacts that touch.

    Parameters
    ----------
    model : SphereCluster or Arrangement
        The number of spheres, or the bodies.
    polyline : (k, n) array, or Trajectory
        Points along an edge, at least two, as in ``Edge.polyline``; or of an arrangement a motion
        of its system.
    frames : int, optional
        Number of pictures, at least 2.

    Raises
    ------
    TypeError, ValueError
        For a model, polyline or number of frames of another form.
    """
    frames = whole("frames", frames, least=2)
    if isinstance(model, SphereCluster):
        if isinstance(polyline, Trajectory):
            refuse("polyline", "points of the cluster", polyline, TypeError)
        return cluster_strip(model, polyline, frames)
    if isinstance(polyline, Trajectory):
        poses = poses_of(model, polyline, "polyline")
        shown = poses.between(np.linspace(poses.times[0], poses.times[-1], frames))
        return _strip(shown, [f"{time:.3g} s" for time in shown.times])
    return _along(model, polyline, frames)


def _along(model: Arrangement, polyline: Any, frames: int) -> Figure:
    """Draw a motion along an edge, by arc length."""
    given, polyhedron = reals("polyline", polyline), model.polyhedron
    if given.ndim != 2 or len(given) < 2:
        refuse("polyline", "at least two points (k, n)", given.shape)
    line = model.manifold.points(given, "polyline")
    closed = [set(stratum_at(polyhedron, q, tolerance=DEFAULT.same).active) for q in line]
    held = set.intersection(*closed)
    rows = [polyhedron.names.index(name) for name in sorted(held)]
    places, moments = sampled(polyhedron, line, rows, frames)
    changed = [closed[0] - held, *[set[str]()] * (frames - 2), closed[-1] - held]
    verbs = ["opening", *[""] * (frames - 2), "closing"]
    titles = [
        f"{moment:.2f}\n{verb} {_named(names)}" if names else f"{moment:.2f}\n"
        for moment, verb, names in zip(moments.tolist(), verbs, changed, strict=True)
    ]
    touching = tuple(tuple(((0,), name, 0.0) for name in held | some) for some in changed)
    return _strip(poses_of(model, places).touched(touching), titles)


def _strip(poses: Poses, titles: list[str]) -> Figure:
    return grid_of([poses], [poses.marks(k) for k in range(len(poses))], titles, len(poses))


def _named(contacts: set[str]) -> str:
    if len(contacts) > MOST_NAMES:
        return f"{len(contacts)} contacts"
    return ", ".join(sorted(contacts))
