"""Events of a motion and their kinds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from polycorner.spaces.manifold import Array
from polycorner.values import Checked


class EventKind(IntEnum):
    """Kinds of events, with the engine's numbers."""

    MADE = 0
    LOST = 1
    IMPACT = 2
    REST = 3
    MOTION = 4
    EXIT = 5
    FAILED = 6
    SPLIT = 7
    ACTED = 8
    CEASED = 9

    @property
    def sentence(self) -> str:
        """The event in words."""
        return _SENTENCES[self]


_SENTENCES = {
    EventKind.MADE: "a contact closed",
    EventKind.LOST: "a contact opened",
    EventKind.IMPACT: "a contact closed and bounced off at once",
    EventKind.REST: "a body came to rest on its substrate",
    EventKind.MOTION: "a body began to move",
    EventKind.EXIT: "a body left",
    EventKind.SPLIT: "a concave corner was met, beyond which the motion has several continuations",
    EventKind.FAILED: "contacts and limits were not solved to the tolerance, in however short a "
    "step; limits may admit no velocity together",
    EventKind.ACTED: "a limit on velocities began to act",
    EventKind.CEASED: "a limit on velocities ceased to act",
}


@dataclass(frozen=True)
class Event(Checked):
    """An event: a contact, a limit, the rest or the exit of bodies at a time.

    Attributes
    ----------
    time : float
        For a contact that closes, the moment at which the gap vanishes, and so for a limit on
        velocities; for one that opens, or ceases, that at which its force vanishes; otherwise the
        end or, where motion begins, the start of the step, and its middle where an island is not
        solved to the tolerance.
    kind : EventKind
    bodies : tuple of int
        Number of the body, or of both.
    contact : str
        Name of the contact or limit, or empty.
    impulse : float
        Normal impulse in that step, for contacts; for limits on velocities along scaled gradients
        of length 1.
    """

    time: float
    kind: EventKind
    bodies: tuple[int, ...]
    contact: str
    impulse: float


class EventTable(Sequence[Event]):
    """Events as arrays, which become objects when they are asked for.

    Parameters
    ----------
    whole : (n, 4) array of int
        Kind, bodies (-1: none) and contact (-1: none) of each.
    numbers : (n, 2) array
        Time and impulse of each.
    names : sequence of str
        Contacts of a body with its surroundings, then those between two bodies.
    """

    def __init__(self, whole: NDArray[np.int64], numbers: Array, names: Sequence[str]) -> None:
        self.whole, self.numbers, self.names = whole, numbers, names

    def __len__(self) -> int:
        return len(self.whole)

    @overload
    def __getitem__(self, index: int) -> Event: ...

    @overload
    def __getitem__(self, index: slice) -> "EventTable": ...

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return EventTable(self.whole[index], self.numbers[index], self.names)
        whole, numbers = self.whole[index][None], self.numbers[index][None]
        return next(iter(EventTable(whole, numbers, self.names)))

    def __iter__(self) -> Iterator[Event]:
        for (kind, i, j, which), (time, impulse) in zip(
            self.whole.tolist(), self.numbers.tolist(), strict=True
        ):
            contact = "" if which < 0 else self.names[which]
            bodies = (i,) if j < 0 else (i, j)
            yield Event(time, EventKind(kind), bodies, contact, impulse)

    def __repr__(self) -> str:
        return f"EventTable({list(self)!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    def __add__(self, other: "EventTable") -> "EventTable":
        return joined([self, other], self.names)

    __hash__ = None  # type: ignore[assignment]

    def of_kind(self, kind: EventKind) -> "EventTable":
        """Return the events of one kind."""
        chosen = self.whole[:, 0] == kind
        return EventTable(self.whole[chosen], self.numbers[chosen], self.names)

    def in_time(self) -> "EventTable":
        """Return the events in the order of their times."""
        order = np.argsort(self.numbers[:, 0], kind="stable")
        return EventTable(self.whole[order], self.numbers[order], self.names)


def joined(tables: Sequence[EventTable], names: Sequence[str]) -> EventTable:
    """Return the events of tables of the same contacts, one table after the other."""
    whole = [np.zeros((0, 4), dtype=np.int64), *(table.whole for table in tables)]
    numbers = [np.zeros((0, 2)), *(table.numbers for table in tables)]
    return EventTable(np.concatenate(whole), np.concatenate(numbers), names)
