"""Appendix A: the torque on a dumbbell, and the surface it lies on."""

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from paper_checks.appendixA.forces import STATIC, TILT, does, frame, judged, tex
from paper_checks.appendixA.rest import DYNAMIC
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.singles import follow
from polycorner.dumbbells.statics.keel import RestRegion, net_torque, s_curve
from polycorner.toolkit import Array

DRUM = DumbbellDrum(sliding=(STATIC[1], DYNAMIC[1]), rolling=(STATIC[0], DYNAMIC[0]))


# ------------------------------------------------------------------------------------------ torque


@cache
def potential() -> tuple[Any, Any]:
    """Return symbols and the height of the two balls' mean, for balls on the wall of the drum.

    Azimuths of the balls are ``phi -+ asin(k sin(theta))``, ``k = l / (2 R)``.
    """
    import sympy

    phi, eta, theta, alpha, k = sympy.symbols("phi eta theta alpha k", real=True)
    away = sympy.asin(k * sympy.sin(theta))
    height = eta * sympy.sin(alpha)
    for e in (-1, 1):
        along = e * k * sympy.cos(theta) * sympy.sin(alpha)
        height += (along - sympy.cos(alpha) * sympy.cos(phi + e * away)) / 2
    return (phi, eta, theta, alpha, k), height


def torque_vanishes_at(stable: float = 0.0, unstable: float = 90.0, tilt: float = 0.0) -> Finding:
    """Check the weight's torque ``-dz/dtheta``: its zeros, its sign, and its slopes there."""
    import sympy

    (phi, _, theta, alpha, k), height = potential()
    torque = sympy.simplify(sympy.expand_trig(-height.diff(theta)))
    at = {phi: sympy.Rational(1, 10), k: sympy.Rational(1, 15), alpha: sympy.rad(tilt)}
    law = sympy.lambdify(theta, torque.subs(at))
    slope = sympy.lambdify(theta, torque.diff(theta).subs(at))
    zero = [abs(law(math.radians(angle))) < 1e-12 for angle in (stable, unstable)]
    signs = [slope(math.radians(angle)) for angle in (stable, unstable)]
    between = law(np.radians(np.arange(1.0, 90.0)))
    holds = all(zero) and signs[0] < 0 < signs[1] and bool((between < 0).all())
    return Finding(
        judged(holds),
        f"$-\\partial z/\\partial\\theta = $ {tex(torque)}; its slope is {signs[0]:.5f} at "
        f"{stable:g}° and {signs[1]:.5f} at {unstable:g}° (per $R$), and between 0 and 90° it is "
        f"at most {between.max():.1e}",
        {"stable_slope": float(signs[0]), "unstable_slope": float(signs[1])},
    )


def lower_ball_presses_more(sign: int = 1) -> Finding:
    """Compare the loads ``cos(alpha) cos(phi_i)`` of both balls, the lower one first."""
    import sympy

    symbols, (_, _, normal) = frame()
    load = sympy.lambdify(symbols["phi"], (normal / sympy.cos(symbols["alpha"])))
    phi = np.linspace(-1, 1, 41)[:, None]
    away = np.arcsin(np.sin(np.linspace(-1.5, 1.5, 40)) / 15)
    first, second = np.abs(phi - away), np.abs(phi + away)
    difference = load(np.minimum(first, second)) - load(np.maximum(first, second))
    holds = bool((sign * difference).min() >= -1e-15)
    return Finding(
        judged(holds),
        f"over {difference.size} placements the lower ball presses by {difference.min():.2e} to "
        f"{difference.max():.3f} of its weight more than the upper one",
        {"least": float(difference.min()), "largest": float(difference.max())},
    )


def torque_comes_from_friction(share: float = 1.0, headings: float = 20.0) -> Finding:
    """Check which share of the torque on a sliding dumbbell comes from unequal friction.

    Holds if it is at least ``share`` up to that heading, at azimuths where dumbbells can rest.
    """
    phi, theta = samples(0.0, headings)
    whole, weight = (net_torque(phi, theta, 0.0, mu) for mu in (STATIC[1], 0.0))
    found = float(np.max(np.abs((whole - weight) / whole)))
    return Finding(
        judged(found >= share, Verdict.CORRECTED),
        f"with $\\mu_s = {STATIC[1]:g}$ the difference in friction of the balls makes at most "
        f"{100 * found:.1f} % of the torque on a sliding dumbbell, for headings up to "
        f"{headings:g}°; the remainder is that of the weight, also without friction",
        {"share": found},
        "the torque is that of the weight along the wall, $-\\partial V/\\partial\\theta$; the "
        "unequal loads and the friction they cause add a few percent",
    )


