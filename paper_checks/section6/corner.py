"""The nested corner of section 6: balance of forces, heading, entrapment."""

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np
import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.experiment import (
    BUNCH,
    CORNER,
    DEGREES,
    EXPERIMENT,
    PLANE,
    SHORTER,
    Interval,
    centres,
    enclosed,
    exact,
    has,
    height,
    middle,
    multiplier,
    proof,
    rests,
)
from polycorner import stationary_on
from polycorner.dumbbells import (
    DumbbellPair,
    critical_rod_radius,
    heading_error_bar,
    plane_heading_formula,
)
from polycorner.toolkit import checks

LENGTH, BALL, ROD = sympy.symbols("l r t", positive=True)
PRINTED_HEADING = sympy.atan(BALL / LENGTH)
TOLERANCES = {"length": 0.1, "ball_radius": 0.05, "rod_radius": 0.05, "drum_radius": 1.0}
OTHERS = (EXPERIMENT, SHORTER, BUNCH)
CURVATURE = 1e-3  # degrees, largest difference between a drum of 125 mm and the plane
KINDS = ("half-V", "half-U", "U", "free")


def sizes(pair: DumbbellPair) -> dict[sympy.Symbol, sympy.Rational]:
    """Return the sizes of the dumbbells for the symbols of a formula."""
    numbers = (pair.length, pair.ball_radius, pair.rod_radius)
    return dict(zip((LENGTH, BALL, ROD), map(exact, numbers), strict=True))


def half_turn_fixes_the_corner() -> bool:
    """Decide whether the proved corner is its own image, with A and B exchanged.

    A half-turn about a vertical axis, the exchange of the two dumbbells and of their ends sends
    ``(phi1, eta1, theta1, phi2, eta2, theta2)`` to ``(-phi2, c - eta2, theta2, -phi1, c - eta1,
    theta1)``, and ``c`` can be chosen so that both ``eta`` stay.  It turns every centre by a
    half-turn (checked symbolically), so it keeps gaps and energy, and it exchanges the contacts
    ``A2b`` and ``aB1``.  So it carries the solution of the KKT equations to a solution.  If the
    image of the enclosure lies in the box in which the solution is unique, both are the same.
    """
    ball = centres(EXPERIMENT)
    p1, e1, t1, p2, e2, t2 = EXPERIMENT.manifold.symbols
    moved = {p1: -p2, e1: -e2, t1: t2, p2: -p1, e2: -e1, t2: t1}
    turned = {"A1": "B2", "A2": "B1", "B1": "A2", "B2": "A1"}
    for name, image in turned.items():
        new, old = ball[name].subs(moved, simultaneous=True), ball[image]
        expected = sympy.Matrix([-old[0], -old[1], old[2]])
        if (new - expected).applyfunc(sympy.simplify) != sympy.zeros(3, 1):
            return False
    found = proof(EXPERIMENT, "delta_R")
    source = {"phi1": ("phi2", -1), "phi2": ("phi1", -1), "theta1": ("theta2", 1)}
    source |= {"theta2": ("theta1", 1), "multiplier A2b": ("multiplier aB1", 1)}
    source |= {"multiplier aB1": ("multiplier A2b", 1)}
    for name, bounds in found.box.items():
        other, sign = source.get(name, (name, 1))
        sides = sorted(sign * sympy.Rational(x) for x in found.enclosures[other])
        low, high = map(sympy.Rational, bounds)
        if not low < sides[0] <= sides[1] < high:
            return False
    return True


def balanced(azimuths: int = 1, headings: int = -1) -> Finding:
    """Check ``phi1 + azimuths phi2 = 0`` and ``theta1 + headings theta2 = 0`` at the corner."""
    p1, _, t1, p2, _, t2 = EXPERIMENT.manifold.symbols
    found = proof(EXPERIMENT, "delta_R")
    sides = [enclosed(found, e) for e in (p1 + azimuths * p2, t1 + headings * t2)]
    holds = all(has(side, 0) for side in sides) and half_turn_fixes_the_corner()
    widest = max(float(max(map(abs, side))) for side in sides)
    own = middle(enclosed(found, p1 * DEGREES))
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"At the proved point both combinations vanish to within {widest:.1e}; they vanish exactly,"
        " because the half-turn about the vertical that exchanges the dumbbells maps the point "
        f"into the box where it is the only solution. $\\varphi_1 = {own:.6f}^\\circ$."
        if holds
        else f"At the proved point the two combinations are {middle(sides[0]):.6f} and "
        f"{middle(sides[1]):.6f} rad.",
        {"azimuth": own, "widest": widest},
    )


