"""The surface that a two-dimensional face lies on, for many points at once.

The surface is where the functions that are active on the face, and the equations, vanish.  Points
are told apart by their coordinates, or by the invariants of the symmetry, and nearby ones compared
in orthonormal frames of the tangent plane.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.polyhedra.faces import NEWTON
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array

Flags = NDArray[np.bool_]

# Points at which it is seen whether invariants are computed for many points at once.
SAMPLE = 3
# Radius of a ball, as a part of the distance of a point outside it.
OUTSIDE = 0.7
# Parts of a straight way that are looked at.
WAY = np.linspace(0.05, 0.95, 10)


class Surface:
    """Where the functions of a face vanish.

    Parameters
    ----------
    quotient : Quotient
        The polyhedron modulo its symmetry.
    active : set of int
        Functions that vanish on the face.
    seed : (n,) array
        A point of the face or of its boundary.
    balls : sequence of (n,) arrays, two by two
        Centres of balls that are taken out of the face, and points just outside them.
    """

    def __init__(
        self,
        quotient: Quotient,
        active: frozenset[int],
        seed: Array,
        balls: Sequence[tuple[Array, Array]] = (),
    ) -> None:
        self.quotient, self.active = quotient, active
        self.polyhedron, self.manifold = quotient.polyhedron, quotient.manifold
        self.scales, self.tolerances = self.manifold.scale_array, quotient.tolerances
        self.held = quotient.held(quotient.at(seed).basis(active))
        self.watched = [i for i in range(quotient.count) if i not in active]
        self._at_once: bool | None = None  # whether invariants of many points are found in one call
        self._belongs: dict[tuple[bool, ...], bool] = {}
        self._functions = quotient.count + len(self.polyhedron.equation_names)
        self._centres: Array = np.array([])
        if balls:
            centres, beside = np.array(balls).transpose(1, 0, 2)
            self._centres = self.embedded(centres)
            sizes = np.linalg.norm(self.apart(self.embedded(beside), self._centres), axis=1)
            self._radii = OUTSIDE * sizes

    @property
    def is_plane(self) -> bool:
        """Whether it is a plane, in which no face has handles."""
        plain = self.quotient.symmetry.invariants is None and not self.polyhedron.equation_names
        return plain and len(self.scales) == 2 and bool(np.isinf(self.manifold.periods).all())

    def values(self, q: Array) -> Array:
        """Return values ``(k, m)`` of all functions, and distances from the balls after them."""
        with np.errstate(all="ignore"):
            found: Array = self.polyhedron.bundle.evaluate(q, 0)[0]
        return self._with_balls(q, found)

    def evaluated(self, q: Array) -> tuple[Array, Array]:
        """Return values as :meth:`values`, and scaled gradients ``(k, m, n)`` of all functions."""
        with np.errstate(all="ignore"):
            values, gradients = self.polyhedron.bundle.evaluate(q, 1)
        return self._with_balls(q, values), gradients * self.scales

    def _with_balls(self, q: Array, values: Array) -> Array:
        if not len(self._centres):
            return values
        away = np.linalg.norm(self.apart(self.embedded(q)[:, None], self._centres), axis=2)
        return np.concatenate([values, away - self._radii], axis=1)

    def normals(self, gradients: Array) -> tuple[Array, Array]:
        """Return unit gradients of the held functions ``(k, r, n)`` and their lengths."""
        rows = gradients[:, self.held]
        sizes = np.sqrt(np.einsum("kij,kij->ki", rows, rows))
        with np.errstate(all="ignore"):
            return np.nan_to_num(rows / sizes[..., None]), sizes

    def across(self, gradients: Array) -> Array:
        """Return unit vectors that span the normals of the surface, ``(k, r, n)``.

        On spheres and rotations gradients may be nearly parallel to the vector itself, so that
        they hardly turn where the surface does: there each is taken orthogonal to those after it,
        and the determinant of the products of two such frames is that of the cosines of the angles
        between the tangent planes.
        """
        units, _ = self.normals(gradients)
        if not self.polyhedron.normalised or not len(units):
            return units
        frames, factors = np.linalg.qr(units[:, ::-1].transpose(0, 2, 1))
        signs = np.where(np.diagonal(factors, axis1=1, axis2=2) < 0, -1.0, 1.0)
        return np.asarray((frames * signs[:, None]).transpose(0, 2, 1)[:, ::-1])

    def projected(self, q: Array) -> tuple[Array, Flags]:
        """Return the nearest points of the surface, and which of them were found."""
        size = np.zeros(len(q))
        for _ in range(NEWTON if self.held else 0):
            values, gradients = self.evaluated(q)
            units, sizes = self.normals(gradients)
            with np.errstate(all="ignore"):
                target = -values[:, self.held] / sizes
            size = np.asarray(abs(target).max(axis=1))
            if not (size > self.tolerances.held).any():
                break
            q = q + self.scales * _shortest(units, np.nan_to_num(target))
        return q, (size < self.tolerances.zero) & np.isfinite(q).all(axis=1)

    def placed(self, q: Array) -> tuple[Array, Flags]:
        """Return the nearest points of the surface, and which of them lie on the face."""
        q, found = self.projected(q)
        return q, found & self.contains(self.values(q))

    def leave(
        self, inside: Array, outside: Array, low: Array, high: Array, steps: int
    ) -> tuple[Array, Array]:
        """Bisect where ways leave the face, from parts of them inside and outside."""
        for _ in range(steps if len(inside) else 0):
            middle = (low + high) / 2
            _, within = self.placed(inside + middle[:, None] * (outside - inside))
            low, high = np.where(within, middle, low), np.where(within, high, middle)
        return low, high

    def room(self, where: Array) -> Array:
        """Return distances of embedded points from the nearest centre of a ball."""
        away = self.apart(where[:, None], self._centres) if len(self._centres) else None
        none = np.full(len(where), np.inf)
        return none if away is None else np.asarray(np.linalg.norm(away, axis=2).min(axis=1))

    def inside_balls(self, q: Array) -> Flags:
        """Whether points lie in one of the balls."""
        return np.asarray((self.values(q)[:, self._functions :] < 0).any(axis=1))

    def contains(self, values: Array) -> Any:
        """Whether points of the surface with given values lie on the face, not on another one."""
        signs = values[:, self.watched] > 0
        outside = (values[:, self._functions :] > 0).all(axis=1)
        if not self.polyhedron.is_union:
            return signs.all(axis=1) & outside
        found = np.zeros(len(signs), dtype=bool)
        patterns, where = np.unique(signs, axis=0, return_inverse=True)
        for k, pattern in enumerate(patterns):
            found[where.ravel() == k] = self._belongs_to(tuple(pattern.tolist()))
        return found & outside & np.isfinite(values).all(axis=1)

    def joins(self, before: Array, after: Array) -> Flags:
        """Whether values ``(..., m)`` that change in proportion stay those of the face.

        Where functions change sign, one after another, the signs in between must be those of
        points on the face.
        """
        a, b = before[..., self.watched], after[..., self.watched]
        turned = (a > 0) != (b > 0)
        found = np.ones(turned.shape[:-1], dtype=bool)
        for where in zip(*np.nonzero(turned.sum(axis=-1) > 1), strict=True):
            u, v = before[where], after[where]
            changed = np.array(self.watched)[turned[where]]
            at = np.sort(u[changed] / (u[changed] - v[changed]))
            between = (at[:-1] + at[1:]) / 2
            found[where] = self.contains(u + between[:, None] * (v - u)).all()
        return found

    def sees(self, p: Array, q: Array) -> Any:
        """Whether straight ways from one point of the face to others stay on it."""
        away = self.manifold.chord(q, p)
        way = p + WAY[:, None, None] * away
        _, on = self.placed(way.reshape(-1, len(p)))
        return on.reshape(len(WAY), len(q)).all(axis=0)

    def _belongs_to(self, pattern: tuple[bool, ...]) -> bool:
        if pattern not in self._belongs:
            signs = [0] * self.quotient.count
            for i, positive in zip(self.watched, pattern, strict=True):
                signs[i] = 1 if positive else -1
            pieces = self.polyhedron.signs_to_pieces(signs)
            here = bool(pieces) and frozenset().union(*pieces) == self.active
            self._belongs[pattern] = here
        return self._belongs[pattern]

    # ----------------------------------------------------------------------------- tangent planes

    def tangents(self, q: Array, gradients: Array) -> Array | None:
        """Return orthonormal frames of the tangent planes ``(k, n, 2)``; None if they are none."""
        units, _ = self.normals(gradients)
        orbits = [self.quotient.orbit(p) for p in q]
        if orbits and len(orbits[0]):
            units = np.concatenate([units, np.array(orbits)], axis=1)
        if units.shape[1] + 2 != len(self.scales):
            return None
        if not units.shape[1]:
            return np.tile(np.eye(2), (len(q), 1, 1))
        _, singular, right = np.linalg.svd(np.nan_to_num(units))
        if (singular[:, -1] < self.tolerances.rank * singular[:, 0]).any():
            return None
        return np.asarray(right[:, -2:].transpose(0, 2, 1))

    def embedded(self, q: Array) -> Array:
        """Return what points are compared by: scaled coordinates, or the invariants."""
        invariants = self.quotient.symmetry.invariants
        if invariants is None:
            return q / self.scales
        if self._at_once is None and len(q):
            self._at_once = _is_elementwise(invariants, q[:SAMPLE])
        if self._at_once:
            return np.asarray(invariants(q.T)).T
        return np.array([invariants(p) for p in q])

    def frames(self, q: Array, tangents: Array) -> tuple[Array, Array]:
        """Return tangents ``(k, n, 2)`` whose images, ``(k, N, 2)``, are orthonormal."""
        if self.quotient.symmetry.invariants is None:
            return tangents, tangents
        h = self.tolerances.difference
        steps = h * self.scales[:, None] * tangents
        sides = [
            (self.embedded(q + steps[..., i]) - self.embedded(q - steps[..., i])) / (2 * h)
            for i in (0, 1)
        ]
        images, factors = np.linalg.qr(np.stack(sides, axis=-1))
        return tangents @ np.linalg.inv(factors), images

    def apart(self, p: Array, q: Array) -> Array:
        """Return displacements from embedded points ``q`` to embedded points ``p``."""
        if self.quotient.symmetry.invariants is not None:
            return np.asarray(p - q)
        return self.manifold.chord(p * self.scales, q * self.scales) / self.scales


def _is_elementwise(invariants: Callable[[Array], Array], q: Array) -> bool:
    """Whether invariants written for a point ``(n,)`` give those of points ``(n, k)`` as well."""
    each = np.array([invariants(p) for p in q])
    try:
        together = np.asarray(invariants(q.T))
    except (TypeError, ValueError, IndexError):
        return False
    return together.shape == each.T.shape and bool(np.allclose(together.T, each, 1e-12, 1e-12))


def _shortest(units: Array, target: Array) -> Array:
    """Return the shortest solutions ``(k, n)`` of ``units x = target``."""
    if units.shape[1] > 1:
        weights = np.linalg.pinv(units @ units.transpose(0, 2, 1), hermitian=True)
        target = np.einsum("kij,kj->ki", weights, target)
    return np.asarray(np.einsum("kin,ki->kn", units, target))


# Where in a tangent plane differences of invariants are made, in steps.
STENCIL = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1]])


class Height:
    """A random linear function of the lines and a wave on every circle, or of the invariants.

    On rotations it is a quadratic form in the quaternion, the same at opposite ones.
    Derivatives are in scaled coordinates; those of invariants are central differences.
    """

    def __init__(self, surface: Surface, rng: np.random.Generator) -> None:
        self.surface, self.step = surface, surface.tolerances.beside
        periods = np.array(surface.manifold.periods)
        n = len(periods)
        self._circles = np.isfinite(periods)
        self._rates = 2 * np.pi * surface.scales / np.where(self._circles, periods, 1.0)
        self._invariant = surface.quotient.symmetry.invariants is not None
        self._weights, self._phases = rng.standard_normal(n), rng.uniform(0, 2 * np.pi, n)
        self._rng, self._shares = rng, np.zeros(0)
        self._form = np.zeros((n, n))
        for factor in surface.manifold.factors:
            if factor.turns:
                form = rng.standard_normal((len(factor.names),) * 2)
                self._form[factor.at, factor.at] = form + form.T
                self._weights[factor.at] = 0.0

    def slopes(self, q: Array, directions: Array) -> Array:
        """Return the slopes ``(k, d)`` along scaled directions ``(k, n, d)``."""
        if not self._invariant:
            return np.asarray(np.einsum("kn,knd->kd", self._gradient(q), directions))
        steps = np.moveaxis(self.step * self.surface.scales[:, None] * directions, 2, 0)
        sides = [self._of_invariants(q + s) - self._of_invariants(q - s) for s in steps]
        return np.stack(sides, axis=-1) / (2 * self.step)

    def restricted(self, q: Array, gradients: Array, tangents: Array) -> tuple[Array, Array]:
        """Return slopes ``(k, 2)`` and second derivatives ``(k, 2, 2)`` along the surface.

        Second derivatives are those of the Lagrangian, or of the height of projected points.
        """
        if self._invariant:
            return self._differences(q, tangents)
        first = self._gradient(q)
        waves = np.where(self._circles, -np.cos(self._angles(q)) * self._rates, 0.0)
        curvature = np.einsum("knt,kn,kns->kts", tangents, waves * self._weights, tangents)
        curvature += np.einsum("knt,nm,kms->kts", tangents, self._form, tangents)
        held = self.surface.held
        if held:
            with np.errstate(all="ignore"):
                hessians = self.surface.polyhedron.bundle.evaluate(q, 2)[2][:, held]
            scales, rows = self.surface.scales, gradients[:, held]
            weights = np.linalg.pinv(rows @ rows.transpose(0, 2, 1), hermitian=True)
            shares = np.einsum("kij,kjn,kn->ki", weights, rows, first)
            bend = np.einsum("ki,kinm->knm", shares, hessians * scales[:, None] * scales)
            curvature -= np.einsum("knt,knm,kms->kts", tangents, bend, tangents)
        return np.einsum("knt,kn->kt", tangents, first), curvature

    def _differences(self, q: Array, tangents: Array) -> tuple[Array, Array]:
        steps: Array = self.step * self.surface.scales * np.einsum("knt,jt->jkn", tangents, STENCIL)
        points, _ = self.surface.projected((q + steps).reshape(-1, q.shape[1]))
        heights: Array = self._of_invariants(points).reshape(-1, len(q))
        here, right, left, up, down, over, under = (heights[k] for k in range(len(STENCIL)))
        slope = np.stack([right - left, up - down], axis=-1) / (2 * self.step)
        a: Array = right - 2 * here + left
        d: Array = up - 2 * here + down
        b: Array = (over - 2 * here + under - a - d) / 2
        return slope, np.array([[a, b], [b, d]]).transpose(2, 0, 1) / self.step**2

    def _gradient(self, q: Array) -> Array:
        waves = np.where(self._circles, -np.sin(self._angles(q)), 1.0)
        return np.asarray(waves * self._weights + q / self.surface.scales @ self._form)

    def _angles(self, q: Array) -> Array:
        return np.asarray(self._rates * q / self.surface.scales + self._phases)

    def _of_invariants(self, q: Array) -> Array:
        values = self.surface.embedded(q)
        if not self._shares.size:
            self._shares = self._rng.standard_normal((values.shape[1],))
        return np.asarray(values @ self._shares)
