"""Appendix A: the forces on a dumbbell in the tilted drum.

Everything is derived from the position of a point on the wall, independently of the library;
printed formulas enter as parameters of a check.
"""

import math
from collections.abc import Sequence
from functools import cache, partial
from typing import Any

from paper_checks.framework.claims import Claim, Finding, Means, Verdict

TILT = math.radians(7.0)
STATIC = (0.1, 0.3)  # coefficients of rolling and sliding, from the text
COSINE = "cos(alpha)*sin(phi)*cos(theta) - sin(alpha)*sin(theta)"
SIZE = "sqrt(cos(alpha)**2*sin(phi)**2 + sin(alpha)**2)"
NAMES = "phi eta theta alpha R mu"


@cache
def frame() -> Any:
    """Return symbols and ``-z`` along ``e_phi / R``, ``e_eta`` and the outward normal."""
    import sympy

    symbols = dict(zip(NAMES.split(), sympy.symbols(NAMES, real=True), strict=True))
    phi, eta, _, alpha, R, _ = symbols.values()
    across = -R * sympy.cos(phi)  # the coordinate that is z in a level drum
    y = eta * sympy.cos(alpha) - across * sympy.sin(alpha)
    z = eta * sympy.sin(alpha) + across * sympy.cos(alpha)
    place = sympy.Matrix([R * sympy.sin(phi), y, z])
    legs = (place.diff(phi) / R, place.diff(eta), place.diff(R))
    down = tuple(sympy.simplify(-leg[2]) for leg in legs)
    return symbols, down


def parsed(formula: str) -> Any:
    """Return a printed formula as an expression in the symbols of :func:`frame`."""
    import sympy

    return sympy.sympify(formula, locals=frame()[0])


def is_zero(expression: Any) -> bool:
    """Return whether an expression vanishes identically."""
    import sympy

    return bool(sympy.simplify(sympy.expand_trig(expression)) == 0)


def tex(expression: Any) -> str:
    import sympy

    return f"${sympy.latex(expression)}$"


def row(entries: Any) -> str:
    """Return expressions as a row vector in TeX."""
    import sympy

    return f"$({', '.join(sympy.latex(entry) for entry in entries)})$"


def does(holds: bool) -> str:
    return "does" if holds else "does not"


def judged(holds: bool, otherwise: Verdict = Verdict.REFUTED) -> Verdict:
    return Verdict.HOLDS if holds else otherwise


# ------------------------------------------------------------------------------------------- forces


def pressure_is(formula: str = "cos(alpha)*cos(phi)") -> Finding:
    import sympy

    _, (east, north, normal) = frame()
    claimed = parsed(formula)
    rest = sympy.simplify(1 - east**2 - north**2 - claimed**2)
    holds = is_zero(normal - claimed) and rest == 0
    evidence = (
        f"the outward component of $-\\hat z$ is {tex(normal)}, claimed {tex(claimed)}; $1 - "
        f"|F_T|^2$ minus its square is {tex(rest)}"
    )
    return Finding(judged(holds), evidence)


def decomposition_has_sign(sign: int = 1) -> Finding:
    """Compare ``sign * d/dz`` with ``F_T + F_N`` for the paper's ``F_T = -grad z``."""
    _, (east, north, normal) = frame()
    printed = (parsed("-cos(alpha)*sin(phi)"), parsed("-sin(alpha)"))
    tangent = all(is_zero(sign * -a - b) for a, b in zip((east, north), printed, strict=True))
    opposite = all(is_zero(-sign * -a - b) for a, b in zip((east, north), printed, strict=True))
    evidence = (
        f"along the wall $-\\hat z$ is ({tex(east)}, {tex(north)}), which is the $F_T$ of section "
        f"2; this {does(tangent)} agree with the stated sign and {does(opposite)} with the other"
    )
    return Finding(
        judged(tangent, Verdict.CORRECTED if opposite else Verdict.REFUTED),
        evidence,
        correction=f"$-\\partial/\\partial z = F_T + F_N$ with $|F_N| = $ {tex(normal)}",
    )


def ratio_is(formulas: Sequence[str] = ("-tan(phi)", "-tan(alpha)/cos(phi)")) -> Finding:
    _, (east, north, normal) = frame()
    claimed = [parsed(f) for f in formulas]
    found = (east / normal, north / normal)
    holds = all(is_zero(a - b) for a, b in zip(found, claimed, strict=True))
    listed = ", ".join(tex(c) for c in claimed)
    return Finding(
        judged(holds),
        f"$F_T/|F_N|$ in unit vectors along $\\varphi, \\eta$ {does(holds)} equal ({listed})",
    )


