"""Functions for parameter studies: headings of dyads, climbing pairs, bunches in a drum."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import whole
from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER, dyad_corner, paper_heading

if TYPE_CHECKING:
    from polycorner.dumbbells.dynamics.bunch import BunchRun

FIRST, LAST = 2.0, 14.0  # degrees: headings of the first and the last pair at the start


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
    ArithmeticError
        If the pair has no such corner: a ball does not fit beside the rod.
    """
    pair = DumbbellPair(length, ball_radius, rod_radius, drum_radius)
    found = dyad_corner(pair, chirality)
    certificate, sign = found.certificate, 1 if chirality == "R" else -1
    if not set(CORNER) <= set(certificate.active):
        why = certificate.verdict.value
        msg = f"expected a corner where {' '.join(CORNER)} touch; got none: {why}"
        raise ArithmeticError(msg)
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
    from polycorner.motion.noise import Noise

    whole("pairs", pairs, least=1)
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


def bunch(
    start: int,
    *,
    kind: str = "chatter",
    strength: float = 0.0,
    scale: float = 0.01,
    kicks: float = 0.0,
    kick_time: float = 0.003,
    top: float = 300.0,
    sliding: float = 0.3,
    rolling: float = 0.1,
    rubbing: float = 0.3,
    tilt: float = 7.0,
    spin: float = 0.01,
    length: float = 16.0,
    ball_radius: float = 3.0,
    rod_radius: float = 1.5,
    count: int = 60,
    duration: float = 1200.0,
    dt: float = 0.004,
) -> dict[str, Any]:
    """Follow a bunch of dumbbells in the drum; return how many left, and how many are in dyads.

    See :func:`~polycorner.dumbbells.dynamics.bunch.follow_bunch`.  Defaults are the paper's drum,
    with what the paper does not give as in :class:`~polycorner.dumbbells.drum.DumbbellDrum`.

    Parameters
    ----------
    start : int
        Seed of the start and of the noise: one member of an ensemble.
    kind : str
    strength, scale : float
        Kind of noise, as of :func:`~polycorner.dumbbells.studies.driven.driven`; by default none.
    kicks, kick_time : float
        Strength and time in s of kicks in addition to another kind.
    top : float
        Height at which the drum ends, in mm.
    sliding, rolling, rubbing : float
        Static coefficients; the dynamic ones change in proportion to the drum's defaults.
    tilt, spin : float
        Of the drum, in degrees and rad/s.
    length, ball_radius, rod_radius : float
        In mm.
    count : int
        How many dumbbells.
    duration, dt : float
        In s.

    Returns
    -------
    dict
        Numbers of dumbbells that ``left`` the drum, among them ``left_right`` and ``left_left`` in
        right- and left-handed dyads and ``left_single``; numbers of those in the drum at the end:
        ``in_right``, ``in_left``, in dyads of ``both`` hands, ``single``, and ``rollers``.
        ``reach``, the mean height of those in the drum, and ``highest``, the greatest height of any
        at any time, in mm: where nobody left, the motion in a longer drum is the same, and so it is
        in a shorter one that ends above it.  For dyads of either hand ``free_right``, the share of
        intervals of 10 s in which no third dumbbell touched them, and the mean rates of climbing,
        ``rate_right_free`` and ``rate_right_touched``, in mm/s.  ``max_penetration`` in mm;
        ``missed``, the share of groups in contact that were not solved to the tolerance.
    """
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.bunch import drum_for_bunch, follow_bunch
    from polycorner.dumbbells.studies.driven import disturbed, kicks_of

    whole("start", start, least=0)
    drum = DumbbellDrum(
        length,
        ball_radius,
        rod_radius,
        tilt=math.radians(tilt),
        spin=spin,
        sliding=in_proportion(sliding, DumbbellDrum.sliding),
        rolling=in_proportion(rolling, DumbbellDrum.rolling),
        rubbing=in_proportion(rubbing, DumbbellDrum.rubbing),
    )
    drum = drum_for_bunch(drum, count=count, top=top)
    drum, noise = disturbed(drum, kind, strength, scale, start)
    if kicks:
        noise = replace(noise, kicks=kicks_of(drum, kicks), kick_time=kick_time)
    run = follow_bunch(drum, duration, seed=start, noise=noise, dt=dt)
    census, there = run.census(-1), run.present[-1]
    return {
        "left": len(run.exits),
        **{f"left_{kind}": number for kind, number in run.exit_counts().items()},
        "in_right": census["right"],
        "in_left": census["left"],
        "both": census["both"],
        "single": census["single"],
        "rollers": int(run.rollers(-1).sum()),
        "reach": (float(run.q[-1, there, 1].mean()) if there.any() else math.nan, "mm"),
        "highest": (float(run.q[..., 1].max()), "mm"),
        **_climbing(run),
        "max_penetration": (run.trajectory.max_penetration, "mm"),
        "missed": run.trajectory.missed,
    }


def _climbing(run: "BunchRun") -> dict[str, Any]:
    """Return the share of free dyads and the mean rates of climbing, by chirality."""
    found: dict[str, Any] = {}
    rates = run.dyad_rates()
    for hand in ("right", "left"):
        free, touched = (rates[f"{hand} {state}"] for state in ("free", "touched"))
        many = len(free) + len(touched)
        found[f"free_{hand}"] = len(free) / many if many else math.nan
        for name, values in (("free", free), ("touched", touched)):
            mean = float(values.mean()) if len(values) else math.nan
            found[f"rate_{hand}_{name}"] = (mean, "mm/s")
    return found


def in_proportion(static: float, usual: tuple[float, float]) -> tuple[float, float]:
    """Return a static coefficient, and a dynamic one in the ratio of the usual two."""
    return static, static * usual[1] / usual[0]
