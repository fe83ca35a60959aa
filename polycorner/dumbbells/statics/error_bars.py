"""Sensitivity of a dyad's corner to the sizes of its dumbbells, and error bars of headings."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycorner import checks
from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER
from polycorner.minimisation import Sensitivity, sensitivity, stationary_on

if TYPE_CHECKING:
    from polycorner.minimisation.sensitivities import Quantity

PLANE_RATES = {
    "length": {"l": 1.0},
    "ball_radius": {"r": 1.0},
    "rod_radius": {"t": 1.0},
    "rod_weight": {"w": 1.0},
}
# The formulas are written in rho = R - r, so that the radii move it, too.
DRUM_RATES = PLANE_RATES | {
    "ball_radius": {"r": 1.0, "rho": -1.0},
    "drum_radius": {"R": 1.0, "rho": 1.0},
}


@dataclass(frozen=True)
class ErrorBar:
    """A value with the spread that independent tolerances give it, to first order ([GUM] sec. 5).

    Attributes
    ----------
    value : float
        The value.
    spread : float
        Its standard deviation: the root of the sum of the squared shares.
    shares : mapping from str to float
        What each parameter contributes: derivative times tolerance, with its sign.
    """

    value: float
    spread: float
    shares: Mapping[str, float]

    def __str__(self) -> str:
        """Return the value and its spread to two significant digits."""
        digits = max(0, 1 - math.floor(math.log10(self.spread))) if self.spread > 0 else 6
        return f"{self.value:.{digits}f} +- {self.spread:.{digits}f}"


def error_bar(
    found: Sensitivity, quantity: "Quantity", tolerances: Mapping[str, float]
) -> ErrorBar:
    """Return a quantity at a point of rest with the spread that tolerances give it.

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
        For a name that is no parameter, a tolerance that is not a number from 0 on, or a quantity
        without a derivative.
    """
    checks.names("tolerances", tolerances, found.rates)
    for name, tolerance in tolerances.items():
        if not 0 <= float(tolerance) < math.inf:
            msg = f"tolerances: expected {name} as a number not below 0; got {tolerance!r}"
            raise ValueError(msg)
    slopes = dict(zip(found.parameters, found.of(quantity).tolist(), strict=True))
    shares = {name: slopes[name] * float(size) for name, size in tolerances.items()}
    value = float(found.function(quantity).value(found.certificate.point))
    return ErrorBar(value, math.hypot(*shares.values()), shares)


def pair_sensitivity(pair: DumbbellPair, chirality: Chirality = "R") -> Sensitivity:
    """Differentiate the three-contact corner of a pair by the pair's own parameters.

    The parameters are ``length``, ``ball_radius``, ``rod_radius``, ``rod_weight`` and, in a drum,
    ``drum_radius``; both dumbbells change together.  The plane is the limit ``1/R = 0``, by which
    there is no derivative here: headings depend on its square.  The model has no tilt.

    The corner is the stationary point of its face; ``certificate.verdict`` says whether the pair
    rests there.

    Raises
    ------
    ValueError
        If the corner is not in ``D`` (short dumbbells), or a multiplier vanishes there.
    """
    start = pair.nested(chirality, clearance=0.0)
    corner = stationary_on(pair.polyhedron, pair.energy, start, CORNER)
    return sensitivity(corner, PLANE_RATES if pair.is_plane else DRUM_RATES)


def heading_error_bar(
    pair: DumbbellPair, tolerances: Mapping[str, float], chirality: Chirality = "R"
) -> ErrorBar:
    """Return the heading at rest, in degrees, with the spread that measured sizes give it.

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells as measured.
    tolerances : mapping from str to float
        Standard deviations of the pair's parameters, in mm: ``{"length": 0.1}``.  What is not named
        is taken to be exact.  A size is shared by both dumbbells.
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
        msg = f"pair: expected one that rests in its corner; the corner is {verdict}"
        raise ValueError(msg)
    heading = sympy.Symbol("theta1", real=True) * 180 / sympy.pi
    return error_bar(found, heading, tolerances)
