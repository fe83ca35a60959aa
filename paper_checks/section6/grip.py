"""Sections 6 and C: the force that holds a dyad in its corner, compared with friction."""

from functools import partial

import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.experiment import EXPERIMENT, enclosed, has, middle, multiplier, proof

ROLLING = 0.1  # the paper's static coefficient of rolling, appendix A


def force_holds_the_pair(locus: str = "delta_R", rolling: float = ROLLING) -> Finding:
    """Compare gravity's pull on each dumbbell of a dyad with the limit of friction.

    In a horizontal drum a dumbbell at azimuth ``phi`` is pulled by ``tan phi`` of its load along
    the circumference, ``tan phi cos theta`` of it along the direction of rolling; it starts to roll
    when that exceeds the coefficient (appendix A).
    """
    found = proof(EXPERIMENT, locus)
    p1, _, t1, p2, _, t2 = EXPERIMENT.manifold.symbols
    pulls = [enclosed(found, sympy.tan(p) * sympy.cos(t)) for p, t in ((p1, t1), (p2, t2))]
    strongest = max(max(map(abs, side)) for side in pulls)
    presses = max((middle(multiplier(found, name)) for name in found.active), default=0.0)
    pulled = found.proved and not any(has(side, 0) for side in pulls)
    held = strongest < rolling
    return Finding(
        (Verdict.HOLDS_UNDER if held else Verdict.HOLDS) if pulled else Verdict.REFUTED,
        "Proved at the minimum: gravity pulls either dumbbell in its rolling direction with "
        f"{float(strongest):.5f} of its load, and the strongest contact presses with {presses:.5f} "
        f"ball weights. Rolling starts at {rolling:g} of the load.",
        {"pull": float(strongest), "rolling": rolling},
        "The force that presses the dumbbells into the corner is not zero, but at the quoted "
        f"$\\mu_r^{{stat}} = {rolling:g}$ either of them would rest there, or a little aside, "
        "without the other: friction balances the pull. The corner holds a pair that noise or the "
        "rotation keeps moving."
        if held and pulled
        else "",
    )


CLAIMS = (
    Claim(
        "E10",
        "6",
        "paragraph on entrapment; appendix C, triangular entrapment",
        "A dyad in $\\delta$ is driven into its corner and held there by a force that is not zero.",
        Means.PROOF,
        force_holds_the_pair,
        partial(force_holds_the_pair, locus="G"),
        figure="entrapment",
    ),
)
