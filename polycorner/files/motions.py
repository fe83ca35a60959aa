"""Datasets and NetCDF files of motions: the part that all systems have in common.

The structure of HDF5 files, checked before anything in them is read.

HDF5 can store a dataset in other files of the machine, link to these, and declare shapes for which
nothing is stored.  What is written here needs none of that: arrays in the root, at most deflated.
"""

import io
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from polycorner import checks, forms
from polycorner.checks import refuse
from polycorner.container import FileKind, versions
from polycorner.motion.engine.driver import Effort
from polycorner.motion.events import EventKind
from polycorner.motion.mechanics import MechanicalSystem
from polycorner.motion.noise import Noise
from polycorner.motion.tables import (
    event_table,
    read_events,
    read_friction,
    read_touches,
    touch_table,
)
from polycorner.motion.trajectory import Trajectory
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import xarray as xr

# What a byte can become by deflating at most (https://zlib.net/zlib_tech.html), and shuffling.
INFLATED = 1032
DEFLATE, SHUFFLE = 1, 2  # filters, as HDF5 counts them
# References to the scales of dimensions, which NetCDF keeps in these attributes.
SCALES = ("DIMENSION_LIST", "REFERENCE_LIST")
LENGTH = b"This is a netCDF dimension but not a netCDF variable"  # has no numbers, and is not read
EFFORT = tuple(field.name for field in fields(Effort))
T = TypeVar("T")
PARTICIPANTS = ("body_1", "body_2", "contact")
RUBBING = ("instant", "body_1", "body_2", "law")


def check_structure(content: bytes, stream: Any) -> None:
    """Raise ValueError if an HDF5 file has more than arrays of numbers and texts in its root."""
    import h5py

    with h5py.File(stream, "r") as file:
        stored = 0
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                _refuse(name, "is a link to something else")
            if file.get(name, getclass=True) is not h5py.Dataset:
                _refuse(name, "is no array")
            dataset = file[name].id
            _check_attributes(name, dataset, len(content))
            is_read = not bytes(file[name].attrs.get("NAME", b"")).startswith(LENGTH)
            for why in _faults(dataset, is_read=is_read):
                _refuse(name, why)
            stored += dataset.get_storage_size()
        if stored > len(content):
            _refuse("content", f"is of {stored} bytes, more than the file")
        _check_attributes("/", file.id, len(content))


def _faults(dataset: Any, *, is_read: bool) -> Iterator[str]:
    import h5py

    how, kind, shape = dataset.get_create_plist(), dataset.dtype, dataset.shape
    if how.get_external_count():
        yield "is stored in other files"
    if how.get_layout() not in (h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED):
        yield "is put together from other arrays"
    if not _is_plain(kind):
        yield f"has the type {kind}"
    if shape is None:
        yield "has no shape"
        return
    chunks = how.get_chunk() if how.get_layout() == h5py.h5d.CHUNKED else ()
    sizes = zip(chunks, shape, strict=bool(chunks))
    if math.prod(shape) and any(size > extent for size, extent in sizes):
        yield "has pieces larger than itself"
    filters = [how.get_filter(k)[0] for k in range(how.get_nfilters())]
    if not set(filters) <= {DEFLATE, SHUFFLE} or len(set(filters)) < len(filters):
        yield "is packed in another way"
    most = dataset.get_storage_size() * (INFLATED if filters else 1)
    if is_read and math.prod(shape) * kind.itemsize > most:
        yield f"has the shape {shape}, for which nothing is stored"


def _is_plain(kind: Any) -> bool:
    import h5py

    return kind.kind in "iufSU" or h5py.check_string_dtype(kind) is not None


def _check_attributes(name: str, owner: Any, size: int) -> None:
    import h5py

    for k in range(h5py.h5a.get_num_attrs(owner)):
        attribute = h5py.h5a.open(owner, index=k)
        label = attribute.name.decode()
        if not _is_plain(attribute.dtype) and label not in SCALES:
            _refuse(f"{name}: {label}", f"has the type {attribute.dtype}")
        if attribute.get_storage_size() > size:
            _refuse(f"{name}: {label}", "is larger than the file")


def _refuse(place: str, why: str) -> None:
    msg = f"{place} {why}"
    raise ValueError(msg)


@dataclass(frozen=True)
class MotionUnits:
    """Units of the quantities that every motion has."""

    time: str = "s"
    energy: str = "not stated"
    force: str = "not stated"
    impulse: str = "not stated"


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
    return data | {"touch_force": force} | _rubbing(path, units)


def _rubbing(path: Trajectory, units: MotionUnits) -> dict[str, Any]:
    data: dict[str, Any] = {}
    for k, name in enumerate(RUBBING):
        words = f"friction: {name}, counted from 0 (-1: none)"
        data[f"rub_{name}"] = column(("rub",), path.friction.whole[:, k], "1", words)
    for k in range(2):
        words = f"component {k} of the friction"
        data[f"rub_force_{k}"] = column(("rub",), path.friction.forces[:, k], units.force, words)
    return data


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
        "body": np.arange(path.rests.shape[1]),
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
        "seed": np.int64(path.noise.seed),
        "noise_chatter": float(path.noise.chatter),
        "noise_correlation_time": float(path.noise.correlation_time),
        "noise_kicks": json.dumps(dict(path.noise.kicks)),
        "noise_kick_time": float(path.noise.kick_time),
        "noise_scatter": json.dumps(dict(path.noise.scatter)),
        "every": np.int64(path.every),
        "t_end": math.nan if path.t_end is None else path.t_end,
        "steps_per_second": path.steps_per_second,
    }