def samples(tilt: float, headings: float, least: float = 0.5) -> tuple[Array, Array]:
    """Return azimuths at which dumbbells can rest and headings of both signs, in rad."""
    limit = RestRegion(tilt, *STATIC).limit
    angles = np.radians(np.linspace(least, headings, 40))
    return np.meshgrid(np.linspace(-limit, limit, 81), np.concatenate([-angles, angles]))


def tilting_changes_torque_by(bound: float = 0.1, headings: float = 20.0) -> Finding:
    """Check that tilting by 10 degrees changes the torque by at most a share ``bound``."""
    tilt = math.radians(10.0)
    phi, theta = samples(tilt, headings)
    level = net_torque(phi, theta, 0.0, STATIC[1])
    tilted = math.cos(tilt) * net_torque(phi, theta, tilt, STATIC[1])
    change = float(np.max(np.abs(tilted / level - 1)))
    keeps = bool((tilted * level > 0).all())
    return Finding(
        judged(keeps and change <= bound),
        f"tilting by 10° changes the torque on a sliding dumbbell by at most {100 * change:.1f} % "
        f"for headings up to {headings:g}° where dumbbells can rest, of which "
        f"{100 * (1 - math.cos(tilt)):.1f} % are the smaller weight; it "
        + ("keeps" if keeps else "does not keep")
        + " its sign",
        {"change": change},
    )


def beyond_the_curve(phi: Array, theta: Array) -> Array:
    """Return whether the heading is steeper than that of ``S``, with the same sign."""
    curve = s_curve(phi, TILT)
    return np.asarray((np.abs(theta) > np.abs(curve)) & (theta * curve > 0))


def thin_sliver(phi: Array, theta: Array) -> Array:
    """Return whether friction of the balls outweighs the weight, for a short sliding dumbbell."""
    phi, theta, outward = np.abs(phi), np.abs(theta), phi * theta > 0
    across = math.cos(TILT) * np.sin(phi)
    cosine = across * np.cos(theta) - math.sin(TILT) * np.sin(theta)
    cosine /= np.hypot(across, math.sin(TILT))
    return np.asarray(outward & (np.cos(theta) < -STATIC[1] * np.tan(phi) * cosine))


def torque_grows_in(region: Callable[[Array, Array], Array] = beyond_the_curve) -> Finding:
    """Compare a region with the one in which the torque, in sliding, has the heading's sign."""
    limit = RestRegion(TILT, *STATIC).limit
    phi, theta = np.meshgrid(
        np.linspace(-limit, limit, 240), np.radians(np.linspace(-89.99, 89.99, 3600))
    )
    grows = net_torque(phi, theta, TILT, STATIC[1]) * np.sign(theta) > 0
    claimed, right = region(phi, theta), thin_sliver(phi, theta)
    holds = bool((grows == claimed).all())
    steep = np.degrees(np.abs(theta[grows]).min())
    share = float((grows & claimed).sum() / claimed.sum())
    return Finding(
        judged(holds, Verdict.CORRECTED if (grows == right).all() else Verdict.REFUTED),
        f"within $\\varphi_s$ the torque increases $|\\theta|$ only above {steep:.1f}°, in "
        f"{100 * share:.1f} % of the claimed region",
        {"least_heading": float(steep), "share": share},
        "define the hatched region: for a sliding dumbbell $|\\theta|$ grows where $\\cos\\theta "
        "< -\\mu_s\\tan\\varphi\\cos\\vartheta$ (for $\\varphi, \\theta > 0$), a sliver beyond "
        "$S$ next to $\\pi/2$",
    )