def axes_are(
    axis: Sequence[str] = ("sin(theta)", "cos(theta)"),
    rolling: Sequence[str] = ("-cos(theta)", "sin(theta)"),
) -> Finding:
    """Check that the pair is orthonormal and ``u_r`` is ``u_s`` turned by ``+pi/2``."""
    import sympy

    u, w = (sympy.Matrix([parsed(f) for f in v]) for v in (axis, rolling))
    turned = sympy.Matrix([[0, -1], [1, 0]]) * u
    apart = sympy.simplify(w - turned)
    lengths = [sympy.simplify(v.dot(v)) for v in (u, w)]
    holds = apart.is_zero_matrix and lengths == [1, 1]
    evidence = (
        f"$|u_s|^2, |u_r|^2 = {lengths[0]}, {lengths[1]}$; $u_r$ minus $u_s$ turned by $+\\pi/2$ "
        f"is {row(apart)}"
    )
    return Finding(judged(bool(holds)), evidence)


def cosine_is(formula: str = COSINE) -> Finding:
    """Compare with ``F_T . u_r / |F_T|``, the cosine of the angle."""
    import sympy

    symbols, (east, north, _) = frame()
    theta = symbols["theta"]
    dot = -east * sympy.cos(theta) + north * sympy.sin(theta)
    size = sympy.sqrt(east**2 + north**2)
    claimed = parsed(formula)
    holds, without = is_zero(claimed - dot / size), is_zero(claimed - dot)
    at = {symbols["alpha"]: TILT, symbols["phi"]: 0.1, theta: 0.1}
    values = {"printed": float(claimed.subs(at)), "cosine": float((dot / size).subs(at))}
    evidence = (
        f"the formula {does(without)} equal $F_T \\cdot u_r = $ {tex(sympy.simplify(dot))} and "
        f"{does(holds)} equal its quotient by $|F_T| = $ {tex(sympy.simplify(size))}. At $\\alpha "
        f"= 7°$, $\\varphi = \\theta = 0.1$ the formula gives {values['printed']:.4f}, the cosine "
        f"is {values['cosine']:.4f}"
    )
    return Finding(
        judged(holds, Verdict.CORRECTED if without else Verdict.REFUTED),
        evidence,
        values,
        "$\\cos\\vartheta = (\\cos\\alpha\\sin\\varphi\\cos\\theta - \\sin\\alpha\\sin\\theta) / "
        "\\sqrt{\\cos^2\\alpha\\sin^2\\varphi + \\sin^2\\alpha}$",
    )


def limit_is(formula: str = "asin(sqrt((mu**2 - tan(alpha)**2)/(1 + mu**2)))") -> Finding:
    """Check that ``|F_T| = mu |F_N|`` there, and that the ratio grows with ``|phi|``."""
    import sympy

    symbols, (east, north, normal) = frame()
    sine = sympy.Symbol("s", real=True)
    square = (east**2 + north**2 - (symbols["mu"] * normal) ** 2).subs(
        sympy.cos(symbols["phi"]) ** 2, 1 - sympy.sin(symbols["phi"]) ** 2
    )
    square = square.subs(sympy.sin(symbols["phi"]) ** 2, sine)
    claimed = parsed(formula)
    left = sympy.simplify(square.subs(sine, sympy.sin(claimed) ** 2))
    grows = sympy.simplify(square.diff(sine))
    value = math.degrees(float(claimed.subs({symbols["mu"]: 0.3, symbols["alpha"]: TILT})))
    evidence = (
        f"$|F_T|^2 - \\mu^2|F_N|^2$ at the stated azimuth is {tex(left)} and grows with "
        f"$\\sin^2\\varphi$ at the rate {tex(grows)}; for $\\mu_s = 0.3$ at 7° it is {value:.2f}°"
    )
    return Finding(judged(left == 0), evidence, {"limit": value})


