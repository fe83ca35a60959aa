"""Files with a complete list of corners and its proof, verified by the same checker.

They are as those of stationary points (:mod:`~polycorner.proofs.lists.records`), with another
format, no loci and no directions.  The energy is the constant 0.  Regions have as many functions as
there are free coordinates, without multipliers; those of singular corners have the exact point,
the combination of gradients that vanishes, the weight, and the functions whose gradient vanishes.
Linear relations between functions are stated with their weights.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from polycorner.proofs.lists import records
from polycorner.proofs.lists.corner_points import Candidate
from polycorner.proofs.lists.corner_search import CornerSearch
from polycorner.proofs.lists.records import Record
from polycorner.proofs.lists.relations import Relation
from polycorner.proofs.lists.tips import TipRegion
from polycorner.values import Value

FORMAT = ("polycorner-corner-list", 1)


@dataclass(frozen=True, eq=False)
class CornerRecord(Value):
    """What is known of a list of corners and its proof.

    Attributes
    ----------
    record : Record
        Problem, regions, subdivision.
    active : tuple of tuple of int
        Functions that are active at the listed corners.
    relations : tuple of Relation
        Linear relations between functions.
    """

    record: Record
    active: tuple[tuple[int, ...], ...]
    relations: tuple[Relation, ...]


def corner_record(search: CornerSearch, found: Sequence[Candidate]) -> CornerRecord:
    """Return the record of a search and the corners found, without images."""
    listed = [one for one in found if one.active is not None]
    record = Record(
        search.problem,
        search.domain,
        search.branches,
        search.motions,
        search.weights,
        tuple(search.regions),
        (),
        tuple(one.number for one in listed),
        tuple(one.number for one in found if one.active is None),
        *search.tree.preorder(),
    )
    active = tuple(one.active for one in listed if one.active is not None)
    return CornerRecord(record, active, tuple(filter(None, search.relations.values())))


def save(path: str | os.PathLike[str], proof: CornerRecord) -> Path:
    """Save a list of corners and its proof; see :func:`polycorner.proofs.lists.records.save`."""
    data = records.described(proof.record)
    data["format"] = list(FORMAT)
    data["points"] = [
        {"region": k, "active": list(active)}
        for k, active in zip(proof.record.listed, proof.active, strict=True)
    ]
    data["relations"] = [
        {"rows": list(r.rows), "weights": [str(w) for w in r.weights]} for r in proof.relations
    ]
    for region, entry in zip(proof.record.regions, data["regions"], strict=True):
        if isinstance(region, TipRegion):
            entry.update(_tip(region))
    return records.written(path, proof.record, data)


def _tip(region: TipRegion) -> dict[str, Any]:
    return {
        "exact": [str(x) for x in region.exact],
        "combination": [str(x) for x in region.combination],
        "weight": region.weight.hex(),
        "critical": list(region.critical),
    }
