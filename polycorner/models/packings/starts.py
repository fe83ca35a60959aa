"""Starts for jamming: soft bodies pushed apart, and the largest inflation without overlap."""

from typing import Any

import numpy as np
from scipy.optimize import minimize

from polycorner.models.packings.contacts import neighbours
from polycorner.spaces.manifold import Array

SKIN = 0.3  # margin of the list of neighbours, in mean diameters
MOST_DEFLATIONS = 15
DEFLATED = 0.8  # share of the overlap that one deflation takes away
MEMORY = 20  # pairs of vectors that L-BFGS keeps


class _SoftBodies:
    """The energy ``1/2 sum (1 - |x_j - x_i| / sigma_ij)^2`` over overlapping pairs ([OSLN])."""

    def __init__(self, centres: Array, radii: Array, box: float) -> None:
        self.radii, self.box, self.shape = radii, box, centres.shape
        self.skin = SKIN * 2 * float(radii.mean())
        self._listed(centres)

    def _listed(self, centres: Array) -> None:
        self.at = centres.copy()
        pairs, _, _ = neighbours(centres, self.radii, 1.0, self.box, self.skin)
        self.first, self.second = pairs.T
        self.sigma = self.radii[pairs].sum(axis=1)

    def __call__(self, u: Array) -> tuple[float, Array]:
        centres = u.reshape(self.shape)
        if np.linalg.norm(centres - self.at, axis=1).max() > self.skin / 2:
            self._listed(centres)
        between = centres[self.second] - centres[self.first]
        between -= self.box * np.round(between / self.box)
        distance = np.sqrt(np.einsum("ij,ij->i", between, between))
        hit = np.flatnonzero(distance < self.sigma)
        distance, sigma = np.maximum(distance[hit], 1e-300), self.sigma[hit]
        overlap = 1 - distance / sigma
        push = (overlap / (sigma * distance))[:, None] * between[hit]
        first, second, count = self.first[hit], self.second[hit], len(centres)
        slope = [
            np.bincount(first, along, count) - np.bincount(second, along, count) for along in push.T
        ]
        return float(overlap @ overlap) / 2, np.column_stack(slope).ravel()


def pushed_apart(centres: Array, radii: Array, box: float, iterations: int) -> Array:
    """Return centres after a minimisation of the energy of soft bodies by L-BFGS."""
    energy = _SoftBodies(centres, radii, box)
    options = {"maxiter": iterations, "maxfun": 2 * iterations, "maxcor": MEMORY, "ftol": 0.0}
    solve: Any = minimize  # whose stubs know no callable object that returns a gradient, too
    found = solve(energy, centres.ravel(), jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x).reshape(centres.shape)


def decompressed(
    centres: Array, radii: Array, box: float, iterations: int, *, overlap: float
) -> Array:
    """Return centres of soft bodies that are deflated until they overlap by ``overlap`` only.

    The mean overlap of harmonic bodies is proportional to the inflation beyond jamming, so most of
    it is taken away, and the rest minimised, again and again.  The contacts are then nearly those
    of the jammed packing.
    """
    inflation = 1.0
    for _ in range(MOST_DEFLATIONS):
        centres = pushed_apart(centres, inflation * radii, box, iterations)
        pairs, _, gaps = neighbours(centres, radii, inflation, box, 0.0)
        if not len(pairs):
            break
        mean = float((-gaps / (inflation * radii[pairs].sum(axis=1))).mean())
        if mean <= overlap:
            break
        inflation *= 1 - DEFLATED * mean
    return centres


def largest_inflation(centres: Array, radii: Array, box: float, guess: float) -> float:
    """Return the largest factor of the radii without overlap, at most ``guess`` times a bit."""
    margin = 0.5 * guess * float(radii.max())
    pairs, _, gaps = neighbours(centres, radii, guess, box, margin)
    sums = radii[pairs].sum(axis=1)
    return float(((gaps + guess * sums) / sums).min(initial=guess))
