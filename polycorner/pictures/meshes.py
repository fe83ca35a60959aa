"""Regions ``{f < 0}`` of space as watertight meshes, their topology, and files of them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.errors import SolverError
from polycorner.geometry.manifold import Array

if TYPE_CHECKING:
    import trimesh

Function = Callable[[Array], Array]
Bounds = Sequence[tuple[float, float]]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

AXES = 3
# A vertex stays this fraction of a grid edge away from its ends, so that no face degenerates.
CLEARANCE = 1e-3
# Least size of the values given to marching cubes, and of the differences between them.
LEAST = 0.05
FALSE_POSITIONS = 12
SLAB = 200_000
FEWEST_CELLS = 4
# Kinds of vertices in a key after those on an edge along axis 0, 1 or 2.
ON_NODE, IN_CELL = 3, 4


@dataclass(frozen=True, eq=False)
class Isosurface:
    """The boundary of a region ``{f < 0}`` of a box some of whose sides may be identified.

    ``mesh`` is closed in the chart: where the region crosses the seam of a periodic axis, flat
    caps close it at both ends, so that it bounds a volume.  ``euler_characteristic`` belongs to
    the surface without caps, its seam sewn together.

    Attributes
    ----------
    mesh : trimesh.Trimesh
        Watertight, with outward normals; ``mesh.euler_number`` is that of the capped surface.
    caps : (F,) bool
        Which faces of the mesh are caps.
    euler_characteristic : int
        ``V - E + F`` of the surface, opposite sides of periodic axes identified.
    inside : (n1 + 1, n2 + 1, n3 + 1) bool
        Where ``f < 0`` on the grid; the last layer of a periodic axis repeats the first.
    bounds : (3, 2) float
        The box.
    periodic : tuple of three bool
        Which axes are periodic.
    """

    mesh: "trimesh.Trimesh"
    caps: Mask
    euler_characteristic: int
    inside: Mask
    bounds: Array
    periodic: tuple[bool, bool, bool]

    @cached_property
    def volume(self) -> float:
        """The volume of the region, in the product of the units of the axes."""
        return float(self.mesh.volume)

    @cached_property
    def area(self) -> float:
        """The area of the surface without caps, the axes taken as they are (mm beside radians)."""
        return float(np.asarray(self.mesh.area_faces)[~self.caps].sum())

    @property
    def spacing(self) -> Array:
        """The sides of a cell of the grid, ``(3,)``."""
        sides = self.bounds[:, 1] - self.bounds[:, 0]
        return np.asarray(sides / (np.array(self.inside.shape) - 1))


def isosurface(
    function: Function,
    bounds: Bounds,
    resolution: int | Sequence[int],
    periodic: Sequence[bool] = (False, False, False),
) -> Isosurface:
    """Return the boundary of ``{f < 0}`` in a box: marching cubes with vertices on ``f = 0``.

    Marching cubes ([LLVT]) finds which edges of a grid the surface crosses and joins the
    crossings; each crossing is then found on its edge by false position.  For a continuous,
    piecewise smooth ``f`` volume and area are right to second order in the spacing.  The grid is
    evaluated slab by slab; a crossing closer than ``1e-3`` of an edge to its end is put there.

    Parameters
    ----------
    function : callable
        ``f`` of points ``(N, 3)``, returning ``(N,)``; continuous.
    bounds : sequence of three pairs
        Least and greatest value of each coordinate.
    resolution : int or three of them
        Number of cells along each axis, at least 4.
    periodic : three bool, optional
        Axes along which ``f`` repeats itself with the length of the box as its period.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong form; where the region is empty, fills the box, or touches the
        end of an axis that is not periodic; where ``f`` differs at the ends of a periodic one.
    SolverError
        If the surface found is not closed.
    """
    box, cells, wraps = _grid(bounds, resolution, periodic)
    values = _evaluate(function, box, cells)
    _check_ends(values, box, wraps)
    for axis in np.flatnonzero(wraps).tolist():
        _layer(values, axis, -1)[...] = _layer(values, axis, 0)
    signed = _distinct(values, wraps)
    open_places, open_faces = _march(signed, np.zeros(AXES, dtype=bool))
    open_keys = _keys(open_places, cells)
    euler = _sewn_euler_characteristic(open_keys, open_faces, cells, wraps)
    places, faces = _march(signed, wraps)
    keys = _keys(places, cells)
    points = _points(function, values, keys, faces, box)
    caps = ~_shared(keys, faces, open_keys, open_faces)
    mesh, kept = _closed(points, faces, keys)
    flags = (bool(wraps[0]), bool(wraps[1]), bool(wraps[2]))
    return Isosurface(mesh, caps[kept], euler, values < 0, box, flags)


def components_of_complement(surface: Isosurface) -> int:
    """Return the number of connected pieces of ``{f >= 0}``, seams identified.

    Two grid points are joined when they are neighbours along an axis, so a passage narrower than
    a cell may be missed.
    """
    from scipy.ndimage import label
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    labels, count = label(~surface.inside)
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for axis in np.flatnonzero(surface.periodic).tolist():
        ends = np.stack([_layer(labels, axis, 0).ravel(), _layer(labels, axis, -1).ravel()], axis=1)
        pairs.append(ends[(ends > 0).all(axis=1)] - 1)
    joined = np.concatenate(pairs)
    graph = coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(count, count))
    return int(connected_components(graph, directed=False)[0])


def write_mesh(
    mesh: "trimesh.Trimesh",
    path: Path,
    *,
    curves: Sequence[tuple[str, ArrayLike]] = (),
    points: ArrayLike = (),
    scale: Sequence[float] = (1.0, 1.0, 1.0),
) -> Path:
    """Write a mesh as ``.glb`` or ``.ply`` and return the path.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        What to write.
    path : Path
        Its suffix says the format; folders are made.
    curves : sequence of (name, (k, 3) array), optional
        Polylines for the scene of a GLB, broken at rows of NaN.
    points : (m, 3) array_like, optional
        Points for the scene of a GLB.
    scale : three float, optional
        What the coordinates are multiplied with, such as millimetres per radian.

    Raises
    ------
    ValueError
        For another suffix, or for curves or points in a PLY.
    """
    suffix = path.suffix.lower()
    if suffix not in (".glb", ".ply"):
        msg = f"path: expected a name ending in .glb or .ply; got {path.name}"
        raise ValueError(msg)
    marks = np.asarray(points, dtype=np.float64).reshape(-1, AXES)
    if suffix == ".ply" and (len(curves) or len(marks)):
        msg = "path: expected a name ending in .glb for curves and points; got .ply"
        raise ValueError(msg)
    factors, made = np.asarray(scale, dtype=np.float64), _objects()
    scene = made.Scene()
    solid = made.Trimesh(np.asarray(mesh.vertices) * factors, mesh.faces, process=False)
    scene.add_geometry(solid, geom_name="solid")
    for name, curve in curves:
        for number, piece in enumerate(_unbroken(curve)):
            line = made.path.entities.Line(np.arange(len(piece)))
            drawn = made.path.Path3D([line], piece * factors, process=False)
            scene.add_geometry(drawn, geom_name=f"{name} {number + 1}")
    if len(marks):
        scene.add_geometry(made.PointCloud(marks * factors), geom_name="points")
    path.parent.mkdir(parents=True, exist_ok=True)
    (scene if suffix == ".glb" else solid).export(path)
    return path


def _grid(
    bounds: Bounds, resolution: int | Sequence[int], periodic: Sequence[bool]
) -> tuple[Array, Indices, Mask]:
    box = np.asarray(bounds, dtype=np.float64)
    if box.shape != (AXES, 2) or not (np.isfinite(box).all() and (box[:, 0] < box[:, 1]).all()):
        msg = f"bounds: expected three pairs of increasing numbers; got {bounds!r}"
        raise ValueError(msg)
    cells = np.asarray(resolution)
    if cells.dtype.kind != "i":
        msg = f"resolution: expected an integer or three; got {resolution!r}"
        raise TypeError(msg)
    if cells.shape not in {(), (AXES,)} or (cells < FEWEST_CELLS).any():
        msg = f"resolution: expected one or three numbers from {FEWEST_CELLS}; got {resolution!r}"
        raise ValueError(msg)
    if len(periodic) != AXES:
        msg = f"periodic: expected three truth values; got {periodic!r}"
        raise ValueError(msg)
    return box, np.broadcast_to(cells, AXES).astype(np.int64), np.array(periodic, dtype=bool)


def _evaluate(function: Function, box: Array, cells: Indices) -> Array:
    """Return ``f`` at the nodes, ``(n1 + 1, n2 + 1, n3 + 1)``, a few layers at a time."""
    ends = zip(box.tolist(), cells.tolist(), strict=True)
    first, second, third = (np.linspace(low, high, n + 1) for (low, high), n in ends)
    layer = np.stack(np.broadcast_arrays(0.0, second[:, None], third[None, :]), axis=-1)
    values = np.empty((len(first), len(second), len(third)))
    step = max(1, SLAB // (len(second) * len(third)))
    for k in range(0, len(first), step):
        slab = np.repeat(layer[None], len(first[k : k + step]), axis=0)
        slab[..., 0] = first[k : k + step, None, None]
        values[k : k + step] = _at(function, slab.reshape(-1, AXES)).reshape(slab.shape[:-1])
    if not (values < 0).any():
        msg = f"function: expected negative values in the box; got {values.min():g} or more"
        raise ValueError(msg)
    if not (values >= 0).any():
        msg = f"function: expected values not below 0 in the box; got {values.max():g} or less"
        raise ValueError(msg)
    return values


def _at(function: Function, points: Array) -> Array:
    found = np.asarray(function(points), dtype=np.float64)
    if found.shape != (len(points),) or not np.isfinite(found).all():
        what = "numbers that are not finite" if found.shape == (len(points),) else found.shape
        msg = f"function: expected a finite number for each of {len(points)} points; got {what}"
        raise ValueError(msg)
    return found


def _layer(values: Any, axis: int, index: int) -> Any:
    return np.moveaxis(values, axis, 0)[index]


def _check_ends(values: Array, box: Array, wraps: Mask) -> None:
    for axis in range(AXES):
        ends = _layer(values, axis, 0), _layer(values, axis, -1)
        if wraps[axis]:
            apart = float(abs(ends[1] - ends[0]).max())
            if apart > 1e-8 * abs(values).max():
                msg = (
                    f"periodic: expected the same values at both ends of axis {axis}; "
                    f"got some that differ by {apart:g}"
                )
                raise ValueError(msg)
            continue
        for end, word, place in zip(ends, ("lower", "upper"), box[axis], strict=True):
            if (end < 0).any():
                msg = (
                    f"bounds: expected a region inside the box; "
                    f"it reaches the {word} end {place:g} of axis {axis}"
                )
                raise ValueError(msg)


def _march(signed: Array, capped: Mask) -> tuple[Array, Indices]:
    """Return vertices, in steps of the grid, and outward faces; flat caps close some axes."""
    from skimage.measure import marching_cubes

    padded = np.pad(signed, [(int(c), int(c)) for c in capped], constant_values=1.0)
    march: Any = marching_cubes
    places, faces, _, _ = march(padded, 0.0, gradient_direction="descent")
    return places.astype(np.float64) - capped, faces.astype(np.int64)


def _distinct(values: Array, wraps: Mask) -> Array:
    """Return values with the same signs, of size ``LEAST`` to 1, that marching cubes can handle.

    It computes in single precision, so crossings are kept clear of the nodes.  Faces of cells
    whose corners alternate are joined by comparing products of opposite corners, and a tie, common
    on a symmetric region, would be settled differently on both sides of the face: small factors
    without symmetry forbid ties.
    """
    steps = [
        abs(np.diff(values, axis=axis))[np.diff(values < 0, axis=axis)].max(initial=0.0)
        for axis in range(AXES)
    ]
    # Products of neighbouring indices: their mixed differences are irrational, never near 0.
    i, j, k = np.ogrid[tuple(slice(n) for n in values.shape)]
    last = np.array(values.shape) - 1
    i, j, k = (np.where(w, x % n, x) for x, n, w in zip((i, j, k), last, wraps, strict=True))
    factors = 1 - LEAST * ((math.sqrt(2) * i * j + math.sqrt(3) * j * k + math.sqrt(5) * k * i) % 1)
    size = abs(values) / (abs(values) + max(steps))
    size = (LEAST + (1 - LEAST) * size) * factors
    return np.asarray(np.where(values < 0, -size, size))


def _keys(places: Array, cells: Indices) -> Indices:
    """Return what each vertex stands for, ``(V, 4)``: a lower node or cell, and a kind.

    The kind is the axis of the edge the vertex lies on; a vertex between the last layer and the
    one beyond it belongs to the node in the last layer; a few lie within a cell.
    """
    lower = np.floor(places).astype(np.int64)
    between = places != lower
    kind = np.where(between.sum(axis=1) == 1, between.argmax(axis=1), IN_CELL)
    beyond = (places < 0) | (places > cells)
    kind[beyond.any(axis=1)] = ON_NODE
    return np.column_stack([np.clip(lower, 0, cells), kind])


def _points(
    function: Function,
    values: Array,
    keys: Indices,
    faces: Indices,
    box: Array,
) -> Array:
    """Return the vertices in the box, those on edges moved to ``f = 0``."""
    cells = np.array(values.shape) - 1
    spacing = (box[:, 1] - box[:, 0]) / cells
    nodes, kind = keys[:, :AXES], keys[:, AXES]
    exact = nodes.astype(np.float64)
    on_edge = kind < AXES
    start, axis = nodes[on_edge], kind[on_edge]
    end = start + np.eye(AXES, dtype=np.int64)[axis]
    exact[on_edge, axis] += _crossings(function, values, start, end, box[:, 0], spacing)
    inner = kind == IN_CELL
    if inner.any():
        exact[inner] = _neighbours_mean(exact, faces, inner)
    return np.asarray(box[:, 0] + exact * spacing)


def _crossings(
    function: Function, values: Array, start: Indices, end: Indices, low: Array, spacing: Array
) -> Array:
    """Return where ``f`` vanishes on edges of the grid, as fractions of the edges.

    False position; an end that is kept twice in a row has its value halved, so that the other
    end moves too (the Illinois rule).
    """
    cells = np.array(values.shape) - 1
    # Edges in the last layer of a periodic axis are evaluated in the first: seams fit exactly.
    base, step = low + (start % cells) * spacing, (end - start) * spacing
    first, second = values[tuple(start.T)].copy(), values[tuple(end.T)].copy()
    left, right = np.zeros(len(start)), np.ones(len(start))
    between, before = left, np.zeros(len(start), dtype=np.int64)
    for _ in range(FALSE_POSITIONS):
        between = (left * second - right * first) / (second - first)
        found = _at(function, base + between[:, None] * step)
        moved = np.where((found < 0) == (first < 0), 1, -1)
        kept = np.where(moved == before, 0.5, 1.0)
        first = np.where(moved == 1, found, first * kept)
        second = np.where(moved == 1, second * kept, found)
        left = np.where(moved == 1, between, left)
        right = np.where(moved == 1, right, between)
        before = moved
    return np.clip(between, CLEARANCE, 1 - CLEARANCE)


def _neighbours_mean(points: Array, faces: Indices, inner: Mask) -> Array:
    """Return the mean of the neighbours of each inner vertex, inner ones not counted."""
    total, count = np.zeros_like(points), np.zeros(len(points))
    for turn in range(AXES):
        here, there = faces[:, turn - 1], faces[:, turn]
        for one, other in ((here, there), (there, here)):
            used = inner[one] & ~inner[other]
            np.add.at(total, one[used], points[other[used]])
            np.add.at(count, one[used], 1.0)
    return np.asarray(total[inner] / count[inner, None])


def _merged(keys: Indices, faces: Indices) -> tuple[Indices, Indices]:
    """Return one vertex for each distinct key in use, and the faces in these numbers."""
    sizes = keys.max(axis=0) + 1
    codes = np.ravel_multi_index(tuple(keys.T), tuple(sizes))
    _, chosen, numbers = np.unique(codes[faces], return_index=True, return_inverse=True)
    return faces.ravel()[chosen], numbers.reshape(faces.shape)


def _shared(keys: Indices, faces: Indices, open_keys: Indices, open_faces: Indices) -> Mask:
    """Return which faces are also faces of the surface without caps."""
    both = np.concatenate([faces, open_faces + len(keys)])
    vertices, numbered = _merged(np.concatenate([keys, open_keys]), both)
    codes = np.sort(numbered, axis=1) @ (len(vertices) ** np.arange(AXES))
    return np.isin(codes[: len(faces)], codes[len(faces) :])


def _sewn_euler_characteristic(keys: Indices, faces: Indices, cells: Indices, wraps: Mask) -> int:
    """Return ``V - E + F`` of the surface without caps, opposite sides of the box identified."""
    wrapped = keys.copy()
    wrapped[:, :AXES] = np.where(wraps, keys[:, :AXES] % cells, keys[:, :AXES])
    vertices, sewn = _merged(wrapped, faces)
    edges = np.sort(np.concatenate([sewn[:, [0, 1]], sewn[:, [1, 2]], sewn[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_counts=True)
    if (counts != 2).any():
        msg = f"marching cubes left {int((counts != 2).sum())} edges without two faces at a seam"
        raise SolverError(msg)
    return int(len(vertices) - len(counts) + len(sewn))


def _closed(points: Array, faces: Indices, keys: Indices) -> "tuple[trimesh.Trimesh, Mask]":
    """Return the mesh with equal vertices joined, and which faces are left."""
    import trimesh

    vertices, joined = _merged(keys, faces)
    kept = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    mesh = trimesh.Trimesh(points[vertices], joined[kept], process=False)
    if not (mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0):
        msg = "marching cubes left a surface that is not closed"
        raise SolverError(msg)
    return mesh, kept


def _objects() -> Any:
    """Return trimesh with its paths; parts of it have no types."""
    import trimesh.path

    return trimesh


def _unbroken(curve: ArrayLike) -> list[Array]:
    """Return the pieces of a polyline between rows of NaN, those of two points and more."""
    line = np.asarray(curve, dtype=np.float64)
    gaps = np.flatnonzero(np.isnan(line).any(axis=1))
    pieces = np.split(line, gaps)
    whole = [piece[~np.isnan(piece).any(axis=1)] for piece in pieces]
    return [piece for piece in whole if len(piece) > 1]
