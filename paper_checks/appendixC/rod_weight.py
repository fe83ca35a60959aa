"""Appendix C: the effect of the rods' weight on the heading."""

import math
from functools import partial

import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.experiment import EXPERIMENT, centres
from polycorner.dumbbells import DumbbellPair

NOTICED = 0.1  # degrees: a change smaller than that due to the tolerances of the sizes


def weight_of_rod(pair: DumbbellPair) -> float:
    """Return the weight of a rod, in balls of the same material: a cylinder between two spheres."""
    r, t = pair.ball_radius, pair.rod_radius
    reach = math.sqrt(r**2 - t**2)
    cap = math.pi * (r - reach) ** 2 * (3 * r - (r - reach)) / 3
    return (math.pi * t**2 * (pair.length - 2 * reach) - 2 * cap) / (4 / 3 * math.pi * r**3)


def heading_with_rods(pair: DumbbellPair, weight: float, outer_share: float) -> float:
    """Return the heading at the minimum in the plane, in degrees, for rods with weight.

    The outer ball bears ``outer_share`` of a rod's weight, the inner one the remainder.
    The outer balls lie at ``(d + l sin theta)/2`` either side of the lowest line, the inner ones at
    ``(d - l sin theta)/2``, with ``d = D sin theta - p cos theta``; the energy is half the weighted
    sum of squares, a quadratic form in ``sin theta`` and ``cos theta``.
    """
    p = pair.ball_radius + pair.rod_radius
    along = pair.length - math.sqrt(4 * pair.ball_radius**2 - p**2)
    sine_sine = sine_cosine = cosine_cosine = 0.0
    for sign, share in ((1, outer_share), (-1, 1 - outer_share)):
        mass, reach = 1 + weight * share, along + sign * pair.length
        sine_sine += mass * reach**2
        sine_cosine -= mass * reach * p
        cosine_cosine += mass * p**2
    return math.degrees(math.atan2(-2 * sine_cosine, sine_sine - cosine_cosine) / 2)


def middle_is_the_mean() -> bool:
    """Decide whether a rod's middle is at the mean height of its balls, at every placement.

    The middle of the chord lies at ``-sqrt(rho^2 - (l sin theta / 2)^2) cos phi``.
    """
    pair = EXPERIMENT
    names = dict(zip(pair.manifold.names, pair.manifold.symbols, strict=True))
    ball = centres(pair)
    rho, half = (sympy.Rational(x) for x in (pair.centre_radius, pair.length / 2))
    for body, k in (("A", 1), ("B", 2)):
        depth = sympy.sqrt(rho**2 - (half * sympy.sin(names[f"theta{k}"])) ** 2)
        own = -depth * sympy.cos(names[f"phi{k}"])
        if sympy.simplify(own - (ball[f"{body}1"][2] + ball[f"{body}2"][2]) / 2) != 0:
            return False
    return True


def rods_raise_the_heading(outer_share: float = 0.5) -> Finding:
    pair, weight = EXPERIMENT, weight_of_rod(EXPERIMENT)
    light = heading_with_rods(pair, 0.0, outer_share)
    heavy = heading_with_rods(pair, weight, outer_share)
    change = heavy - light if abs(heavy - light) > 1e-12 else 0.0
    mean = middle_is_the_mean()
    return Finding(
        Verdict.HOLDS if change > 0 else Verdict.REFUTED if mean else Verdict.CORRECTED,
        f"Rods of {weight:.3f} ball weights, {outer_share:g} of it at the outer balls, change the "
        f"heading by {change:g} degrees. A rod's middle {'is' if mean else 'is not'} at the mean "
        "height of its balls identically, so its weight $w$ (in balls) multiplies the energy by "
        "$1 + w/2$ and moves no minimum.",
        {"weight": weight, "change": change},
        ""
        if change > 0
        else "The weight of a symmetric rod does not change $\\theta_s$ at all: the energy is "
        "multiplied by $1 + w/2$.",
    )


def rods_are_negligible(outer_share: float = 0.5) -> Finding:
    pair, weight = EXPERIMENT, weight_of_rod(EXPERIMENT)
    change = heading_with_rods(pair, weight, outer_share) - heading_with_rods(pair, 0, outer_share)
    return Finding(
        Verdict.HOLDS if abs(change) < NOTICED else Verdict.REFUTED,
        f"A rod of the balls' material weighs {weight:.3f} balls, which is not little, but with "
        f"{outer_share:g} of it at the outer ball it turns the pair by {abs(change):.2g} degrees.",
        {"weight": weight, "change": change},
    )


CLAIMS = (
    Claim(
        "L7a",
        "C",
        "first paragraph",
        "If the rods have weight, $\\theta_s$ goes up.",
        Means.SYMBOLIC,
        rods_raise_the_heading,
        partial(rods_raise_the_heading, outer_share=0.75),
    ),
    Claim(
        "L7b",
        "C",
        "first paragraph",
        "For the experiment's parameters the effect of the rods' weight is negligible.",
        Means.SYMBOLIC,
        rods_are_negligible,
        partial(rods_are_negligible, outer_share=1.0),
    ),
)
