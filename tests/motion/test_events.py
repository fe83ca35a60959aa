"""Tables of events: the same as the events one by one."""

import numpy as np
import pytest

from polycorner.motion.events import Event, EventKind, EventTable, joined
from polycorner.motion.tables import event_table, read_events

NAMES = ("floor", "rim", "discs")
EVENTS = [
    Event(0.5, EventKind.MADE, (3,), "rim", 2.0),
    Event(0.25, EventKind.IMPACT, (1, 4), "discs", 1.0),
    Event(0.5, EventKind.REST, (3,), "", 0.0),
    Event(0.125, EventKind.EXIT, (0,), "", 0.0),
]


def table(events):
    """Return the table of events."""
    arrays = event_table(events, NAMES)
    return EventTable(arrays["event"], arrays["event_numbers"], NAMES)


def test_a_table_is_a_sequence_of_its_events():
    events = table(EVENTS)
    assert list(events) == EVENTS
    assert [events[k] for k in range(-4, 4)] == [EVENTS[k] for k in range(-4, 4)]
    assert events[1:3] == EVENTS[1:3]
    assert events == tuple(EVENTS)
    assert events != EVENTS[:3]
    assert EVENTS[2] in events
    with pytest.raises(IndexError):
        events[4]


def test_events_are_chosen_by_kind_and_ordered_by_time():
    events = table(EVENTS)
    for kind in EventKind:
        assert events.of_kind(kind) == [event for event in EVENTS if event.kind == kind]
    assert events.in_time() == sorted(EVENTS, key=lambda event: event.time)


@pytest.mark.parametrize("cut", range(5))
def test_tables_are_joined_one_after_the_other(cut):
    assert joined([table(EVENTS[:cut]), table(EVENTS[cut:])], NAMES) == EVENTS
    assert table(EVENTS[:cut]) + table(EVENTS[cut:]) == EVENTS
    assert len(joined([], NAMES)) == 0


def test_what_is_read_has_kinds_and_contacts_that_there_are():
    arrays = event_table(EVENTS, NAMES)
    assert read_events(arrays, NAMES, 5) == EVENTS
    for column, value in ((0, len(EventKind)), (0, -1), (3, 3), (3, -2)):
        damaged = arrays["event"].copy()
        damaged[1, column] = value
        with pytest.raises(ValueError, match=r"^event: expected"):
            read_events(arrays | {"event": damaged}, NAMES, 5)


def test_bodies_and_contacts_are_whole_numbers_also_where_there_are_no_events():
    assert table([]).whole.dtype == joined([], NAMES).whole.dtype == np.int64
