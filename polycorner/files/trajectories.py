"""Trajectories of any system as NetCDF files."""

import json
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import forms
from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.motions import Poses, by_kind, recorded
from polycorner.checks import increasing, instance, names, refuse
from polycorner.container import BINARY, FileKind
from polycorner.files.formulas import formula_text
from polycorner.files.motions import (
    PARTICIPANTS,
    MotionUnits,
    column,
    load_dataset,
    motion_attributes,
    motion_coordinates,
    motion_data,
    read_motion,
    save_dataset,
)
from polycorner.files.polyhedra import arrangement_entry, read_arrangement
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.motion.assembly import Assembly
from polycorner.motion.bodies import IMPACT_LAWS
from polycorner.motion.contacts import ContactFamily
from polycorner.motion.drifts import Drift
from polycorner.motion.hulls.contacts import HullContacts
from polycorner.motion.system import System
from polycorner.motion.tables import read_touches
from polycorner.motion.ties import described_tie
from polycorner.motion.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray as xr

Moving = System | Assembly | Drift
KIND = FileKind("trajectory", "save_trajectory", BINARY)
OTHERS = ("time", "energy", "force", "impulse", "gap")
NOT_STATED = "not stated"


def trajectory_dataset(
    trajectory: Trajectory,
    *,
    units: Mapping[str, str] | None = None,
    arrangement: Arrangement | None = None,
) -> "xr.Dataset":
    """Return the trajectory of a system as an xarray dataset with units and versions.

    Parameters
    ----------
    trajectory : Trajectory
        As returned by :func:`~polycorner.motion.simulation.simulate`.
    units : mapping from str to str, optional
        Units of ``time`` (default s), ``energy``, ``force``, ``impulse`` and ``gap`` (default that
        of the contacts' functions); those of coordinates are the manifold's.
    arrangement : Arrangement, optional
        Whose system moved: it is kept as an attribute.

    Returns
    -------
    xarray.Dataset
        ``q`` and ``v`` over ``time``, ``body`` and ``coordinate``, ``gaps`` over ``time``,
        ``body`` and ``gap``, energies, contacts, events, dissipation and work by cause, and the
        computational effort.  Of an :class:`~polycorner.motion.Assembly` there are ``q_large`` over
        ``time``, ``body_large`` and ``coordinate_large``, ..., for each kind.
    """
    import xarray as xr

    system = _system(trajectory)
    told = {} if arrangement is None else _arrangement(arrangement, system)
    names("units", units or {}, OTHERS)
    kinds = [kind for _, kind in _kinds(system)]
    gaps = {f.unit for kind in kinds for f in kind.polyhedron.functions if f.unit}
    known = {"time": "s", "gap": gaps.pop() if len(gaps) == 1 else NOT_STATED}
    every = dict.fromkeys(OTHERS, NOT_STATED) | known | dict(units or {})
    motion = MotionUnits(*(every[key] for key in OTHERS[:-1]))
    data: dict[str, Any] = {}
    places = motion_coordinates(trajectory, motion)
    for (end, kind), q, v in zip(
        _kinds(system),
        system.bodies.split(trajectory.q),
        system.bodies.split(trajectory.v),
        strict=True,
    ):
        own = [unit or NOT_STATED for unit in kind.manifold.units]
        dimensions = ("time", f"body{end}", f"coordinate{end}")
        each = {"coordinate_units": json.dumps(own)}
        about = {"long_name": f"velocities, per {motion.time}"} | each
        data[f"q{end}"] = dimensions, q, {"long_name": "coordinates, not wrapped"} | each
        data[f"v{end}"] = dimensions, v, about
        over, values = ("time", f"body{end}", f"gap{end}"), _gaps(kind, q)
        data[f"gaps{end}"] = column(over, values, every["gap"], "gaps of the contacts")
        places |= {over[1]: np.arange(q.shape[1]), over[2]: list(kind.contacts)}
        places[dimensions[2]] = list(kind.manifold.names)
    return xr.Dataset(
        data | motion_data(trajectory, system.bodies.contact_names, motion),
        places,
        _attributes(trajectory, system) | told,
    )


def _kinds(system: Moving) -> list[tuple[str, System | Drift]]:
    """Return the kinds of bodies, and how the names of their variables end."""
    if not isinstance(system, Assembly):
        return [("", system)]
    return [(f"_{name}", kind) for name, kind in system.kinds.items()]


@checked
def save_trajectory(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    *,
    units: Mapping[str, str] | None = None,
    arrangement: Arrangement | None = None,
) -> Path:
    """Write the trajectory of a system as NetCDF, atomically.

    Parameters
    ----------
    trajectory : Trajectory
        As returned by :func:`~polycorner.motion.simulation.simulate`.
    path : path
        The file; its folder is created if it does not exist.
    units : mapping from str to str, optional
        See :func:`trajectory_dataset`.
    arrangement : Arrangement, optional
        Whose system moved: ``polycorner view FILE`` shows its bodies.

    Returns
    -------
    Path

    Raises
    ------
    TypeError, ValueError
        Naming the argument.  Runs in the drum are saved by
        :func:`~polycorner.dumbbells.dynamics.files.save_run`.
    OSError
        If the file cannot be written.
    """
    return save_dataset(
        KIND, path, trajectory_dataset(trajectory, units=units, arrangement=arrangement)
    )


