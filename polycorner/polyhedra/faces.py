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
from enum import Enum
from functools import partial

import numpy as np

from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import evaluated
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, Tolerances
from polycorner.values import Value

STEPS = 50


class End(Enum):
    """How a way to a face ended; the value is a sentence."""

    SETTLED = "the last step was rounding, or its square is"
    UNSETTLED = "the steps did not become short"
    FAR = "the steps led farther away than was allowed"
    NOT_FINITE = "a value or a derivative was not finite"


@dataclass(frozen=True, eq=False)
class Arrival(Value):
    """Where the way to a face ended.

    Attributes
    ----------
    point : (n,) array
        The last point at which the functions were evaluated or to which a step led.
    first, last : float
        Lengths of the first and the last step, in scale units.
    end : End
    gradients : (k, n) array
        Scaled gradients of the functions that are held, where the last step began.
    """

    point: Array
    first: float
    last: float
    end: End
    gradients: Array

    @property
    def settled(self) -> bool:
        """Whether the functions vanish there."""
        return self.end is End.SETTLED


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
        cut: float | None = None,
        reach: float = math.inf,
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
        cut : float, optional
            Singular values of the derivative, relative to the largest, along which no step is
            taken; by default ``tolerances.rank``.
        reach : float, optional
            Longest way, in scale units.
        stride : float, optional
            Longest step; longer ones are shortened.
        steps : int, optional
            The most steps.
        """
        rows, cut = list(self.held), self.tolerances.rank if cut is None else cut
        first, last, way = math.inf, math.inf, 0.0
        gradients = np.zeros((len(rows), len(q)))
        for k in range(steps):
            values, every = self.evaluate(q)[:2]
            missed, gradients = values[rows], every[rows]
            if not (np.isfinite(missed).all() and np.isfinite(gradients).all()):
                return Arrival(q, first, last, End.NOT_FINITE, gradients)
            matrix = gradients if along is None else gradients @ along
            d = np.linalg.lstsq(matrix, -missed, rcond=cut)[0]
            d = d if along is None else along @ d
            size, before = math.sqrt(float(d @ d)), last
            share = min(1.0, stride / size) if size else 1.0
            q, last, way = q + self.scales * (share * d), size, way + share * size
            first = size if k == 0 else first
            if way > reach:
                return Arrival(q, first, last, End.FAR, gradients)
            if self._is_last(q, size, before):
                return Arrival(q, first, last, End.SETTLED, gradients)
        return Arrival(q, first, last, End.UNSETTLED, gradients)

    def _is_last(self, q: Array, size: float, before: float) -> bool:
        """Whether a step was rounding, or no longer half as long as the one before."""
        rounding = self.tolerances.rounding * (1.0 + float(abs(q / self.scales).max(initial=0.0)))
        return size <= rounding or (size < self.tolerances.settled and size > before / 2)
