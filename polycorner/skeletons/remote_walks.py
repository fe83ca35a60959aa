"""Walks along edges in workers: what comes back.

Points travel as coordinates with the functions that are held there; values, gradients and frames
are computed again at the other end.
"""

from dataclasses import dataclass

from polycorner.skeletons.dependence import follow_edge, held_at, is_dependent
from polycorner.skeletons.points import HeldPoint, Quotient
from polycorner.skeletons.vertex_figures import Ray
from polycorner.skeletons.walks import End, Walk
from polycorner.spaces.manifold import Array
from polycorner.workers import Shared


@dataclass(frozen=True, eq=False)
class Report:
    """A walk without the values at its end; see :class:`~polycorner.skeletons.walks.Walk`."""

    points: Array
    kept: list[int]
    kind: type[HeldPoint] | None
    tangent: Array
    end: End
    length: float

    @classmethod
    def of(cls, walk: Walk) -> "Report":
        """Return that of a walk."""
        kind = None if is_dependent(walk.last) else type(walk.last)
        return cls(walk.points, walk.last.kept, kind, walk.tangent, walk.end, walk.length)

    def walk(self, quotient: Quotient, active: frozenset[int]) -> Walk:
        """Return the walk along an edge with given active functions."""
        if self.kind is None:
            last = held_at(quotient, self.points[-1], active, self.kept)
        else:
            last = self.kind(quotient, self.points[-1], self.kept)
        return Walk(self.points, last, self.tangent, self.end, self.length)


def walked(quotient: Shared, ray: Ray) -> Report:
    """Walk along an edge to its end."""
    start = ray.start(quotient.value)
    return Report.of(follow_edge(start, ray.direction, ray.active))
