"""Appendix A: turning points of zigzags, and rolling between them."""

import math
from collections.abc import Callable
from functools import cache, partial

import numpy as np

from paper_checks.appendixA.forces import STATIC, TILT, frame, judged
from paper_checks.appendixA.rest import DYNAMIC
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.singles import Zigzag, follow, keel_of, onset_azimuths, zigzags
from polycorner.dumbbells.statics.keel import RestRegion
from polycorner.toolkit import Array

DRUM = DumbbellDrum(sliding=(STATIC[1], DYNAMIC[1]), rolling=(STATIC[0], DYNAMIC[0]))
STEP = 1e-4  # rad, angle by which the drum is turned in one step
HEADINGS = (-25.0, -15.0, -5.0, 0.0, 5.0, 15.0, 25.0)


@cache
def turns() -> tuple[Zigzag, ...]:
    """Return zigzags of 40 s without noise, carried from the lowest line, at ``HEADINGS``."""
    return zigzags(follow(DRUM, np.radians(HEADINGS), 40.0), DRUM.spin)


def carried_until(boundary: str = "A") -> Finding:
    """Compare the azimuths of onset with a boundary: that of ``A`` or ``B``, or ``phi_s``."""
    theta = np.radians(HEADINGS)
    inner, outer = RestRegion(TILT, *DYNAMIC), RestRegion(TILT, *STATIC)
    claimed = {
        "A": onset_azimuths(DRUM, theta),
        "B": inner.eastern_boundary(theta),
        "phi_s": np.full_like(theta, outer.limit),
    }[boundary]
    apart = [np.abs(z.upper - c).max() for z, c in zip(turns(), claimed, strict=True)]
    worst, step = math.degrees(max(apart)), math.degrees(DRUM.spin * 1e-3)
    count = sum(len(z) for z in turns())
    return Finding(
        judged(worst < 1.01 * step),
        f"{count} onsets of headings {HEADINGS[0]:g}° to {HEADINGS[-1]:g}° lie within "
        f"{worst:.5f}° of the boundary; the drum turns {step:.5f}° in a step",
        {"worst": worst, "step": step},
    )


def stops_are_in(region: str = "B") -> Finding:
    """Check that a rolling dumbbell comes to rest in ``B``, or in ``A`` outside ``B``."""
    inner, outer = RestRegion(TILT, *DYNAMIC), RestRegion(TILT, *STATIC)
    inside, total, least = 0, 0, math.inf
    for zigzag in turns():
        margin = inner.margin(zigzag.lower, zigzag.heading)
        outside = outer.contains(zigzag.lower, zigzag.heading) & (margin < 0)
        inside += int((margin >= 0).sum() if region == "B" else outside.sum())
        total, least = total + len(zigzag), min(least, float(margin.min()))
    return Finding(
        judged(inside == total),
        f"{inside} of {total} stops are in the region; the force there is inside the limits of "
        f"$B$ by at least {least:.4f} of the load",
        {"inside": float(inside), "stops": float(total), "margin": least},
    )


def stops_on_entering(inertia: bool = False) -> Finding:
    """Compare stops with the edge of ``B``, or with the point where the energy gained is spent."""
    theta = np.radians(HEADINGS)
    turning = keel_of(DRUM).turning(theta)
    lower = np.array([z.lower.mean() for z in turns()])
    claimed = turning.coasting if inertia else turning.lower
    apart = np.degrees(np.abs(lower - claimed))
    beyond = np.degrees(turning.lower - lower)
    exact = float(np.degrees(np.abs(lower - turning.coasting)).max())
    holds = bool(apart.max() < 0.01)
    return Finding(
        judged(holds, Verdict.CORRECTED if exact < 0.01 else Verdict.REFUTED),
        f"stops are up to {apart.max():.3f}° from the claimed azimuth; they lie "
        f"{beyond.min():.2f}° to {beyond.max():.2f}° beyond the edge of $B$, and within "
        f"{exact:.4f}° of where the energy gained above the edge is used up",
        {"apart": float(apart.max()), "least": float(beyond.min()), "exact": exact},
        "inertia cannot be ignored: at the edge of $B$ rolling is fastest, and the stop is where "
        "the work of weight and rolling resistance since the onset is zero, about as far again",
    )


def rolls_across_its_axis(angle: float = 90.0) -> Finding:
    """Check the angle between axis and path on the drum, and that the path is straight there."""
    path = follow(DRUM, np.radians(HEADINGS), 40.0)
    across = DRUM.centre_radius * (path.q[:, :, 0] - DRUM.spin * path.times[:, None])
    along = path.q[:, :, 1] - path.q[0, :, 1]
    theta = np.radians(HEADINGS)
    whole = np.hypot(across[-1], along[-1])
    off = np.abs(across * np.sin(theta) + along * np.cos(theta)).max(axis=0) / whole
    turned = np.degrees(np.abs(path.q[:, :, 2] - theta).max())
    course = np.arctan2(across[-1], along[-1]) - theta
    found = np.degrees(np.abs(np.arcsin(np.abs(np.sin(course)))))
    holds = bool(np.abs(found - angle).max() < 1e-3) and off.max() < 1e-5
    return Finding(
        judged(holds),
        f"over {len(theta)} zigzags the course on the drum makes {found.min():.4f}° to "
        f"{found.max():.4f}° with the axis; it leaves a straight line by {off.max():.1e} of its "
        f"length and the heading by {turned:.1e}°",
        {"least": float(found.min()), "off": float(off.max()), "turned": float(turned)},
    )


