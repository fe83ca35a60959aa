"""Events of a motion and their kinds."""

from dataclasses import dataclass
from enum import IntEnum


class EventKind(IntEnum):
    """Kinds of events, with the engine's numbers."""

    MADE = 0
    LOST = 1
    IMPACT = 2
    REST = 3
    MOTION = 4
    EXIT = 5
    FAILED = 6

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
    EventKind.FAILED: "a contact was not solved to the tolerance, in however short a step",
}


@dataclass(frozen=True)
class Event:
    """An event: a contact, the rest or the exit of bodies at a time.

    Attributes
    ----------
    time : float
        For a contact that closes, the moment at which the gap vanishes; for one that opens, that
        at which its force vanishes; otherwise the end or, where motion begins, the start of the
        step, and its middle where an island is not solved to the tolerance.
    kind : EventKind
    bodies : tuple of int
        Number of the body, or of both.
    contact : str
        Name of the contact, or empty.
    impulse : float
        Normal impulse in that step, for contacts.
    """

    time: float
    kind: EventKind
    bodies: tuple[int, ...]
    contact: str
    impulse: float
