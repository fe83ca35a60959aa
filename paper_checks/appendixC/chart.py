"""Appendix C: coordinates around a dyad in equilibrium, and the lemma in these coordinates.

``x1`` is a ball-ball gap, ``x2`` and ``x3`` are ball-rod gaps, ``x4, x5, x6`` the mean azimuth,
heading and axial position of the pair.
"""

from collections.abc import Callable
from functools import cache, partial

import numpy as np
import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.corner import PRINTED_HEADING, sizes
from paper_checks.section6.experiment import (
    CORNER,
    EXPERIMENT,
    PLANE,
    Interval,
    between,
    determinant,
    enclosed,
    exact,
    has,
    height,
    middle,
    multiplier,
    proof,
    rests,
    to_axis,
)
from polycorner import stationary_on
from polycorner.dumbbells import DumbbellPair

Array = np.ndarray
NEWTON = 8
STEPS = (0.02, 0.01, 0.005)


@cache
def distances() -> tuple[sympy.Expr, ...]:
    """Return ``d(A2, B1)``, ``d(alpha, B1)`` and ``d(A2, beta)``."""
    return between(EXPERIMENT, "A2", "B1"), to_axis(EXPERIMENT, "B1"), to_axis(EXPERIMENT, "A2")


@cache
def jacobian_determinant(locus: str, which: tuple[int, int, int] = (0, 1, 2)) -> Interval:
    """Return bounds of ``det dx/dq`` at a proved dyad, with three of the distances.

    In the variables ``(q1 + q2)/2`` and ``(q2 - q1)/2`` the rows of ``x4, x5, x6`` are the identity
    and zero, so the determinant is that of the distances by the latter, up to sign and the factor
    ``2^3`` of the change of variables.
    """
    q = EXPERIMENT.manifold.symbols
    found = proof(EXPERIMENT, locus)
    chosen = [distances()[k] for k in which]
    rows = [[enclosed(found, d.diff(q[k + 3]) - d.diff(q[k])) for k in range(3)] for d in chosen]
    low, high = determinant(rows)
    return low / 8, high / 8


@cache
def _compiled() -> tuple[Callable[[Array], Array], ...]:
    """Return the coordinates, their derivatives and the energy as functions of a point."""
    q = EXPERIMENT.manifold.symbols
    means = [(q[k] + q[k + 3]) / 2 for k in (0, 2, 1)]
    x = sympy.Matrix([*distances(), *means])
    energy = sympy.lambdify([q], height(EXPERIMENT), cse=True)
    return sympy.lambdify([q], x, cse=True), sympy.lambdify([q], x.jacobian(q), cse=True), energy


def energy_rise(locus: str, direction: int, step: float) -> float:
    """Return the increase of the energy when a single coordinate changes by ``step``."""
    values, slopes, energy = _compiled()
    here = rests(EXPERIMENT)[locus].point
    goal = values(here).ravel()
    goal[direction] += step
    q = here.copy()
    for _ in range(NEWTON):
        q = q - np.linalg.solve(slopes(q), values(q).ravel() - goal)
    return float(energy(q) - energy(here))


def exponents(locus: str) -> list[float]:
    """Return ``k`` for each coordinate along which the energy grows like the ``k``-th power.

    Gaps are opened, in mm; means are moved, in radians and mm.  Zero if the energy is constant.
    """
    found = []
    for direction in range(6):
        rises = [energy_rise(locus, direction, step) for step in STEPS]
        if max(map(abs, rises)) < 1e-12:
            found.append(0.0)
        elif min(rises) <= 0:
            found.append(float("nan"))
        else:
            found.append(float(np.log2(rises[-2] / rises[-1])))
    return found


# ----------------------------------------------------------------------- L4, L5: the coordinates


