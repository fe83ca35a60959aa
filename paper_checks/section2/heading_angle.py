"""Sections 2 and 4: a dumbbell on the cylinder, its heading, and the tilt as a force.

The two ball centres come from :func:`paper_checks.section2.cylinder.ball_centres`.
"""

import math
from functools import partial

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section2.cylinder import (
    at_sample,
    ball_centres,
    fall,
    formula,
    symbols,
    tangents,
    typeset,
    unit_frame,
    vanishes,
)

# Length, ball radius and rod radius in mm of the dumbbells that the captions name.
QUOTED = ((14.0, 3.0, 1.5), (8.0, 2.0, 0.5), (16.0, 3.0, 1.5))
DRUM_RADIUS = 125.0


def heading_has_period(period: str = "pi") -> Finding:
    theta = symbols()["theta"]
    centres = ball_centres()

    def returns(turn: object) -> bool:
        turned = [c.subs(theta, theta + turn) for c in centres]
        matches = [(turned[0] - c, turned[1] - d) for c, d in (centres, centres[::-1])]
        return any(all(vanishes(e) for v in pair for e in v) for pair in matches)

    full = formula(period)
    fractions = [k for k in (2, 3) if returns(full / k)]
    return Finding(
        Verdict.HOLDS if returns(full) and not fractions else Verdict.REFUTED,
        f"Turning the heading by {typeset(full)} brings the two ball centres back as a set: "
        f"{'yes' if returns(full) else 'no'}; fractions of it that do so, too: "
        f"{', '.join(f'1/{k}' for k in fractions) or 'none of 1/2 and 1/3'}.",
    )


def positions_have(coordinates: int = 3) -> Finding:
    """Differentiate both ball centres by azimuth, altitude and heading; compare the rank."""
    import sympy

    s = symbols()
    first, second = ball_centres()
    both = first.col_join(second)
    # scalar products do not change when the drum is rolled, shifted or tilted: one place suffices
    place = {s["phi"]: 0, s["eta"]: 0, s["alpha"]: 0}
    along = [both.diff(s[name]).subs(place) for name in ("phi", "eta", "theta")]
    gram = sympy.Matrix(3, 3, lambda i, j: sympy.simplify(along[i].dot(along[j])))
    volume = sympy.factor(sympy.simplify(gram.det()))
    size = sympy.simplify((second - first).dot(second - first))
    sizes = {"l": 16.0, "rho": DRUM_RADIUS - 3.0, "R": DRUM_RADIUS}
    rank = sympy.Matrix(3, 3, lambda i, j: at_sample(gram[i, j], **sizes)).rank()
    middle = (first + second) / 2
    depth = s["R"] - middle.dot(unit_frame()[2])
    off = [at_sample(depth, **sizes, theta=angle) for angle in (0.0, math.pi / 2)]
    right = rank == coordinates and vanishes(size - s["l"] ** 2)
    return Finding(
        Verdict.HOLDS_UNDER if right else Verdict.REFUTED,
        f"The two centres are a distance {typeset(sympy.sqrt(size))} apart for every heading, and "
        f"their derivatives have rank {rank}: the Gram determinant is {typeset(volume)}. The "
        f"middle of the dumbbell is {off[0]:.3f} to {off[1]:.3f} mm off the wall for a length of "
        f"{sizes['l']:g} mm.",
        {"rank": float(rank), "depth_least": off[0], "depth_largest": off[1]},
        r"For $\ell < 2(R - r)$, with $(\varphi, \eta)$ azimuth and altitude of the centre, which "
        "lies inside the drum and not on its surface.",
    )


def heading_turns(start: str = "meridian", end: str = "axis") -> Finding:
    """Measure the angle from one direction to the other, positive from phi towards eta."""
    import sympy

    s = symbols()
    axis = (sympy.sin(s["theta"]), sympy.cos(s["theta"]))
    east, north, _ = unit_frame()
    first, second = ball_centres()
    middle = ((second - first) / s["l"]).applyfunc(sympy.simplify)
    drawn = all(vanishes(middle.dot(v) - part) for v, part in zip((east, north), axis, strict=True))
    vectors = {"meridian": (sympy.Integer(0), sympy.Integer(1)), "axis": axis}
    u, v = vectors[start], vectors[end]
    sine = sympy.simplify(u[0] * v[1] - u[1] * v[0])
    rolling = (-sympy.cos(s["theta"]), sympy.sin(s["theta"]))
    turn = sympy.simplify(axis[0] * rolling[1] - axis[1] * rolling[0])
    right = drawn and vanishes(sine - sympy.sin(s["theta"])) and turn == 1
    return Finding(
        Verdict.HOLDS if right else Verdict.CORRECTED,
        "With the axis along $\\sin\\theta\\,R^{-1}\\partial_\\varphi + \\cos\\theta\\,"
        "\\partial_\\eta$ and the rolling direction at "
        f"{typeset(sympy.asin(turn))} from it (appendix A), the sine of the angle from the {start} "
        f"to the {end} is {typeset(sine)}.",
        correction=""
        if right
        else r"In the orientation $(\partial_\varphi, \partial_\eta)$ "
        r"$\theta$ is the angle from the axis to the meridian, as section 2 has it and appendix A "
        r"uses it; section 4 has the opposite sense, which would change the sign of every heading.",
    )


