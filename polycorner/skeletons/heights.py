"""Heights on surfaces in general position, for counting critical points."""

import numpy as np

from polycorner.skeletons.surfaces import Surface
from polycorner.spaces.manifold import Array

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
