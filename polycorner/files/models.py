"""Models as entries of a file, and the units of their coordinates, functions and energies.

A file holds no formulas.  A model is written as the name of its class and its parameters, and made
again from these; only the classes listed here are.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib import import_module
from typing import TYPE_CHECKING, Any

from polycorner.files.container import WORDS, number

if TYPE_CHECKING:
    from polycorner.formulas.functions import SmoothFunction
    from polycorner.polyhedra.polyhedron import Polyhedron
    from polycorner.spaces.manifold import Manifold

MODELS = {
    "DumbbellPair": "polycorner.dumbbells",
    "Pinball": "polycorner.models",
    "SphereCluster": "polycorner.models",
    "TorusDisks": "polycorner.models",
    "Tutorial": "polycorner.models",
}
# By the module that holds the formulas; coordinates without the number at their end.
COORDINATES = {
    "dumbbells.formulas": {"phi": "rad", "eta": "mm", "theta": "rad", "x": "mm", "y": "mm"},
    "models.planar": {"x": "1", "y": "1"},
    "models.spheres": {"x": "diameter", "y": "diameter", "z": "diameter"},
    "models.disks.torus": {"x": "lattice vector", "y": "lattice vector", "r": "lattice vector"},
}
VALUES = {
    ("dumbbells.formulas", "heading"): "1",
    ("dumbbells.formulas", "trough"): "mm^2",
    ("dumbbells.formulas", ""): "mm",
    ("models.planar", ""): "1",
    ("models.pinball", ""): "1",
    ("models.spheres", ""): "diameter^2",
    ("models.disks.torus", ""): "lattice vector",
}


def described(model: object) -> dict[str, Any]:
    """Return a model as entries: its class and its parameters.

    Raises
    ------
    TypeError
        If its class is not among those that can be made again from a file.
    """
    name = type(model).__name__
    if name not in MODELS or type(model) is not _class(name):
        msg = f"model: expected one of {', '.join(MODELS)}; got {model!r}"
        raise TypeError(msg)
    values = {f.name: getattr(model, f.name) for f in fields(_class(name))}
    return {"class": name, "parameters": {key: _written(x) for key, x in values.items()}}


def rebuilt(entry: Mapping[str, Any]) -> Any:
    """Return the model that entries describe.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is none of the listed ones, or one with other parameters.
    """
    name = entry["class"]
    if name not in MODELS:
        msg = f"the model {name!r} is none of {', '.join(MODELS)}"
        raise ValueError(msg)
    values = {key: _read(value) for key, value in entry["parameters"].items()}
    known = [f.name for f in fields(_class(name))]
    if sorted(values) != sorted(known):
        msg = f"{name} has the parameters {', '.join(known)}, not {', '.join(values)}"
        raise ValueError(msg)
    return _class(name)(**values)


def _class(name: str) -> Any:
    return getattr(import_module(MODELS[name]), name)


def _written(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_written(part) for part in value]
    return number(value) if isinstance(value, float) else value


def _read(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_read(part) for part in value)
    return WORDS.get(value, value) if isinstance(value, str) else value


# -------------------------------------------------------------------------------------------- units


@dataclass(frozen=True)
class Units:
    """Units of coordinates, of functions and equations, and of the energy; None: not stated."""

    coordinates: dict[str, str | None]
    functions: dict[str, str | None]
    energy: str | None = None


def units_of(
    polyhedron: "Polyhedron",
    energy: "SmoothFunction | None" = None,
    stated: Mapping[str, str] | None = None,
) -> Units:
    """Return the units of a polyhedron's coordinates and functions.

    Models of the package have theirs; a circle of period ``2 pi`` is an angle in ``rad``; what is
    ``stated`` by name, for coordinates, functions and ``energy``, goes before.

    Raises
    ------
    ValueError
        If a unit is stated for something that is not there.
    """
    own = dict(stated or {})
    manifold, every = polyhedron.manifold, (*polyhedron.functions, *polyhedron.equations)
    names = (*manifold.names, *(f.name for f in every), "energy")
    check_stated(own, names)
    by = _module(every[0])
    return Units(
        {name: own.get(name, _coordinate(manifold, name, by)) for name in manifold.names},
        {f.name: own.get(f.name, _value(f)) for f in every},
        own.get("energy", None if energy is None else _value(energy)),
    )


def coordinate_units(
    manifold: "Manifold", stated: Mapping[str, str] | None = None
) -> dict[str, str | None]:
    """Return the units of coordinates: as stated, or ``rad`` on a circle of period ``2 pi``."""
    own = dict(stated or {})
    return {name: own.get(name, _coordinate(manifold, name, "")) for name in manifold.names}


def check_stated(stated: Mapping[str, str], names: tuple[str, ...]) -> None:
    """Refuse units of what has no such name, and units that are no words."""
    for name, unit in stated.items():
        if name not in names:
            msg = f"units: expected names among {', '.join(names)}; got {name!r}"
            raise ValueError(msg)
        if not isinstance(unit, str) or not unit:
            msg = f"units: expected a unit such as 'mm' for {name!r}; got {unit!r}"
            raise ValueError(msg)


def _module(function: "SmoothFunction") -> str:
    """Return the module of the package's models that holds a function's formula, if any does."""
    module = str(getattr(function.family.formulas, "__module__", ""))
    return module.removeprefix("polycorner.")


def _coordinate(manifold: "Manifold", name: str, by: str) -> str | None:
    known = COORDINATES.get(by, {}).get(name.rstrip("0123456789"))
    period = manifold.periods[manifold.names.index(name)]
    return known or ("rad" if period == math.tau else None)


def _value(function: "SmoothFunction") -> str | None:
    by = _module(function)
    return VALUES.get((by, function.member_name), VALUES.get((by, "")))
