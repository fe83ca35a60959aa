"""Section 2: coordinates on the tilted cylinder, height, flow lines, and rotation.

Every identity is derived from the cylinder in space (:mod:`paper_checks.section2.cylinder`).
"""

import math
from functools import partial

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section2 import heading_angle
from paper_checks.section2.cylinder import (
    at_sample,
    fall,
    formula,
    frame,
    surface,
    symbols,
    tangents,
    typeset,
    unit_frame,
    vanishes,
)

AZIMUTH = "-atan(x/(-y*sin(alpha) + z*cos(alpha)))"
ALTITUDE = "y*cos(alpha) + z*sin(alpha)"
HEIGHT = "eta*sin(alpha) - R*cos(alpha)*cos(phi)"
FIELD = ("-cos(alpha)*sin(phi)/R", "-sin(alpha)")
FLOW = "sin(phi)/(R*tan(alpha))"


def _verdict(holds: object) -> Verdict:
    return Verdict.HOLDS if holds else Verdict.REFUTED


def coordinates_are(azimuth: str = AZIMUTH, altitude: str = ALTITUDE) -> Finding:
    import sympy

    s = symbols()
    place = dict(zip((s["x"], s["y"], s["z"]), surface(), strict=True))
    found, along = (formula(text).subs(place) for text in (azimuth, altitude))
    right = vanishes(along - s["eta"]) and vanishes(sympy.tan(found) - sympy.tan(s["phi"]))
    angles = [-150, -80, -20, 35, 80, 150]
    errors = {k: math.degrees(at_sample(found, phi=math.radians(k))) - k for k in angles}
    lower = right and all(abs(errors[k]) < 1e-9 for k in angles if abs(k) < 90)
    upper = max(abs(errors[k]) for k in angles if abs(k) > 90)
    verdict = Verdict.HOLDS if lower and upper < 1e-9 else Verdict.HOLDS_UNDER
    whole = formula("atan2(x, y*sin(alpha) - z*cos(alpha))").subs(place)
    repaired = max(abs(at_sample(whole, phi=math.radians(k)) - math.radians(k)) for k in angles)
    return Finding(
        verdict if lower else Verdict.REFUTED,
        f"On the embedded cylinder the second formula gives {typeset(sympy.simplify(along))}; the "
        f"first is off by {max(abs(errors[k]) for k in angles if abs(k) < 90):.1e} degrees at most "
        f"on the lower half and by {upper:.6g} degrees on the upper half, the two-argument "
        f"arctangent by {math.degrees(repaired):.1e} on both.",
        {"error_upper_half": upper},
        r"For $|\varphi| < \pi/2$, the region $\Omega$ of the experiment. On the whole cylinder "
        r"$\varphi = \mathrm{atan2}(x,\; y \sin\alpha - z \cos\alpha)$.",
    )


def metric_is(coefficients: tuple[str, str, str] = ("R**2", "0", "1")) -> Finding:
    import sympy

    around, along = tangents()
    pairs = ((around, around), (around, along), (along, along))
    found = [sympy.simplify(u.dot(v)) for u, v in pairs]
    return Finding(
        _verdict(all(vanishes(f - formula(c)) for f, c in zip(found, coefficients, strict=True))),
        "The first fundamental form of the embedding has the coefficients "
        f"{', '.join(typeset(f) for f in found)} of $d\\varphi^2$, $2\\,d\\varphi\\,d\\eta$ and "
        "$d\\eta^2$.",
    )


def geodesics_are(relation: str = "a*phi + b*eta + c") -> Finding:
    """Compute acceleration and torsion in space along the level curves of the relation."""
    import sympy

    s = symbols()
    f = formula(relation)
    turn = (-f.diff(s["eta"]), f.diff(s["phi"]))

    def along(v: sympy.Matrix) -> sympy.Matrix:
        return turn[0] * v.diff(s["phi"]) + turn[1] * v.diff(s["eta"])

    velocity = along(surface())
    acceleration = along(velocity)
    sideways = sympy.simplify(velocity.cross(acceleration).dot(unit_frame()[2]))
    if sideways != 0:
        return Finding(
            Verdict.REFUTED,
            f"The acceleration along the surface, across the curve, is {typeset(sideways)}.",
        )
    binormal = velocity.cross(acceleration)
    size = sympy.simplify(binormal.dot(binormal))
    square = sympy.simplify(size / velocity.dot(velocity) ** 3)
    torsion = sympy.simplify(binormal.dot(along(acceleration)) / size)
    helix = not (square.has(s["phi"], s["eta"]) or torsion.has(s["phi"], s["eta"]))
    ends = square.subs(s["b"], 0), torsion.subs(s["a"], 0)
    return Finding(
        _verdict(helix and ends == (0, 0)),
        f"The acceleration along the surface, across the curve, is {typeset(sideways)}: one such "
        "curve leaves every point in every direction. Its curvature squared is "
        f"{typeset(square)}, {typeset(ends[0])} for $b = 0$ (a line), and its torsion "
        f"{typeset(torsion)}, {typeset(ends[1])} for $a = 0$ (a circle), both constant: a helix.",
    )


