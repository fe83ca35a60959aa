"""Scenes of rigid bodies for several engines: shapes, placements, energies and overlaps.

Nothing here belongs to an engine.  Units are m, kg and s; gravity acts along the last axis.  The
placement of a body is ``x, y, angle`` or ``x, y, z`` and a unit quaternion, scalar first, its
velocity that of the centre and the rate of turning; arrays have a row for each body, kind after
kind.  Bodies in space are balls and cubes, whose moment of inertia is the same about all axes.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from polycorner.spaces.manifold import Array

GRAVITY, DENSITY, FRICTION = 9.81, 1000.0, 0.3
DT = 2e-3


class Shape(NamedTuple):
    """The points within ``radius`` of the hull of points about the centre of mass, and its mass."""

    points: Array
    radius: float
    mass: float
    inertia: float

    @property
    def size(self) -> float:
        """The radius about the origin."""
        return float(np.linalg.norm(self.points, axis=1).max()) + self.radius


class Wall(NamedTuple):
    """The half-space beyond a point."""

    normal: Array
    point: Array


class Hinge(NamedTuple):
    """A hinge in the plane, at a point in the coordinates of each body; None is the world."""

    parent: int | None
    child: int
    at: tuple[float, float]
    on: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Scene:
    """Bodies in a tray at rest, or turning about hinges, and how long they move.

    ``settles`` says whether placements depend so little on the step that its convergence can be
    measured: in heaps they do not.
    """

    shapes: Mapping[str, Shape]
    counts: Mapping[str, int]
    start: Array
    walls: Mapping[str, Wall]
    duration: float
    hinges: Mapping[str, Hinge] = field(default_factory=dict)
    settles: bool = False
    sweeps: int = 0

    @property
    def dimension(self) -> int:
        """Of the space, 2 or 3."""
        return 2 if self.start.shape[1] == 3 else 3

    @cached_property
    def bodies(self) -> list[Shape]:
        """The shape of every body."""
        return [self.shapes[name] for name, count in self.counts.items() for _ in range(count)]

    @cached_property
    def masses(self) -> Array:
        """Mass and moment of inertia of every body, ``(N, 2)``."""
        return np.array([(body.mass, body.inertia) for body in self.bodies])

    def energy(self, q: Array, v: Array) -> float:
        """Return kinetic and potential energy."""
        d = self.dimension
        kinetic = self.masses[:, 0] @ (v[:, :d] ** 2).sum(1) + self.masses[:, 1] @ (
            v[:, d:] ** 2
        ).sum(1)
        return float(kinetic / 2 + GRAVITY * self.masses[:, 0] @ q[:, d - 1])

    def scale(self) -> float:
        """Return the energy that all bodies gain when they fall by the size of the largest."""
        return float(GRAVITY * self.masses[:, 0].sum() * max(body.size for body in self.bodies))

    def overlap(self, q: Array) -> float:
        """Return the deepest overlap, over the size of the smallest body."""
        placed = list(map(placed_points, self.bodies, q))
        deepest = max(
            float((wall.normal @ wall.point - p @ wall.normal).max()) + body.radius
            for p, body in zip(placed, self.bodies, strict=True)
            for wall in self.walls.values()
        )
        for i, j in self.near(q):
            radii = self.bodies[i].radius + self.bodies[j].radius
            deepest = max(deepest, radii - separation(placed[i], placed[j]))
        return max(0.0, deepest) / min(body.size for body in self.bodies)

    def near(self, q: Array) -> Iterator[tuple[int, int]]:
        """Return pairs of bodies that may overlap, and are not joined."""
        reach, d = 2 * max(body.size for body in self.bodies), self.dimension
        joined = {(hinge.parent, hinge.child) for hinge in self.hinges.values()}
        for i, j in sorted(cKDTree(q[:, :d]).query_pairs(reach)):
            apart = np.linalg.norm(q[i, :d] - q[j, :d])
            if apart < self.bodies[i].size + self.bodies[j].size and (i, j) not in joined:
                yield i, j


def placed_points(body: Shape, q: Array) -> Array:
    """Return the points of a body in its place."""
    d = body.points.shape[1]
    if len(body.points) == 1 and not body.points.any():
        return q[None, :d]
    turn = (
        Rotation.from_euler("z", q[2]).as_matrix()[:2, :2]
        if d == 2
        else Rotation.from_quat(q[3:], scalar_first=True).as_matrix()
    )
    return np.asarray(body.points @ turn.T + q[:d])


def separation(p: Array, q: Array) -> float:
    """Return the largest distance of two planes between two hulls; negative if they cross.

    The normals tried are those of edges in the plane, of faces and pairs of edges of cubes in
    space, and the directions from points of one to those of the other.  For hulls that cross these
    are all that count, but for a point in an edge in space, which no scene has.
    """
    d = p.shape[1]
    normals = [(b - a) for a in p for b in q]
    edges = [_edges(p), _edges(q)]
    if d == 2:
        normals += [np.array([-e[1], e[0]]) for e in (*edges[0], *edges[1])]
    else:
        normals += edges[0] + edges[1]
        normals += [np.cross(a, b) for a in edges[0] for b in edges[1]]
    n = np.array(normals)
    lengths = np.linalg.norm(n, axis=1)
    n = n[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    n = np.concatenate([n, -n])
    return float(((q @ n.T).min(0) - (p @ n.T).max(0)).max(initial=-np.inf))


def _edges(p: Array) -> list[Array]:
    """Return the directions of a polygon's sides, or of a cube's edges, which are normals too."""
    if len(p) == 1:
        return []
    if p.shape[1] == 3:
        return [p[k] - p[0] for k in (1, 2, 4)]
    return [p[1] - p[0], p[2] - p[1]] if len(p) == 4 else [p[1] - p[0]]


def disc(r: float) -> Shape:
    mass = DENSITY * math.pi * r**2
    return Shape(np.zeros((1, 2)), r, mass, mass * r**2 / 2)


def sphere(r: float) -> Shape:
    mass = DENSITY * 4 / 3 * math.pi * r**3
    return Shape(np.zeros((1, 3)), r, mass, 0.4 * mass * r**2)


def rectangle(a: float, b: float) -> Shape:
    mass = DENSITY * 4 * a * b
    corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
    return Shape(corners, 0.0, mass, mass * (a**2 + b**2) / 3)


def rod(a: float, r: float) -> Shape:
    """Return a capsule along ``x``, of half-length ``a`` between its ends."""
    bar, caps = DENSITY * 4 * a * r, DENSITY * math.pi * r**2
    ends = caps * (r**2 / 2 + a**2 + 8 * a * r / (3 * math.pi))
    inertia = bar * (a**2 + r**2) / 3 + ends
    return Shape(np.array([[-a, 0.0], [a, 0.0]]), r, bar + caps, inertia)


def cube(a: float) -> Shape:
    mass = DENSITY * 8 * a**3
    corners = np.array([*itertools.product((-a, a), repeat=3)])
    return Shape(corners, 0.0, mass, mass * (2 * a) ** 2 / 6)


def tray(width: float, d: int) -> dict[str, Wall]:
    """Return a floor at 0, and walls half a width from the middle."""
    up = np.eye(d)
    walls = {"floor": Wall(up[-1], np.zeros(d))}
    for k, name in enumerate(["x", "y"][: d - 1]):
        walls[f"{name}min"] = Wall(up[k], -width / 2 * up[k])
        walls[f"{name}max"] = Wall(-up[k], width / 2 * up[k])
    return walls


def lattice(count: int, pitch: float, across: int, d: int, seed: int = 1) -> Array:
    """Return loose rows above the floor, ``across`` to a side, a little moved and turned."""
    rng = np.random.default_rng(seed)
    k = np.arange(count)
    columns = [k // across**axis % across for axis in range(d - 1)]
    x = pitch * (np.column_stack([*columns, k // across ** (d - 1)]) + 0.5)
    x[:, :-1] -= pitch * across / 2
    x += 0.02 * pitch * rng.uniform(-1, 1, x.shape)
    if d == 2:
        return np.column_stack([x, rng.uniform(-0.1, 0.1, count)])
    turns = Rotation.from_rotvec(rng.uniform(-0.1, 0.1, (count, 3)))
    return np.column_stack([x, turns.as_quat(scalar_first=True)])


def heap(
    shapes: Mapping[str, tuple[Shape, int]], across: int, duration: float, sweeps: int = 0
) -> Scene:
    """Return bodies that fall into a tray, the first of each kind in the first rows in turn."""
    counts = {name: count for name, (_, count) in shapes.items()}
    kinds = {name: shape for name, (shape, _) in shapes.items()}
    d = next(iter(kinds.values())).points.shape[1]
    pitch = 2.3 * max(shape.size for shape in kinds.values())
    count = sum(counts.values())
    places = lattice(count, pitch, across, d)
    # Kinds are mixed: rows are dealt to bodies in an order that does not know of kinds.
    places = places[np.random.default_rng(2).permutation(count)] if len(kinds) > 1 else places
    return Scene(kinds, counts, places, tray(pitch * across, d), duration, sweeps=sweeps)


def arm() -> Scene:
    """Return an arm of two links that hangs from the world and falls onto the floor."""
    upper, lower = rod(0.5, 0.05), rod(0.4, 0.05)
    shoulder, angle = np.array([0.0, 1.2]), np.array([0.3, -0.4])
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    first = shoulder + 0.5 * way[0]
    second = shoulder + way[0] + 0.4 * way[1]
    start = np.array([[*first, angle[0]], [*second, angle[1]]])
    hinges = {
        "shoulder": Hinge(None, 0, (0.0, 1.2), (-0.5, 0.0)),
        "elbow": Hinge(0, 1, (0.5, 0.0), (-0.4, 0.0)),
    }
    walls = {"floor": tray(4.0, 2)["floor"]}
    shapes, counts = {"upper": upper, "lower": lower}, {"upper": 1, "lower": 1}
    return Scene(shapes, counts, start, walls, 2.0, hinges=hinges, settles=True)


SCENES: dict[str, Callable[[], Scene]] = {
    "10 discs": lambda: heap({"disc": (disc(0.1), 10)}, 4, 2.0),
    "10 boxes": lambda: heap({"box": (rectangle(0.1, 0.06), 10)}, 4, 2.0),
    "10 spheres in space": lambda: heap({"ball": (sphere(0.1), 10)}, 2, 2.0),
    "10 boxes in space": lambda: heap({"cube": (cube(0.1), 10)}, 2, 2.0),
    "100 spheres in space": lambda: heap({"ball": (sphere(0.1), 100)}, 4, 2.0),
    "100 boxes in space": lambda: heap({"cube": (cube(0.1), 100)}, 4, 2.0),
    "1000 discs of two sizes": lambda: heap(
        {"large": (disc(0.1), 400), "small": (disc(0.06), 600)}, 25, 2.0, sweeps=10
    ),
    "rods and discs": lambda: heap({"rod": (rod(0.15, 0.05), 20), "disc": (disc(0.1), 20)}, 6, 2.0),
    "arm of two links": arm,
}
