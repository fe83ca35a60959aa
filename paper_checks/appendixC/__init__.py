"""Checks of appendix C: the minimisation lemma."""

from paper_checks.appendixC.minimisation import CLAIMS

__all__ = ["CLAIMS"]
