"""Budgets of a search, and its states, which are pickled and saved."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from polycorner import checks
from polycorner.polyhedra.quotients import Quotient
from polycorner.skeletons.curves import Curve, EdgeEnd, FaceCrossing, Flag
from polycorner.skeletons.probing import Anchor, Patch
from polycorner.skeletons.registry import FoundCorner
from polycorner.spaces.manifold import Array
from polycorner.values import Value


@dataclass(frozen=True)
class Budget:
    """How much a search may do before it stops and can be resumed.

    Attributes
    ----------
    edges : int
        Most edges to trace; as many starts may be descended from, and as many faces crossed.
    seconds : float
        Time after which it stops: between two edges, descents or crossings, of which it does at
        least one.

    Raises
    ------
    TypeError, ValueError
        Naming the argument.
    """

    edges: int = 100_000
    seconds: float = math.inf

    def __post_init__(self) -> None:
        checks.whole("budget", self.edges, least=1)
        checks.real("seconds", self.seconds, above=0, infinite=True, unit="s")


@dataclass(frozen=True, eq=False)
class SearchState(Value):
    """Everything that a search found and has left to do.

    Attributes
    ----------
    quotient : Quotient
        The polyhedron with its symmetry and tolerances.
    records : tuple of FoundCorner
        Corners.
    curves : tuple of Curve
        Edges.
    crossings : tuple of FaceCrossing
        Straight ways across faces.
    starts : tuple of (int, (n,) array)
        Numbered starts that no descent was made from yet.
    pending : tuple of EdgeEnd
        Ends of edges to trace.
    tried : frozenset
        Faces beside edges and apexes that were crossed.
    patches : tuple of Patch
        Closed faces without edges.
    links : tuple of frozenset of Anchor
        Edges and closed faces that are connected through the interior.
    origins : tuple of (n,) arrays
        Points of the polyhedron that descents were made from.
    least : mapping from str to float
        Least values that were found of functions that were never met.
    sought : (int, int)
        How often islands were sought, and how much was known then.
    notes : tuple of str
        What a user should know.
    lost : bool
        Whether something could not be followed.
    rng : numpy.random.Generator
        For the descents that are left.
    """

    quotient: Quotient
    records: tuple[FoundCorner, ...]
    curves: tuple[Curve, ...]
    crossings: tuple[FaceCrossing, ...]
    starts: tuple[tuple[int, Array], ...]
    pending: tuple[EdgeEnd, ...]
    tried: frozenset[Flag]
    patches: tuple[Patch, ...]
    links: tuple[frozenset[Anchor], ...]
    origins: tuple[Array, ...]
    least: Mapping[str, float]
    sought: tuple[int, int]
    notes: tuple[str, ...]
    lost: bool
    rng: np.random.Generator


def copied(record: FoundCorner) -> FoundCorner:
    """Return a corner whose edges can grow without those of the original."""
    return replace(record, edges=dict(record.edges))
