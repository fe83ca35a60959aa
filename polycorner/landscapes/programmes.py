"""Linear programmes on a box in exact numbers, by the dual simplex method in integers.

It starts from the corner of the box where the energy is least, and ends with multipliers that are
exactly dual feasible and a point that is exactly feasible, or with a function that is negative
wherever those that hold are not ([Edmonds], [Bland]).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np

from polycorner.spaces.manifold import Array

Point = tuple[Fraction, ...]


@dataclass(frozen=True, eq=False)
class Dictionary:
    """Affine functions of ``n`` slacks, at least zero each, and the point where these vanish.

    Attributes
    ----------
    table : (k, n + 1) array of int
        Values, and derivatives by the slacks, times ``scale``; functions first, the energy and
        the coordinates last.  The energy's derivatives are not negative.
    scale : int
        Positive.
    slacks : tuple of int
        The functions that are the slacks.
    held : tuple of int
        The functions that are at least zero, increasing.
    """

    table: Array
    scale: int
    slacks: tuple[int, ...]
    held: tuple[int, ...]

    def pivoted(self, row: int, column: int) -> "Dictionary":
        """Return the dictionary in which a function takes the place of a slack ([Edmonds])."""
        table, pivot = self.table, self.table[row, column]
        found = (table * pivot - np.outer(table[:, column], table[row])) // self.scale
        found[:, column] = table[:, column]
        slacks = list(self.slacks)
        slacks[column - 1] = row
        return Dictionary(found, pivot, tuple(slacks), self.held)

    def holding(self, some: Iterable[int]) -> "Dictionary | None":
        """Return that of the least energy where further functions hold; None if nowhere.

        The function and the slack that change places are the first ones, by their numbers, so
        that no dictionary returns ([Bland]).
        """
        held = tuple(sorted({*self.held, *some}))
        one = Dictionary(self.table, self.scale, self.slacks, held)
        energy = -1 - len(self.slacks)
        while (row := next((r for r in held if one.table[r, 0] < 0), None)) is not None:
            slopes, costs = one.table[row, 1:], one.table[energy, 1:]
            rising = [
                (Fraction(costs[k], slopes[k]), s, k + 1)
                for k, s in enumerate(one.slacks)
                if slopes[k] > 0
            ]
            if not rising:
                return None
            one = one.pivoted(row, min(rising)[2])
        return one


class ExactProgrammes:
    """Linear programmes on a box, in exact numbers.

    ``rows`` ``(k, n + 1)`` and ``energy`` ``(n + 1,)`` are values at zero and derivatives; the box
    is ``(n, 2)``.
    """

    def __init__(self, rows: Array, energy: Array, box: Array) -> None:
        n = len(box)
        self.rows, self.energy, self.box = rows, energy, box
        upwards = np.array([slope >= 0 for slope in energy[1:]], dtype=bool)
        signs = np.where(upwards, 1, -1).astype(object)
        corner = np.where(upwards, box[:, 0], box[:, 1])
        coordinates = np.hstack([np.zeros((n, 1), dtype=object), np.eye(n, dtype=object)])
        low, high = coordinates.copy(), -coordinates
        low[:, 0], high[:, 0] = -box[:, 0], box[:, 1]
        sides = np.where(upwards[:, None], low, high), np.where(upwards[:, None], high, low)
        self.all = np.vstack([rows, *sides])
        at = np.vstack([self.all, energy, coordinates])
        at = np.hstack([(at[:, :1] + at[:, 1:] @ corner[:, None]), at[:, 1:] * signs])
        self._sizes = [lcm(*(Fraction(x).denominator for x in row)) for row in at]
        table = np.array(
            [[int(x * s) for x in row] for row, s in zip(at, self._sizes, strict=True)],
            dtype=object,
        )
        k = len(rows)
        self.start = Dictionary(table, 1, tuple(range(k, k + n)), tuple(range(k, k + 2 * n)))

    def value(self, one: Dictionary) -> Fraction:
        """Return the least energy."""
        return self._entry(one, len(self.all))

    def point(self, one: Dictionary) -> Point:
        """Return a point at which it is taken."""
        return tuple(self._entry(one, len(self.all) + 1 + k) for k in range(len(self.box)))

    def height(self, point: Point) -> Fraction:
        """Return the energy of a point."""
        return Fraction(self.energy @ np.array([Fraction(1), *point], dtype=object))

    def _entry(self, one: Dictionary, row: int) -> Fraction:
        return Fraction(one.table[row, 0], one.scale * self._sizes[row])

    def isolated(self, one: Dictionary) -> bool:
        """Whether the least energy is taken at one point only."""
        costs = one.table[len(self.all), 1:]
        free = [s for s, cost in zip(one.slacks, costs, strict=True) if cost == 0]
        if not free:
            return True
        level = -self.energy
        level[0] += self.value(one)
        some = ExactProgrammes(np.vstack([self.rows, level]), -self.all[free].sum(axis=0), self.box)
        k = len(self.rows)
        found = some.start.holding([*(r for r in one.held if r < k), k])
        assert found is not None  # the point itself
        return some.value(found) == 0
