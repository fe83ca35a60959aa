"""Section 6 and appendix C: where a pair of dumbbells rests, its heading, how it is held."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from paper_checks.claims import Claim, Finding, Outcome
from polycorner.models import DumbbellPair
from polycorner.studies import dyad_minima

EXPERIMENT = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
HEADING_TOLERANCE = math.degrees(1e-4)


def paper_heading(pair: DumbbellPair) -> float:
    """Return arctan(r/l) in degrees."""
    return math.degrees(math.atan2(pair.ball_radius, pair.length))


def corners_are_minima(pair: DumbbellPair = EXPERIMENT) -> Finding:
    right, left, _ = dyad_minima(pair)
    worst = max(corner.certificate.residuals().worst for corner in (right, left))
    minima = right.certificate.is_minimum and left.certificate.is_minimum
    least = min(min(corner.multipliers.values()) for corner in (right, left))
    return Finding(
        Outcome.HOLDS if minima else Outcome.REFUTED,
        f"both corners: least multiplier {least:.6g}, largest residual {worst:.1e}",
        {"least_multiplier": least, "worst_residual": worst},
    )


def pair_is_balanced_and_parallel(pair: DumbbellPair = EXPERIMENT) -> Finding:
    q = dyad_minima(pair)[0].point
    azimuth, heading = math.degrees(abs(q[0] + q[3])), math.degrees(abs(q[2] - q[5]))
    return Finding(
        Outcome.HOLDS if max(azimuth, heading) < 1e-9 else Outcome.REFUTED,
        f"|phi1 + phi2| = {azimuth:.1e} and |theta1 - theta2| = {heading:.1e} degrees",
        {"azimuth_sum": azimuth, "heading_difference": heading},
    )


def heading_is(
    formula: Callable[[DumbbellPair], float] = paper_heading, pair: DumbbellPair = EXPERIMENT
) -> Finding:
    computed = dyad_minima(pair)[0].headings[0]
    claimed, plane = formula(pair), math.degrees(pair.plane_corner()[0])
    far = replace(pair, drum_radius=8 * pair.drum_radius)
    rest = abs(dyad_minima(far)[0].headings[0] - plane)
    converges = rest < 0.05 * abs(computed - plane)
    if abs(computed - claimed) < HEADING_TOLERANCE:
        outcome = Outcome.HOLDS
    else:
        outcome = Outcome.CORRECTED if converges else Outcome.REFUTED
    return Finding(
        outcome,
        f"claimed {claimed:.6f}, computed {computed:.6f} degrees; the plane's closed form "
        f"tan 2 theta = 2 D p / (D^2 + l^2 - p^2) gives {plane:.6f}, and the difference from it "
        f"falls to {rest:.1e} in a drum eight times as large",
        {"claimed": claimed, "computed": computed, "plane": plane},
    )


def energy_slopes_at_the_corner(pair: DumbbellPair = EXPERIMENT) -> Finding:
    right = dyad_minima(pair)[0]
    slope = float(np.linalg.norm(pair.energy.gradient(right.point) * pair.manifold.scale_array))
    return Finding(
        Outcome.HOLDS if slope > 1e-6 else Outcome.REFUTED,
        f"|dE| = {slope:.6g} mm per scale unit",
        {"slope": slope},
    )


def signature_is(
    claimed: tuple[int, int, int] = (1, 4, 1), pair: DumbbellPair = EXPERIMENT
) -> Finding:
    right = dyad_minima(pair)[0]
    found = right.certificate.signature()
    kinds = right.certificate.entrapment_counts()
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    weights = ", ".join(f"{name} {value:.6f}" for name, value in right.multipliers.items())
    return Finding(
        Outcome.HOLDS if found == claimed else Outcome.CORRECTED,
        f"(p, q, r) = {found}: {listed}; multipliers {weights}",
        {f"multiplier_{name}": value for name, value in right.multipliers.items()},
    )


def corner_is_a_minimum_for(
    shares: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.9, 0.97), pair: DumbbellPair = EXPERIMENT
) -> Finding:
    """Check rods from thin to nearly as thick as the balls."""
    entries = {
        share: dyad_minima(replace(pair, rod_radius=share * pair.ball_radius))[0]
        for share in shares
    }
    failing = [share for share, entry in entries.items() if not entry.certificate.is_minimum]
    if not failing:
        return Finding(Outcome.HOLDS, f"a minimum for t/r in {shares}", {})
    first = entries[failing[0]]
    least = min(first.multipliers.values())
    return Finding(
        Outcome.REFUTED,
        f"no minimum at t/r = {failing[0]}: a multiplier is {least:.6g}",
        {"rod_share": failing[0], "multiplier": least},
    )


def rod_weight_turns_the_pair(weight: float = 0.5, pair: DumbbellPair = EXPERIMENT) -> Finding:
    light = dyad_minima(replace(pair, rod_weight=0.0))[0].headings[0]
    heavy = dyad_minima(replace(pair, rod_weight=weight))[0].headings[0]
    change = heavy - light
    return Finding(
        Outcome.HOLDS if change > 1e-9 else Outcome.REFUTED,
        f"rods of {weight} ball weights change the heading by {change:.1e} degrees: a rod's middle "
        "is at the mean height of its balls, so its weight multiplies the energy by 1 + w/2",
        {"change": change},
    )


CLAIMS = (
    Claim("E2", "6", "both nested loci are local minima", "numerical", corners_are_minima),
    Claim(
        "E3",
        "6",
        "there the azimuths cancel and the headings are equal",
        "numerical",
        pair_is_balanced_and_parallel,
    ),
    Claim("E4", "6, C", "the heading is arctan(r/l)", "numerical", heading_is),
    Claim("E5", "6", "dE does not vanish there", "numerical", energy_slopes_at_the_corner),
    Claim(
        "E6",
        "6, C",
        "one direction is held half-V, two half-U, two U, one is free: (p, q, r) = (1, 4, 1)",
        "numerical",
        signature_is,
    ),
    Claim(
        "E9",
        "6",
        "the nested corner is a minimum for every rod thinner than the balls",
        "numerical",
        corner_is_a_minimum_for,
    ),
    Claim(
        "L7",
        "C",
        "rods that have weight increase the heading",
        "numerical",
        rod_weight_turns_the_pair,
    ),
)
