"""Section 3.2: dyads in the turning drum, as observed.

The model is that of :mod:`paper_checks.section3.singles`; the coefficient of friction between
dumbbells that touch is 0.3.
"""

import math
from collections.abc import Sequence
from functools import cache, partial

import numpy as np

from paper_checks.appendixA.forces import judged
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section7.driven import LASTING, LATE, TWO, Kind, Starts, dyads, pairs
from polycorner.dumbbells.dynamics.dyads import handedness
from polycorner.dumbbells.dynamics.pairs import is_dyad
from polycorner.spaces.manifold import Array

FOUR: Starts = (("R", 2.0), ("R", 6.0), ("R", 10.0), ("R", 14.0))
STRONG = 0.4  # chatter under which headings of pairs change within minutes


def hands_are_images(image: Sequence[float] = (-1, 1, -1)) -> Finding:
    """Check that an image of right-handed dyads consists of left-handed dyads; signs as given."""
    angles = np.radians(np.linspace(-15, 15, 31))
    right = np.array([TWO.pair.nested("R", heading=angle) for angle in angles]).reshape(-1, 2, 3)
    other = right * image
    before, after = handedness(TWO, right), handedness(TWO, other)
    feasible = is_dyad(TWO, other) & is_dyad(TWO, right)
    holds = bool((before == 1).all() and (after == -1).all() and feasible.all())
    return Finding(
        judged(holds),
        f"of {len(angles)} right-handed dyads with headings from -15° to 15°, "
        f"{(after == -1).sum()} images are left-handed and {feasible.sum()} are dyads",
        {"left": float((after == -1).sum()), "dyads": float(feasible.sum())},
    )


def comes_apart(
    kind: Kind | None = "side_by_side", count: int = 4, duration: float = 100.0
) -> Finding:
    """Check that most pairs of a kind leave their placement within ``duration`` under noise.

    ``None``: nested pairs.
    """
    if kind is None:
        paths = dyads((("R", 8.0),) * count, duration, chatter=STRONG)
        first, quiet = TWO.pair.nested("R"), 0.0
        left = paths.hand[-1] != paths.hand[0]
        own = False
    else:
        paths = pairs(kind, count, duration, chatter=STRONG)
        first = getattr(TWO.pair, kind)(clearance=0.05)
        quiet = float(pairs(kind, 1, duration).shift[-1].max())
        left = paths.shift[-1] > TWO.ball_radius / 2
        flipped = first.reshape(2, 3)[::-1] * [-1, 1, -1]
        own = bool(np.allclose(flipped, first.reshape(2, 3)))
    return Finding(
        Verdict.HOLDS_UNDER if left.mean() > 0.5 and own else Verdict.REFUTED,
        f"under A = {STRONG:g}, {left.sum()} of {count} pairs have left their placement after "
        f"{duration:g} s, shifted by {paths.shift[-1].min():.2f} to {paths.shift[-1].max():.2f} "
        f"mm; without noise they shift by {quiet:.4f} mm; the placement "
        + ("is" if own else "is not")
        + " its own mirror image",
        {"left": float(left.sum()), "shift": float(paths.shift[-1].min())},
        "the pair marked NC read as one side by side, which is its own mirror image: it needs "
        "noise to slide apart",
    )


def heading_gets_its_sign(chatter: float = 0.45, degrees: float = 8.0) -> Finding:
    """Start dyads with headings of the wrong sign and simulate them for 150 s."""
    starts: Starts = (("R", -degrees), ("R", -degrees / 2), ("L", degrees), ("L", degrees / 2))
    paths = dyads(starts, 150.0, chatter=chatter)
    late = np.degrees(paths.heading[paths.times >= 130.0]).mean(axis=0)
    sign = np.array([1, 1, -1, -1])
    holds = bool((sign * late > 0).all()) and bool(np.isinf(paths.lifetimes).all())
    listed = ", ".join(
        f"{hand} {angle:g}°: {end:.1f}°" for (hand, angle), end in zip(starts, late, strict=True)
    )
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"with chatter A = {chatter:g}, means from 130 to 150 s: {listed}",
        {f"end_{k}": float(x) for k, x in enumerate(late)},
        f"noise of about A = {chatter:g}; without noise dyads keep the heading they are formed "
        "with",
    )


def hands_are_opposite(tolerance: float = 2.0) -> Finding:
    """Compare the headings that both hands reach in the tilted drum, 100 to 150 s."""
    starts: Starts = (("R", -8.0), ("R", -4.0), ("L", 8.0), ("L", 4.0))
    paths = dyads(starts, 150.0, chatter=0.45)
    late = np.degrees(paths.heading[paths.times >= 100.0]).mean(axis=0)
    right, left = float(late[:2].mean()), float(late[2:].mean())
    return Finding(
        judged(abs(right + left) <= tolerance),
        f"tilted by 7°, A = 0.45: right-handed dyads {right:.1f}°, left-handed ones {left:.1f}°",
        {"right": right, "left": left},
        "exact in a level drum only, where reflection in a cross-section exchanges the hands; "
        "tilted, left-handed dyads are steeper",
    )


@cache
def late_headings(length: float, tilt: float, chatter: float) -> tuple[float, float, Array]:
    """Return mean, standard error and means of four starts, from 150 to 300 s, in degrees."""
    paths = dyads(FOUR, LASTING, chatter=chatter, tilt=tilt, length=length)
    each = np.degrees(paths.heading[paths.times >= LATE]).mean(axis=0)
    return float(each.mean()), float(each.std(ddof=1) / math.sqrt(len(each))), each


