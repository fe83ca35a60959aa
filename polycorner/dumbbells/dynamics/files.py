"""Runs in the drum as NetCDF files: self-describing, and read back bit for bit."""

import json
import os
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.dumbbells.drum import DumbbellDrum, drum_of
from polycorner.dumbbells.drum_motion import COORDINATES
from polycorner.dumbbells.imperfections import KINDS
from polycorner.motion import Trajectory
from polycorner.toolkit import (
    BINARY,
    FileKind,
    MotionUnits,
    column,
    load_dataset,
    motion_attributes,
    motion_coordinates,
    motion_data,
    read_motion,
    save_dataset,
)

if TYPE_CHECKING:
    import xarray as xr

KIND = FileKind("run", "save_run", BINARY)
UNITS = {
    "length": "mm",
    "ball_radius": "mm",
    "rod_radius": "mm",
    "drum_radius": "mm",
    "count": "1",
    "tilt": "rad",
    "spin": "rad/s",
    "sliding": "static and dynamic coefficient",
    "rolling": "static and dynamic coefficient",
    "rubbing": "static and dynamic coefficient",
    "restitution": "1",
    "ball_mass": "g",
    "floor": "1 if there is a bottom at eta = 0",
    "top": "mm",
    "cohesion": "weight of a dumbbell",
    "adhesion": "weight of a dumbbell",
    "attraction_range": "mm",
}
LATER = ("cohesion", "adhesion", "attraction_range")  # not in runs saved before there were these
PLACES = (
    ("phi", "rad", "azimuth, not wrapped"),
    ("eta", "mm", "axial position"),
    ("theta", "rad", "heading, not wrapped"),
    ("psi", "rad", "spin about its own axis"),
)
MOTION = MotionUnits(energy="nJ", force="uN", impulse="g mm/s")  # nJ = g mm^2/s^2


def dataset(path: Trajectory) -> "xr.Dataset":
    """Return a run in the drum as an xarray dataset with units, parameters, seed and versions."""
    import xarray as xr

    names = list(drum_of(path).bodies.contact_names)
    data: dict[str, Any] = {}
    for k, (name, unit, words) in enumerate(PLACES):
        data[name] = column(("time", "body"), path.q[..., k], unit, words)
        speed = column(("time", "body"), path.v[..., k], f"{unit}/s", f"velocity of {name}")
        data[f"{name}_dot"] = speed
    data |= motion_data(path, names, MOTION)
    return xr.Dataset(data, motion_coordinates(path, MOTION), _attributes(path, names))


def _attributes(path: Trajectory, names: list[str]) -> dict[str, Any]:
    values: dict[str, Any] = {
        "title": "Dumbbells in a slowly rotating, tilted drum",
        **motion_attributes(path, names),
    }
    for name, unit in UNITS.items():
        value = getattr(drum_of(path), name)
        whole = isinstance(value, bool | int)
        values[name] = np.int64(value) if whole else np.array(value, dtype=np.float64)
        values[f"{name}_units"] = unit
    told = drum_of(path).imperfections.described()
    return values | {name: json.dumps(parameters) for name, parameters in told.items()}


def save_run(trajectory: Trajectory, path: str | os.PathLike[str]) -> Path:
    """Write the trajectory of dumbbells in a drum as NetCDF, atomically.

    Raises
    ------
    TypeError
        If the trajectory is one of another system.
    OSError
        If the file cannot be written.
    """
    return save_dataset(KIND, path, dataset(trajectory))


def load_run(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory that :func:`save_run` wrote; its ``system`` is the drum.

    Raises
    ------
    ValueError
        Naming the file, if it is something else or was changed.
    """
    return load_dataset(KIND, path, _read)


def _read(content: "xr.Dataset") -> Trajectory:
    at = content.attrs
    values: dict[str, Any] = {}
    for field in fields(DumbbellDrum):
        if field.name in KINDS:
            if field.name in at:
                told = json.loads(at[field.name])
                values[field.name] = KINDS[field.name].restored(told)
            continue
        if field.name in LATER and field.name not in at:
            continue
        value = at[field.name]
        if field.name in ("count", "floor"):
            values[field.name] = int(value) if field.name == "count" else bool(value)
        elif np.ndim(value):
            values[field.name] = tuple(float(x) for x in value)
        else:
            values[field.name] = float(value)
    q = np.stack([content[name].values for name in COORDINATES], axis=-1)
    v = np.stack([content[f"{name}_dot"].values for name in COORDINATES], axis=-1)
    return read_motion(content, DumbbellDrum(**values), q, v)
