"""Appendix A: the regions of rest, ``A`` for the onset of motion and ``B`` for its end."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from paper_checks.appendixA.coefficients import held
from paper_checks.appendixA.forces import STATIC, TILT, does, frame, judged, tex
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.statics.keel import RestRegion, exact_eastern_boundary
from polycorner.motion import Trajectory, simulate
from polycorner.toolkit import Array

DYNAMIC = (0.06, 0.2)  # dynamic coefficients of rolling and sliding; the paper gives none
NUDGE = 1.0  # mm/s
APART = 1e4  # mm along the drum, between dumbbells that are to stay apart


def forces(phi: Array, theta: Array) -> tuple[Array, Array]:
    """Return ``F_T/|F_N|`` along ``u_r, u_s``, ``(..., 2)``, and ``|F_T|``, in the tilted drum."""
    import sympy

    symbols, down = frame()
    parts = sympy.lambdify((symbols["phi"], symbols["alpha"]), down)
    east, north, normal = (np.broadcast_to(part, phi.shape) for part in parts(phi, TILT))
    across = -east * np.cos(theta) + north * np.sin(theta)
    along = east * np.sin(theta) + north * np.cos(theta)
    return np.stack([across / normal, along / normal], axis=-1), np.hypot(east, north)


def everywhere(count: int = 721) -> tuple[Array, Array]:
    """Return ``phi`` within 40 degrees and all headings on a grid that avoids both boundaries."""
    shift = math.pi / 7e3
    phi = np.linspace(-0.7, 0.7, count) + shift
    theta = np.linspace(-math.pi / 2, math.pi / 2, count) + shift / 2
    return np.meshgrid(phi, theta, indexing="ij")


def region_is(divided: bool = False, absolute: bool = False) -> Finding:
    """Compare the two printed cases, with the printed cosine, with a balance of forces."""
    phi, theta = everywhere()
    ratio, force = forces(phi, theta)
    found = held(ratio, *STATIC, divided=divided, absolute=absolute, force=force)
    right = (np.hypot(ratio[..., 0], ratio[..., 1]) <= STATIC[1]) & (
        np.abs(ratio[..., 0]) <= STATIC[0]
    )
    halved = held(ratio, *STATIC, divided=True, absolute=False, force=force)
    whole = held(ratio, *STATIC, divided=True, absolute=True, force=force)
    holds = bool((found == right).all())
    areas = {"claimed": float(found.sum() / right.sum()), "signed": halved.sum() / right.sum()}
    return Finding(
        judged(holds, Verdict.CORRECTED if (whole == right).all() else Verdict.REFUTED),
        f"the region of the two cases is {areas['claimed']:.2f} times as large as that in which "
        "friction can balance the weight; with the cosine divided by $|F_T|$ but signed it is "
        f"{areas['signed']:.2f} times as large",
        {name: float(value) for name, value in areas.items()},
        "divide the cosine by $|F_T|$ and take its absolute value; then $A$ is where $|f_T| \\le "
        "\\mu_s|f_N|$ and $|f_T \\cdot u_r| \\le \\mu_r|f_N|$",
    )


def boundary_belongs(strict: bool = True) -> Finding:
    """Look for points of ``A`` at heading 0 that every further turn carries out of ``A``.

    There ``|F_T . u_r|/|F_N| = tan(phi)``, which is ``mu_r`` at the last azimuth of rest.
    """
    import sympy

    mu = sympy.Symbol("mu_r", positive=True)
    symbols, (east, _, normal) = frame()
    last = sympy.atan(mu)
    excess = sympy.simplify((-east / normal).subs(symbols["phi"], last) - mu)
    inside = not strict if excess == 0 else bool(excess < 0)
    return Finding(
        judged(inside, Verdict.CORRECTED if excess == 0 else Verdict.REFUTED),
        f"at heading 0 and $\\varphi = $ {tex(last)} the pull exceeds the limit by {tex(excess)}: "
        f"the point {does(inside)} belong to $A$, and points before it have neighbours to the "
        "east "
        "in $A$; so the eastern boundary is " + ("not empty" if inside else "empty"),
        correction="$A$ needs $\\le$ instead of $<$ in both cases (as in the law of onset, where "
        "motion begins for $>$); then its eastern boundary is not empty",
    )


def arrest_is_inside(dynamic: tuple[float, float] = DYNAMIC, count: int = 200) -> Finding:
    """Check that ``B`` lies in the interior of ``A`` for many ordered coefficients and tilts.

    ``dynamic``: factors of the default coefficients of rolling and sliding are drawn below 1.
    """
    rng = np.random.default_rng(3)
    phi, theta = everywhere(181)
    least, inside = math.inf, 0
    share = (dynamic[0] / STATIC[0], dynamic[1] / STATIC[1])
    for _ in range(count):
        roll = rng.uniform(0.05, 0.5)
        slide = rng.uniform(1.1, 3.0) * roll
        tilt = math.atan(slide * share[1] * rng.uniform(0.0, 0.9))
        drawn = [s * rng.uniform(0.6, 1.0) for s in share]
        outer = RestRegion(tilt, roll, slide)
        inner = RestRegion(tilt, min(roll * drawn[0], slide * drawn[1]), slide * drawn[1])
        within = inner.contains(phi, theta)
        inside += int(within.sum())
        least = min(least, float(outer.margin(phi, theta)[within].min(initial=math.inf)))
    return Finding(
        judged(least > 0 and inside > 0),
        f"for {count} sets of coefficients, {inside} points of $B$: the least distance of the "
        f"force from the limits of $A$ is {least:.4f} of the load",
        {"least": least, "points": float(inside)},
    )


def nudged(azimuth: Callable[[Array], Array], headings: Array) -> Trajectory:
    """Simulate dumbbells in a drum at rest, pushed so that they roll downhill with 1 mm/s."""
    count = len(headings)
    drum = DumbbellDrum(count=count, spin=0.0)
    phi = azimuth(headings)
    q = np.stack([phi, APART * np.arange(count), headings], axis=-1)
    across = -NUDGE * np.cos(headings) / drum.centre_radius
    spin = np.full(count, NUDGE / drum.ball_radius)
    v = np.stack([across, NUDGE * np.sin(headings), 0 * headings, spin], axis=-1)
    return simulate(drum, drum.state(q, v), 1.5, 1e-3, every=10)


def middle(headings: Array) -> Array:
    return np.asarray(sum(RestRegion(TILT, *DYNAMIC).azimuths(headings)) / 2)


def between(headings: Array) -> Array:
    inner, outer = RestRegion(TILT, *DYNAMIC), RestRegion(TILT, *STATIC)
    return np.asarray((inner.eastern_boundary(headings) + outer.eastern_boundary(headings)) / 2)


def nudges_die(azimuth: Callable[[Array], Array] = middle) -> Finding:
    """Push dumbbells in ``B`` (``middle``) or in ``A`` but not in ``B`` (``between``)."""
    headings = np.radians([-20.0, -10.0, 0.0, 10.0, 20.0])
    moved = []
    for place in (azimuth, middle, between):
        path = nudged(place, headings)
        across = DumbbellDrum().centre_radius * (path.q[-1, :, 0] - path.q[0, :, 0])
        moved.append(np.hypot(across, path.q[-1, :, 1] - path.q[0, :, 1]))
    stays = bool(moved[0].max() < 0.1)
    return Finding(
        judged(stays),
        f"pushed with {NUDGE:g} mm/s, they go {moved[0].min():.3f} to {moved[0].max():.3f} mm; in "
        f"the middle of $B$ at most {moved[1].max():.3f} mm, between $B$ and the eastern boundary "
        f"of $A$ at least {moved[2].min():.2f} mm",
        {"least": float(moved[0].min()), "largest": float(moved[0].max())},
    )


def regions_are_symmetric(absolute: bool = True) -> Finding:
    """Compare both regions with their images under ``(phi, theta) -> (-phi, -theta)``."""
    phi, theta = everywhere()
    wrong = 0
    for limits in (STATIC, DYNAMIC):
        images = []
        for sign in (1, -1):
            ratio, force = forces(sign * phi, sign * theta)
            images.append(held(ratio, *limits, divided=True, absolute=absolute, force=force))
        wrong += int((images[0] != images[1]).sum())
    return Finding(
        Verdict.HOLDS_UNDER if wrong == 0 else Verdict.REFUTED,
        f"{wrong} of {2 * phi.size} points of a grid are in a region while their image is not",
        {"differ": float(wrong)},
        "$|\\cos\\vartheta|$ in the definition: with the sign of $u_r$ one side of the strip is "
        "lost, and with it the symmetry",
    )


def length_does_not_matter(headings: float = 30.0, length: float = 16.0) -> Finding:
    """Compare the eastern boundary of ``A`` with the one for a dumbbell of finite length.

    For headings up to ``headings``, in degrees; boundaries count as equal within 0.05 degrees.
    """
    region = RestRegion(TILT, *STATIC)
    theta = np.radians(np.linspace(-headings, headings, 121))
    kappa = length / (2 * DumbbellDrum().centre_radius)
    exact = exact_eastern_boundary(theta, region, kappa)
    moved = np.abs(np.degrees(exact - region.eastern_boundary(theta)))
    worst, rest = float(np.nanmax(moved)), int(np.isfinite(moved).sum())
    return Finding(
        judged(worst < 0.05),
        f"balancing loads and forces of both balls of a dumbbell of {length:g} mm moves the "
        f"boundary by at most {worst:.4f}° for headings up to {headings:g}° ({rest} headings)",
        {"largest": worst, "headings": float(rest)},
    )


CLAIMS = (
    Claim(
        "F7b",
        "A",
        "definition of $A$",
        "with the printed cosine, $A$ is the region in which a dumbbell at rest stays at rest",
        Means.NUMERICAL,
        region_is,
        partial(region_is, divided=True, absolute=True),
        figure="rest_regions",
    ),
    Claim(
        "F9a",
        "A",
        "definition of $A$ and of its eastern boundary",
        "with the strict inequalities of $A$ every turn carries some points of $A$ out of it",
        Means.SYMBOLIC,
        boundary_belongs,
        partial(boundary_belongs, strict=False),
        figure="rest_regions",
    ),
    Claim(
        "F9b",
        "A",
        "region $B$",
        "with smaller coefficients of motion, $B$ lies strictly inside $A$",
        Means.NUMERICAL,
        arrest_is_inside,
        partial(arrest_is_inside, dynamic=(0.12, 0.36)),
        figure="rest_regions",
    ),
    Claim(
        "F9c",
        "A",
        "region $B$",
        "in $B$ a dumbbell stays at rest even when nudged",
        Means.SIMULATION,
        nudges_die,
        partial(nudges_die, between),
    ),
    Claim(
        "F10",
        "A",
        "symmetry of the regions",
        "$A$ and $B$ are invariant under $(\\varphi, \\theta) \\mapsto (-\\varphi, -\\theta)$",
        Means.NUMERICAL,
        regions_are_symmetric,
        partial(regions_are_symmetric, absolute=False),
        figure="rest_regions",
    ),
    Claim(
        "F16",
        "A",
        "dumbbells as points of $N$",
        "whether a dumbbell of small heading rests depends on position and heading, not on length",
        Means.NUMERICAL,
        length_does_not_matter,
        partial(length_does_not_matter, 80.0),
    ),
)