def are_coordinates(which: tuple[int, int, int] = (0, 1, 2)) -> Finding:
    """Check that three of the distances and the three means have a regular Jacobian."""
    sides = {name: jacobian_determinant(name, which) for name in ("delta_R", "delta_L")}
    regular = all(not has(side, 0) for side in sides.values())
    listed = ", ".join(f"{middle(side):.6f} at {name}" for name, side in sides.items())
    return Finding(
        Verdict.HOLDS if regular else Verdict.REFUTED,
        f"The Jacobian determinant of $(x_1, \\dots, x_6)$ is proved to be {listed} (mm$^3$); it "
        f"{'does not vanish' if regular else 'may vanish'}, and constants do not enter it.",
        {name: middle(side) for name, side in sides.items()},
    )


def gap_vanishes(radii: int = 1) -> Finding:
    """Check that ``x1 = d(A2, B1) - radii r`` is zero at the dyad; two radii would be."""
    r, zero = exact(EXPERIMENT.ball_radius), {}
    proofs = [proof(EXPERIMENT, name) for name in ("delta_R", "delta_L")]
    for number in {radii, 2}:
        sides = [enclosed(found, distances()[0] - number * r) for found in proofs]
        zero[number] = all(has(side, 0) for side in sides)
    value = middle(enclosed(proofs[0], distances()[0] - radii * r))
    failing = Verdict.CORRECTED if zero[2] else Verdict.REFUTED
    return Finding(
        Verdict.HOLDS if zero[radii] else failing,
        f"At $\\delta$, where the balls touch, $d(A_2, B_1) - {radii}\\,r$ is proved to be "
        f"{value:.6f} mm; $d(A_2, B_1) - 2r$ {'vanishes' if zero[2] else 'does not vanish'}.",
        {"x1": value},
        ""
        if zero[radii]
        else "$x_1 = d(A_2, B_1) - 2r$. As printed, $x_1 \\ge 0$ would let the balls overlap.",
    )


def rod_gaps_vanish(constant: str = "r + t") -> Finding:
    pair = EXPERIMENT
    sums = {"r + t": pair.ball_radius + pair.rod_radius, "2r": 2 * pair.ball_radius}
    found = [
        enclosed(proof(pair, name), d - exact(sums[constant]))
        for name in ("delta_R", "delta_L")
        for d in distances()[1:]
    ]
    status = proof(pair, "delta_R").conditions["inactive gaps positive"].value
    holds = all(has(side, 0) for side in found)
    largest = max(float(max(map(abs, side))) for side in found)
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"At $\\delta_R$ and $\\delta_L$ $x_2$ and $x_3$ are proved to be at most {largest:.1e} mm "
        "in size; that all gaps but the three are open there, so that these describe $D$, is "
        f"{status}.",
        {"largest": largest},
    )


def heading_coordinate(minus_for: str = "L") -> Finding:
    """Check that ``x5`` vanishes on the paper's own ``delta``: its sign only, not its value."""
    a = PRINTED_HEADING.subs(sizes(PLANE))
    values = {}
    for hand, theta in (("L", -a), ("R", a)):
        sign = -1 if hand == minus_for else 1
        values[hand] = sympy.simplify(theta + sign * a)
    holds = all(value == 0 for value in values.values())
    off = {k: float(sympy.deg(v)) for k, v in values.items()}
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED,
        "With section 6's own headings, $\\mp\\arctan(r/\\ell)$ on $\\delta_L$ and $\\delta_R$, "
        f"$x_5$ is {off['L']:.4f} degrees on $\\delta_L$ and {off['R']:.4f} on "
        "$\\delta_R$.",
        {f"x5_{k}": v for k, v in off.items()},
        ""
        if holds
        else "The plus sign is for $\\delta_L$ and the minus sign for $\\delta_R$ (and "
        "$\\arctan(r/\\ell)$ has to be replaced by the heading at the minimum).",
    )


