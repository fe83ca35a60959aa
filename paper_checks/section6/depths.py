"""Sections 3 and 6: how deep a dyad lies, over which passes it is left, and what noise opens it."""

import math
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.framework.disturbances import HELD, Disturbance
from paper_checks.section6.experiment import EXPERIMENT
from polycorner.dumbbells import (
    DumbbellDrum,
    DumbbellPair,
    PairLandscape,
    RelativePlacements,
    pair_landscape,
)
from polycorner.dumbbells.dynamics.dyads import Start, follow_dyads
from polycorner.dumbbells.pair import Chirality
from polycorner.dumbbells.statics.depths import Level
from polycorner.dumbbells.statics.wells import GRAVITY

KICKS = 30.0  # mm/s per sqrt(s), which bring right-handed dyads to the heading that is quoted
DURATION = 30.0  # s
ANGLES = (6.0, 8.0, 10.0, 12.0, 14.0)  # degrees, of right-handed pairs; mirrored for left-handed
STEP = 1e-3  # s
DRUM = DumbbellDrum(EXPERIMENT.length, tilt=math.radians(7.0))

landscape_of = cache(pair_landscape)


@dataclass(frozen=True)
class Strength:
    """What it takes to open a dyad, friction left aside.

    Attributes
    ----------
    depth, error : float
        In mm, times the weight of a ball; by how much both bounds differ.
    way : float
        In mm, by which one dumbbell moves against the other up to the pass.
    speed : float
        In mm/s, with which one dumbbell has that energy.
    acceleration : float
        In mm/s^2, of one dumbbell while the other is held, that does this work on the way.
    time : float
        In s, until kicks give the motion of one dumbbell against the other this energy: half of
        ``6 sigma^2`` per second and mass of a ball.
    kicks : float
        ``(g h)^(1/4) (mu g)^(1/2)`` for the depth ``h`` and the dynamic coefficient of rolling.
    """

    depth: float
    error: float
    way: float
    speed: float
    acceleration: float
    time: float
    kicks: float


def strength_of(found: PairLandscape, kicks: float = KICKS) -> Strength:
    """Return the strength of a dyad's hold."""
    if found.depth is None or found.pair.is_plane:
        msg = "found: expected the landscape of a pair in a drum with dyads"
        raise ValueError(msg)
    landscape, lowest = found.landscape, found.passes[0].numbers[0]
    start = next(
        s.minimum for s in landscape.passes[lowest].sides if found.names[s.minimum or 0] != "G"
    )
    top, rest = landscape.passes[lowest].point, landscape.minima[start or 0].point
    across, along = (top - rest)[:2] * (2 * found.pair.centre_radius, 1)
    way, (depth, high) = math.hypot(across, along), found.depth
    energy = GRAVITY * depth  # per mass of a ball
    return Strength(
        depth,
        high - depth,
        way,
        speed=math.sqrt(energy),
        acceleration=energy / (2 * way),
        time=energy / (3 * kicks**2),
        kicks=energy**0.25 * math.sqrt(DRUM.rolling[1] * GRAVITY),
    )


@cache
def held(kicks: float, friction: float = 1.0, rod: float = EXPERIMENT.rod_radius) -> int:
    """Simulate five dyads of either hand, and return how many hold together.

    ``friction`` multiplies all coefficients and the tilt.
    """
    drum = DumbbellDrum(
        EXPERIMENT.length,
        rod_radius=rod,
        tilt=friction * DRUM.tilt,
        sliding=scaled(DRUM.sliding, friction),
        rolling=scaled(DRUM.rolling, friction),
        rubbing=scaled(DRUM.rubbing, friction),
    )
    drum, noise = Disturbance("kicks", kicks, HELD).acting_on(drum, 1)
    hands: list[tuple[Chirality, int]] = [("R", 1), ("L", -1)]
    starts: list[Start] = [(hand, sign * math.radians(a)) for hand, sign in hands for a in ANGLES]
    path = follow_dyads(drum, starts, DURATION, noise=noise, dt=STEP)
    return int(np.isinf(path.lifetimes).sum())


def scaled(pair: tuple[float, float], factor: float) -> tuple[float, float]:
    """Return both coefficients times a factor."""
    return pair[0] * factor, pair[1] * factor