def heading_is(formula: sympy.Expr = PRINTED_HEADING) -> Finding:
    """Compare a formula with proved headings, exactly in the plane and nearly in the drum."""
    degrees = sympy.N(formula.subs(sizes(PLANE)) * DEGREES, 40)
    right = sympy.N(plane_formula().subs(sizes(PLANE)) * DEGREES, 40)
    plane = enclosed(proof(PLANE, "delta_R"), PLANE.manifold.symbols[2] * DEGREES)
    drum = enclosed(proof(EXPERIMENT, "delta_R"), EXPERIMENT.manifold.symbols[2] * DEGREES)
    claimed, computed = float(degrees), middle(drum)
    holds = has(plane, degrees) and abs(computed - claimed) < CURVATURE
    known = abs(computed - float(right)) < CURVATURE and all(map(_closed_form_is_right, OTHERS))
    bar = heading_error_bar(EXPERIMENT, TOLERANCES)
    larger = proof(replace(EXPERIMENT, drum_radius=2 * EXPERIMENT.drum_radius), "delta_R")
    far = enclosed(larger, EXPERIMENT.manifold.symbols[2] * DEGREES)
    falls = (computed - middle(plane)) / (middle(far) - middle(plane))
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if known else Verdict.REFUTED,
        f"The formula gives {claimed:.6f} degrees. Proved by interval arithmetic: "
        f"{computed:.10f} in the drum, {middle(plane):.10f} in the plane it develops into, where "
        f"the closed form $\\tan 2\\theta_s = 2Dp/(D^2 + \\ell^2 - p^2)$ gives {float(right):.10f} "
        f"and lies in the enclosure, {_width(plane)} wide, as for {len(OTHERS) - 1} other sizes. "
        f"The difference of drum and plane shrinks {falls:.2f} times when the radius doubles. "
        f"Tolerances of the sizes move the heading by {bar.spread:.2f}; the formula is off by "
        f"{claimed - computed:.2f}.",
        {"claimed": claimed, "drum": computed, "plane": middle(plane), "error_bar": bar.spread},
        ""
        if holds
        else "$\\tan 2\\theta_s = 2Dp/(D^2 + \\ell^2 - p^2)$ with $p = r + t$ and $D = \\ell - "
        f"\\sqrt{{4r^2 - p^2}}$: ${float(right):.4f}^\\circ$ for $\\ell = {PLANE.length:g}$, $r = "
        f"{PLANE.ball_radius:g}$, $t = {PLANE.rod_radius:g}$ mm, up to a term of order "
        f"$1/R^2$, here ${computed - float(right):.4f}^\\circ$. {_when_printed_is_exact()}",
    )


@cache
def plane_formula() -> sympy.Expr:
    """Return the closed form in the plane, derived from the energy of the four balls."""
    return plane_heading_formula()


@cache
def _closed_form_is_right(pair: DumbbellPair) -> bool:
    """Decide whether the closed form lies in the enclosure of the heading in the plane."""
    flat = replace(pair, drum_radius=math.inf)
    side = enclosed(proof(flat, "delta_R"), flat.manifold.symbols[2] * DEGREES)
    return has(side, plane_formula().subs(sizes(flat)) * DEGREES)


def _when_printed_is_exact() -> str:
    """Balance the outer balls alone: they lie lowest at ``(D + l) sin theta = p cos theta``."""
    p = BALL + ROD
    along = LENGTH - sympy.sqrt(4 * BALL**2 - p**2)
    outer = sympy.atan(p / (along + LENGTH))
    exactly = sympy.simplify(outer.subs(ROD, BALL) - PRINTED_HEADING) == 0
    plain = "is" if exactly else "is not"
    return f"The printed value {plain} exact if $t = r$ and only the two outer balls have weight."


