"""The graph of a skeleton as GraphML, for other programs."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polycorner.checks import instance, refuse
from polycorner.container import XML, FileKind, versions
from polycorner.forms import Form, count, entries, flag, many, mapped, number, position, text, word
from polycorner.kinds import checked
from polycorner.polyhedra.strata import LocalType
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.parts import Completeness, Corner, Edge
from polycorner.skeletons.walks import End

if TYPE_CHECKING:
    import networkx as nx

    from polycorner.spaces.manifold import Array

KIND = FileKind("graph", "save_graph", XML)
HEADER = '<?xml version="1.0" encoding="utf-8"?>'
TAKEN = ("kind", "active", "rank", "dimension", "local_type", "singular", "chirality", "length")


def skeleton_graph(skeleton: Skeleton) -> "nx.MultiGraph":
    """Return corners as nodes and edges as edges, with plain values only.

    Corners are the nodes ``"0"``, ``"1"``, ...  Open ends of an edge have nodes of their own, such
    as ``"edge 3 from"`` and ``"edge 3 to"``; a closed edge is a loop at the node ``"edge 3"``.
    Lists of names are JSON.

    Parameters
    ----------
    skeleton : Skeleton

    Returns
    -------
    networkx.MultiGraph
    """
    import networkx as nx

    instance("skeleton", skeleton, Skeleton)
    names, units = skeleton.polyhedron.manifold.names, skeleton.polyhedron.manifold.units
    about = {
        "polycorner_version": versions()["polycorner"],
        "complete": skeleton.complete.name,
        "functions": json.dumps(skeleton.polyhedron.names),
        "length_units": "scale units",
        **{
            f"{_column(name)}_units": unit or "not stated"
            for name, unit in zip(names, units, strict=True)
        },
    }
    graph = nx.MultiGraph(**about)
    for k, corner in enumerate(skeleton.corners):
        graph.add_node(str(k), **_corner(corner), **_place(names, corner.point))
    for k, edge in enumerate(skeleton.edges):
        start, stop = _ends(k, edge)
        for node, where, kind in ((start, 0, edge.kinds[0]), (stop, -1, edge.kinds[1])):
            if node not in graph:
                point = skeleton.polyhedron.manifold.canonical(edge.polyline[where])
                graph.add_node(node, kind=kind.name.lower(), **_place(names, point))
        graph.add_edge(start, stop, key=k, **_edge(k, edge))
    return graph


@checked
def save_graph(skeleton: Skeleton, path: str | os.PathLike[str]) -> Path:
    """Write the graph of a skeleton (see :func:`skeleton_graph`) as GraphML, atomically.

    :func:`load_graph` checks the file and reads it; so does any other reader of GraphML.

    Parameters
    ----------
    skeleton : Skeleton
    path : path
        The file; its folder is created if it does not exist.

    Returns
    -------
    Path

    Raises
    ------
    TypeError
        If ``skeleton`` is none.
    OSError
        If the file cannot be written.
    """
    import networkx as nx

    lines = nx.generate_graphml(skeleton_graph(skeleton))
    return KIND.save(path, "\n".join([HEADER, *lines, ""]).encode())


@checked
def load_graph(path: str | os.PathLike[str]) -> "nx.MultiGraph":
    """Return the graph in a file that :func:`save_graph` wrote, after a check of its digest.

    Raises
    ------
    ValueError
        If the file is no such graph or was changed.
    """
    import networkx as nx

    content = KIND.load(path)
    with KIND.reading(path):
        if b"<!DOCTYPE" in content:  # where entities are defined, which may grow without bound
            refuse("content", "GraphML alone", "a document type")
        # Without its header, since networkx parses text, and text must not declare an encoding.
        graph = nx.parse_graphml(content.decode().removeprefix(HEADER), force_multigraph=True)
        _check(graph)
        return graph


def _check(graph: "nx.MultiGraph") -> None:
    """Check that a graph is that of a skeleton: its kinds, counts and places."""
    kind = word(*(end.name.lower() for end in End))
    names = many(word(*json.loads(graph.graph["functions"])))
    word(*Completeness.__members__)("complete", graph.graph["complete"])
    taken: dict[str, Form] = {"rank": count, "dimension": count, "singular": flag}
    taken |= {"local_type": word(*LocalType.__members__), "active": _json(names)}
    for node, about in graph.nodes(data=True):
        at_corner = about.get("kind") == End.CORNER.name.lower()
        entries({"kind": kind} | (taken if at_corner else {}))(node, about)
        place = {name: x for name, x in about.items() if name not in ("kind", "chirality", *taken)}
        mapped(text, number())(node, place)
    lengths = {"active": _json(names), "length": number(least=0), "from_kind": kind}
    edge = entries({"position": position(len(graph.edges)), "to_kind": kind} | lengths)
    for start, stop, about in graph.edges(data=True):
        edge(f"edge from {start} to {stop}", about)


def _json(form: Form) -> Form:
    return lambda place, value: form(place, json.loads(text(place, value)))


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
