"""Options that describe a pair of dumbbells."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import checked_keys, config_option, fail, settings_option, toml_table
from polycorner.cli.manner import Command, tell

if TYPE_CHECKING:
    from polycorner.dumbbells import DumbbellPair

# option, the model's parameter, default (the paper's dyads)
PARAMETERS = (
    ("length", "length", 16.0),
    ("ball", "ball_radius", 3.0),
    ("rod", "rod_radius", 1.5),
    ("drum", "drum_radius", 125.0),
    ("rod_weight", "rod_weight", 0.0),
)
HELP = {
    "length": "Distance of a dumbbell's ball centres, mm.",
    "ball": "Radius of the balls, mm.",
    "rod": "Radius of the rods, mm.",
    "drum": "Radius of the drum, mm; inf is the plane.",
    "rod_weight": "Weight of a rod, in weights of a ball.",
}


def pair_options(command: Command) -> Command:
    """Add the options that describe a pair of dumbbells, and ``--config``."""
    return _pair_numbers(config_option(command))


def pair_settings(command: Command) -> Command:
    """Add the options of a pair, and a ``--config`` that may hold every option."""
    return _pair_numbers(settings_option(command))


def _pair_numbers(command: Command) -> Command:
    for name, _, default in reversed(PARAMETERS):
        flag = f"--{name.replace('_', '-')}"
        command = click.option(flag, type=float, help=f"{HELP[name]} [{default:g}]")(command)
    return command


def chosen_pair(config: Path | None, options: dict[str, float | None]) -> "DumbbellPair":
    """Return the pair that the options, over the file, over the defaults, describe."""
    values: dict[str, Any] = {name: default for name, _, default in PARAMETERS}
    values |= _read(config) if config is not None else {}
    values |= {name: value for name, value in options.items() if value is not None}
    tell("pair: " + ", ".join(f"{name} = {value:g}" for name, value in values.items()))
    from polycorner.dumbbells import DumbbellPair

    try:
        return DumbbellPair(**{field: values[name] for name, field, _ in PARAMETERS})
    except (ValueError, TypeError) as error:
        message = str(error)
        for name, field, _ in PARAMETERS:
            if message.startswith(f"{field}:"):
                message = f"--{name.replace('_', '-')}" + message.removeprefix(field)
                break
        fail(message)


def _read(config: Path) -> dict[str, Any]:
    where = f"--config: {config}"
    read = checked_keys(toml_table(config), [name for name, _, _ in PARAMETERS], where)
    for name, value in read.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            fail(f"{where}: {name}: expected a number; got {value!r}")
    return read


def parameters(pair: "DumbbellPair") -> dict[str, Any]:
    """Return the parameters of a pair under the names of the options."""
    values: dict[str, Any] = {name: getattr(pair, field) for name, field, _ in PARAMETERS}
    values["drum"] = "inf" if pair.is_plane else pair.drum_radius
    return values
