"""Section 3.2: the zigzag of a dyad and its heading.

The model is that of :mod:`paper_checks.section3.singles`; the coefficient of friction between
dumbbells that touch is 0.3.
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from paper_checks.appendixA.forces import STATIC, frame, is_zero, judged, tex
from paper_checks.appendixA.torque import DRUM
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section7.driven import one_dyad
from polycorner.dumbbells.dynamics.singles import onset_azimuths
from polycorner.dumbbells.statics.keel import RestRegion
from polycorner.motion import EventKind, Trajectory
from polycorner.toolkit import Array


def highest(path: Trajectory) -> float:
    """Return the largest mean azimuth of both dumbbells, in degrees."""
    return float(np.degrees(path.q[:, :, 0].mean(axis=1)).max())


def carried_higher(rubbing: float = 0.3, heading: float = 8.0) -> Finding:
    """Compare the azimuths to which a dyad and a single dumbbell are carried, without noise."""
    single = float(np.degrees(onset_azimuths(DRUM, [math.radians(heading)]))[0])
    dyad = highest(one_dyad("R", heading, 60.0, rubbing=rubbing))
    more = {mu: highest(one_dyad("R", heading, 60.0, rubbing=mu)) - single for mu in (0.0, 1.0)}
    return Finding(
        Verdict.HOLDS_UNDER if dyad > single + 0.05 else Verdict.REFUTED,
        f"of heading {heading:g}° a single dumbbell is carried to {single:.2f}°, a dyad whose "
        f"members rub with {rubbing:g} to {dyad:.2f}°; without rubbing it is {more[0.0]:.2f}° "
        f"higher than a single one, with a coefficient of 1 {more[1.0]:.2f}°",
        {"single": single, "dyad": dyad},
        "dumbbells that touch rub; the difference is small in the model",
    )


def carried_as_far_as_quoted(rolling: float = 0.2, heading: float = 8.0) -> Finding:
    """Compare a dyad with a dumbbell of the coefficient of rolling given in the caption."""
    region = RestRegion(DRUM.tilt, rolling, STATIC[1])
    quoted = math.degrees(region.eastern_boundary(math.radians(heading)))
    dyad = highest(one_dyad("R", heading, 60.0))
    return Finding(
        judged(abs(dyad - quoted) < 0.5),
        f"with $\\mu_r = {rolling:g}$ a dumbbell of heading {heading:g}° would be carried to "
        f"{quoted:.2f}°; the model's dyad is carried to {dyad:.2f}°",
        {"quoted": quoted, "dyad": dyad},
        "friction between the two, with the coefficient of their friction on the drum, does not "
        "double the resistance to rolling",
    )


def first_to_move(path: Trajectory) -> dict[str, int]:
    """Count the starts from rest by which of the pair moves: the lower, the upper, or both."""
    counts = {"lower": 0, "upper": 0, "both": 0}
    rest = {0: True, 1: True}
    begins: dict[float, list[tuple[int, bool]]] = {}
    for event in path.events:
        if event.kind in (EventKind.MOTION, EventKind.REST):
            stops = event.kind == EventKind.REST
            begins.setdefault(round(event.time, 4), []).append((event.bodies[0], stops))
    for time, group in sorted(begins.items()):
        moved = {body for body, stops in group if not stops}
        if all(rest.values()) and moved:
            lower = int(np.argmin(path.q[path.at(time), :, 0]))
            both = len(moved) == 2
            counts["both" if both else "lower" if lower in moved else "upper"] += 1
        rest |= dict(group)
    return counts


def first_is(who: str = "lower", chatters: Sequence[float] = (0.0, 0.1)) -> Finding:
    """Check that in most starts of a dyad, with little noise, one of them moves first."""
    found = {a: first_to_move(one_dyad("R", 8.0, 60.0, chatter=a)) for a in chatters}
    share = sum(c[who] for c in found.values()) / sum(sum(c.values()) for c in found.values())
    listed = "; ".join(
        f"A = {a:g}: " + ", ".join(f"{k} {n}" for k, n in c.items()) for a, c in found.items()
    )
    return Finding(
        judged(share > 0.5),
        f"first to start from rest, in 60 s: {listed}",
        {"share": share},
        "in the model the upper one presses on the lower, and both start together",
    )


def rolls_at_angle_to(line: str = "meridian") -> Finding:
    """Check that the direction of rolling makes the angle ``theta`` with meridian or latitude."""
    import sympy

    theta = frame()[0]["theta"]
    rolling = sympy.Matrix([-sympy.cos(theta), sympy.sin(theta)])
    along = {"meridian": sympy.Matrix([0, 1]), "latitude": sympy.Matrix([-1, 0])}
    cosines = {name: rolling.dot(v) for name, v in along.items()}
    holds = is_zero(cosines[line] - sympy.cos(theta))
    right = is_zero(cosines["latitude"] - sympy.cos(theta))
    return Finding(
        judged(holds, Verdict.CORRECTED if right else Verdict.REFUTED),
        "the direction of rolling, across the axis, makes an angle with cosine "
        f"{tex(cosines['meridian'])} with the meridian and {tex(cosines['latitude'])} with the "
        "latitude",
        correction="it rolls at the angle $\\theta$ to the latitudes; it is its axis that is at "
        "the angle $\\theta$ to the meridians",
    )


def mean_heading_is_defined(mean: str = "average") -> Finding:
    """Check whether a mean of two headings is unchanged, modulo pi, if one is turned by pi."""
    rng = np.random.default_rng(4)
    pairs_of = rng.uniform(-0.5, 0.5, (100, 2))

    def value(angles: Array) -> Array:
        if mean == "average":
            return np.asarray(angles.mean(axis=-1))
        return np.asarray(np.angle(np.exp(2j * angles).sum(axis=-1)) / 2)

    turned = value(pairs_of + np.array([0.0, math.pi])) - value(pairs_of)
    apart = np.abs(np.angle(np.exp(2j * turned))) / 2
    doubled = np.angle(np.exp(2j * pairs_of).sum(axis=-1)) / 2 - pairs_of.mean(axis=-1)
    right = bool(np.abs(doubled).max() < 1e-12)
    holds = bool(apart.max() < 1e-9)
    return Finding(
        judged(holds, Verdict.CORRECTED if right else Verdict.REFUTED),
        "adding $\\pi$ to one of the two headings changes the mean by up to "
        f"{math.degrees(apart.max()):.1f}°, modulo 180°",
        {"change": math.degrees(float(apart.max()))},
        "the average of two headings is defined modulo $\\pi/2$ only: take representatives within "
        "$\\pi/2$ of each other, or half the argument of $e^{2i\\theta_1} + e^{2i\\theta_2}$",
    )


CLAIMS = (
    Claim(
        "B5a",
        "3",
        "observation (v) on a bunch",
        "a dyad is carried higher than a single dumbbell, because touching dumbbells roll less "
        "easily",
        Means.SIMULATION,
        carried_higher,
        partial(carried_higher, 0.0),
    ),
    Claim(
        "B5b",
        "3",
        "observation (v) on a bunch, against the caption of measured turning points",
        "it is carried as far as with twice the resistance to rolling",
        Means.SIMULATION,
        carried_as_far_as_quoted,
        partial(carried_as_far_as_quoted, 0.103),
    ),
    Claim(
        "B8a",
        "3",
        "observation (v) on a bunch",
        "the lower dumbbell of a dyad rolls off first and the upper one follows",
        Means.SIMULATION,
        first_is,
        partial(first_is, "both"),
    ),
    Claim(
        "B8b",
        "3",
        "observation (v) on a bunch",
        "a dumbbell of heading $\\theta$ rolls along a geodesic at the angle $\\theta$ to the "
        "meridians",
        Means.SYMBOLIC,
        rolls_at_angle_to,
        partial(rolls_at_angle_to, "latitude"),
    ),
    Claim(
        "B9",
        "3",
        "position and heading of a dyad",
        "the heading of a dyad is the average of its two headings, each defined modulo $\\pi$",
        Means.NUMERICAL,
        mean_heading_is_defined,
        partial(mean_heading_is_defined, "doubled angles"),
    ),
)
