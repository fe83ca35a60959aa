"""A bunch of dumbbells in the drum, under one kind of noise: who leaves, and what climbs."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.dumbbells.dynamics.pairs import LEFT_AS
from polycorner.dumbbells.pair import Chirality
from polycorner.dumbbells.studies.driven import disturbed, kicks_of
from polycorner.toolkit import LONGEST, Array, checked, choice, real, whole

if TYPE_CHECKING:
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.bunch import BunchRun

HEADING = 8.0  # degrees
BETWEEN = 36.0  # mm, from pair to pair
EXITS = 60  # how many that leave are told one by one
INSTANTS = 20  # at which it is told who is in the drum
HANDED = {kind: hand for hand, kind in LEFT_AS.items()}


@checked
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
    sliding_ratio: float | None = None,
    rolling_ratio: float | None = None,
    rubbing_ratio: float | None = None,
    tilt: float = 7.0,
    spin: float = 0.01,
    length: float = 16.0,
    ball_radius: float = 3.0,
    rod_radius: float = 1.5,
    count: int = 60,
    pairs: str = "",
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
        Static coefficients.
    sliding_ratio, rolling_ratio, rubbing_ratio : float
        Dynamic coefficients over static ones; by default those of the drum's defaults.
    tilt, spin : float
        Of the drum, in degrees and rad/s.
    length, ball_radius, rod_radius : float
        In mm.
    count : int
        How many dumbbells.
    pairs : str
        Chiralities, as in ``"RLRL"``, of nested pairs that start one above the other on the lowest
        line with headings of 8 and -8 degrees, in place of ``count`` scattered dumbbells.
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

        Of the first sixty that leave, in the order in which they do, nan where fewer leave:
        ``exit_time``, ``exit_hand`` (1 in a right-handed dyad, -1 in a left-handed one, 0 single),
        ``exit_heading``, ``exit_alone`` and ``exit_above``; see
        :class:`~polycorner.dumbbells.dynamics.bunch.Leaving`.  At the end of each twentieth of the
        time: ``present_at``, dumbbells in the drum, ``heap_at``, those in the largest group that
        touch each other, ``right_at`` and ``left_at``, those in dyads.
    """
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics.bunch import drum_for_bunch, follow_bunch, scattered

    whole("start", start, least=0)
    real("duration", duration, least=0, most=LONGEST, unit="s")
    drum = DumbbellDrum(
        length,
        ball_radius,
        rod_radius,
        tilt=math.radians(tilt),
        spin=spin,
        sliding=coefficients("sliding", sliding, sliding_ratio),
        rolling=coefficients("rolling", rolling, rolling_ratio),
        rubbing=coefficients("rubbing", rubbing, rubbing_ratio),
    )
    drum = drum_for_bunch(drum, count=2 * len(pairs) or count, top=top)
    drum, noise = disturbed(drum, kind, strength, scale, start)
    if kicks:
        noise = replace(noise, kicks=kicks_of(drum, kicks), kick_time=kick_time)
    q = one_above_the_other(drum, pairs) if pairs else scattered(drum, np.random.default_rng(start))
    run = follow_bunch(drum, duration, start=q, noise=noise, dt=dt)
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
        **_leavings(run),
        **_history(run),
        "max_penetration": (run.trajectory.max_penetration, "mm"),
        "missed": run.trajectory.missed,
    }


def one_above_the_other(drum: "DumbbellDrum", pairs: str) -> Array:
    """Return nested pairs on the lowest line, ``(2 n, 3)``, the first at the bottom."""
    from polycorner.dumbbells.dynamics.dyads import CLEARANCE

    places = []
    for k, letter in enumerate(pairs):
        hand: Chirality = "R" if choice("pairs", letter, ("R", "L")) == "R" else "L"
        angle = math.radians(HEADING if hand == "R" else -HEADING)
        pair = drum.pair.nested(hand, heading=angle, clearance=CLEARANCE).reshape(2, 3)
        places.append(pair + np.array([0.0, (k + 2 / 3) * BETWEEN, 0.0]))
    return np.concatenate(places)


def _leavings(run: "BunchRun") -> dict[str, Any]:
    """Return times, hands, headings and isolation of those that leave, ``(60,)`` each."""
    columns = np.full((5, EXITS), math.nan)
    for k, one in enumerate(run.leavings[:EXITS]):
        heading = math.degrees(one.heading)
        columns[:, k] = one.time, HANDED[one.kind], heading, one.alone, one.above
    units = {"time": "s", "hand": "1", "heading": "deg", "alone": "s", "above": "mm"}
    return {f"exit_{name}": (x, units[name]) for name, x in zip(units, columns, strict=True)}


def _history(run: "BunchRun") -> dict[str, Any]:
    """Return who is in the drum at twenty instants, ``(20,)`` each."""
    times = run.times[-1] * np.arange(1, INSTANTS + 1) / INSTANTS
    indices = (np.searchsorted(run.times, times, side="right") - 1).tolist()
    rows = [run.census(index) | {"heap": run.heap(index)} for index in indices]
    names = ("present", "heap", "right", "left")
    return {f"{name}_at": np.array([float(row[name]) for row in rows]) for name in names}


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


def coefficients(name: str, static: float, ratio: float | None) -> tuple[float, float]:
    """Return a static coefficient and a dynamic one, in a ratio or in that of the drum's own."""
    from polycorner.dumbbells.drum import DumbbellDrum

    if ratio is not None:
        return static, static * real(f"{name}_ratio", ratio, least=0, most=1)
    usual = getattr(DumbbellDrum, name)
    return static, static * usual[1] / usual[0]
