"""Touching contacts and events as tables of numbers, for files."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from polycorner.motion.events import Event, EventKind
from polycorner.motion.trajectory import Touch


def touch_table(touching: Sequence[Sequence[Touch]], names: Sequence[str]) -> dict[str, Any]:
    """Return contacts as columns: instant, bodies (-1: none), contact, force."""
    rows = [
        (index, bodies[0], bodies[1] if len(bodies) > 1 else -1, names.index(contact), force)
        for index, touches in enumerate(touching)
        for bodies, contact, force in touches
    ]
    whole = np.array([row[:4] for row in rows], dtype=np.int64).reshape(-1, 4)
    return {"touch": whole, "touch_force": np.array([row[4] for row in rows], dtype=np.float64)}


def read_touches(table: Any, names: Sequence[str], count: int) -> list[tuple[Touch, ...]]:
    """Return contacts by instant from :func:`touch_table`."""
    found: list[list[Touch]] = [[] for _ in range(count)]
    for (index, i, j, which), force in zip(
        table["touch"].tolist(), table["touch_force"].tolist(), strict=True
    ):
        found[index].append(((i,) if j < 0 else (i, j), names[which], force))
    return [tuple(touches) for touches in found]


def event_table(events: Iterable[Event], names: Sequence[str]) -> dict[str, Any]:
    """Return events as columns: kind, bodies (-1: none), contact (-1: none); time, impulse."""
    listed = list(events)
    whole = [
        (
            int(event.kind),
            event.bodies[0],
            event.bodies[1] if len(event.bodies) > 1 else -1,
            names.index(event.contact) if event.contact else -1,
        )
        for event in listed
    ]
    numbers = [(event.time, event.impulse) for event in listed]
    return {
        "event": np.array(whole, dtype=np.int64).reshape(-1, 4),
        "event_numbers": np.array(numbers, dtype=np.float64).reshape(-1, 2),
    }


def read_events(table: Any, names: Sequence[str]) -> list[Event]:
    """Return events from :func:`event_table`."""
    return [
        Event(time, EventKind(kind), (i,) if j < 0 else (i, j), "" if at < 0 else names[at], value)
        for (kind, i, j, at), (time, value) in zip(
            table["event"].tolist(), table["event_numbers"].tolist(), strict=True
        )
    ]
