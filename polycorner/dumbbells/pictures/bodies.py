"""Places of balls, rods, contacts and the wall, shared by all drawings of dumbbells."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.toolkit import Array

MARGIN = 1.5  # least extent of the wall beyond the outermost centres, in ball radii
SIDES = 12  # of a tube
AXIS = 10.0  # mm, the length at which axes are drawn


@dataclass(frozen=True)
class WallPatch:
    """A part of the drum's wall, or of the plane.

    Attributes
    ----------
    radius : float
        ``R`` in mm, ``inf`` for the plane ``z = -r``.
    depth : float
        ``r``: distance of the wall below a centre.
    across : (float, float)
        Least and greatest azimuth in rad, ``x`` in mm in the plane.
    along : (float, float)
        Least and greatest ``eta``, in mm.
    """

    radius: float
    depth: float
    across: tuple[float, float]
    along: tuple[float, float]

    @property
    def is_plane(self) -> bool:
        """Whether it is flat."""
        return math.isinf(self.radius)

    def points(self, across: ArrayLike, along: ArrayLike) -> Array:
        """Return points of the wall in space, ``(..., 3)``, in mm."""
        u, y = np.broadcast_arrays(np.asarray(across, float), np.asarray(along, float))
        if self.is_plane:
            return np.stack([u, y, np.full_like(u, -self.depth)], axis=-1)
        return np.stack([self.radius * np.sin(u), y, -self.radius * np.cos(u)], axis=-1)

    @property
    def description(self) -> dict[str, Any]:
        """The wall for JSON; the radius of a plane is None."""
        radius = None if self.is_plane else self.radius
        return {
            "radius": radius,
            "depth": self.depth,
            "across": list(self.across),
            "along": list(self.along),
        }


def sizes_of(pair: DumbbellPair) -> dict[str, float]:
    """Return the lengths that dumbbells are drawn with, in mm, as what JSON can hold."""
    return {"length": pair.length, "ball": pair.ball_radius, "rod": pair.rod_radius}


def box_of(pair: DumbbellPair, centres: Array) -> dict[str, list[float]]:
    """Return a box around balls with centres ``(..., 3)``, in mm, as what JSON can hold."""
    here = centres.reshape(-1, 3)
    low, high = np.nanmin(here, axis=0), np.nanmax(here, axis=0)
    return {
        "low": (low - pair.ball_radius).tolist(),
        "high": (high + pair.ball_radius).tolist(),
    }


def dumbbell_centres(pair: DumbbellPair, q: ArrayLike) -> Array:
    """Return the centres of both balls of each dumbbell in space, ``(..., 2, 3)``, in mm.

    ``q`` is ``(..., k)`` and begins with ``phi, eta, theta`` (``x, y, theta`` in the plane).
    """
    places = np.asarray(q, dtype=np.float64)[..., :3]
    return pair.ball_centres(np.concatenate([places, places], axis=-1))[..., :2, :]


def wall_around(pair: DumbbellPair, centres: Array) -> WallPatch:
    """Return the part of the wall below ball centres ``(..., 3)``; rows of NaN do not count.

    It reaches beyond them by half a dumbbell, and not further than once around.
    """
    here = centres.reshape(-1, 3)
    here = here[~np.isnan(here).any(axis=1)]
    room = max(MARGIN * pair.ball_radius, pair.length / 2)
    along = (float(here[:, 1].min()) - room, float(here[:, 1].max()) + room)
    if pair.is_plane:
        across = (float(here[:, 0].min()) - room, float(here[:, 0].max()) + room)
        return WallPatch(math.inf, pair.ball_radius, across, along)
    mean = np.angle(np.exp(1j * np.arctan2(here[:, 0], -here[:, 2])).sum())
    turned = np.arctan2(here[:, 0], -here[:, 2]) - mean
    azimuths = mean + np.angle(np.exp(1j * turned))
    turn = room / pair.centre_radius
    low, high = float(azimuths.min()) - turn, float(azimuths.max()) + turn
    if high - low > math.tau:
        low, high = -math.pi, math.pi
    return WallPatch(pair.drum_radius, pair.ball_radius, (low, high), along)


def relative_stretch(pair: DumbbellPair) -> Array:
    """Return the factors of relative placements in drawings: 1, 1 and ``l/2`` mm for a radian."""
    return np.array([1.0, 1.0, pair.length / 2])


def contact_point(pair: DumbbellPair, centres: Array, name: str) -> Array:
    """Return the point of a contact, ``(3,)``, midway between the surfaces.

    Parameters
    ----------
    pair : DumbbellPair
        For the radii.
    centres : (4, 3) array
        Ball centres ``A1, A2, B1, B2``, in mm; in two dimensions ``(4, 2)``.
    name : str
        The contact: ``A1B2``, ``A1b``, ``aB2`` or ``ab``.

    Notes
    -----
    On the segment between the nearest points of the two axes, the point is midway between the
    surfaces, also where the bodies overlap.
    """
    one, other = _member(centres[:2], name[: -1 if name.endswith("b") else -2]), centres[2:]
    other = _member(other, name[len(name) - (1 if name.endswith("b") else 2) :])
    p, q = _nearest(one, other)
    r, t = pair.ball_radius, pair.rod_radius
    thick = (t if len(one) == 2 else r), (t if len(other) == 2 else r)
    apart = float(np.linalg.norm(q - p))
    if apart == 0.0:
        return np.asarray(p)
    return np.asarray(p + (q - p) * (apart + thick[0] - thick[1]) / (2 * apart))


def _member(centres: Array, name: str) -> Array:
    """Return the axis of a rod, two points, or the centre of a ball, one."""
    return centres if len(name) == 1 else centres[[int(name[1]) - 1]]


def _nearest(one: Array, other: Array) -> tuple[Array, Array]:
    """Return points of two segments (or points) nearest to each other.

    Where the lines are nearest, if that is on the first segment, else its nearer end; from there
    the foot on the other segment, and the foot of that.
    """
    a, b, apart = one[-1] - one[0], other[-1] - other[0], other[0] - one[0]
    turned = float((a @ a) * (b @ b) - (a @ b) ** 2)
    share = float((b @ b) * (a @ apart) - (a @ b) * (b @ apart)) / turned if turned > 0 else 0.0
    q = _foot(other, one[0] + min(max(share, 0.0), 1.0) * a)
    return _foot(one, q), q


def _foot(segment: Array, point: Array) -> Array:
    start, axis = segment[0], segment[-1] - segment[0]
    size = float(axis @ axis)
    share = float((point - start) @ axis) / size if size > 0 else 0.0
    return np.asarray(start + min(max(share, 0.0), 1.0) * axis)


def rod_outlines(ends: Array, radius: float) -> Array:
    """Return the rectangles of rods in the plane, ``(..., 4, 2)``, from their ends ``(..., 2, 2)``.

    A rod that is seen end on has length zero; its rectangle is then as wide as the rod.
    """
    axis = ends[..., 1, :] - ends[..., 0, :]
    length = np.linalg.norm(axis, axis=-1, keepdims=True)
    unit = np.where(length > 0, axis / np.where(length > 0, length, 1.0), np.array([1.0, 0.0]))
    side = radius * np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
    one, other = ends[..., 0, :], ends[..., 1, :]
    return np.stack([one + side, other + side, other - side, one - side], axis=-2)


def tube_surface(points: ArrayLike, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices and triangles of a closed tube about a polyline ``(k, 3)``."""
    line = np.asarray(points, dtype=np.float64)
    line = line[np.concatenate([[True], np.linalg.norm(np.diff(line, axis=0), axis=1) > 0])]
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    normal = np.empty_like(along)
    side = np.cross(along[0], np.eye(3)[np.argmin(abs(along[0]))])
    for k, direction in enumerate(along):  # carried along without turning about the line
        side = side - (side @ direction) * direction
        side = side / np.linalg.norm(side)
        normal[k] = side
    angle = np.linspace(0, math.tau, SIDES, endpoint=False)[:, None]
    rings = np.cos(angle) * normal[:, None] + np.sin(angle) * np.cross(along, normal)[:, None]
    vertices = [*(line[:, None] + radius * rings).reshape(-1, 3), line[0], line[-1]]
    return np.array(vertices), _tube_faces(len(line))


def _tube_faces(count: int) -> NDArray[np.int64]:
    """Return the triangles of a tube of ``count`` rings, whose ends are fans about two points."""
    k, s = np.meshgrid(np.arange(count - 1), np.arange(SIDES), indexing="ij")
    a, b = k * SIDES + s, k * SIDES + (s + 1) % SIDES
    c, d = a + SIDES, b + SIDES
    sides = np.stack([a, b, c, b, d, c], axis=-1).reshape(-1, 3)
    ring, last = np.arange(SIDES), (count - 1) * SIDES
    first, end = np.full(SIDES, count * SIDES), np.full(SIDES, count * SIDES + 1)
    start = np.stack([first, (ring + 1) % SIDES, ring], axis=-1)
    stop = np.stack([end, last + ring, last + (ring + 1) % SIDES], axis=-1)
    return np.concatenate([sides, start, stop])
