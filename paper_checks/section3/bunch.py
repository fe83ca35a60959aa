"""Section 3.2: a bunch of dumbbells at the bottom of the turning drum, as observed.

The model is that of :mod:`paper_checks.section3.singles`; the coefficient of friction between
dumbbells that touch is 0.3.  Bunches are simulated without noise, which would take several times
as long, except for the question how many leave.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial

import numpy as np

from paper_checks.appendixA.forces import judged
from paper_checks.appendixA.torque import DRUM
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.framework.disturbances import CAPTIONS, TEXT, Disturbance, Friction
from paper_checks.section7.driven import SHAKEN, one_dyad
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import (
    BunchRun,
    drum_for_bunch,
    exit_statistics,
    follow_bunch,
)
from polycorner.dumbbells.dynamics.dyads import handedness, minimiser_heading
from polycorner.dumbbells.dynamics.pairs import is_dyad
from polycorner.dumbbells.pair import Chirality
from polycorner.motion import EventKind, Noise, simulate
from polycorner.toolkit import Array

PICTURE = (8.0, 2.0, 0.5)  # l, r, t of the paper's picture of a bunch
LARGER = (16.0, 3.0, 1.5)  # l, r, t of its dyads
OBSERVED_TIME = 1200.0  # s, twenty minutes
LEAVING = (60, 40)  # number of dumbbells of the bunch, and of those that leave
TOP = 300.0  # mm; the paper does not give the length of its drum
QUIET = Disturbance("chatter", 0.0, 0.01)
SHORTEST = 150.0  # mm, a drum that hardly more than holds the bunch, in the check on leaving
STEPS = {QUIET: 4e-3, SHAKEN: 2e-3}  # s, in this check
STARTS = {(TEXT, QUIET): 2, (TEXT, SHAKEN): 1, (CAPTIONS, QUIET): 4}  # numbers of starts
APART = 1e4  # mm along the drum, between encounters


@cache
def bunch(
    sizes: tuple[float, float, float],
    duration: float,
    seed: int = 0,
    top: float = TOP,
    dt: float = 2e-3,
    noise: Disturbance = QUIET,
    friction: Friction = TEXT,
) -> BunchRun:
    """Simulate a bunch; ``sizes`` are ``l, r, t``."""
    length, r, t = sizes
    drum = friction.of(replace(DRUM, length=length, ball_radius=r, rod_radius=t))
    drum = drum_for_bunch(drum, count=LEAVING[0], top=top)
    drum, kicks = noise.acting_on(drum, seed)
    return follow_bunch(drum, duration, start=seed, noise=kicks, dt=dt)


def partitions(
    sizes: tuple[float, float, float] = LARGER, starts: int = 3, apart: bool = True
) -> Finding:
    """Check that, from 15 to 30 s, rollers are at smaller positive azimuths than sliders.

    A roller has turned by more than 30 degrees about its axis in 10 s; azimuths count as smaller
    if the difference is a degree or more in each start.  ``apart = False`` claims the opposite.
    """
    listed, found, lost = [], [], 0.0
    numbers: dict[str, float] = {}
    for seed in range(starts):
        followed = bunch(sizes, 30.0, seed)
        late = np.flatnonzero(followed.times >= 15.0)
        azimuths = np.degrees([followed.azimuths(int(i)) for i in late])
        count = float(np.mean([followed.rollers(int(i)).sum() for i in late]))
        rolls, slides = np.nanmean(azimuths[~np.isnan(azimuths[:, 0])], axis=0)
        found.append(0 < rolls < slides - 1.0)
        listed.append(f"{count:.1f} roll at {rolls:.1f}° and the others slide at {slides:.1f}°")
        numbers |= {f"rolling_{seed}": float(rolls), f"sliding_{seed}": float(slides)}
        lost = max(lost, followed.trajectory.missed)
    return Finding(
        Verdict.HOLDS_UNDER if all(found) == apart else Verdict.REFUTED,
        f"{LEAVING[0]} dumbbells of {sizes[0]:g} mm, no noise, means from 15 to 30 s in {starts} "
        f"start(s): {'; '.join(listed)}; {100 * lost:.0f} % of the groups in contact were not "
        "solved to the tolerance",
        numbers,
        "in half a minute without noise; most dumbbells are still carried up and slump together",
    )


def both_hands_form(least: int = 2, duration: float = 30.0) -> Finding:
    """Check that new right- and left-handed dyads form."""
    followed = bunch(LARGER, duration)
    first = {pair[:2] for pair in followed.dyads(0)}
    new = [pair for pair in followed.dyads(-1) if pair[:2] not in first]
    hands = {name: sum(1 for *_, h in new if h == sign) for name, sign in (("R", 1), ("L", -1))}
    return Finding(
        Verdict.HOLDS_UNDER if min(hands.values()) >= least else Verdict.REFUTED,
        f"after {duration:g} s a bunch of {LEAVING[0]} has {hands['R']} right-handed and "
        f"{hands['L']} left-handed nested pairs that were not there at the start",
        {"right": float(hands["R"]), "left": float(hands["L"])},
        f"{LEAVING[0]} dumbbells of {LARGER[0]:g} mm, one start, no noise",
    )


@cache
def encounters(count: int, duration: float, chatter: float) -> tuple[DumbbellDrum, Array]:
    """Simulate climbing dumbbells, each with one of heading about 0 above it, ``(T, n, 2, 4)``."""
    rng = np.random.default_rng(7)
    lower = np.stack(
        [rng.uniform(-6, 6, count), np.zeros(count), rng.uniform(6, 16, count)], axis=-1
    )
    upper = np.stack(
        [np.zeros(count), rng.uniform(22.1, 26, count), rng.uniform(-3, 3, count)], axis=-1
    )
    q = np.stack([lower, upper], axis=1)
    q[..., 1] += APART * np.arange(count)[:, None]
    q *= [1 / DRUM.centre_radius, 1.0, math.pi / 180]
    many = replace(DRUM, count=2 * count)
    noise = Noise(chatter=chatter, seed=9)
    path = simulate(many, many.state(q.reshape(-1, 3)), duration, 2e-3, every=500, noise=noise)
    return replace(DRUM, count=2), path.q.reshape(len(path), count, 2, 4)


def meetings_make_dyads(least: float = 0.1, count: int = 8, chatter: float = 0.3) -> Finding:
    """Let climbing dumbbells meet others of heading about 0 and count the dyads.

    Holds if a share ``least`` of the encounters are dyads at the end.
    """
    drum, q = encounters(count, 120.0, chatter)
    made = is_dyad(drum, q)
    hands = np.where(made[-1], handedness(drum, q[-1]), 0)
    right, left = int((hands == 1).sum()), int((hands == -1).sum())
    ever = int(made.any(axis=0).sum())
    return Finding(
        Verdict.HOLDS_UNDER if right + left >= least * count else Verdict.REFUTED,
        f"of {count} dumbbells that climb under another, {ever} form a dyad within 120 s and "
        f"{right + left} are one then, {right} right-handed and {left} left-handed",
        {"ever": float(ever), "right": float(right), "left": float(left)},
        "headings of 6° to 16° below others within 3° of 0, sideways up to 6 mm off, chatter A = "
        f"{chatter:g}",
    )


# ------------------------------------------------------------------------------------- who leaves


def leaves_at(end: str = "top", hand: Chirality = "R", duration: float = 150.0) -> Finding:
    """Simulate a dyad that starts half-way along a drum 60 mm long."""
    path = one_dyad(hand, 12.0 if hand == "R" else -12.0, duration, height=35.0, top=60.0)
    left = [event.time for event in path.of_kind(EventKind.EXIT)]
    low = float(path.q[-1, :, 1].mean())
    reached = len(left) == 2 if end == "top" else not left and low < 12.0
    times = ", ".join(f"{t:.0f} s" for t in left) if left else "never"
    return Finding(
        Verdict.HOLDS_UNDER if reached else Verdict.REFUTED,
        f"without noise, from 35 mm, a dyad {hand} leaves a drum 60 mm long at {times}; after "
        f"{duration:g} s its middle was last at {low:.1f} mm",
        {"left": float(len(left)), "height": low},
        "noise so small that slippage does not outweigh the climb; here none",
    )


def breaks_at_the_bottom(apart: bool = True, duration: float = 150.0) -> Finding:
    """Check whether a left-handed dyad that has reached the bottom is still a dyad.

    In steps of 1 ms, as in those of 0.5 and 0.25 ms, it is; in steps of 2 ms it may fall apart.
    """
    path = one_dyad("L", -12.0, duration, height=35.0, top=60.0, dt=1e-3)
    drum = replace(DRUM, count=2)
    still = bool(is_dyad(drum, path.q[-1])) and handedness(drum, path.q[-1]) == -1
    steep = float(np.degrees(path.q[-1, :, 2]).mean())
    touched = any(event.contact.startswith("floor") for event in path.events)
    return Finding(
        judged(touched and still != apart),
        f"{duration:g} s after a start at 35 mm the left-handed dyad "
        + ("touches" if touched else "does not touch")
        + " the bottom, has turned to a mean heading of "
        f"{steep:.0f}° and " + ("is still nested" if still else "is no longer nested"),
        {"heading": steep},
        "alone, a left-handed dyad turns until it lies on the bottom, still nested; collisions "
        "with others may break it up",
    )


def can_leave_in_time(length: float = TOP, observed: float = 15.0) -> Finding:
    """Compare the length of a drum with the climb of a dyad in twenty minutes, without slip.

    The heading is that of least energy, the paper's formula for it, or the one ``observed``.
    """
    least = minimiser_heading(replace(DRUM, count=2))
    formula = math.degrees(math.atan(DRUM.ball_radius / DRUM.length))
    full = OBSERVED_TIME * DRUM.spin * DRUM.centre_radius
    reach = {a: full * math.tan(math.radians(a)) for a in (least, formula, observed)}
    needed = math.degrees(math.atan(length / full))
    listed = ", ".join(f"at {a:.1f}° {way:.0f} mm" for a, way in reach.items())
    return Finding(
        Verdict.HOLDS_UNDER if length <= max(reach.values()) else Verdict.REFUTED,
        f"in twenty minutes a dyad climbs at most {listed}: the heading of least energy, that of "
        f"the paper's formula and the one observed; a drum of {length:g} mm needs {needed:.1f}°",
        {"reach": reach[observed], "least_reach": reach[least], "needed": needed},
        f"for the heading observed a drum shorter than {reach[observed]:.0f} mm, for that of least "
        f"energy one shorter than {reach[least]:.0f} mm; the length of the drum is not given",
    )


def of_sixty_leave(
    leaving: int = LEAVING[1],
    starts: Mapping[tuple[Friction, Disturbance], int] = STARTS,
    top: float = SHORTEST,
) -> Finding:
    """Simulate bunches for the twenty minutes of the observation, by friction and noise.

    Holds if the mean of one of these sets is ``leaving``, to within 10 or two standard errors, and
    most that leave do so in right-handed dyads.
    """
    listed: list[str] = []
    numbers: dict[str, float] = {}
    good = False
    for k, ((friction, noise), count) in enumerate(starts.items()):
        runs = [
            bunch(LARGER, OBSERVED_TIME, seed, top, STEPS[noise], noise, friction)
            for seed in range(count)
        ]
        found = exit_statistics(runs)
        left, by_right = found.total.value, found.by_kind["right"].value
        error = 0.0 if math.isnan(found.total.error) else found.total.error
        good |= abs(left - leaving) <= max(10.0, 2 * error) and by_right >= left / 2
        last = [one.census(-1) for one in runs]
        right, other = (float(np.mean([c[k] for c in last])) for k in ("right", "left"))
        listed.append(
            f"{friction}, {noise}, {count} start(s): {', '.join(str(len(r.exits)) for r in runs)} "
            f"left, of them {by_right * count:.0f} in right-handed dyads and "
            f"{found.by_kind['left'].value * count:.0f} in left-handed ones; at the end "
            f"{right:.1f} are in right-handed dyads and {other:.1f} in left-handed ones"
        )
        numbers |= {f"left_{k}": left, f"right_handed_{k}": by_right}
    return Finding(
        Verdict.HOLDS_UNDER if good else Verdict.REFUTED,
        f"{LEAVING[0]} dumbbells of {LARGER[0]:g} mm in a drum {top:g} mm long, "
        f"{OBSERVED_TIME:g} s: {'; '.join(listed)}",
        numbers,
        "with the sliding friction that the captions imply some starts lose a third of the bunch "
        "and others hardly anybody, in dyads of both hands and in none; with that of the text a "
        "bunch stays interlocked, also under noise that makes right-handed dyads that are alone "
        "climb. Dumbbells lie in one layer; the drum's length and the noise are not given",
    )


CLAIMS = (
    Claim(
        "B1a",
        "3",
        "observation (i) on a bunch",
        "a bunch separates into rollers at small, mostly positive azimuths and interlocked sliders "
        "at larger ones",
        Means.SIMULATION,
        partitions,
        partial(partitions, apart=False),
        slow=True,
    ),
    Claim(
        "B1b",
        "3",
        "observation (i) on a bunch, picture of the bunch",
        "bunches of dumbbells of 8 mm do so very soon after the start",
        Means.SIMULATION,
        partial(partitions, PICTURE, 1),
        partial(partitions, PICTURE, 1, apart=False),
        slow=True,
    ),
    Claim(
        "B2c",
        "3",
        "observation (iii) on a bunch",
        "dyads of both hands form in a bunch",
        Means.SIMULATION,
        both_hands_form,
        partial(both_hands_form, 1000),
        slow=True,
    ),
    Claim(
        "B10",
        "3",
        "observation (iii) on a bunch, formation of dyads in section 7",
        "climbing dumbbells that meet descending ones occasionally form dyads",
        Means.SIMULATION,
        meetings_make_dyads,
        partial(meetings_make_dyads, 1.1),
        slow=True,
    ),
    Claim(
        "B6a",
        "3",
        "observation (vi) on a bunch",
        "right-handed dyads climb to the top and fall out",
        Means.SIMULATION,
        leaves_at,
        partial(leaves_at, hand="L"),
    ),
    Claim(
        "B6b",
        "3",
        "observation (vi) on a bunch",
        "left-handed dyads go to the bottom",
        Means.SIMULATION,
        partial(leaves_at, "bottom", "L"),
        partial(leaves_at, "bottom"),
    ),
    Claim(
        "B6c",
        "3",
        "observation (vi) on a bunch",
        "at the bottom left-handed dyads break apart",
        Means.SIMULATION,
        breaks_at_the_bottom,
        partial(breaks_at_the_bottom, apart=False),
    ),
    Claim(
        "B7a",
        "3",
        "observation (vi) on a bunch",
        "right-handed dyads can climb the drum within twenty minutes",
        Means.NUMERICAL,
        can_leave_in_time,
        partial(can_leave_in_time, 500.0),
    ),
    Claim(
        "B7b",
        "3",
        "observation (vi) on a bunch",
        "of 60 dumbbells about 40 leave within twenty minutes, as right-handed dyads",
        Means.SIMULATION,
        of_sixty_leave,
        partial(of_sixty_leave, 0),
        slow=True,
    ),
)
