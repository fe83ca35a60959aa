"""Section 7.3: the effect of the drum's tilt on the heading of a dyad in equilibrium."""

import math
from functools import cache, partial

import numpy as np
import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.experiment import CORNER, EXPERIMENT, centres
from polycorner import Certificate, SmoothFunction, stationary_on

TILT = 7.0


@cache
def tilted(share: float, tilt: float) -> Certificate:
    """Return the corner of a tilted drum where A's friction carries a share of the axial pull."""
    pair = EXPERIMENT
    angle, part = sympy.symbols("alpha share")
    ball = centres(pair)
    z = sum((c[2] for c in ball.values()), sympy.S.Zero)
    axial = sum((c[1] for c in ball.values()), sympy.S.Zero)
    _, e1, _, _, e2, _ = pair.manifold.symbols
    carried = 4 * sympy.sin(angle) * (part * e1 + (1 - part) * e2)
    energy = sympy.cos(angle) * z + sympy.sin(angle) * axial - carried
    values = {"alpha": math.radians(tilt), "share": share}
    weight = SmoothFunction("tilted", energy, pair.manifold, parameters=values)
    return stationary_on(pair.polyhedron, weight, pair.nested("R", clearance=0.0), CORNER)


def _heading(certificate: Certificate) -> float:
    return float(np.degrees(EXPERIMENT.heading(certificate.point)[0]))


@cache
def range_of_shares(tilt: float) -> tuple[float, float]:
    """Return the shares between which the corner is a minimum, by bisection."""
    found = []
    for outside in (0.4, 0.6):
        inside, beyond = 0.5, outside
        for _ in range(40):
            half = (inside + beyond) / 2
            pressed = min(tilted(half, tilt).multipliers.values()) > 0
            inside, beyond = (half, beyond) if pressed else (inside, half)
        found.append(inside)
    return found[0], found[1]


def tilt_changes_heading_little(share: float = 0.5, tilt: float = TILT) -> Finding:
    """Compare the corner of a tilted drum with that of a horizontal one.

    The four centres have axial positions that sum to ``2 (eta1 + eta2)``: a tilt multiplies the
    energy by ``cos alpha`` and adds a multiple of the mean ``eta``, which no contact depends on.
    """
    ball = centres(EXPERIMENT)
    _, e1, _, _, e2, _ = EXPERIMENT.manifold.symbols
    axial = sum((c[1] for c in ball.values()), sympy.S.Zero)
    uniform = sympy.simplify(axial - 2 * (e1 + e2)) == 0
    level, there = tilted(0.5, 0.0), tilted(share, tilt)
    change = abs(_heading(there) - _heading(level))
    low, high = range_of_shares(tilt)
    steep = _heading(tilted(low, tilt)), _heading(tilted(high, tilt))
    stays = uniform and there.is_minimum and change < 1e-9
    return Finding(
        Verdict.HOLDS_UNDER if stays else Verdict.REFUTED,
        f"With a share {share:g} of the axial pull carried by friction at the lower dumbbell, the "
        f"tilt of {tilt:g} degrees moves the stationary heading by {change:.3g} degrees, and it is "
        f"{'a' if there.is_minimum else 'no'} minimum. The corner holds only for shares between "
        f"{low:.4f} and {high:.4f}, where the heading goes from {steep[0]:.3f} to {steep[1]:.3f} "
        "degrees.",
        {"change": change, "least_share": low, "most_share": high},
        "A tilt does not change the heading at all if friction carries the pull on both dumbbells "
        "alike: it multiplies $E$ by $\\cos\\alpha$ and adds $4\\sin\\alpha$ times mean $\\eta$. "
        f"But without friction between the dumbbells the well is shallow: the lower dumbbell has "
        f"to be carried by {100 * low:.1f} to {100 * high:.1f} per cent of the pull, or the pair "
        "leaves the corner."
        if stays
        else "",
    )


CLAIMS = (
    Claim(
        "T4a",
        "7",
        "section 7.3, first paragraph",
        "Tilting the drum by 7 degrees changes the heading of pairs in $\\delta$ negligibly.",
        Means.NUMERICAL,
        tilt_changes_heading_little,
        partial(tilt_changes_heading_little, share=1.0),
    ),
)
