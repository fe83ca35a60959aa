"""Checks of section 8: corners in general."""

from paper_checks.section8.conclusion import CLAIMS

__all__ = ["CLAIMS"]
