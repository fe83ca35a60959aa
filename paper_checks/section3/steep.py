"""Section 3.1: dumbbells of large heading, and drums of larger tilt."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from paper_checks.appendixA.forces import STATIC, judged
from paper_checks.appendixA.torque import DRUM
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section3.singles import risen
from polycorner.dumbbells.dynamics.singles import follow
from polycorner.dumbbells.statics.keel import Keel, s_curve
from polycorner.motion import Noise

RAPID = 1.0  # mm/s, threshold of a rapid descent: several times the speed of climbing


def climbs_below(threshold: float = 20.0, reach: float = 80.0) -> Finding:
    """Find, without noise, the largest heading that climbs, and compare it with a formula.

    At that heading, that of ``S`` less epsilon, both limits of ``A`` are reached at once.
    """
    headings = np.arange(2.0, reach, 2.0)
    path = follow(DRUM, np.radians(headings), 30.0, dt=2e-3)
    rise = risen(path)
    climbing = headings[rise > 0]
    formula = largest_climbing(STATIC[1])
    holds = abs(climbing.max() - threshold) <= 2.0
    return Finding(
        judged(holds),
        f"without noise headings up to {climbing.max():g}° climb (tried every 2°) and larger ones "
        f"fall by {-rise.max(where=rise < 0, initial=-math.inf):.1f} mm or more in 30 s; "
        f"$S(\\varphi_s) - \\varepsilon = {formula:.1f}°$",
        {"threshold": float(climbing.max()), "formula": formula},
        "with the coefficients of the text a dumbbell climbs up to $S(\\varphi_s)-\\varepsilon = "
        f"{formula:.1f}°$; above, the drum carries it out of $A$ by sliding instead of rolling, "
        f"and it descends. For {threshold:g}° that would need $\\mu_s = "
        f"{sliding_for(threshold):.3f}$",
    )


def largest_climbing(sliding: float) -> float:
    """Return ``S(phi_s) - epsilon`` in degrees, for a static coefficient of sliding."""
    limit = Keel(DRUM.tilt, STATIC[0], sliding, *(DRUM.rolling[1], 0.1)).onset.limit
    return math.degrees(s_curve(limit, DRUM.tilt) - math.asin(STATIC[0] / sliding))


def sliding_for(heading: float) -> float:
    """Return the coefficient of sliding for which headings up to a given one climb."""
    tried = np.arange(0.13, 0.5, 0.001)
    return float(tried[np.argmin([abs(largest_climbing(mu) - heading) for mu in tried])])


def descends_above(tilt: float = 10.0, chatter: float = 0.3) -> Finding:
    """Check that every heading descends fast 2 degrees above a tilt, and none 2 degrees below."""
    headings = (-10.0, 0.0, 5.0, 15.0)
    slow, fast = (
        risen(follow(tilted, np.radians(headings), 15.0, noise=noise, dt=2e-3)) / 15.0
        for noise in [Noise(chatter=chatter, seed=1)]
        for tilted in (replace(DRUM, tilt=math.radians(tilt + d)) for d in (-2, 2))
    )
    slides = math.degrees(math.atan(STATIC[1]))
    holds = bool((fast < -RAPID).all()) and bool((slow > -RAPID).all())
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"with chatter A = {chatter:g}: at {tilt - 2:g}° dumbbells move along the drum with "
        f"{slow.min():.2f} to {slow.max():.2f} mm/s, at {tilt + 2:g}° with {fast.min():.0f} to "
        f"{fast.max():.0f} mm/s; without noise axial sliding begins at $\\arctan\\mu_s = "
        f"{slides:.1f}°$",
        {"slowest_above": float(fast.max()), "fastest_below": float(slow.min()), "slides": slides},
        f"noise of about A = {chatter:g}; without noise small headings climb up to {slides:.1f}°",
    )


CLAIMS = (
    Claim(
        "O5a",
        "3",
        "after the observations on isolated dumbbells",
        "headings above 20° roll down to the bottom, smaller ones do not",
        Means.SIMULATION,
        climbs_below,
        partial(climbs_below, 45.4),
    ),
    Claim(
        "O5b",
        "3",
        "after the observations on isolated dumbbells",
        "this holds for tilts up to 10°; above 10° every heading descends rapidly",
        Means.SIMULATION,
        descends_above,
        partial(descends_above, 4.0),
    ),
)
