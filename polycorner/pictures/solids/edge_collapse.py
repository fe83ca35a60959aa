"""Edge collapses that remove slivers of a cut surface and keep its creases and corners."""

import math
from dataclasses import dataclass, replace

import numpy as np

from polycorner.pictures.solids.charts import Chart
from polycorner.pictures.solids.creases import Cut, edges_of
from polycorner.pictures.solids.grids import Indices, Mask
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

# Edges shorter than the first number of cells are collapsed; none gets longer than the second.
SHORT, LONG = 0.45, 1.8
# Faces of a lower shape are poor: 1 is equilateral, 0 degenerate, negative inverted.
POOR = 0.2
ROUNDS = 40
# Rounds end when fewer collapses than this share of the faces remain.
FEW = 2e-3


@dataclass(frozen=True)
class Labelled:
    """A cut surface with the function of each face.

    Attributes
    ----------
    cut : Cut
    labels : (F,) int
        The function that vanishes on the face; ``m`` and an axis for caps.
    slopes : (V, m + 3, 3) array
        Outward unit normals at the vertices by label, in cells.
    """

    cut: Cut
    labels: Indices
    slopes: Array

    @property
    def unresolved(self) -> int:
        """Number of faces whose corners have no common function."""
        return int((~self.cut.common.any(axis=1) & ~self.cut.caps).sum())

    def shapes(self, faces: Indices, labels: Indices) -> Array:
        """Return the shapes of faces, from 1 for equilateral ones to -1; see ``POOR``."""
        a, b, c = (self.cut.places[corner] for corner in faces.T)
        out = sum(self.slopes[corner, labels] for corner in faces.T)
        size = lengths_of(out)
        area = np.einsum("fk,fk->f", np.cross(b - a, c - a), out) / np.where(size > 0, 2 * size, 1)
        total = sum(lengths_of(side) ** 2 for side in (b - a, c - b, a - c))
        return np.asarray(4 * math.sqrt(3) * area / np.where(total > 0, total, 1.0))


def lengths_of(vectors: Array) -> Array:
    """Return the lengths of vectors ``(N, 3)``; faster than ``norm`` along a short axis."""
    return np.asarray(np.sqrt(np.einsum("nk,nk->n", vectors, vectors)))


def labelled(cut: Cut, chart: Chart) -> Labelled:
    """Return the surface with the function of each face.

    Where several vanish at all corners, or none, it is the least one in the middle of the face.
    """
    middles = chart.distances(cut.places[cut.faces].mean(axis=1))
    common = cut.common
    tried = np.where(common | ~common.any(axis=1, keepdims=True), middles, np.inf)
    flat = cut.fixed[cut.faces].all(axis=1)
    corners = cut.places[cut.faces]
    flat &= corners.max(axis=1) == corners.min(axis=1)
    labels = np.where(cut.caps, common.shape[1] + flat.argmax(axis=1), tried.argmin(axis=1))
    _, slopes = chart.evaluate(cut.places)
    lengths = np.linalg.norm(slopes, axis=-1, keepdims=True)
    ends = np.where(cut.fixed & (cut.places > 0.5), 1.0, -1.0)
    planes = np.eye(3) * ends[:, :, None]
    units = np.concatenate([slopes / np.where(lengths > 0, lengths, 1.0), planes], axis=1)
    return Labelled(cut, labels, units)


def collapsed(surface: Labelled) -> Labelled:
    """Return the surface with short edges collapsed, its creases and topology preserved.

    A vertex inside a face may collapse into any neighbour, one on a crease along the crease, one
    on a seam along the seam and on both of its sides at once; corners do not, unless both ends
    are the same point.  The surface stays closed and keeps its topology: both ends have exactly two
    common neighbours, the link condition [DEGN].  No face is inverted, and none becomes poor.
    """
    twins, shapes = _twins(surface.cut), surface.shapes(surface.cut.faces, surface.labels)
    for on_seams in (True, False):
        for _ in range(ROUNDS):
            moves = _moves(surface, shapes, twins if on_seams else None)
            surface, shapes = _after(surface, shapes, moves)
            if len(moves) <= (0 if on_seams else FEW * len(surface.labels)):
                break
    return surface


def _twins(cut: Cut) -> Indices:
    """Return the vertex across the seam for vertices on a seam, ``(V,)``; -1 for others."""
    from scipy.spatial import cKDTree

    twins = np.full(len(cut.places), -1)
    rim = cut.active.any(axis=1) & (cut.fixed.sum(axis=1) == 1)
    for axis in range(3):
        on_it = rim & cut.fixed[:, axis]
        low, high = (np.flatnonzero(on_it & (s * (cut.places[:, axis] - 0.5) > 0)) for s in (-1, 1))
        if len(low) and len(high):
            across = np.delete(np.arange(3), axis)
            away, found = cKDTree(cut.places[high][:, across]).query(cut.places[low][:, across])
            near, other = np.asarray(away) < DEFAULT.same, high[np.asarray(found)]
            twins[low[near]], twins[other[near]] = other[near], low[near]
    return twins


