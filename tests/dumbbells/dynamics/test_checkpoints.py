"""Checkpoints in files: a flipped bit anywhere is noticed."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells.dynamics.checkpoints import Checkpoint
from polycorner.motion import Event, EventKind

CONTACTS = ("floor1", "floor2")


class Engine:
    """The part of an engine that checkpoints use."""

    def __init__(self, q):
        self.q = np.array(q)
        body = SimpleNamespace(contacts=CONTACTS)
        self.bodies = SimpleNamespace(body=body, pair_contacts=())

    def save(self):
        return {"q": self.q}

    def load(self, arrays):
        self.q = arrays["q"]


def recorder(q=(0.0, 0.0), *, rows=0):
    return SimpleNamespace(
        engine=Engine(q),
        columns={"times": [0.1 * k for k in range(rows)]},
        left=[0.0] * rows,
        touching=[(((0,), "floor1", 1.5),)] * rows,
        events=[Event(0.05, EventKind.IMPACT, (0,), "floor2", 2.0)] * bool(rows),
        gone=0.25,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the folder of a run that was saved once."""
    where = tmp_path_factory.mktemp("saved")
    Checkpoint(where, {"count": 1}).save(recorder((1.0, 2.0), rows=3))
    return where


def test_a_run_comes_back(folder):
    saved, fresh = recorder((1.0, 2.0), rows=3), recorder()
    Checkpoint(folder, {"count": 1}).restore(fresh)
    np.testing.assert_array_equal(fresh.engine.q, saved.engine.q)
    for name in ("columns", "left", "touching", "events", "gone"):
        assert getattr(fresh, name) == getattr(saved, name)


def test_other_parameters_are_refused(folder):
    with pytest.raises(ValueError, match="expected the parameters of the run"):
        Checkpoint(folder, {"count": 2}).restore(recorder())


@given(data=st.data())
def test_a_single_flipped_bit_is_noticed(folder, tmp_path_factory, data):
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    name = data.draw(st.sampled_from(sorted(files)))
    changed = bytearray(files[name])
    position = data.draw(st.integers(0, 8 * len(changed) - 1))
    changed[position // 8] ^= 1 << position % 8
    copied = tmp_path_factory.mktemp("flipped")
    for other, content in (files | {name: bytes(changed)}).items():
        (copied / other).write_bytes(content)
    with pytest.raises(ValueError, match=rf"^checkpoint: .* is damaged .*{name}"):
        Checkpoint(copied, {"count": 1}).restore(recorder())
