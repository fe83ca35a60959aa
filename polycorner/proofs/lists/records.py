"""Files with a complete list and its proof, which :mod:`~polycorner.proofs.checker` verifies.

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
    How many directions belong to each closed box (16 bits), and these (single precision).

Numbers are little-endian.  Derivatives are not stored.

Lists of corners have another format, no loci and no directions.  The energy is the constant 0.
Regions have as many functions as there are free coordinates, without multipliers; those of singular
corners have the exact point, the combination of gradients that vanishes, the weight, and the
functions whose gradient vanishes.  Linear relations of functions are stated with their weights.
"""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.intervals.enclosures import Formulas
from polycorner.minimisation.problem import Problem
from polycorner.proofs.files import archived, stated
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.faces import Region
from polycorner.proofs.lists.images import Motion
from polycorner.proofs.lists.loci import LocusRegion
from polycorner.proofs.lists.pinned import Pinned
from polycorner.proofs.lists.relations import Relation
from polycorner.proofs.lists.search import BoxSearch
from polycorner.proofs.lists.tips import TipRegion
from polycorner.proofs.lists.tree import OPEN as OPEN_BOX
from polycorner.spaces.manifold import Array
from polycorner.values import Value

FORMAT = ("polycorner-stationary-list", 1)
CORNERS = ("polycorner-corner-list", 1)
SIDES = ("lower", "upper", "sharp_lower", "sharp_upper")
EXACT = ("exact", "combination")
PINNED = ("into", "steps", "weights")


@dataclass(frozen=True, eq=False)
class Record(Value):
    """What is known of a list and its proof when the search has ended.

    Attributes
    ----------
    problem : Problem
    domain : Domain
    branches : tuple of tuple of int
        The set as a union of intersections.
    motions : tuple of Motion
    weights : (n,) array
    regions : tuple of Region
    loci : tuple of LocusRegion
    listed, open_points : tuple of int
        Regions whose points are in the list, and those whose points may be.  Of points that are
        images of each other, those that the search met.
    codes, positions, counts, directions : arrays
        The subdivision; see :meth:`~polycorner.proofs.lists.tree.Tree.preorder`.
    ways : mapping from int to (n,) array
        Directions of negative curvature, by the regions whose points are no minima for their sake.
    minima_only : bool
        Whether the list is one of local minima.
    active : tuple of tuple of int, or None
        Functions that are active at the listed corners; None in a list of stationary points.
    relations : tuple of Relation
        Linear relations between functions, in a list of corners.
    """

    problem: Problem
    domain: Domain
    branches: tuple[tuple[int, ...], ...]
    motions: tuple[Motion, ...]
    weights: Array
    regions: tuple[Region, ...]
    loci: tuple[LocusRegion, ...]
    listed: tuple[int, ...]
    open_points: tuple[int, ...]
    codes: NDArray[np.int8]
    positions: Array
    counts: NDArray[np.uint16]
    directions: NDArray[np.float32]
    ways: Mapping[int, Array] = field(default_factory=dict)
    minima_only: bool = False
    active: tuple[tuple[int, ...], ...] | None = None
    relations: tuple[Relation, ...] = ()


def record(
    search: BoxSearch, listed: Iterable[int], open_points: Iterable[int], **more: Any
) -> Record:
    """Return the record of a search and of its list, by the numbers of regions; see `Record`."""
    return Record(
        search.problem,
        search.domain,
        search.branches,
        search.motions,
        search.weights,
        tuple(search.regions),
        tuple(search.loci),
        tuple(listed),
        tuple(open_points),
        *search.tree.preorder(),
        minima_only=search.minima_only,
        **more,
    )


def save(path: str | os.PathLike[str], record: Record) -> Path:
    """Save a list and its proof; return the path.

    Raises
    ------
    ValueError
        If the name does not end in ``.zip``.
    OSError
        If the file could not be written.
    """
    parts = {
        "problem.json": json.dumps(described(record), indent=1).encode(),
        "tree.bin": record.codes.astype("<i1").tobytes(),
        "positions.bin": record.positions.astype("<f8").tobytes(),
        "counts.bin": record.counts.astype("<u2").tobytes(),
        "directions.bin": record.directions.astype("<f4").tobytes(),
    }
    return archived(path, parts)


