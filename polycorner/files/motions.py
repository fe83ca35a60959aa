"""Datasets and NetCDF files of motions: the part that all systems have in common."""

import io
import json
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from polycorner.container import Kind, versions
from polycorner.motion.engine.driver import Effort
from polycorner.motion.events import Event, EventKind
from polycorner.motion.trajectory import Touch, Trajectory
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import xarray as xr

    from polycorner.motion.bodies import IdenticalBodies
    from polycorner.motion.system import System

EFFORT = tuple(field.name for field in fields(Effort))
T = TypeVar("T")
PARTICIPANTS = ("body_1", "body_2", "contact")


@dataclass(frozen=True)
class MotionUnits:
    """Units of the quantities that every motion has."""

    time: str = "s"
    energy: str = "not stated"
    force: str = "not stated"
    impulse: str = "not stated"


# ------------------------------------------------------------------------------ contacts and events


def touch_table(touching: Sequence[Sequence[Touch]], names: Sequence[str]) -> dict[str, Any]:
    """Return contacts as columns: instant, bodies (-1: none), contact, force."""
    rows = [
        (index, bodies[0], bodies[1] if len(bodies) > 1 else -1, names.index(contact), force)
        for index, touches in enumerate(touching)
        for bodies, contact, force in touches
    ]
    whole = np.array([row[:4] for row in rows], dtype=np.int64).reshape(-1, 4)
    return {"touch": whole, "touch_force": np.array([row[4] for row in rows], dtype=np.float64)}


def read_touches(table: Any, names: Sequence[str], count: int) -> list[tuple[Touch, ...]]:
    """Return contacts by instant from :func:`touch_table`."""
    found: list[list[Touch]] = [[] for _ in range(count)]
    for (index, i, j, which), force in zip(
        table["touch"].tolist(), table["touch_force"].tolist(), strict=True
    ):
        found[index].append(((i,) if j < 0 else (i, j), names[which], force))
    return [tuple(touches) for touches in found]


def event_table(events: Iterable[Event], names: Sequence[str]) -> dict[str, Any]:
    """Return events as columns: kind, bodies (-1: none), contact (-1: none); time, impulse."""
    listed = list(events)
    whole = [
        (
            int(event.kind),
            event.bodies[0],
            event.bodies[1] if len(event.bodies) > 1 else -1,
            names.index(event.contact) if event.contact else -1,
        )
        for event in listed
    ]
    numbers = [(event.time, event.impulse) for event in listed]
    return {
        "event": np.array(whole, dtype=np.int64).reshape(-1, 4),
        "event_numbers": np.array(numbers, dtype=np.float64).reshape(-1, 2),
    }


def read_events(table: Any, names: Sequence[str]) -> list[Event]:
    """Return events from :func:`event_table`."""
    return [
        Event(time, EventKind(kind), (i,) if j < 0 else (i, j), "" if at < 0 else names[at], value)
        for (kind, i, j, at), (time, value) in zip(
            table["event"].tolist(), table["event_numbers"].tolist(), strict=True
        )
    ]


# ------------------------------------------------------------------------------------------ dataset


def column(dimensions: tuple[str, ...], values: Any, unit: str, words: str) -> Any:
    """Return a variable of a dataset with its unit and its description."""
    return dimensions, values, {"units": unit, "long_name": words}


def motion_data(path: Trajectory, names: Sequence[str], units: MotionUnits) -> dict[str, Any]:
    """Return the variables of a motion other than coordinates and velocities."""
    data: dict[str, Any] = {
        "rests": column(
            ("time", "body"), path.rests.astype(np.int8), "1", "at rest on the substrate"
        ),
        "present": column(
            ("time", "body"), path.present.astype(np.int8), "1", "still in the system"
        ),
    }
    for name, values in (("kinetic", path.kinetic), ("potential", path.potential)):
        words = f"{name} energy of the bodies present"
        data[name] = column(("time",), values, units.energy, words)
    for name, causes in (("dissipated", path.dissipated), ("work", path.work)):
        values = np.stack(list(causes.values()), axis=1)
        data[name] = column(("time", f"{name}_by"), values, units.energy, f"{name} up to this time")
    return data | _touches(path, names, units) | _events(path, names, units)


def _touches(path: Trajectory, names: Sequence[str], units: MotionUnits) -> dict[str, Any]:
    table = touch_table(path.touching, names)
    data: dict[str, Any] = {}
    for k, name in enumerate(("instant", *PARTICIPANTS)):
        words = f"touching contacts: {name}, counted from 0 (-1: none)"
        data[f"touch_{name}"] = column(("touch",), table["touch"][:, k], "1", words)
    force = column(("touch",), table["touch_force"], units.force, "normal force")
    return data | {"touch_force": force}


