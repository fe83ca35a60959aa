"""Edge flips that improve the shapes of triangles."""

from dataclasses import replace

import numpy as np

from polycorner.pictures.solids.creases import edges_of
from polycorner.pictures.solids.edge_collapse import LONG, Labelled
from polycorner.pictures.solids.grids import Indices, Mask
from polycorner.spaces.manifold import Array

# Pairs with a shape below the first number are tried; the worse shape has to improve by the second.
TRIED, GAIN = 0.5, 0.05
ROUNDS = 12


def flipped(surface: Labelled) -> Labelled:
    """Return the surface with edges between faces of one label flipped where shapes improve.

    Of the two diagonals of a quadrilateral we take the one whose worse triangle is better.  A flip
    never duplicates an existing edge, so the surface stays closed.
    """
    for _ in range(ROUNDS):
        turned = _turned(surface)
        if turned is None:
            break
        surface = turned
    return surface


def _turned(surface: Labelled) -> Labelled | None:
    cut, labels = surface.cut, surface.labels
    edges, sides = edges_of(cut.faces)
    order = np.argsort(sides.ravel(), kind="stable").reshape(-1, 2)
    beside, place = order // 3, order % 3
    shapes = surface.shapes(cut.faces, labels)
    worse = shapes[beside].min(axis=1)
    tried = np.flatnonzero((worse < TRIED) & (labels[beside[:, 0]] == labels[beside[:, 1]]))
    beside, place = beside[tried], place[tried]
    # The edge leads from u to v in the first face; w and x are opposite to it.
    u, v, w = (cut.faces[beside[:, 0], (place[:, 0] + k) % 3] for k in range(3))
    x = cut.faces[beside[:, 1], (place[:, 1] + 2) % 3]
    ones, others = np.stack([u, x, w], axis=1), np.stack([x, v, w], axis=1)
    kind = labels[beside[:, 0]]
    after = np.minimum(surface.shapes(ones, kind), surface.shapes(others, kind))
    spans = np.linalg.norm(cut.places[w] - cut.places[x], axis=1)
    gain = after - worse[tried]
    fine = (gain > GAIN) & (spans < LONG) & (w != x)
    fine &= ~_joined(edges, w, x)
    chosen = np.flatnonzero(fine)
    chosen = chosen[_best(beside[chosen], gain[chosen], len(cut.faces))]
    codes = np.minimum(w, x)[chosen] * len(cut.places) + np.maximum(w, x)[chosen]
    chosen = chosen[np.unique(codes, return_index=True)[1]]
    if not len(chosen):
        return None
    faces = cut.faces.copy()
    faces[beside[chosen, 0]], faces[beside[chosen, 1]] = ones[chosen], others[chosen]
    return replace(surface, cut=replace(cut, faces=faces))


def _joined(edges: Indices, one: Indices, other: Indices) -> Mask:
    count = int(edges.max()) + 1
    codes = np.minimum(one, other) * count + np.maximum(one, other)
    return np.isin(codes, edges[:, 0] * count + edges[:, 1])


def _best(beside: Indices, gain: Array, count: int) -> Mask:
    """Return a mask of the pairs that gain more than all others with a face in common."""
    rank = np.empty(len(gain), dtype=np.int64)
    rank[np.argsort(-gain, kind="stable")] = np.arange(len(gain))
    least = np.full(count, len(gain))
    for k in range(2):
        np.minimum.at(least, beside[:, k], rank)
    return np.asarray((least[beside] == rank[:, None]).all(axis=1))
