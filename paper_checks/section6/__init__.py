"""Checks of section 6: minima of the energy of a pair."""

from paper_checks.section6.energetics import CLAIMS

__all__ = ["CLAIMS"]
