"""Subdivision of a triangulated surface ``min f_i = 0`` along its creases."""

from dataclasses import dataclass, replace

import numpy as np

from polycorner.pictures.solids.charts import Chart
from polycorner.pictures.solids.grids import Indices, Mask
from polycorner.spaces.manifold import Array

ROUNDS = 6
# Least initial distance of a new vertex from the ends of its edge, as a fraction.
MARGIN = 0.02
HALVINGS = 6


@dataclass(frozen=True)
class Cut:
    """A closed triangulation, and the functions that vanish at its vertices.

    Attributes
    ----------
    places : (V, 3) array
        Vertices, in cells.
    active : (V, m) bool
        Functions that vanish there; none at a vertex inside a cap.
    fixed : (V, 3) bool
        Coordinates that must not change: those of the seams.
    faces : (F, 3) int
    caps : (F,) bool
        Faces that close the chart at a seam.
    """

    places: Array
    active: Mask
    fixed: Mask
    faces: Indices
    caps: Mask

    @property
    def common(self) -> Mask:
        """Functions that vanish at all three vertices of a face, ``(F, m)``."""
        return np.asarray(self.active[self.faces].all(axis=1))


def cut_along_creases(cut: Cut, chart: Chart) -> Cut:
    """Return the surface with vertices where edges cross from one function to another.

    Edges whose ends have no function in common are split where two functions vanish; faces
    whose corners have none in common, but in pairs, get a vertex where three vanish.  Every face
    then lies on one function.  Subdividing keeps a surface closed.
    """
    for _ in range(ROUNDS):
        cut, edges = _split_edges(cut, chart)
        cut, centres = _split_faces(cut, chart)
        if not edges + centres:
            break
    return cut


def edges_of(faces: Indices) -> tuple[Indices, Indices]:
    """Return the edges ``(E, 2)``, lower vertex first, and the edge of each side ``(F, 3)``.

    Side ``k`` of a face goes from its vertex ``k`` to the next.
    """
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    count = int(faces.max()) + 1
    codes, numbers = np.unique(low * count + high, return_inverse=True)
    return np.stack([codes // count, codes % count], axis=1), numbers.reshape(faces.shape)


def _split_edges(cut: Cut, chart: Chart) -> tuple[Cut, int]:
    edges, sides = edges_of(cut.faces)
    apart = ~(cut.active[edges[:, 0]] & cut.active[edges[:, 1]]).any(axis=1)
    on_surface = np.zeros(len(edges), dtype=bool)
    on_surface[sides[~cut.caps]] = True
    chosen = np.flatnonzero(apart & on_surface)
    if not len(chosen):
        return cut, 0
    ends = edges[chosen]
    fixed = cut.fixed[ends].all(axis=1)
    fixed &= cut.places[ends[:, 0]] == cut.places[ends[:, 1]]
    start, wanted = _crossings(cut, ends, chart)
    places, active = chart.meet(start, wanted, fixed)
    numbers = np.full(len(edges), -1)
    numbers[chosen] = len(cut.places) + np.arange(len(chosen))
    grown = _with_vertices(cut, places, active, fixed)
    faces, parents = subdivided(cut.faces, numbers[sides], grown.places)
    return replace(grown, faces=faces, caps=cut.caps[parents]), len(chosen)


def _crossings(cut: Cut, ends: Indices, chart: Chart) -> tuple[Array, Mask]:
    """Return points on edges where two functions exchange the minimum, and the two functions.

    Between two creases without a common function there is a corner of all their functions.
    """
    start, stop = cut.places[ends[:, 0]], cut.places[ends[:, 1]]
    middle = chart.distances((start + stop) / 2)
    rows = np.arange(len(ends))
    first, second = (
        np.where(cut.active[ends[:, k]], middle, np.inf).argmin(axis=1) for k in (0, 1)
    )
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    for _ in range(HALVINGS):
        share = (low + high) / 2
        between = chart.distances(start + share[:, None] * (stop - start))
        ahead = between[rows, first] <= between[rows, second]
        low, high = np.where(ahead, share, low), np.where(ahead, high, share)
    share = np.clip((low + high) / 2, MARGIN, 1 - MARGIN)[:, None]
    wanted = np.zeros((len(ends), cut.active.shape[1]), dtype=bool)
    wanted[rows, first] = wanted[rows, second] = True
    either = cut.active[ends]
    creases = (np.asarray(either.sum(axis=2)) > 1).all(axis=1)
    wanted |= either.any(axis=1) & np.asarray(creases)[:, None]
    return start + share * (stop - start), wanted


def _split_faces(cut: Cut, chart: Chart) -> tuple[Cut, int]:
    corners = cut.active[cut.faces]
    pairs = corners & np.roll(corners, -1, axis=1)
    joined = np.asarray(pairs.any(axis=2)).all(axis=1)
    chosen = np.flatnonzero(joined & ~cut.common.any(axis=1) & ~cut.caps)
    if not len(chosen):
        return cut, 0
    faces = cut.faces[chosen]
    fixed = np.zeros((len(chosen), 3), dtype=bool)
    middle = cut.places[faces].mean(axis=1)
    places, active = chart.meet(middle, np.asarray(pairs[chosen].any(axis=1)), fixed)
    grown = _with_vertices(cut, places, active, fixed)
    new = len(cut.places) + np.arange(len(chosen))
    fans = [np.stack([faces[:, k - 1], faces[:, k], new], axis=1) for k in range(3)]
    kept = np.delete(np.arange(len(cut.faces)), chosen)
    whole = np.concatenate([cut.faces[kept], *fans])
    caps = np.concatenate([cut.caps[kept], np.zeros(3 * len(chosen), dtype=bool)])
    return replace(grown, faces=whole, caps=caps), len(chosen)


def _with_vertices(cut: Cut, places: Array, active: Mask, fixed: Mask) -> Cut:
    return replace(
        cut,
        places=np.concatenate([cut.places, places]),
        active=np.concatenate([cut.active, active]),
        fixed=np.concatenate([cut.fixed, fixed]),
    )


def subdivided(faces: Indices, middles: Indices, places: Array) -> tuple[Indices, Indices]:
    """Return faces subdivided at vertices on some of their sides, and the parent of each.

    Parameters
    ----------
    faces : (F, 3) int
    middles : (F, 3) int
        The vertex on side ``k``, or -1.
    places : (V, 3) array
        Vertices; quadrilaterals are cut along the shorter diagonal.
    """
    count = (middles >= 0).sum(axis=1)
    parts, parents = [faces[count == 0]], [np.flatnonzero(count == 0)]
    for number in (1, 2, 3):
        chosen = np.flatnonzero(count == number)
        # Rotated so that the side that is split, or the one that is not, comes first.
        first = (middles[chosen] >= 0) if number == 1 else (middles[chosen] < 0)
        turn = (first.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces[chosen], turn, axis=1).T
        m, n, o = np.take_along_axis(middles[chosen], turn, axis=1).T
        if number == 1:
            pieces = [(a, m, c), (m, b, c)]
        elif number == 2:
            far = np.linalg.norm(places[a] - places[n], axis=1)
            short = far <= np.linalg.norm(places[b] - places[o], axis=1)
            pieces = [(n, c, o), (a, b, np.where(short, n, o))]
            pieces.append((np.where(short, a, b), n, o))
        else:
            pieces = [(a, m, o), (b, n, m), (c, o, n), (m, n, o)]
        parts += [np.stack(piece, axis=1) for piece in pieces]
        parents += [chosen] * len(pieces)
    return np.concatenate(parts), np.concatenate(parents)
