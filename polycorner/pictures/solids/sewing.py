"""Grid keys of mesh vertices, and surfaces sewn together by them."""

import numpy as np

from polycorner.errors import SolverError
from polycorner.pictures.solids.grids import AXES, Indices, Mask
from polycorner.spaces.manifold import Array

# Kinds of vertices beside 0, 1 and 2, which lie on an edge along that axis.
ON_NODE, IN_CELL = 3, 4


def keys_of(places: Array, cells: Indices) -> Indices:
    """Return the grid key of each vertex, ``(V, 4)``: a lower node or cell, and a kind.

    The kind is the axis of the edge the vertex lies on; a vertex between the last layer and the
    one beyond it belongs to the node in the last layer; a few lie within a cell.
    """
    lower = np.floor(places).astype(np.int64)
    between = places != lower
    kind = np.where(between.sum(axis=1) == 1, between.argmax(axis=1), IN_CELL)
    beyond = (places < 0) | (places > cells)
    kind[beyond.any(axis=1)] = ON_NODE
    return np.column_stack([np.clip(lower, 0, cells), kind])


def merged(keys: Indices, faces: Indices) -> tuple[Indices, Indices]:
    """Return one vertex for each distinct key in use, and the faces in these numbers."""
    sizes = keys.max(axis=0) + 1
    codes = np.ravel_multi_index(tuple(keys.T), tuple(sizes))
    _, chosen, numbers = np.unique(codes[faces], return_index=True, return_inverse=True)
    return faces.ravel()[chosen], numbers.reshape(faces.shape)


def shared(keys: Indices, faces: Indices, open_keys: Indices, open_faces: Indices) -> Mask:
    """Return a mask of the faces that belong to the surface without caps."""
    both = np.concatenate([faces, open_faces + len(keys)])
    vertices, numbered = merged(np.concatenate([keys, open_keys]), both)
    codes = np.sort(numbered, axis=1) @ (len(vertices) ** np.arange(AXES))
    return np.isin(codes[: len(faces)], codes[len(faces) :])


def sewn_euler_characteristic(keys: Indices, faces: Indices, cells: Indices, wraps: Mask) -> int:
    """Return ``V - E + F`` of the surface without caps, opposite sides of the box identified."""
    wrapped = keys.copy()
    wrapped[:, :AXES] = np.where(wraps, keys[:, :AXES] % cells, keys[:, :AXES])
    vertices, sewn = merged(wrapped, faces)
    edges = np.sort(np.concatenate([sewn[:, [0, 1]], sewn[:, [1, 2]], sewn[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_counts=True)
    if (counts != 2).any():
        msg = f"marching cubes left {int((counts != 2).sum())} edges at a seam without two faces"
        raise SolverError(msg)
    return int(len(vertices) - len(counts) + len(sewn))