def lowest_line_is(azimuth: str = "0") -> Finding:
    import sympy

    phi = symbols()["phi"]
    height = surface()[2]
    level = sympy.solve(height.diff(phi), phi)
    values = {point: height.subs(phi, point) for point in level}
    lowest = min(level, key=lambda point: at_sample(values[point]))
    rise = sympy.simplify(height - height.subs(phi, formula(azimuth)))
    return Finding(
        _verdict(vanishes(lowest - formula(azimuth))),
        f"The height is stationary along a latitude at {', '.join(map(typeset, level))}, lowest at "
        f"{typeset(lowest)}; above the meridian at {typeset(formula(azimuth))} it is "
        f"{typeset(rise)}.",
    )


def height_is(printed: str = HEIGHT) -> Finding:
    height = surface()[2]
    return Finding(
        _verdict(vanishes(height - formula(printed))),
        f"The third coordinate of the embedding is {typeset(height)}; at a sample point it is "
        f"{at_sample(height):.6f} mm, the printed formula {at_sample(formula(printed)):.6f} mm.",
        {"height": at_sample(height), "printed": at_sample(formula(printed))},
    )


def field_is(printed: tuple[str, str] = FIELD) -> Finding:
    import sympy

    around, along = tangents()
    pushed = formula(printed[0]) * around + formula(printed[1]) * along
    difference = (pushed - fall()).applyfunc(sympy.simplify)
    parts = [sympy.simplify(fall().dot(v) / v.dot(v)) for v in (around, along)]
    return Finding(
        _verdict(difference.is_zero_matrix),
        "The part of the downward unit vector along the surface is "
        f"{typeset(parts[0])} times $\\partial/\\partial\\varphi$ plus {typeset(parts[1])} times "
        "$\\partial/\\partial\\eta$; the printed field differs by a vector of "
        f"{math.sqrt(sum(at_sample(entry) ** 2 for entry in difference)):.3g} at a sample point.",
    )


def flow_lines_are(slope: str = FLOW) -> Finding:
    import sympy

    s = symbols()
    around, along = tangents()
    found = sympy.simplify(
        fall().dot(around) / around.dot(around) / (fall().dot(along) / along.dot(along))
    )
    solution = 2 * sympy.atan(s["c"] * sympy.exp(s["eta"] / (s["R"] * sympy.tan(s["alpha"]))))
    solved = vanishes(sympy.expand_trig(solution.diff(s["eta"]) - found.subs(s["phi"], solution)))
    return Finding(
        _verdict(vanishes(found - formula(slope)) and solved),
        f"The field in space gives $d\\varphi/d\\eta =$ {typeset(found)}, solved by "
        f"$\\varphi =$ {typeset(solution)} with a constant $c$; it needs $\\alpha \\ne 0$, since "
        "in a horizontal drum the flow runs around the drum.",
    )


def flow_crosses_level_curves_at(angle: float = 90.0, slope: str = FLOW) -> Finding:
    import sympy

    s = symbols()
    around, along = tangents()
    height = surface()[2]
    level = -height.diff(s["eta"]) * around + height.diff(s["phi"]) * along
    flow = formula(slope) * around + along
    product = sympy.simplify(level.dot(flow))
    cosine = at_sample(level.dot(flow) / level.norm() / flow.norm())
    on_lowest = formula(slope).subs(s["phi"], 0)
    strength = sympy.simplify(fall().dot(fall()).subs(s["phi"], 0))
    crossing = math.degrees(math.acos(cosine))
    right = abs(crossing - angle) < 1e-9 and (product == 0) == (angle == 90) and on_lowest == 0
    return Finding(
        _verdict(right),
        f"The scalar product in space of the tangents to a flow line and to a level curve is "
        f"{typeset(product)}, an angle of {crossing:.6f} degrees at a sample point; on "
        f"$\\varphi = 0$ the slope is {typeset(on_lowest)} and the field, of squared length "
        f"{typeset(strength)}, does not vanish as long as the drum is tilted.",
        {"angle": crossing},
    )


