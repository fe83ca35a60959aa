"""Section 7: motion of pairs in the rotating drum.

The model is that of :mod:`paper_checks.section3.singles`; the coefficient of friction between
dumbbells that touch is 0.3.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from paper_checks.appendixA.forces import judged
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.framework.disturbances import TEXT, Disturbance, Friction
from paper_checks.section7.driven import (
    ANGLES,
    CHATTER,
    CLEARANCE,
    HARD,
    KINDS,
    TWO,
    Starts,
    disturbed_dyads,
    dyads,
    pairs,
    settled,
)
from polycorner.dumbbells.dynamics.dyads import DyadPaths, handedness, minimiser_heading
from polycorner.motion import Noise, simulate
from polycorner.toolkit import Array

BOTH: Starts = (("R", 8.0), ("L", -8.0))
MILD, STRONG = 0.3, 0.4  # chatter with which right-handed pairs climb, and do not


def rates(paths: DyadPaths, after: float = 5.0) -> Array:
    return np.asarray(paths.climb_rates(after=after))


def pairs_go(
    sign: int = 1, *, tilt: float = 0.0, chatter: float = 0.0, duration: float = 40.0
) -> Finding:
    """Check that right-handed pairs climb and left-handed ones descend, and the motion of ``G``.

    In a level drum pairs in ``G`` have to stay, in a tilted one to descend.
    """
    right, left = rates(dyads(BOTH, duration, chatter=chatter, tilt=tilt))
    both = pairs("end_to_end", 2, duration, chatter=chatter, tilt=tilt)
    moved = (both.eta[-1] - both.eta[0]) / duration
    ends = bool((moved < -1e-6).all()) if tilt else bool((np.abs(moved) < 1e-6).all())
    holds = sign * right > 0 > sign * left and ends
    under = Verdict.HOLDS_UNDER if chatter else Verdict.HOLDS
    how = f"with chatter A = {chatter:g}" if chatter else "without noise"
    return Finding(
        under if holds else Verdict.REFUTED,
        f"{how}, tilted by {tilt:g}°, in mm/s: a right-handed pair {right:.4f}, a left-handed one "
        f"{left:.4f}, pairs end to end {moved[0]:.4f} and {moved[1]:.4f}",
        {"right": float(right), "left": float(left), "end_to_end": float(moved.max())},
        f"noise of about A = {chatter:g}: enough for pairs in $G$ to slip, not so much that "
        "slippage outweighs the climb of right-handed pairs"
        if chatter
        else "",
    )


class Wandering(NamedTuple):
    """Five right-handed pairs under noise: by how much headings and azimuths vary, in degrees."""

    heading: float  # largest deviation from a pair's own mean in the last quarter
    widths: tuple[float, float]  # of the zigzags of different pairs, least and largest
    turned: float  # the range of all first headings over that of the last ones


def wandering(noise: Disturbance, duration: float, friction: Friction = TEXT) -> Wandering:
    """Return how far pairs depart from what they have come to, in the last quarter of the time."""
    paths, count = disturbed_dyads(noise, duration, friction=friction), len(ANGLES)
    late = paths.times >= 0.75 * duration
    headings, azimuths = (np.degrees(x[:, :count]) for x in (paths.heading, paths.azimuth))
    means, widths = headings[late].mean(axis=0), np.ptp(azimuths[late], axis=0)
    return Wandering(
        float(np.abs(headings[late] - means).max()),
        (float(widths.min()), float(widths.max())),
        float(np.ptp(headings[0]) / np.ptp(means)),
    )


def stays_at_its_heading(
    within: float = 2.0,
    width: tuple[float, float] = (4.0, 6.0),
    kinds: Sequence[tuple[Disturbance, float]] = KINDS,
    turned: float = 2.0,
) -> Finding:
    """Check both under noise that has turned pairs: the headings of others are not their own doing.

    The range of five headings has to have shrunk by the factor ``turned``; ``width`` is that of
    zigzags.
    """
    found = {noise: wandering(noise, duration) for noise, duration in kinds}
    turning = {noise: one for noise, one in found.items() if one.turned >= turned}
    steady = [noise for noise, one in turning.items() if one.heading <= within]
    both = [
        n for n in steady if width[0] <= min(found[n].widths) <= max(found[n].widths) <= width[1]
    ]
    listed = "; ".join(
        f"{noise}, {one.heading:.2g}° and {one.widths[0]:.2g}° to {one.widths[1]:.2g}°"
        for noise, one in found.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if both else Verdict.REFUTED,
        "largest deviation of the headings of right-handed pairs from their means, and widths of "
        f"their zigzags, in the last quarter of the time: {listed}; headings stay within "
        f"{within:g}° under {len(steady)} of the {len(turning)} that turn pairs",
        {f"heading_{k}": one.heading for k, one in enumerate(found.values())}
        | {f"width_{k}": one.widths[1] for k, one in enumerate(found.values())},
        f"{' or '.join(map(str, both))}"
        if both
        else "headings do stay within 2°; what makes them turn makes the zigzags narrower than "
        "observed, or, across the axis, wider. Without noise zigzags have the width observed, and "
        "pairs the heading with which they were formed, whatever that is",
    )


def stays_close_to_the_corner(locus: str = "delta", near: float = TWO.ball_radius) -> Finding:
    """Measure how far a zigzag is from ``delta_R``, or from ``Delta_R``, the corner.

    The distance is that of section 7, by the natural metric of ``M x M``: azimuths along the wall,
    axial positions and headings times half the length, of both dumbbells.  It is small if it is
    less than the radius of a ball.  From ``Delta_R`` it is at most that of the same corner, placed
    where the pair is.
    """
    paths = dyads((("R", 8.0),), 60.0)
    late = paths.times > 15.0
    heading = math.radians(minimiser_heading(TWO))
    across = TWO.centre_radius * paths.azimuth[late, 0]
    turned = TWO.length / 2 * (paths.heading[late, 0] - heading)
    far = math.sqrt(2) * np.hypot(across, turned)
    opened = float(np.abs(paths.shift[late] - paths.shift[0]).max())
    distance = float(far.min()) if locus == "delta" else opened
    return Finding(
        judged(distance < near, Verdict.CORRECTED if opened < near else Verdict.REFUTED),
        f"by the natural metric of $M \\times M$ the zigzag of a pair without noise is "
        f"{far.min():.1f} to {far.max():.1f} mm from $\\delta_R$; meanwhile its dumbbells shift by "
        f"{opened:.4f} mm against each other",
        {"least": float(far.min()), "largest": float(far.max()), "shift": opened},
        "the zigzag stays close to the corner $\\Delta_R$, which it hardly opens, and not to "
        "$\\delta_R$, the part of it on the lowest line: all its azimuths are on the side "
        "to which the drum carries",
    )


def sorting_needs_no_chirality(
    image: Sequence[float] = (1, -1, -1), turned: bool = True
) -> Finding:
    """Simulate a right-handed pair and its image in a level drum under the same noise.

    ``image``: signs of ``phi, eta, theta``; ``turned``: headings by half a turn, so that the balls
    keep their numbers and their noise.
    """
    two = replace(TWO, tilt=0.0)
    half = np.array([0, 0, math.pi * turned])
    q = two.pair.nested("R", heading=0.2, clearance=CLEARANCE).reshape(2, 3)
    place = q * image + half
    noise = Noise(chatter=STRONG, seed=11)
    first, second = (
        simulate(two, two.state(p), 9.5, 1e-3, noise=noise).q[..., :3] for p in (q, place)
    )
    moved = float(np.abs(first[-1, :, 1] - first[0, :, 1]).max())
    apart = float(np.abs(second * image + half - first)[-1].max())
    hands = [int(handedness(two, p)) for p in (q, place)]
    holds = hands[0] == -hands[1] and apart < 0.01 * moved
    return Finding(
        judged(holds),
        f"handedness {hands[0]} and {hands[1]}; under the same noise the image's motion differs "
        f"from the image of the motion by {apart:.1e}, after both have moved {moved:.2f} mm",
        {"apart": apart, "moved": moved},
    )


def spin_decides_who_climbs(sign: int = 1) -> Finding:
    """Simulate pairs in level drums that turn with ``sign`` times the usual spin."""
    right, left = rates(dyads(BOTH, 30.0, tilt=0.0, spin=0.01 * sign))
    return Finding(
        judged(right > 0 > left),
        f"with $\\omega = {0.01 * sign:g}$ rad/s right-handed pairs of 8° move with {right:.4f} "
        f"mm/s and left-handed ones of -8° with {left:.4f} mm/s",
        {"right": float(right), "left": float(left)},
    )


def noise_leads_to_the_corner(spin: float = 0.0, chatter: float = 1.0) -> Finding:
    """Check that shaken pairs stay in the corner and approach the heading of least energy."""
    paths = dyads((("R", 2.0), ("R", 14.0)), 100.0, chatter=chatter, tilt=0.0, spin=spin)
    least = minimiser_heading(TWO)
    start, end = np.degrees(paths.heading[[0, -1]])
    shifted = float(np.abs(paths.shift[-1] - paths.shift[0]).max())
    closer = bool((np.abs(end - least) < np.abs(start - least) - 1.0).all())
    return Finding(
        Verdict.HOLDS_UNDER if closer and shifted < 0.5 else Verdict.REFUTED,
        f"in a level drum of spin {spin:g} rad/s under A = {chatter:g} headings of "
        f"{start[0]:.0f}° and {start[1]:.0f}° become {end[0]:.2f}° and {end[1]:.2f}° in 100 s, "
        f"the least energy being at {least:.2f}°; the dumbbells shift by up to {shifted:.2f} mm",
        {"first": float(end[0]), "second": float(end[1]), "least": least, "shift": shifted},
        "in a drum at rest. In the turning one chatter strong enough to turn a pair takes it out "
        "of the corner along the rods; shaking of the whole drum does not (T9b)",
    )


def driven_stay_at_the_corner(
    kinds: Sequence[tuple[Disturbance, float]] = KINDS, least: float = 0.5
) -> Finding:
    """Check that right-handed pairs keep the shift of the corner to within ``least`` mm."""
    found = {noise: settled(*noise) for noise in kinds}
    stay = [noise for noise, one in found.items() if one.opened < least]
    listed = "; ".join(
        f"{noise[0]}, {noise[1]:g} s, {one.opened:.2f} mm with {one.held[0]} of 5 pairs together"
        for noise, one in found.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if stay else Verdict.REFUTED,
        "largest change of the shift of right-handed pairs along their rods, in the tilted, "
        f"turning drum: {listed}",
        {f"opened_{k}": one.opened for k, one in enumerate(found.values())},
        f"{'; '.join(str(noise[0]) for noise in stay)}: shaking acts on both dumbbells alike; "
        "under kicks the shift is that of the corner, but the dumbbells rattle in it, and chatter "
        "takes them along the rods, towards balls side by side"
        if stay
        else "",
    )


def tilting_keeps_heading(
    tolerance: float = 1.0, noise: Disturbance = HARD, duration: float = 200.0
) -> Finding:
    """Compare the headings of right-handed pairs, tilted and level, under the same noise."""
    late = [settled(noise, duration, tilt).right for tilt in (7.0, 0.0)]
    tilted, level = (float(x.mean()) for x in late)
    errors = [float(x.std(ddof=1) / math.sqrt(len(x))) for x in late]
    return Finding(
        Verdict.HOLDS_UNDER if abs(tilted - level) <= tolerance else Verdict.REFUTED,
        f"under {noise}, headings of right-handed pairs are {tilted:.2f} ± {errors[0]:.2f}° tilted "
        f"by 7° and {level:.2f} ± {errors[1]:.2f}° level (means from {0.75 * duration:g} to "
        f"{duration:g} s of five starts from -8° to 14°)",
        {"tilted": tilted, "level": level},
        "shaking of the whole drum that makes pairs slip in both, where both come to the heading "
        "of least energy; in a level drum it has to be stronger, because the weight does not help; "
        "under chatter and kicks pairs of the tilted drum have smaller headings",
    )


def colours_agree() -> Finding:
    """State what was read: there is nothing to compute."""
    return Finding(
        Verdict.NOT_TESTABLE,
        "Nothing is computed here, it was read: the caption has right-handed pairs in blue and "
        "left-handed ones in green, the text the other way round. In the figures of the drum's "
        "coordinates and of the boundary of $A$ blue goes with positive headings, as in the "
        "caption.",
    )


CLAIMS = (
    Claim(
        "T3",
        "7",
        "pairs in a level drum",
        "near $\\delta_R$ a pair climbs, near $\\delta_L$ it descends, near $G$ it stays",
        Means.SIMULATION,
        pairs_go,
        partial(pairs_go, -1),
        figure="dyad_history",
    ),
    Claim(
        "T5a",
        "7",
        "pairs in a tilted drum, end",
        "a right-handed pair keeps its heading within 2° in zigzags of about 5°",
        Means.SIMULATION,
        stays_at_its_heading,
        partial(stays_at_its_heading, width=(0.0, 6.0)),
        slow=True,
        figure="dyad_history",
    ),
    Claim(
        "T5b",
        "7",
        "pairs in a tilted drum, end",
        "its zigzag stays close to $\\delta_R$",
        Means.SIMULATION,
        stays_close_to_the_corner,
        partial(stays_close_to_the_corner, "Delta"),
    ),
    Claim(
        "T6a",
        "7",
        "chiral sorting",
        "the level turning drum is achiral and nevertheless sorts by chirality",
        Means.SIMULATION,
        sorting_needs_no_chirality,
        partial(sorting_needs_no_chirality, (-1, 1, -1), turned=False),
    ),
    Claim(
        "T6b",
        "7",
        "chiral sorting",
        "right-handed pairs go towards positive $\\eta$, for the sense of rotation in the paper",
        Means.SIMULATION,
        spin_decides_who_climbs,
        partial(spin_decides_who_climbs, -1),
    ),
    Claim(
        "T7",
        "7",
        "pairs in a tilted drum",
        "near $\\delta_R$ a pair climbs to the top; near $\\delta_L$ and $G$ it descends",
        Means.SIMULATION,
        partial(pairs_go, tilt=7.0, chatter=MILD, duration=80.0),
        partial(pairs_go, tilt=7.0, chatter=STRONG, duration=80.0),
        figure="dyad_history",
    ),
    Claim(
        "T10",
        "7",
        "caption of the figure of pairs near $\\delta$, against the text",
        "the colours of right-handed and left-handed pairs agree",
        Means.NUMERICAL,
        colours_agree,
        None,
    ),
    Claim(
        "T9a",
        "7",
        "pairs in a level drum",
        "weak noise takes a pair to the neighbourhood of $\\delta$ if rotation is slow",
        Means.SIMULATION,
        noise_leads_to_the_corner,
        partial(noise_leads_to_the_corner, 0.01, STRONG),
        slow=True,
    ),
    Claim(
        "T9b",
        "7",
        "pairs in a turning drum",
        "driven pairs stay close to the corner $\\delta$",
        Means.SIMULATION,
        driven_stay_at_the_corner,
        partial(driven_stay_at_the_corner, ((CHATTER, 300.0),)),
        slow=True,
    ),
    Claim(
        "T4b",
        "7",
        "pairs in a tilted drum",
        "tilting by 7° hardly changes the heading of driven pairs",
        Means.SIMULATION,
        tilting_keeps_heading,
        partial(tilting_keeps_heading, noise=CHATTER, duration=300.0),
        slow=True,
        figure="heading_length",
    ),
)
