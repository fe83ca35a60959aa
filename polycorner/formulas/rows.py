"""Many functions of few coordinates each: values, sparse Jacobians and sparse Hessians."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from polycorner.formulas.bundles import BoundFunction, resolve
from polycorner.spaces.manifold import Array
from polycorner.values import Value

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Group(Value):
    """Functions of one family: one kernel evaluated in one call for all of them.

    Attributes
    ----------
    family : Family or Shape
        What has the kernel.
    rows : (m,) array of int
        Positions of the functions among all rows.
    columns : (m,) array of int
        Which of the kernel's outputs each function is.
    places : (m,) array of int
        Which of the ``c`` choices of coordinates and parameters each function has.
    reads : (c, k) array of int
        The coordinates that are read.
    parameters : (c, p) array
    """

    family: Any
    rows: Indices
    columns: Indices
    places: Indices
    reads: Indices
    parameters: Array

    @classmethod
    def separate(cls, family: Any, reads: Indices, parameters: Array) -> "Group":
        """Return the group of functions that are the first output each, in the order of rows."""
        order = np.arange(len(reads))
        return cls(family, order, np.zeros_like(order), order, reads, parameters)

    @property
    def read(self) -> Indices:
        """The coordinates that each function reads, ``(m, k)``."""
        return self.reads[self.places]

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values ``(m,)``, derivatives ``(m, k)`` and second derivatives ``(m, k, k)``."""
        parameters = np.ascontiguousarray(self.parameters)
        if not parameters.size:
            parameters = np.zeros((1, 1))
        parts = self.family.kernel.over(
            q[self.reads], parameters.ctypes.data, order, len(parameters)
        )
        return tuple([part[self.places, self.columns] for part in parts])

    def part(self, chosen: Indices) -> "Group":
        """Return some of the functions, given by their positions in the group."""
        used, places = np.unique(self.places[chosen], return_inverse=True)
        return Group(
            self.family,
            self.rows[chosen],
            self.columns[chosen],
            places,
            self.reads[used],
            self.parameters[used],
        )


@dataclass(frozen=True, eq=False)
class SparseRows(Value):
    """``m`` functions of ``n`` coordinates, each of a few of them only.

    Attributes
    ----------
    groups : tuple of Group
        The functions, grouped by kernels.
    count, dimension : int
        ``m`` and ``n``.
    """

    groups: tuple[Group, ...]
    count: int
    dimension: int

    @classmethod
    def of(cls, functions: Sequence[BoundFunction], dimension: int) -> "SparseRows":
        """Return the rows of functions, one after the other."""
        found: dict[Any, tuple[Any, list[Any]]] = {}
        for row, f in enumerate(functions):
            family, reads, parameters, column = resolve(f)
            key = (family.key or id(family), len(reads))
            found.setdefault(key, (family, []))[1].append((row, column, (reads, parameters)))
        groups = tuple([_group(*parts) for parts in found.values()])
        return cls(groups, len(functions), dimension)

    def chosen(self, positions: Indices) -> "SparseRows":
        """Return some of the rows, numbered anew in their order."""
        place = np.full(self.count, -1)
        place[positions] = np.arange(len(positions))
        groups = []
        for group in self.groups:
            part = group.part(np.flatnonzero(place[group.rows] >= 0))
            if len(part.rows):
                groups.append(replace(part, rows=place[part.rows]))
        return SparseRows(tuple(groups), len(positions), self.dimension)

    @property
    def entries(self) -> int:
        """The number of entries of the Jacobian that may differ from zero."""
        return sum(len(group.rows) * group.reads.shape[1] for group in self.groups)

    @property
    def used(self) -> Mask:
        """The mask ``(n,)`` of the coordinates that any row reads."""
        used = np.zeros(self.dimension, dtype=np.bool_)
        for group in self.groups:
            used[group.reads.ravel()] = True
        return used

    def values(self, q: Array) -> Array:
        """Return the values ``(m,)``."""
        values = np.zeros(self.count)
        for group in self.groups:
            values[group.rows] = group.evaluate(q, 0)[0]
        return values

    def evaluate(self, q: Array) -> tuple[Array, csr_array]:
        """Return the values ``(m,)`` and the Jacobian ``(m, n)``."""
        values = np.zeros(self.count)
        entries, rows, columns = [], [], []
        for group in self.groups:
            value, slope = group.evaluate(q, 1)
            values[group.rows] = value
            entries.append(slope.ravel())
            rows.append(np.repeat(group.rows, group.reads.shape[1]))
            columns.append(group.read.ravel())
        return values, _assembled(entries, rows, columns, (self.count, self.dimension))

    def curvature(self, q: Array, weights: Array, *, convex: bool = False) -> csr_array:
        """Return ``sum w_i H_i``, ``(n, n)``, for weights ``(m,)`` of the functions.

        ``convex`` replaces every ``w_i H_i`` by the nearest matrix without negative eigenvalues,
        and the sum then has none.
        """
        entries, rows, columns = [], [], []
        for group in self.groups:
            used = group.part(np.flatnonzero(weights[group.rows]))
            if not len(used.rows):
                continue
            bent = used.evaluate(q, 2)[2] * weights[used.rows][:, None, None]
            bent = _convex(bent) if convex else bent
            read, k = used.read, used.reads.shape[1]
            entries.append(bent.ravel())
            rows.append(np.repeat(read, k, axis=1).ravel())
            columns.append(np.tile(read, (1, k)).ravel())
        return _assembled(entries, rows, columns, (self.dimension, self.dimension))


def _group(family: Any, members: list[Any]) -> Group:
    rows, columns, bound = zip(*members, strict=True)
    number = {some: c for c, some in enumerate(dict.fromkeys(bound))}
    reads, parameters = zip(*number, strict=True)
    return Group(
        family,
        np.array(rows, dtype=np.int64),
        np.array(columns, dtype=np.int64),
        np.array([number[some] for some in bound], dtype=np.int64),
        np.array(reads, dtype=np.int64).reshape(len(number), -1),
        np.array(parameters, dtype=np.float64).reshape(len(number), -1),
    )


def _convex(matrices: Array) -> Array:
    """Return symmetric matrices ``(m, k, k)`` without their negative eigenvalues."""
    if not np.isfinite(matrices).all() or not matrices.any():
        return matrices
    values, vectors = np.linalg.eigh(matrices)
    kept = vectors * np.maximum(values, 0.0)[:, None, :]
    return np.asarray(kept @ np.swapaxes(vectors, 1, 2))


def _assembled(
    entries: list[Array], rows: list[Indices], columns: list[Indices], shape: tuple[int, int]
) -> csr_array:
    if not entries:
        return csr_array(shape)
    places = np.concatenate(rows), np.concatenate(columns)
    matrix = csr_array((np.concatenate(entries), places), shape=shape)
    matrix.sum_duplicates()
    return matrix
