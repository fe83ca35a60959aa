"""Simulations of pairs of dumbbells in the drum, computed once and shared between checks."""

import math
from dataclasses import replace
from functools import cache
from typing import Literal, NamedTuple

import numpy as np

from paper_checks.appendixA.torque import DRUM
from paper_checks.framework.disturbances import ALONG, HELD, TEXT, Disturbance, Friction
from polycorner.dumbbells.dynamics.dyads import DyadPaths, follow_dyads, follow_pairs
from polycorner.dumbbells.pair import Chirality
from polycorner.motion import Noise, Trajectory, simulate

Kind = Literal["end_to_end", "side_by_side"]
Starts = tuple[tuple[Chirality, float], ...]  # chirality and heading, in degrees
TWO = replace(DRUM, count=2)
CLEARANCE = 0.05  # mm, between the dumbbells at the start
APART = 1e4  # mm along the drum, between pairs that are to stay apart


CHATTER = Disturbance("chatter", 0.4, 0.01)  # turns pairs within minutes
SHAKEN = Disturbance(ALONG, 600.0, 0.01)  # under which right-handed pairs climb
HARD = Disturbance(ALONG, 1500.0, 0.01)  # under which pairs of a level drum slip, too
KICKED = Disturbance("kicks", 30.0, HELD)
ACROSS = Disturbance("shaking across", 3000.0, 0.03)
UP = Disturbance("shaking up", 4000.0, 0.03)
KINDS: tuple[tuple[Disturbance, float], ...] = (
    (SHAKEN, 1600.0),
    (HARD, 200.0),
    (ACROSS, 200.0),
    (UP, 200.0),
    (KICKED, 400.0),
    (CHATTER, 300.0),
)  # those by which pairs are judged, and for how long they are kept up, in s
ANGLES = (-8.0, 2.0, 6.0, 10.0, 14.0)  # degrees, of right-handed pairs; mirrored for left-handed
ALL: Starts = (*(("R", a) for a in ANGLES), *(("L", -a) for a in ANGLES))


@cache
def disturbed_dyads(
    noise: Disturbance,
    duration: float,
    tilt: float = 7.0,
    length: float = 16.0,
    friction: Friction = TEXT,
) -> DyadPaths:
    """Simulate five right-handed and five left-handed nested pairs; angles in degrees."""
    drum = friction.of(replace(DRUM, tilt=math.radians(tilt), length=length))
    drum, kicks = noise.acting_on(drum, 1)
    starts = [(hand, math.radians(degrees)) for hand, degrees in ALL]
    dt = noise.step(2e-3, kicked=5e-4)
    return follow_dyads(drum, starts, duration, noise=kicks, dt=dt)


class Settled(NamedTuple):
    """Last quarter of a run of ten pairs: headings in degrees, in the order of the starts."""

    right: np.ndarray
    left: np.ndarray
    climb: float  # mm/s, of right-handed pairs, over the last half
    descent: float  # mm/s, the rate of left-handed ones, negative where they descend
    held: tuple[int, int]  # right- and left-handed pairs that held together
    opened: float  # mm, by which the shift of a right-handed pair differs from that at the start

    @property
    def spread(self) -> float:
        """The largest less the smallest heading of right-handed pairs."""
        return float(np.ptp(self.right))


def settled(
    noise: Disturbance,
    duration: float,
    tilt: float = 7.0,
    length: float = 16.0,
    friction: Friction = TEXT,
) -> Settled:
    """Return what noise makes of the ten pairs; those that came apart are left out of means."""
    paths, half = disturbed_dyads(noise, duration, tilt, length, friction), len(ANGLES)
    whole = np.isinf(paths.lifetimes)
    late = np.degrees(paths.heading[paths.times >= 0.75 * duration]).mean(axis=0)
    late[~whole] = np.nan
    changed = np.abs(paths.shift[-1] - paths.shift[0])[:half]
    rates = paths.climb_rates(after=duration / 2)
    return Settled(
        right=late[:half][whole[:half]],
        left=late[half:][whole[half:]],
        climb=_mean(rates[:half][whole[:half]]),
        descent=_mean(rates[half:][whole[half:]]),
        held=(int(whole[:half].sum()), int(whole[half:].sum())),
        opened=float(changed.max()),
    )


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else math.nan


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
    dt: float | None = None,
) -> Trajectory:
    """Simulate a nested pair with its events; ``height`` above a bottom, if there is a top.

    By default in steps of 1 ms, and of 2 ms if there is a top.
    """
    closed = math.isfinite(top)
    drum = replace(TWO, rubbing=(rubbing, rubbing), floor=closed, top=top)
    angle = math.radians(heading)
    q = drum.pair.nested(hand, heading=angle, clearance=CLEARANCE).reshape(2, 3)
    q[:, 1] += height
    noise = Noise(chatter=chatter, seed=2)
    step = dt or (2e-3 if closed else 1e-3)
    return simulate(drum, drum.state(q), duration, step, every=10, noise=noise)
