"""Statements about single points, by their kinds."""

from typing import Any

from .balls import need
from .growth import StoredGrowth
from .minimum import StoredCells, StoredMinimum

KINDS = {
    "minimum between energies": StoredGrowth,
    "strict minimum": StoredMinimum,
    "box of parameters": StoredCells,
}


def stated(data: dict[str, Any]) -> str:
    """Verify the statement of a file; return it in words."""
    kind = data["kind"]
    need(kind in KINDS, f"the kind is {kind!r:.80}, not one of {', '.join(KINDS)}")
    return "; ".join(KINDS[kind](data).said())
