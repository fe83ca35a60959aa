"""Many functions of few coordinates each: values, sparse Jacobians and sparse Hessians."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from polycorner.formulas.bundles import resolve
from polycorner.spaces.manifold import Array
from polycorner.values import Value

if TYPE_CHECKING:
    from polycorner.formulas.functions import SmoothFunction

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Group(Value):
    """Functions of one family: one kernel evaluated in one call for all of them.

    Attributes
    ----------
    family : Family or Shape
        What has the kernel.
    column : int
        Which of the kernel's outputs the functions are.
    rows : (m,) array of int
        Their positions among all rows.
    reads : (m, k) array of int
        The coordinates that each of them reads.
    parameters : (m, p) array
        Their parameters.
    """

    family: Any
    column: int
    rows: Indices
    reads: Indices
    parameters: Array

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values ``(m,)``, derivatives ``(m, k)`` and second derivatives ``(m, k, k)``."""
        parameters = np.ascontiguousarray(self.parameters)
        if not parameters.size:
            parameters = np.zeros((1, 1))
        parts = self.family.kernel.over(
            q[self.reads], parameters.ctypes.data, order, len(parameters)
        )
        return tuple([part[:, self.column] for part in parts])

    def part(self, chosen: Indices) -> "Group":
        """Return some of the functions, given by their positions in the group."""
        return replace(
            self,
            rows=self.rows[chosen],
            reads=self.reads[chosen],
            parameters=self.parameters[chosen],
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
    def of(cls, functions: "Sequence[SmoothFunction]", dimension: int) -> "SparseRows":
        """Return the rows of functions, one after the other."""
        found: dict[Any, tuple[Any, int, list[Any]]] = {}
        for row, f in enumerate(functions):
            family, reads, parameters, column = resolve(f)
            key = (family.key or id(family), column, len(reads))
            members = found.setdefault(key, (family, column, []))[2]
            members.append((row, reads, parameters))
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
            columns.append(group.reads.ravel())
        return values, _assembled(entries, rows, columns, (self.count, self.dimension))

    def curvature(self, q: Array, weights: Array) -> csr_array:
        """Return ``sum w_i H_i``, ``(n, n)``, for weights ``(m,)`` of the functions."""
        entries, rows, columns = [], [], []
        for group in self.groups:
            used = group.part(np.flatnonzero(weights[group.rows]))
            if not len(used.rows):
                continue
            bent = used.evaluate(q, 2)[2] * weights[used.rows][:, None, None]
            k = used.reads.shape[1]
            entries.append(bent.ravel())
            rows.append(np.repeat(used.reads, k, axis=1).ravel())
            columns.append(np.tile(used.reads, (1, k)).ravel())
        return _assembled(entries, rows, columns, (self.dimension, self.dimension))


def _group(family: Any, column: int, members: list[Any]) -> Group:
    rows, reads, parameters = zip(*members, strict=True)
    k, p = len(reads[0]), len(parameters[0])
    return Group(
        family,
        column,
        np.array(rows, dtype=np.int64),
        np.array(reads, dtype=np.int64).reshape(len(rows), k),
        np.array(parameters, dtype=np.float64).reshape(len(rows), p),
    )


def _assembled(
    entries: list[Array], rows: list[Indices], columns: list[Indices], shape: tuple[int, int]
) -> csr_array:
    if not entries:
        return csr_array(shape)
    places = np.concatenate(rows), np.concatenate(columns)
    matrix = csr_array((np.concatenate(entries), places), shape=shape)
    matrix.sum_duplicates()
    return matrix
