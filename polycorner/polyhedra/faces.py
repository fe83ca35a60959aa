"""Faces: the points where some functions vanish, and the way to them from points nearby.

In scaled coordinates ``u = q / scales`` let ``f`` be the functions that are held and ``A`` their
derivative.  The shortest step to the zeros of the linearised functions is ``d = -A^+ f`` (Gauss
and Newton).  Where the gradients are independent at the solution the steps converge to it
quadratically ([NW] sec. 10.3), so that a step below the square root of the rounding error is
the last; where they are dependent convergence is linear, and directions along which ``A`` is small
are cut off.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import evaluated
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, Tolerances
from polycorner.values import Value

STEPS = 50


class Arrival(NamedTuple):
    """Where the way to a face ended: a point, and whether the last step was rounding there."""

    point: Array
    settled: bool


@dataclass(frozen=True, eq=False)
class Face(Value):
    """The common zeros of some functions.

    Attributes
    ----------
    evaluate : callable
        Returns the values ``(m,)`` and the scaled gradients ``(m, n)`` of all functions at a point.
    scales : (n,) array
        The scales of the coordinates.
    held : sequence of int
        The functions that vanish.
    tolerances : Tolerances
    """

    evaluate: Callable[[Array], Sequence[Array]]
    scales: Array
    held: Sequence[int]
    tolerances: Tolerances = DEFAULT

    @classmethod
    def of(
        cls, polyhedron: Polyhedron, held: Sequence[int], tolerances: Tolerances = DEFAULT
    ) -> "Face":
        """Return a face of a polyhedron, whose equations are counted after its inequalities."""
        scales = polyhedron.manifold.scale_array
        return cls(partial(evaluated, polyhedron), scales, held, tolerances)

    def project(
        self,
        q: Array,
        *,
        along: Array | None = None,
        stride: float = math.inf,
        steps: int = STEPS,
    ) -> Arrival:
        """Move a point onto the face by the shortest steps.

        Parameters
        ----------
        q : (n,) array
            A point nearby.
        along : (n, r) array, optional
            Scaled directions that the steps are combined of; by default all.
        stride : float, optional
            Longest step, in scale units; longer ones are shortened.
        steps : int, optional
            The most steps.

        Returns
        -------
        Arrival
            Not settled at the last point where a value or a derivative is not finite, and after
            the last step.
        """
        rows, last = list(self.held), math.inf
        for _ in range(steps):
            values, gradients = (part[rows] for part in self.evaluate(q)[:2])
            if not (np.isfinite(values).all() and np.isfinite(gradients).all()):
                break
            matrix = gradients if along is None else gradients @ along
            d = np.linalg.lstsq(matrix, -values, rcond=self.tolerances.rank)[0]
            d = d if along is None else along @ d
            size = math.sqrt(float(d @ d))
            q = q + self.scales * (d * min(1.0, stride / size) if size else d)
            if self._is_last(q, size, last):
                return Arrival(q, settled=True)
            last = size
        return Arrival(q, settled=False)

    def _is_last(self, q: Array, size: float, before: float) -> bool:
        """Whether a step was rounding, or no longer half as long as the one before."""
        rounding = self.tolerances.rounding * (1.0 + float(abs(q / self.scales).max(initial=0.0)))
        return size <= rounding or (size < self.tolerances.settled and size > before / 2)
