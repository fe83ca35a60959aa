"""Motions as rows of pictures: of clusters, and of bodies of any shape."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.motions import Motion, Poses, poses_of
from polycorner.checks import reals, refuse, whole
from polycorner.kinds import checked
from polycorner.models.spheres import SphereCluster
from polycorner.motion.trajectory import Trajectory
from polycorner.pictures.arguments import sampled
from polycorner.pictures.arrangements import grid_of
from polycorner.pictures.clusters import cluster_strip
from polycorner.polyhedra.strata import stratum_at
from polycorner.tolerances import DEFAULT

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
