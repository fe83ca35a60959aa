"""Section 5: the configuration space of a pair as a curvilinear polyhedron.

What it is near each contact, how many components its strata have, and what it is as a whole.
"""

import string

from paper_checks import (
    strata_counts,
    strata_dimensions,
    strata_local,
    strata_motions,
    strata_whole,
)
from paper_checks.claims import Claim


def _order(claim: Claim) -> tuple[int, str]:
    digits = claim.id.strip(string.ascii_letters)
    return int(digits), claim.id


_THEMES = (strata_local, strata_dimensions, strata_counts, strata_motions, strata_whole)

CLAIMS: tuple[Claim, ...] = tuple(
    sorted((claim for theme in _THEMES for claim in theme.CLAIMS), key=_order)
)
