"""Parameter studies described in TOML files."""

import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.checks import about, choice, instance, real, refuse, whole
from polycorner.errors import nearest
from polycorner.kinds import checked
from polycorner.sweeps.execution import check_arguments
from polycorner.sweeps.grid import MOST_POINTS, Axis, Grid
from polycorner.values import Checked

KEYS = ("study", "seed", "axes", "fixed")
AXIS = ("values", "start", "stop", "count", "spacing", "unit")
SPACINGS: Mapping[str, Callable[..., Any]] = {"linear": np.linspace, "logarithmic": np.geomspace}


@dataclass(frozen=True)
class NamedStudy(Checked):
    """A study that files refer to by a name.

    Attributes
    ----------
    function : callable
        For :func:`~polycorner.sweeps.sweep`.
    units : mapping from str to str
        Units of its parameters.
    file : Path
        A study file with usual values.
    figure : callable
        Returns a figure of the results, or None where none is apt.
    """

    function: Callable[..., Mapping[str, Any]]
    units: Mapping[str, str]
    file: Path
    figure: Callable[[Any], Any]


@dataclass(frozen=True)
class StudyFile(Checked):
    """The contents of a study file.

    Attributes
    ----------
    study : str
        The name of a study, or ``module:function``.
    function : callable
    grid : Grid
    fixed : dict
        Arguments with the same value at every point.
    seed : int or None
        None for the default.
    random : bool
        Whether the function takes a random generator.
    """

    study: str
    function: Callable[..., Mapping[str, Any]]
    grid: Grid
    fixed: dict[str, Any]
    seed: int | None
    random: bool


@checked
def read_study(
    path: str | os.PathLike[str], named: Mapping[str, NamedStudy] | None = None
) -> StudyFile:
    """Read a study from a TOML file; the module of a user's own function is imported and runs.

    ::

        study = "my_module:my_function"   # or one of the names, such as "heading"
        seed = 1                          # optional

        [axes]
        length = { start = 8, stop = 30, count = 45 }
        rod_radius = [0.5, 1.0, 1.5]      # or { values = [...], unit = "mm" }

        [fixed]
        drum_radius = 125

    Parameters
    ----------
    path : path
    named : mapping from str to NamedStudy, optional
        Studies that the file may refer to by name.

    Raises
    ------
    ValueError
        Naming file, field, what was expected and what came.
    """
    file = Path(path)
    content = _content(file)
    try:
        return _study(content, named or {})
    except (TypeError, ValueError) as error:
        msg = f"{file}: {error}"
        raise ValueError(msg) from error


def _content(file: Path) -> dict[str, Any]:
    try:
        with file.open("rb") as opened:
            return tomllib.load(opened)
    except OSError as error:
        msg = f"{file} cannot be read ({error.strerror or error})"
        raise ValueError(msg) from error
    except (ValueError, RecursionError) as error:  # numbers may be too long, and tables too deep
        msg = f"{file} is no TOML file that can be read: {error}"
        raise ValueError(msg) from error


def _study(content: dict[str, Any], named: Mapping[str, NamedStudy]) -> StudyFile:
    _check_keys("", content, KEYS)
    name = content.get("study")
    if not isinstance(name, str):
        refuse("study", _expected(named), name, TypeError)
    function, units = _function(name, named)
    axes = instance("axes", content.get("axes", {}), dict)
    if not axes:
        msg = "axes: expected a table with the values of each parameter; got none"
        raise ValueError(msg)
    grid = Grid.of({key: _axis(key, entry, units.get(key, "")) for key, entry in axes.items()})
    fixed = instance("fixed", content.get("fixed", {}), dict)
    random = check_arguments(function, grid, fixed, called=("axes", "fixed"))
    seed = content.get("seed")
    chosen = None if seed is None else whole("seed", seed, least=0)
    return StudyFile(name, function, grid, fixed, chosen, random)


def _check_keys(field: str, keys: Iterable[str], known: tuple[str, ...]) -> None:
    for key in keys:
        if key not in known:
            where = f"{field}: " if field else ""
            msg = f"{where}expected {', '.join(known)}; got {nearest(key, known)}"
            raise ValueError(msg)


def _expected(named: Mapping[str, NamedStudy]) -> str:
    return f"{', '.join(named)} or module:function" if named else "module:function"


def _function(
    name: str, named: Mapping[str, NamedStudy]
) -> tuple[Callable[..., Mapping[str, Any]], Mapping[str, str]]:
    """Return the function of a study and the units of its parameters."""
    if name in named:
        return named[name].function, named[name].units
    if ":" not in name:
        msg = f"study: expected {_expected(named)}; got {nearest(name, named)}"
        raise ValueError(msg)
    module, _, attribute = name.partition(":")
    try:
        function: Any = import_module(module)
        for part in attribute.split("."):
            function = getattr(function, part)
    except (ImportError, AttributeError, ValueError) as error:
        msg = f"study: expected module:function that can be imported; got {name} ({error})"
        raise ValueError(msg) from error
    return function, {}


def _axis(name: str, entry: Any, unit: str) -> Axis:
    field = f"axes.{name}"
    if isinstance(entry, dict):
        _check_keys(field, entry, AXIS)
    table = entry if isinstance(entry, dict) else {"values": entry}
    with about(field):
        return Axis(_values(table), table.get("unit", unit))


def _values(table: dict[str, Any]) -> Any:
    ranged = {"start", "stop", "count"}
    if "values" in table:
        if ranged & set(table):
            msg = "expected values, or start, stop and count; got both"
            raise ValueError(msg)
        return table["values"]
    if not ranged <= set(table):
        msg = f"expected values, or start, stop and count; got {', '.join(table) or 'nothing'}"
        raise ValueError(msg)
    start, stop = real("start", table["start"]), real("stop", table["stop"])
    spacing = SPACINGS[choice("spacing", table.get("spacing", "linear"), SPACINGS)]
    return spacing(start, stop, whole("count", table["count"], least=1, most=MOST_POINTS))
