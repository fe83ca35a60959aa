"""Networks: curves of Fritz John points, the nodes at which they end, and the arms that leave."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Generic, TypeVar

from polycorner.branches.continuation import Course, Stop, follow
from polycorner.branches.system import Face, FritzJohn
from polycorner.polyhedra.quotients import WalkOptions
from polycorner.searches import Task
from polycorner.spaces.manifold import Array

P = TypeVar("P", bound=FritzJohn)
K = TypeVar("K")


@dataclass(eq=False)
class Arm(Generic[P]):
    """A direction in which a curve leaves a node from a point, and its number once followed."""

    start: P
    direction: Array
    curve: int = -1

    @property
    def face(self) -> Face:
        """The functions that are held along the curve."""
        return self.start.face


@dataclass
class Node(Generic[P, K]):
    """An end of curves: where, of what kind, what vanishes, and the arms that leave it."""

    at: P
    kind: K
    weak: Face = ()
    arms: list[Arm[P]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass
class Curve(Generic[P]):
    """The points on a curve, and the nodes at its ends; -1 where there is none."""

    points: list[P]
    ends: list[int]


class Network(ABC, Generic[P, K]):
    """The curves that are connected with given points, as they are followed."""

    def __init__(self, options: WalkOptions, extent: float) -> None:
        self.options, self.extent = options, extent
        self.nodes: list[Node[P, K]] = []
        self.curves: list[Curve[P]] = []

    def tasks(self, most: int, starts: Iterable[P] = ()) -> Iterator[Task]:
        """Yield the curves to be followed: through the starts, then those that leave nodes."""
        for start in starts:
            yield len(self.curves) < most, partial(self.begin, start)
        while True:
            waiting = (
                (k, a) for k, node in enumerate(self.nodes) for a in node.arms if a.curve < 0
            )
            first = next(waiting, None)
            if first is None:
                return
            yield len(self.curves) < most, partial(self.leave, *first)

    def begin(self, at: P) -> None:
        """Follow the curve through a point both ways, as one, unless it is known."""
        if any(self.passes(curve, at) for curve in self.curves):
            return
        back, on = (self.follow(at, side * at.tangent()) for side in (-1.0, 1.0))
        if back.stop is Stop.CLOSED:
            self.curves.append(Curve(back.points, [-1, -1]))
        else:
            self.add(back, on)

    def add(self, back: Course[P], on: Course[P]) -> None:
        """Add a curve that was followed both ways."""
        self.curves.append(Curve([*back.points[::-1], *on.points[1:]], [-1, -1]))
        for end, course in enumerate((back, on)):
            self.arrive(course, len(self.curves) - 1, end)

    def leave(self, k: int, arm: Arm[P]) -> None:
        """Follow an arm of a node."""
        course = self.follow(arm.start, arm.direction)
        arm.curve = len(self.curves)
        self.curves.append(Curve(course.points, [k, -1]))
        self.arrive(course, arm.curve, 1)

    def follow(self, at: P, direction: Array) -> Course[P]:
        """Follow the curve through a point to its end."""
        return follow(at, direction, self.options, self.extent)

    @abstractmethod
    def passes(self, curve: Curve[P], at: P) -> bool:
        """Whether a curve goes through a point."""

    @abstractmethod
    def arrive(self, course: Course[P], curve: int, end: int) -> None:
        """Register the end of a curve at a node, a new one or one that is known."""
