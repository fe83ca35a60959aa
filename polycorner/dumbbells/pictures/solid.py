"""The solid of forbidden placements of a pair with the corners and edges of its skeleton."""

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from polycorner.dumbbells.pictures.placements import (
    forbidden_solid,
    relative_coordinates,
    relative_gaps,
)
from polycorner.dumbbells.pictures.relabelling import contact_counts
from polycorner.dumbbells.pictures.symbols import KIND_WORDS, corner_symbol
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.pictures import SharpSurface, draw_solid, save, write_mesh
from polycorner.skeletons import traced
from polycorner.toolkit import Array, Chart, Checked, about, checked, real, write_atomically

SAME = 1e-6  # mm or radians


def contacts_in_words(active: Iterable[str]) -> str:
    """Return the kind of an edge by its contacts, such as ``two balls on rods``."""
    kind = contact_counts(active)
    return KIND_WORDS.get(kind, "{} ball-ball, {} ball-rod, {} rod-rod".format(*kind))


@checked
def relative_curves(
    atlas: PairAtlas,
    period: float,
    naming: Callable[[tuple[str, ...]], str] = contacts_in_words,
) -> list[tuple[str, Array]]:
    """Return the edges as ``(name, (k, 3))`` in relative placements, each once.

    The relative heading is reduced to one period about zero; edges are cut where they leave it.
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
    real("period", period, above=0)
    curves: list[tuple[str, Array]] = []
    for edge in atlas.skeleton.edges:
        line = traced(atlas.skeleton, edge)
        points = relative_coordinates(atlas.pair, line, mean_heading=atlas.heading)
        with about("naming"):
            label = naming(edge.active)
        for piece in _cut(atlas, points, period):
            curves += [(label, image) for image in _images(atlas, piece)]
    kept: list[tuple[str, Array]] = []
    for label, line in curves:
        if not any(label == name and _coincide(line, other) for name, other in kept):
            kept.append((label, line))
    return kept


def _cut(atlas: PairAtlas, points: Array, period: float) -> list[Array]:
    """Return the pieces of an edge in one period about zero."""
    turns = _turns(points[:, 2], period)
    cuts = np.flatnonzero(np.diff(turns)) + 1
    pieces = np.split(points, cuts)
    for k, cut in enumerate(cuts.tolist()):
        end = _on_seam(atlas, points[cut - 1], points[cut], turns[cut - 1 : cut + 1], period)
        pieces[k] = np.vstack([pieces[k], end])
        pieces[k + 1] = np.vstack([end, pieces[k + 1]])
    starts = np.concatenate([[0], cuts])
    return [
        piece - np.array([0.0, 0.0, period * turns[start]])
        for piece, start in zip(pieces, starts.tolist(), strict=True)
    ]


def _turns(heading: Array, period: float) -> Array:
    """Return whole periods to be taken off; points between two have those of a point beside them.

    Rounding does not cut an edge along which the heading is half a period.
    """
    share = heading / period - np.floor(heading / period)
    clear = np.flatnonzero(abs(share - 0.5) * period > SAME)
    if not clear.size:
        return np.floor(heading / period) + 1
    before = np.searchsorted(clear, np.arange(len(heading)), side="right") - 1
    return np.asarray(np.round(heading / period)[clear[np.maximum(before, 0)]])


def _on_seam(atlas: PairAtlas, one: Array, other: Array, turns: Array, period: float) -> Array:
    """Return the point ``(1, 3)`` at which an edge crosses the end of a period."""
    place = period * turns.mean()
    share = (place - one[2]) / (other[2] - one[2])
    guess = (one + share * (other - one))[None]
    guess[:, 2] = place
    gaps = relative_gaps(atlas.pair, mean_heading=atlas.heading)
    held = abs(gaps(one[None], 0)[0]) < SAME
    fixed = np.array([[False, False, True]])
    return Chart(gaps, np.zeros(3), np.ones(3)).settle(guess, held, fixed)[0]


def _coincide(one: Array, other: Array) -> bool:
    """Return whether two polylines are one curve, compared at the ends and in the middle."""
    places = one[[0, len(one) // 2, -1]]
    steps = np.linalg.norm(np.diff(other, axis=0), axis=1).max()
    apart = np.linalg.norm(places[:, None] - other, axis=-1).min(axis=1)
    return bool((apart <= steps).all() and len(other) > 1)


def _images(atlas: PairAtlas, points: Array) -> list[Array]:
    if atlas.heading is None:
        return [points]
    return [points, points * np.array([-1, -1, 1])]


@checked
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
        point[2] -= period * _turns(point[2:], period)[0]
        for image in _images(atlas, point):
            if all(abs(image - other).max() > 1e-6 for other in points):
                points.append(image)
                letters.append(corner_symbol(atlas.kind(corner), hand=hands))
    return np.array(points), letters


@dataclass(frozen=True)
class SolidFacts(Checked):
    """Size of a solid, and agreement of its mesh with the skeleton.

    Attributes
    ----------
    volume, curved_volume : float
        Of the mesh, and with the curvature of its faces, in mm^2 rad.
    euler_characteristic : int
        Of the surface, the seam of the relative heading sewn together.
    watertight : bool
        Whether the mesh is closed and wound consistently.
    faces, unresolved : int
        Number of triangles, and of those that lie on no single contact.
    surface_error, edge_error : float
        Largest gap on faces and on edges, see :class:`~polycorner.pictures.SharpSurface`,
        in mm.
    corner_error : float
        Largest distance of a corner of the atlas from the nearest vertex; a radian counts ``l/2``
        mm.
    corners : int
        Number of corners of the atlas in one period.
    """

    volume: float
    curved_volume: float
    euler_characteristic: int
    watertight: bool
    faces: int
    unresolved: int
    surface_error: float
    edge_error: float
    corner_error: float
    corners: int


@checked
def solid_facts(solid: SharpSurface, atlas: PairAtlas) -> SolidFacts:
    """Return the size of a solid and the errors of its mesh against the atlas of the same pair."""
    low, high = solid.bounds[2].tolist()
    points, _ = relative_corners(atlas, high - low)
    return SolidFacts(
        volume=solid.volume,
        curved_volume=solid.curved_volume,
        euler_characteristic=solid.euler_characteristic,
        watertight=solid.watertight,
        faces=len(solid.labels),
        unresolved=solid.unresolved,
        surface_error=solid.surface_error,
        edge_error=solid.edge_error,
        corner_error=solid.corner_error(points, (1.0, 1.0, atlas.pair.length / 2)),
        corners=len(points),
    )


@checked
def write_solid(atlas: PairAtlas, folder: Path, *, resolution: int = 96) -> list[Path]:
    """Write ``solid.png``, ``solid.glb`` and ``solid.json``; a radian is as long as ``l/2`` mm.

    In the plane over half a turn of the relative heading, since the balls of a dumbbell are alike;
    in the drum over a whole turn at the atlas's mean heading.  The JSON file, and the extras of
    the GLB file, hold the :class:`SolidFacts`.
    """
    period = math.pi if atlas.heading is None else math.tau
    solid = forbidden_solid(atlas.pair, resolution, period=period, mean_heading=atlas.heading)
    curves = relative_curves(atlas, period)
    points, letters = relative_corners(atlas, period)
    facts = asdict(solid_facts(solid, atlas))
    figure = draw_solid(solid.mesh, curves, points, letters, caps=solid.caps)
    mesh = write_mesh(
        solid.mesh,
        folder / "solid.glb",
        curves=curves,
        points=points,
        scale=(1.0, 1.0, atlas.pair.length / 2),
        facts=facts,
    )
    numbers = write_atomically(folder / "solid.json", json.dumps(facts, indent=2) + "\n")
    return [save(figure, folder / "solid.png"), mesh, numbers]
