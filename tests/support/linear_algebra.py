"""Linear algebra that rounds differently: what another processor or LAPACK may return."""

import numpy as np

EPSILON = np.finfo(np.float64).eps


class Disturbed:
    """Factorisations of NumPy with other signs, other null bases and other last bits.

    Every result is one that a backward stable implementation may return for the same matrix.
    """

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.svd_, self.qr_, self.eigh_ = np.linalg.svd, np.linalg.qr, np.linalg.eigh
        self.solve_, self.inv_, self.det_ = np.linalg.solve, np.linalg.inv, np.linalg.det

    def install(self, monkeypatch):
        """Put the disturbed functions in place of NumPy's."""
        for name in ("svd", "qr", "eigh", "solve", "inv", "det"):
            monkeypatch.setattr(np.linalg, name, getattr(self, name))
        return self

    def noisy(self, array):
        size = abs(array).max(initial=0.0)
        return array + 2 * EPSILON * size * self.rng.standard_normal(np.shape(array))

    def signs(self, count):
        return self.rng.choice([-1.0, 1.0], count)

    def turned(self, rows):
        """Return another orthonormal basis of the space that some rows span."""
        if not len(rows):
            return rows
        return self.qr_(self.rng.standard_normal((len(rows), len(rows))))[0] @ rows

    def svd(self, matrix, *_, **options):
        if options or np.ndim(matrix) != 2:
            return self.svd_(matrix, *_, **options)
        left, singular, right = self.svd_(self.noisy(matrix))
        k = len(singular)
        signs = self.signs(k)
        left[:, :k] *= signs
        right[:k] *= signs[:, None]
        right[k:] = self.turned(right[k:])
        left[:, k:] = self.turned(left[:, k:].T).T
        return left, singular, right

    def qr(self, matrix, **options):
        q, r = self.qr_(self.noisy(matrix), **options)
        signs = self.signs(q.shape[-1])
        return q * signs, r * signs[:, None]

    def eigh(self, matrix):
        values, axes = self.eigh_(self.noisy(matrix))
        return values, axes * self.signs(axes.shape[-1])

    def solve(self, matrix, right):
        return self.noisy(self.solve_(matrix, right))

    def inv(self, matrix):
        return self.noisy(self.inv_(matrix))

    def det(self, matrix):
        return self.det_(self.noisy(matrix))
