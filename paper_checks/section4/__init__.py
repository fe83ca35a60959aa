"""Checks of section 4: the motion of single dumbbells explained."""

from paper_checks.section4.explained import CLAIMS

__all__ = ["CLAIMS"]