def signature_is(claimed: tuple[int, int, int] = (1, 4, 1)) -> Finding:
    """Count the lemma's ``p, q, r`` in the paper's coordinates, in two ways."""
    found = proof(EXPERIMENT, "delta_R")
    presses = [multiplier(found, name) for name in CORNER]
    powers = {name: exponents(name) for name in ("delta_R", "delta_L")}
    observed = {
        tuple(sum(round(k) == power for k in row) for power in (1, 2, 0)) for row in powers.values()
    }
    proved = found.proved and all(low > 0 for low, _ in presses)
    right = (len(presses), 5 - len(presses), 1)
    known = proved and observed == {right}
    holds = known and claimed == right
    steps = ", ".join(f"{k:.3f}" for k in powers["delta_R"])
    slopes = ", ".join(f"{middle(side):.6f}" for side in presses)
    theta = PRINTED_HEADING.subs(sizes(EXPERIMENT))
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if known else Verdict.REFUTED,
        f"In these coordinates the derivatives of $E$ by $x_1, x_2, x_3$ are proved to be {slopes} "
        f"and the other three zero; moving one coordinate at a time, the energy rises with the "
        f"powers {steps} of the step. At the printed heading the derivative by $x_5$ is "
        f"{_slope_along_corner(theta):.4f} mm, so there the lemma applies with no $p$.",
        {"p": float(right[0]), "q": float(right[1]), "r": float(right[2])},
        ""
        if holds
        else "$(p, q, r) = (3, 2, 1)$: the first derivatives by $x_2$ and $x_3$ do not vanish, so "
        "they belong to the $p$ directions. So the lemma applies, at the computed heading.",
    )


def _slope_along_corner(theta: sympy.Expr) -> float:
    """Return the derivative of the energy by the mean heading along the corner, by differences."""
    h, angle = 1e-4, float(theta)
    low, high = (on_corner(EXPERIMENT, angle + d) for d in (-h, h))
    values = sympy.lambdify([EXPERIMENT.manifold.symbols], height(EXPERIMENT))
    return float(values(high) - values(low)) / (2 * h)


def on_corner(pair: DumbbellPair, heading: float) -> np.ndarray:
    """Return the pair in the corner with a given mean heading, balanced about the lowest line."""
    start = pair.nested("R", heading=heading, clearance=0.0)
    return stationary_on(pair.section(heading), pair.energy, start, CORNER).point


CLAIMS = (
    Claim(
        "L4a",
        "C",
        "definition of $x_1, \\dots, x_6$",
        "$x_1, \\dots, x_6$ are local coordinates of $M \\times M$ near $\\delta$.",
        Means.PROOF,
        are_coordinates,
        partial(are_coordinates, (0, 1, 1)),
    ),
    Claim(
        "L4b",
        "C",
        "definition of $x_1$",
        "$x_1 = d(A_2, B_1) - r$ vanishes on $\\delta$, and $x_1 \\ge 0$ describes $D$ there.",
        Means.PROOF,
        gap_vanishes,
        partial(gap_vanishes, radii=2),
    ),
    Claim(
        "L4c",
        "C",
        "definition of $x_2$ and $x_3$",
        "$x_2 = d(\\alpha, B_1) - r - t$ and $x_3 = d(A_2, \\beta) - r - t$ vanish on $\\delta$ "
        "and are not negative on $D$ nearby.",
        Means.PROOF,
        rod_gaps_vanish,
        partial(rod_gaps_vanish, "2r"),
    ),
    Claim(
        "L4d",
        "C",
        "definition of $x_5$ and the sentence after it",
        "$x_5 = \\theta \\pm \\arctan(r/\\ell)$ vanishes on $\\delta$, with the minus sign for "
        "$\\delta_L$ and the plus sign for $\\delta_R$.",
        Means.SYMBOLIC,
        heading_coordinate,
        partial(heading_coordinate, minus_for="R"),
    ),
    Claim(
        "L5",
        "C",
        "last paragraph",
        "At $\\delta$ the lemma applies with $(p, q, r) = (1, 4, 1)$.",
        Means.PROOF,
        signature_is,
        partial(signature_is, (3, 2, 1)),
    ),
)
