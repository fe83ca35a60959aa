"""Motions of arrangements: where each body is at each instant, and where bodies touch."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.frames import Frame
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body, Part
from polycorner.bodies.walls import HalfSpace, Wall
from polycorner.checks import instance, reals, refuse
from polycorner.motion.drifts import Drift
from polycorner.motion.system import System
from polycorner.motion.trajectory import Touch, Trajectory
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value, cached_property

Motion = Trajectory | ArrayLike
# A side of the name of a contact: what touches, and its vertex, edge or face, if it is one.
SIDE = re.compile(r"(?P<what>.+?)(?:\.(?P<kind>[vef])(?P<number>\d+))?")


@dataclass(frozen=True, eq=False)
class Poses(Value):
    """Where ``N`` bodies are at ``T`` instants, kind after kind.

    Attributes
    ----------
    arrangement : Arrangement
        Its bodies are the kinds, each of which may be there several times.
    times : (T,) array
        In s, or the numbers of points.
    kinds : (N,) array of int
        The position of the kind of each body among those of the arrangement.
    origins, velocities : (T, N, d) array
        The velocities are zero where points are given.
    turns : (T, N, 4) array
        Unit quaternions, the scalar first; in the plane about the third axis.
    present : (T, N) array of bool
        Which bodies have not left.
    touching : tuple of T tuples
        As in :class:`~polycorner.Trajectory`; empty where points are given.
    timed : bool
        Whether times are in s, not numbers of points.
    """

    arrangement: Arrangement
    times: Array
    kinds: NDArray[np.int64]
    origins: Array
    velocities: Array
    turns: Array
    present: NDArray[np.bool_]
    touching: tuple[tuple[Touch, ...], ...]
    timed: bool

    def __len__(self) -> int:
        """Return the number of instants."""
        return len(self.times)

    @cached_property
    def names(self) -> list[str]:
        """What each body is called, ``small 2`` where there are several of a kind."""
        counts = np.bincount(self.kinds, minlength=len(self.arrangement.placements))
        return [
            p.name if count == 1 else f"{p.name} {k + 1}"
            for p, count in zip(self.arrangement.placements, counts.tolist(), strict=True)
            for k in range(count)
        ]

    @cached_property
    def matrices(self) -> Array:
        """The rotations as matrices, ``(T, N, d, d)``."""
        d = self.arrangement.dimension
        flat = Rotation.from_quat(self.turns.reshape(-1, 4)[:, [1, 2, 3, 0]]).as_matrix()
        return np.asarray(flat.reshape(*self.turns.shape[:2], 3, 3)[..., :d, :d])

    def placed(self, k: int) -> dict[str, Body]:
        """Return the bodies that are there at an instant, in the box, by name; fixed ones last."""
        bodies = [*self.arrangement.named.values()]
        found = {
            name: bodies[kind].carried(origin, matrix)
            for name, kind, origin, matrix, here in zip(
                self.names, self.kinds.tolist(), self.boxed[k], self.matrices[k],
                self.present[k].tolist(), strict=True,
            )
            if here
        }  # fmt: skip
        return {**found, **self.arrangement.fixed}

    @cached_property
    def boxed(self) -> Array:
        """The origins ``(T, N, d)``, by whole periods into the box."""
        lattice = self.arrangement.lattice
        axes = list(lattice.axes)
        if not axes:
            return self.origins
        means = np.array([b.markers.mean(axis=0) for b in self.arrangement.named.values()])
        lengths, found = lattice.lengths[axes], self.origins.copy()
        middles = self.origins + np.einsum("tnij,nj->tni", self.matrices, means[self.kinds])
        found[..., axes] -= lengths * np.floor(middles[..., axes] / lengths)
        return found

    def only(self, chosen: ArrayLike) -> "Poses":
        """Return those at chosen instants, by number."""
        at = np.asarray(chosen)
        some = {
            n: getattr(self, n)[at] for n in ("times", "origins", "velocities", "turns", "present")
        }
        return replace(self, **some, touching=tuple(self.touching[k] for k in at.tolist()))

    def between(self, times: ArrayLike) -> "Poses":
        """Return those at given times, linear between the instants."""
        asked = np.asarray(times, dtype=np.float64)
        k = np.clip(np.searchsorted(self.times, asked, side="right") - 1, 0, len(self) - 1)
        on = np.minimum(k + 1, len(self) - 1)
        span = self.times[on] - self.times[k]
        share = np.where(span > 0, (asked - self.times[k]) / np.where(span > 0, span, 1.0), 0.0)
        share = np.clip(share, 0.0, 1.0)[:, None, None]
        one, two = self.turns[k], self.turns[on]
        two = np.where((one * two).sum(axis=-1, keepdims=True) < 0, -two, two)
        turns = (1 - share) * one + share * two
        turns /= np.linalg.norm(turns, axis=-1, keepdims=True)
        origins = (1 - share) * self.origins[k] + share * self.origins[on]
        return replace(self.only(k), times=asked, origins=origins, turns=turns)

    def touched(self, touching: tuple[tuple[Touch, ...], ...]) -> "Poses":
        """Return them with contacts that touch at each instant."""
        return replace(self, touching=touching)

    def marks(self, k: int) -> Array:
        """Return the points of the contacts at an instant, ``(m, d)``.

        Midway between the surfaces; equations, and names of no bodies, have none.
        """
        there = [point for _, point in self.named_marks(k)]
        return np.array(there).reshape(-1, self.arrangement.dimension)

    def named_marks(self, k: int) -> list[tuple[str, Array]]:
        """Return :meth:`marks` with the names of the contacts."""
        named = [(touch[1], self._mark(k, *touch[:2])) for touch in self.touching[k]]
        return [(name, point) for name, point in named if point is not None]

    def _mark(self, k: int, bodies: Sequence[int], name: str) -> Array | None:
        if name not in self._read:
            self._read[name] = _sides(self.arrangement, name)
        sides, moving = self._read[name], iter(bodies)
        if len(sides) != 2:
            return None
        placed: list[tuple[Array, float, Wall | None]] = []
        for side in sides:
            points = side.points
            if side.kind >= 0:
                number = side.kind
                if len(self.kinds) > len(self.arrangement.placements):
                    number = next(moving) if side.which is None else bodies[side.which]
                points = self.boxed[k, number] + points @ self.matrices[k, number].T
            placed.append((points, side.radius, side.wall))
        one, two = placed
        if one[2] is None and two[2] is None:
            two = two[0] + self._nearest_image(one[0], two[0]), *two[1:]
        return _midway(one, two)

    @cached_property
    def _read(self) -> "dict[str, tuple[_Side, ...]]":
        return {}

    def _nearest_image(self, one: Array, two: Array) -> Array:
        """Return the displacement of the second that brings it nearest to the first."""
        lattice = self.arrangement.lattice
        away = two.mean(axis=0) - one.mean(axis=0)
        whole = np.round(np.where(np.isfinite(lattice.lengths), away / lattice.lengths, 0.0))
        return lattice.shift(tuple((-whole).astype(int).tolist()))


def poses_of(arrangement: Any, motion: Any, argument: str = "motion") -> Poses:
    """Return where bodies are in a motion, or at points.

    Parameters
    ----------
    arrangement : Arrangement
    motion : Trajectory or array
        A motion of its system, or points ``(N,)`` or ``(T, N)``; of bodies like one ``(T, n, k)``.
    argument : str, optional
        What an error calls the motion.

    Raises
    ------
    TypeError, ValueError
        For a motion of another system, or points of another shape.
    """
    instance("arrangement", arrangement, Arrangement)
    if isinstance(motion, Trajectory):
        return _moving(argument, arrangement, motion)
    q = _points(argument, arrangement, motion)
    if not len(q):
        refuse(argument, "at least one point", "none")
    return _posed(arrangement, by_kind(arrangement, q), np.arange(len(q), dtype=np.float64))


def _moving(argument: str, arrangement: Arrangement, path: Trajectory) -> Poses:
    system: Any = path.system
    if isinstance(system, System | Drift):
        known, own = system.manifold.names, arrangement.manifold.names
        if known != own:
            refuse(argument, f"one of the coordinates {', '.join(own)}", ", ".join(known))
        places, rates = by_kind(arrangement, path.q), by_kind(arrangement, path.v)
    else:  # several kinds, each with motions of its own
        several: Any = path
        places = [several[name].q for name in arrangement.named]
        rates = [several[name].v for name in arrangement.named]
    return recorded(arrangement, path.times, places, rates, path.present, tuple(path.touching))


def recorded(
    arrangement: Arrangement,
    times: Array,
    places: Sequence[Array],
    rates: Sequence[Array],
    present: NDArray[np.bool_],
    touching: tuple[tuple[Touch, ...], ...],
) -> Poses:
    """Return where bodies are in a motion, of coordinates and velocities ``(T, n, k)`` by kind."""
    found = _posed(arrangement, places, times)
    velocities = np.concatenate([v[..., : arrangement.dimension] for v in rates], axis=1)
    here = np.broadcast_to(present, found.present.shape)
    return replace(found, velocities=velocities, present=here, touching=touching, timed=True)


def _points(argument: str, arrangement: Arrangement, given: Any) -> Array:
    """Return points ``(T, N, k)``, one body of all coordinates where several are listed."""
    q = reals(argument, given)
    if q.ndim < 3:
        return np.atleast_2d(arrangement.manifold.points(q, argument))[:, None]
    q = finite(q, argument)
    size = arrangement.manifold.size
    if len(arrangement.placements) > 1 or q.ndim != 3 or q.shape[2] != size:
        refuse(argument, f"shape (T, {size}), or (T, n, k) for n bodies like one", q.shape)
    return q


def by_kind(arrangement: Arrangement, q: Array) -> list[Array]:
    """Return the coordinates ``(T, n, k)`` of each kind."""
    if len(arrangement.placements) == 1:
        return [q]
    return [q[..., p.at] for p in arrangement.placements]


def _posed(arrangement: Arrangement, coordinates: Sequence[Array], times: Array) -> Poses:
    d = arrangement.dimension
    counts = [q.shape[1] for q in coordinates]
    origins = np.concatenate([q[..., :d] for q in coordinates], axis=1)
    turns = [_turned(p, q) for p, q in zip(arrangement.placements, coordinates, strict=True)]
    kinds = np.repeat(np.arange(len(counts)), counts)
    here = np.ones(origins.shape[:2], dtype=bool)
    touching: tuple[tuple[Touch, ...], ...] = ((),) * len(times)
    places = origins, 0 * origins, np.concatenate(turns, axis=1)
    return Poses(arrangement, times, kinds, *places, here, touching, timed=False)


def _turned(p: Placement, q: Array) -> Array:
    """Return how bodies ``(..., k)`` are turned, as unit quaternions ``(..., 4)``."""
    rest, found = q[..., p.body.dimension :], np.zeros((*q.shape[:-1], 4))
    found[..., 0] = 1.0
    if p.frame is Frame.TURNED:
        found[..., 0], found[..., 3] = np.cos(rest[..., 0] / 2), np.sin(rest[..., 0] / 2)
    elif p.frame is Frame.ROTATED:
        found = rest / np.linalg.norm(rest, axis=-1, keepdims=True)
    elif p.frame is Frame.AXIAL:
        # The shortest rotation of the axis to u, and half a turn to its opposite.
        u = rest / np.linalg.norm(rest, axis=-1, keepdims=True)
        found[..., 0], found[..., 1:] = 1 + u @ p.axis, np.cross(p.axis, u)
        side = np.cross(p.axis, np.eye(3)[np.argmin(abs(p.axis))])
        found[found[..., 0] < DEFAULT.alike] = [0.0, *side]
        found /= np.linalg.norm(found, axis=-1, keepdims=True)
    return np.asarray(found)


# ---------------------------------------------------------------------------------------- contacts


class _Side(NamedTuple):
    """What a contact is of: points of a body, of a fixed one (kind -1), or a wall."""

    kind: int
    which: int | None  # of two bodies of a kind, the first or the second
    points: Array
    radius: float
    wall: Wall | None = None


def _sides(arrangement: Arrangement, name: str) -> tuple[_Side, ...]:
    """Return what the name of a contact says, nothing where it is not understood."""
    found = [
        _side(arrangement, words) for words in re.split(r"[-<>]", re.sub(r"\[.*?\]", "", name))
    ]
    return tuple(side for side in found if side is not None)


def _side(arrangement: Arrangement, words: str) -> _Side | None:
    if words in arrangement.walls:
        empty = np.empty((0, arrangement.dimension))
        return _Side(-1, None, empty, 0.0, arrangement.walls[words])
    told = SIDE.fullmatch(words)
    for name, kind, which, body in _bodies(arrangement):
        if told is None or not f"{told['what']}.".startswith(f"{name}."):
            continue
        part = body.parts.get(told["what"][len(name) + 1 :])
        if part is not None:
            points = _feature(part, told["kind"], int(told["number"] or 0) - 1)
            return _Side(kind, which, points, part.radius)
    return None


def _bodies(arrangement: Arrangement) -> Iterator[tuple[str, int, int | None, Body]]:
    """Yield what a side may name, and which of two repeated bodies that is."""
    for kind, (name, body) in enumerate(arrangement.named.items()):
        yield name, kind, None, body
    for name, body in arrangement.fixed.items():
        yield name, -1, None, body
    for kind, (name, body) in enumerate(arrangement.named.items()):
        for which in (0, 1):
            yield f"{name}{which + 1}", kind, which, body


def _feature(part: Part, kind: str | None, k: int) -> Array:
    """Return the points of a vertex, an edge, a face or the whole of a part."""
    if kind == "v" and k < len(part.points):
        return part.points[[k]]
    facets = part.facets
    if kind is None or facets is None:
        return part.points
    if kind == "e" and facets.edges:
        return part.points[[*facets.edges[k][:2]]] if k < len(facets.edges) else part.points
    return part.points[[*facets.faces[k]]] if k < len(facets.faces) else part.points


def _midway(one: tuple[Array, float, Wall | None], two: tuple[Array, float, Wall | None]) -> Array:
    """Return the point midway between two surfaces where they are nearest."""
    if one[2] is not None:
        one, two = two, one
    points, radius, _ = one
    if (wall := two[2]) is not None:
        outwards = [_outwards(wall, point) for point in points]
        nearest = int(np.argmin([apart for apart, _ in outwards]))
        apart, way = outwards[nearest]
        return np.asarray(points[nearest] + (radius + apart) / 2 * way)
    p, q = nearest_points(points, two[0])
    apart = float(np.linalg.norm(q - p))
    if apart <= DEFAULT.alike:
        return (p + q) / 2
    return np.asarray(p + (q - p) * (apart + radius - two[1]) / (2 * apart))


def _outwards(wall: Wall, point: Array) -> tuple[float, Array]:
    """Return how far a point is from a wall, and the unit vector towards it."""
    away = point - wall.point
    if isinstance(wall, HalfSpace):
        return float(away @ wall.normal), -wall.normal
    if wall.axis is not None:
        away = away - (away @ wall.axis) * wall.axis
    size = float(np.linalg.norm(away))
    way = away / size if size > 0 else np.eye(len(away))[0]
    wave = 0.0
    if wall.waves:
        x, y = wall.around @ away
        azimuth = np.arctan2(y, x)
        wave = sum(a * float(np.cos(k * azimuth + p)) for k, (a, p) in wall.waves.items())
    return wall.radius + wave - size, way


def nearest_points(one: Array, two: Array) -> tuple[Array, Array]:
    """Return points of the hulls of ``(j, d)`` and ``(k, d)`` points that are nearest.

    The least ``|D w|^2 + (1 - sum w)^2`` with ``w >= 0``, where the columns of ``D`` are all
    differences, is a multiple of the weights of the difference nearest to zero.

    Examples
    --------
    >>> p, q = nearest_points(np.array([[0.0, 0.0], [2.0, 0.0]]), np.array([[1.0, 3.0]]))
    >>> p.round(9).tolist(), q.tolist()
    ([1.0, 0.0], [1.0, 3.0])
    """
    from scipy.optimize import nnls

    if len(one) == len(two) == 1:
        return one[0], two[0]
    away = two[None] - one[:, None]
    size = float(abs(away).max()) or 1.0
    columns = np.vstack([away.reshape(-1, one.shape[1]).T / size, np.ones(len(one) * len(two))])
    weights = nnls(columns, np.append(np.zeros(one.shape[1]), 1.0))[0].reshape(away.shape[:2])
    weights /= weights.sum()
    return weights.sum(axis=1) @ one, weights.sum(axis=0) @ two