def steep_headings_change(
    direction: int = 1,
    headings: tuple[float, ...] = (60.0, 65.0, 70.0, 75.0, 80.0, 85.0),
    room: float = 300.0,
) -> Finding:
    """Simulate dumbbells of these headings from the lowest line, without noise, for 30 s.

    Each is followed until it is ``room`` mm lower in the drum.  Holds if the heading of most has
    grown (``direction = 1``) or decreased (-1) by a degree.
    """
    path = follow(DRUM, np.radians(headings), 30.0, dt=2e-3)
    angles, fallen_by = np.abs(np.degrees(path.q[:, :, 2])), path.q[0, :, 1] - path.q[:, :, 1]
    out = fallen_by > room
    last = np.where(out.any(axis=0), out.argmax(axis=0), len(path) - 1)
    start, end = angles[0], angles[last, np.arange(len(headings))]
    largest = np.array([angles[: n + 1, k].max() for k, n in enumerate(last)])
    grown, fallen = int((end > start + 1).sum()), int((end < start - 1).sum())
    listed = ", ".join(f"{a:g}° to {b:.1f}°" for a, b in zip(start, end, strict=True))
    return Finding(
        judged((grown if direction > 0 else fallen) > len(headings) / 2),
        f"in 30 s, or until they are {room:g} mm lower, {grown} of {len(headings)} headings grow "
        f"and {fallen} decrease, from {listed}; the largest meanwhile is {largest.max():.1f}°; "
        f"{out.any(axis=0).sum()} of them would need a longer drum than that to turn further",
        {"grown": float(grown), "fallen": float(fallen), "largest": float(largest.max())},
        "in the model a steep dumbbell turns towards the meridian as it descends",
    )


def curvature_bound_is(curvature: str = "mean") -> Finding:
    """Check on catenoids whether a surface of small curvature is flat on the scale of a rod.

    ``curvature`` is ``mean``, or ``largest`` for the larger principal curvature in size.
    """
    import sympy

    u, v = sympy.symbols("u v", real=True)
    waist = sympy.Symbol("c", positive=True)
    radius = waist * sympy.cosh(v / waist)
    place = sympy.Matrix([radius * sympy.cos(u), radius * sympy.sin(u), v])
    first, second = place.diff(u), place.diff(v)
    normal = first.cross(second)
    length = sympy.sqrt(sympy.simplify(normal.dot(normal)))
    principal = [
        sympy.simplify((place.diff(s, 2).dot(normal) / length / leg.dot(leg)).subs({u: 0, v: 0}))
        for s, leg in ((u, first), (v, second))
    ]
    mean = sympy.simplify(sum(principal) / 2)
    largest = sympy.Abs(principal[0])
    chosen = {"mean": mean, "largest": largest}[curvature]
    holds = chosen != 0
    return Finding(
        judged(holds, Verdict.CORRECTED),
        f"at the waist $c$ of a catenoid the principal curvatures are {tex(principal[0])} and "
        f"{tex(principal[1])}, their mean is {tex(mean)}: a small {curvature} curvature "
        f"{does(holds)} make the surface flat on the scale of a rod",
        correction="the length has to be small against the least radius of normal curvature, "
        "$R$ in the drum (the reciprocal of the drum's mean curvature is $2R$)",
    )


CLAIMS = (
    Claim(
        "F11a",
        "A",
        "torque on a dumbbell in a level drum",
        "the torque drives the heading to 0; at $\\pm\\pi/2$ it vanishes and is repulsive",
        Means.SYMBOLIC,
        torque_vanishes_at,
        partial(torque_vanishes_at, stable=90.0, unstable=0.0),
        figure="torque",
    ),
    Claim(
        "F11b",
        "A",
        "torque on a dumbbell",
        "the lower ball presses harder on the drum",
        Means.NUMERICAL,
        lower_ball_presses_more,
        partial(lower_ball_presses_more, -1),
    ),
    Claim(
        "F11c",
        "A",
        "origin of the torque",
        "the torque originates from the unequal loads of the balls and their unequal friction",
        Means.NUMERICAL,
        torque_comes_from_friction,
        partial(torque_comes_from_friction, share=0.0),
    ),
    Claim(
        "F11d",
        "A",
        "torque in a tilted drum",
        "up to 10° the tilt changes the torque little at small headings",
        Means.NUMERICAL,
        tilting_changes_torque_by,
        partial(tilting_changes_torque_by, bound=0.01),
        figure="torque",
    ),
    Claim(
        "F12a",
        "A",
        "figure of the curve $S$, hatched region",
        "the torque increases $|\\theta|$ in a region at large $|\\theta|$, beyond the curve $S$",
        Means.NUMERICAL,
        torque_grows_in,
        partial(torque_grows_in, thin_sliver),
        figure="torque",
    ),
    Claim(
        "F12b",
        "A",
        "torque in a tilted drum",
        "large headings grow towards $\\pi/2$",
        Means.SIMULATION,
        steep_headings_change,
        partial(steep_headings_change, -1),
    ),
    Claim(
        "F15",
        "A",
        "assumption on the surface",
        "dumbbells much shorter than the reciprocal of the mean curvature see a flat surface",
        Means.SYMBOLIC,
        curvature_bound_is,
        partial(curvature_bound_is, "largest"),
    ),
)
