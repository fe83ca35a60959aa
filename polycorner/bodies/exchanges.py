"""Finite symmetries of arrangements: exchanges, isometries of space, congruences of a body.

An isometry ``p -> c + S p`` of space carries a body at ``(o, M)`` to ``(c + S o, S M K)``, where
``K`` is a congruence of the body with itself (about its origin here, for simplicity): a rotation if
``S`` is one, and a rotation with a reflection if ``S`` is a mirror image, so that ``S M K`` is a
rotation again.  A body without such a ``K`` is not equal to its mirror image.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, permutations, product

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from polycorner.bodies.frames import Frame
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Element
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value

Isometry = tuple[Array, Array]  # p -> shift + matrix p

MOST_ELEMENTS = 10_000
SAMPLES = 12  # random points at which functions are told apart


def elements(
    placements: tuple[Placement, ...],
    polyhedron: Polyhedron,
    shifts: Sequence[Sequence[Array]],
    isometries: Sequence[Isometry],
    joined: frozenset[str] = frozenset(),
    *,
    sized: bool = False,
) -> Iterator[Element]:
    """Yield exchanges of equal bodies with rotations of bodies onto themselves, no identity.

    With them go ``isometries`` of space, and ``shifts`` of each body; the first ones of both change
    nothing.  Bodies that are ``joined`` to others stay where they are.  None where there would be
    more than ten thousand.  How functions change their names is
    found by their values at random points and at the images of these.
    """
    groups = _equal(placements, joined)
    turns = [
        [_own_turns(p, matrix)[: 1 if p.name in joined else None] for p in placements]
        for _, matrix in isometries
    ]
    count = sum(math.prod(map(len, some)) for some in turns) * math.prod(map(len, shifts))
    count *= math.prod(math.factorial(len(group)) for group in groups)
    if count > MOST_ELEMENTS:
        return
    points = _samples(placements, polyhedron)
    values = polyhedron.values(points)
    changes = (
        (isometry, *some)
        for isometry, own in zip(isometries, turns, strict=True)
        for some in product(_orders(groups), product(*own), product(*shifts))
    )
    next(changes)  # the identity
    for some in changes:
        change = Exchange(placements, *some, sized)
        images = polyhedron.values(np.array([change(q) for q in points]))
        yield Element(change, _renaming(polyhedron.names, values.T, images.T))


def _equal(placements: tuple[Placement, ...], joined: frozenset[str]) -> list[list[int]]:
    """Return the bodies in groups of equal ones that may change places, by number."""
    groups: list[list[int]] = []
    for k, p in enumerate(placements):
        for group in groups:
            one = placements[group[0]]
            if joined.isdisjoint((one.name, p.name)) and one.body.same(p.body):
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

    Then the whole is carried by an isometry, and the body shifted.  A coordinate behind those of
    the bodies does not change; ``sized`` says whether it is a factor of their sizes.
    """

    placements: tuple[Placement, ...]
    isometry: Isometry
    order: tuple[int, ...]
    turns: "tuple[Isometry, ...]"
    shifts: "tuple[Array, ...]"
    sized: bool = False

    def __call__(self, q: Array) -> Array:
        """Return the image of a point ``(N,)``."""
        found = []
        (start, whole), d = self.isometry, self.placements[0].body.dimension
        changes = zip(self.placements, self.order, self.turns, self.shifts, strict=True)
        factor = q[-1] if self.sized else 1.0
        for p, source, (middle, turn), by in changes:
            shift = factor * middle
            if p.frame is Frame.AXIAL:
                # The matrix of a body of revolution is not unique; its axis is.
                there = q[self.placements[source].at]
                u = there[d:]
                origin = start + whole @ (there[:d] + (shift @ p.axis) * u) + by
                found += [origin, (turn @ p.axis) @ p.axis * (whole @ u)]
                continue
            origin, matrix = self.placements[source].pose(q)
            origin = start + whole @ (origin + matrix @ shift) + by
            found.append(p.coordinates(origin, whole @ matrix @ turn))
        return np.concatenate([*found, q[self.placements[-1].at.stop :]])


def _own_turns(p: Placement, whole: Array) -> list[Isometry]:
    """Return the congruences of a body with itself, ``p -> shift + turn p``; identity first.

    They are rotations, or mirror images if the matrix ``whole`` of an isometry is one.  Of bodies
    of revolution only one of those is returned that exchange the ends of the axis, or keep them; of
    bodies that do not turn the one that makes up for the isometry.
    """
    body, d = p.body, p.body.dimension
    mirror = np.linalg.det(whole) < 0
    flip = np.diag([-1.0 if mirror else 1.0, *[1.0] * (d - 1)])
    if p.is_round:
        return [(np.zeros(d), flip)]
    middle = body.markers.mean(axis=0)
    away = body.markers - middle
    if p.frame is Frame.SHIFTED:
        candidates: Iterator[Array] = iter([whole.T])
    elif p.revolves and body.axis is not None:
        candidates = _along(body.axis, mirror=mirror)
    else:
        candidates = (turn @ flip for turn in _candidates(away @ flip, away))
    found = [] if mirror or p.frame is Frame.SHIFTED else [(np.zeros(d), np.eye(d))]
    for turn in candidates:
        shift = middle - turn @ middle
        known = any(np.abs(turn - other).max() <= DEFAULT.same for _, other in found)
        if not known and carries(body, body, shift, turn):
            found.append((shift, turn))
    return found


def _along(axis: Array, *, mirror: bool) -> Iterator[Array]:
    """Return a congruence of a line in space that keeps its ends, and one that exchanges them."""
    across = np.cross(axis, np.eye(3)[np.argmin(abs(axis))])
    half_turn = Rotation.from_rotvec(math.pi * across / np.linalg.norm(across)).as_matrix()
    if mirror:
        yield -half_turn @ (2 * np.outer(axis, axis) - np.eye(3))
        yield -np.eye(3)
    else:
        yield np.eye(3)
        yield half_turn


def _candidates(source: Array, target: Array) -> Iterator[Array]:
    """Return every rotation that may carry markers about their middle to others."""
    d = source.shape[1]
    lengths, others = (np.linalg.norm(some, axis=1) for some in (source, target))
    first = int(np.argmax(lengths))
    if d == 2:
        for other in target[abs(others - lengths[first]) <= DEFAULT.alike * lengths[first]]:
            yield _plane_frame(other) @ _plane_frame(source[first]).T
        return
    apart = np.linalg.norm(np.cross(source, source[first]), axis=1)
    second = int(np.argmax(apart))
    own = _space_frame(source[first], source[second])
    tolerance = DEFAULT.same * lengths[first] ** 2
    wanted = (source @ source.T)[np.ix_([first, second], [first, second])]
    gram = target @ target.T
    for i, j in permutations(range(len(target)), 2):
        if np.abs(gram[np.ix_([i, j], [i, j])] - wanted).max() <= tolerance:
            yield _space_frame(target[i], target[j]) @ own.T


def carries(body: Body, onto: Body, shift: Array, turn: Array) -> bool:
    """Whether an isometry carries the parts of a body to those of another."""
    left = list(onto.parts.values())
    if len(left) != len(body.parts):
        return False
    for part in body.parts.values():
        image = part.points @ turn.T + shift
        for other in left:
            if len(other.points) != len(image) or not math.isclose(other.radius, part.radius):
                continue
            away = np.linalg.norm(other.points[:, None] - image, axis=-1)
            if max(away.min(axis=0).max(), away.min(axis=1).max()) <= DEFAULT.same * body.size:
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
