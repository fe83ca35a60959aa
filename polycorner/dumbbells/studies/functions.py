"""Functions for parameter studies: headings of dyads, and climbing pairs."""

import math
from typing import Any

import numpy as np

from polycorner import SolverError
from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER, dyad_corner, paper_heading
from polycorner.toolkit import LONGEST, checked, real, whole

FIRST, LAST = 2.0, 14.0  # degrees: headings of the first and the last pair at the start


@checked
def heading(
    length: float,
    rod_radius: float,
    *,
    ball_radius: float = 3.0,
    drum_radius: float = 125.0,
    chirality: Chirality = "R",
) -> dict[str, Any]:
    """Return the heading of a dyad at its corner, certified, beside the formulas for it.

    The corner is where the energy is stationary on the face of the three contacts ``A2B1, A2b,
    aB1``; ``minimum`` is 1 where its certificate says that it is a minimum.

    Parameters
    ----------
    length, rod_radius, ball_radius, drum_radius : float
        Of a :class:`~polycorner.dumbbells.pair.DumbbellPair`, in mm; ``drum_radius`` may be inf.
    chirality : {"R", "L"}

    Returns
    -------
    dict
        ``heading``, ``paper_heading`` (``arctan(r/l)``) and ``plane_heading`` in degrees,
        ``minimum``, ``multiplier_<contact>`` (``dE/dgap``; mm in the plane), the largest
        ``residual`` of the certificate and its ``verdict``.

    Raises
    ------
    ValueError
        If there is no such pair.
    SolverError
        If the pair has no such corner: a ball does not fit beside the rod.
    """
    pair = DumbbellPair(length, ball_radius, rod_radius, drum_radius)
    found = dyad_corner(pair, chirality)
    certificate, sign = found.certificate, 1 if chirality == "R" else -1
    if not set(CORNER) <= set(certificate.active):
        why = certificate.verdict.value
        sizes = f"length = {length:g}, rod_radius = {rod_radius:g}, ball_radius = {ball_radius:g}"
        msg = (
            f"{sizes}, drum_radius = {drum_radius:g}: expected a corner where "
            f"{' '.join(CORNER)} touch; got none: {why}"
        )
        raise SolverError(msg)
    residuals = certificate.residuals
    multipliers = found.multipliers
    return {
        "heading": (found.headings[0], "deg"),
        "paper_heading": (sign * paper_heading(pair), "deg"),
        "plane_heading": (sign * math.degrees(pair.plane_corner()[0]), "deg"),
        "minimum": certificate.is_minimum,
        **{
            f"multiplier_{name}": (multipliers[name], "mm" if pair.is_plane else "1")
            for name in CORNER
        },
        "residual": max(residuals.infeasibility, residuals.stationarity, residuals.complementarity),
        "verdict": certificate.verdict.name,
    }


@checked
def climbing(
    noise: float,
    tilt: float,
    *,
    rng: np.random.Generator,
    length: float = 16.0,
    rod_radius: float = 1.5,
    spin: float = 0.01,
    pairs: int = 4,
    duration: float = 60.0,
) -> dict[str, Any]:
    """Return climb rate and heading of right-handed nested pairs in a turning drum.

    Pairs start at headings from 2 to 14 degrees and move under noise; the first half of the time is
    left out.  Other parameters are those of the paper's drum, the defaults of
    :class:`~polycorner.dumbbells.drum.DumbbellDrum`.

    Parameters
    ----------
    noise : float
        Amplitude of the chatter, see :class:`~polycorner.motion.noise.Noise`.
    tilt : float
        Tilt of the drum, in degrees.
    rng : Generator
        Source of the seed of the noise.
    length, rod_radius : float
        In mm.
    spin : float
        Of the drum, in rad/s.
    pairs : int
        How many.
    duration : float
        In s.

    Returns
    -------
    dict
        ``climb_rate`` in mm/s, ``heading`` and ``azimuth`` in degrees, each with its standard
        ``_error`` over the pairs that ``held``; ``law``, ``spin rho tan(heading)`` in mm/s.
    """
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.dyads import Start, follow_dyads, steady
    from polycorner.motion import Noise

    whole("pairs", pairs, least=1)
    real("noise", noise, least=0)
    real("duration", duration, above=0, most=LONGEST, unit="s")
    drum = DumbbellDrum(length, rod_radius=rod_radius, tilt=math.radians(tilt), spin=spin)
    headings = np.radians(np.linspace(FIRST, LAST, pairs)).tolist()
    starts: list[Start] = [("R", angle) for angle in headings]
    shaken = Noise(chatter=noise, seed=int(rng.integers(2**63)))
    found = steady(follow_dyads(drum, starts, duration, noise=shaken), after=duration / 2)
    means = {"climb_rate": (found.climb_rate, "mm/s"), "heading": (found.heading, "deg")}
    means["azimuth"] = (found.azimuth, "deg")
    law = spin * drum.centre_radius * math.tan(math.radians(found.heading.value))
    return {
        **{name: (mean.value, unit) for name, (mean, unit) in means.items()},
        **{f"{name}_error": (mean.error, unit) for name, (mean, unit) in means.items()},
        "held": found.held,
        "law": (law, "mm/s"),
    }
