"""Pairs of badly shaped neighbours in a triangulation exchanged for better ones."""

from dataclasses import replace

import numpy as np

from polycorner.pictures.solids.creases import edges_of
from polycorner.pictures.solids.edge_collapse import LONG, Labelled
from polycorner.pictures.solids.grids import Indices, Mask
from polycorner.spaces.manifold import Array

# Pairs with a face of a shape below this are tried; the worse shape has to grow by the gain.
TRIED, GAIN = 0.5, 0.05
ROUNDS = 12


def flipped(surface: Labelled) -> Labelled:
    """Return the surface with edges between faces of one label turned, where that shapes better.

    Of the two ways to cut a quadrilateral into triangles, the one whose worse triangle is better.
    Edges that are there already are not made again, so that the surface stays closed.
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
    # Along the edge from u to v in the first face; w and x are across from it.
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
    """Return which pairs of faces gain more than any other pair with one of them."""
    rank = np.empty(len(gain), dtype=np.int64)
    rank[np.argsort(-gain, kind="stable")] = np.arange(len(gain))
    least = np.full(count, len(gain))
    for k in range(2):
        np.minimum.at(least, beside[:, k], rank)
    return np.asarray((least[beside] == rank[:, None]).all(axis=1))
