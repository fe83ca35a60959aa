"""Motions in the drum made by hand: where dumbbells are is given, what touches is found."""

import math

import numpy as np

from polycorner import stratum_at
from polycorner.dumbbells.drum import GRAVITY
from polycorner.motion.engine.driver import Effort
from polycorner.motion.recorder import WORK
from polycorner.motion.trajectory import Trajectory


def moved(drum, places, *, leaves=None):
    """Return a run through places ``(T, N, 3)``, an instant every 0.1 s.

    ``leaves`` are a dumbbell and the instant from which on it has left.
    """
    count, bodies = places.shape[:2]
    q = np.concatenate([places, np.zeros((count, bodies, 1))], axis=-1)
    present = np.ones((count, bodies), dtype=bool)
    if leaves is not None:
        present[leaves[1] :, leaves[0]] = False
    return recorded(
        drum,
        0.1 * np.arange(count),
        q,
        present=present,
        touching=tuple(touches(drum, instant) for instant in places),
        potential=np.where(present, heights(drum, places), 0.0).sum(axis=1),
    )


def recorded(drum, times, q, **given):
    """Return a trajectory of dumbbells at placements ``(T, N, 4)``, written down by hand."""
    count, bodies = q.shape[:2]
    zeros = np.zeros(count)
    usual = {
        "rests": np.zeros((count, bodies), dtype=bool),
        "present": np.ones((count, bodies), dtype=bool),
        "touching": ((),) * count,
        "kinetic": zeros,
        "potential": zeros,
        "dissipated": dict.fromkeys(drum.bodies.causes, zeros),
        "work": dict.fromkeys(WORK, zeros),
        "events": (),
        "max_penetration": 0.0,
        "effort": Effort(round((times[-1] - times[0]) / 0.1), 0, 0, 0, 0, 0.0),
    }
    return Trajectory(
        system=drum, dt=0.1, times=times, q=q, v=np.zeros_like(q), t_end=float(times[-1]),
        **(usual | given),
    )  # fmt: skip


def heights(drum, places):
    """Return the potential energy of each dumbbell, ``(T, N)``: weights times heights of balls."""
    both = np.concatenate([places, places], axis=-1)
    balls = drum.pair.ball_centres(both)[..., :2, :]
    height = balls[..., 1] * math.sin(drum.tilt) + balls[..., 2] * math.cos(drum.tilt)
    return drum.ball_mass * GRAVITY * height.sum(axis=-1)


def touches(drum, places):
    """Return the contacts that are closed, as a trajectory records them."""
    found = []
    for i in range(len(places)):
        for j in range(i + 1, len(places)):
            pair = np.concatenate([places[i], places[j]])
            closed = stratum_at(drum.pair.polyhedron, pair, tolerance=1e-6).active
            found += [((i, j), name, 1.0) for name in closed]
    return tuple(found)