def _after(surface: Labelled, shapes: Array, moves: Indices) -> tuple[Labelled, Array]:
    """Return the surface after the collapses, and the shapes of its faces."""
    cut = surface.cut
    target = np.arange(len(cut.places))
    target[moves[:, 0]] = moves[:, 1]
    faces = target[cut.faces]
    a, b, c = faces.T
    kept = (a != b) & (b != c) & (c != a)
    a, b, c = (faces != cut.faces)[kept].T
    changed = a | b | c
    fewer = replace(cut, faces=faces[kept], caps=cut.caps[kept])
    drawn, left = replace(surface, cut=fewer, labels=surface.labels[kept]), shapes[kept]
    left[changed] = drawn.shapes(fewer.faces[changed], drawn.labels[changed])
    return drawn, left


def _moves(surface: Labelled, shapes: Array, twins: Indices | None) -> Indices:
    """Return independent collapses ``(k, 2)``: a vertex, and the neighbour it collapses into.

    With twins, vertices on seams; without them, all others.
    """
    cut = surface.cut
    edges, sides = edges_of(cut.faces)
    lengths = lengths_of(np.subtract(*cut.places[edges.T]))
    wanted = lengths < SHORT
    wanted[sides[shapes < POOR]] = True
    rim = np.asarray(cut.fixed.any(axis=1) & cut.active.any(axis=1))
    ways = _allowed(surface, edges, sides, lengths, wanted)
    ways = ways[rim[ways[:, 0]] == (twins is not None)]
    ways = ways[_two_in_common(cut.faces, edges, ways)]
    ways = ways[_no_worse(surface, ways, shapes)]
    if twins is not None:
        ways = ways[_twice(ways, twins)]
    ways = ways[_apart(edges, ways, lengths_of(np.subtract(*cut.places[ways.T])))]
    return np.asarray(ways if twins is None else ways[_twice(ways, twins)])


def _twice(ways: Indices, twins: Indices) -> Mask:
    """Return a mask of the collapses that occur on both sides of a seam."""
    count = len(twins)
    across = twins[ways]
    there = np.isin(across @ [count, 1], ways @ [count, 1])
    return np.asarray(there & (across >= 0).all(axis=1))


def _allowed(
    surface: Labelled, edges: Indices, sides: Indices, lengths: Array, wanted: Mask
) -> Indices:
    """Return the wanted collapses that keep creases and corners, ``(k, 2)``."""
    cut = surface.cut
    beside = np.argsort(sides.ravel(), kind="stable").reshape(-1, 2) // 3
    crease = surface.labels[beside[:, 0]] != surface.labels[beside[:, 1]]
    creases = np.bincount(edges[crease].ravel(), minlength=len(cut.places))
    found = []
    for way in (edges, edges[:, ::-1]):
        start = way[:, 0]
        free = (creases[start] == 0) | ((creases[start] == 2) & crease)
        found.append(way[wanted & (free | (lengths < DEFAULT.same))])
    return np.concatenate(found)


def _two_in_common(faces: Indices, edges: Indices, ways: Indices) -> Mask:
    """Return a mask of the collapses that satisfy the link condition."""
    from scipy.sparse import coo_array

    count = int(faces.max()) + 1
    both = np.concatenate([edges, edges[:, ::-1]])
    joined = coo_array((np.ones(len(both), dtype=np.int32), tuple(both.T)), (count, count)).tocsr()
    shared = joined[ways[:, 0]].multiply(joined[ways[:, 1]])
    return np.asarray(np.asarray(shared.sum(axis=1)).ravel() == 2)


def _no_worse(surface: Labelled, ways: Indices, shapes: Array) -> Mask:
    """Return a mask of the collapses that make no face poor and no edge too long."""
    cut = surface.cut
    corners = cut.faces.ravel()
    order = np.argsort(corners, kind="stable")
    first = np.searchsorted(corners[order], ways[:, 0])
    count = np.searchsorted(corners[order], ways[:, 0], side="right") - first
    which = np.repeat(np.arange(len(ways)), count)
    at = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + first[which]
    around = order[at] // 3
    before = np.full(len(ways), np.inf)
    np.minimum.at(before, which, shapes[around])
    faces = cut.faces[around]
    a, b, c = (faces != ways[which, 1][:, None]).T
    left = a & b & c
    which, around, faces = which[left], around[left], faces[left]
    moved = np.where(faces == ways[which, 0][:, None], ways[which, 1][:, None], faces)
    after = np.full(len(ways), np.inf)
    np.minimum.at(after, which, surface.shapes(moved, surface.labels[around]))
    reach, goal = np.zeros(len(ways)), cut.places[ways[which, 1]]
    for corner in moved.T:
        np.maximum.at(reach, which, lengths_of(cut.places[corner] - goal))
    still = lengths_of(np.subtract(*cut.places[ways.T])) < DEFAULT.same
    flat = ~cut.active[ways[:, 0]].any(axis=1)  # inside a cap, where size makes no error
    return np.asarray(still | ((after >= np.minimum(before, POOR)) & (flat | (reach < LONG))))


def _apart(edges: Indices, ways: Indices, costs: Array) -> Mask:
    """Return a mask of the collapses that cost less than all others near by."""
    order = np.lexsort((ways[:, 1], ways[:, 0], costs))
    rank = np.empty(len(ways), dtype=np.int64)
    rank[order] = np.arange(len(ways))
    least = np.full(int(edges.max()) + 1, len(ways))
    for k in range(2):
        np.minimum.at(least, ways[:, k], rank)
    near = least.copy()
    for one, other in ((0, 1), (1, 0)):
        np.minimum.at(near, edges[:, one], least[edges[:, other]])
    return np.asarray((near[ways[:, 0]] == rank) & (near[ways[:, 1]] == rank))
