from .diagram import Arc, BranchEvent, BranchKind, Diagram
from .search import branches

__all__ = ["Arc", "BranchEvent", "BranchKind", "Diagram", "branches"]
