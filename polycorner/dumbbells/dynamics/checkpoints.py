"""Checkpoints of a long run in the drum: whole, or not there at all.

A folder with ``state.npz``, the engine's state bit for bit, and ``chunk-*.npz``, what was recorded
between two savings.  A chunk is written before the state that counts it, every file under another
name first; so whenever a run is killed, the folder has a state and all that belongs to it.
"""

import contextlib
import hashlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.atomic import PART
from polycorner.container import BINARY, Kind
from polycorner.files.motions import event_table, read_events, read_touches, touch_table
from polycorner.motion.engine.driver import Engine
from polycorner.motion.recorder import Recorder

KIND = Kind("checkpoint", "a run", BINARY)
STATE = "state.npz"
ENGINE = "engine."


def contact_names(engine: Engine) -> tuple[str, ...]:
    """Return the names of all contacts that can occur; files have numbers instead."""
    return (*engine.bodies.body.contacts, *engine.bodies.pair_contacts)


class Checkpoint:
    """A run's savings in a folder.

    Parameters
    ----------
    folder : path
        It is made if need be.
    parameters : dict
        All that the run depends on; its representation is hashed.
    """

    def __init__(self, folder: str | os.PathLike[str], parameters: dict[str, Any]) -> None:
        self.folder = Path(folder)
        self.key = hashlib.sha256(repr(sorted(parameters.items())).encode()).hexdigest()
        self.chunks = 0
        self._frames = self._events = 0

    @property
    def exists(self) -> bool:
        """Whether something was saved."""
        return (self.folder / STATE).exists()

    def clear(self) -> None:
        """Remove what this class writes, and the folder when nothing else is in it."""
        if not self.folder.is_dir():
            return
        for entry in (self.folder / STATE, *self.folder.glob("chunk-*"), *self._parts()):
            entry.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            self.folder.rmdir()
        self.chunks = self._frames = self._events = 0

    def _parts(self) -> Iterable[Path]:
        return self.folder.glob(f".*{PART}.npz")

    def _chunk(self, number: int) -> Path:
        return self.folder / f"chunk-{number:06d}.npz"

    def save(self, recorder: Recorder) -> None:
        """Add what was recorded since the last time, and the present state."""
        self.folder.mkdir(parents=True, exist_ok=True)
        names, since = contact_names(recorder.engine), self._frames
        arrays = {name: np.array(rows[since:]) for name, rows in recorder.columns.items()}
        arrays["left"] = np.array(recorder.left[since:], dtype=np.float64)
        arrays |= touch_table(recorder.touching[since:], names)
        arrays |= event_table(recorder.events[self._events :], names)
        KIND.save_arrays(self._chunk(self.chunks), arrays)
        state = {
            "key": np.array(self.key),
            "chunks": np.array(self.chunks + 1),
            "frames": np.array(len(recorder.left)),
            "gone": np.array(recorder.gone),
            **{ENGINE + name: array for name, array in recorder.engine.save().items()},
        }
        KIND.save_arrays(self.folder / STATE, state)
        self.chunks += 1
        self._frames, self._events = len(recorder.left), len(recorder.events)

    def restore(self, recorder: Recorder) -> None:
        """Bring a fresh recorder and its engine to where the run was saved last.

        Raises
        ------
        ValueError
            If nothing was saved, if it was saved with other parameters or by a newer version, or if
            files are damaged.
        """
        if not self.exists:
            msg = f"checkpoint: expected an unfinished run in {self.folder}; got none"
            raise ValueError(msg)
        try:
            state = KIND.load_arrays(self.folder / STATE)
            other = str(state["key"]) != self.key
            if not other:
                self._fill(recorder, state)
        except (KeyError, IndexError, ValueError, OSError) as error:
            msg = f"checkpoint: expected an unfinished run; {self.folder} is damaged ({error})"
            raise ValueError(msg) from error
        if other:
            msg = f"checkpoint: expected the parameters of the run in {self.folder}; got others"
            raise ValueError(msg)

    def _fill(self, recorder: Recorder, state: dict[str, Any]) -> None:
        names = contact_names(recorder.engine)
        for number in range(int(state["chunks"])):
            chunk = KIND.load_arrays(self._chunk(number))
            for name, rows in recorder.columns.items():
                rows.extend(chunk[name])
            recorder.left += chunk["left"].tolist()
            recorder.touching += read_touches(chunk, names, len(chunk["left"]))
            recorder.events += read_events(chunk, names)
        if len(recorder.left) != int(state["frames"]):
            msg = f"{int(state['frames'])} instants were saved, {len(recorder.left)} are there"
            raise ValueError(msg)
        recorder.gone = float(state["gone"])
        saved = {name.removeprefix(ENGINE): a for name, a in state.items() if ENGINE in name}
        recorder.engine.load(saved)
        self.chunks = int(state["chunks"])
        self._frames, self._events = len(recorder.left), len(recorder.events)
