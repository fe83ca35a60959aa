from .groups import AllOf, AnyOf
from .nerves import Bar, Nerve, nerve
from .polyhedron import Polyhedron
from .quotients import WalkOptions
from .strata import LocalType, Stratum, stratum_at
from .symmetry import Element, Symmetry

__all__ = [
    "AllOf",
    "AnyOf",
    "Bar",
    "Element",
    "LocalType",
    "Nerve",
    "Polyhedron",
    "Stratum",
    "Symmetry",
    "WalkOptions",
    "nerve",
    "stratum_at",
]
