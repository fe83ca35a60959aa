"""Edges of an atlas as finely as one likes."""

import numpy as np

from polycorner.skeletons.curves import settle
from polycorner.skeletons.elements import Edge, Skeleton
from polycorner.skeletons.explorer import Explorer
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
    kept = explorer.ground.spot(edge.polyline[len(edge.polyline) // 2]).basis(rows)
    points = [edge.polyline[0]]
    for start, end in zip(edge.polyline, edge.polyline[1:], strict=False):
        chord = float(np.linalg.norm((end - start) / explorer.scales))
        for s in np.arange(1, pieces) / pieces:
            frame = settle(explorer.ground, start + s * (end - start), kept, chord)
            if frame is not None:
                points.append(frame.q)
        points.append(end)
    return np.array(points)
