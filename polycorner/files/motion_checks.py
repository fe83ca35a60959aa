"""What a recorded motion says of itself, computed again from its places and velocities."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from polycorner.motion.bodies import IdenticalBodies
from polycorner.motion.recorder import WORK
from polycorner.motion.system import bodies_of
from polycorner.motion.trajectory import Trajectory
from polycorner.spaces.manifold import Array

ENERGIES = 1e-9  # by how much energies may differ from those written, of the largest there is
STEPS = 1e-6  # by how much instants may be off a whole number of steps
DEPTH = 1e-9  # in units of the gaps, by which overlaps may be deeper than is written


def motion_fault(path: Trajectory) -> str:
    """Return the first thing in which a motion does not fit what moves, or nothing.

    Shapes and instants; kinetic and potential energy of those present, up to ``1e-9`` of the
    largest; causes of dissipation and work; numbers of bodies and contacts; and overlaps, which at
    recorded instants may be deeper than the deepest one by what moves within a step.
    """
    return next(_faults(path), "")


def _faults(path: Trajectory) -> Iterator[str]:
    system = bodies_of(path.system)
    expected = (len(path.times), system.count, system.dimension)
    for name, values, shape in (
        ("q", path.q, expected),
        ("v", path.v, expected),
        ("rests", path.rests, expected[:2]),
        ("present", path.present, expected[:2]),
    ):
        if values.shape != shape:
            yield f"{name} has the shape {values.shape}, expected {shape}"
        if not np.isfinite(values).all():
            yield f"{name} has numbers that are not finite"
    yield from _time_faults(path)
    yield from _name_faults(path, system)
    yield from _energy_faults(path, system)
    yield from _overlap_faults(path, system)


def _time_faults(path: Trajectory) -> Iterator[str]:
    times, dt = path.times, path.dt
    if not (len(times) and dt > 0 and np.isfinite(times).all() and (np.diff(times) > 0).all()):
        yield "instants do not grow, or there are none"
        return
    done = (times - times[0]) / dt
    if (abs(done - np.round(done)) > STEPS * np.maximum(1.0, done)).any():
        yield f"instants are not whole steps of {dt:g} apart"
    if round(float(done[-1])) != path.effort.steps:
        yield f"{path.effort.steps} steps were done, not those up to the last instant"
    late = [e for e in path.events if not times[0] - dt <= e.time <= times[-1] + dt]
    if late:
        yield f"an event at {late[0].time:g} is outside of the motion"


def _name_faults(path: Trajectory, system: IdenticalBodies) -> Iterator[str]:
    if tuple(path.dissipated) != system.causes:
        yield f"causes of dissipation: written {', '.join(path.dissipated)}, found {system.causes}"
    left = ("left",) if system.exit_coordinate >= 0 else ()
    if tuple(path.work) != (*WORK, *left):
        yield f"kinds of work: written {', '.join(path.work)}"
    for bodies, contact in _met(path):
        known = system.body.contacts if len(bodies) == 1 else system.pair_contacts
        if not all(0 <= i < system.count for i in bodies) or (contact and contact not in known):
            yield f"contact {contact!r} of the bodies {bodies} is not there"


def _met(path: Trajectory) -> Iterator[tuple[tuple[int, ...], str]]:
    for touches in path.touching:
        yield from ((bodies, contact) for bodies, contact, _ in touches)
    yield from ((event.bodies, event.contact) for event in path.events)


# ----------------------------------------------------------------------------------------- energies


def recomputed_energies(path: Trajectory, system: IdenticalBodies) -> Array:
    """Return kinetic and potential energy of the bodies that are present, ``(T, 2)``."""
    kernel = system.body.formulation.energies.kernel
    numbers = np.array([*system.body.parameters, 0.0])
    at = np.concatenate([path.q, path.v], axis=2).reshape(-1, 2 * system.dimension)
    (values,) = kernel.over(at, numbers.ctypes.data, 0)
    each = values.reshape(*path.present.shape, 2)
    return np.asarray(np.where(path.present[..., None], each, 0.0).sum(axis=1))


def _energy_faults(path: Trajectory, system: IdenticalBodies) -> Iterator[str]:
    anew = recomputed_energies(path, system)
    size = float(abs(anew).max())
    for name, written, found in zip(
        ("kinetic", "potential"), (path.kinetic, path.potential), anew.T, strict=True
    ):
        apart = ~(abs(written - found) <= ENERGIES * size)
        if apart.any():
            t = int(np.argmax(apart))
            said = f"written {written[t]:.12g}, found {found[t]:.12g}"
            yield f"{name} energy at the time {path.times[t]:g}: {said}"


# ----------------------------------------------------------------------------------------- overlaps


def _overlap_faults(path: Trajectory, system: IdenticalBodies) -> Iterator[str]:
    for names, present, gaps, moves in (*_own_gaps(path, system), *_pair_gaps(path, system)):
        allowed = path.max_penetration + DEPTH * system.body.gap_unit + path.dt * moves
        deep = (-gaps > allowed) & present[:, None]
        if deep.any():
            t, g = np.argwhere(deep)[0]
            yield (
                f"contact {names[g]!r} overlaps by {-gaps[t, g]:.6g} at the time "
                f"{path.times[t]:g}, and the deepest overlap is said to be {path.max_penetration:g}"
            )


# Names of contacts, the instants they are asked at, gaps and how fast these may change, (T, m).
Gaps = tuple[tuple[str, ...], NDArray[np.bool_], Array, Array]


def _own_gaps(path: Trajectory, system: IdenticalBodies) -> Iterator[Gaps]:
    for i in range(system.count):
        for call in system.body.gaps:
            reads = list(call.reads)
            at, speed = path.q[:, i, reads], path.v[:, i, reads]
            kernel, address = call.family.kernel, call.parameters.ctypes.data
            values, gradients = kernel.over(np.ascontiguousarray(at), address, 1)
            moves = (abs(gradients) * abs(speed)[:, None]).sum(axis=2)
            names = tuple(system.body.contacts[row] for row in call.rows)
            columns = list(call.columns)
            yield names, path.present[:, i], values[:, columns], moves[:, columns]


def _pair_gaps(path: Trajectory, system: IdenticalBodies) -> Iterator[Gaps]:
    """Yield the gaps of all pairs that are near along the second of the coordinates of a place."""
    family = system.contacts
    if family is None:
        return
    where, numbers = system.position[1], np.array([*family.parameters, 0.0])
    along = path.q[..., where] * system.body.units[where]
    body, column = (list(part) for part in zip(*family.reads, strict=True))
    for pair in combinations(range(system.count), 2):
        near = np.flatnonzero(abs(along[:, pair[0]] - along[:, pair[1]]) <= family.reach)
        if not near.size:
            continue
        bodies = [pair[b] for b in body]
        at, speed = (np.ascontiguousarray(x[near][:, bodies, column]) for x in (path.q, path.v))
        values, gradients = family.gaps.kernel.over(at, numbers.ctypes.data, 1)
        moves = (abs(gradients) * abs(speed)[:, None]).sum(axis=2)
        present = path.present[near][:, pair[0]] & path.present[near][:, pair[1]]
        yield family.gaps.names, present, values, moves
