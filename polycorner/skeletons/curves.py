"""Edges as curves with the rays at their ends, while a skeleton grows.

The end of an edge at a corner is named by two positions, those of the corner and of the ray.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner.checks import refuse
from polycorner.polyhedra.faces import projected
from polycorner.polyhedra.quotients import Quotient
from polycorner.polyhedra.symmetry import Relabelling
from polycorner.skeletons.walks import End, sign_change
from polycorner.spaces.manifold import Array
from polycorner.values import Value

EdgeEnd = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Curve(Value):
    """An edge while the skeleton grows, of at least two points.

    ``relabelled`` carries the names along the walk to the names at the corner ``stop``.
    """

    points: Array
    active: frozenset[int]
    kinds: tuple[End, End]
    start: EdgeEnd | None
    stop: EdgeEnd | None
    relabelled: Relabelling

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            refuse("points", "at least two points of an edge", len(self.points))
        super().__post_init__()

    @property
    def middle(self) -> Array:
        """The vertex half-way along."""
        return np.asarray(self.points[len(self.points) // 2])


def lies_on(quotient: Quotient, q: Array, curve: Curve) -> bool:
    """Whether a point lies on a curve: on the arc over a chord that is as near as it is long.

    The nearest vertex may belong to another part of the curve.
    """
    manifold = quotient.manifold
    apart = quotient.symmetry.separations(manifold, q, curve.points)
    near = np.minimum(apart[:-1], apart[1:])
    chords = np.linalg.norm(np.diff(curve.points, axis=0) / manifold.scale_array, axis=1)
    possible = [k for k in np.argsort(near) if near[k] <= chords[k]]
    return any(_on_arc(quotient, q, curve, int(k)) for k in possible)


def _on_arc(quotient: Quotient, q: Array, curve: Curve, k: int) -> bool:
    """Whether a point lies on the arc over chord ``k``: where the arc passes it."""
    same = quotient.tolerances.corner
    start, end = curve.points[k], curve.points[k + 1]
    q = quotient.manifold.image(q, start)
    kept = quotient.at(start).basis(curve.active)
    along = quotient.displacement(end, start)

    def passed(s: float) -> tuple[float, Array]:
        at = projected(quotient, start + s * (end - start), kept, np.inf)
        p = start if at is None else at.q
        return float(quotient.displacement(p, q) @ along), p

    if passed(0.0)[0] > 0 or passed(1.0)[0] < 0:
        return min(quotient.separation(q, p) for p in (start, end)) < same
    return quotient.separation(q, sign_change(passed)[1]) < same


# -------------------------------------------------------------------------------------------- flags

# An edge (its end at a corner, or its position) or an apex (its corner and sector), and the names
# of a face beside it.
Flag = tuple[str, Any, frozenset[str]]


@dataclass(frozen=True)
class FaceCrossing:
    """A straight way across a face, from one of its edges to another."""

    start: Flag
    stop: Flag