def steady_heading_is(degrees: float = 15.0, tolerance: float = 2.0) -> Finding:
    """Compare with dyads of 16 mm, tilted and level, under strong noise and without noise."""
    found = {}
    for tilt, chatter in ((7.0, STRONG), (0.0, STRONG)):
        found[tilt] = late_headings(16.0, tilt, chatter)[:2]
    reached = [abs(mean - degrees) <= max(tolerance, 3 * error) for mean, error in found.values()]
    listed = ", ".join(f"{m:.1f} ± {e:.1f}° at {tilt:g}°" for tilt, (m, e) in found.items())
    return Finding(
        Verdict.HOLDS_UNDER if any(reached) else Verdict.REFUTED,
        f"with chatter A = {STRONG:g} four dyads of 16 mm have, on average from {LATE:g} to "
        f"{LASTING:g} s, headings of {listed} of tilt",
        {f"tilt_{tilt:g}": mean for tilt, (mean, _) in found.items()},
        "not reproduced: with noise headings end far below, without it they stay as they are",
    )


def heading_is_common(spread: float = 2.0, chatter: float = 0.2) -> Finding:
    """Check that dyads from 2 to 14 degrees have the same heading after 300 s."""
    _, _, each = late_headings(16.0, 7.0, chatter)
    found = float(np.ptp(each))
    return Finding(
        judged(found <= 2 * spread),
        f"with chatter A = {chatter:g} dyads from 2°, 6°, 10° and 14° have "
        f"{', '.join(f'{x:.1f}°' for x in each)} on average from {LATE:g} to {LASTING:g} s",
        {"spread": found},
        "in the model mild noise leaves dyads the heading with which they were formed; only noise "
        "that takes them out of the corner brings the headings together",
    )


def heading_falls_with_length(
    lengths: Sequence[float] = (12.0, 16.0, 24.0),
    sign: int = -1,
    tilts: Sequence[float] = (7.0, 0.0),
) -> Finding:
    means = {t: [late_headings(n, t, STRONG)[0] for n in lengths] for t in tilts}
    holds = all((sign * np.diff(m) > 0).all() for m in means.values())
    listed = "; ".join(
        f"tilt {t:g}°: " + ", ".join(f"{n:g} mm {x:.1f}°" for n, x in zip(lengths, m, strict=True))
        for t, m in means.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"headings under A = {STRONG:g}, means from {LATE:g} to {LASTING:g} s: {listed}",
        {f"{t:g}_{n:g}": x for t, m in means.items() for n, x in zip(lengths, m, strict=True)},
        f"under noise of A = {STRONG:g}, although the headings are not those observed",
    )


def text_and_curve_agree(
    observed: float = 15.0, radius: float = 3.0, length: float = 16.0
) -> Finding:
    """Compare the heading quoted for 16 mm with the curve ``arctan(r/l)`` of the figure."""
    curve = math.degrees(math.atan2(radius, length))
    return Finding(
        judged(abs(curve - observed) <= 2.0),
        f"quoted {observed:.1f}°, $\\arctan({radius:g}/{length:g}) = {curve:.2f}°$: they differ "
        f"by {abs(observed - curve):.1f}°, and headings are said to fluctuate by 2°",
        {"curve": curve},
        f"the quoted heading is {observed / curve:.2f} times that of the curve said to explain it",
    )


CLAIMS = (
    Claim(
        "B2a",
        "3",
        "observation (iii) on a bunch",
        "right- and left-handed dyads are mirror images of each other",
        Means.NUMERICAL,
        hands_are_images,
        partial(hands_are_images, (-1, -1, 1)),
    ),
    Claim(
        "B2b",
        "3",
        "observation (iii) on a bunch",
        "a pair that is its own mirror image and not nested is unstable",
        Means.SIMULATION,
        comes_apart,
        partial(comes_apart, None),
        slow=True,
    ),
    Claim(
        "B3a",
        "3",
        "observation (iv) on a bunch",
        "right-handed dyads turn to positive headings, left-handed ones to negative ones, from "
        "either sign",
        Means.SIMULATION,
        heading_gets_its_sign,
        partial(heading_gets_its_sign, 0.0),
        slow=True,
        figure="dyad_history",
    ),
    Claim(
        "B3b",
        "3",
        "observation (iv) on a bunch",
        "dyads of any small initial heading reach the same final heading",
        Means.SIMULATION,
        heading_is_common,
        partial(heading_is_common, chatter=STRONG),
        slow=True,
        figure="dyad_history",
    ),
    Claim(
        "B3c",
        "3",
        "observation (iv) on a bunch",
        "left-handed dyads settle at the opposite of the heading of right-handed ones, in the "
        "tilted drum",
        Means.SIMULATION,
        hands_are_opposite,
        partial(hands_are_opposite, 20.0),
        slow=True,
        figure="heading_length",
    ),
    Claim(
        "B4a",
        "3",
        "observation (iv) on a bunch",
        "the steady heading of dyads of 16 mm is about 15°",
        Means.SIMULATION,
        steady_heading_is,
        partial(steady_heading_is, 4.5),
        slow=True,
        figure="heading_length",
    ),
    Claim(
        "B4b",
        "3",
        "observation (iv) on a bunch",
        "the steady heading falls with the length",
        Means.SIMULATION,
        heading_falls_with_length,
        partial(heading_falls_with_length, sign=1),
        slow=True,
        figure="heading_length",
    ),
    Claim(
        "B4c",
        "3",
        "observation (iv) on a bunch, against the figure of headings",
        "the heading quoted for 16 mm agrees with $\\arctan(r/\\ell)$",
        Means.NUMERICAL,
        text_and_curve_agree,
        partial(text_and_curve_agree, 10.6),
        figure="heading_length",
    ),
)