def _width(side: Interval) -> str:
    return f"{float(side[1] - side[0]):.0e}"


def sign_of_heading(right_handed: int = 1) -> Finding:
    """Check the sign of the heading for each chirality.

    Orientation: the paper turns the axis ``(sin theta, cos theta)`` of the plane ``(R phi, eta)``
    by ``+ pi/2`` to ``(-cos theta, sin theta)`` (appendix A), so ``(phi, eta)`` is positive.
    """
    theta = EXPERIMENT.manifold.symbols[2] * DEGREES
    sides = {name: enclosed(proof(EXPERIMENT, name), theta) for name in ("delta_R", "delta_L")}
    signs = {k: 1 if v[0] > 0 else -1 if v[1] < 0 else 0 for k, v in sides.items()}
    hands = {name: _hand(rests(EXPERIMENT)[name].point) for name in sides}
    holds = all(signs[name] == right_handed * hands[name] != 0 for name in sides)
    told = " and ".join(
        f"{middle(sides[k]):+.4f} degrees where the vectors turn {'left' if h > 0 else 'right'}"
        for k, h in hands.items()
    )
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"The proved headings are {told} in the oriented plane $(R\\varphi, \\eta)$ (the "
        "orientation in which appendix A turns $u_s$ into $u_r$; a left turn is right-handed).",
        {name: middle(side) for name, side in sides.items()},
    )


def _hand(q: np.ndarray) -> int:
    """Return the sign of the vectors from the farthest pair of centres and the other two."""
    a, b = np.split(EXPERIMENT.developed(q), 2)
    i, j = max(np.ndindex(2, 2), key=lambda ij: float(np.hypot(*(b[ij[1]] - a[ij[0]]))))
    outer, inner = b[j] - a[i], b[1 - j] - a[1 - i]
    return int(np.sign(outer[0] * inner[1] - outer[1] * inner[0]))


def slopes_at(locus: str = "delta_R") -> Finding:
    pair, found = EXPERIMENT, proof(EXPERIMENT, locus)
    names = pair.manifold.symbols
    slopes = {str(x): enclosed(found, height(pair).diff(x)) for x in names}
    steep = {name: middle(side) for name, side in slopes.items() if not has(side, 0)}
    listed = ", ".join(f"$\\partial E/\\partial$ {k} $= {v:.6f}$" for k, v in steep.items())
    return Finding(
        Verdict.HOLDS if found.proved and steep else Verdict.REFUTED,
        f"Proved not to vanish: {listed or 'nothing'} (mm per radian); the enclosures of the other "
        f"{len(names) - len(steep)} derivatives contain zero.",
        steep,
    )


def held_by(
    half_v: int = 1,
    half_u: int = 2,
    full_u: int = 2,
    free: int = 1,
    pair: DumbbellPair = EXPERIMENT,
) -> Finding:
    """Count directions by kind of entrapment, and find when the printed counts would be right."""
    claimed = dict(zip(KINDS, (half_v, half_u, full_u, free), strict=True))
    entry, found = rests(pair)["delta_R"], proof(pair, "delta_R")
    counts = entry.certificate.entrapment_counts
    complete = {kind: counts.get(kind, 0) for kind in KINDS}
    presses = {name: multiplier(found, name) for name in CORNER}
    proved = found.proved and all(low > 0 for low, _ in presses.values())
    radius = critical_rod_radius(pair)
    if radius is None:
        checks.refuse("pair", "one whose rod contacts open at some rod radius", pair)
    edge = replace(pair, rod_radius=radius)
    start = edge.nested("R", clearance=0.0)
    at_edge = stationary_on(edge.polyhedron, edge.energy, start, CORNER)
    holds = proved and complete == claimed
    listed = ", ".join(f"{name} {middle(side):.9f}" for name, side in presses.items())
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if proved else Verdict.REFUTED,
        f"Proved: all three contacts press, with $dE = \\sum\\lambda_i\\,df_i$ and $\\lambda$ = "
        f"{listed}; so {', '.join(f'{n} {k}' for k, n in complete.items())}. Ball-rod contacts "
        f"without pressure, signature {at_edge.signature}, occur at $t = "
        f"{edge.rod_radius:.6f}$ mm, and there the corner is "
        f"{'a' if at_edge.is_minimum else 'no'} minimum.",
        {f"multiplier_{name}": middle(side) for name, side in presses.items()},
        ""
        if holds
        else "Half-V in three degrees of freedom (all three contacts press), U in two, "
        "free along $\\delta$: $(p, q, r) = (3, 2, 1)$, and nothing is held as half-U.",
    )


