"""Checks of section 3: dumbbells and bunches as observed."""

from paper_checks.framework.claims import Claim
from paper_checks.section3 import bunch, dyads, singles, steep, together, zigzag

CLAIMS: tuple[Claim, ...] = (
    *singles.CLAIMS,
    *steep.CLAIMS,
    *dyads.CLAIMS,
    *zigzag.CLAIMS,
    *bunch.CLAIMS,
    *together.CLAIMS,
)