def rolling_climbs(climb: str = "-rho*tan(theta)") -> Finding:
    """Roll perpendicularly to the chord and compare the rise along the axis per azimuth."""
    import sympy

    first, second = ball_centres()
    chord = second - first
    around, along = tangents("rho")
    found = sympy.simplify(-around.dot(chord) / along.dot(chord))
    rise = at_sample(found, theta=math.radians(10)) * -math.radians(5)
    return Finding(
        Verdict.HOLDS if vanishes(found - formula(climb)) else Verdict.REFUTED,
        f"Perpendicular to the chord $d\\eta/d\\varphi =$ {typeset(found)}, with $\\rho = R - r$: "
        "rolling back to smaller azimuth raises a dumbbell of positive heading, by "
        f"{rise:.4f} mm for 5 degrees at a heading of 10 degrees, and lowers one of negative "
        "heading by as much.",
        {"rise": rise},
    )


def sizes_are(slenderness: float = 0.1) -> Finding:
    ratios = {length: length / DRUM_RADIUS for length, _, _ in QUOTED}
    most = max(ratios.values())
    listed = ", ".join(f"{ratio:.3f} for {length:g} mm" for length, ratio in ratios.items())
    own = all(2 * ball <= length and rod < ball for length, ball, rod in QUOTED)
    right = most <= slenderness and own
    return Finding(
        Verdict.HOLDS if right else Verdict.CORRECTED,
        f"With $R$ = {DRUM_RADIUS:g} mm the quoted dumbbells have $\\ell/R$ = {listed}; "
        f"$r \\le \\ell/2$ and $t < r$ for {'all' if own else 'not all'} of them, and $t/r$ is "
        f"{min(t / r for _, r, t in QUOTED):g} to {max(t / r for _, r, t in QUOTED):g}.",
        {"largest_ratio": most},
        "" if right else f"$\\ell/R \\le {most:.3g}$ for the dumbbells of the figures.",
    )


def tilt_is_a_force(weight: str = "1", side: str = "sin(alpha)") -> Finding:
    """Compare gravity in the tilted drum with weight in a level one plus a force down the axis."""
    import sympy

    alpha = symbols()["alpha"]
    down = fall() + sympy.Matrix([0, 0, -1]).dot(unit_frame()[2]) * unit_frame()[2]
    tilted = [sympy.simplify(down.dot(v)) for v in unit_frame()]
    level = [entry.subs(alpha, 0) for entry in tilted]
    share = formula(weight)
    claimed = [share * level[0], share * level[1] - formula(side), share * level[2]]
    off = [sympy.simplify(a - b) for a, b in zip(tilted, claimed, strict=True)]
    right = [
        sympy.cos(alpha) * level[0],
        sympy.cos(alpha) * level[1] - sympy.sin(alpha),
        sympy.cos(alpha) * level[2],
    ]
    repaired = all(vanishes(a - b) for a, b in zip(tilted, right, strict=True))
    angle = math.radians(7)
    lost = 1 - at_sample(sympy.cos(alpha), alpha=angle)
    holds = all(entry == 0 for entry in off)
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if repaired else Verdict.REFUTED,
        "Along $\\varphi$, along $\\eta$ and outwards, in units of $mg$, gravity in the tilted "
        f"drum is {', '.join(map(typeset, tilted))}, and the level drum with the force is off by "
        f"{', '.join(map(typeset, off))}; at 7 degrees that is a share of {lost:.5f} of the "
        "weight.",
        {"share": lost},
        ""
        if holds
        else r"A level drum in which the weight is $mg\cos\alpha$, with the force $mg\sin\alpha$ "
        r"down the axis.",
    )


CLAIMS: tuple[Claim, ...] = (
    Claim(
        "G9",
        "2",
        "heading, section 2",
        r"A dumbbell and the same dumbbell turned by $\pi$ are one configuration: $\theta$ is "
        r"periodic with period $\pi$.",
        Means.SYMBOLIC,
        heading_has_period,
        partial(heading_has_period, "pi/2"),
        figure="coordinates",
    ),
    Claim(
        "G10",
        "2",
        "coordinates of a dumbbell, sections 2 and 4",
        r"$\varphi, \eta$ of the centre and $\theta$ describe a dumbbell up to its spin; they form "
        "a manifold $M$ of dimension three.",
        Means.SYMBOLIC,
        positions_have,
        partial(positions_have, 4),
    ),
    Claim(
        "G11",
        "4",
        "definition of M, section 4, against section 2 and appendix A",
        r"$\theta$ is the angle from the meridian to the axis of the dumbbell.",
        Means.SYMBOLIC,
        heading_turns,
        partial(heading_turns, "axis", "meridian"),
    ),
    Claim(
        "G12",
        "2",
        "caption of the figure of the coordinates",
        "A zigzag of constant positive heading climbs along the drum, one of negative heading "
        "descends.",
        Means.SYMBOLIC,
        rolling_climbs,
        partial(rolling_climbs, "rho*tan(theta)"),
        figure="coordinates",
    ),
    Claim(
        "G13",
        "2",
        "sizes, section 2, against the captions of sections 3 and A",
        r"The dumbbells are short against the drum, $\ell/R \le 1/10$, with $r \le \ell/2$ and "
        "thinner rods.",
        Means.NUMERICAL,
        sizes_are,
        partial(sizes_are, 0.13),
    ),
    Claim(
        "G14",
        "4",
        "tilt as a body force, section 4",
        r"A drum tilted by $\alpha$ is a horizontal drum with an additional force $mg\sin\alpha$ "
        r"in the direction $-\eta$.",
        Means.SYMBOLIC,
        tilt_is_a_force,
        partial(tilt_is_a_force, "cos(alpha)"),
    ),
)
