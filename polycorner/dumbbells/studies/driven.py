"""Single dumbbells and pairs of either chirality under one kind of noise."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.toolkit import LONGEST, Array, checked, choice, real, refuse

if TYPE_CHECKING:
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.dyads import DyadPaths, Steady
    from polycorner.motion import Noise, Trajectory

SINGLES = (12.0, 12.0, 6.0, -6.0)  # degrees: headings at the start
PAIRS = 5  # of each hand
SHAKEN = ("shaking across", "shaking along", "shaking up")
KINDS = ("kicks", "chatter", *SHAKEN, "out of round", "wobble", "uneven friction")
LOWEST = 0.1  # least frequency of shaking over the greatest
CORNER = "ball rod rod"  # contacts of a nested pair
TURN = 360.0  # degrees, the largest heading at the start
CLOSE = 0.1  # mm, up to which a contact of a pair that rattles counts as closed


@checked
def driven(
    kind: str,
    strength: float,
    scale: float,
    *,
    rng: np.random.Generator,
    length: float = 16.0,
    tilt: float = 7.0,
    spin: float = 0.01,
    lowest: float = -8.0,
    highest: float = 14.0,
    restitution: float = 0.0,
    cohesion: float = 0.0,
    adhesion: float = 0.0,
    scatter: float = 0.0,
    refine: bool = True,
    duration: float = 400.0,
    dt: float = 0.001,
) -> dict[str, Any]:
    """Return what one kind of noise makes of single dumbbells and of pairs in a turning drum.

    One run of 24 dumbbells far apart: four single ones with headings 12, 12, 6 and -6 degrees, five
    right-handed nested pairs from headings that are evenly spaced, and five left-handed ones from
    their negatives.  Other parameters are the defaults of
    :class:`~polycorner.dumbbells.drum.DumbbellDrum`.

    ===============  ==================================  =========================================
    kind             strength                            scale
    ===============  ==================================  =========================================
    kicks            diffusion of either velocity of     time in s for which a random force is
                     the centre, mm/s per sqrt(s);       held, or 0: white
                     ``2/l`` times it for the heading
    chatter          amplitude, relative to the load     time in s for which a draw is held
    shaking across,  root mean square of the             time ``T`` in s: the band is from
    along, up        acceleration, mm/s^2                ``0.05/T`` to ``0.5/T``, and the
                                                         correlation is zero first at ``0.91 T``
    out of round     amplitude of a harmonic, mm         number of the harmonic
    wobble           angle of the axes, degrees          not used
    uneven friction  root mean square, relative          correlation length, mm
    ===============  ==================================  =========================================

    Parameters
    ----------
    kind : str
        One of those in the table.
    strength, scale : float
    rng : Generator
        Source of the seed of the noise.
    length : float
        In mm.
    tilt, spin : float
        Of the drum, in degrees and rad/s.
    lowest, highest : float
        First headings of right-handed pairs, in degrees.
    restitution : float
        Of dumbbells that collide.
    cohesion, adhesion : float
        Attraction of dumbbells by each other, at each contact, and by the wall, over their weight.
    scatter : float
        Relative standard deviation of the threshold of rolling, drawn anew at every stop.
    refine : bool
        Whether impacts act within steps, where dumbbells meet; not needed without noise.
    duration, dt : float
        In s.

    Returns
    -------
    dict
        Of single dumbbells: ``single_rate`` in 1/s, the change of the heading in the first quarter
        of the time, over the heading at the start and that time; ``single_kept``, the heading in
        the last quarter over that at the start; ``single_climb_rate`` in mm/s over the last half;
        ``single_carried``, the azimuth in degrees at which they leave rest, and
        ``single_highest``, the greatest of the last half.
        Of pairs, once with ``_right`` and once with ``_left``, with their own signs: means over
        the last half and over the pairs that held together, ``heading`` in degrees, ``shift`` in
        mm, ``climb_rate`` in mm/s; ``early`` and ``late``, the headings of the third and the last
        quarter, their difference ``drift``, and ``settled``, whether it is zero within two standard
        errors; ``spread``, the standard deviation of ``late`` over the pairs; ``samples``, the
        number of headings that are independent in time; ``carried`` and ``highest``, as of single
        dumbbells; ``relaxation``, the time in s in which
        headings come together to 1/e of their first spread; ``corner``, the share of time with the
        three contacts of the nested pair closed to 0.1 mm (of all five pairs); ``held``, the number
        of pairs.  Means have a standard ``_error`` over the pairs or dumbbells; shaking, unlike
        other kinds, is the same for all of them.  ``missed``, the share of groups in contact that
        were not solved to the tolerance.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.
    """
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.dyads import SOLVER, DyadPaths, follow_pairs, steady

    real("tilt", tilt, unit="deg")
    real("duration", duration, above=0, most=LONGEST, unit="s")
    real("lowest", lowest, least=-TURN, most=TURN, unit="deg")
    real("highest", highest, least=-TURN, most=TURN, unit="deg")
    drum = DumbbellDrum(length, tilt=math.radians(tilt), spin=spin, restitution=restitution)
    drum = replace(drum, cohesion=cohesion, adhesion=adhesion)
    drum, noise = disturbed(drum, kind, strength, scale, int(rng.integers(2**63)))
    noise = replace(noise, scatter={"rolling": scatter})
    places = _places(drum, np.radians(np.linspace(lowest, highest, PAIRS)).tolist())
    solver = replace(SOLVER, refine=refine)
    path = follow_pairs(drum, places, duration, noise=noise, dt=dt, solver=solver).trajectory
    first, middle = len(SINGLES), len(SINGLES) + 2 * PAIRS
    right, left = DyadPaths(path, first, middle), DyadPaths(path, middle)
    half = duration / 2
    return {
        **_singles(path),
        **_pairs("right", right, steady(right, after=half)),
        **_pairs("left", left, steady(left, after=half)),
        **_carried(
            path,
            {"single_{}": (0, first)}
            | {"{}_right": (first, middle), "{}_left": (middle, middle + 2 * PAIRS)},
        ),
        "missed": path.missed,
    }


def disturbed(
    drum: "DumbbellDrum", kind: str, strength: float, scale: float, seed: int
) -> "tuple[DumbbellDrum, Noise]":
    """Return a drum with one kind of imperfection, and the noise; see :func:`driven`."""
    from polycorner.dumbbells.imperfections import OutOfRound, UnevenFriction, Wobble
    from polycorner.motion import Noise

    choice("kind", kind, KINDS)
    real("strength", strength, least=0)
    quiet = Noise(seed=seed)
    if kind == "kicks":
        real("scale", scale, least=0, unit="s")
        return drum, replace(quiet, kicks=kicks_of(drum, strength), kick_time=scale)
    if kind == "wobble":
        return replace(drum, wobble=Wobble(math.radians(strength))), quiet
    real("scale", scale, above=0)
    if kind == "chatter":
        return drum, replace(quiet, chatter=strength, correlation_time=scale)
    if kind == "out of round":
        wall = OutOfRound({_harmonic(scale): strength})
        return replace(drum, out_of_round=wall), quiet
    if kind == "uneven friction":
        return replace(drum, uneven_friction=UnevenFriction(strength, scale, seed)), quiet
    return _shaken(drum, kind, strength, scale, seed), quiet


def kicks_of(drum: "DumbbellDrum", strength: float) -> dict[str, float]:
    """Return the kicks under which the velocity of a dumbbell diffuses.

    Both components of the velocity of its centre by ``strength``, in mm/s per sqrt(s), and the rate
    of its heading by ``2/l`` times that: masses are ``2 m rho^2`` for ``phi``, ``2 m`` for
    ``eta``, and ``2 m (l^2/4 + 2 r^2/5)`` for ``theta``.
    """
    both, rho, half = 2 * drum.ball_mass, drum.centre_radius, drum.length / 2
    inertia = both * (half**2 + 0.4 * drum.ball_radius**2)
    kicks = {"phi": both * rho, "eta": both, "theta": inertia / half}
    return {name: strength * size for name, size in kicks.items()}


def _shaken(
    drum: "DumbbellDrum", kind: str, strength: float, scale: float, seed: int
) -> "DumbbellDrum":
    from polycorner.dumbbells.imperfections import Shaking

    across, along, up = (strength if kind == axis else 0.0 for axis in SHAKEN)
    band = (LOWEST / (2 * scale), 1 / (2 * scale))
    return replace(drum, shaking=Shaking((across, along, up), band, seed))


def _harmonic(scale: float) -> int:
    if not float(scale).is_integer():
        refuse("scale", "a whole number, the harmonic of the wall", scale)
    return int(scale)


def _places(drum: "DumbbellDrum", angles: list[float]) -> Array:
    """Return single dumbbells, right-handed and left-handed pairs, far apart, ``(24, 3)``."""
    from polycorner.dumbbells.dynamics.dyads import Start, nested_places
    from polycorner.dumbbells.dynamics.singles import APART

    starts: list[Start] = [*(("R", a) for a in angles), *(("L", -a) for a in angles)]
    count = len(SINGLES)
    singles = [np.zeros(count), APART * np.arange(count), np.radians(SINGLES)]
    pairs = nested_places(drum, starts)
    pairs[:, 1] += APART * count
    return np.concatenate([np.stack(singles, axis=-1), pairs])


def _singles(path: "Trajectory") -> dict[str, Any]:
    from polycorner.dumbbells.dynamics.singles import Mean

    times, (eta, theta) = path.times, np.moveaxis(path.q[:, : len(SINGLES), 1:3], -1, 0)
    quarter, half, last = np.searchsorted(times, times[-1] * np.array([0.25, 0.5, 0.75]))
    rate = (theta[quarter] / theta[0] - 1) / times[quarter]
    rise = (eta[-1] - eta[half]) / (times[-1] - times[half])
    means = {"rate": (rate, "1/s"), "climb_rate": (rise, "mm/s")}
    means["kept"] = (theta[last:].mean(axis=0) / theta[0], "1")
    return _with_errors({f"single_{n}": (Mean.of(x), unit) for n, (x, unit) in means.items()})


def _pairs(hand: str, paths: "DyadPaths", found: "Steady") -> dict[str, Any]:
    sign = 1 if hand == "right" else -1
    means = {
        "heading": (sign * found.heading, "deg"),
        "shift": (found.shift, "mm"),
        "climb_rate": (sign * found.climb_rate, "mm/s"),
        "early": (sign * found.early, "deg"),
        "late": (sign * found.late, "deg"),
        "drift": (sign * found.drift, "deg"),
    }
    means = {f"{name}_{hand}": mean for name, mean in means.items()}
    others = {
        "spread": (found.late.deviation, "deg"),
        "settled": found.settled,
        "samples": found.samples,
        "relaxation": (paths.relaxation_time, "s"),
        "corner": paths.strata(after=paths.times[-1] / 2, touch=CLOSE).get(CORNER, 0.0),
        "held": found.held,
    }
    return _with_errors(means) | {f"{name}_{hand}": value for name, value in others.items()}


def _carried(path: "Trajectory", groups: dict[str, tuple[int, int]]) -> dict[str, Any]:
    """Return the azimuths at which groups of dumbbells leave rest, and the greatest they reach."""
    from polycorner.dumbbells.drum import drum_of
    from polycorner.dumbbells.dynamics.singles import Mean, zigzags

    slips, half = zigzags(path, drum_of(path).spin), len(path) // 2
    found = {}
    for name, (first, last) in groups.items():
        means = [one.upper.mean() for one in slips[first:last] if len(one)]
        carried = Mean.of(np.degrees(means))
        highest = np.degrees(path.q[half:, first:last, 0].max())
        found[name.format("carried")] = (carried.value, "deg")
        found[name.format("carried") + "_error"] = (carried.error, "deg")
        found[name.format("highest")] = (float(highest), "deg")
    return found


def _with_errors(means: dict[str, Any]) -> dict[str, Any]:
    values = {name: (mean.value, unit) for name, (mean, unit) in means.items()}
    return values | {f"{name}_error": (mean.error, unit) for name, (mean, unit) in means.items()}
