"""Walls out of round: the waves of a radius around the axis."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from polycorner import checks
from polycorner.checks import refuse

if TYPE_CHECKING:
    import sympy

    Wave = tuple[Any, Any, Any]  # harmonic k, amplitude a, phase p


def waves(angle: "sympy.Expr", terms: "list[Wave]") -> "tuple[sympy.Expr, sympy.Expr]":
    """Return ``sum a cos(k angle + p)`` and its derivative by the angle."""
    import sympy

    total = slope = sympy.S.Zero
    for k, a, p in terms:
        turned = k * angle + p
        total, slope = total + a * sympy.cos(turned), slope - k * a * sympy.sin(turned)
    return total, slope


def checked_waves(given: Any, radius: float) -> dict[int, tuple[float, float]]:
    """Return amplitudes and phases by harmonic, of a wall whose inside is convex."""
    expected = "an amplitude and a phase for each harmonic, such as {2: (0.1, 0.0)}"
    found = {}
    for k, pair in sorted(checks.mapping("waves", given).items()):
        if not isinstance(pair, tuple) or len(pair) != 2:
            refuse("waves", expected, given, TypeError)
        amplitude, phase = (checks.real("waves", x) for x in pair)
        found[checks.whole("waves", k, least=1)] = amplitude, phase
    if found and wave_depth(found) >= radius:
        least = "amplitudes a_k with the sum of |a_k| (k^2 + 1) below the radius, for a convex wall"
        refuse("waves", least, given)
    return found


def wave_depth(given: Mapping[int, tuple[float, float]]) -> float:
    """Return ``sum |a_k| (k^2 + 1)``.

    A curve ``rho(phi) = s + sum a_k cos(k phi + p_k)`` bounds a convex set if ``rho^2 + 2 rho'^2 -
    rho rho'' >= 0``, which holds as long as ``rho - rho'' >= 0``, hence if this is at most ``s``.
    """
    return sum(abs(a) * (k**2 + 1) for k, (a, _) in given.items())
