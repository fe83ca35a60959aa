"""Rigid dumbbells in space that rub in a turning drum: starts, overlaps and motion.

Units are mm, g and s.  The drum is about the ``y`` axis and its bottom at negative ``z``.  A
placement is a row ``x y z`` and a unit quaternion, real part first.  Dumbbells start at rest, in a
drum at full speed.
"""

from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from polycorner import System
from polycorner.bodies import Arrangement, Body, Cylinder, capsule, compound, sphere
from polycorner.dumbbells import DumbbellDrum, RigidDumbbells
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.motion.noise import Solver
from polycorner.motion.simulation import start as started
from polycorner.spaces.manifold import Array

LENGTH, BALL, ROD = 16.0, 3.0, 1.5
RADIUS, SPIN = 125.0, 0.1  # of the drum; rad/s about +y
GRAVITY, DENSITY, FRICTION = 9810.0, 1e-3, 0.3
DT = 1e-3
TOLERANCE = 1e-8  # of the solvers of both engines


def dumbbell(axis: ArrayLike) -> Body:
    """Return two balls about the origin, a rod between them along a unit vector."""
    end = LENGTH / 2 * np.asarray(axis, dtype=float)
    parts = {"1": sphere(BALL, at=-end), "2": sphere(BALL, at=end), "rod": capsule(-end, end, ROD)}
    return compound(parts)


LEVEL = dumbbell([0, 1, 0])


@cache
def drum() -> Arrangement:
    """Return a dumbbell in the turning drum."""
    wall = Cylinder(RADIUS, axis=[0, 1, 0], spin=SPIN)
    return Arrangement({"D": LEVEL}, {"drum": wall}, orientations="all")


@cache
def pair() -> Arrangement:
    """Return two dumbbells."""
    return Arrangement({"A": LEVEL, "B": LEVEL}, orientations="all")


@cache
def system(count: int) -> System:
    """Return the mechanical system of dumbbells in the drum."""
    down = [0, 0, -GRAVITY]
    return drum().system(gravity=down, density=DENSITY, friction=FRICTION, count=count)


def rows_of(count: int) -> Array:
    """Return dumbbells along the axis of the drum, side by side in rows of six, ``(count, 7)``."""
    row, column = np.divmod(np.arange(count), 6)
    phi = (column - 2.5) * 0.09
    away = RADIUS - BALL
    places = np.stack([away * np.sin(phi), 30.0 * row, -away * np.cos(phi)], axis=-1)
    turns = Rotation.from_rotvec(np.stack([0 * phi, -phi, 0 * phi], axis=-1))
    return np.array([drum().point({"D": at}) for at in zip(places, turns, strict=True)])


def heap_of(count: int) -> Array:
    """Return dumbbells turned in all directions, in layers above the drum, ``(count, 7)``."""
    rng = np.random.default_rng(0)
    layer, rest = np.divmod(np.arange(count), 15)
    x, y = np.divmod(rest, 3)
    places = np.stack([23.0 * (x - 2), 23.0 * (y - 1), 23.0 * layer - 100], axis=-1)
    turns = Rotation.random(count, random_state=rng)
    return np.array([drum().point({"D": at}) for at in zip(places, turns, strict=True)])


def bunch_of(count: int) -> Array:
    """Return dumbbells scattered at the bottom, both balls of each on the drum, ``(count, 7)``."""
    lying = DumbbellDrum(LENGTH, BALL, ROD, RADIUS, count=count)
    return RigidDumbbells(lying).state(bunch(lying, np.random.default_rng(0))).q


def deepest_overlap(placements: Array) -> float:
    """Return the deepest overlap of dumbbells ``(count, 7)``, with each other and the round drum.

    Zero where nothing overlaps.  The gap at the drum is no distance, so that balls are measured.
    """
    turns = Rotation.from_quat(placements[:, 3:], scalar_first=True)
    half = turns.apply([0, LENGTH / 2, 0])
    ends = np.concatenate([placements[:, :3] - half, placements[:, :3] + half])
    overlaps = [np.hypot(ends[:, 0], ends[:, 2]).max() + BALL - RADIUS]
    one, two = np.triu_indices(len(placements), 1)
    if one.size:
        both = np.hstack([placements[one], placements[two]])
        overlaps.append(-pair().polyhedron.values(both).min())
    return max(0.0, *map(float, overlaps))


class Motion(Protocol):
    """Dumbbells moved by an engine."""

    @property
    def unsolved(self) -> int | None:
        """The number of islands that missed the tolerance until now, None if it is unknown."""

    def advance(self, steps: int) -> object:
        """Advance by steps of :data:`DT`."""

    def placements(self) -> Array:
        """Return the placements now, ``(count, 7)``."""

    def save(self) -> Any:
        """Return a copy of the state."""

    def load(self, saved: Any) -> None:
        """Continue from a saved state."""


class PolycornerMotion:
    """Dumbbells moved by polycorner, from placements ``(count, 7)`` at rest."""

    def __init__(self, placements: Array, tolerance: float = TOLERANCE) -> None:
        several = system(len(placements))
        state = several.state(placements if len(placements) > 1 else placements[0])
        self.engine = started(several, state, DT, solver=Solver(tolerance=tolerance))

    @property
    def unsolved(self) -> int:
        """The number of islands that missed the tolerance until now."""
        return self.engine.effort.unconverged

    def advance(self, steps: int) -> object:
        """Advance by steps of :data:`~bodies_in_drum.DT`."""
        return self.engine.advance(steps)

    def placements(self) -> Array:
        """Return the placements now, ``(count, 7)``."""
        return self.engine.motion.q.copy()

    def save(self) -> dict[str, Array]:
        """Return a copy of the state."""
        return {name: array.copy() for name, array in self.engine.save().items()}

    def load(self, saved: dict[str, Array]) -> None:
        """Continue from a saved state."""
        self.engine.load(saved)