@checked
def load_trajectory(path: str | os.PathLike[str], system: Moving) -> Trajectory:
    """Read the trajectory of a system back.

    The system must be that of the file: coordinates with periods and scales, energies, forces,
    gaps, friction and restitution, by the text of their formulas.

    Parameters
    ----------
    path : path
        A file that :func:`save_trajectory` wrote.
    system : System, Assembly or Drift
        The system that moved.

    Returns
    -------
    Trajectory

    Raises
    ------
    TypeError, ValueError
        If the file is no trajectory, was changed, or is of another system, naming the first
        difference.
    """
    if not isinstance(system, Assembly | Drift):
        instance("system", system, System)
    found = load_dataset(KIND, path, lambda content: _read(content, system))
    if isinstance(found, str):
        raise KIND.refusal(path, f"is of another system: {found}")
    return found


def saved_poses(path: str | os.PathLike[str]) -> Poses:
    """Return where bodies are in a motion that was written with its arrangement.

    Raises
    ------
    TypeError, ValueError
        If the file is no trajectory, was changed, or has no arrangement.
    """
    found = load_dataset(KIND, path, _read_poses)
    if found is None:
        raise KIND.refusal(path, "has no bodies, as save_trajectory(..., arrangement=...) keeps")
    return found


def _read_poses(content: "xr.Dataset") -> Poses | None:
    if "arrangement" not in content.attrs:
        return None
    arrangement = read_arrangement("arrangement", json.loads(content.attrs["arrangement"]))
    contacts = forms.many(forms.text)("contacts", json.loads(content.attrs["contacts"]))
    T, N = content["present"].shape

    def of(name: str, *shape: int, kind: str = "f", **limits: Any) -> Any:
        return forms.array(name, np.array(content[name].values), kind, shape, **limits)

    if "q" in content:
        if N > 1 and len(arrangement.named) > 1:
            refuse("arrangement", "one body, which is repeated", [*arrangement.named])
        q, v = (of(name, T, N, arrangement.manifold.size) for name in ("q", "v"))
        both = by_kind(arrangement, q), by_kind(arrangement, v)
    else:
        sizes = [(f"_{p.name}", p.manifold.size) for p in arrangement.placements]
        places, rates = ([of(name + end, T, -1, n) for end, n in sizes] for name in ("q", "v"))
        both = places, rates
    present = of("present", T, N, kind="i", least=0, most=1) != 0
    columns = [of(f"touch_{name}", -1, kind="i") for name in ("instant", *PARTICIPANTS)]
    table = {
        "touch": np.stack(columns, axis=1).astype(np.int64),
        "touch_force": of("touch_force", -1),
    }
    touching = tuple(read_touches(table, contacts, T, N))
    times = increasing("time", content["time"].values)
    return recorded(arrangement, times, *both, present, touching)


def _arrangement(arrangement: Arrangement, system: Moving) -> dict[str, str]:
    own = instance("arrangement", arrangement, Arrangement)
    known = tuple(name for _, kind in _kinds(system) for name in kind.manifold.names)
    if own.manifold.names != known:
        refuse("arrangement", f"one of the coordinates {', '.join(known)}", own.manifold.names)
    return {"arrangement": json.dumps(arrangement_entry(own))}


def _system(trajectory: Trajectory) -> Moving:
    if not isinstance(trajectory, Trajectory):
        msg = f"trajectory: expected a Trajectory; got {type(trajectory).__name__}"
        raise TypeError(msg)
    if not isinstance(trajectory.system, Moving):
        msg = (
            "trajectory: expected that of a System; got one of "
            f"{type(trajectory.system).__name__}: save_run keeps runs in the drum"
        )
        raise TypeError(msg)
    return trajectory.system


def _attributes(trajectory: Trajectory, system: Moving) -> dict[str, Any]:
    return {
        "title": "Motion of a system with unilateral contacts",
        **motion_attributes(trajectory, system.bodies.contact_names),
        "system": json.dumps(_told(system)),
    }


def _told(system: Moving) -> dict[str, Any]:
    """Return a system as plain values, formulas as text."""
    if isinstance(system, Drift):
        return _drift(system)
    told: dict[str, Any] = {}
    if system.ties:
        told["ties"] = [described_tie(tie, formula_text) for tie in system.ties]
    if isinstance(system, System):
        own = {"count": system.count, "between": _between(system.between)}
        return _body(system) | own | told
    bodies = {f"kind {name}": _body(kind) for name, kind in system.kinds.items()}
    pairs = {f"between {a} and {b}": _between(f) for (a, b), f in system.between.items()}
    return bodies | pairs | {"count": dict(system.count)} | told


