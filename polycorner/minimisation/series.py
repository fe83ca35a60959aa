"""Truncated power series in a few variables.

A series is an array ``(2, K)``: its coefficients, by increasing degree, and bounds of their
rounding errors in units of the machine's precision, propagated to first order: for a product
``|a| e_b + e_a |b| + |a| |b|``, for a function ``|f'(a)| e_a + |f(a)|`` ([GW] ch. 13 for the
arithmetic, [Higham] sec. 3.3 for running error bounds).
"""

from functools import lru_cache
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

EPSILON = float(np.finfo(np.float64).eps)


class Ring:
    """Power series in ``variables`` variables, truncated beyond total degree ``order``.

    Attributes
    ----------
    exponents : (K, variables) array of int
        Exponents of the monomials, by increasing degree; ``degrees`` are their sums.
    """

    def __init__(self, variables: int, order: int) -> None:
        self.variables, self.order = variables, order
        rows = [
            [chosen.count(i) for i in range(variables)]
            for degree in range(order + 1)
            for chosen in combinations_with_replacement(range(variables), degree)
        ]
        self.exponents = np.array(rows, dtype=np.int64).reshape(len(rows), variables)
        self.degrees: NDArray[np.int64] = self.exponents.sum(axis=1)
        self.index = {tuple(row): k for k, row in enumerate(rows)}
        ends = np.searchsorted(self.degrees, np.arange(order + 2)).tolist()
        triples = sorted(
            (self.index[tuple(self.exponents[i] + self.exponents[j])], i, j)
            for i, degree in enumerate(self.degrees.tolist())
            for j in range(ends[order - degree + 1])
        )
        to, self._left, self._right = (np.array(column) for column in zip(*triples, strict=True))
        self._starts = np.flatnonzero(np.diff(to, prepend=-1))

    @property
    def size(self) -> int:
        """The number of coefficients."""
        return len(self.degrees)

    def constant(self, value: float) -> Array:
        """Return a constant series, exact."""
        series = np.zeros((2, self.size))
        series[0, 0] = value
        return series

    def variable(self, i: int) -> Array:
        """Return the series of variable number ``i``."""
        series = np.zeros((2, self.size))
        if self.order:
            series[0, 1 + i] = 1.0
        return series

    def mul(self, a: Array, b: Array) -> Array:
        """Return the product."""
        u, v = abs(a[0]), abs(b[0])
        parts = self._products(np.array([a[0], u, a[1]]), np.array([b[0], b[1] + v, v]))
        parts[1] += parts[2]
        return parts[:2]

    def _products(self, a: Array, b: Array) -> Array:
        """Return the products of coefficients ``(k, K)``, row by row."""
        parts = a.take(self._left, axis=1)
        parts *= b.take(self._right, axis=1)
        return np.asarray(np.add.reduceat(parts, self._starts, axis=1))

    def compose(self, taylor: Array, a: Array) -> Array:
        """Return ``f(a)`` for Taylor coefficients ``(order + 2,)`` of ``f`` at ``a``'s constant.

        Horner's scheme gives the value, its bound ``sum |c_k| |a|^k`` and ``sum k |c_k| |a|^k-1``.
        """
        powers = np.array([a[0], abs(a[0]), abs(a[0])])
        powers[:, 0] = 0.0
        sizes = abs(taylor)
        factors = np.array([taylor[:-1], sizes[:-1], sizes[1:] * np.arange(1, len(taylor))])
        result = np.zeros_like(powers)
        result[:, 0] = factors[:, -1]
        for c in factors[:, -2::-1].T:
            result = self._products(result, powers)
            result[:, 0] += c
        result[1] += self._products(result[2:], a[1:])[0]
        return result[:2]

    @cached_property
    def shifts(self) -> list[tuple[int, int, int, float]]:
        """Entries ``(to, from, variable, factor)`` of the partial derivatives."""
        return [
            (self.index[tuple(e - np.eye(self.variables, dtype=np.int64)[i])], k, i, float(e[i]))
            for k, e in enumerate(self.exponents)
            for i in range(self.variables)
            if e[i]
        ]

    def derivative(self, coefficients: Array, i: int) -> Array:
        """Return the coefficients of the partial derivative by variable ``i``."""
        result = np.zeros_like(coefficients)
        for to, source, variable, factor in self.shifts:
            if variable == i:
                result[to] += factor * coefficients[source]
        return result

    def shifted(self, coefficients: Array, move: Array) -> Array:
        """Return the coefficients of ``p(w + move)``, by Taylor's formula."""
        total, term = coefficients.copy(), coefficients
        for k in range(1, self.order + 1):
            term = sum(
                (step / k * self.derivative(term, i) for i, step in enumerate(move) if step),
                np.zeros_like(term),
            )
            total += term
        return total


@lru_cache(maxsize=64)
def ring(variables: int, order: int) -> Ring:
    """Return the ring of truncated series, from a cache."""
    return Ring(variables, order)
