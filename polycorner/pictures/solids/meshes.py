"""Watertight meshes of regions ``{f < 0}`` of space, their topology, and mesh files."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgba
from numpy.typing import ArrayLike

from polycorner.atomic import replace_atomically
from polycorner.checks import refuse
from polycorner.errors import SolverError
from polycorner.kinds import checked
from polycorner.pictures import arguments
from polycorner.pictures.solids.grids import (
    AXES,
    Bounds,
    Function,
    Indices,
    Mask,
    check_ends,
    crossings,
    evaluate,
    grid,
    layer,
)
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import trimesh

# Kinds of vertices beside 0, 1 and 2, which lie on an edge along that axis.
ON_NODE, IN_CELL = 3, 4
# Least size of the values given to marching cubes, and of the differences between them.
LEAST = 0.05


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


@dataclass(frozen=True, eq=False)
class Isosurface(Checked):
    """The boundary of a region ``{f < 0}`` of a box some of whose sides may be identified.

    ``mesh`` is closed in the chart: where the region crosses the seam of a periodic axis, flat
    caps close it at both ends, so that it bounds a volume.  ``euler_characteristic`` belongs to
    the surface without caps, its seam sewn together.

    Attributes
    ----------
    mesh : trimesh.Trimesh
        Watertight, with outward normals; ``mesh.euler_number`` is that of the capped surface.
    caps : (F,) bool
        Mask of the faces that are caps.
    euler_characteristic : int
        ``V - E + F`` of the surface, opposite sides of periodic axes identified.
    inside : (n1 + 1, n2 + 1, n3 + 1) bool
        Sign of ``f`` on the grid; the last layer of a periodic axis repeats the first.
    bounds : (3, 2) float
        The box.
    periodic : tuple of three bool
        Mask of the periodic axes.
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
        """The area of the surface without caps; units of the axes (mm, radians) are mixed."""
        return float(np.asarray(self.mesh.area_faces)[~self.caps].sum())

    @property
    def spacing(self) -> Array:
        """The sides of a cell of the grid, ``(3,)``."""
        sides = self.bounds[:, 1] - self.bounds[:, 0]
        return np.asarray(sides / (np.array(self.inside.shape) - 1))


@checked
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
    evaluated slab by slab; crossings stay ``1e-3`` of an edge away from its ends.

    Parameters
    ----------
    function : callable
        ``f`` of points ``(N, 3)``, returning ``(N,)``; continuous.
    bounds : sequence of three pairs
        Least and greatest value of each coordinate.
    resolution : int or three of them
        Number of cells along each axis, at least 4.
    periodic : three bool, optional
        Axes along which ``f`` is periodic with the length of the box.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong form; where the region is empty, fills the box, or touches the
        end of an axis that is not periodic; where ``f`` differs at the ends of a periodic one.
    SolverError
        If the surface found is not closed.
    """
    box, cells, wraps = grid(bounds, resolution, periodic)
    values = evaluate(function, box, cells)
    check_ends(values, box, wraps)
    for axis in np.flatnonzero(wraps).tolist():
        layer(values, axis, -1)[...] = layer(values, axis, 0)
    signed = _distinct(values, wraps)
    open_places, open_faces = _march(signed, np.zeros(AXES, dtype=bool))
    open_keys = keys_of(open_places, cells)
    euler = sewn_euler_characteristic(open_keys, open_faces, cells, wraps)
    places, faces = _march(signed, wraps)
    keys = keys_of(places, cells)
    points = _points(function, values, keys, faces, box)
    caps = ~shared(keys, faces, open_keys, open_faces)
    mesh, kept = _closed(points, faces, keys)
    flags = (bool(wraps[0]), bool(wraps[1]), bool(wraps[2]))
    return Isosurface(mesh, caps[kept], euler, values < 0, box, flags)


@checked
def components_of_complement(surface: Isosurface) -> int:
    """Return the number of connected components of ``{f >= 0}``, seams identified.

    Grid points are joined to their neighbours along the axes, so passages narrower than a cell
    may be missed.
    """
    from scipy.ndimage import label
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    labels, count = label(~surface.inside)
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for axis in np.flatnonzero(surface.periodic).tolist():
        ends = np.stack([layer(labels, axis, 0).ravel(), layer(labels, axis, -1).ravel()], axis=1)
        pairs.append(ends[(ends > 0).all(axis=1)] - 1)
    joined = np.concatenate(pairs)
    graph = coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(count, count))
    return int(connected_components(graph, directed=False)[0])


@checked
def write_mesh(
    mesh: "trimesh.Trimesh",
    path: Path,
    *,
    curves: Sequence[tuple[str, ArrayLike]] = (),
    points: ArrayLike = (),
    scale: Sequence[float] = (1.0, 1.0, 1.0),
    facts: Mapping[str, object] | None = None,
) -> Path:
    """Write a mesh as ``.glb`` or ``.ply`` and return the path.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        The surface.
    path : Path
        Its suffix determines the format; folders are created.
    curves : sequence of (name, (k, 3) array), optional
        Polylines for the scene of a GLB, broken at rows of NaN.
    points : (m, 3) array_like, optional
        Points for the scene of a GLB.
    scale : three float, optional
        Factors of the coordinates, such as millimetres per radian.
    facts : mapping, optional
        Numbers and texts kept as metadata of a GLB scene.

    Raises
    ------
    ValueError
        For another suffix, or for curves, points or facts in a PLY.
    """
    suffix = path.suffix.lower()
    if suffix not in (".glb", ".ply"):
        refuse("path", "a name ending in .glb or .ply", path.name)
    marks = arguments.points("points", points)
    lines = [(name, arguments.points("curves", curve)) for name, curve in curves]
    if suffix == ".ply" and (len(curves) or len(marks) or facts):
        refuse("path", "a name ending in .glb for curves, points and facts", path.name)
    factors, made = arguments.factors("scale", scale), _objects()
    scene = made.Scene(metadata=dict(facts or {}))
    solid = made.Trimesh(np.asarray(mesh.vertices) * factors, mesh.faces, process=False)
    scene.add_geometry(solid, geom_name="solid")
    for name, line in lines:
        for number, piece in enumerate(_unbroken(line)):
            order = made.path.entities.Line(np.arange(len(piece)))
            drawn = made.path.Path3D([order], piece * factors, process=False)
            scene.add_geometry(drawn, geom_name=f"{name} {number + 1}")
    if len(marks):
        scene.add_geometry(made.PointCloud(marks * factors), geom_name="points")
    with replace_atomically(path) as temporary:
        (scene if suffix == ".glb" else solid).export(temporary)
    return path


def _march(signed: Array, capped: Mask) -> tuple[Array, Indices]:
    """Return vertices, in steps of the grid, and outward faces; flat caps close some axes."""
    from skimage.measure import marching_cubes

    padded = np.pad(signed, [(int(c), int(c)) for c in capped], constant_values=1.0)
    march: Any = marching_cubes
    places, faces, _, _ = march(padded, 0.0, gradient_direction="descent")
    return places.astype(np.float64) - capped, faces.astype(np.int64)


def _distinct(values: Array, wraps: Mask) -> Array:
    """Return values with the same signs, of size ``LEAST`` to 1, that marching cubes can handle.

    The implementation works in single precision, so crossings are kept away from the nodes.  It
    resolves faces whose corners alternate in sign by comparing products of opposite corners; ties,
    common on symmetric regions, would be broken differently on both sides of a face, and small
    asymmetric factors prevent them.
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


