"""Options of ``polycorner drum``."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import click

from polycorner.cli import (
    Command,
    added,
    fail,
    from_file,
    given,
    option,
    output_options,
    seed_option,
)

if TYPE_CHECKING:
    from polycorner.dumbbells.imperfections import OutOfRound
    from polycorner.motion import Noise

PLACING = "Dumbbells"
DRUM = "Drum"
CONTACT = "Friction"
RUN = "Simulation"
# What places the dumbbells: --pair or --start on the command line replaces all of it.
PLACEMENTS = ("pair", "heading", "start", "count")
IMPERFECT = "Imperfections"
COORDINATES = ("phi", "eta", "theta", "psi")
OPTIONS = {"band": "shake-band"}  # of arguments that have one of their own
T = TypeVar("T")


def drum_options(function: Command) -> Command:
    """Add the options that describe a run and its answer."""
    number = click.FLOAT
    return added(
        function,
        option(
            "--count", type=click.IntRange(1, 5000), group=PLACING,
            help="Number of dumbbells.  [default: 1, or as many as are placed]",
        ),
        option(
            "--pair", type=click.Choice(["R", "L"]), group=PLACING,
            help="Start as a right- or left-handed nested pair.",
        ),
        option(
            "--heading", type=number, multiple=True, group=PLACING,
            help="Initial heading, degrees; repeat for several.",
        ),
        option(
            "--start", type=number, nargs=3, multiple=True, metavar="DEG MM DEG",
            group=PLACING, help="Azimuth, eta and heading of a dumbbell; repeat for several.",
        ),
        option(
            "--length", type=number, default=16.0, group=PLACING,
            help="Distance of a dumbbell's ball centres, mm.",
        ),
        option(
            "--ball", type=number, default=3.0, group=PLACING, help="Radius of the balls, mm."
        ),
        option(
            "--rod", type=number, default=1.5, group=PLACING, help="Radius of the rods, mm."
        ),
        option(
            "--drum", type=number, default=125.0, group=DRUM, help="Radius of the drum, mm."
        ),
        option(
            "--top", type=number, group=DRUM,
            help="Length of the drum, mm; dumbbells beyond it leave.  [default: endless]",
        ),
        option(
            "--tilt", type=number, default=7.0, group=DRUM,
            help="Tilt of the drum's axis, degrees.",
        ),
        option(
            "--spin", type=number, default=0.01, group=DRUM,
            help="Angular speed of the drum, rad/s.",
        ),
        option(
            "--mu-slide", type=number, nargs=2, default=(0.3, 0.2), group=CONTACT,
            metavar="STATIC DYNAMIC", help="Coefficients of sliding friction.",
        ),
        option(
            "--mu-roll", type=number, nargs=2, default=(0.1, 0.06), group=CONTACT,
            metavar="STATIC DYNAMIC", help="Coefficients of rolling friction.",
        ),
        option(
            "--mu-contact", type=number, default=0.3, group=CONTACT,
            help="Coefficient of friction between dumbbells.",
        ),
        option(
            "--noise", type=number, default=0.0, group=RUN,
            help="Relative amplitude of the random loads.",
        ),
        option(
            "--duration", type=number, default=60.0, group=RUN, help="Simulated time, s."
        ),
        option("--dt", type=number, default=1e-3, group=RUN, help="Time step, s."),
        seed_option("the noise, the imperfections and the bunch", group=RUN),
        option(
            "--resume", is_flag=True, group=RUN,
            help="Continue a run that was stopped or killed.",
        ),
        option(
            "--movie", is_flag=False, flag_value="", metavar="[FILE]", group="Output",
            help="Movie, .mp4 or .gif; without a name it goes into the folder of --out.",
        ),
        output_options,
    )  # fmt: skip


def without_hidden(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values without placements of a file that the command line replaces."""
    if not (given("pair") or given("start")):
        return values
    return values | {name: None for name in PLACEMENTS if from_file(name)}


# ------------------------------------------------------------------------------------ imperfections


def imperfection_options(function: Command) -> Command:
    """Add the options that describe imperfections and random forces."""
    number = click.FLOAT
    return added(
        function,
        option(
            "--shake", type=number, nargs=3, metavar="ACROSS ALONG UP", group=IMPERFECT,
            help="Shaking of the drum, root mean squares of accelerations, mm/s^2.",
        ),
        option(
            "--shake-band", type=number, nargs=2, default=(1.0, 15.0), metavar="LOW HIGH",
            group=IMPERFECT, help="Frequencies of the shaking, Hz.",
        ),
        option(
            "--out-of-round", type=number, nargs=2, multiple=True, metavar="HARMONIC MM",
            group=IMPERFECT, help="Amplitude of a harmonic of the wall; repeat for several.",
        ),
        option(
            "--wobble", type=number, group=IMPERFECT,
            help="Angle between the drum's axis and its axis of rotation, degrees.",
        ),
        option(
            "--uneven-friction", type=number, nargs=2, metavar="RMS MM", group=IMPERFECT,
            help="Relative unevenness of the wall's friction, and its correlation length.",
        ),
        option(
            "--kicks", type=number, nargs=4, metavar="PHI ETA THETA PSI", group=IMPERFECT,
            help="Intensities of random forces on each coordinate, in g mm (rad) and s.",
        ),
        option(
            "--kick-time", type=number, default=0.01, group=IMPERFECT,
            help="How long a random force is held, s; 0: white noise.",
        ),
    )  # fmt: skip


def imperfections(values: dict[str, Any]) -> dict[str, Any]:
    """Return the imperfections that the options describe, as arguments of the drum."""
    from polycorner.dumbbells.imperfections import Shaking, UnevenFriction, Wobble

    seed, rms = values["seed"], values["shake"] or (0.0, 0.0, 0.0)
    found: dict[str, Any] = {}
    shaking = _made("shake", lambda: Shaking(rms, values["shake_band"], seed))
    if values["shake"] is not None:
        found["shaking"] = shaking
    if values["out_of_round"]:
        found["out_of_round"] = _made("out-of-round", lambda: _wall(values["out_of_round"]))
    if values["wobble"] is not None:
        angle = math.radians(values["wobble"])
        found["wobble"] = _made("wobble", lambda: Wobble(angle))
    if values["uneven_friction"] is not None:
        rms, length = values["uneven_friction"]
        found["uneven_friction"] = _made(
            "uneven-friction", lambda: UnevenFriction(rms, length, seed)
        )
    return found


def noise_of(values: dict[str, Any]) -> "Noise":
    """Return the noise that the options describe."""
    from polycorner.motion import Noise

    given = {"chatter": values["noise"], "seed": values["seed"]}
    held = Noise(kick_time=values["kick_time"], **given)  # checks it also where it is not needed
    if values["kicks"] is None:
        return Noise(**given)
    return replace(held, kicks=dict(zip(COORDINATES, values["kicks"], strict=True)))


def _wall(terms: Any) -> "OutOfRound":
    from polycorner.dumbbells.imperfections import OutOfRound

    for harmonic, _ in terms:
        if not float(harmonic).is_integer():
            msg = f"harmonic: expected a whole number; got {harmonic:g}"
            raise ValueError(msg)
    return OutOfRound({int(harmonic): amplitude for harmonic, amplitude in terms})


def _made(name: str, make: Callable[[], T]) -> T:
    """Return what is made, or end with one line that begins with the option."""
    try:
        return make()
    except (TypeError, ValueError) as error:
        argument, _, rest = str(error).partition(":")
        return fail(f"--{OPTIONS.get(argument, name)}:{rest}")
