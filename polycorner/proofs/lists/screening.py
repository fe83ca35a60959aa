"""Guesses of boxes in which Krawczyk's operator will show one KKT point, many at a time.

The same tests as in :mod:`~polycorner.proofs.lists.acceptance`, with compiled enclosures of
derivatives and matrices in floating point without regard to rounding: they prove nothing and
save nearly all attempts in ball arithmetic that would fail.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.proofs.lists.acceptance import (
    GROWTH,
    MOST_WIDENING,
    QUARTERINGS,
    WIDENINGS,
    WIDEST,
)
from polycorner.proofs.lists.batches import bordered, inverted, solved
from polycorner.proofs.lists.settings import Setting
from polycorner.spaces.manifold import Array

Sides = tuple[Array, Array]
SURE = 0.8  # of the unknowns' radii, below which those of the image are small enough


@dataclass
class Screen:
    """KKT points of one face, approximately, about which boxes are tried.

    Attributes
    ----------
    setting : Setting
    active : tuple of int
    q : (B, n) array
    """

    setting: Setting
    active: Sequence[int]
    q: Array

    def __post_init__(self) -> None:
        problem, m = self.setting.problem, self.setting.problem.inequalities
        self.rows = [*self.active, *range(m, problem.rows - 1), problem.rows - 1]
        self.free = list(self.setting.domain.free)
        values, slopes, bends = problem.evaluate(self.q, 2)
        free, units = self.free, problem.scales[self.free]
        self.values = values[:, self.rows[:-1]]
        self.start = (
            slopes[:, self.rows][:, :, free] / units,
            bends[:, self.rows][:, :, free][:, :, :, free] / np.outer(units, units),
        )

    def radii(self, widest: Array) -> Array:
        """Return the radii ``(B, n)`` of the widest boxes that pass, NaN where none does."""
        scales = self.setting.problem.scales[self.free]
        found = np.full((len(self.q), len(self.free)), np.nan)
        left = np.arange(len(self.q))
        for power in range(QUARTERINGS):
            reach = np.minimum(widest[left], WIDEST)[:, None] / 4**power * scales
            found[left] = self._widened(left, reach)
            left = left[np.isnan(found[left]).any(axis=1)]
            if not left.size:
                break
        result = np.zeros_like(self.q)
        result[:, self.free] = found
        return result

    def _widened(self, which: NDArray[np.intp], radii: Array) -> Array:
        """Return radii that pass for some points, starting from given ones; NaN for none."""
        found, going = np.full_like(radii, np.nan), np.arange(len(which))
        for _ in range(WIDENINGS):
            here = radii[going]
            images, sure = self._images(which[going], here)
            found[going[sure]] = here[sure]
            with np.errstate(invalid="ignore"):
                more = ~sure & (images <= MOST_WIDENING * here).all(axis=1)
            radii[going[more]] = np.maximum(here[more], GROWTH * images[more])
            going = going[more]
            if not going.size:
                break
        return found

    def _bounds(self, lower: Array, upper: Array) -> tuple[Sides, Sides]:
        """Return middles and radii of derivatives of the face's rows."""
        ends = self.setting.functions.mean_value_gradients(lower, upper, hessians=True)
        g_lo, g_hi = (side[:, self.rows][:, :, self.free] for side in ends[:2])
        h_lo, h_hi = (side[:, self.rows][:, :, self.free][:, :, :, self.free] for side in ends[2:])
        with np.errstate(all="ignore"):
            middles = [0.5 * (low + high) for low, high in ((g_lo, g_hi), (h_lo, h_hi))]
            radii = [0.5 * (high - low) for low, high in ((g_lo, g_hi), (h_lo, h_hi))]
        return (middles[0], radii[0]), (middles[1], radii[1])

    def _images(self, which: NDArray[np.intp], radii: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return radii of the images of boxes about some points, and whether these pass."""
        reach = np.zeros((len(which), self.q.shape[1]))
        reach[:, self.free] = radii
        for i, (low, high) in self.setting.domain.held.items():
            reach[:, i] = 0.5 * (high - low)
        q, n, k = self.q[which], len(self.free), len(self.active)
        (g, g_rad), (h, h_rad) = self._bounds(q - reach, q + reach)
        fine = np.isfinite(g_rad).all(axis=(1, 2)) & np.isfinite(h_rad).all(axis=(1, 2, 3))
        images, sure = np.full_like(radii, np.nan), np.zeros(len(which), dtype=np.bool_)
        which, g, g_rad, h, h_rad = which[fine], g[fine], g_rad[fine], h[fine], h_rad[fine]
        rows, rows_rad = g[:, :-1], g_rad[:, :-1]
        left = np.linalg.pinv(rows.transpose(0, 2, 1))
        lam = np.einsum("bij,bj->bi", left, g[:, -1])
        defect = np.eye(lam.shape[1]) - abs(left) @ rows_rad.transpose(0, 2, 1)
        pull = g_rad[:, -1] + np.einsum("bki,bk->bi", rows_rad, abs(lam))
        spread = solved(defect, np.einsum("bij,bj->bi", abs(left), pull))
        rho = np.concatenate([radii[fine], 2 * spread], axis=1)
        weights = np.concatenate([-lam, np.ones((len(lam), 1))], axis=1)
        slopes, bends = self.start[0][which], self.start[1][which]
        inverse = inverted(bordered(np.einsum("bk,bkij->bij", weights, bends), slopes[:, :-1]))
        jacobian = bordered(np.einsum("bk,bkij->bij", weights, h), rows)
        apart = np.einsum("bk,bkij->bij", abs(weights), h_rad)
        apart += np.einsum("bk,bkij->bij", 2 * spread, abs(h[:, :-1]) + h_rad[:, :-1])
        wide = abs(bordered(apart, rows_rad))
        residual = np.einsum("bk,bki->bi", weights, slopes)
        residual = np.concatenate([residual, self.values[which]], axis=1)
        shrink = abs(np.eye(rho.shape[1]) - inverse @ jacobian) + abs(inverse) @ wide
        image = abs(np.einsum("bij,bj->bi", inverse, residual))
        image += np.einsum("bij,bj->bi", shrink, rho)
        with np.errstate(invalid="ignore"):
            fit = (spread >= 0).all(axis=1) & (lam[:, :k] > spread[:, :k]).all(axis=1)
            sure[fine] = fit & (image < SURE * rho).all(axis=1)
        images[fine] = np.where(fit[:, None], image[:, :n], np.nan)
        return images, sure