def _points(
    function: Function,
    values: Array,
    keys: Indices,
    faces: Indices,
    box: Array,
) -> Array:
    """Return the vertices in the units of the box, those on edges at ``f = 0``."""
    cells = np.array(values.shape) - 1
    spacing = (box[:, 1] - box[:, 0]) / cells
    nodes, kind = keys[:, :AXES], keys[:, AXES]
    exact = nodes.astype(np.float64)
    on_edge = kind < AXES
    start, axis = nodes[on_edge], kind[on_edge]
    end = start + np.eye(AXES, dtype=np.int64)[axis]
    exact[on_edge, axis] += crossings(function, values, start, end, box[:, 0], spacing)
    inner = kind == IN_CELL
    if inner.any():
        exact[inner] = _neighbours_mean(exact, faces, inner)
    return np.asarray(box[:, 0] + exact * spacing)


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


def _closed(points: Array, faces: Indices, keys: Indices) -> "tuple[trimesh.Trimesh, Mask]":
    """Return the mesh with equal vertices merged, and a mask of the faces kept."""
    vertices, joined = merged(keys, faces)
    kept = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return closed_mesh(points[vertices], joined[kept], "marching cubes"), kept


def closed_mesh(points: Array, faces: Indices, method: str, **attributes: Any) -> "trimesh.Trimesh":
    """Return a mesh of points ``(V, 3)`` and outward faces ``(F, 3)`` that bounds a volume.

    Attributes are numbers ``(F,)`` kept with the faces.

    Raises
    ------
    SolverError
        If it is not closed.
    """
    import trimesh

    mesh = trimesh.Trimesh(points, faces, face_attributes=attributes, process=False)
    if not (mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0):
        msg = f"{method} left a surface that is not closed"
        raise SolverError(msg)
    return mesh


def _objects() -> Any:
    """Return trimesh with its paths, which have no types."""
    import trimesh.path

    return trimesh


def _unbroken(line: Array) -> list[Array]:
    """Return the pieces of a polyline between rows of NaN, those of two points and more."""
    gaps = np.flatnonzero(np.isnan(line).any(axis=1))
    pieces = np.split(line, gaps)
    whole = [piece[~np.isnan(piece).any(axis=1)] for piece in pieces]
    return [piece for piece in whole if len(piece) > 1]


def painted(
    mesh: Any, colour: str, *, opacity: float = 1.0, rough: float = 0.55, two_sided: bool = False
) -> "trimesh.Trimesh":
    """Give a mesh a material of one colour, not metallic, since there is nothing to reflect."""
    import trimesh

    made: Any = trimesh.visual
    material = made.material.PBRMaterial(
        baseColorFactor=[*map(_linear, to_rgba(colour)[:3]), round(255 * opacity)],
        metallicFactor=0.0,
        roughnessFactor=rough,
        doubleSided=two_sided or opacity < 1,
        alphaMode="BLEND" if opacity < 1 else "OPAQUE",
    )
    mesh.visual = made.TextureVisuals(material=material)
    found: trimesh.Trimesh = mesh
    return found


def _linear(part: float) -> int:
    """Return a component of an sRGB colour as linear light from 0 to 255, as in GLB files."""
    return round(255 * (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4))
