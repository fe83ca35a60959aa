"""Thousands of equal discs that rub in a turning drum, for polycorner and for Pymunk.

Units are cm, g and s.  The drum is half full and turns about the origin; discs start at rest, in
loose rows.
"""

from functools import cache
from importlib.util import find_spec

import numpy as np
import sympy

from polycorner import Friction, Manifold, Polyhedron, System, velocities
from polycorner.motion import (
    ContactFamily,
    Interval,
    PairFriction,
    Solver,
    pair_coordinates,
    pair_velocities,
)
from polycorner.motion.simulation import start as started
from polycorner.spaces.manifold import Array

RADIUS, GRAVITY, WALL, BETWEEN = 1.0, 981.0, 0.5, 0.3  # of a disc; coefficients of friction
FILLED, PACKED = 0.5, 0.85  # of the drum, and of the part that is filled
DT = 1e-3
SEGMENTS = 720  # of the drum, for Pymunk


def drum_radius(count: int) -> float:
    """Return the radius of the drum."""
    return float(RADIUS * np.sqrt(count / FILLED / PACKED))


@cache
def system(count: int, spin: float) -> System:
    """Return so many discs in a drum that turns by ``spin`` rad/s."""
    drum = drum_radius(count)
    M = Manifold.euclidean("x y a")
    x, y, _ = M.symbols
    vx, vy, w = velocities(M)
    far = sympy.sqrt(x**2 + y**2)
    along_wall = (x * vy - y * vx) / far + RADIUS * w - spin * drum
    (x1, y1, _), (x2, y2, _) = pair_coordinates(M)
    (u1, v1, w1), (u2, v2, w2) = pair_velocities(M)
    apart = sympy.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2)
    along = ((x2 - x1) * (v2 - v1) - (y2 - y1) * (u2 - u1)) / apart - RADIUS * (w1 + w2)
    return System(
        Polyhedron(M, {"drum": drum - RADIUS - far}),
        (vx**2 + vy**2) / 2 + RADIUS**2 * w**2 / 4,
        GRAVITY * y,
        friction=[Friction("wall", [along_wall], Interval(WALL), load="drum")],
        count=count,
        between=ContactFamily(
            {"discs": apart - 2 * RADIUS},
            reach=2 * RADIUS,
            friction=[PairFriction({"discs": along}, Interval(BETWEEN))],
        ),
    )


def loose_rows(count: int) -> Array:
    """Return discs in rows that do not touch, a little disturbed, ``(count, 3)``."""
    drum, apart = drum_radius(count), 2.05 * RADIUS
    rng, most = np.random.default_rng(0), int(drum / apart) + 1
    grid = np.array([(i, j) for j in range(-most, most + 1) for i in range(-most, most + 1)])
    places = apart * np.column_stack([grid[:, 0] + (grid[:, 1] % 2) / 2, 0.9 * grid[:, 1]])
    places += rng.uniform(-0.01, 0.01, places.shape)
    inside = places[np.hypot(*places.T) < drum - 1.1 * RADIUS]
    lowest = inside[np.argsort(inside[:, 1], kind="stable")[:count]]
    return np.column_stack([lowest, np.zeros(count)])


class Ours:
    """Discs in the drum, moved by polycorner."""

    def __init__(self, count: int, spin: float, solver: Solver) -> None:
        several = system(count, spin)
        self.engine = started(several, several.state(loose_rows(count)), DT, solver=solver)

    def step(self, steps: int) -> None:
        """Advance by so many steps."""
        self.engine.advance(steps)

    @property
    def state(self) -> tuple[Array, Array]:
        """Places and velocities."""
        return self.engine.motion.q, self.engine.motion.v


class Pymunk:
    """Discs in the drum, moved by Pymunk from a state."""

    def __init__(self, q: Array, v: Array, spin: float, iterations: int, threads: int) -> None:
        import pymunk

        drum = drum_radius(len(q))
        self.space = pymunk.Space(threaded=threads > 1)
        self.space.threads = threads
        self.space.gravity, self.space.iterations = (0.0, -GRAVITY), iterations
        self.space.collision_slop = 1e-3 * RADIUS
        turning = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        turning.angular_velocity = spin
        angles = np.linspace(0.0, 2 * np.pi, SEGMENTS + 1)
        ring = (
            (drum + 1.0)
            / np.cos(np.pi / SEGMENTS)
            * np.column_stack([np.cos(angles), np.sin(angles)])
        )
        self.space.add(turning)
        for a, b in zip(ring[:-1].tolist(), ring[1:].tolist(), strict=True):
            wall = pymunk.Segment(turning, a, b, 1.0)
            wall.friction = WALL / BETWEEN**0.5  # coefficients of two shapes are multiplied
            self.space.add(wall)
        self.bodies = []
        for (x, y, a), (vx, vy, w) in zip(q.tolist(), v.tolist(), strict=True):
            body = pymunk.Body(1.0, RADIUS**2 / 2)
            body.position, body.angle = (x, y), a
            body.velocity, body.angular_velocity = (vx, vy), w
            shape = pymunk.Circle(body, RADIUS)
            shape.friction = BETWEEN**0.5
            self.space.add(body, shape)
            self.bodies.append(body)

    def step(self, steps: int) -> None:
        """Advance by so many steps."""
        for _ in range(steps):
            self.space.step(DT)

    @property
    def state(self) -> tuple[Array, Array]:
        """Places and velocities."""
        q = [(*b.position, b.angle) for b in self.bodies]
        v = [(*b.velocity, b.angular_velocity) for b in self.bodies]
        return np.array(q), np.array(v)


def have_pymunk() -> bool:
    """Return whether Pymunk is installed; say so if it is not."""
    found = find_spec("pymunk") is not None
    if not found:
        print("Pymunk is left out: it is not installed; `pip install '.[bench]'`.")
    return found


def overlaps(q: Array) -> Array:
    """Return the overlaps of discs that overlap, with each other and with the drum."""
    from scipy.spatial import cKDTree

    places = q[:, :2]
    pairs = cKDTree(places).query_pairs(2 * RADIUS, output_type="ndarray")
    between = 2 * RADIUS - np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
    wall = np.hypot(*places.T) + RADIUS - drum_radius(len(q))
    return np.concatenate([between, wall[wall > 0]])
