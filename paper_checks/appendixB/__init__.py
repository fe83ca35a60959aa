"""Checks of appendix B: strata of curvilinear polyhedra."""

from paper_checks.appendixB.polyhedra import CLAIMS

__all__ = ["CLAIMS"]
