"""Options of ``polycorner drum``, which are also the keys of its TOML file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from polycorner.cli.common import checked_keys, config_option, fail, toml_table
from polycorner.cli.manner import Command


@dataclass(frozen=True)
class Option:
    """An option that is also a key of the TOML file."""

    name: str
    default: Any
    words: str
    numbers: int = 1  # so many in a row
    many: bool = False  # may be given several times; a list in the file
    kind: Any = float
    metavar: str | None = None

    @property
    def flag(self) -> str:
        """The option as it is written."""
        return f"--{self.name.replace('_', '-')}"

    def decorate(self, command: Command) -> Command:
        """Add it to a command; what is not given is None."""
        shown = "" if self.default is None else f" [{_shown(self.default)}]"
        extra: dict[str, Any] = {"nargs": self.numbers} if self.numbers > 1 else {}
        if self.many:
            extra["multiple"] = True
        return click.option(
            self.flag,
            self.name,
            type=self.kind,
            metavar=self.metavar,
            help=f"{self.words}{shown}",
            **extra,
        )(command)


OPTIONS = (
    Option("count", None, "Number of dumbbells. [1, or as many as are placed]", kind=int),
    Option("pair", None, "Start as a nested pair, right or left.", kind=click.Choice(["R", "L"])),
    Option("heading", None, "Initial heading, degrees; repeat for several.", many=True),
    Option(
        "start", None, "Azimuth, eta and heading of one dumbbell, degrees, mm, degrees; repeat.",
        numbers=3, many=True, metavar="DEG MM DEG",
    ),
    Option("length", 16.0, "Distance of a dumbbell's ball centres, mm."),
    Option("ball", 3.0, "Radius of the balls, mm."),
    Option("rod", 1.5, "Radius of the rods, mm."),
    Option("drum", 125.0, "Radius of the drum, mm."),
    Option("top", None, "Length of the drum, mm: who passes it leaves. [endless]"),
    Option("tilt", 7.0, "Tilt of the drum's axis, degrees."),
    Option("spin", 0.01, "Angular speed of the drum, rad/s."),
    Option("mu_slide", (0.3, 0.2), "Static and dynamic friction of sliding.", numbers=2),
    Option("mu_roll", (0.1, 0.06), "Static and dynamic friction of rolling.", numbers=2),
    Option("mu_contact", 0.3, "Friction where dumbbells touch."),
    Option("noise", 0.0, "Amplitude of the loads' chatter."),
    Option("duration", 60.0, "Time to simulate, s."),
    Option("dt", 1e-3, "Step, s."),
    Option("seed", 0, "Seed of the noise and of the bunch.", kind=int),
)  # fmt: skip


def _shown(value: Any) -> str:
    return " ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else f"{value:g}"


def drum_options(command: Command) -> Command:
    """Add all that describes a run, and ``--config``."""
    command = config_option(command)
    for option in reversed(OPTIONS):
        command = option.decorate(command)
    return command


def merged(config: Path | None, options: dict[str, Any]) -> dict[str, Any]:
    """Return options over the file over the defaults."""
    given = {name: value for name, value in options.items() if value not in (None, ())}
    values: dict[str, Any] = {option.name: option.default for option in OPTIONS}
    read = _read(config) if config is not None else {}
    for name in ("pair", "heading", "start"):  # one of them given hides the file's others
        if name in given and name != "heading":
            read = {k: v for k, v in read.items() if k not in ("pair", "heading", "start", "count")}
    return values | read | given


def _read(config: Path) -> dict[str, Any]:
    known = {option.name: option for option in OPTIONS}
    read: dict[str, Any] = {}
    where = f"--config: {config}"
    for name, value in checked_keys(toml_table(config), known, where).items():
        try:
            read[name] = _checked(known[name], value)
        except ValueError as error:
            fail(f"{where}: {name}: expected {error}; got {value!r}")
    return read


def _checked(option: Option, value: Any) -> Any:
    """Return the value of a key as the option would have it; the error says what is expected."""
    if isinstance(option.kind, click.Choice):
        if value not in option.kind.choices:
            raise ValueError(" or ".join(f'"{choice}"' for choice in option.kind.choices))
        return value
    if option.many:
        single = "a number" if option.numbers == 1 else f"{option.numbers} numbers in brackets"
        listed = value if isinstance(value, list) else [value]
        if listed and option.numbers > 1 and not isinstance(listed[0], list):
            listed = [listed]
        try:
            return tuple(_row(option, entry) for entry in listed)
        except ValueError:
            msg = f"{single}, or a list of such"
            raise ValueError(msg) from None
    return _row(option, value)


def _row(option: Option, value: Any) -> Any:
    if option.numbers == 1:
        return _number(option, value)
    if not isinstance(value, list) or len(value) != option.numbers:
        msg = f"{option.numbers} numbers in brackets"
        raise ValueError(msg)
    return tuple(_number(option, entry) for entry in value)


def _number(option: Option, value: Any) -> float | int:
    whole = option.kind is int
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        raise ValueError("a whole number" if whole else "a number")
    return int(value) if whole else float(value)
