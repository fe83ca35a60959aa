"""Walks along edges in workers: what is sent, and what comes back.

Points travel as coordinates with the functions that are held there; values, gradients and frames
are computed again at the other end.
"""

from dataclasses import dataclass

from polycorner.skeletons.points import HeldPoint, Quotient
from polycorner.skeletons.singularities import SingularPoint
from polycorner.skeletons.vertex_figures import Ray
from polycorner.skeletons.walks import End, Walk, follow
from polycorner.spaces.manifold import Array
from polycorner.workers import Shared


@dataclass(frozen=True, eq=False)
class Beginning:
    """The beginning of an edge: a point on it, the direction, and the functions that vanish."""

    q: Array
    kept: list[int]
    direction: Array
    active: frozenset[int]

    @classmethod
    def of(cls, ray: Ray) -> "Beginning":
        """Return that of a ray."""
        return cls(ray.sample.q, ray.sample.kept, ray.direction, ray.active)


@dataclass(frozen=True, eq=False)
class Report:
    """A walk without the values at its end; see :class:`~polycorner.skeletons.walks.Walk`."""

    points: Array
    kept: list[int]
    singular: bool
    tangent: Array
    end: End
    length: float

    def walk(self, quotient: Quotient) -> Walk:
        """Return the walk."""
        kind = SingularPoint if self.singular else HeldPoint
        last = kind(quotient, self.points[-1], self.kept)
        return Walk(self.points, last, self.tangent, self.end, self.length)


def walked(quotient: Shared, beginning: Beginning) -> Report:
    """Walk along an edge to its end."""
    start = HeldPoint(quotient.value, beginning.q, beginning.kept)
    walk = follow(start, beginning.direction, passive=beginning.active)
    singular = isinstance(walk.last, SingularPoint)
    return Report(walk.points, walk.last.kept, singular, walk.tangent, walk.end, walk.length)
