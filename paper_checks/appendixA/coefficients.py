"""Appendix A: the law of the onset of motion and its coefficients, text against captions."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType

import numpy as np

from paper_checks.appendixA.forces import STATIC, TILT, frame, is_zero, judged, tex
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner.dumbbells.statics.keel import RestRegion
from polycorner.toolkit import Array

ROUNDING = 1.0  # degree: the uncertainty of "about 20 degrees"
SAMPLES = 20_000


def held(
    ratio: Array, mu_r: float, mu_s: float, *, divided: bool, absolute: bool, force: Array | None
) -> Array:
    """Return whether the two printed cases hold a dumbbell.

    ``ratio`` is ``F_T/|F_N|`` along ``u_r, u_s``; ``force`` is ``|F_T|``, by which the printed
    cosine has to be divided; ``divided`` says whether it is.
    """
    size = np.hypot(ratio[..., 0], ratio[..., 1])
    cosine = ratio[..., 0] / size
    if not divided and force is not None:
        cosine = cosine * force
    cosine = np.abs(cosine) if absolute else cosine
    first = np.arccos(np.clip(cosine, -1, 1)) <= math.pi / 2 - math.asin(mu_r / mu_s)
    with np.errstate(divide="ignore"):
        limit = np.where(first, mu_r / np.where(first, cosine, 1.0), mu_s)
    return np.asarray(size <= limit)


def law_is_one_convex_set(absolute: bool = True, mu_r: float = 0.1, mu_s: float = 0.3) -> Finding:
    """Compare both cases with the disc ``|f| <= mu_s``, cut by the strip ``|f_r| <= mu_r``."""
    rng = np.random.default_rng(1)
    ratio = rng.uniform(-1.2 * mu_s, 1.2 * mu_s, (SAMPLES, 2))
    found = held(ratio, mu_r, mu_s, divided=True, absolute=absolute, force=None)
    disc = np.hypot(*ratio.T) <= mu_s
    strip = np.abs(ratio[:, 0]) <= mu_r
    wrong = int((found != (disc & strip)).sum())
    half = int((found != (disc & (ratio[:, 0] <= mu_r))).sum())
    return Finding(
        Verdict.HOLDS_UNDER if wrong == 0 else Verdict.REFUTED,
        f"disc and strip decide otherwise for {wrong} of {SAMPLES} forces, and for {half} "
        "otherwise by the disc cut on one side only",
        {"differ_from_strip": float(wrong), "differ_from_one_side": float(half)},
        "$\\vartheta$ is the angle with the line of rolling, from 0 to $\\pi/2$; then the force "
        "is held exactly when $|f_T| \\le \\mu_s |f_N|$ and $|f_T \\cdot u_r| \\le \\mu_r |f_N|$",
    )


def cases_meet_at(function: str = "sin") -> Finding:
    """Check that both thresholds agree at ``pi/2 - epsilon`` if f(epsilon) = mu_r / mu_s."""
    import sympy

    mu_r, mu_s = sympy.symbols("mu_r mu_s", positive=True)
    epsilon = getattr(sympy, f"a{function}")(mu_r / mu_s)
    jump = sympy.simplify(mu_r / sympy.cos(sympy.pi / 2 - epsilon) - mu_s)
    return Finding(
        judged(jump == 0),
        f"with $\\{function}\\,\\varepsilon = \\mu_r/\\mu_s$ the threshold jumps by {tex(jump)}",
    )


def quoted_angle_is(mu_r: float = 0.1, mu_s: float = 0.3, epsilon: float = 20.0) -> Finding:
    found = math.degrees(math.asin(mu_r / mu_s))
    return Finding(
        judged(abs(found - epsilon) < ROUNDING),
        f"$\\arcsin({mu_r:g}/{mu_s:g}) = {found:.2f}°$, quoted about {epsilon:g}°",
        {"epsilon": found},
    )


def captions_agree(
    single: tuple[float, float] = (0.1, 8.0),
    dyad: tuple[float, float] = (0.2, 20.0),
    mu_s: float = STATIC[1],
) -> Finding:
    """Compare ``mu_s = mu_r / sin(epsilon)`` of the caption with the one of the text."""
    found = [mu / math.sin(math.radians(angle)) for mu, angle in (single, dyad)]
    right = [math.degrees(math.asin(mu / mu_s)) for mu, _ in (single, dyad)]
    limits = [math.degrees(RestRegion(TILT, 0.1, mu).limit) for mu in (mu_s, *found)]
    holds = all(abs(mu - mu_s) < 0.02 for mu in found)
    return Finding(
        judged(holds, Verdict.CORRECTED),
        f"the caption implies $\\mu_s = {found[0]:.4f}$ (single) and {found[1]:.4f} (dyad), the "
        f"text has about {mu_s:g} and 20° for a single dumbbell; $\\varphi_s$ would be "
        f"{limits[1]:.1f}° and {limits[2]:.1f}° instead of {limits[0]:.1f}°",
        {"single": found[0], "dyad": found[1], "limit_single": limits[1], "limit_text": limits[0]},
        f"with $\\mu_s = {mu_s:g}$ of the text, $\\varepsilon = {right[0]:.1f}°$ for $\\mu_r = "
        f"{single[0]:g}$ and {right[1]:.1f}° for {dyad[0]:g}; one of the three quoted pairs has "
        "to be changed",
    )


def ordering_holds(mu_r: float = 0.1, mu_s: float = 0.3, tilt: float = 7.0) -> Finding:
    """Check the part of the chain of inequalities for which the paper gives numbers."""
    slope = math.tan(math.radians(tilt))
    low, high = (math.degrees(math.atan(mu)) for mu in (mu_r, mu_s))
    holds = mu_r < slope < mu_s
    return Finding(
        Verdict.HOLDS_UNDER if holds else Verdict.REFUTED,
        f"$\\mu_r = {mu_r:g}$, $\\tan {tilt:g}° = {slope:.4f}$, $\\mu_s = {mu_s:g}$; static "
        f"coefficients allow tilts between {low:.2f}° and {high:.2f}°",
        {"slope": slope, "least_tilt": low, "largest_tilt": high},
        f"the dynamic coefficients, which are not given, have to satisfy $\\mu_s^{{dyn}} > "
        f"{slope:.4f}$ and $\\mu_r^{{dyn}} < {mu_r:g}$",
    )


def experiments_are_ordered(
    cases: Mapping[str, tuple[float, float]] = MappingProxyType(
        {"dyads at 7°": (0.2, 7.0), "level drum": (0.1, 0.0)}
    ),
) -> Finding:
    """Check ``mu_r < tan(alpha)`` for the other data shown: dyads, and the level drum."""
    slopes = {name: math.tan(math.radians(tilt)) for name, (_, tilt) in cases.items()}
    bad = [name for name, (mu, _) in cases.items() if not mu < slopes[name]]
    listed = "; ".join(
        f"{name}: $\\mu_r = {mu:g}$, $\\tan\\alpha = {slopes[name]:.4f}$"
        for name, (mu, _) in cases.items()
    )
    least = {n: math.degrees(math.atan(mu)) for n, (mu, _) in cases.items()}
    needed = ", ".join(f"{n}: above {angle:.2f}°" for n, angle in least.items())
    return Finding(
        judged(not bad, Verdict.CORRECTED),
        f"{listed}; the first inequality fails for {len(bad)} of {len(cases)}",
        {f"slope {name}": value for name, value in slopes.items()},
        "restrict the chain to single dumbbells at 7°; with $\\mu_r$ as quoted it needs tilts "
        f"{needed}",
    )


def inequalities_mean(
    places: Sequence[tuple[float, float, str]] = ((0.0, 90.0, "across"), (0.0, 0.0, "along")),
) -> Finding:
    """Check that at these placements the ratio along ``u_r`` or ``u_s`` is ``tan(alpha)``."""
    import sympy

    symbols, (east, north, normal) = frame()
    theta = symbols["theta"]
    parts = {
        "across": -east * sympy.cos(theta) + north * sympy.sin(theta),
        "along": east * sympy.sin(theta) + north * sympy.cos(theta),
    }
    sizes = []
    for azimuth, heading, part in places:
        at = {symbols["phi"]: sympy.rad(azimuth), theta: sympy.rad(heading)}
        sizes.append(sympy.simplify((parts[part] / normal).subs(at)))
    holds = all(is_zero(size**2 - sympy.tan(symbols["alpha"]) ** 2) for size in sizes)
    listed = ", ".join(
        f"{part} at ({azimuth:g}°, {heading:g}°): {tex(size)}"
        for (azimuth, heading, part), size in zip(places, sizes, strict=True)
    )
    return Finding(judged(holds), f"force over load {listed}")


CLAIMS = (
    Claim(
        "F1",
        "A",
        "law of the onset of motion",
        "a dumbbell starts to roll when $|f_T|/|f_N| > \\mu_r/\\cos\\vartheta$ and to slide, for "
        "$|\\vartheta| > \\pi/2-\\varepsilon$, when it exceeds $\\mu_s$: together one convex set "
        "of forces",
        Means.NUMERICAL,
        law_is_one_convex_set,
        partial(law_is_one_convex_set, absolute=False),
    ),
    Claim(
        "F2a",
        "A",
        "definition of $\\varepsilon$",
        "both thresholds agree at $\\pi/2-\\varepsilon$ with $\\sin\\varepsilon = \\mu_r/\\mu_s$",
        Means.SYMBOLIC,
        cases_meet_at,
        partial(cases_meet_at, "tan"),
    ),
    Claim(
        "F2b",
        "A",
        "coefficients in the text",
        "$\\mu_r = 0.1$, $\\mu_s = 0.3$ and $\\varepsilon = 20°$ belong together",
        Means.NUMERICAL,
        quoted_angle_is,
        partial(quoted_angle_is, epsilon=8.0),
    ),
    Claim(
        "F2c",
        "A",
        "caption of the figure of measured turning points, against the text",
        "$(\\mu_r, \\varepsilon) = (0.1, 8°)$ for single dumbbells and $(0.2, 20°)$ for dyads are "
        "the coefficients of the text",
        Means.NUMERICAL,
        captions_agree,
        partial(captions_agree, (0.1, 19.47), (0.2, 41.81)),
    ),
    Claim(
        "F3a",
        "A",
        "ordering of the coefficients",
        "$\\mu_r^{dyn} < \\mu_r < \\tan\\alpha < \\mu_s^{dyn} < \\mu_s$ for single dumbbells at 7°",
        Means.NUMERICAL,
        ordering_holds,
        partial(ordering_holds, tilt=20.0),
    ),
    Claim(
        "F3b",
        "A",
        "ordering of the coefficients, against the figures",
        "the ordering is that of the paper's experiments, dyads and the level drum included",
        Means.NUMERICAL,
        experiments_are_ordered,
        partial(experiments_are_ordered, {"single at 7°": (0.1, 7.0)}),
    ),
    Claim(
        "F3c",
        "A",
        "meaning of the ordering",
        "$\\mu_r < \\tan\\alpha$ says that a dumbbell across the lowest line rolls down, "
        "$\\tan\\alpha < \\mu_s^{dyn}$ that one along it does not slide",
        Means.SYMBOLIC,
        inequalities_mean,
        partial(inequalities_mean, ((0.0, 45.0, "across"), (0.0, 0.0, "along"))),
    ),
)
