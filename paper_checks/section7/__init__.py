"""Checks of section 7: dyads in the turning drum."""

from paper_checks.framework.claims import Claim
from paper_checks.section7 import dyads, moving

CLAIMS: tuple[Claim, ...] = (*dyads.CLAIMS, *moving.CLAIMS)