def measured_points() -> Finding:
    return Finding(
        Verdict.NOT_TESTABLE,
        "the measured points are in a figure only, and the dynamic coefficients that bound $B$ "
        "are not given; in the model onsets lie on the boundary of $A$ and stops in $B$",
    )


def carried_to(theta: Array) -> Array:
    """Return the azimuth of onset, by small turns of the drum from the middle of the region."""
    symbols, (east, north, normal) = frame()
    import sympy

    slopes = sympy.lambdify((symbols["phi"], symbols["alpha"]), (east / normal, north / normal))
    mu_r, mu_s = STATIC
    phi = np.array(sum(RestRegion(TILT, *STATIC).azimuths(theta)) / 2)
    moving = np.zeros(phi.shape, dtype=bool)
    while not moving.all():
        phi += np.where(moving, 0.0, STEP)
        a, b = slopes(phi, TILT)
        across = np.abs(-a * np.cos(theta) + b * np.sin(theta))
        moving |= (across > mu_r) | (np.hypot(a, b) > mu_s)
    return phi


def constant_limit(theta: Array) -> Array:
    return np.full_like(theta, RestRegion(TILT, *STATIC).limit)


def eastern_boundary(theta: Array) -> Array:
    return np.asarray(RestRegion(TILT, *STATIC).eastern_boundary(theta))


def turning_is(azimuth: Callable[[Array], Array] = constant_limit) -> Finding:
    """Compare with the azimuths to which the drum carries headings up to 20 degrees."""
    theta = np.radians(np.linspace(-20, 20, 9))
    found, claimed, limit = (f(theta) for f in (carried_to, azimuth, constant_limit))
    right = np.abs(found - eastern_boundary(theta)).max() <= STEP
    holds = bool(np.abs(found - claimed).max() <= STEP)
    east, stated = np.degrees(found), np.degrees(claimed)
    return Finding(
        judged(holds, Verdict.CORRECTED if right else Verdict.REFUTED),
        f"carried dumbbells with headings up to 20° start between {east[0]:.2f}° and "
        f"{east[-1]:.2f}°, claimed {stated[0]:.2f}° to {stated[-1]:.2f}°; $\\varphi_s = "
        f"{np.degrees(limit[0]):.2f}°$ bounds them all",
        {"least": float(east[0]), "largest": float(east[-1]), "limit": float(np.degrees(limit[0]))},
        "give the measured azimuth of the figure another name: it is the eastern boundary of $A$ "
        "at that heading, while $\\varphi_s$ of the text is one number, larger than all of them",
    )


CLAIMS = (
    Claim(
        "F4b",
        "A",
        "caption of the figure of measured turning points",
        "the measured azimuth $\\varphi_s$ at which carried dumbbells start, plotted against the "
        "heading, is the constant $\\varphi_s$ of the text",
        Means.NUMERICAL,
        turning_is,
        partial(turning_is, eastern_boundary),
        figure="rest_regions",
    ),
    Claim(
        "F13a",
        "A",
        "turning points of zigzags",
        "carried dumbbells begin to move on the eastern boundary of $A$",
        Means.SIMULATION,
        carried_until,
        partial(carried_until, "phi_s"),
        figure="rest_regions",
    ),
    Claim(
        "F13b",
        "A",
        "turning points of zigzags",
        "rolling dumbbells come to rest in $B$",
        Means.SIMULATION,
        stops_are_in,
        partial(stops_are_in, "A without B"),
        figure="rest_regions",
    ),
    Claim(
        "F13c",
        "A",
        "law by which a rolling dumbbell halts",
        "inertia ignored, a rolling dumbbell halts where $|f_T|/|f_N| < "
        "\\mu_r^{dyn}/\\cos\\vartheta$",
        Means.SIMULATION,
        stops_on_entering,
        partial(stops_on_entering, inertia=True),
    ),
    Claim(
        "F13d",
        "A",
        "figure of measured turning points",
        "the measured points lie on the eastern boundary of $A$ and in $B$",
        Means.SIMULATION,
        measured_points,
        None,
        figure="rest_regions",
    ),
    Claim(
        "F14",
        "A",
        "law of the onset of motion",
        "it rolls along a geodesic of the drum, at right angles to its axis",
        Means.SIMULATION,
        rolls_across_its_axis,
        partial(rolls_across_its_axis, 80.0),
    ),
)
