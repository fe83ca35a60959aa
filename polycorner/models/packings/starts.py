"""Starts for jamming: soft bodies pushed apart, and the largest inflation without overlap."""

from typing import Any

import numpy as np
from scipy.optimize import minimize

from polycorner.models.packings.contacts import neighbours
from polycorner.spaces.manifold import Array

SKIN = 0.3, 0.05  # margins of the list of neighbours in mean diameters: at first, and later
MOST_CHANGES = 30  # of the inflation
DEFLATED = 0.8  # share of the excess inflation that one deflation takes away
FIRST = 4e-3  # mean overlap, relative to the sum of radii, that is expected at first
APART = 0.1  # share of the expected overlap below which the bodies have come apart
WIDEST = 0.02  # largest overlap that is expected
# Largest unbalanced force, relative to the mean: before a deflation, and at the end.
BALANCE = 5e-2, 2e-3
MEMORY = 20  # pairs of vectors that L-BFGS keeps


class _SoftBodies:
    """The energy ``1/2 sum (1 - |x_j - x_i| / sigma_ij)^2`` over overlapping pairs ([OSLN])."""

    def __init__(self, centres: Array, radii: Array, box: float, skin: float) -> None:
        self.radii, self.box, self.shape = radii, box, centres.shape
        self.skin = skin * 2 * float(radii.mean())
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


def pushed_apart(
    centres: Array, radii: Array, box: float, iterations: int, *, unbalanced: float, skin: float
) -> Array:
    """Return centres after a minimisation of the energy of soft bodies by L-BFGS.

    It ends when the gradient, times the mean diameter, is at most ``unbalanced``.
    """
    energy = _SoftBodies(centres, radii, box, skin)
    options = {
        "maxiter": iterations,
        "maxfun": 2 * iterations,
        "maxcor": MEMORY,
        "ftol": 0.0,
        "gtol": unbalanced / (2 * float(radii.mean())),
    }
    solve: Any = minimize  # whose stubs know no callable object that returns a gradient, too
    found = solve(energy, centres.ravel(), jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x).reshape(centres.shape)


def decompressed(
    centres: Array, radii: Array, box: float, iterations: int, *, overlap: float
) -> Array:
    """Return centres of soft bodies that are deflated until they overlap by ``overlap`` only.

    Of the excess inflation most is taken away, and the rest minimised, again and again.  Where a
    rearrangement lets the bodies come apart, they are inflated.  The contacts are then nearly those
    of the jammed packing.
    """
    inflation, expected = 1.0, FIRST
    for count in range(MOST_CHANGES):
        last = expected <= overlap
        unbalanced = expected * BALANCE[last]
        centres = pushed_apart(
            centres, inflation * radii, box, iterations, unbalanced=unbalanced, skin=SKIN[count > 0]
        )
        overlaps = relative_overlaps(centres, inflation * radii, box)
        mean = float(overlaps.mean()) if len(overlaps) else 0.0
        if mean < APART * expected:
            expected = min(expected / (1 - DEFLATED), WIDEST)
            inflation *= 1 + expected
        elif last:
            break
        else:  # where they overlap little enough, they have only to be balanced
            share = min(DEFLATED, max(1 - overlap / mean, 0.0))
            inflation *= 1 - share * excess(overlaps)
            expected = max((1 - DEFLATED) * mean, overlap)
    return centres


def relative_overlaps(centres: Array, radii: Array, box: float) -> Array:
    """Return the overlaps of the pairs that overlap, relative to the sums of their radii."""
    pairs, _, gaps = neighbours(centres, radii, 1.0, box, 0.0)
    overlaps: Array = -gaps / radii[pairs].sum(axis=1)
    return overlaps


def excess(overlaps: Array) -> float:
    """Return ``(s - s_J) / s`` for soft bodies in equilibrium at ``s``, which jam at ``s_J``.

    Near jamming their energy is ``E = k (s - s_J)^2``, so that ``s - s_J = 2 E / E'``, and
    ``E' = sum o (1 - o) / s`` for the overlaps ``o`` (``(m,)``, relative to the sums of radii).
    """
    return float((overlaps @ overlaps) / (overlaps @ (1 - overlaps)))


def largest_inflation(centres: Array, radii: Array, box: float, guess: float) -> float:
    """Return the largest factor of the radii without overlap, at most ``guess`` times a bit."""
    margin = 0.5 * guess * float(radii.max())
    pairs, _, gaps = neighbours(centres, radii, guess, box, margin)
    sums = radii[pairs].sum(axis=1)
    return float(((gaps + guess * sums) / sums).min(initial=guess))
