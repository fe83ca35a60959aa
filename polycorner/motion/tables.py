"""Touching contacts and events as tables of numbers, for files."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner import forms
from polycorner.motion.events import Event, EventKind, EventTable
from polycorner.motion.scenes import FrictionTable, Rubbing
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


def read_touches(
    table: Any, names: Sequence[str], count: int, bodies: int
) -> list[tuple[Touch, ...]]:
    """Return contacts by instant from :func:`touch_table`; ValueError if there is none such."""
    whole = _positions("touch", table["touch"], (count, bodies, bodies, len(names)), (0, 0, -1, 0))
    forces = forms.array("touch_force", table["touch_force"], "f", (len(whole),))
    found: list[list[Touch]] = [[] for _ in range(count)]
    for (index, i, j, which), force in zip(whole.tolist(), forces.tolist(), strict=True):
        found[index].append(((i,) if j < 0 else (i, j), names[which], force))
    return [tuple(touches) for touches in found]


def read_friction(table: Any, laws: Sequence[Rubbing], count: int, bodies: int) -> FrictionTable:
    """Return friction forces by instant, which files of earlier versions do not have."""
    if "rub" not in table:
        return FrictionTable()
    sizes = (count, bodies, bodies, len(laws))
    whole = _positions("rub", table["rub"], sizes, (0, 0, -1, 0))
    forms.array("rub", np.diff(whole[:, 0]), "i", (-1,), least=0)
    return FrictionTable(whole, forms.array("rub_force", table["rub_force"], "f", (len(whole), 2)))


def friction_arrays(table: FrictionTable) -> dict[str, Any]:
    """Return the arrays of friction forces, by the names that they have in files."""
    return {"rub": table.whole, "rub_force": table.forces}


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
    columns = np.array(whole, dtype=np.int64).reshape(-1, 4)
    return event_arrays(EventTable(columns, np.array(numbers).reshape(-1, 2), names))


def event_arrays(events: EventTable) -> dict[str, Any]:
    """Return the arrays of events, by the names that they have in files."""
    return {"event": events.whole, "event_numbers": events.numbers}


def read_events(table: Any, names: Sequence[str], bodies: int) -> EventTable:
    """Return events from :func:`event_table`; ValueError if there is no such kind or contact."""
    sizes = (len(EventKind), bodies, bodies, len(names))
    whole = _positions("event", table["event"], sizes, (0, 0, -1, -1))
    numbers = forms.array("event_numbers", table["event_numbers"], "f", (len(whole), 2))
    return EventTable(whole, numbers, names)


def _positions(
    place: str, table: Any, sizes: tuple[int, ...], least: tuple[int, ...]
) -> NDArray[np.int64]:
    """Return a table after a check that each column has positions among so many things."""
    most = np.array(sizes) - 1
    whole = forms.array(place, table, "i", (-1, len(sizes)), least=np.array(least), most=most)
    return np.asarray(whole, dtype=np.int64)
