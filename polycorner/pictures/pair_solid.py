"""The solid of forbidden placements of a pair, with the corners and edges of its atlas over it."""

import math
from collections import Counter
from pathlib import Path

import numpy as np

from polycorner.geometry.manifold import Array
from polycorner.pictures.meshes import write_mesh
from polycorner.pictures.plots import save
from polycorner.pictures.solids import draw_solid, forbidden_solid, relative_coordinates
from polycorner.polyhedra.tracing import traced
from polycorner.studies.pair_atlas import PairAtlas

KINDS = {
    (2, 0, 0): "ball on ball twice",
    (1, 1, 0): "ball on ball, ball on rod",
    (0, 2, 0): "two balls on rods",
}
LETTERS = {"Delta": "$\\Delta$", "E": "$E$"}


def relative_curves(atlas: PairAtlas, period: float) -> list[tuple[str, Array]]:
    """Return the edges as ``(kind of contacts, (k, 3))`` in relative placements.

    The relative heading is brought into one period about zero; an edge that leaves it is cut.
    Balls of a dumbbell are alike here, so in the drum a half-turn about the vertical gives a
    second image.
    """
    curves = []
    for edge in atlas.skeleton.edges:
        lengths = Counter(len(name) for name in edge.active)
        kind = (lengths[4], lengths[3], lengths[2])
        label = KINDS.get(kind, "{} ball-ball, {} ball-rod, {} rod-rod".format(*kind))
        line = traced(atlas.skeleton, edge)
        points = relative_coordinates(atlas.pair, line, mean_heading=atlas.heading)
        turns = np.round(points[:, 2] / period)
        points[:, 2] -= period * turns
        cuts = np.flatnonzero(np.diff(turns)) + 1
        for piece in np.split(points, cuts):
            if len(piece) > 1:
                curves += [(label, image) for image in _images(atlas, piece)]
    return curves


def _images(atlas: PairAtlas, points: Array) -> list[Array]:
    if atlas.heading is None:
        return [points]
    return [points, points * np.array([-1, -1, 1])]


def relative_corners(atlas: PairAtlas, period: float) -> tuple[Array, list[str]]:
    """Return the corners ``(k, 3)`` in relative placements, each once, and their letters."""
    points: list[Array] = []
    letters = []
    for corner in atlas.skeleton.corners:
        point = relative_coordinates(atlas.pair, corner.point, mean_heading=atlas.heading)
        point[2] -= period * np.round(point[2] / period)
        kind = atlas.kind(corner).split("_")[0]
        for image in _images(atlas, point):
            if all(abs(image - other).max() > 1e-6 for other in points):
                points.append(image)
                letters.append(LETTERS.get(kind, kind))
    return np.array(points), letters


def write_solid(atlas: PairAtlas, folder: Path, *, resolution: int = 96) -> list[Path]:
    """Write ``solid.png`` and ``solid.glb``; a radian is drawn as long as ``l/2`` mm.

    In the plane over half a turn of the relative heading, since the balls of a dumbbell are alike;
    in the drum over a whole turn at the atlas's mean heading.
    """
    period = math.pi if atlas.heading is None else math.tau
    solid = forbidden_solid(atlas.pair, resolution, period=period, mean_heading=atlas.heading)
    curves = relative_curves(atlas, period)
    points, letters = relative_corners(atlas, period)
    figure = draw_solid(solid.mesh, curves, points, letters, caps=solid.caps)
    mesh = write_mesh(
        solid.mesh,
        folder / "solid.glb",
        curves=curves,
        points=points,
        scale=(1.0, 1.0, atlas.pair.length / 2),
    )
    return [save(figure, folder / "solid.png"), mesh]
