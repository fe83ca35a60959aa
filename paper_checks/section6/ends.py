"""Section 6: the global minimum, two dumbbells end to end on the lowest line."""

from collections.abc import Callable
from functools import partial

import numpy as np
import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from paper_checks.section6.corner import BALL, LENGTH, sizes
from paper_checks.section6.experiment import EXPERIMENT, exact, height
from polycorner import stratum_at
from polycorner.dumbbells import DumbbellPair


def least_at(azimuth: sympy.Expr = sympy.S.Zero, heading: sympy.Expr = sympy.S.Zero) -> Finding:
    """Check the claimed minimisers of the energy.

    ``E - 4 r`` is a sum of terms ``2 rho (1 - cos phi)`` and ``2 rho cos phi (1 - c)`` with
    ``c = sqrt(1 - (l sin theta / 2 rho)^2)``, none negative where ``cos phi > 0``.
    """
    pair = EXPERIMENT
    names = pair.manifold.symbols
    rho, half = exact(pair.centre_radius), exact(pair.length) / 2
    excess = height(pair) - 4 * exact(pair.ball_radius)
    terms = []
    for phi, theta in ((names[0], names[2]), (names[3], names[5])):
        depth = sympy.sqrt(1 - (half * sympy.sin(theta) / rho) ** 2)
        terms += [2 * rho * (1 - sympy.cos(phi)), 2 * rho * sympy.cos(phi) * (1 - depth)]
    identity = sympy.simplify(excess - sum(terms)) == 0
    place = {names[k]: azimuth for k in (0, 3)} | {names[k]: heading for k in (2, 5)}
    above = sympy.simplify(excess.subs(place))
    return Finding(
        Verdict.HOLDS if identity and above == 0 else Verdict.REFUTED,
        f"There $E$ is {float(above):.4g} mm above $4r$, and $E - 4r$ is the sum of "
        f"{len(terms)} terms $2\\rho(1 - \\cos\\varphi_k)$ and $2\\rho\\cos\\varphi_k(1 - c_k)$ "
        "with $c_k = \\sqrt{1 - (\\ell\\sin\\theta_k/2\\rho)^2}$, which vanish together only for "
        "$\\varphi_k = 0$ and $\\sin\\theta_k = 0$.",
        {"above_least": float(above)},
    )


def strata_of_ends(apart: int = 6, touching: int = 5) -> Finding:
    pair = EXPERIMENT
    found = [stratum_at(pair.polyhedron, pair.end_to_end(gap=gap)) for gap in (1.0, 0.0)]
    holds = [stratum.dimension for stratum in found] == [apart, touching]
    return Finding(
        Verdict.HOLDS if holds else Verdict.REFUTED,
        f"With a gap the pair lies on a stratum of dimension {found[0].dimension}; touching, with "
        f"{len(found[1].active)} contact ({', '.join(found[1].active)}), on one of dimension "
        f"{found[1].dimension}.",
        {"apart": found[0].dimension, "touching": found[1].dimension},
    )


def gap_of_ends(
    gap: sympy.Expr = LENGTH + 2 * BALL, components: int = 2, pair: DumbbellPair = EXPERIMENT
) -> Finding:
    """Find the allowed separations on the lowest line by a scan, and their ends by bisection."""

    def allowed(apart: float) -> bool:
        return bool(pair.polyhedron.contains([0, -apart / 2, 0, 0, apart / 2, 0]))

    reach = 4 * pair.length
    scan = np.linspace(-reach, reach, 1601)
    inside = np.array([allowed(x) for x in scan])
    steps = np.flatnonzero(inside[1:] != inside[:-1])
    pieces = int(inside[0]) + int((~inside[:-1] & inside[1:]).sum())
    ends = [_switch(allowed, scan[k], scan[k + 1]) for k in steps]
    claimed = float(gap.subs(sizes(pair)))
    right = pair.length + 2 * pair.ball_radius
    error, truth = (max(abs(abs(x) - value) for x in ends) for value in (claimed, right))
    holds = error < 1e-9 and pieces == components
    known = truth < 1e-9
    return Finding(
        Verdict.HOLDS if holds else Verdict.CORRECTED if known else Verdict.REFUTED,
        f"On the lowest line the axial distances that are allowed form {pieces} intervals, which "
        f"end at {', '.join(f'{x:.9f}' for x in ends)} mm; $\\ell + 2r = {right:g}$ mm. The two "
        "dumbbells are distinguished here: otherwise there is one component.",
        {"components": pieces, "end": abs(ends[0])},
        "" if holds else f"{pieces} components, with $|\\eta_1 - \\eta_2| \\ge \\ell + 2r$.",
    )


def _switch(allowed: Callable[[float], bool], low: float, high: float) -> float:
    first = allowed(low)
    for _ in range(60):
        half = (low + high) / 2
        low, high = (half, high) if allowed(half) == first else (low, half)
    return (low + high) / 2


CLAIMS = (
    Claim(
        "E1a",
        "6",
        "first paragraph",
        "The energy of a pair is least where $\\varphi_1 = \\varphi_2 = 0$ and $\\theta_1 = "
        "\\theta_2 = 0$, and only there.",
        Means.SYMBOLIC,
        least_at,
        partial(least_at, heading=sympy.pi / 2),
    ),
    Claim(
        "E1b",
        "6",
        "first paragraph",
        "Pairs in $G$ belong to $D_6$ if they do not touch, and to $D_5$ if they touch.",
        Means.NUMERICAL,
        strata_of_ends,
        partial(strata_of_ends, touching=4),
    ),
    Claim(
        "E1c",
        "6",
        "first paragraph",
        "$G$ has two components, given by $\\eta_1 - \\eta_2 \\ge \\ell + 2r$ and by "
        "$\\eta_2 - \\eta_1 \\ge \\ell + 2r$.",
        Means.NUMERICAL,
        gap_of_ends,
        partial(gap_of_ends, LENGTH + BALL),
    ),
)
