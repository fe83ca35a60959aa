"""Trajectories of any system as NetCDF files: computed again where they can be when loaded."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.files.container import Kind
from polycorner.files.models import check_stated, coordinate_units
from polycorner.files.motion_checks import motion_fault
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
from polycorner.motion.system import System
from polycorner.motion.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray as xr

KIND = Kind("a trajectory", "save_trajectory", "polycorner_trajectory", schema=1)
OTHERS = ("time", "energy", "force", "impulse", "gap")
NOT_STATED = "not stated"
GAPS = 1e-9  # by how much gaps may differ, of the larger of a gap and its slope


def trajectory_dataset(
    trajectory: Trajectory, *, units: Mapping[str, str] | None = None
) -> "xr.Dataset":
    """Return the trajectory of a system as an xarray dataset with units and versions.

    Parameters
    ----------
    trajectory : Trajectory
        What :func:`~polycorner.motion.simulation.simulate` returned.
    units : mapping from str to str, optional
        Units of coordinates by name, and of ``time`` (default s), ``energy``, ``force``,
        ``impulse`` and ``gap``.  A circle of period ``2 pi`` is an angle in ``rad``.

    Returns
    -------
    xarray.Dataset
        ``q`` and ``v`` over ``time``, ``body`` and ``coordinate``, ``gaps`` over ``time`` and
        ``gap``, energies, contacts, events, where the energy went, and what it cost.
    """
    import xarray as xr

    system = _system(trajectory)
    stated = dict(units or {})
    check_stated(stated, (*system.manifold.names, *OTHERS))
    every = {key: stated.get(key, NOT_STATED) for key in OTHERS} | {"time": stated.get("time", "s")}
    motion = MotionUnits(*(every[key] for key in OTHERS[:-1]))
    known = coordinate_units(system.manifold, stated)
    own = [unit or NOT_STATED for unit in known.values()]
    dimensions = ("time", "body", "coordinate")
    each = {"coordinate_units": json.dumps(own)}
    data = {
        "q": (dimensions, trajectory.q, {"long_name": "coordinates, not wrapped"} | each),
        "v": (dimensions, trajectory.v, {"long_name": f"velocities, per {motion.time}"} | each),
        "gaps": column(("time", "gap"), _gaps(trajectory), every["gap"], "gaps of the contacts"),
    }
    return xr.Dataset(
        data | motion_data(trajectory, system.contacts, motion),
        motion_coordinates(trajectory, motion)
        | {"coordinate": list(system.manifold.names), "gap": list(system.contacts)},
        _attributes(trajectory, system),
    )


def save_trajectory(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    *,
    units: Mapping[str, str] | None = None,
) -> Path:
    """Write the trajectory of a system as NetCDF; the file appears whole or not at all.

    Parameters
    ----------
    trajectory : Trajectory
        What :func:`~polycorner.motion.simulation.simulate` returned.
    path : path
        The file; its folder is made if need be.
    units : mapping from str to str, optional
        See :func:`trajectory_dataset`.

    Returns
    -------
    Path

    Raises
    ------
    TypeError, ValueError
        Naming the argument.  Runs in the drum are kept by
        :func:`~polycorner.dumbbells.dynamics.files.save_run`.
    OSError
        If the file cannot be written.
    """
    return save_dataset(KIND, path, trajectory_dataset(trajectory, units=units))


def load_trajectory(path: str | os.PathLike[str], system: System) -> Trajectory:
    """Read a trajectory back, comparing it with the system.

    Names, periods and restitution have to be the system's; instants to be whole steps apart;
    kinetic and potential energy at all recorded instants are computed again from ``q`` and ``v``
    and have to agree to ``1e-9`` of the largest energy; gaps are computed again, and none may
    overlap by more than the deepest overlap met and what moves within a step.

    Parameters
    ----------
    path : path
        A file that :func:`save_trajectory` wrote.
    system : System
        What moved: formulas are not in the file.

    Returns
    -------
    Trajectory

    Raises
    ------
    TypeError, ValueError
        If the file is no trajectory or was changed, or if it is one of another system.
    """
    if not isinstance(system, System):
        msg = f"system: expected a System; got {type(system).__name__}"
        raise TypeError(msg)
    found = load_dataset(KIND, path, lambda content: _read(content, system))
    if isinstance(found, str):
        raise KIND.refusal(path, f"is of another system: {found}")
    trajectory: Trajectory = found[0]
    if fault := motion_fault(trajectory) or _gap_fault(trajectory, found[1]):
        raise KIND.refusal(path, f"is not what is computed here: {fault}")
    return trajectory


def _system(trajectory: Trajectory) -> System:
    if not isinstance(trajectory, Trajectory):
        msg = f"trajectory: expected a Trajectory; got {type(trajectory).__name__}"
        raise TypeError(msg)
    if not isinstance(trajectory.system, System):
        msg = (
            "trajectory: expected that of a System; got one of "
            f"{type(trajectory.system).__name__}: save_run keeps runs in the drum"
        )
        raise TypeError(msg)
    return trajectory.system


def _attributes(trajectory: Trajectory, system: System) -> dict[str, Any]:
    return {
        "title": "Motion of a system with unilateral contacts",
        **motion_attributes(trajectory, system.contacts),
        "system": json.dumps(_told(system)),
    }


def _told(system: System) -> dict[str, Any]:
    """Return what can be told of a system without its formulas."""
    manifold = system.manifold
    return {
        "coordinates": list(manifold.names),
        "periods": [str(period) for period in manifold.periods],
        "scales": list(manifold.scales),
        "contacts": list(system.contacts),
        "restitution": system.restitutions.tolist(),
        "friction": [f"{f.name}: {f.static}, {f.moving}" for f in system.friction],
    }


def _read(content: "xr.Dataset", system: System) -> "str | tuple[Trajectory, xr.DataArray]":
    written, here = json.loads(content.attrs["system"]), _told(system)
    for key, value in here.items():
        if written[key] != value:
            return f"{key}: written {written[key]}, found {value}"
    q, v = (np.array(content[name].values) for name in ("q", "v"))
    return read_motion(content, system, q, v), content["gaps"]


def _gaps(trajectory: Trajectory) -> Any:
    return _system(trajectory).polyhedron.values(trajectory.q[:, 0])


def _gap_fault(trajectory: Trajectory, written: "xr.DataArray") -> str:
    d, q = _system(trajectory).polyhedron, trajectory.q[:, 0]
    values, gradients = d.evaluate(q, 1)
    slopes = abs(gradients * d.manifold.scale_array).max(axis=-1)
    apart = abs(written.values - values) / np.maximum(np.maximum(slopes, abs(values)), 1e-300)
    off = ~(apart <= GAPS)
    if not off.any():
        return ""
    t, g = np.argwhere(off)[0]
    said = f"written {float(written.values[t, g]):.12g}, found {values[t, g]:.12g}"
    return f"gap {d.names[g]!r} at the time {trajectory.times[t]:g}: {said}"
