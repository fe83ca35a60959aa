"""Section 3.1: a single dumbbell in the turning drum, as observed.

Observations of an experiment are compared with the model: dumbbells as rigid axles with dry
friction, coefficients of the text (dynamic ones, not given there, 0.06 and 0.2), and, where stated,
noise of one kind: loads that chatter with a relative amplitude ``A``, drawn independently every
0.01 s, shaking of the whole drum, or random forces on each dumbbell.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial

import numpy as np

from paper_checks.appendixA.forces import STATIC, judged
from paper_checks.appendixA.torque import DRUM
from paper_checks.appendixA.turning import turns
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.framework.disturbances import ALONG, HELD, TEXT, Disturbance, Friction, which
from polycorner.dumbbells.dynamics.singles import follow, zigzags
from polycorner.dumbbells.statics.keel import Keel
from polycorner.motion import Trajectory
from polycorner.toolkit import Array

NOISY = Disturbance("chatter", 0.35, 0.01)  # headings decay while dumbbells climb at first
MILD, QUIET = NOISY._replace(strength=0.2), NOISY._replace(strength=0.0)
KINDS = (
    NOISY,
    Disturbance(ALONG, 800.0, 0.01),
    Disturbance("shaking across", 2000.0, 0.03),
    Disturbance("shaking up", 3000.0, 0.03),
    Disturbance("kicks", 40.0, HELD),
)
START = (15.0, 15.0, -15.0, -15.0, 0.0, 0.0)


@cache
def shaken(
    noise: Disturbance,
    headings: tuple[float, ...] = START,
    duration: float = 200.0,
    friction: Friction = TEXT,
) -> Trajectory:
    """Simulate dumbbells under noise, from the lowest line."""
    drum, kicks = noise.acting_on(friction.of(DRUM), 1)
    dt = noise.step(2e-3, kicked=1e-3)
    return follow(drum, np.radians(headings), duration, noise=kicks, dt=dt)


def risen(path: Trajectory) -> Array:
    return np.asarray(path.q[-1, :, 1] - path.q[0, :, 1])


# -------------------------------------------------------------------------------- climbing, zigzags


def climbs_with_sign(
    sign: int = 1, headings: Sequence[float] = (-20, -10, -3, 3, 10, 20)
) -> Finding:
    """Compare rises over whole zigzags with the sign of the heading, and with a speed."""
    found = zigzags(follow(DRUM, np.radians(headings), 30.0), DRUM.spin)
    rates = np.array([z.climb_rate for z in found])
    law = DRUM.spin * DRUM.centre_radius * np.tan(np.radians(headings))
    off = float(np.abs(rates / law - 1).max())
    listed = ", ".join(f"{a:g}°: {b:.4f}" for a, b in zip(headings, rates, strict=True))
    return Finding(
        judged(bool((sign * rates * headings > 0).all())),
        f"speeds along the drum in mm/s, without noise: {listed}; they are "
        f"$\\omega(R-r)\\tan\\theta$ to within a share of {off:.1e}",
        {"slowest": float(np.abs(rates).min()), "off": off},
    )


def rolls_faster_than_carried(factor: float = 5.0) -> Finding:
    """Check that zigzags have both phases, the rolling one faster by at least ``factor``."""
    ratios, shares = [], []
    for zigzag in turns():
        rolling = zigzag.width / (zigzag.stops - zigzag.starts)
        ratios.append(float((rolling / DRUM.spin).min()))
        spans = np.diff(zigzag.starts)
        shares.append(float(((zigzag.stops - zigzag.starts)[:-1] / spans).max()))
    return Finding(
        judged(min(ratios) >= factor),
        f"rolling back is {min(ratios):.1f} to {max(ratios):.1f} times as fast as being carried "
        f"and takes at most {100 * max(shares):.1f} % of the time",
        {"least_ratio": min(ratios), "share": max(shares)},
    )


def width_is(
    degrees: float = 5.0, tolerance: float = 0.5, rolling: float = DRUM.rolling[1]
) -> Finding:
    """Compare the widths of zigzags without noise; ``rolling`` is the dynamic coefficient."""
    theta = np.radians([-20.0, -10.0, 0.0, 10.0, 20.0])
    drum = replace(DRUM, rolling=(DRUM.rolling[0], rolling))
    found = zigzags(follow(drum, theta, 30.0), drum.spin)
    widths = np.degrees([z.width.mean() for z in found])
    holds = bool((np.abs(widths - degrees) <= tolerance).all())
    possible = [mu for mu in np.arange(0.01, 0.1, 0.001) if fits(float(mu), degrees, tolerance)]
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"without noise widths are {widths.min():.2f}° to {widths.max():.2f}° for headings up to "
        "20°",
        {"least": float(widths.min()), "largest": float(widths.max())},
        f"a dynamic coefficient of rolling from {min(possible):.3f} to {max(possible):.3f}, which "
        "is not given, and no noise"
        if possible
        else "",
    )


def fits(rolling: float, degrees: float, tolerance: float) -> bool:
    keel = Keel(DRUM.tilt, *STATIC, rolling, DRUM.sliding[1])
    turning = keel.turning(np.radians([-20.0, 0.0, 20.0]))
    widths = np.degrees(turning.upper - turning.coasting)
    return bool((np.abs(widths - degrees) <= tolerance).all())


def width_and_decay(
    kinds: Sequence[Disturbance] = (QUIET, MILD, *KINDS),
    least: float = 4.0,
) -> Finding:
    """Search for noise under which zigzags are wide and headings decay, both as observed.

    ``least`` is a width in degrees; a heading decays if it loses a tenth in a minute.
    """
    widths, left = [], []
    for noise in kinds:
        path = shaken(noise, (12.0,) * 4, 60.0)
        slips = np.degrees(np.concatenate([z.width for z in zigzags(path, DRUM.spin)]))
        wide = slips[slips > 1.0]
        widths.append(float(wide.mean()) if len(wide) else 0.0)
        left.append(float(np.degrees(path.q[-1, :, 2]).mean()) / 12.0)
    found = [w >= least and h < 0.9 for w, h in zip(widths, left, strict=True)]
    listed = "; ".join(
        f"{noise}, {w:.2f}° and {100 * h:.1f} %"
        for noise, w, h in zip(kinds, widths, left, strict=True)
    )
    return Finding(
        judged(any(found)),
        "mean width of slips of more than 1° (0: there are none), and share of a heading of 12° "
        f"left after 60 s: {listed}",
        {f"width_{k}": w for k, w in enumerate(widths)},
        "in the model noise of any kind tried that turns a dumbbell within minutes also makes it "
        "slip early, so that its zigzags are narrower: wide ones keep their heading",
    )


# ------------------------------------------------------------------------------- headings and noise


def heading_decays(kinds: Sequence[Disturbance] = KINDS) -> Finding:
    """Check that headings of both signs fall to less than a third in 200 s."""
    ends = {noise: np.degrees(shaken(noise).q[-1, :4, 2]) for noise in kinds}
    quiet = float(np.abs(shaken(QUIET, START[:4], 30.0).q[-1, :, 2] - np.radians(START[:4])).max())
    decay = [noise for noise, end in ends.items() if (np.abs(end) < 5.0).all()]
    listed = "; ".join(
        f"{noise}, {', '.join(f'{h:.1f}°' for h in end)}" for noise, end in ends.items()
    )
    return Finding(
        Verdict.HOLDS_UNDER if decay else Verdict.REFUTED,
        f"headings of 15° (two) and -15° (two) after 200 s: {listed}; without noise they change by "
        f"{math.degrees(quiet):.1e}° in 30 s",
        {"largest": max(float(np.abs(end).max()) for end in ends.values())},
        f"noise that makes dumbbells slip, {which(decay, kinds)}; friction balances the torque at "
        "rest and in rolling, and only slippage lets the heading decay",
    )


def heading_falls_while_rolling(share: float = 0.6) -> Finding:
    """Check which share of the loss of heading happens while the azimuth decreases."""
    path = shaken(NOISY)
    turn = np.diff(np.abs(path.q[:, :4, 2]), axis=0)
    falls = np.diff(path.q[:, :4, 0], axis=0) < 0
    found, time = float(turn[falls].sum() / turn.sum()), float(falls.mean())
    return Finding(
        Verdict.HOLDS_UNDER if found >= share else Verdict.REFUTED,
        f"under {NOISY}, {100 * found:.0f} % of the change of headings happens while "
        f"the azimuth decreases, {100 * time:.0f} % of the time (records 0.02 s apart)",
        {"share": found, "time": time},
        f"most of it: with this noise {100 * (1 - found):.0f} % happen in slips while carried",
    )


def level_heading_slips_down(kinds: Sequence[Disturbance] = KINDS) -> Finding:
    """Check that dumbbells of heading 0 descend by a millimetre or more in 200 s."""
    rises, widest = {}, 0.0
    for noise in kinds:
        path = shaken(noise)
        rises[noise] = risen(path)[-2:]
        widest = max(widest, float(np.degrees(np.abs(path.q[:, -2:, 2])).max()))
    sink = [noise for noise, rise in rises.items() if (rise < -1.0).all()]
    listed = "; ".join(f"{noise}, {r[0]:.1f} and {r[1]:.1f} mm" for noise, r in rises.items())
    return Finding(
        Verdict.HOLDS_UNDER if sink and widest < 5.0 else Verdict.REFUTED,
        f"two dumbbells of heading 0 move in 200 s under {listed}, and stay within {widest:.1f}° "
        "of it",
        {"rise": max(float(rise.max()) for rise in rises.values()), "widest": widest},
        f"noise that makes dumbbells slip, {which(sink, kinds)}; without it a dumbbell of "
        "heading 0 stays where it is along the drum",
    )


def all_descend_in_the_end(kinds: Sequence[Disturbance] = KINDS) -> Finding:
    """Check that all headings of at most 15 degrees end descending."""
    fastest, slowest, highest = {}, {}, 0.0
    for noise in kinds:
        path = shaken(noise)
        late = path.at(150.0)
        rates = (path.q[-1, :, 1] - path.q[late, :, 1]) / (path.times[-1] - path.times[late])
        fastest[noise], slowest[noise] = float(rates.min()), float(rates.max())
        highest = max(highest, float((path.q[:, :2, 1] - path.q[0, :2, 1]).max()))
    sink = [noise for noise, rate in slowest.items() if rate < 0]
    listed = "; ".join(f"{n}, {fastest[n]:.3f} to {slowest[n]:.3f} mm/s" for n in kinds)
    return Finding(
        Verdict.HOLDS_UNDER if sink else Verdict.REFUTED,
        f"dumbbells of 15° rise by up to {highest:.1f} mm; in the last 50 s of 200 s dumbbells of "
        f"±15° and 0 move along the drum under {listed}",
        {"highest": highest, "slowest": max(slowest.values())},
        "with noise strong enough that slippage outweighs the climb once the heading is small, "
        + which(sink, kinds),
    )


CLAIMS = (
    Claim(
        "O1",
        "3",
        "observation (i) on isolated dumbbells",
        "a dumbbell of small positive heading climbs, one of small negative heading descends",
        Means.SIMULATION,
        climbs_with_sign,
        partial(climbs_with_sign, -1),
        figure="single_history",
    ),
    Claim(
        "O2",
        "3",
        "observation (ii) on isolated dumbbells",
        "a dumbbell moves in zigzags: it is carried up and rolls back much faster",
        Means.SIMULATION,
        rolls_faster_than_carried,
        partial(rolls_faster_than_carried, 100.0),
        figure="single_history",
    ),
    Claim(
        "O3a",
        "3",
        "observation (iii) on isolated dumbbells",
        "headings of either sign tend to 0",
        Means.SIMULATION,
        heading_decays,
        partial(heading_decays, (QUIET,)),
        figure="single_history",
    ),
    Claim(
        "O3b",
        "3",
        "observation (iii) on isolated dumbbells",
        "headings change in the rolling arms of the zigzag",
        Means.SIMULATION,
        heading_falls_while_rolling,
        partial(heading_falls_while_rolling, 0.95),
    ),
    Claim(
        "O3c",
        "3",
        "observation (iii) on isolated dumbbells",
        "zigzags are about 5° wide",
        Means.SIMULATION,
        width_is,
        partial(width_is, rolling=0.09),
    ),
    Claim(
        "O3d",
        "3",
        "observation (iii) on isolated dumbbells",
        "zigzags are about 5° wide while their heading decays within minutes",
        Means.SIMULATION,
        width_and_decay,
        partial(width_and_decay, least=1.1),
    ),
    Claim(
        "O4",
        "3",
        "observation (iv) on isolated dumbbells",
        "a dumbbell of heading 0 descends by slippage and keeps its heading",
        Means.SIMULATION,
        level_heading_slips_down,
        partial(level_heading_slips_down, (QUIET,)),
    ),
    Claim(
        "O9",
        "3",
        "after the observations on isolated dumbbells",
        "dumbbells of any heading below 20° end at the bottom",
        Means.SIMULATION,
        all_descend_in_the_end,
        partial(all_descend_in_the_end, (NOISY._replace(strength=0.1),)),
    ),
)
