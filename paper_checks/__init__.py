"""Claims of [GMBN], each restated and checked: one module per part of the paper."""

from paper_checks import energetics
from paper_checks.claims import Claim, Finding, Outcome

CLAIMS: tuple[Claim, ...] = energetics.CLAIMS

__all__ = ["CLAIMS", "Claim", "Finding", "Outcome"]
