"""Sensitivity of a dyad's corner to the sizes of its dumbbells, and error bars of headings."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER
from polycorner.minimisation import Sensitivity, sensitivity, stationary_on
from polycorner.toolkit import Checked, checked, checks

if TYPE_CHECKING:
    import sympy

    from polycorner import SmoothFunction

PLANE_RATES = {
    "length": {"l": 1.0},
    "ball_radius": {"r": 1.0},
    "rod_radius": {"t": 1.0},
    "rod_weight": {"w": 1.0},
}
# The formulas are written in rho = R - r, which depends on both radii.
DRUM_RATES = PLANE_RATES | {
    "ball_radius": {"r": 1.0, "rho": -1.0},
    "drum_radius": {"R": 1.0, "rho": 1.0},
}


@dataclass(frozen=True)
class ErrorBar(Checked):
    """A value with its spread from independent tolerances, to first order ([GUM] sec. 5).

    Attributes
    ----------
    value : float
        The value.
    spread : float
        Its standard deviation: the root of the sum of the squared shares.
    shares : mapping from str to float
        Contribution of each parameter: derivative times tolerance, with its sign.
    """

    value: float
    spread: float
    shares: Mapping[str, float]

    def __str__(self) -> str:
        """Return the value and its spread to two significant digits."""
        digits = max(0, 1 - math.floor(math.log10(self.spread))) if self.spread > 0 else 6
        return f"{self.value:.{digits}f} +- {self.spread:.{digits}f}"


def error_bar(
    found: Sensitivity,
    quantity: "SmoothFunction | sympy.Expr | str",
    tolerances: Mapping[str, float],
) -> ErrorBar:
    """Return a quantity at an equilibrium with its spread from tolerances.

    Parameters
    ----------
    found : Sensitivity
        Derivatives by the parameters that have tolerances.
    quantity : SmoothFunction, sympy.Expr or str
        A function of the point, as :meth:`Sensitivity.of` takes it.
    tolerances : mapping from str to float
        Standard deviations of parameters, independent of each other.

    Raises
    ------
    ValueError
        For a name that is no parameter, a tolerance that is not a finite number >= 0, or a
        quantity without a derivative.
    """
    checks.names("tolerances", tolerances, found.rates)
    for name, tolerance in tolerances.items():
        checks.real(f"tolerances: {name}", tolerance, least=0)
    slopes = dict(zip(found.parameters, found.of(quantity).tolist(), strict=True))
    shares = {name: slopes[name] * float(size) for name, size in tolerances.items()}
    value = float(found.function(quantity).value(found.certificate.point))
    return ErrorBar(value, math.hypot(*shares.values()), shares)


@checked
def pair_sensitivity(pair: DumbbellPair, chirality: Chirality = "R") -> Sensitivity:
    """Differentiate the three-contact corner of a pair by the pair's own parameters.

    The parameters are ``length``, ``ball_radius``, ``rod_radius``, ``rod_weight`` and, in a drum,
    ``drum_radius``; both dumbbells change together.  The plane is the limit ``1/R = 0``; there is
    no derivative with respect to ``1/R`` here, as headings depend on its square.  The model has no
    tilt.

    The corner is the stationary point of its face; ``certificate.verdict`` says whether it is a
    minimum.

    Raises
    ------
    ValueError
        If the corner is not in ``D`` (short dumbbells), or a multiplier vanishes there.
    """
    start = pair.nested(chirality, clearance=0.0)
    corner = stationary_on(pair.polyhedron, pair.energy, start, CORNER)
    return sensitivity(corner, PLANE_RATES if pair.is_plane else DRUM_RATES)


@checked
def heading_error_bar(
    pair: DumbbellPair, tolerances: Mapping[str, float], chirality: Chirality = "R"
) -> ErrorBar:
    """Return the heading at the minimum, in degrees, with its spread from measured sizes.

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells as measured.
    tolerances : mapping from str to float
        Standard deviations of the pair's parameters, in mm: ``{"length": 0.1}``.  Parameters that
        are not named are taken to be exact.  A size is shared by both dumbbells.
    chirality : {"R", "L"}, optional
        Which of the two corners.

    Raises
    ------
    ValueError
        See :func:`error_bar`; also if the corner is no minimum.
    """
    import sympy

    found = pair_sensitivity(pair, chirality)
    if not found.certificate.is_minimum:
        verdict = found.certificate.verdict.value
        msg = f"pair: expected one whose corner is a minimum; its corner: {verdict}"
        raise ValueError(msg)
    heading = sympy.Symbol("theta1", real=True) * 180 / sympy.pi
    return error_bar(found, heading, tolerances)