def curve_is_flow_line(heading: str = "atan(sin(phi)/tan(alpha))") -> Finding:
    """Check that on ``S`` the axis is along ``F_T``, so that there is no pull across it."""
    import sympy

    symbols, (east, north, _) = frame()
    theta = parsed(heading)
    along = sympy.simplify(sympy.sin(theta) * north - sympy.cos(theta) * east)
    slope = sympy.simplify(sympy.tan(theta) - east / north)  # R dphi / deta of a flow line
    holds = along == 0 and slope == 0
    steep = math.degrees(float(theta.subs({symbols["phi"]: math.pi / 2, symbols["alpha"]: TILT})))
    evidence = (
        f"with $\\theta = $ {tex(theta)}, $F_T \\cdot u_r = $ {tex(along)} and $\\tan\\theta$ "
        f"less the slope of a flow line is {tex(slope)}; at 7° the curve ends at {steep:.2f}°"
    )
    return Finding(judged(holds), evidence, {"end": steep})


def curves_are_flow_lines_of(field: str = "vertical") -> Finding:
    """Check that a field is tangent to the wall, so that its flow lines lie on it."""
    _, (east, north, normal) = frame()
    across = {"vertical": normal, "F_T": parsed("0")}[field]
    holds = is_zero(across)
    return Finding(
        judged(holds, Verdict.CORRECTED),
        f"the component of the field out of the wall is {tex(across)}; its tangential part is "
        f"({tex(east)}, {tex(north)})",
        correction="the curves on the drum are flow lines of $F_T$, the tangential part of "
        "$-\\partial/\\partial z$, which itself is not tangent to the drum",
    )


CLAIMS = (
    Claim(
        "F4a",
        "A",
        "equation for the limit of rest",
        "no dumbbell rests beyond $\\varphi_s = \\arcsin\\sqrt{(\\mu_s^2 - "
        "\\tan^2\\alpha)/(1+\\mu_s^2)}$",
        Means.SYMBOLIC,
        limit_is,
        partial(limit_is, "asin(sqrt((mu**2 - tan(alpha)**2)/(1 - mu**2)))"),
    ),
    Claim(
        "F5a",
        "A",
        "normal force",
        "$|F_N| = \\sqrt{1-|F_T|^2} = \\cos\\alpha\\cos\\varphi$",
        Means.SYMBOLIC,
        pressure_is,
        partial(pressure_is, "cos(alpha)"),
    ),
    Claim(
        "F5b",
        "A",
        "decomposition of the vertical field",
        "$\\partial/\\partial z = F_T + F_N$ with the $F_T = -\\mathrm{grad}\\,z$ of section 2",
        Means.SYMBOLIC,
        decomposition_has_sign,
        partial(decomposition_has_sign, -1),
    ),
    Claim(
        "F6a",
        "A",
        "ratio of forces",
        "$f_T/|f_N| = -\\tan\\varphi\\,R^{-1}\\partial_\\varphi - "
        "(\\tan\\alpha/\\cos\\varphi)\\,\\partial_\\eta$",
        Means.SYMBOLIC,
        ratio_is,
        partial(ratio_is, ("-tan(phi)", "-sin(alpha)/cos(phi)")),
    ),
    Claim(
        "F6b",
        "A",
        "axial and rolling directions",
        "$u_s = (\\sin\\theta, \\cos\\theta)$ and $u_r = (-\\cos\\theta, \\sin\\theta)$ are unit "
        "vectors, $u_r$ at $+\\pi/2$ from $u_s$",
        Means.SYMBOLIC,
        axes_are,
        partial(axes_are, rolling=("cos(theta)", "-sin(theta)")),
    ),
    Claim(
        "F7a",
        "A",
        "angle between force and rolling direction",
        "$\\cos\\vartheta = \\cos\\alpha\\sin\\varphi\\cos\\theta - \\sin\\alpha\\sin\\theta$",
        Means.SYMBOLIC,
        cosine_is,
        partial(cosine_is, f"({COSINE})/{SIZE}"),
    ),
    Claim(
        "F8a",
        "A",
        "curve $S$",
        "$\\vartheta = \\pi/2$ exactly where the dumbbell lies along a flow line, and there it "
        "does not roll however small $\\mu_r$",
        Means.SYMBOLIC,
        curve_is_flow_line,
        partial(curve_is_flow_line, "atan(tan(phi)/tan(alpha))"),
        figure="torque",
    ),
    Claim(
        "F8b",
        "A",
        "curve $S$",
        "the curves of steepest descent on the drum are flow lines of $\\partial/\\partial z$",
        Means.SYMBOLIC,
        curves_are_flow_lines_of,
        partial(curves_are_flow_lines_of, "F_T"),
    ),
)