def read_motion(content: "xr.Dataset", system: MechanicalSystem, q: Array, v: Array) -> Trajectory:
    """Return the trajectory in a dataset, given its coordinates and velocities.

    Raises
    ------
    TypeError, ValueError
        If an array has another shape than the system asks for, or a number is none or not one of
        such a motion.
    """
    at, bodies, T = content.attrs, system.bodies, len(content["time"])
    names = json.loads(at["contacts"])
    forms.many(forms.word(*bodies.contact_names))("contacts", names)

    def of(name: str, *shape: int, kind: str = "f", **limits: Any) -> Any:
        return forms.array(name, np.array(content[name].values), kind, shape, **limits)

    def by(name: str) -> dict[str, Any]:
        causes = [str(cause) for cause in content[f"{name}_by"].values]
        return dict(zip(causes, of(name, T, len(causes)).T, strict=True))

    def table(kind: str, first: str) -> Any:
        columns = [of(f"{kind}_{name}", -1, kind="i") for name in (first, *PARTICIPANTS)]
        return np.stack(columns, axis=1).astype(np.int64)

    def flags(name: str) -> Any:
        return of(name, T, bodies.total, kind="i", least=0, most=1) != 0

    for name, array in (("q", q), ("v", v)):
        forms.array(name, array, "f", (T, *bodies.shape))
    times = of("time", T)
    if not T or (np.diff(times) <= 0).any():
        refuse("time", "increasing times", times.tolist())
    touches = {"touch": table("touch", "instant"), "touch_force": of("touch_force", -1)}
    rubbing: dict[str, Any] = {}
    if "rub_law" in content:
        rows = [of(f"rub_{name}", -1, kind="i") for name in RUBBING]
        forces = [of(f"rub_force_{k}", -1) for k in range(2)]
        rubbing = {"rub": np.stack(rows, axis=1), "rub_force": np.stack(forces, axis=1)}
    numbers = np.stack([of("event_time", -1), of("event_impulse", -1)], axis=1)
    events = {"event": table("event", "kind"), "event_numbers": numbers}
    costs = {
        name: checks.whole(f"effort_{name}", at[f"effort_{name}"], least=0)
        for name in EFFORT
        if name != "residual"
    }
    return Trajectory(
        system=system,
        dt=checks.real("dt", at["dt"], above=0),
        times=times,
        q=q,
        v=v,
        rests=flags("rests"),
        present=flags("present"),
        touching=tuple(read_touches(touches, names, T, bodies.total)),
        kinetic=of("kinetic", T),
        potential=of("potential", T),
        dissipated=by("dissipated"),
        work=by("work"),
        events=read_events(events, names, bodies.total),
        max_penetration=checks.real("max_penetration", at["max_penetration"], least=0),
        effort=Effort(
            **costs,
            residual=checks.real("effort_residual", at["effort_residual"], least=0, infinite=True),
        ),
        noise=_noise(at),
        every=checks.whole("every", at["every"], least=1),
        t_end=None if math.isnan(at["t_end"]) else checks.real("t_end", at["t_end"]),
        steps_per_second=float(at["steps_per_second"]),
        friction=read_friction(rubbing, bodies.rubbing, T, bodies.total),
    )


def _noise(at: Mapping[Any, Any]) -> Noise:
    return Noise(
        chatter=float(at["noise_chatter"]),
        correlation_time=float(at["noise_correlation_time"]),
        kicks=json.loads(at["noise_kicks"]),
        kick_time=float(at.get("noise_kick_time", 0.0)),
        scatter=json.loads(at.get("noise_scatter", "{}")),
        seed=int(at["seed"]),
    )


# -------------------------------------------------------------------------------------------- files


def save_dataset(kind: FileKind, path: str | os.PathLike[str], content: "xr.Dataset") -> Path:
    """Write a dataset as NetCDF, atomically."""
    packed = {"zlib": True, "complevel": 4}
    encoding = {name: packed for name in content.data_vars if content[name].size > 1}
    # HDF5 may bring the process down when a disk is full; bytes that are complete cannot.
    return kind.save(path, bytes(content.to_netcdf(engine="h5netcdf", encoding=encoding)))


def load_dataset(
    kind: FileKind, path: str | os.PathLike[str], read: "Callable[[xr.Dataset], T]"
) -> "T":
    """Return what ``read`` makes of the dataset in a file, after checks of digest and structure."""
    import xarray as xr

    content = kind.load(path)
    with kind.reading(path):
        check_structure(content, io.BytesIO(content))
        with xr.open_dataset(io.BytesIO(content), engine="h5netcdf", decode_cf=False) as file:
            return read(file.load())