def described(record: Record) -> dict[str, Any]:
    """Return a problem, its regions, loci and symmetries, and the list, as plain data."""
    corners = record.active is not None
    told: list[Any] = [record.regions[k].index for k in record.listed]
    if record.active is not None:
        told = [list(active) for active in record.active]
    what = "active" if corners else "index"
    relations = [
        {"rows": list(r.rows), "weights": [str(w) for w in r.weights]} for r in record.relations
    ]
    return {
        "format": list(CORNERS if corners else FORMAT),
        **posed(record),
        "regions": [
            region_data(region) | ({"way": _hex(record.ways[k])} if k in record.ways else {})
            for k, region in enumerate(record.regions)
        ],
        "loci": [locus_data(place) for place in record.loci],
        "points": [
            {"region": k, what: entry} for k, entry in zip(record.listed, told, strict=True)
        ],
        "open_points": list(record.open_points),
        "open": int((record.codes == OPEN_BOX).sum()),
    } | ({"relations": relations} if corners else {})


def posed(record: "Record | BoxSearch") -> dict[str, Any]:
    """Return a problem with its domain and symmetries as plain data."""
    problem, domain = record.problem, record.domain
    formulas = Formulas(problem.functions, problem.polyhedron.manifold)
    data, _ = stated(problem, formulas, record.branches)
    return data | {
        "domain": {"lower": _hex(domain.lower), "upper": _hex(domain.upper)},
        "fixed": list(domain.fixed),
        "parameters": list(domain.parameters),
        "minima_only": record.minima_only,
        "symmetries": [_motion(g) for g in record.motions],
        "weights": _hex(record.weights),
    }


def _hex(values: Array) -> list[str]:
    return [x.hex() for x in values.tolist()]


def _sides(box: Region | LocusRegion) -> dict[str, list[str]]:
    return {name: _hex(getattr(box, name)) for name in SIDES}


def region_data(region: Region) -> dict[str, Any]:
    """Return a region as plain data."""
    found: dict[str, Any] = {"active": list(region.active), "index": region.index, **_sides(region)}
    if isinstance(region, Pinned):
        found["corner"] = list(region.corner)
        found |= {name: _hex(getattr(region, name).ravel()) for name in PINNED}
    if isinstance(region, TipRegion):
        found |= {name: [str(x) for x in getattr(region, name)] for name in EXACT}
        found |= {"weight": region.weight.hex(), "critical": list(region.critical)}
    return found


def locus_data(place: LocusRegion) -> dict[str, Any]:
    """Return a locus as plain data."""
    sample = None if place.sample is None else _hex(place.sample)
    return {"z": list(place.z), "index": place.index, "sample": sample, **_sides(place)}


def region_from(data: dict[str, Any]) -> Region:
    """Return the region that some data describe."""
    lower, upper, low, high = (_numbers(data[name]) for name in SIDES)
    region = lower, upper, tuple(data["active"]), low, high, data["index"]
    if "corner" not in data:
        return Region(*region)
    into, steps, weights = (_numbers(data[name]) for name in PINNED)
    return Pinned(*region, tuple(data["corner"]), into, steps, weights.reshape(len(steps), -1))


def locus_from(data: dict[str, Any]) -> LocusRegion:
    """Return the locus that some data describe."""
    lower, upper, low, high = (_numbers(data[name]) for name in SIDES)
    sample = None if data["sample"] is None else _numbers(data["sample"])
    return LocusRegion(tuple(data["z"]), lower, upper, low, high, data["index"], sample)


def _numbers(texts: Sequence[str]) -> Array:
    return np.array([float.fromhex(text) for text in texts])


def _motion(g: Motion) -> dict[str, Any]:
    shifts = [str(Fraction(half, 2)) for half in g.halves]
    return {"order": list(g.order), "signs": list(g.signs), "shifts": shifts}
