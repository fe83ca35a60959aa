"""Coordinates that rattle: nothing that holds a minimum reads them, and they have room.

Where the energy and the functions that support a minimum do not read some coordinates, these may
have any value at which the functions that do read them are positive: the point stays a minimum.
Circles that rattle in a packing are the example.
"""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from scipy.optimize import linprog

from polycorner.intervals.balls import Ball, ball, exact, middles
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import Box
from polycorner.minimisation import Problem
from polycorner.spaces.manifold import Array

Room = dict[int, Fraction]
REACH = 0.1  # of the first of these steps, in scale units
STEPS = 40  # of linear programmes towards the middle of the room
FIRST = 8  # the part of the least distance to a function with which room begins
DOUBLINGS, BISECTIONS = 6, 5  # of the room as it grows
SHARE = Fraction(15, 16)  # of the room; functions stay positive where other coordinates move


def reads(formulas: Formulas, row: int) -> frozenset[int]:
    """Return the coordinates that a function depends on."""
    graph = formulas.graph
    nodes = (graph.nodes[a] for a in graph.needed([formulas.outputs[row]]))
    return frozenset(int(args[0]) for op, args in nodes if op == "var")


class Rattlers:
    """Coordinates that rattle, and the functions that read them.

    Neither the energy nor equations nor functions that support read these coordinates.
    """

    def __init__(self, problem: Problem, formulas: Formulas, coordinates: Sequence[int]) -> None:
        self.problem, self.formulas = problem, formulas
        self.coordinates = list(coordinates)
        self._read = [reads(formulas, i) for i in range(problem.inequalities)]
        self.rows = self._reading(self.coordinates)

    def _reading(self, some: Sequence[int]) -> list[int]:
        return [i for i, row in enumerate(self._read) if not row.isdisjoint(some)]

    def _distances(self, q: Array) -> tuple[Array, Array]:
        """Return distances to the zeros of the functions along these coordinates, and normals."""
        values, gradients = self.problem.evaluate(q, 1)
        scales = self.problem.scales[self.coordinates]
        table = gradients[self.rows][:, self.coordinates] * scales
        sizes = np.linalg.norm(table, axis=1)
        steep = sizes > 0  # others, at their maximum here, stand in no way
        return values[self.rows][steep] / sizes[steep], table[steep] / sizes[steep, None]

    def _middle(self, q: Array) -> Array:
        """Return a point at which the functions are as large as can be found."""
        best, places, reach = np.array(q), self.coordinates, REACH
        cost = np.append(np.zeros(len(places)), -1.0)
        for _ in range(STEPS if self.rows else 0):
            distances, normals = self._distances(best)
            if not len(distances):
                break
            found = linprog(
                cost, np.hstack([-normals, np.ones((len(normals), 1))]), distances,
                bounds=[(-reach, reach)] * len(places) + [(None, None)],
            )  # fmt: skip
            if found.x is None:
                break
            trial = best.copy()
            trial[places] += found.x[:-1] * self.problem.scales[places]
            if self._distances(trial)[0].min(initial=np.inf) > distances.min():
                best = trial
            else:
                reach /= 4
            if reach < REACH / 1000:
                break
        return best

    def placed(self, hull: "Sequence[Ball]") -> tuple[tuple[Fraction, ...], Room | None]:
        """Return a centre and half sides of the room, in scale units, or None where none is shown.

        All sides grow alike first, then one after the other, while the functions that read these
        coordinates are positive.  Of all coordinates in ``hull`` the others are enclosed; those
        that rattle are where they are.
        """
        q = self._middle(middles(hull))
        centre = [exact(x.mid()) for x in hull]
        for j in self.coordinates:
            centre[j] = Fraction(q[j])
        least = min(self._distances(q)[0].min(initial=np.inf), 1.0) / FIRST
        sides = dict.fromkeys(self.coordinates, Fraction(least))

        def free(factor: Fraction, places: Sequence[int], some: Sequence[int]) -> bool:
            wide, scales = list(hull), self.problem.scales.tolist()
            for j, side in (sides | {j: factor * sides[j] for j in places}).items():
                wide[j] = ball(centre[j]) + ball(0, 1) * ball(side) * ball(scales[j])
            return all(value > 0 for value in self.formulas.values(Box(wide), some))

        for _ in range(DOUBLINGS):
            if free(Fraction(1), self.coordinates, self.rows):
                break
            sides = {j: side / 2 for j, side in sides.items()}
        else:
            return tuple(centre), None
        for places in (self.coordinates, *([j] for j in self.coordinates)):
            some, factor = self._reading(places), Fraction(1)
            for _ in range(DOUBLINGS):
                if not (some and free(2 * factor, places, some)):
                    break
                factor *= 2
            step = factor
            for _ in range(BISECTIONS):
                step /= 2
                factor += step if some and free(factor + step, places, some) else 0
            sides |= {j: factor * sides[j] for j in places}
        return tuple(centre), {j: side * SHARE for j, side in sides.items()}
