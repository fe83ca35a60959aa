"""Flags of faces, and straight crossings that join the boundary curves of a face."""

from dataclasses import dataclass
from typing import Any

# An edge (its end at a corner, or its position) or an apex (its corner and sector), and the names
# of a face beside it.
Flag = tuple[str, Any, frozenset[str]]


@dataclass(frozen=True)
class FaceCrossing:
    """A straight way across a face, from one of its edges to another."""

    start: Flag
    stop: Flag