def does_not_depend_on(coordinate: str = "eta") -> Finding:
    pair = EXPERIMENT
    names = [x for x in pair.manifold.symbols if str(x).startswith(coordinate)]
    slopes = [sympy.simplify(height(pair).diff(x)) for x in names]
    gaps = [_shifted(pair, names, contact) for contact in pair.polyhedron.names]
    holds = all(slope == 0 for slope in slopes) and max(gaps) < 1e-12
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"The derivatives of $E$ by {' and '.join(map(str, names))} are "
        f"{' and '.join('zero' if s == 0 else 'not zero' for s in slopes)} identically; a common "
        f"change of both moves the {len(gaps)} gaps by {max(gaps):.0e} mm.",
        {"gaps_move": max(gaps)},
    )


def _shifted(pair: DumbbellPair, names: list[sympy.Symbol], contact: str) -> float:
    """Return the largest change of a gap when coordinates grow by the same amount."""
    rng = np.random.default_rng(11)
    step = np.array([0.3 if x in names else 0.0 for x in pair.manifold.symbols])
    gap = next(f for f in pair.polyhedron.functions if f.name == contact)
    q = pair.placements(rng, 20)
    return float(abs(gap.value(q + step) - gap.value(q)).max())


CLAIMS = (
    Claim(
        "E3",
        "6",
        "definition of $\\delta_L$ and $\\delta_R$",
        "On $\\delta$ the azimuths cancel, $\\varphi_1 + \\varphi_2 = 0$, and the headings agree, "
        "$\\theta_1 = \\theta_2$.",
        Means.PROOF,
        balanced,
        partial(balanced, azimuths=-1),
    ),
    Claim(
        "E4a",
        "6",
        "definition of $\\delta_L$ and $\\delta_R$; caption of the figure of headings",
        "The heading on $\\delta_R$ is $\\arctan(r/\\ell)$, on $\\delta_L$ its negative.",
        Means.PROOF,
        heading_is,
        lambda: heading_is(plane_formula()),  # seconds of algebra, not for every import
        figure="heading_length",
    ),
    Claim(
        "E4b",
        "6",
        "definition of $\\delta_L$ and $\\delta_R$; section 7.2",
        "The right-handed dyad rests at a positive heading, the left-handed one at a negative one.",
        Means.PROOF,
        sign_of_heading,
        partial(sign_of_heading, right_handed=-1),
        figure="nested",
    ),
    Claim(
        "E5",
        "6",
        "paragraph on entrapment",
        "The derivative of the energy does not vanish on $\\delta$.",
        Means.PROOF,
        slopes_at,
        partial(slopes_at, locus="G"),
    ),
    Claim(
        "E6a",
        "6",
        "paragraph on entrapment; appendix C, last paragraph",
        "A dyad in $\\delta$ is held as half-V in one degree of freedom, as half-U in two, as U in "
        "two, and it is free in one.",
        Means.PROOF,
        held_by,
        partial(held_by, half_v=3, half_u=0),
        figure="entrapment",
    ),
    Claim(
        "E6b",
        "6",
        "paragraph on entrapment",
        "Along $\\delta$ the motion is free: the energy does not depend on $\\eta$.",
        Means.SYMBOLIC,
        does_not_depend_on,
        partial(does_not_depend_on, coordinate="theta"),
    ),
)
