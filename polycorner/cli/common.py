"""What subcommands share: options of the pair, one line for a mistake, JSON, patience."""

import sys
import tomllib
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click

if TYPE_CHECKING:
    from polycorner.models import DumbbellPair

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

Command = TypeVar("Command", bound=Callable[..., Any])


def pair_options(command: Command) -> Command:
    """Add the options that describe a pair of dumbbells, and ``--config``."""
    command = config_option(command)
    for name, _, default in reversed(PARAMETERS):
        flag = f"--{name.replace('_', '-')}"
        command = click.option(flag, type=float, help=f"{HELP[name]} [{default:g}]")(command)
    return command


def config_option(command: Command) -> Command:
    """Add ``--config``."""
    return click.option(
        "--config",
        type=click.Path(path_type=Path),
        help="TOML file with these names as keys; options override it.",
    )(command)


def output_options(command: Command) -> Command:
    """Add ``--json`` and ``--out``."""
    command = click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        help="Folder for the figures and the JSON file.",
    )(command)
    return click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")(
        command
    )


def patience(words: str) -> AbstractContextManager[object]:
    """Show on a terminal that something is going on."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(words)


def fail(message: str) -> NoReturn:
    """End the command with one line and exit code 2."""
    raise click.UsageError(message)


def _merged(config: Path | None, options: dict[str, float | None]) -> dict[str, Any]:
    values: dict[str, Any] = {name: default for name, _, default in PARAMETERS}
    values |= _read(config) if config is not None else {}
    return values | {name: value for name, value in options.items() if value is not None}


def toml_table(config: Path) -> dict[str, Any]:
    """Return what is in the file of ``--config``."""
    try:
        with config.open("rb") as file:
            return tomllib.load(file)
    except OSError as error:
        fail(f"--config: {config} cannot be read ({error.strerror or error})")
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        fail(f"--config: {config} is no TOML file: {error}")


def _read(config: Path) -> dict[str, Any]:
    known = {name for name, _, _ in PARAMETERS}
    renamed = {key.replace("-", "_"): value for key, value in toml_table(config).items()}
    unknown = sorted(set(renamed) - known)
    if unknown:
        expected = ", ".join(name for name, _, _ in PARAMETERS)
        fail(f"--config: {config}: expected {expected}; got {', '.join(unknown)}")
    for name, value in renamed.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            fail(f"--config: {config}: {name}: expected a number; got {value!r}")
    return renamed


def chosen_pair(config: Path | None, options: dict[str, float | None]) -> "DumbbellPair":
    """Return the pair that the options, over the file, over the defaults, describe."""
    values = _merged(config, options)
    from polycorner.models import DumbbellPair

    try:
        return DumbbellPair(**{field: values[name] for name, field, _ in PARAMETERS})
    except (ValueError, TypeError) as error:
        message = str(error)
        for name, field, _ in PARAMETERS:
            if message.startswith(f"{field}:"):
                message = f"--{name.replace('_', '-')}" + message.removeprefix(field)
                break
        fail(message)


def json_text(answer: dict[str, Any] | list[Any]) -> str:
    """Return JSON with ``null`` in place of numbers it does not have."""
    import json

    return json.dumps(_finite(answer), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    """Return the same value with ``null`` in place of numbers JSON does not have."""
    import math

    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_answer(answer: dict[str, Any], out: Path, name: str) -> Path:
    """Write an answer as JSON into the folder of ``--out`` and return the file."""
    file = out / name
    try:
        out.mkdir(parents=True, exist_ok=True)
        file.write_text(json_text(answer) + "\n", encoding="utf-8")
    except OSError as error:
        fail(f"--out: {out} cannot be written ({error.strerror})")
    return file


def deliver(
    answer: dict[str, Any],
    show: Callable[[], object],
    written: Iterable[Path] = (),
    *,
    as_json: bool,
) -> None:
    """Print an answer as JSON, or as ``show`` does and with the files that were written."""
    if as_json:
        click.echo(json_text(answer))
        return
    show()
    for path in written:
        click.echo(f"wrote {path}")


def parameters(pair: "DumbbellPair") -> dict[str, Any]:
    """Return the parameters of a pair under the names of the options."""
    values: dict[str, Any] = {name: getattr(pair, field) for name, field, _ in PARAMETERS}
    values["drum"] = "inf" if pair.is_plane else pair.drum_radius
    return values
