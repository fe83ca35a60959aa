"""Appendix A: friction of a single dumbbell; the claims of five modules in the paper's order."""

from paper_checks import coefficients, forces, rest, torque, turning
from paper_checks.claims import Claim

CLAIMS: tuple[Claim, ...] = (
    *coefficients.CLAIMS,
    *forces.CLAIMS,
    *rest.CLAIMS,
    *torque.CLAIMS,
    *turning.CLAIMS,
)