def rotation_moves_to(image: tuple[str, str] = ("phi + omega*t", "eta")) -> Finding:
    """Turn the point about the axis by Rodrigues' formula, in either sense, and compare."""
    import sympy

    s = symbols()
    point, turn = surface(), s["omega"] * s["t"]
    ends = {s["phi"]: formula(image[0]), s["eta"]: formula(image[1])}
    claimed, numbers = point.subs(ends, simultaneous=True), {"omega": 0.01, "t": 30.0}

    def apart(about: sympy.Matrix) -> sympy.Matrix:
        turned = (
            point * sympy.cos(turn)
            + about.cross(point) * sympy.sin(turn)
            + about * about.dot(point) * (1 - sympy.cos(turn))
        )
        return turned - claimed

    gaps = {k: apart(k * frame()[0]) for k in (1, -1)}
    off = {k: math.sqrt(sum(at_sample(e, **numbers) ** 2 for e in v)) for k, v in gaps.items()}
    sense = min(off, key=lambda k: off[k])
    right = all(vanishes(e) for e in gaps[sense])
    return Finding(
        _verdict(right),
        "The embedded point, turned in space by $\\omega t$ about the axis pointed "
        f"{'uphill' if sense > 0 else 'downhill'}, and the point at the printed coordinates are "
        f"{off[sense]:.3g} mm apart after {numbers['t']:g} s at {numbers['omega']:g} rad/s; in the "
        f"other sense {off[-sense]:.3g} mm.",
        {"apart": off[sense]},
    )


_PLACE = "coordinates, section 2"

CYLINDER = (
    Claim(
        "G1a",
        "2",
        "definition of the coordinates, section 2",
        r"$\varphi = -\arctan(x/(z\cos\alpha - y\sin\alpha))$ and "
        r"$\eta = y\cos\alpha + z\sin\alpha$ are azimuth, from the lowest line, and position along "
        "the axis of the tilted cylinder.",
        Means.SYMBOLIC,
        coordinates_are,
        partial(coordinates_are, "atan(x/(-y*sin(alpha) + z*cos(alpha)))"),
        figure="coordinates",
    ),
    Claim(
        "G1b",
        "2",
        _PLACE,
        r"Lengths on the surface are given by $ds^2 = R^2 d\varphi^2 + d\eta^2$.",
        Means.SYMBOLIC,
        metric_is,
        partial(metric_is, ("R**2*cos(alpha)**2", "0", "1")),
    ),
    Claim(
        "G2",
        "2",
        _PLACE,
        r"The geodesics are the linear relations $a\varphi + b\eta + c = 0$: helices, with "
        "meridians and latitudes as special cases.",
        Means.SYMBOLIC,
        geodesics_are,
        partial(geodesics_are, "a*phi**2 + b*eta + c"),
    ),
    Claim(
        "G3",
        "2",
        _PLACE,
        r"$\varphi = 0$ is the lowest straight line on the cylinder.",
        Means.SYMBOLIC,
        lowest_line_is,
        partial(lowest_line_is, "pi"),
    ),
    Claim(
        "G4",
        "2",
        "height formula, section 2",
        r"The height is $z = \eta\sin\alpha - R\cos\alpha\cos\varphi$.",
        Means.SYMBOLIC,
        height_is,
        partial(height_is, "eta*sin(alpha) + R*cos(alpha)*cos(phi)"),
    ),
    Claim(
        "G5",
        "2",
        "equation for F_T, section 2",
        r"$F_T = -\mathrm{grad}\,z$ has the components $-\cos\alpha\sin\varphi\,R^{-1}$ and "
        r"$-\sin\alpha$ in the basis $\partial/\partial\varphi$, $\partial/\partial\eta$.",
        Means.SYMBOLIC,
        field_is,
        partial(field_is, ("-cos(alpha)*sin(phi)", "-sin(alpha)")),
        figure="flow_lines",
    ),
    Claim(
        "G6",
        "2",
        "flow lines, section 2",
        r"The flow lines of $F_T$ satisfy $d\varphi/d\eta = \sin\varphi/(R\tan\alpha)$.",
        Means.SYMBOLIC,
        flow_lines_are,
        partial(flow_lines_are, "R*sin(phi)/tan(alpha)"),
        figure="flow_lines",
    ),
    Claim(
        "G7",
        "2",
        "flow lines, section 2",
        r"Flow lines meet level curves of the height at right angles everywhere, and the line "
        r"$\varphi = 0$ is one of them.",
        Means.SYMBOLIC,
        flow_crosses_level_curves_at,
        partial(flow_crosses_level_curves_at, slope="R*sin(phi)/tan(alpha)"),
        figure="flow_lines",
    ),
    Claim(
        "G8",
        "2",
        "rotation of the cylinder, section 2",
        r"In the time $t$ the rotation carries $(\varphi, \eta)$ to $(\varphi + \omega t, \eta)$.",
        Means.SYMBOLIC,
        rotation_moves_to,
        partial(rotation_moves_to, ("phi + omega*t/R", "eta")),
    ),
)

CLAIMS: tuple[Claim, ...] = CYLINDER + heading_angle.CLAIMS
