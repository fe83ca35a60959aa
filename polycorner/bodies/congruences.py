"""Symmetries of arrangements: motions of the whole, exchanges, rotations of a body onto itself.

Isometries of space that carry walls, fixed bodies and periods to each other.

Candidates permute the coordinate axes and reverse some of them: the symmetries of a box whose sides
are parallel to the axes, mirror images among them.  The translation that belongs to each follows
from where walls and fixed bodies are to go.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations, product
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from polycorner.bodies.exchanges import Isometry, carries, elements
from polycorner.bodies.frames import Frame
from polycorner.bodies.lattices import Lattice
from polycorner.bodies.poses import Placement
from polycorner.bodies.rigid_motions import (
    carried,
    number,
    reduced,
    spin,
    turned,
    turned_within,
    velocity,
)
from polycorner.bodies.shapes import Body
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Value, cached_property

if TYPE_CHECKING:
    from collections.abc import Hashable

    import sympy

    from polycorner.bodies.walls import Wall

# Rows of ``A c = b`` for a translation ``c``.
Rows = list[tuple[Array, float]]
FEW = 12  # vectors of which all triple products are invariants


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


@dataclass(frozen=True, eq=False)
class Congruences(Value):
    """The motions and exchanges of bodies that change no gap.

    A velocity ``w + omega x p`` of the whole is one if it keeps every wall, every fixed body and
    the periods: linear equations in ``(w, omega)``.  Bodies that joints connect, ``joined``, are
    only moved as a whole, and not at all where one of them is space or a fixed body.
    """

    placements: tuple[Placement, ...]
    walls: "tuple[Wall, ...]"
    fixed: tuple[Body, ...]
    lattice: Lattice
    joined: frozenset[str] = frozenset()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.placements[0].body.dimension

    @cached_property
    def motions(self) -> Array:
        """A basis of the velocities ``(w, omega)`` that keep everything, ``(g, 3)``, ``(g, 6)``."""
        d = self.dimension
        rows = [np.empty((0, 3 if d == 2 else 6))]
        for wall in self.walls:
            across, held = wall.fixed_by()
            rows.append(across @ velocity(wall.point))
            rows += [velocity(v) - velocity(np.zeros(d)) for v in held]
        rows += [velocity(p) for body in self.fixed for p in body.markers]
        rows += [velocity(v) - velocity(np.zeros(d)) for v in self.lattice.directions]
        if any(p.frame is Frame.SHIFTED and not p.is_round for p in self.placements):
            rows.append(np.eye(rows[0].shape[1])[d:])
        if not self.joined <= {p.name for p in self.placements}:
            rows.append(np.eye(rows[0].shape[1]))
        basis = scipy.linalg.null_space(np.concatenate(rows), rcond=DEFAULT.alike).T
        return reduced(basis) if len(basis) else basis

    def symmetry(
        self, polyhedron: Polyhedron, *, full: bool = False, sized: bool = False
    ) -> Symmetry:
        """Return the group, with the names that functions of a polyhedron change.

        ``full`` says whether isometries are in it that are no motions, ``sized`` whether a last
        coordinate is a factor of all sizes.
        """
        fields, d = [*map(self._field, self.motions), *self._spins()], self.dimension
        carrying = [(np.zeros(d), np.eye(d))]
        if full and not self.joined:
            carrying = isometries(self.walls, self.fixed, self.lattice, self.motions[:, d:])
        found = elements(
            self.placements, polyhedron, self._shifts(), carrying, self.joined, sized=sized
        )
        invariants = self.invariants if fields else None
        return Symmetry(fields=fields, invariants=invariants, elements=tuple(found))

    def _shifts(self) -> list[list[Array]]:
        """Return the shifts of each body by whole periods, where its coordinates go round several.

        Shifts of the whole are left out where they are motions.
        """
        periods = np.array(self.placements[0].manifold.periods[: self.dimension])
        counts = np.ones(self.dimension, dtype=int)
        for axis in self.lattice.axes:
            counts[axis] = round(periods[axis] / self.lattice.lengths[axis])
        found = [self.lattice.shift(some) for some in self.lattice.images(tuple(counts.tolist()))]
        others = [found] * (len(self.placements) - 1)
        return [found if self.fixed else found[:1], *others]

    # ------------------------------------------------------------------------- motions of the whole

    def _field(self, motion: Array) -> "dict[str, sympy.Expr]":
        """Return the velocities of all coordinates as formulas."""
        d = self.dimension
        found: dict[str, Any] = {}
        numbers = [number(x) for x in motion.tolist()]
        for p in self.placements:
            names, symbols = p.manifold.names, p.manifold.symbols
            moved = carried(numbers, symbols[:d])
            found |= dict(zip(names[:d], moved, strict=True))
            found |= dict(zip(names[d:], turned(p.frame, numbers[d:], symbols[d:]), strict=True))
        return found

    def _spins(self) -> "Iterator[dict[str, sympy.Expr]]":
        """Rotations of bodies of revolution about their own axes."""
        for p in self.placements:
            if not p.spins or p.body.axis is None or p.name in self.joined:
                continue
            names, symbols = p.manifold.names, p.manifold.symbols
            if p.frame is Frame.TURNED:
                yield {names[-1]: number(1.0)}
                continue
            axes = [p.body.axis] if p.body.axis.any() else list(np.eye(3))
            for axis in axes:
                rates = turned_within([number(x) for x in axis.tolist()], symbols[3:])
                yield dict(zip(names[3:], rates, strict=True))

    @cached_property
    def _reference(self) -> tuple[Array, Array, Array]:
        """Translations as a projection, a point that rotations keep, the axes they keep."""
        d = self.dimension
        free = self.motions[:, d:]
        pure = free
        if len(free):
            pure = scipy.linalg.null_space(free.T, rcond=DEFAULT.alike).T @ self.motions
        shifts = scipy.linalg.orth(pure[:, :d].T) if len(pure) else np.zeros((d, 0))
        along: Array = shifts @ shifts.T
        across = np.eye(d) - along
        rotations = self.motions[np.abs(free).max(axis=1) > 0] if len(free) else self.motions
        centre = np.zeros(d)
        if len(rotations):
            matrix = np.concatenate([across @ spin(m[d:], d) for m in rotations])
            target = -np.concatenate([across @ m[:d] for m in rotations])
            centre = np.linalg.lstsq(matrix, target, rcond=None)[0]
        turning = 0
        if len(rotations):
            turning = np.linalg.matrix_rank(rotations[:, d:], tol=DEFAULT.alike)
        if d == 3 and turning == 1:
            axis = rotations[0, d:]
            return along, centre, (axis / np.linalg.norm(axis))[None]
        return along, centre, np.eye(d) if turning == 0 else np.empty((0, d))

    def invariants(self, q: Array) -> Array:
        """Return numbers that are equal exactly on orbits of the motions, ``(k,)``.

        All vectors between centres and along bodies turn together; their lengths, products and
        (where no body shows its three axes) triple products, and the components along axes that
        are kept.  Along periodic axes, points of a circle.
        """
        along, centre, axes = self._reference
        d = self.dimension
        places = np.array([q[p.at][:d] for p in self.placements])
        around = self._around(places)
        centres = places - centre
        centres[:, list(self.lattice.axes)] = 0.0
        centres = (centres - along @ centres.mean(axis=0)) / self.placements[0].manifold.scales[0]
        ways = [
            p.directions(q, whole=p.name in self.joined) / p.manifold.scales[-1]
            for p in self.placements
        ]
        if len(axes) == d:
            return np.concatenate([around, centres.ravel(), *(w.ravel() for w in ways)])
        points = np.concatenate([np.zeros((1, d)), centres])
        first, second = np.triu_indices(len(points), 1)
        found = [around, np.linalg.norm(points[first] - points[second], axis=1)]
        found.append((points @ axes.T).ravel())
        for k, own in enumerate(ways):
            unit = own * self.placements[k].manifold.scales[-1]
            found += [(unit @ (points - points[k + 1]).T).ravel(), (own @ axes.T).ravel()]
            found += [(unit @ other.T).ravel() for other in ways[k + 1 :]]
        if max(map(len, ways)) < d:
            found.append(_volumes([*points[1:], *np.concatenate(ways), *axes], d))
        return np.concatenate(found)

    def _around(self, places: Array) -> Array:
        """Return points of circles that tell places along periodic axes; modulo motions."""
        manifold, axes = self.placements[0].manifold, list(self.lattice.axes)
        away = places[:, axes] if self.fixed else (places[1:] - places[0])[:, axes]
        radii = np.array(manifold.periods)[axes] / math.tau
        turns, units = away / radii, radii / manifold.scales[0]
        return np.concatenate([(units * np.cos(turns)).ravel(), (units * np.sin(turns)).ravel()])


def _volumes(vectors: list[Array], d: int) -> Array:
    """Return the determinants of ``d`` vectors each, by which mirror images differ."""
    some = combinations(vectors[:FEW], d)
    return np.array([float(np.linalg.det(np.array(few))) for few in some])
