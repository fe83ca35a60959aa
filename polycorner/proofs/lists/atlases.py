"""Skeletons whose corners are proved to be all: their corners beside those of a complete list."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.parts import Completeness
from polycorner.skeletons.search import skeleton
from polycorner.spaces.manifold import Array
from polycorner.tolerances import TOLERANCE, Tolerances


def proved_skeleton(
    polyhedron: Polyhedron,
    points: Sequence[Array],
    symmetry: Symmetry,
    *,
    complete: bool,
    starts: Sequence[Any] = (),
    tolerance: float = TOLERANCE,
    **options: Any,
) -> Skeleton:
    """Return the skeleton found from corners, and whether its corners are proved to be all.

    Parameters
    ----------
    polyhedron : Polyhedron
    points : sequence of (n,) arrays
        The corners of a list.
    symmetry : Symmetry
        Symmetry to divide by.
    complete : bool
        Whether the list is complete.
    starts : sequence of (n,) arrays, optional
        Points of the set from which the search sets out as well.
    tolerance : float, optional
        Distance, in scale units, up to which a function counts as zero; corners of either side are
        compared with what belongs to it.
    options
        Of :func:`polycorner.skeleton`.
    """
    rows = [*points, *(np.asarray(q, dtype=float) for q in starts)]
    around = np.reshape(rows, (-1, polyhedron.manifold.size))
    found = skeleton(polyhedron, around, symmetry=symmetry, tolerance=tolerance, **options)
    notes = _mismatches(found, points, symmetry, Tolerances.of(tolerance).corner)
    if not complete:
        notes.append("the list of corners is not complete")
    proved = not notes and found.complete is Completeness.EXHAUSTED
    return replace(
        found,
        complete=Completeness.CORNERS_PROVED if proved else found.complete,
        notes=(*found.notes, *notes),
    )


def _mismatches(
    found: Skeleton, points: Sequence[Array], symmetry: Symmetry, reach: float
) -> list[str]:
    """Return sentences on the corners of one side that are not those of the other."""
    manifold = found.polyhedron.manifold
    pairs = [
        [bool(symmetry.relabellings(manifold, q, corner.point, reach)) for corner in found.corners]
        for q in points
    ]
    table = np.reshape(np.array(pairs, dtype=bool), (len(points), len(found.corners)))
    notes = [
        f"corner {k} of the list is {count} corners of the skeleton"
        for k, count in enumerate(table.sum(axis=1).tolist())
        if count != 1
    ]
    single = not (symmetry.elements or symmetry.fields)
    for k, count in enumerate(table.sum(axis=0).tolist()):
        if count == 0 or (single and count > 1):
            notes.append(f"corner {k} of the skeleton is {count} corners of the list")
    return notes