def noise_leaves_dyads(kicks: float = KICKS, pair: DumbbellPair = EXPERIMENT) -> Finding:
    """Prove how deep a dyad lies, and simulate ten of them under kicks, also with less friction."""
    found = landscape_of(pair)
    if not found.landscape.complete:
        return Finding(Verdict.NOT_TESTABLE, found.landscape.statement)
    one, noise = strength_of(found), Disturbance("kicks", kicks, HELD)
    whole, bare = held(kicks), held(kicks, 0.1)
    count = 2 * len(ANGLES)
    holds = whole >= count - 1
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"Proved: a dyad opens where it is lifted by {one.depth:.7f} mm times the weight of a ball "
        f"(both bounds agree to {one.error:.0e} mm), not below. With this "
        f"energy one dumbbell moves at {one.speed:.1f} mm/s, and on the {one.way:.2f} mm to the "
        f"pass {one.acceleration:.0f} mm/s² do this work, {one.acceleration / GRAVITY:.4f} of "
        f"gravity. Simulated for {DURATION:g} s, tilted by 7°, under {noise}: {whole} of {count} "
        f"dyads hold together; with a tenth of the friction, {bare}.",
        {"depth": one.depth, "speed": one.speed, "acceleration": one.acceleration,
         "held": float(whole), "held_with_less_friction": float(bare)},
        "By its depth the hold is weak: without friction such kicks would bring the energy in "
        f"{one.time:.2f} s. It is friction with the drum that keeps dyads together under noise "
        "that acts on each dumbbell by itself, up to kicks of about $(gh)^{1/4}(\\mu_r g)^{1/2}$ = "
        f"{one.kicks:.0f} mm/s per $\\sqrt{{\\mathrm{{s}}}}$. Accelerations of the whole drum are "
        "another gravity, which scales the landscape and opens nothing."
        if holds
        else "",
    )  # fmt: skip


def not_chiral_is_unstable(rests: bool = False, pair: DumbbellPair = EXPERIMENT) -> Finding:
    """Find the pair side by side among the passes, with what lies on both sides of it."""
    found = landscape_of(pair)
    if not found.landscape.complete:
        return Finding(Verdict.NOT_TESTABLE, found.landscape.statement)
    beside = {
        level.name: level
        for level in (*found.minima, *found.passes)
        if len(level.contacts) == 2
        and pair.chirality(RelativePlacements(pair).placement(point_of(found, level))) is None
    }
    level = beside.get("delta_L - delta_R")
    holds = (level is None) == rests and len(beside) == 1
    at = level.height[0] if level else math.nan
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"Proved: two dumbbells side by side are a pass, of index 1, {at:.7f} mm times the weight "
        "of a ball above $G$, and of the minima and passes up to a tenth above it no others have "
        "two contacts and no hand. On one side the energy falls to a right-handed dyad, on the "
        "other to a left-handed one; no lower way from hand to hand avoids $G$.",
        {"height": at},
    )


def point_of(found: PairLandscape, level: Level) -> np.ndarray:
    """Return the first point of a level."""
    every = found.landscape.passes if level in found.passes else found.landscape.minima
    return every[level.numbers[0]].point


def opens_before_it_turns(times: float = 1.0, pair: DumbbellPair = EXPERIMENT) -> Finding:
    """Compare the passes from hand to hand with those at which dyads open."""
    found = landscape_of(pair)
    if not found.landscape.complete or found.depth is None or found.turnover is None:
        return Finding(Verdict.NOT_TESTABLE, found.landscape.statement)
    (low, high), (least, most) = found.depth, found.turnover
    return Finding(
        Verdict.HOLDS if least > times * high else Verdict.REFUTED,
        f"Proved: a dyad opens {low:.7f} mm times the weight of a ball above $\\delta$, and goes "
        f"over to the other hand without opening {most:.7f} mm above it, {most / low:.2f} times as "
        "high. In the plane the ratio is $1 + r^2/(r^2 - E_\\delta)$, more than 2 for all sizes.",
        {"depth": low, "turnover": most, "ratio": most / low},
    )


CLAIMS = (
    Claim(
        "E11",
        "6",
        "last paragraph before the figures",
        "If noise and spin are small enough dyads survive them, which shows how strong the "
        "entrapment is.",
        Means.SIMULATION,
        noise_leaves_dyads,
        partial(noise_leaves_dyads, kicks=160.0),
        slow=True,
        figure="passes",
    ),
    Claim(
        "E12",
        "6",
        "on section 3.2, item (iii), and the pair NC of the figure there",
        "A pair that is not nested and its own mirror image is unstable.",
        Means.PROOF,
        not_chiral_is_unstable,
        partial(not_chiral_is_unstable, rests=True),
        slow=True,
        figure="passes",
    ),
    Claim(
        "E13",
        "6",
        "on section 7.2",
        "Dyads keep their hand while they hold together, so that they can be sorted by it.",
        Means.PROOF,
        opens_before_it_turns,
        partial(opens_before_it_turns, times=5.0),
        slow=True,
        figure="passes",
    ),
)
