"""Edges of an atlas as finely as one likes."""

import numpy as np

from polycorner.skeletons.elements import Edge, Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.points import projected
from polycorner.spaces.manifold import Array


def traced(atlas: Skeleton, edge: Edge, *, pieces: int = 8) -> Array:
    """Return points of an edge ``(k, n)``: its polyline with every chord cut into pieces.

    The new points are brought to the edge by Newton's method, so that they lie on it as exactly
    as those of the polyline do; coordinates are not wrapped.

    Parameters
    ----------
    atlas : Skeleton
        What :func:`~polycorner.skeletons.search.skeleton` returned.
    edge : Edge
        One of its edges.
    pieces : int, optional
        Into how many pieces a chord is cut.
    """
    explorer: Explorer = atlas.state
    rows = [atlas.polyhedron.names.index(name) for name in edge.active]
    kept = explorer.quotient.at(edge.polyline[len(edge.polyline) // 2]).basis(rows)
    points = [edge.polyline[0]]
    for start, end in zip(edge.polyline, edge.polyline[1:], strict=False):
        chord = float(np.linalg.norm((end - start) / explorer.scales))
        for s in np.arange(1, pieces) / pieces:
            point = projected(explorer.quotient, start + s * (end - start), kept, chord)
            if point is not None:
                points.append(point.q)
        points.append(end)
    return np.array(points)
