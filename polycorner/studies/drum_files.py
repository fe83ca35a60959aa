"""Runs in the drum as NetCDF files: self-describing, and read back bit for bit."""

import json
import os
import platform
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import __version__
from polycorner.models.drum import COORDINATES, DumbbellDrum
from polycorner.motion.engine import Effort
from polycorner.motion.events import EventKind
from polycorner.motion.noise import Noise
from polycorner.motion.trajectory import Trajectory
from polycorner.studies.drum_checkpoints import (
    event_table,
    read_events,
    read_touches,
    touch_table,
    write_whole,
)
from polycorner.studies.drum_runs import DrumRun

if TYPE_CHECKING:
    import xarray as xr

FORMAT = 1
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
ENERGY = "nJ"  # g mm^2/s^2
EFFORT = tuple(field.name for field in fields(Effort))


def dataset(run: DrumRun) -> "xr.Dataset":
    """Return a run as an xarray dataset with units, parameters, seed and versions."""
    import xarray as xr

    path, names = run.trajectory, _contacts(run)
    data: dict[str, Any] = {}
    for k, (name, unit, words) in enumerate(PLACES):
        data[name] = _column(("time", "body"), path.q[..., k], unit, words)
        speed = _column(("time", "body"), path.v[..., k], f"{unit}/s", f"velocity of {name}")
        data[f"{name}_dot"] = speed
    data["rests"] = _column(("time", "body"), path.rests.astype(np.int8), "1", "rests on the drum")
    data["present"] = _column(("time", "body"), path.present.astype(np.int8), "1", "has not left")
    for name, values in (("kinetic", path.kinetic), ("potential", path.potential)):
        data[name] = _column(("time",), values, ENERGY, f"{name} energy of those present")
    for name, causes in (("dissipated", path.dissipated), ("work", path.work)):
        values = np.stack(list(causes.values()), axis=1)
        data[name] = _column(("time", f"{name}_by"), values, ENERGY, f"{name} until then")
    data |= _listed(run, names)
    coordinates = {
        "time": _column(("time",), path.times, "s", "time"),
        "body": np.arange(path.q.shape[1]),
        "dissipated_by": list(path.dissipated),
        "work_by": list(path.work),
    }
    return xr.Dataset(data, coordinates, _attributes(run, names))


def _column(dimensions: tuple[str, ...], values: Any, unit: str, words: str) -> Any:
    return dimensions, values, {"units": unit, "long_name": words}


def _listed(run: DrumRun, names: list[str]) -> dict[str, Any]:
    touches = touch_table(run.trajectory.touching, names)
    events = event_table(run.trajectory.events, names)
    data: dict[str, Any] = {}
    for k, name in enumerate(("instant", "body_1", "body_2", "contact")):
        words = f"contacts that touch: {name}, counted from 0 (-1: none)"
        data[f"touch_{name}"] = _column(("touch",), touches["touch"][:, k], "1", words)
    data["touch_force"] = _column(("touch",), touches["touch_force"], "uN", "force that presses")
    meanings = " ".join(kind.name.lower() for kind in EventKind)
    kinds = {"flag_values": [int(kind) for kind in EventKind], "flag_meanings": meanings}
    for k, name in enumerate(("kind", "body_1", "body_2", "contact")):
        words = f"events: {name}, counted from 0 (-1: none)"
        dimensions, values, about = _column(("event",), events["event"][:, k], "1", words)
        data[f"event_{name}"] = (dimensions, values, about | (kinds if k == 0 else {}))
    for k, (name, unit) in enumerate((("time", "s"), ("impulse", "g mm/s"))):
        words = f"{name} of events"
        data[f"event_{name}"] = _column(("event",), events["event_numbers"][:, k], unit, words)
    return data


def _contacts(run: DrumRun) -> list[str]:
    herd = run.drum.herd
    between = () if herd.pairing is None else herd.pairing.gaps.names
    return [*herd.body.contacts, *between]


