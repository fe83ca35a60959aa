"""Options of ``polycorner drum`` for what a real drum has: imperfections and random forces."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import click

from polycorner.cli import Command, fail, option

if TYPE_CHECKING:
    from polycorner.dumbbells.imperfections import OutOfRound
    from polycorner.motion import Noise

IMPERFECT = "Imperfections"
COORDINATES = ("phi", "eta", "theta", "psi")
OPTIONS = {"band": "shake-band"}  # of arguments that have one of their own
T = TypeVar("T")


def imperfection_options(function: Command) -> Command:
    """Add the options that describe imperfections and random forces."""
    number = click.FLOAT
    for add in reversed(
        (
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
        )
    ):  # fmt: skip
        function = add(function)
    return function


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
