"""Linear algebra that rounds differently: what another processor or LAPACK may return.

A backward stable implementation returns the exact result for a matrix that differs in its last
bits, up to last bits of the result; signs and null bases that the definition leaves open are its
own.  Here all these are drawn from a table, at a place that the bits of the arguments and a seed
determine: equal arguments give equal results, in every thread and process, as they do on a real
processor.  Entries that are zero stay zero.
"""

import math
import zlib
from functools import wraps

import numpy as np

EPSILON = np.finfo(np.float64).eps
TABLE = 1 << 14
ARGUMENTS = ("matrix_rank", "slogdet", "eigvalsh", "eigvals", "det", "cond")  # results follow
BOTH = ("solve", "inv", "pinv", "lstsq", "cholesky", "eig")
RESULTS = ("norm",)
SCIPY = ("null_space", "orth", "solve", "lstsq", "svd", "qr", "eigh", "cholesky", "norm")
LAPACK = ("dgeqrf", "dorgqr", "dormqr", "dtrtrs")


class Disturbed:
    """Functions of ``numpy.linalg``, ``scipy.linalg`` and LAPACK with other last bits.

    Parameters
    ----------
    seed : int
        Which other processor it is.
    """

    def __init__(self, seed):
        self.seed = seed
        self.table = np.clip(np.random.default_rng(seed).standard_normal(TABLE), -3, 3)
        self.orthonormal = np.linalg.qr

    @classmethod
    def install_once(cls, seed):
        """Disturb the whole of a process, which its parent may have asked for already."""
        if not hasattr(np.linalg, "disturbed"):
            np.linalg.disturbed = cls(seed).install()

    def install(self, put=setattr):
        """Put the disturbed functions in place of those of NumPy and SciPy."""
        import scipy.linalg
        from scipy.linalg import lapack

        plans = [
            (np.linalg, ("svd",), self.svd),
            (np.linalg, ("qr",), self.qr),
            (np.linalg, ("eigh",), self.eigh),
            (np.linalg, ARGUMENTS, self.of_noisy),
            (np.linalg, BOTH, lambda function: self.noisily(self.of_noisy(function))),
            (np.linalg, RESULTS, self.noisily),
            (scipy.linalg, SCIPY, self.noisily),
            (lapack, LAPACK, self.noisily),
        ]
        for module, names, disturb in plans:
            for name in names:
                put(module, name, disturb(getattr(module, name)))
        return self

    def draw(self, shape, array, turn=0):
        """Return random numbers that the bits of an array determine."""
        place = zlib.crc32(array.tobytes(), self.seed + turn) % (TABLE // 2)
        size = math.prod(shape)
        if size <= TABLE // 2:
            return self.table[place : place + size].reshape(shape)
        return self.table.take(np.arange(place, place + size), mode="wrap").reshape(shape)

    def noisy(self, found):
        """Return numbers whose last bits are others: arrays, floats, or tuples of such."""
        if isinstance(found, tuple):
            parts = [self.noisy(part) for part in found]
            return type(found)(*parts) if hasattr(found, "_fields") else tuple(parts)
        if isinstance(found, float):
            return type(found)(self.noisy(np.array([found]))[0])
        if isinstance(found, np.ndarray) and found.dtype.kind == "f" and found.size:
            return found * (1 + 2 * EPSILON * self.draw(found.shape, found))
        return found

    def noisily(self, function):
        """Return a function with noisy results."""
        return wraps(function)(lambda *given, **options: self.noisy(function(*given, **options)))

    def of_noisy(self, function):
        """Return a function of a matrix that is noisy."""

        @wraps(function)
        def disturbed(matrix, *others, **options):
            return function(self.matrix(matrix), *others, **options)

        return disturbed

    def matrix(self, given):
        array = np.asarray(given)
        return self.noisy(array.astype(float) if array.dtype.kind in "iu" else array)

    def signs(self, array):
        """Return signs, one for each column of an array."""
        return np.where(self.draw((array.shape[-1],), array, 1) < 0, -1.0, 1.0)

    def turned(self, rows):
        """Return another orthonormal basis of the space that some rows span."""
        k = len(rows)
        return self.orthonormal(self.draw((k, k), rows, 2))[0] @ rows if k else rows

    def svd(self, function):
        @wraps(function)
        def disturbed(matrix, full_matrices=True, compute_uv=True):
            matrix = self.matrix(matrix)
            found = function(matrix, full_matrices, compute_uv)
            if not compute_uv or not matrix.size:
                return found
            left, singular, right = map(np.copy, found)
            k = singular.shape[-1]
            signs = self.signs(left[..., :k])
            left[..., :k] *= signs
            right[..., :k, :] *= signs[:, None]
            if matrix.ndim == 2:
                right[k:] = self.turned(right[k:])
                left[:, k:] = self.turned(left[:, k:].T).T
            return type(found)(left, singular, right)

        return disturbed

    def qr(self, function):
        @wraps(function)
        def disturbed(matrix, mode="reduced"):
            found = function(self.matrix(matrix), mode)
            signs = self.signs(found[0])
            return type(found)(found[0] * signs, found[1] * signs[:, None])

        return disturbed

    def eigh(self, function):
        @wraps(function)
        def disturbed(matrix, *others):
            found = function(self.matrix(matrix), *others)
            return type(found)(found[0], found[1] * self.signs(found[1]))

        return disturbed
