from .groups import AllOf, AnyOf
from .nerves import Bar, Nerve, nerve
from .polyhedron import Polyhedron
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
    "nerve",
    "stratum_at",
]