def _attributes(run: DrumRun, names: list[str]) -> dict[str, Any]:
    path = run.trajectory
    values: dict[str, Any] = {
        "title": "Dumbbells in a slowly rotating, tilted drum",
        "Conventions": "CF-1.11",
        "polycorner_drum_run": FORMAT,
        "polycorner_version": __version__,
        "numpy_version": np.__version__,
        "python_version": platform.python_version(),
    }
    for name, unit in UNITS.items():
        value = getattr(run.drum, name)
        if isinstance(value, bool | int):
            values[name] = np.int64(value)
        else:
            values[name] = np.array(value, dtype=np.float64)
        values[f"{name}_units"] = unit
    values |= {
        "seed": np.int64(run.noise.seed),
        "noise_chatter": float(run.noise.chatter),
        "noise_correlation_time": float(run.noise.correlation_time),
        "noise_kicks": json.dumps(dict(run.noise.kicks)),
        "dt": path.dt,
        "duration": run.duration,
        "every": np.int64(run.every),
        "steps_per_second": run.steps_per_second,
        "max_penetration": path.max_penetration,
        "contacts": " ".join(names),
    }
    return values | {f"effort_{name}": getattr(path.effort, name) for name in EFFORT}


def save_run(run: DrumRun, path: str | os.PathLike[str]) -> Path:
    """Write a run as NetCDF; the file appears whole or not at all."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    content = dataset(run)
    packed = {"zlib": True, "complevel": 4}
    encoding = {name: packed for name in content.data_vars if content[name].size > 1}

    def write(part: Path) -> None:
        content.to_netcdf(part, engine="h5netcdf", encoding=encoding)

    write_whole(target, write)
    return target


def load_run(path: str | os.PathLike[str]) -> DrumRun:
    """Read a run that :func:`save_run` wrote.

    Raises
    ------
    ValueError
        If the file is something else or damaged.
    """
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
            content = file.load()
        known = content.attrs.get("polycorner_drum_run") == FORMAT
        if known:
            return _read(content)
    except FileNotFoundError:
        raise
    except (AttributeError, KeyError, IndexError, OSError, TypeError, ValueError) as error:
        msg = f"path: expected a run that save_run wrote; {path} is damaged ({error})"
        raise ValueError(msg) from error
    msg = f"path: expected a run that save_run wrote; {path} is something else"
    raise ValueError(msg)


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
    path = _trajectory(content, drum)
    return DrumRun(drum, noise, path, float(at["duration"]), int(at["every"]), rate)


def _trajectory(content: "xr.Dataset", drum: DumbbellDrum) -> Trajectory:
    at, names = content.attrs, str(content.attrs["contacts"]).split()

    def of(name: str) -> Any:
        return np.array(content[name].values)

    def by(name: str) -> dict[str, Any]:
        causes = [str(cause) for cause in of(f"{name}_by")]
        return {cause: of(name)[:, k] for k, cause in enumerate(causes)}

    def table(kind: str, first: str) -> Any:
        columns = [of(f"{kind}_{name}") for name in (first, "body_1", "body_2", "contact")]
        return np.stack(columns, axis=1).astype(np.int64)

    touches = {"touch": table("touch", "instant"), "touch_force": of("touch_force")}
    numbers = np.stack([of("event_time"), of("event_impulse")], axis=1)
    whole = {name: int(at[f"effort_{name}"]) for name in EFFORT if name != "residual"}
    return Trajectory(
        system=drum.herd,
        dt=float(at["dt"]),
        times=of("time"),
        q=np.stack([of(name) for name in COORDINATES], axis=-1),
        v=np.stack([of(f"{name}_dot") for name in COORDINATES], axis=-1),
        rests=of("rests") != 0,
        present=of("present") != 0,
        touching=tuple(read_touches(touches, names, len(content["time"]))),
        kinetic=of("kinetic"),
        potential=of("potential"),
        dissipated=by("dissipated"),
        work=by("work"),
        events=tuple(
            read_events({"event": table("event", "kind"), "event_numbers": numbers}, names)
        ),
        max_penetration=float(at["max_penetration"]),
        effort=Effort(**whole, residual=float(at["effort_residual"])),
    )
