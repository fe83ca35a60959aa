"""Checks of appendix A: friction of a single dumbbell."""

from paper_checks.appendixA import coefficients, forces, rest, torque, turning
from paper_checks.framework.claims import Claim

CLAIMS: tuple[Claim, ...] = (
    *coefficients.CLAIMS,
    *forces.CLAIMS,
    *rest.CLAIMS,
    *torque.CLAIMS,
    *turning.CLAIMS,
)
