"""The rate at which pairs turn under one kind of noise, as a function of their heading."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from polycorner.dumbbells.studies.driven import TURN, disturbed
from polycorner.toolkit import LONGEST, checked, choice, real

PAIRS = 6  # and as many single dumbbells
PARTS = {"all": ("phi", "eta", "theta"), "rolling": ("phi",), "sliding": ("eta", "theta")}


@checked
def turning(
    heading: float,
    kind: str,
    strength: float,
    scale: float,
    *,
    rng: np.random.Generator,
    hand: str = "right",
    part: str = "all",
    length: float = 16.0,
    tilt: float = 7.0,
    spin: float = 0.01,
    restitution: float = 0.0,
    duration: float = 30.0,
    after: float = 10.0,
    dt: float = 0.0005,
) -> dict[str, Any]:
    """Return how fast pairs of one heading turn: the slow equation of the heading.

    Six nested pairs of one hand, and six single dumbbells, start at the same heading.  The first
    seconds, in which the drum carries them up from the lowest line, are left out.

    Parameters
    ----------
    heading : float
        At the start, in degrees; of left-handed pairs, its negative.
    kind, strength, scale, rng, length, tilt, spin, restitution, dt
        As for :func:`~polycorner.dumbbells.studies.driven.driven`.
    hand : {"right", "left"}
    part : {"all", "rolling", "sliding"}
        Which of the kicks there are: all, those around the drum alone, which make dumbbells roll,
        or those along it and on headings alone.
    duration, after : float
        The time, and what is left out of it, in s.

    Returns
    -------
    dict
        ``rate`` in degrees/s with the standard ``rate_error`` over the pairs, positive away from
        zero; ``at``, the mean heading; ``single``, the relative rate of the headings of the single
        dumbbells in 1/s, and ``weight``, in degrees/s, the rate at which the weight would turn a
        pair if its slips had the same mobility
        (:func:`~polycorner.dumbbells.dynamics.dyads.return_ratio`); ``impacts``, the rate that
        impacts of the power that was dissipated would give, each as a single one in a plane
        (:func:`~polycorner.dumbbells.dynamics.dyads.turn_by_impact`); ``power`` of the impacts in
        nJ/s per pair; ``azimuth`` in degrees; ``pressing``, the mean force of the dumbbells on each
        other over the weight of a ball, by the closed form.
    """
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics import dyads
    from polycorner.dumbbells.dynamics.dyads import (
        DyadPaths,
        Start,
        follow_pairs,
        heading_at_shift,
        nested_places,
    )
    from polycorner.dumbbells.dynamics.singles import APART, Mean

    choice("hand", hand, ("right", "left"))
    kept = PARTS[choice("part", part, tuple(PARTS))]
    real("heading", heading, least=-TURN, most=TURN, unit="deg")
    real("after", after, least=0, most=LONGEST, unit="s")
    real("duration", duration, above=after, most=LONGEST, unit="s, more than is left out after")
    sign = 1.0 if hand == "right" else -1.0
    plain = DumbbellDrum(length, tilt=math.radians(tilt), spin=spin, restitution=restitution)
    drum, noise = disturbed(plain, kind, strength, scale, int(rng.integers(2**63)))
    noise = replace(noise, kicks={n: x for n, x in noise.kicks.items() if n in kept})
    start: Start = ("R" if hand == "right" else "L", sign * math.radians(heading))
    alone = np.zeros((PAIRS, 3))
    alone[:, 1:] = np.stack([-APART * np.arange(1, PAIRS + 1), np.full(PAIRS, start[1])], axis=1)
    places = np.concatenate([alone, nested_places(plain, [start] * PAIRS)])
    path = follow_pairs(drum, places, duration, noise=noise, dt=dt).trajectory
    paths = DyadPaths(path, PAIRS)
    late = paths.times >= after
    angle, time = np.degrees(sign * paths.heading[late]), paths.times[late]
    single = np.degrees(sign * path.q[late][:, :PAIRS, 2])
    rates, others = (np.polynomial.polynomial.polyfit(time, x, 1)[1] for x in (angle, single))
    lost = path.dissipated["impact"][late]
    power = float(lost[-1] - lost[0]) / (time[-1] - time[0]) / PAIRS
    one = dyads.turn_by_impact(plain, 2.0)
    mean, slips = Mean.of(rates), Mean.of(others / single.mean(axis=0))
    least = heading_at_shift(plain, dyads.offsets(plain)[1])
    away = math.degrees(math.sin(2 * math.radians(float(angle.mean()) - least)) / 2)
    return {
        "rate": (mean.value, "deg/s"),
        "rate_error": (mean.error, "deg/s"),
        "at": (float(angle.mean()), "deg"),
        "single": (slips.value, "1/s"),
        "single_error": (slips.error, "1/s"),
        "weight": (slips.value * dyads.return_ratio(plain) * away, "deg/s"),
        "impacts": (math.degrees(one.turn) * power / one.dissipated, "deg/s"),
        "power": (power, "nJ/s"),
        "azimuth": (float(np.degrees(paths.azimuth[late]).mean()), "deg"),
        "pressing": (dyads.pressing(plain, float(angle.mean())), "1"),
    }
