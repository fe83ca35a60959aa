"""Isometries of space that carry walls, fixed bodies and periods to each other.

Candidates permute the coordinate axes and reverse some of them: the symmetries of a box whose sides
are parallel to the axes, mirror images among them.  The translation that belongs to each follows
from where walls and fixed bodies are to go.
"""

from collections.abc import Iterator, Sequence
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np

from polycorner.bodies.exchanges import Isometry, carries
from polycorner.bodies.lattices import Lattice
from polycorner.bodies.shapes import Body
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from collections.abc import Hashable

# Rows of ``A c = b`` for a translation ``c``.
Rows = list[tuple[Array, float]]


def isometries(
    walls: Sequence[Wall], fixed: Sequence[Body], lattice: Lattice, rotations: Array
) -> list[Isometry]:
    """Return isometries that keep everything, one of each class modulo motions; identity first.

    Parameters
    ----------
    walls, fixed, lattice
        What is kept.
    rotations : (k, 1) or (k, 3) array
        Angular velocities that keep it.
    """
    d = len(lattice.lengths)
    found: dict[Hashable, Isometry] = {}
    for matrix in _signed_permutations(d):
        kind = _class(matrix, rotations)
        if kind in found or not _keeps_lattice(matrix, lattice):
            continue
        shift = _translation(matrix, walls, fixed)
        if shift is not None:
            found[kind] = shift, matrix
    return [*found.values()]


def _signed_permutations(d: int) -> Iterator[Array]:
    """Yield the symmetries of a cube, or a square, with the identity first."""
    for order, signs in product(permutations(range(d)), product((1.0, -1.0), repeat=d)):
        yield np.diag(signs) @ np.eye(d)[list(order)]


def _class(matrix: Array, rotations: Array) -> "Hashable":
    """Return what isometries have in common that differ by rotations of the whole."""
    mirrors = bool(np.linalg.det(matrix) < 0)
    rank = np.linalg.matrix_rank(rotations, tol=DEFAULT.alike) if len(rotations) else 0
    if rank == 0:
        return matrix.tobytes()
    if rank == 1 and len(matrix) == 3:
        axis = rotations[np.argmax(np.linalg.norm(rotations, axis=1))]
        return mirrors, round(float(axis @ matrix @ axis / (axis @ axis)))
    return mirrors


def _keeps_lattice(matrix: Array, lattice: Lattice) -> bool:
    finite = np.where(np.isfinite(lattice.lengths), lattice.lengths, 0.0)
    return bool(np.allclose(abs(matrix) @ finite, finite, rtol=DEFAULT.alike, atol=0))


def _translation(matrix: Array, walls: Sequence[Wall], fixed: Sequence[Body]) -> Array | None:
    """Return the translation that brings all to where others were, or None if there is none."""
    d = len(matrix)
    planes = [wall for wall in walls if isinstance(wall, HalfSpace)]
    round_ones = [wall for wall in walls if isinstance(wall, Cylinder)]
    parts = _planes(matrix, planes), _cylinders(matrix, round_ones)
    if None in parts:
        return None
    rows = [row for part in parts for row in part or ()]
    if fixed:
        middle = np.concatenate([body.markers for body in fixed]).mean(axis=0)
        rows += zip(np.eye(d), (middle - matrix @ middle).tolist(), strict=True)
    normals = np.array([normal for normal, _ in rows]).reshape(-1, d)
    wanted = np.array([offset for _, offset in rows])
    shift: Array = np.linalg.lstsq(normals, wanted, rcond=None)[0]
    away = np.abs(normals @ shift - wanted).max(initial=0)
    if away > DEFAULT.alike * (1 + np.abs(wanted).max(initial=0)):
        return None
    kept = all(any(carries(body, other, shift, matrix) for other in fixed) for body in fixed)
    return shift if kept else None


def _planes(matrix: Array, walls: Sequence[HalfSpace]) -> Rows | None:
    """Half-spaces ``n.p >= h``: among parallel ones, the k-th comes to where the k-th was."""
    found: Rows = []
    for wall in walls:
        normal = matrix @ wall.normal
        before, after = _offsets(walls, wall.normal), _offsets(walls, normal)
        if len(before) != len(after):
            return None
        found += [(normal, b - a) for a, b in zip(before, after, strict=True)]
    return found


def _offsets(walls: Sequence[HalfSpace], normal: Array) -> list[float]:
    return sorted(
        float(wall.normal @ wall.point)
        for wall in walls
        if np.abs(wall.normal - normal).max() <= DEFAULT.alike
    )


def _cylinders(matrix: Array, walls: Sequence[Cylinder]) -> Rows | None:
    """Cylinders and spheres that differ in radius or direction; of equal ones none is sure.

    Where there are waves only the identity is sure.
    """
    found: Rows = []
    for wall in walls:
        targets = [other for other in walls if _fits(matrix, wall, other)]
        if len(targets) != 1:
            return None
        across, _ = targets[0].fixed_by()
        away = targets[0].point - matrix @ wall.point
        found += zip(across, (across @ away).tolist(), strict=True)
    return found


def _fits(matrix: Array, wall: Cylinder, other: Cylinder) -> bool:
    """Whether an isometry without a translation makes two walls parallel, of equal radii."""
    if abs(wall.radius - other.radius) > DEFAULT.alike * wall.radius:
        return False
    if wall.waves or other.waves:
        return wall is other and bool((matrix == np.eye(len(matrix))).all())
    if wall.axis is None or other.axis is None:
        return wall.axis is other.axis
    return bool(abs(abs(other.axis @ matrix @ wall.axis) - 1) <= DEFAULT.alike)
