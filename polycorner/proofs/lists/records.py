"""Files with a complete list and its proof, which :mod:`~polycorner.proofs.lists.checker` verifies.

A file is a zip archive of

``problem.json``
    coordinates and their periods; the functions (inequalities, equations, energy) as one
    straight-line program with exact constants; the set as a union of intersections; the domain;
    regions, loci and symmetries; the list that is claimed.  Sides are hexadecimal doubles,
    enclosures of solutions pairs of them.
``tree.bin``, ``positions.bin``
    The subdivision, each node before its halves: the axis of a split, -1 for a closed and -2 for an
    open box (8-bit integers); where boxes are split (doubles).
``counts.bin``, ``directions.bin``
    How many directions belong to each closed box (8 bits), and these (single precision).

Numbers are little-endian.  Derivatives are not stored.
"""

import io
import json
import math
import os
import zipfile
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.atomic import write_atomically
from polycorner.formulas.programs import Graph
from polycorner.formulas.ranges import arguments, pattern
from polycorner.intervals.tapes import needed
from polycorner.proofs.lists.acceptance import Region
from polycorner.proofs.lists.images import Motion
from polycorner.proofs.lists.loci import Locus
from polycorner.proofs.lists.members import IN, OUT, Known, membership
from polycorner.proofs.lists.search import Search
from polycorner.spaces.manifold import Array

FORMAT = ("polycorner-stationary-list", 1)
MOST_TURNS = 64  # periods up to this multiple of pi are taken for exact ones


def save(path: str | os.PathLike[str], search: Search) -> Path:
    """Save the list that a search found, and its proof; return the path.

    Parameters
    ----------
    path : path
        Ends in ``.zip``.
    search : Search
        Of points that are images of each other, those that it met are listed.

    Raises
    ------
    ValueError
        If the name has another suffix.
    OSError
        If the file could not be written.
    """
    codes, positions, counts, directions = search.tree.preorder()
    parts = {
        "problem.json": json.dumps(described(search), indent=1).encode(),
        "tree.bin": codes.astype("<i1").tobytes(),
        "positions.bin": positions.astype("<f8").tobytes(),
        "counts.bin": counts.astype("<u1").tobytes(),
        "directions.bin": directions.astype("<f4").tobytes(),
    }
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return write_atomically(path, memory.getvalue(), suffix=".zip")


def described(search: Search) -> dict[str, Any]:
    """Return a problem, its regions, loci and symmetries, and the list, as plain data."""
    listed, open_points = members(search)
    problem, domain = search.problem, search.domain
    manifold, formulas = problem.polyhedron.manifold, search.faces.formulas
    nodes, outputs = program(formulas.graph, formulas.outputs)
    regions = [_region(region) for region in search.regions]
    return {
        "format": list(FORMAT),
        "coordinates": list(manifold.names),
        "periods": [period(p) for p in manifold.periods],
        "functions": list(formulas.names),
        "inequalities": problem.inequalities,
        "equations": problem.rows - 1 - problem.inequalities,
        "branches": [np.flatnonzero(branch).tolist() for branch in search.conj],
        "nodes": nodes,
        "outputs": outputs,
        "domain": {"lower": _hex(domain.lower), "upper": _hex(domain.upper)},
        "fixed": list(domain.fixed),
        "symmetries": [_motion(g) for g in search.motions],
        "weights": _hex(search.weights),
        "regions": regions,
        "loci": [_locus(place) for place in search.loci],
        "points": [{"region": k, "index": search.regions[k].index} for k in listed],
        "open_points": open_points,
        "open": _open(search),
    }


def members(search: Search) -> tuple[list[int], list[int]]:
    """Return the regions whose point is in the list, each once, and those that may be."""
    known, listed, undecided = Known(search), list[int](), list[int]()
    for k, region in enumerate(search.regions):
        place = OUT if known.has(region) else membership(search, region)
        if place != OUT:
            known.add(region)
            (listed if place == IN else undecided).append(k)
    return listed, undecided


def program(graph: Graph, outputs: Sequence[int]) -> tuple[list[list[Any]], list[int]]:
    """Return the operations that outputs need, renumbered, and the outputs.

    Selections that are a minimum, a maximum or an absolute value are written as such.
    """
    places: dict[int, int] = {}
    nodes: list[list[Any]] = []
    for a in needed(graph, outputs, _reads):
        op, args = graph.nodes[a]
        found = pattern(graph, a)
        if found:
            op = found.kind.removeprefix("-")
        if op in {"const", "var"}:
            nodes.append([op, str(args[0]) if op == "const" else int(args[0])])
        else:
            nodes.append([op, *(places[b] for b in _reads(graph, a))])
        if found and found.kind == "-abs":
            nodes.append(["neg", len(nodes) - 1])
        places[a] = len(nodes) - 1
    return nodes, [places[a] for a in outputs]


def _reads(graph: Graph, a: int) -> tuple[int, ...]:
    found = pattern(graph, a)
    return found.nodes if found else tuple(arguments(graph, a))


def period(value: float) -> str | None:
    """Return a period as an exact number: a multiple of pi if it is one, None for lines.

    >>> period(2 * math.pi), period(0.5), period(math.inf)
    ('2 pi', '1/2', None)
    """
    if not math.isfinite(value):
        return None
    turns = Fraction(value / math.pi).limit_denominator(MOST_TURNS)
    if turns and float(turns) * math.pi == value:
        return f"{turns} pi"
    return str(Fraction(value))


def _open(search: Search) -> int:
    """Return how many boxes are open: undecided ones and those that still wait."""
    return len(search.waiting) + sum(map(len, search.undecided))


def _hex(values: Array) -> list[str]:
    return [x.hex() for x in values.tolist()]


def _sides(box: Region | Locus) -> dict[str, list[str]]:
    return {
        name: _hex(getattr(box, name)) for name in ("lower", "upper", "sharp_lower", "sharp_upper")
    }


def _region(region: Region) -> dict[str, Any]:
    return {"active": list(region.active), "index": region.index, **_sides(region)}


def _locus(place: Locus) -> dict[str, Any]:
    return {"z": list(place.z), "index": place.index, **_sides(place)}


def _motion(g: Motion) -> dict[str, Any]:
    shifts = [str(Fraction(half, 2)) for half in g.halves]
    return {"order": list(g.order), "signs": list(g.signs), "shifts": shifts}
