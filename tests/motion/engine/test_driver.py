"""The engine: room for contacts, and the key under which its code is cached."""

import numpy as np

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.starts import bunch
from polycorner.formulas.compilation import sources_digest
from polycorner.motion.engine import driver, entry_point
from polycorner.motion.simulation import start


def test_room_for_contacts_grows(monkeypatch):
    """Contacts of sleepers are kept while others meet: both need room."""
    drum = DumbbellDrum(count=12, floor=True)
    starts = bunch(drum, np.random.default_rng(3))
    ample = start(drum, drum.state(starts), 1e-3)
    monkeypatch.setattr(driver, "CONTACTS_PER_BODY", 0)
    narrow = start(drum, drum.state(starts), 1e-3)
    assert narrow.capacity < ample.capacity
    for _ in range(300):  # a repeated step starts from other impulses
        ample.advance(1)
        narrow.advance(1)
        np.testing.assert_allclose(narrow.motion.q, ample.motion.q, atol=1e-4)
    assert narrow.capacity > 16


def test_the_cache_key_covers_all_stages():
    (cell,) = (
        cell
        for name, cell in zip(
            entry_point.advance.py_func.__code__.co_freevars,
            entry_point.advance.py_func.__closure__,
            strict=True,
        )
        if name == "sources"
    )
    assert cell.cell_contents == sources_digest("polycorner.motion.engine")
