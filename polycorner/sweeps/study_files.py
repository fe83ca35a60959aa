"""Parameter studies described in TOML files."""

import os
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.errors import nearest
from polycorner.sweeps.execution import check_arguments
from polycorner.sweeps.grid import Axis, Grid

KEYS = ("study", "seed", "axes", "fixed")
AXIS = ("values", "start", "stop", "count", "spacing", "unit")
SHIPPED = "polycorner.dumbbells.studies"  # has the table STUDIES
SPACINGS: Mapping[str, Callable[..., Any]] = {"linear": np.linspace, "logarithmic": np.geomspace}


@dataclass(frozen=True)
class StudyFile:
    """What is in the file of a study.

    Attributes
    ----------
    study : str
        Name of a study that ships, or ``module:function``.
    function : callable
    grid : Grid
    fixed : dict
        Arguments that are the same at every point.
    seed : int or None
        None for the default.
    random : bool
        Whether the function draws random numbers.
    """

    study: str
    function: Callable[..., Mapping[str, Any]]
    grid: Grid
    fixed: dict[str, Any]
    seed: int | None
    random: bool


def read_study(path: str | os.PathLike[str]) -> StudyFile:
    """Read a study from a TOML file; a function of the user's own is imported, so its module runs.

    ::

        study = "heading"                 # or "my_module:my_function"
        seed = 1                          # optional

        [axes]
        length = { start = 8, stop = 30, count = 45 }
        rod_radius = [0.5, 1.0, 1.5]      # or { values = [...], unit = "mm" }

        [fixed]
        drum_radius = 125

    Raises
    ------
    ValueError
        Naming file, field, what was expected and what came.
    """
    file = Path(path)
    content = _content(file)
    try:
        return _study(content)
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
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        msg = f"{file} is no TOML file: {error}"
        raise ValueError(msg) from error


def _study(content: dict[str, Any]) -> StudyFile:
    _known("", content, KEYS)
    name = content.get("study")
    if not isinstance(name, str):
        msg = f"study: expected {', '.join(_shipped())} or module:function; got {name!r}"
        raise ValueError(msg)
    function, units = _function(name)
    axes = _table(content, "axes")
    if not axes:
        msg = "axes: expected a table with the values of each parameter; got none"
        raise ValueError(msg)
    grid = Grid.of({key: _axis(key, entry, units.get(key, "")) for key, entry in axes.items()})
    fixed = _table(content, "fixed")
    random = check_arguments(function, grid, fixed, names=("axes", "fixed"))
    seed = content.get("seed")
    if seed is not None and (isinstance(seed, bool) or not isinstance(seed, int) or seed < 0):
        msg = f"seed: expected a whole number not below 0; got {seed!r}"
        raise ValueError(msg)
    return StudyFile(name, function, grid, fixed, seed, random)


def _known(field: str, keys: Iterable[str], known: Iterable[str]) -> None:
    listed = list(known)
    for key in keys:
        if key not in listed:
            where = f"{field}: " if field else ""
            msg = f"{where}expected {', '.join(listed)}; got {nearest(key, listed)}"
            raise ValueError(msg)


def _table(content: dict[str, Any], key: str) -> dict[str, Any]:
    table = content.get(key, {})
    if not isinstance(table, dict):
        msg = f"{key}: expected a table; got {table!r}"
        raise TypeError(msg)
    return table


def _shipped() -> Mapping[str, Any]:
    """Return the studies that ship, by name."""
    found: Mapping[str, Any] = import_module(SHIPPED).STUDIES
    return found


def _function(name: str) -> tuple[Callable[..., Mapping[str, Any]], Mapping[str, str]]:
    """Return the function of a study and the units of its parameters."""
    if ":" not in name:
        studies = _shipped()
        if name not in studies:
            expected = ", ".join(studies)
            msg = f"study: expected {expected} or module:function; got {nearest(name, studies)}"
            raise ValueError(msg)
        return studies[name].function, studies[name].units
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
        _known(field, entry, AXIS)
    table = entry if isinstance(entry, dict) else {"values": entry}
    try:
        return Axis(_values(table), table.get("unit", unit))
    except (TypeError, ValueError) as error:
        msg = f"{field}: {error}"
        raise ValueError(msg) from error


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
    for end in ("start", "stop"):
        if isinstance(table[end], bool) or not isinstance(table[end], int | float):
            msg = f"{end}: expected a number; got {table[end]!r}"
            raise TypeError(msg)
    count, spacing = table["count"], table.get("spacing", "linear")
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        msg = f"count: expected a positive whole number; got {count!r}"
        raise ValueError(msg)
    if spacing not in SPACINGS:
        msg = f"spacing: expected {' or '.join(SPACINGS)}; got {spacing!r}"
        raise ValueError(msg)
    return SPACINGS[spacing](table["start"], table["stop"], count)