def _events(path: Trajectory, names: Sequence[str], units: MotionUnits) -> dict[str, Any]:
    table = event_table(path.events, names)
    meanings = " ".join(kind.name.lower() for kind in EventKind)
    kinds = {"flag_values": [int(kind) for kind in EventKind], "flag_meanings": meanings}
    data: dict[str, Any] = {}
    for k, name in enumerate(("kind", *PARTICIPANTS)):
        words = f"events: {name}, counted from 0 (-1: none)"
        dimensions, values, about = column(("event",), table["event"][:, k], "1", words)
        data[f"event_{name}"] = (dimensions, values, about | (kinds if k == 0 else {}))
    for k, (name, unit) in enumerate((("time", units.time), ("impulse", units.impulse))):
        values = table["event_numbers"][:, k]
        data[f"event_{name}"] = column(("event",), values, unit, f"{name} of events")
    return data


def motion_coordinates(path: Trajectory, units: MotionUnits) -> dict[str, Any]:
    """Return the coordinates of the dataset of a motion."""
    return {
        "time": column(("time",), path.times, units.time, "time"),
        "body": np.arange(path.q.shape[1]),
        "dissipated_by": list(path.dissipated),
        "work_by": list(path.work),
    }


def motion_attributes(path: Trajectory, names: Sequence[str]) -> dict[str, Any]:
    """Return the attributes of the dataset of a motion, with the versions that wrote it."""
    return {
        "Conventions": "CF-1.11",
        **{f"{name}_version": version for name, version in versions().items()},
        "dt": path.dt,
        "max_penetration": path.max_penetration,
        "contacts": json.dumps(list(names)),
        **{f"effort_{name}": getattr(path.effort, name) for name in EFFORT},
    }


def read_motion(
    content: "xr.Dataset", system: "System | IdenticalBodies", q: Array, v: Array
) -> Trajectory:
    """Return the trajectory in a dataset, given its coordinates and velocities."""
    at = content.attrs
    names = json.loads(at["contacts"])

    def of(name: str) -> Any:
        return np.array(content[name].values)

    def by(name: str) -> dict[str, Any]:
        return {str(cause): of(name)[:, k] for k, cause in enumerate(of(f"{name}_by"))}

    def table(kind: str, first: str) -> Any:
        columns = [of(f"{kind}_{name}") for name in (first, *PARTICIPANTS)]
        return np.stack(columns, axis=1).astype(np.int64)

    touches = {"touch": table("touch", "instant"), "touch_force": of("touch_force")}
    numbers = np.stack([of("event_time"), of("event_impulse")], axis=1)
    events = {"event": table("event", "kind"), "event_numbers": numbers}
    whole = {name: int(at[f"effort_{name}"]) for name in EFFORT if name != "residual"}
    return Trajectory(
        system=system,
        dt=float(at["dt"]),
        times=of("time"),
        q=q,
        v=v,
        rests=of("rests") != 0,
        present=of("present") != 0,
        touching=tuple(read_touches(touches, names, len(content["time"]))),
        kinetic=of("kinetic"),
        potential=of("potential"),
        dissipated=by("dissipated"),
        work=by("work"),
        events=tuple(read_events(events, names)),
        max_penetration=float(at["max_penetration"]),
        effort=Effort(**whole, residual=float(at["effort_residual"])),
    )


# -------------------------------------------------------------------------------------------- files


def save_dataset(kind: Kind, path: str | os.PathLike[str], content: "xr.Dataset") -> Path:
    """Write a dataset as NetCDF, atomically."""
    packed = {"zlib": True, "complevel": 4}
    encoding = {name: packed for name in content.data_vars if content[name].size > 1}
    # HDF5 may bring the process down when a disk is full; bytes that are complete cannot.
    return kind.save(path, bytes(content.to_netcdf(engine="h5netcdf", encoding=encoding)))


def load_dataset(
    kind: Kind, path: str | os.PathLike[str], read: "Callable[[xr.Dataset], T]"
) -> "T":
    """Return what ``read`` makes of the dataset in a file, after a check of its digest."""
    import xarray as xr

    content = kind.load(path)
    try:
        with xr.open_dataset(io.BytesIO(content), engine="h5netcdf", decode_times=False) as file:
            return read(file.load())
    except (ArithmeticError, AttributeError, LookupError, OSError, TypeError, ValueError) as error:
        raise kind.refusal(path, f"is damaged ({error})") from error
