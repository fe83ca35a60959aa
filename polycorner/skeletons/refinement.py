"""Edges of a skeleton, refined."""

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.polyhedra.faces import projected
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.parts import Edge
from polycorner.skeletons.states import SearchState
from polycorner.spaces.manifold import Array


@checked
def traced(skeleton: Skeleton, edge: Edge, *, pieces: int = 8) -> Array:
    """Return points of an edge ``(k, n)``: its polyline with every chord cut into pieces.

    Newton's method projects the new points to the edge, so that they lie on it as exactly as
    those of the polyline; coordinates are not wrapped.

    Parameters
    ----------
    skeleton : Skeleton
        What :func:`~polycorner.skeletons.search.skeleton` returned.
    edge : Edge
        One of its edges.
    pieces : int, optional
        Number of pieces of a chord.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.
    """
    state = checks.instance("skeleton", skeleton, Skeleton).state
    checks.instance("skeleton", state, SearchState, "polycorner.skeleton")
    checks.instance("edge", edge, Edge)
    checks.whole("pieces", pieces, least=1)
    quotient, scales = state.quotient, skeleton.polyhedron.manifold.scale_array
    rows = [skeleton.polyhedron.names.index(name) for name in edge.active]
    kept = quotient.at(edge.polyline[len(edge.polyline) // 2]).basis(rows)
    points = [edge.polyline[0]]
    for start, end in zip(edge.polyline, edge.polyline[1:], strict=False):
        chord = float(np.linalg.norm((end - start) / scales))
        for s in np.arange(1, pieces) / pieces:
            point = projected(quotient, start + s * (end - start), kept, chord)
            if point is not None:
                points.append(point.q)
        points.append(end)
    return np.array(points)
