"""Bodies that move, their coordinates, and where these put them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner import checks
from polycorner.bodies.frames import Frame
from polycorner.bodies.shapes import Body, Turn, turning
from polycorner.checks import refuse
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Placement(Value):
    """A body that moves, and its coordinates among those of all.

    Attributes
    ----------
    name : str
    body : Body
    frame : Frame
    manifold : Manifold
        The body's own placements.
    at : slice
        Where its coordinates stand.
    """

    name: str
    body: Body
    frame: Frame
    manifold: Manifold
    at: slice

    @property
    def axis(self) -> Array:
        """The axis of a body of revolution."""
        axis = self.body.axis
        assert axis is not None, self.name
        return axis

    @property
    def spins(self) -> bool:
        """Whether there are coordinates that change nothing about the placement."""
        return self.frame in {Frame.TURNED, Frame.ROTATED} and self.revolves

    @property
    def is_round(self) -> bool:
        """Whether the body looks the same when turned about its origin."""
        return self.body.axis is not None and not self.body.axis.any()

    @property
    def revolves(self) -> bool:
        """Whether the body is one of revolution about its origin: a disc, in space an axis."""
        return self.is_round or (self.body.dimension == 3 and self.body.axis is not None)

    def coordinates(self, origin: Array, matrix: Array) -> Array:
        """Return the coordinates of a placement."""
        if self.frame is Frame.TURNED:
            return np.append(origin, math.atan2(matrix[1, 0], matrix[0, 0]))
        if self.frame is Frame.AXIAL:
            return np.append(origin, matrix @ self.axis)
        if self.frame is Frame.ROTATED:
            return np.append(origin, Rotation.from_matrix(matrix).as_quat()[[3, 0, 1, 2]])
        return origin

    def pose(self, q: Array) -> tuple[Array, Array]:
        """Return origin and matrix of the body at a point of all coordinates."""
        d, own = self.body.dimension, q[self.at]
        origin, turned = own[:d], own[d:]
        if self.frame is Frame.TURNED:
            cosine, sine = math.cos(turned[0]), math.sin(turned[0])
            return origin, np.array([[cosine, -sine], [sine, cosine]])
        if self.frame is Frame.AXIAL:
            return origin, _carrying(self.axis, turned)
        if self.frame is Frame.ROTATED:
            return origin, Rotation.from_quat(turned[[1, 2, 3, 0]]).as_matrix()
        return origin, np.eye(d)

    def rates(self, q: Array, velocity: Array, spin: Array) -> Array:
        """Return the velocities of the coordinates for those of the body.

        ``spin`` is the angular velocity ``(3,)``; in the plane its third component counts.
        """
        d, turned = self.body.dimension, q[self.at][self.body.dimension :]
        if self.frame is Frame.TURNED:
            return np.append(velocity, spin[2])
        if self.frame is Frame.AXIAL:
            return np.append(velocity, np.cross(spin, turned))
        if self.frame is Frame.ROTATED:
            scalar, vector = turned[0], turned[1:]  # a' = (0, spin) a / 2
            change = [-spin @ vector, *(scalar * spin + np.cross(spin, vector))]
            return np.append(velocity, np.array(change) / 2)
        return velocity[:d]

    def moved(self, q: Array) -> Body:
        """Return the body in its place."""
        return self.body.carried(*self.pose(q))

    def directions(self, q: Array, *, whole: bool = False) -> Array:
        """Return vectors ``(k, d)`` that show how the body, or ``whole`` all of it, is turned."""
        whole = whole and self.frame is not Frame.AXIAL
        if self.frame is Frame.SHIFTED or (self.is_round and not whole):
            return np.empty((0, self.body.dimension))
        _, matrix = self.pose(q)
        return (matrix @ self.axis)[None] if self.revolves and not whole else matrix.T


def frame_of(body: Body, orientations: str) -> Frame:
    """Return the coordinates of a body: for orientations ``"needed"``, ``"all"`` or ``"none"``."""
    if orientations == "none":
        return Frame.SHIFTED
    if body.axis is not None and orientations == "needed":
        if not body.axis.any():
            return Frame.SHIFTED
        if body.dimension == 3:
            return Frame.AXIAL
    return Frame.TURNED if body.dimension == 2 else Frame.ROTATED


def pose_of(argument: str, given: Any, d: int) -> tuple[Array, Array]:
    """Return origin and matrix of what a user gives for a placement."""
    turn: Turn | None = None
    expected = f"{d} numbers, or a pair of them and a rotation"
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        given, turn = given
    origin = checks.numbers(argument, given, expected)
    if origin.shape != (d,):
        refuse(argument, expected, given)
    return origin, turning(turn, d)


def coordinates(placed: Any, placements: Sequence[Placement]) -> Array:
    """Return the coordinates of all bodies where a user places them."""
    names = [p.name for p in placements]
    checks.names("placed", checks.mapping("placed", placed), names)
    missing = [name for name in names if name not in placed]
    if missing:
        refuse("placed", f"a placement of {missing[0]!r} as well", [*placed])
    found = []
    for p in placements:
        origin, matrix = pose_of("placed", placed[p.name], p.body.dimension)
        fixed = p.frame is Frame.SHIFTED and not p.is_round
        if fixed and (matrix != np.eye(len(origin))).any():
            expected = f"no rotation of {p.name!r}, which is shifted only"
            refuse("placed", expected, placed[p.name])
        found.append(p.coordinates(origin, matrix))
    return np.concatenate(found)


def rates(point: Array, moving: Any, placements: Sequence[Placement]) -> Array:
    """Return the velocities of the coordinates of all bodies, which a user sets in motion."""
    checks.names("moving", checks.mapping("moving", moving), [p.name for p in placements])
    found = [p.rates(point, *_motion(moving.get(p.name), p)) for p in placements]
    return np.concatenate(found)


def _motion(given: Any, p: Placement) -> tuple[Array, Array]:
    """Return velocity ``(d,)`` and angular velocity ``(3,)`` of what a user gives for a motion."""
    d = p.body.dimension
    spins = "a number" if d == 2 else "3 numbers"
    expected = f"{d} finite numbers for {p.name!r}, or a pair of them and {spins}"
    if given is None:
        return np.zeros(d), np.zeros(3)
    turn: Any = np.zeros(3)
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        given, turn = given
        turn = checks.numbers("moving", turn, expected)
        turn = np.array([0.0, 0.0, turn]) if d == 2 and turn.ndim == 0 else turn
    velocity = checks.numbers("moving", given, expected)
    fits = velocity.shape == (d,) and turn.shape == (3,)
    if not fits or not np.isfinite([*velocity, *turn]).all():
        refuse("moving", expected, given)
    if turn.any() and p.frame is Frame.SHIFTED:
        refuse("moving", f"no angular velocity of {p.name!r}, which is shifted only", turn)
    return velocity, turn


def _carrying(a: Array, b: Array) -> Array:
    """Return a rotation that carries the unit vector ``a`` to ``b``."""
    across = np.cross(a, b)
    sine, cosine = float(np.linalg.norm(across)), float(a @ b)
    if sine <= DEFAULT.alike:
        across = np.cross(a, np.eye(3)[np.argmin(abs(a))])
        sine = float(np.linalg.norm(across))
        angle = 0.0 if cosine > 0 else math.pi
    else:
        angle = math.atan2(sine, cosine)
    matrix: Array = Rotation.from_rotvec(angle * across / sine).as_matrix()
    return matrix
