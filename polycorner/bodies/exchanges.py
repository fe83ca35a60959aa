"""Finite symmetries of arrangements: exchanges of bodies, rotations of a body onto itself."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, permutations, product

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from polycorner.bodies.facets import FLAT
from polycorner.bodies.frames import Frame
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Element
from polycorner.spaces.manifold import Array
from polycorner.values import Value

MOST_ELEMENTS = 10_000
SAME = 1e-6  # relative distance up to which points are one
SAMPLES = 12  # random points at which functions are told apart


def elements(
    placements: tuple[Placement, ...],
    polyhedron: Polyhedron,
    shifts: Sequence[Sequence[Array]],
) -> Iterator[Element]:
    """Yield exchanges of equal bodies with rotations of bodies onto themselves, no identity.

    With them go ``shifts`` of each body, the first of which is zero.  None where there would be
    more than ten thousand.  How functions change their names is found by their values at random
    points and at the images of these.
    """
    groups = _equal(placements)
    turns = [_own_turns(p) for p in placements]
    count = math.prod(math.factorial(len(group)) for group in groups)
    count *= math.prod(map(len, [*turns, *shifts]))
    if count > MOST_ELEMENTS:
        return
    points = _samples(placements, polyhedron)
    values = polyhedron.values(points)
    changes = product(_orders(groups), product(*turns), product(*shifts))
    next(changes)  # the identity
    for some in changes:
        change = Exchange(placements, *some)
        images = polyhedron.values(np.array([change(q) for q in points]))
        yield Element(change, _renaming(polyhedron.names, values.T, images.T))


def _equal(placements: tuple[Placement, ...]) -> list[list[int]]:
    """Return the bodies in groups of equal ones, by number."""
    groups: list[list[int]] = []
    for k, p in enumerate(placements):
        for group in groups:
            if placements[group[0]].body.same(p.body):
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _orders(groups: list[list[int]]) -> Iterator[tuple[int, ...]]:
    """Yield the permutations within groups, the identity first."""
    for images in product(*(permutations(group) for group in groups)):
        order = dict(zip(chain(*groups), chain(*images), strict=True))
        yield tuple(order[k] for k in sorted(order))


def _samples(placements: tuple[Placement, ...], polyhedron: Polyhedron) -> Array:
    """Return random points ``(k, N)`` at which bodies are near each other."""
    rng = np.random.default_rng(0)
    points = rng.standard_normal((SAMPLES, polyhedron.manifold.size))
    largest = max(p.body.size for p in placements)
    for p in placements:
        points[:, p.at.start : p.at.start + p.body.dimension] *= largest + p.body.size
    return polyhedron.manifold.canonical(points)


@dataclass(frozen=True, eq=False)
class Exchange(Value):
    """A map of points: body ``k`` takes the place of body ``order[k]``, turned onto itself.

    Then it is shifted.
    """

    placements: tuple[Placement, ...]
    order: tuple[int, ...]
    turns: "tuple[tuple[Array, Array], ...]"
    shifts: "tuple[Array, ...]"

    def __call__(self, q: Array) -> Array:
        """Return the image of a point ``(N,)``."""
        found = []
        changes = zip(self.placements, self.order, self.turns, self.shifts, strict=True)
        for p, source, (shift, turn), by in changes:
            if p.frame is Frame.AXIAL:
                # The matrix of a body of revolution is not unique; its axis is.
                there = q[self.placements[source].at]
                u = there[3:]
                found += [
                    there[:3] + (shift @ p.axis) * u + by,
                    (turn @ p.axis) @ p.axis * u,
                ]
                continue
            origin, matrix = self.placements[source].pose(q)
            found.append(p.coordinates(origin + matrix @ shift + by, matrix @ turn))
        return np.concatenate(found)


def _own_turns(p: Placement) -> list[tuple[Array, Array]]:
    """Return the rotations that carry a body to itself, ``p -> shift + turn p``; identity first.

    Of bodies of revolution only one that exchanges the ends of the axis is returned.
    """
    body, d = p.body, p.body.dimension
    identity = (np.zeros(d), np.eye(d))
    if p.frame is Frame.SHIFTED or p.is_round:
        return [identity]
    middle = body.markers.mean(axis=0)
    found = [identity]
    for turn in _candidates(body.markers - middle, body.axis if p.revolves else None):
        shift = middle - turn @ middle
        known = any(np.abs(turn - other).max() <= SAME for _, other in found)
        if not known and _is_carried(body, shift, turn):
            found.append((shift, turn))
    return found


def _candidates(away: Array, axis: Array | None) -> Iterator[Array]:
    """Return every rotation that may carry markers about their middle to each other."""
    d = away.shape[1]
    if axis is not None:
        across = np.cross(axis, np.eye(3)[np.argmin(abs(axis))])
        yield Rotation.from_rotvec(math.pi * across / np.linalg.norm(across)).as_matrix()
        return
    lengths = np.linalg.norm(away, axis=1)
    first = int(np.argmax(lengths))
    if d == 2:
        for other in away[abs(lengths - lengths[first]) <= FLAT * lengths[first]]:
            yield _plane_frame(other) @ _plane_frame(away[first]).T
        return
    apart = np.linalg.norm(np.cross(away, away[first]), axis=1)
    second = int(np.argmax(apart))
    own = _space_frame(away[first], away[second])
    tolerance = SAME * lengths[first] ** 2
    gram = away @ away.T
    for i, j in permutations(range(len(away)), 2):
        wanted = gram[np.ix_([first, second], [first, second])]
        if np.abs(gram[np.ix_([i, j], [i, j])] - wanted).max() <= tolerance:
            yield _space_frame(away[i], away[j]) @ own.T


def _is_carried(body: Body, shift: Array, turn: Array) -> bool:
    """Whether a rotation carries every part to a part."""
    left = list(body.parts.values())
    for part in body.parts.values():
        image = part.points @ turn.T + shift
        for other in left:
            if len(other.points) != len(image) or not math.isclose(other.radius, part.radius):
                continue
            away = np.linalg.norm(other.points[:, None] - image, axis=-1)
            if max(away.min(axis=0).max(), away.min(axis=1).max()) <= SAME * body.size:
                left.remove(other)
                break
        else:
            return False
    return True


def _renaming(names: tuple[str, ...], values: Array, images: Array) -> dict[str, str]:
    """Return which function takes at the image of every point the value of another."""
    scale = 1e-7 * max(1.0, float(np.abs(values).max()))
    found: dict[str, str] = {}
    taken: set[int] = set()
    tree = cKDTree(images)
    for name, value in zip(names, values, strict=True):
        near = [k for k in tree.query_ball_point(value, scale) if k not in taken]
        if not near:
            msg = f"no function is the image of {name!r}: not a symmetry"
            raise AssertionError(msg)
        taken.add(near[0])
        if names[near[0]] != name:
            found[name] = names[near[0]]
    return found


def _plane_frame(a: Array) -> Array:
    x, y = a / np.linalg.norm(a)
    return np.array([[x, -y], [y, x]])


def _space_frame(a: Array, b: Array) -> Array:
    first = a / np.linalg.norm(a)
    third = np.cross(first, b)
    third /= np.linalg.norm(third)
    return np.column_stack([first, np.cross(third, first), third])
