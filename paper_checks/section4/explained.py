"""Section 4: explanations of the motion of a single dumbbell."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from paper_checks.appendixA.forces import STATIC, frame, is_zero, judged, row, tex
from paper_checks.appendixA.torque import DRUM, potential
from paper_checks.framework.claims import Claim, Finding, Means, Verdict
from polycorner.dumbbells.dynamics.singles import follow, keel_ratio, zigzags
from polycorner.motion import Noise

LEVEL = replace(DRUM, tilt=0.0)


def energy_is_least_at(azimuth: float = 0.0, heading: float = 0.0) -> Finding:
    """Check stationarity, the Hessian, and values elsewhere, of the energy in a level drum."""
    import sympy

    (phi, eta, theta, alpha, k), height = potential()
    energy = height.subs({alpha: 0, k: sympy.Rational(8, 61)})
    at = {phi: sympy.rad(azimuth), theta: sympy.rad(heading)}
    gradient = [sympy.simplify(energy.diff(x).subs(at)) for x in (phi, eta, theta)]
    hessian = sympy.hessian(energy, (phi, theta)).subs(at).evalf()
    values = sympy.lambdify((phi, theta), energy)
    grid = values(*np.meshgrid(np.linspace(-1.4, 1.4, 281), np.linspace(-1.57, 1.57, 281)))
    least = float(grid.min() - values(math.radians(azimuth), math.radians(heading)))
    curved = [float(hessian[i, i]) for i in range(2)]
    holds = gradient == [0, 0, 0] and min(curved) > 0 and least >= -1e-12
    return Finding(
        judged(holds),
        f"there the gradient along $\\varphi, \\eta, \\theta$ is {row(gradient)}, the Hessian has "
        f"the diagonal {curved[0]:.5f}, {curved[1]:.5f} (in units of $R$), and elsewhere the "
        f"energy is lower by at most {max(0.0, -least):.2e}",
        {"curvature_phi": curved[0], "curvature_theta": curved[1]},
    )


def is_saddle_at(heading: float = 90.0) -> Finding:
    """Check that the energy in a level drum is stationary, and decreases along the heading."""
    import sympy

    (phi, _, theta, alpha, k), height = potential()
    energy = height.subs({alpha: 0, k: sympy.Rational(8, 61)})
    at = {phi: 0, theta: sympy.rad(heading)}
    gradient = [sympy.simplify(energy.diff(x).subs(at)) for x in (phi, theta)]
    curved = [float(energy.diff(x, 2).subs(at)) for x in (phi, theta)]
    holds = gradient == [0, 0] and curved[1] < 0 < curved[0]
    return Finding(
        judged(holds),
        f"at heading {heading:g}° on the lowest line the slopes are {row(gradient)} and the "
        f"second derivatives {curved[0]:.5f} along $\\varphi$ and {curved[1]:.5f} along "
        "$\\theta$, in units of $R$",
        {"curvature_phi": curved[0], "curvature_theta": curved[1]},
    )


def noise_leads_to_the_minimum(chatter: float = 1.0) -> Finding:
    """Shake dumbbells in a level drum at rest, from 8.6 degrees up the wall."""
    still = replace(LEVEL, spin=0.0)
    headings = np.radians([40.0, -40.0, 20.0, 80.0])
    noise = Noise(chatter=chatter, seed=5)
    path = follow(still, headings, 40.0, azimuth=0.15, noise=noise, dt=2e-3)
    phi, theta = (np.degrees(np.abs(path.q[-1, :, i])).max() for i in (0, 2))
    return Finding(
        Verdict.HOLDS_UNDER if max(phi, theta) < 3.0 else Verdict.REFUTED,
        f"shaken with A = {chatter:g} for 40 s, dumbbells from azimuth {math.degrees(0.15):.1f}° "
        f"and headings 40°, -40°, 20°, 80° are within {phi:.2f}° of the lowest line and "
        f"{theta:.2f}° of its direction",
        {"azimuth": float(phi), "heading": float(theta)},
        "in a drum at rest; a turning drum keeps a dumbbell at the azimuths of its zigzag",
    )


def keel_needs(sliding: float = STATIC[1]) -> Finding:
    """Compare a climb with that of a perfect keel, for a static coefficient of sliding."""
    drum = replace(LEVEL, sliding=(sliding, min(sliding, DRUM.sliding[1])))
    found = keel_ratio(drum, math.radians(10.0), duration=20.0)
    raft = keel_ratio(replace(LEVEL, sliding=(0.1, 0.1)), math.radians(10.0), duration=20.0)
    return Finding(
        judged(abs(found - 1) < 0.01 and abs(raft) < 0.1),
        f"in a level drum a dumbbell with $\\mu_s = {sliding:g}$ climbs {found:.6f} times as fast "
        f"as $\\omega(R-r)\\tan\\theta$, one that slides as easily as it rolls {raft:.4f} times",
        {"keel": found, "raft": raft},
    )


def rises_in_energy(heading: float = 10.0) -> Finding:
    """Check that the energy at onsets grows from zigzag to zigzag."""
    path = follow(DRUM, [math.radians(heading)], 60.0)
    (zigzag,) = zigzags(path, DRUM.spin)
    at = [path.at(t) for t in zigzag.starts]
    steps = np.diff(path.potential[at])
    return Finding(
        judged(bool((steps > 0).all())),
        f"over {len(steps)} zigzags of heading {heading:g}° the energy at the onsets changes by "
        f"{steps.min():.2f} to {steps.max():.2f} nJ each",
        {"least": float(steps.min()), "largest": float(steps.max())},
    )


def level_heading_rolls_in_place(heading: float = 0.0) -> Finding:
    path = follow(LEVEL, [math.radians(heading)], 40.0)
    moved = float(np.abs(path.q[:, 0, 1] - path.q[0, 0, 1]).max())
    turned = float(abs(path.q[-1, 0, 3]))
    return Finding(
        judged(moved < 1e-6 and turned > 1.0),
        f"in 40 s in a level drum it turns {turned:.2f} rad about its axis and moves {moved:.1e} "
        "mm along the drum",
        {"moved": moved, "turned": turned},
    )


def steep_rolls_down(part: str = "sin(theta)") -> Finding:
    """Check that on the lowest line the weight makes a dumbbell roll towards smaller ``eta``.

    ``part`` is the component of ``u_r`` along the drum.
    """
    import sympy

    symbols, (east, north, _) = frame()
    theta = symbols["theta"]
    pull = (-east * sympy.cos(theta) + north * sympy.sin(theta)).subs(symbols["phi"], 0)
    along = sympy.simplify(pull * sympy.sympify(part, locals=symbols))
    claimed = -sympy.sin(symbols["alpha"]) * sympy.sin(theta) ** 2
    holds = is_zero(along - claimed)
    return Finding(
        judged(holds),
        f"at $\\varphi = 0$ the pull along $u_r$ is {tex(sympy.simplify(pull))}; its part along "
        "the "
        f"drum is {tex(along)}, " + ("never upwards" if holds else "of either sign"),
    )


CLAIMS = (
    Claim(
        "O8",
        "4",
        "keel effect",
        "a dumbbell has a keel because it slides less easily than it rolls",
        Means.SIMULATION,
        keel_needs,
        partial(keel_needs, 0.1),
    ),
    Claim(
        "O10",
        "4",
        "sustained climbing",
        "by alternately sticking and rolling, a dumbbell of constant positive heading gains energy",
        Means.SIMULATION,
        rises_in_energy,
        partial(rises_in_energy, -10.0),
    ),
    Claim(
        "O6a",
        "4",
        "energy of a dumbbell in a level drum",
        "its minima are $\\varphi = \\theta = 0$, whatever $\\eta$",
        Means.SYMBOLIC,
        energy_is_least_at,
        partial(energy_is_least_at, heading=90.0),
    ),
    Claim(
        "O6b",
        "4",
        "attraction to the minimum",
        "slippage by noise leads dumbbells to $\\varphi = \\theta = 0$",
        Means.SIMULATION,
        noise_leads_to_the_minimum,
        partial(noise_leads_to_the_minimum, 0.0),
    ),
    Claim(
        "O7",
        "A",
        "equilibrium across the drum",
        "$|\\theta| = \\pi/2$ is an unstable equilibrium in a level drum",
        Means.SYMBOLIC,
        is_saddle_at,
        partial(is_saddle_at, 0.0),
    ),
    Claim(
        "O12",
        "4",
        "heading 0 in a level drum",
        "a dumbbell of heading 0 rolls in place",
        Means.SIMULATION,
        level_heading_rolls_in_place,
        partial(level_heading_rolls_in_place, 5.0),
    ),
    Claim(
        "O13",
        "4",
        "large headings",
        "the body force makes a dumbbell roll in a direction that lowers $\\eta$",
        Means.SYMBOLIC,
        steep_rolls_down,
        partial(steep_rolls_down, "cos(theta)"),
    ),
)