def _drift(drift: Drift) -> dict[str, Any]:
    """Return first-order motion as plain values."""
    manifold, polyhedron, text = drift.manifold, drift.polyhedron, formula_text
    return {
        "coordinates": list(manifold.names),
        "periods": [str(period) for period in manifold.periods],
        "scales": list(manifold.scales),
        "contacts": list(drift.contacts),
        "velocity": {name: text(u) for name, u in drift.velocity.items()},
        "potential": None if drift.energy is None else _gap(drift.energy),
        "mobility": [[text(e) for e in row] for row in drift.mobility_formulas.tolist()],
        "noise": drift.noise,
        "limits": {name: text(e) for name, e in drift.limits.items()},
        "gaps": {f.name: _gap(f) for f in polyhedron.functions},
        "unions": [[sorted(piece) for piece in union] for union in polyhedron.unions[1]],
        "equations": {h.name: [text(h.expression), *h.parameters] for h in polyhedron.stated},
        "count": drift.count,
        "between": _between(drift.between),
        "exits": dict(drift.exits),
    }


def _body(system: System) -> dict[str, Any]:
    """Return one body of a system."""
    text = formula_text
    manifold, polyhedron = system.manifold, system.polyhedron
    friction = {
        f.name: [
            [*map(_slip, f.slip)],
            f.load if isinstance(f.load, str) else [text(load) for load in f.load],
            f"{f.static}, {f.moving}",
        ]
        for f in system.friction
    }
    told: dict[str, Any] = {
        "coordinates": list(manifold.names),
        "periods": [str(period) for period in manifold.periods],
        "scales": list(manifold.scales),
        "contacts": list(system.contacts),
        "restitution": system.restitutions.tolist(),
        **({} if system.impact == IMPACT_LAWS[0] else {"impact": system.impact}),
        "friction": friction,
        "kinetic": text(system.kinetic),
        "potential": text(system.potential),
        "forces": {name: text(force) for name, force in system.forces.items()},
        "gaps": {f.name: _gap(f) for f in polyhedron.functions},
        "equations": {h.name: [text(h.expression), *h.parameters] for h in polyhedron.stated},
    }
    if system.hulls:
        told["hulls"] = [hulls.described() for hulls in system.hulls]
    return told


def _between(family: ContactFamily | HullContacts | None) -> dict[str, Any] | None:
    """Return the contacts of two bodies."""
    if isinstance(family, HullContacts):
        return family.described()
    if family is None:
        return None
    pull = family.attraction
    return {
        **({} if pull is None else {"attraction": [pull.force, pull.range]}),
        "gaps": {name: formula_text(gap) for name, gap in family.gaps.items()},
        "friction": [
            [
                {name: [*map(_slip, slip)] for name, slip in law.slip.items()},
                f"{law.static}, {law.moving}",
            ]
            for law in family.friction
        ],
        "restitution": family.restitution,
    }


def _gap(function: SmoothFunction) -> list[Any]:
    """Return a gap as text, or as a digest where its formula is written in steps, as of bodies.

    Written out at once it can be too long for any file.
    """
    if _in_steps(function.family):
        return [*_slip(function)]
    return [formula_text(function.expression), *function.parameters]


def _slip(component: Any) -> Any:
    """Return a component of a slip as text; a function that is shared as a digest and numbers."""
    if not isinstance(component, SmoothFunction):
        return formula_text(component)
    return [
        _digest(component.family),
        component.member_name,
        *component.reads,
        *component.parameters,
    ]


@lru_cache(maxsize=64)
def _in_steps(family: Family) -> bool:
    return bool(family.formulas()[0])


@lru_cache(maxsize=64)
def _digest(family: Family) -> str:
    return family.program().digest()


def _read(content: "xr.Dataset", system: Moving) -> "str | Trajectory":
    written, here = json.loads(content.attrs["system"]), _told(system)
    for key, value in here.items():
        if "count" in written and key not in written:  # of one kind and of several
            return f"{key}: written nothing, found {value}"
        if written[key] != value:
            return f"{key}: written {written[key]}, found {value}"
    q, v = (
        [np.array(content[name + end].values) for end, _ in _kinds(system)] for name in ("q", "v")
    )
    if not isinstance(system, Assembly):
        return read_motion(content, system, q[0], v[0])
    # Each has the shape of its kind: together they might have the right size otherwise.
    for kind, *each in zip(system.bodies.kinds, q, v, strict=True):
        shape = len(content["time"]), kind.count, kind.dimension
        for array in each:
            forms.array("q", array, "f", shape)
    joined = [np.concatenate([a.reshape(len(a), -1) for a in every], axis=1) for every in (q, v)]
    return read_motion(content, system, *joined)


def _gaps(system: System | Drift, q: Any) -> Any:
    """Return the gaps of all contacts at places of a body, or of several of a kind."""
    rows, names = q.reshape(-1, q.shape[-1]), system.manifold.names
    hulls = () if isinstance(system, Drift) else system.hulls
    further = [some.values(names, rows) for some in hulls]
    gaps = [system.polyhedron.values(q), *(f.reshape(*q.shape[:-1], -1) for f in further)]
    return np.concatenate(gaps, axis=-1)
