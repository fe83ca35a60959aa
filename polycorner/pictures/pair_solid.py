"""The solid of forbidden placements of a pair, with the corners and edges of its atlas over it."""

import math
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from polycorner.geometry.manifold import Array
from polycorner.pictures.meshes import write_mesh
from polycorner.pictures.plots import save
from polycorner.pictures.solid_view import draw_solid
from polycorner.pictures.solids import forbidden_solid, relative_coordinates
from polycorner.polyhedra.tracing import traced
from polycorner.studies.pair_atlas import PairAtlas

KINDS = {
    (2, 0, 0): "ball on ball twice",
    (1, 1, 0): "ball on ball, ball on rod",
    (0, 2, 0): "two balls on rods",
}
LETTERS = {"Delta": "\\Delta", "E": "\\mathcal{E}"}


def contacts_in_words(active: Iterable[str]) -> str:
    """Return the kind of an edge by its contacts, such as ``two balls on rods``."""
    lengths = Counter(len(name) for name in active)
    kind = (lengths[4], lengths[3], lengths[2])
    return KINDS.get(kind, "{} ball-ball, {} ball-rod, {} rod-rod".format(*kind))


def relative_curves(
    atlas: PairAtlas,
    period: float,
    naming: Callable[[tuple[str, ...]], str] = contacts_in_words,
) -> list[tuple[str, Array]]:
    """Return the edges as ``(name, (k, 3))`` in relative placements, each once.

    The relative heading is brought into one period about zero; an edge that leaves it is cut.
    Balls of a dumbbell are alike here, so in the drum a half-turn about the vertical gives a
    second image, and edges that differ by a relabelling of balls may coincide.

    Parameters
    ----------
    atlas : PairAtlas
    period : float
        Of the relative heading, in radians.
    naming : callable, optional
        Name of an edge from the names of its contacts; default :func:`contacts_in_words`.
    """
    curves: list[tuple[str, Array]] = []
    for edge in atlas.skeleton.edges:
        line = traced(atlas.skeleton, edge)
        points = relative_coordinates(atlas.pair, line, mean_heading=atlas.heading)
        turns = np.round(points[:, 2] / period)
        points[:, 2] -= period * turns
        cuts = np.flatnonzero(np.diff(turns)) + 1
        for piece in np.split(points, cuts):
            if len(piece) > 1:
                label = naming(edge.active)
                curves += [(label, image) for image in _images(atlas, piece)]
    kept: list[tuple[str, Array]] = []
    for label, line in curves:
        if not any(label == name and _coincide(line, other) for name, other in kept):
            kept.append((label, line))
    return kept


def _coincide(one: Array, other: Array) -> bool:
    """Return whether two polylines are one curve: its ends and its middle, either way along it."""
    places = one[[0, len(one) // 2, -1]]
    steps = np.linalg.norm(np.diff(other, axis=0), axis=1).max()
    apart = np.linalg.norm(places[:, None] - other, axis=-1).min(axis=1)
    return bool((apart <= steps).all() and len(other) > 1)


def _images(atlas: PairAtlas, points: Array) -> list[Array]:
    if atlas.heading is None:
        return [points]
    return [points, points * np.array([-1, -1, 1])]


def relative_corners(
    atlas: PairAtlas, period: float, *, hands: bool = False
) -> tuple[Array, list[str]]:
    """Return the corners ``(k, 3)`` in relative placements, each once, and their letters.

    ``hands`` adds the chirality to a letter.
    """
    points: list[Array] = []
    letters = []
    for corner in atlas.skeleton.corners:
        point = relative_coordinates(atlas.pair, corner.point, mean_heading=atlas.heading)
        point[2] -= period * np.round(point[2] / period)
        kind, hand = atlas.kind(corner).split("_")
        for image in _images(atlas, point):
            if all(abs(image - other).max() > 1e-6 for other in points):
                points.append(image)
                letters.append(_written(kind, hand if hands else ""))
    return np.array(points), letters


def _written(kind: str, hand: str) -> str:
    """Return a letter as it is typeset; kinds without one stay as they are."""
    if kind not in LETTERS:
        return kind
    return f"${LETTERS[kind]}_{hand}$" if hand else f"${LETTERS[kind]}$"


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
