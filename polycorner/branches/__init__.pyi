from .diagram import Arc, BranchEvent, BranchKind, Diagram
from .hysteresis import Hysteresis, Jump, Leg, hysteresis
from .search import branches

__all__ = [
    "Arc",
    "BranchEvent",
    "BranchKind",
    "Diagram",
    "Hysteresis",
    "Jump",
    "Leg",
    "branches",
    "hysteresis",
]
