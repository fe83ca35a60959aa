"""Runs in the drum as NetCDF files: self-describing, and read back bit for bit."""

import json
import os
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.container import BINARY, Kind
from polycorner.dumbbells.drum import COORDINATES, DumbbellDrum
from polycorner.dumbbells.dynamics.runs import DrumRun
from polycorner.files.motions import (
    MotionUnits,
    column,
    load_dataset,
    motion_attributes,
    motion_coordinates,
    motion_data,
    read_motion,
    save_dataset,
)
from polycorner.motion.noise import Noise

if TYPE_CHECKING:
    import xarray as xr

KIND = Kind("run", "save_run", BINARY)
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
}
PLACES = (
    ("phi", "rad", "azimuth, not wrapped"),
    ("eta", "mm", "axial position"),
    ("theta", "rad", "heading, not wrapped"),
    ("psi", "rad", "spin about its own axis"),
)
MOTION = MotionUnits(energy="nJ", force="uN", impulse="g mm/s")  # nJ = g mm^2/s^2


def dataset(run: DrumRun) -> "xr.Dataset":
    """Return a run as an xarray dataset with units, parameters, seed and versions."""
    import xarray as xr

    path, names = run.trajectory, _contacts(run)
    data: dict[str, Any] = {}
    for k, (name, unit, words) in enumerate(PLACES):
        data[name] = column(("time", "body"), path.q[..., k], unit, words)
        speed = column(("time", "body"), path.v[..., k], f"{unit}/s", f"velocity of {name}")
        data[f"{name}_dot"] = speed
    data |= motion_data(path, names, MOTION)
    return xr.Dataset(data, motion_coordinates(path, MOTION), _attributes(run, names))


def _contacts(run: DrumRun) -> list[str]:
    bodies = run.drum.bodies
    return [*bodies.body.contacts, *bodies.pair_contacts]


def _attributes(run: DrumRun, names: list[str]) -> dict[str, Any]:
    values: dict[str, Any] = {
        "title": "Dumbbells in a slowly rotating, tilted drum",
        **motion_attributes(run.trajectory, names),
    }
    for name, unit in UNITS.items():
        value = getattr(run.drum, name)
        whole = isinstance(value, bool | int)
        values[name] = np.int64(value) if whole else np.array(value, dtype=np.float64)
        values[f"{name}_units"] = unit
    return values | {
        "seed": np.int64(run.noise.seed),
        "noise_chatter": float(run.noise.chatter),
        "noise_correlation_time": float(run.noise.correlation_time),
        "noise_kicks": json.dumps(dict(run.noise.kicks)),
        "duration": run.duration,
        "every": np.int64(run.every),
        "steps_per_second": run.steps_per_second,
    }


def save_run(run: DrumRun, path: str | os.PathLike[str]) -> Path:
    """Write a run as NetCDF, atomically.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    return save_dataset(KIND, path, dataset(run))


def load_run(path: str | os.PathLike[str]) -> DrumRun:
    """Read a run that :func:`save_run` wrote.

    Raises
    ------
    ValueError
        Naming the file, if it is something else or was changed.
    """
    return load_dataset(KIND, path, _read)


def _read(content: "xr.Dataset") -> DrumRun:
    at = content.attrs
    values: dict[str, Any] = {}
    for field in fields(DumbbellDrum):
        value = at[field.name]
        if field.name in ("count", "floor"):
            values[field.name] = int(value) if field.name == "count" else bool(value)
        elif np.ndim(value):
            values[field.name] = tuple(float(x) for x in value)
        else:
            values[field.name] = float(value)
    drum = DumbbellDrum(**values)
    kicks, seed = json.loads(at["noise_kicks"]), int(at["seed"])
    chatter, hold = float(at["noise_chatter"]), float(at["noise_correlation_time"])
    noise = Noise(chatter=chatter, correlation_time=hold, kicks=kicks, seed=seed)
    rate = float(at["steps_per_second"])
    q = np.stack([content[name].values for name in COORDINATES], axis=-1)
    v = np.stack([content[f"{name}_dot"].values for name in COORDINATES], axis=-1)
    path = read_motion(content, drum.bodies, q, v)
    return DrumRun(drum, noise, path, float(at["duration"]), int(at["every"]), rate)
