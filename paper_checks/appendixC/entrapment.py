"""Appendix C: the three kinds of one-dimensional entrapment, compared.

A unit mass in ``V = k x^2`` on the line (U), in ``V = k x^2`` for ``x >= 0`` (half-U), in
``V = s x`` for ``x >= 0`` (half-V); at the wall it loses half of its speed.
"""

from functools import partial
from itertools import pairwise

import sympy

from paper_checks.framework.claims import Claim, Finding, Means, Verdict

K, SLOPE, ENERGY, SPEED, PULL = sympy.symbols("k s E v f", positive=True)
N = sympy.Symbol("n", integer=True, nonnegative=True)
KINDS = ("U", "half-U", "half-V")
HALF = sympy.Rational(1, 2)


def widths() -> dict[str, sympy.Expr]:
    """Return the width of the interval in which the potential is at most ``E``."""
    x = sympy.Symbol("x", positive=True)
    root = sympy.solve(sympy.Eq(K * x**2, ENERGY), x)[0]
    line = sympy.solve(sympy.Eq(SLOPE * x, ENERGY), x)[0]
    return {"U": 2 * root, "half-U": root, "half-V": line}


def bounce_times() -> dict[str, sympy.Expr]:
    """Return the time from one impact to the next after leaving the wall with speed ``v``."""
    t = sympy.Symbol("t", positive=True)
    arch = sympy.solve(SPEED * t - SLOPE * t**2 / 2, t)[0]
    return {"half-U": sympy.pi / sympy.sqrt(2 * K), "half-V": arch}


def times_to_rest() -> dict[str, sympy.Expr]:
    """Return the sum of all times between impacts, each leaving half of the speed."""
    return {
        kind: sympy.simplify(sympy.summation(time.subs(SPEED, SPEED * HALF**N), (N, 0, sympy.oo)))
        for kind, time in bounce_times().items()
    }


def ordered(kinds: tuple[str, ...] = KINDS) -> Finding:
    """Check that each kind holds more strongly than the one before.

    At low energies the widths decrease from kind to kind; kinds with a wall lose energy at it; only
    the half-V brings the mass to rest in a finite time.
    """
    width = widths()
    crossing = sympy.solve(sympy.Eq(width["half-V"], width["half-U"]), ENERGY)[0]
    below, above = (
        [float(width[kind].subs({ENERGY: f * crossing}).subs({K: 1, SLOPE: 1})) for kind in kinds]
        for f in (HALF / 10, 10)
    )
    falling = [all(a > b for a, b in pairwise(row)) for row in (below, above)]
    rest = times_to_rest()
    finite = {kind: bool(time.is_finite) for kind, time in rest.items()}
    stops = finite == {"half-U": False, "half-V": True}
    if not (falling[0] and stops):
        verdict = Verdict.REFUTED
    else:
        verdict = Verdict.HOLDS if falling[1] else Verdict.HOLDS_UNDER
    listed = ", ".join(f"{kind} ${sympy.latex(width[kind])}$" for kind in kinds)
    return Finding(
        verdict,
        f"The width at energy $E$ is {listed}; half-V is the narrower for $E < "
        f"{sympy.latex(crossing)}$ only. Halving the speed at every impact, the time to rest is "
        f"${sympy.latex(rest['half-V'])}$ in half-V and "
        f"{'finite' if finite['half-U'] else 'infinite'} in half-U; U loses nothing.",
        {f"width_{kind}_low": x for kind, x in zip(kinds, below, strict=True)},
        ""
        if verdict is not Verdict.HOLDS_UNDER
        else "The order holds for small excursions, $x < s/k$ (energies below $s^2/k$), where a "
        "half-V well of slope $s$ is steeper than the parabola $k x^2$; and half-U holds more "
        "strongly than U through the losses at its wall and by having one side only.",
    )


def friction_holds(resistance: sympy.Expr = PULL) -> Finding:
    """Determine the effect of a constant resistance to motion on energy and equilibria.

    Moving from ``a`` to the bottom costs ``resistance`` times ``a``.  The mass stays at rest
    wherever the force of the potential is not larger than the resistance.
    """
    x, a = sympy.symbols("x a", positive=True)
    lost = sympy.integrate(resistance, (x, 0, a))
    farthest = sympy.solve(sympy.Eq(2 * K * x, PULL), x)[0]
    takes_energy = bool(lost.is_positive)
    return Finding(
        Verdict.HOLDS_UNDER if takes_energy else Verdict.REFUTED,
        f"On the way from $a$ to 0 the energy changes by ${sympy.latex(-lost)}$ in all three "
        f"wells. At rest, U and half-U keep the mass anywhere up to ${sympy.latex(farthest)}$ from "
        "0, half-V only at 0 as long as $f < s$.",
        {},
        "Friction $f$ takes energy out of all three, but also holds a mass at rest away from the "
        "bottom, by up to $f/2k$ in U and half-U; only in half-V with $s > f$ it does not."
        if takes_energy
        else "",
    )


CLAIMS = (
    Claim(
        "L3a",
        "C",
        "list of the kinds of entrapment",
        "Harmonic, half-harmonic and triangular wells are three kinds of entrapment, each stronger "
        "than the one before.",
        Means.SYMBOLIC,
        ordered,
        partial(ordered, tuple(reversed(KINDS))),
        figure="entrapment",
    ),
    Claim(
        "L3b",
        "C",
        "after the list of the kinds of entrapment",
        "Friction can strengthen each of the three kinds of entrapment.",
        Means.SYMBOLIC,
        friction_holds,
        partial(friction_holds, -PULL),
    ),
)
