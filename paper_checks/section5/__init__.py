"""Checks of section 5: the configuration space of a pair."""

import string

from paper_checks.framework.claims import Claim
from paper_checks.section5 import counts, dimensions, local, motions, whole


def _order(claim: Claim) -> tuple[int, str]:
    digits = claim.id.strip(string.ascii_letters)
    return int(digits), claim.id


_THEMES = (local, dimensions, counts, motions, whole)

CLAIMS: tuple[Claim, ...] = tuple(
    sorted((claim for theme in _THEMES for claim in theme.CLAIMS), key=_order)
)
