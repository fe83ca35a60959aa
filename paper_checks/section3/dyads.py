"""Section 3.2: dyads in the turning drum, as observed.

The model is that of :mod:`paper_checks.section3.singles`; the coefficient of friction between
dumbbells that touch is 0.3.
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from paper_checks.appendixA.forces import judged
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.framework.disturbances import Disturbance, which
from paper_checks.section7.driven import (
    HARD,
    KINDS,
    TWO,
    Kind,
    Starts,
    dyads,
    pairs,
    settled,
)
from polycorner.dumbbells.dynamics.dyads import handedness, minimiser_heading
from polycorner.dumbbells.dynamics.pairs import is_dyad

Kept = tuple[Disturbance, float]  # a kind of noise, and for how long it is kept up, in s
MILD = Disturbance("chatter", 0.2, 0.01)
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


def hands_are_opposite(sign: int = -1, tolerance: float = 2.0) -> Finding:
    """Compare the mean headings of both hands in the tilted drum, under each kind of noise."""
    found = {noise: settled(*noise) for noise in KINDS}
    means = {noise: (one.right.mean(), one.left.mean()) for noise, one in found.items()}
    agree = [noise for noise, (r, left) in means.items() if abs(left - sign * r) <= tolerance]
    shaken = [noise for noise in agree if noise[0].kind.startswith("shaking")]
    listed = "; ".join(f"{noise[0]}, {r:.1f}° and {x:.1f}°" for noise, (r, x) in means.items())
    return Finding(
        Verdict.HOLDS_UNDER if shaken else Verdict.REFUTED,
        f"tilted by 7°, mean headings of right- and left-handed dyads in the last quarter of the "
        f"time: {listed}",
        {f"sum_{k}": float(r + x) for k, (r, x) in enumerate(means.values())},
        "shaking of the whole drum that makes dumbbells slip, along the axis, across or up, under "
        f"which they are opposite within {max(abs(sum(means[noise])) for noise in shaken):.1f}°; "
        "kicks and chatter, which act on each dumbbell by itself, make left-handed dyads steeper "
        "in a tilted drum"
        if shaken
        else "",
    )


def steady_heading_is(
    degrees: float = 15.0, tolerance: float = 2.0, kinds: Sequence[Kept] = KINDS
) -> Finding:
    """Compare with the mean headings of right-handed dyads of 16 mm under each kind of noise."""
    found = {noise: settled(*noise) for noise in kinds}
    reached = [
        noise
        for noise, one in found.items()
        if abs(one.right.mean() - degrees) <= tolerance and one.spread <= 2 * tolerance
    ]
    listed = "; ".join(
        f"{noise[0]}, {one.right.mean():.1f}° (over {one.spread:.1f}°)"
        for noise, one in found.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if reached else Verdict.REFUTED,
        f"mean headings of right-handed dyads of 16 mm, and the range of five starts, in the last "
        f"quarter of the time, tilted by 7°: {listed}",
        {f"heading_{k}": float(one.right.mean()) for k, one in enumerate(found.values())},
        f"{' or '.join(str(noise[0]) for noise in reached)}, two numbers that are not measured; "
        "stronger kicks lead to smaller headings, and under shaking of the whole drum dyads come "
        f"to that of least energy, {minimiser_heading(TWO):.2f}°"
        if reached
        else "",
    )


def heading_is_common(spread: float = 2.0, kinds: Sequence[Kept] = KINDS) -> Finding:
    """Check that right-handed dyads from -8 to 14 degrees reach the same heading."""
    found = {noise: settled(*noise) for noise in kinds}
    reached = [noise for noise, one in found.items() if one.spread <= 2 * spread]
    climb = [str(noise[0]) for noise in reached if found[noise].climb > 0]
    listed = "; ".join(
        f"{noise[0]}, after {0.75 * noise[1]:g} to {noise[1]:g} s {one.right.min():.1f}° to "
        f"{one.right.max():.1f}°, moving at {one.climb:.2f} mm/s"
        for noise, one in found.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if reached else Verdict.REFUTED,
        f"right-handed dyads of 16 mm from -8°, 2°, 6°, 10° and 14°, tilted by 7°: {listed}",
        {f"spread_{k}": one.spread for k, one in enumerate(found.values())},
        f"noise that makes dyads slip, {which([n[0] for n in reached], [n[0] for n in kinds])}; at "
        f"the same time they climb under {' and '.join(climb) or 'none of these'}; less noise "
        "leaves dyads their headings"
        if reached
        else "",
    )


def heading_falls_with_length(
    lengths: Sequence[float] = (12.0, 16.0, 24.0),
    sign: int = -1,
    tilts: Sequence[float] = (7.0, 0.0),
) -> Finding:
    """Compare dyads of several lengths under shaking that makes all of them slip."""
    means = {t: [settled(HARD, 200.0, t, n).right.mean() for n in lengths] for t in tilts}
    holds = all((sign * np.diff(m) > 0).all() for m in means.values())
    listed = "; ".join(
        f"tilt {t:g}°: " + ", ".join(f"{n:g} mm {x:.1f}°" for n, x in zip(lengths, m, strict=True))
        for t, m in means.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"headings under {HARD}, means from 150 to 200 s over five starts: {listed}",
        {
            f"{t:g}_{n:g}": float(x)
            for t, m in means.items()
            for n, x in zip(lengths, m, strict=True)
        },
        "noise that brings dyads to one heading, here shaking, where it is that of least energy",
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
        partial(heading_is_common, kinds=((MILD, 300.0),)),
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
        partial(hands_are_opposite, 1),
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
        partial(steady_heading_is, 25.0),
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
