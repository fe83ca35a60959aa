"""Sections 3 and 4: what was observed; the claims of six modules in the paper's order."""

from paper_checks import bunch, dyad_zigzag, dyads_observed, explained, singles, steep
from paper_checks.claims import Claim

CLAIMS: tuple[Claim, ...] = (
    *singles.CLAIMS,
    *steep.CLAIMS,
    *dyads_observed.CLAIMS,
    *dyad_zigzag.CLAIMS,
    *bunch.CLAIMS,
    *explained.CLAIMS,
)
