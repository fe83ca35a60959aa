"""Checks of section 2: coordinates on the tilted cylinder."""

from paper_checks.section2.geometry import CLAIMS

__all__ = ["CLAIMS"]
