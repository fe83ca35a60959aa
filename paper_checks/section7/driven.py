"""Simulations of pairs of dumbbells in the drum, computed once and shared between checks."""

import math
from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np

from paper_checks.appendixA.torque import DRUM
from polycorner.dumbbells.dynamics.dyads import DyadPaths, follow_dyads, follow_pairs
from polycorner.dumbbells.pair import Chirality
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate
from polycorner.motion.trajectory import Trajectory

Kind = Literal["end_to_end", "side_by_side"]
Starts = tuple[tuple[Chirality, float], ...]  # chirality and heading, in degrees
TWO = replace(DRUM, count=2)
LASTING, LATE = 300.0, 150.0  # s, duration of runs for steady headings, and start of the averages
CLEARANCE = 0.05  # mm, between the dumbbells at the start
APART = 1e4  # mm along the drum, between pairs that are to stay apart


def dyads(
    starts: Starts,
    duration: float,
    *,
    chatter: float = 0.0,
    tilt: float = 7.0,
    length: float = 16.0,
    spin: float = 0.01,
) -> DyadPaths:
    """Simulate nested pairs from the lowest line; angles in degrees."""
    return _dyads(starts, duration, chatter, tilt, length, spin)


@cache
def _dyads(
    starts: Starts, duration: float, chatter: float, tilt: float, length: float, spin: float
) -> DyadPaths:
    drum = replace(DRUM, tilt=math.radians(tilt), length=length, spin=spin)
    angles = [(hand, math.radians(degrees)) for hand, degrees in starts]
    return follow_dyads(drum, angles, duration, noise=Noise(chatter=chatter, seed=3))


@cache
def pairs(
    kind: Kind, count: int, duration: float, *, chatter: float = 0.0, tilt: float = 7.0
) -> DyadPaths:
    """Simulate ``count`` pairs that are not nested, on the lowest line, with independent noise."""
    two = replace(TWO, tilt=math.radians(tilt))
    start = {
        "end_to_end": two.pair.end_to_end(gap=CLEARANCE),
        "side_by_side": two.pair.side_by_side(clearance=CLEARANCE),
    }[kind].reshape(2, 3)
    places = np.tile(start, (count, 1))
    places[:, 1] += APART * np.repeat(np.arange(count), 2)
    return follow_pairs(two, places, duration, noise=Noise(chatter=chatter, seed=3))


@cache
def one_dyad(
    hand: Chirality,
    heading: float,
    duration: float,
    *,
    chatter: float = 0.0,
    rubbing: float = 0.3,
    height: float = 0.0,
    top: float = math.inf,
) -> Trajectory:
    """Simulate a nested pair with its events; ``height`` above a bottom, if there is a top."""
    closed = math.isfinite(top)
    drum = replace(TWO, rubbing=(rubbing, rubbing), floor=closed, top=top)
    angle = math.radians(heading)
    q = drum.pair.nested(hand, heading=angle, clearance=CLEARANCE).reshape(2, 3)
    q[:, 1] += height
    noise = Noise(chatter=chatter, seed=2)
    dt = 2e-3 if closed else 1e-3
    return simulate(drum, drum.state(q), duration, dt, every=10, noise=noise)
