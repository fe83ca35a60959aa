"""The graph of a skeleton as GraphML, for other programs."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polycorner.atomic import write_atomically
from polycorner.files.container import versions
from polycorner.files.models import units_of
from polycorner.skeletons.elements import Corner, Edge, Skeleton
from polycorner.skeletons.walks import End

if TYPE_CHECKING:
    import networkx as nx

    from polycorner.spaces.manifold import Array

SCHEMA = 1
TAKEN = ("kind", "active", "rank", "dimension", "local_type", "singular", "chirality", "length")


def skeleton_graph(
    skeleton: Skeleton, *, units: Mapping[str, str] | None = None
) -> "nx.MultiGraph":
    """Return corners as nodes and edges as edges, with plain values only.

    Nodes are called by the position of the corner, ``"0"``, ``"1"``, ...  What is no corner gets a
    node of its own, called by the edge: ``"edge 3 from"`` and ``"edge 3 to"`` for ends that are
    open, ``"edge 3"`` for a closed edge, which is a loop there.  Lists of names are JSON.

    Parameters
    ----------
    skeleton : Skeleton
    units : mapping from str to str, optional
        Units of coordinates by name, as for :func:`~polycorner.files.save_skeleton`.

    Returns
    -------
    networkx.MultiGraph
    """
    import networkx as nx

    if not isinstance(skeleton, Skeleton):
        msg = f"skeleton: expected a Skeleton; got {type(skeleton).__name__}"
        raise TypeError(msg)
    names = skeleton.polyhedron.manifold.names
    known = units_of(skeleton.polyhedron, None, units).coordinates
    about = {
        "polycorner_graph": SCHEMA,
        "polycorner_version": versions()["polycorner"],
        "complete": skeleton.complete.name,
        "functions": json.dumps(skeleton.polyhedron.names),
        "length_units": "scale units",
        **{f"{_column(name)}_units": known[name] or "not stated" for name in names},
    }
    graph = nx.MultiGraph(**about)
    for k, corner in enumerate(skeleton.corners):
        graph.add_node(str(k), **_corner(corner), **_place(names, corner.point))
    for k, edge in enumerate(skeleton.edges):
        start, stop = _ends(k, edge)
        for node, where, kind in ((start, 0, edge.kinds[0]), (stop, -1, edge.kinds[1])):
            if node not in graph:
                point = skeleton.polyhedron.manifold.wrap(edge.polyline[where])
                graph.add_node(node, kind=kind.name.lower(), **_place(names, point))
        graph.add_edge(start, stop, key=k, **_edge(k, edge))
    return graph


def save_graph(
    skeleton: Skeleton, path: str | os.PathLike[str], *, units: Mapping[str, str] | None = None
) -> Path:
    """Write the graph of a skeleton as GraphML; the file appears whole or not at all.

    What is in it says :func:`skeleton_graph`; ``networkx.read_graphml`` reads it again.

    Parameters
    ----------
    skeleton : Skeleton
    path : path
        The file; its folder is made if need be.
    units : mapping from str to str, optional
        Units of coordinates by name.

    Returns
    -------
    Path

    Raises
    ------
    TypeError, ValueError
        Naming the argument.
    OSError
        If the file cannot be written.
    """
    import networkx as nx

    lines = nx.generate_graphml(skeleton_graph(skeleton, units=units))
    text = "\n".join(['<?xml version="1.0" encoding="utf-8"?>', *lines, ""])
    return write_atomically(path, text)


def _corner(corner: Corner) -> dict[str, Any]:
    stratum = corner.stratum
    chirality = {} if corner.chirality is None else {"chirality": corner.chirality}
    return {
        "kind": End.CORNER.name.lower(),
        "active": json.dumps(corner.active),
        "rank": int(corner.rank),
        "dimension": int(stratum.dimension),
        "local_type": corner.local_type.name,
        "singular": bool(corner.singular),
        **chirality,
    }


def _edge(k: int, edge: Edge) -> dict[str, Any]:
    return {
        "position": k,
        "active": json.dumps(edge.active),
        "length": float(edge.length),
        "from_kind": edge.kinds[0].name.lower(),
        "to_kind": edge.kinds[1].name.lower(),
        "branches": int(edge.branches),
    }


def _ends(k: int, edge: Edge) -> tuple[str, str]:
    """Return the nodes at the ends of an edge."""
    if edge.is_closed:
        return f"edge {k}", f"edge {k}"
    first, last = edge.ends
    return (
        f"edge {k} from" if first is None else str(first),
        f"edge {k} to" if last is None else str(last),
    )


def _place(names: tuple[str, ...], point: "Array") -> dict[str, float]:
    return dict(zip(map(_column, names), point.tolist(), strict=True))


def _column(name: str) -> str:
    """Return the attribute of a coordinate: its name, with a line after it where that is taken."""
    return f"{name}_" if name in TAKEN else name
