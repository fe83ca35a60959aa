"""Watertight meshes of regions ``{min f_i < 0}`` with sharp edges and corners."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import about
from polycorner.errors import SolverError
from polycorner.kinds import checked
from polycorner.pictures import arguments
from polycorner.pictures.solids.charts import Chart, Gaps
from polycorner.pictures.solids.creases import Cut, cut_along_creases, edges_of
from polycorner.pictures.solids.edge_collapse import LONG, Labelled, collapsed, labelled
from polycorner.pictures.solids.grids import Bounds, Indices, Mask
from polycorner.pictures.solids.meshes import Isosurface, closed_mesh, isosurface
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

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


@dataclass(frozen=True, eq=False)
class SharpSurface(Isosurface):
    """The boundary of a region ``{min f_i < 0}``, each of whose faces lies on one function.

    Errors are in the units of the functions; all are of second order in the spacing.

    Attributes
    ----------
    labels : (F,) int
        The function that vanishes on a face; -1 on caps.  Kept with the mesh as
        ``mesh.face_attributes["part"]``.
    active : (V, m) bool
        Functions that vanish at a vertex: one inside a face, two on a crease, more at a corner,
        none inside a cap.
    surface_error : float
        Largest ``|min f_i|`` at vertices, in the middles of faces and of their sides.
    edge_error : float
        Largest ``|f_i|`` of either function at the ends and in the middles of creases.
    unresolved : int
        Number of faces whose corners have no function in common: 0 unless the grid is too coarse
        to separate creases.
    curved_volume : float
        The volume with a correction for the curvature of the faces, of higher order than
        :attr:`volume`.
    """

    labels: Indices
    active: Mask
    surface_error: float
    edge_error: float
    unresolved: int
    curved_volume: float

    @property
    def watertight(self) -> bool:
        """Whether every edge has two faces, wound in opposite ways."""
        return bool(self.mesh.is_watertight and self.mesh.is_winding_consistent)

    @cached_property
    def creases(self) -> Indices:
        """Edges between faces of different functions, ``(k, 2)`` numbers of vertices."""
        edges, one, other = _creases(np.asarray(self.mesh.faces), self.labels)
        return edges[(one >= 0) & (other >= 0)]

    @cached_property
    def corners(self) -> Array:
        """Vertices where a crease ends or more than two meet, ``(k, 3)``.

        A crease that is cut at a seam does not end there.
        """
        ends, counts = np.unique(self.creases, return_counts=True)
        faces = np.asarray(self.mesh.faces)
        rim = np.isin(ends, faces[self.caps])
        return np.asarray(self.mesh.vertices[ends[(counts > 2) | ((counts == 1) & ~rim)]])

    @checked
    def corner_error(self, corners: ArrayLike, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> float:
        """Return the largest distance of given corners ``(k, 3)`` from the nearest vertex.

        Coordinates are first multiplied with ``scale``, such as millimetres per radian.  Along
        periodic axes the nearest image counts.
        """
        from scipy.spatial import cKDTree

        sides = self.bounds[:, 1] - self.bounds[:, 0]
        factors = arguments.factors("scale", scale)
        inside = finite(arguments.points("corners", corners), "corners") - self.bounds[:, 0]
        inside = np.where(self.periodic, inside % sides, inside)
        vertices = np.asarray(self.mesh.vertices) - self.bounds[:, 0]
        away, _ = cKDTree(vertices * factors).query(inside * factors)
        return float(np.max(away, initial=0.0))


@checked
def sharp_surface(
    gaps: Gaps,
    bounds: Bounds,
    resolution: int | Sequence[int],
    periodic: Sequence[bool] = (False, False, False),
) -> SharpSurface:
    """Return the boundary of ``{min f_i < 0}`` in a box, with mesh edges along its creases.

    1. Marching cubes ([LLVT]) and false position give a closed triangulation of
       ``min f_i = 0`` (:func:`~polycorner.pictures.isosurface`).
    2. Newton's method moves each vertex to the zeros of the least function there.
    3. Edges from one function to another get a vertex where both vanish, faces between three a
       vertex where three vanish: vertices on features as in [KBSS], by Newton's method on the
       functions themselves in place of a fit to normals.  Where a third function is negative it
       has to vanish, too, which finds corners, those of four faces and rank three included.
    4. Short edges collapse along faces and creases, and edges inside faces are flipped, until
       faces are well shaped.

    Steps 3 and 4 subdivide, collapse under the link condition ([DEGN]) and flip edges of a closed
    surface, which stays closed for all functions.  Where one function is only piecewise smooth,
    such as the distance from a segment, its gradient is continuous and there is no crease; the jump
    of the curvature costs no order.

    Parameters
    ----------
    gaps : callable
        Of points ``(N, 3)`` and an order: the values ``(N, m)`` alone for order 0, with the
        gradients ``(N, m, 3)`` for order 1.
    bounds, resolution, periodic
        As for :func:`~polycorner.pictures.isosurface`.  Only the least function
        has to be periodic; the others may exchange their roles.

    Raises
    ------
    TypeError, ValueError
        As for :func:`~polycorner.pictures.isosurface`.
    SolverError
        If the surface found is not closed.
    """

    def least(points: Array) -> Array:
        with about("gaps"):
            return np.asarray(gaps(points, 0)[0].min(axis=-1))

    rough = isosurface(least, bounds, resolution, periodic)
    chart = Chart(gaps, rough.bounds[:, 0], rough.spacing)
    whole = labelled(cut_along_creases(_settled(rough, chart), chart), chart)
    return _surface(rough, flipped(collapsed(whole)), chart)


def _settled(rough: Isosurface, chart: Chart) -> Cut:
    """Return an isosurface with its vertices moved to their functions, within seams on seams."""
    places = chart.places(np.asarray(rough.mesh.vertices))
    faces, cells = np.asarray(rough.mesh.faces), np.array(rough.inside.shape) - 1
    fixed = np.isclose(places, 0.0, atol=1e-6) | np.isclose(places, cells, rtol=0.0, atol=1e-6)
    fixed &= np.array(rough.periodic) & _used(len(places), faces[rough.caps])[:, None]
    places = np.where(fixed, np.round(places), places)
    on_surface = _used(len(places), faces[~rough.caps])
    places[on_surface], found = chart.descend(places[on_surface], fixed[on_surface])
    active = np.zeros((len(places), found.shape[1]), dtype=bool)
    active[on_surface] = found
    return Cut(places, active, fixed, faces, rough.caps)


def _used(count: int, faces: Indices) -> Mask:
    used = np.zeros(count, dtype=bool)
    used[faces] = True
    return used


def _surface(rough: Isosurface, whole: Labelled, chart: Chart) -> SharpSurface:
    cut = whole.cut
    used, faces = np.unique(cut.faces, return_inverse=True)
    places, faces = cut.places[used], faces.reshape(cut.faces.shape)
    labels = np.where(cut.caps, -1, whole.labels)
    mesh = closed_mesh(chart.points(places), faces, "sharpening", part=labels)
    if mesh.euler_number != rough.mesh.euler_number:
        msg = "sharpening changed the topology of a surface"
        raise SolverError(msg)
    curved = float(mesh.volume) + _between(places, faces, labels, chart)
    kept = {field.name: getattr(rough, field.name) for field in fields(rough)}
    return SharpSurface(
        **kept | {"mesh": mesh, "caps": cut.caps},
        labels=labels,
        active=cut.active[used],
        surface_error=_surface_error(places, faces[~cut.caps], chart),
        edge_error=_edge_error(places, faces, labels, chart),
        unresolved=whole.unresolved,
        curved_volume=curved,
    )


def _surface_error(places: Array, faces: Indices, chart: Chart) -> float:
    edges, _ = edges_of(faces)
    tried = [places[np.unique(faces)], places[faces].mean(axis=1), places[edges].mean(axis=1)]
    values, _ = chart.evaluate(np.concatenate(tried))
    return float(abs(values.min(axis=1)).max())


def _creases(faces: Indices, labels: Indices) -> tuple[Indices, Indices, Indices]:
    """Return edges ``(k, 2)`` between faces of different labels, and these labels."""
    edges, sides = edges_of(faces)
    beside = np.argsort(sides.ravel(), kind="stable").reshape(-1, 2) // 3
    one, other = labels[beside].T
    return edges[one != other], one[one != other], other[one != other]


def _edge_error(places: Array, faces: Indices, labels: Indices, chart: Chart) -> float:
    edges, one, other = _creases(faces, labels)
    inner = (one >= 0) & (other >= 0)
    edges, rows = edges[inner], np.arange(int(inner.sum()))
    worst = 0.0
    for tried in (places[edges[:, 0]], places[edges[:, 1]], places[edges].mean(axis=1)):
        values, _ = chart.evaluate(tried)
        for label in (one[inner], other[inner]):
            worst = max(worst, float(abs(values[rows, label]).max(initial=0.0)))
    return worst


def _between(places: Array, faces: Indices, labels: Indices, chart: Chart) -> float:
    """Return the volume between flat faces and curved ones.

    The surface has height ``-f / (grad f . n)`` above a face; the midpoints of the sides integrate
    quadratic heights exactly.
    """
    on_surface = labels >= 0
    faces, labels = faces[on_surface], labels[on_surface]
    a, b, c = (places[corner] for corner in faces.T)
    normal = np.cross(b - a, c - a) / 2
    area, rows = np.linalg.norm(normal, axis=1), np.arange(len(faces))
    total = 0.0
    for one, other in ((a, b), (b, c), (c, a)):
        values, slopes = chart.evaluate((one + other) / 2)
        steep = np.einsum("fk,fk->f", slopes[rows, labels], normal)
        height = -values[rows, labels] * area**2 / np.where(steep > 0, steep, np.inf)
        total += float(height.sum()) / 3
    return total * float(chart.spacing.prod())
