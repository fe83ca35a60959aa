from .groups import AllOf, AnyOf
from .polyhedron import Polyhedron
from .strata import LocalType, Stratum, stratum_at
from .symmetry import Element, Symmetry

__all__ = [
    "AllOf",
    "AnyOf",
    "Element",
    "LocalType",
    "Polyhedron",
    "Stratum",
    "Symmetry",
    "stratum_at",
]
