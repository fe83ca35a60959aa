"""Checkpoints of a simulation: a folder from which an interrupted run continues bit for bit.

The folder has ``state.npz``, the engine's state, and ``chunk-*.npz``, what was recorded between
two saves.  A chunk is written before the state that counts it, and every file atomically; so
whenever a run is killed, the folder has a state and all that belongs to it.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.atomic import PART
from polycorner.checks import instance, real, refuse
from polycorner.container import BINARY, FileKind
from polycorner.kinds import check_fields
from polycorner.motion.events import joined
from polycorner.motion.recorder import Recorder
from polycorner.motion.scenes import FrictionTable, friction_table
from polycorner.motion.tables import event_arrays, friction_arrays, touch_table
from polycorner.values import Checked

KIND = FileKind("checkpoint", "a simulation", BINARY)
STATE = "state.npz"
LOCK = ".lock"
ENGINE = "engine."
SHOWN = 40  # characters of a value in an error


@dataclass(frozen=True)
class Checkpoint(Checked):
    """Where and how often a simulation saves its progress, and whether it continues from there.

    ==================================  =======================  ==========================
    In the folder                       ``resume=True``          ``resume=False``
    ==================================  =======================  ==========================
    nothing                             starts                   starts
    unfinished run, same parameters     continues                starts anew
    finished run, same parameters       returns it               starts anew
    unfinished run, other parameters    refused                  refused
    finished run, other parameters      refused                  starts anew
    ==================================  =======================  ==========================

    An error names the parameter that differs.  What does not belong to a run is never removed.

    Parameters
    ----------
    folder : path
        It is created if it does not exist.
    seconds : float, optional
        Save at the first record after so many seconds of real time; default 30.
    resume : bool, optional
        Default True, so that one and the same script starts a run and continues it.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    folder: str | os.PathLike[str]
    seconds: float = 30.0
    resume: bool = True

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "folder", Path(self.folder))
        object.__setattr__(self, "seconds", real("seconds", self.seconds, least=0))
        super().__post_init__()

    def clear(self) -> None:
        """Remove the saved run, and the folder when nothing else is in it.

        Raises
        ------
        ValueError
            If a run is using the folder.
        """
        folder = Path(self.folder)
        if not folder.is_dir():
            return
        with _alone(folder):
            _remove_run(folder)
            with contextlib.suppress(OSError):  # where an open file cannot be removed
                (folder / LOCK).unlink()
        with contextlib.suppress(OSError):
            folder.rmdir()


def _remove_run(folder: Path) -> None:
    for pattern in (STATE, "chunk-*.npz", f".state-*{PART}.npz", f".chunk-*{PART}.npz"):
        for entry in folder.glob(pattern):
            entry.unlink(missing_ok=True)


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Keep other runs out of a folder; without locks, or where none can be written, all go on."""
    from filelock import FileLock, Timeout

    lock = FileLock(folder / LOCK, thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        msg = f"checkpoint: expected a folder that no other run is using; {folder} is in use"
        raise ValueError(msg) from None
    except (OSError, NotImplementedError):
        pass
    try:
        yield
    finally:
        lock.release()


class SavedRun:
    """The run in the folder of a checkpoint.

    Parameters
    ----------
    checkpoint : Checkpoint
    parameters : mapping
        Everything that the run depends on, by name, as values that JSON can hold.
    steps, every : int
        Steps of the whole run, and between two records.
    """

    def __init__(
        self, checkpoint: Checkpoint, parameters: Mapping[str, Any], steps: int, every: int
    ) -> None:
        self.checkpoint, self.folder = checkpoint, Path(checkpoint.folder)
        self.steps, self.every = steps, every
        self.parameters = json.loads(json.dumps(parameters, default=str))
        self._chunks = self._frames = self._events = 0

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Use the folder, which is created if it does not exist, and keep other runs out of it.

        Raises
        ------
        ValueError
            If another run is using it.
        """
        with contextlib.suppress(OSError):  # what cannot be written is said when it is tried
            self.folder.mkdir(parents=True, exist_ok=True)
        with _alone(self.folder):
            yield

    def begin(self, recorder: Recorder) -> bool:
        """Bring a fresh recorder to where the run was saved; return whether there was one.

        Raises
        ------
        ValueError
            If the saved run has other parameters, another format, or damaged files.
        """
        if not (self.folder / STATE).exists():
            _remove_run(self.folder)  # chunks of a run that was killed before its first state
            return False
        resume = self.checkpoint.resume
        try:
            state = KIND.load_arrays(self.folder / STATE)
            with KIND.reading(self.folder / STATE):
                finished = bool(forms.array("finished", state["finished"], "b", ()))
                parameters = instance("parameters", json.loads(str(state["parameters"])), dict)
            if resume or not finished:
                self._compare(parameters, finished=finished)
            if resume:
                self._fill(recorder, state, finished=finished)
        except _RefusedError as error:
            raise ValueError(str(error)) from None
        except (ValueError, OSError) as error:
            msg = f"checkpoint: expected a saved run; {self.folder} is damaged ({error})"
            raise ValueError(msg) from error
        if not resume:
            _remove_run(self.folder)
        return resume

    def _compare(self, saved: dict[str, Any], *, finished: bool) -> None:
        """Raise for the first parameter that differs from that of the saved run."""
        for name in [*self.parameters, *saved]:
            here, there = self.parameters.get(name), saved.get(name)
            if here != there:
                kind = "finished" if finished else "unfinished"
                msg = (
                    f"checkpoint: expected {name} = {_short(there)} as in the {kind} run in "
                    f"{self.folder}; got {_short(here)}: choose another folder or remove that run"
                )
                raise _RefusedError(msg)

    def save(self, recorder: Recorder, *, finished: bool) -> None:
        """Add what was recorded since the last save, and the present state."""
        names, since = recorder.engine.bodies.contact_names, self._frames
        arrays = {name: np.array(rows[since:]) for name, rows in recorder.columns.items()}
        arrays["left"] = np.array(recorder.left[since:], dtype=np.float64)
        arrays |= touch_table(recorder.touching[since:], names)
        rubbed = friction_table(recorder.friction[since:])
        whole = rubbed.whole - np.array([since, 0, 0, 0])
        arrays |= friction_arrays(FrictionTable(whole, rubbed.forces))
        arrays |= event_arrays(joined(recorder.events[self._events :], names))
        KIND.save_arrays(self._chunk(self._chunks), arrays)
        state = {
            "parameters": np.array(json.dumps(self.parameters)),
            "finished": np.array(finished),
            "chunks": np.array(self._chunks + 1),
            "frames": np.array(len(recorder.left)),
            "gone": np.array(recorder.gone),
            **{ENGINE + name: array for name, array in recorder.engine.save().items()},
        }
        KIND.save_arrays(self.folder / STATE, state)
        self._chunks += 1
        self._frames, self._events = len(recorder.left), len(recorder.events)

    def _chunk(self, number: int) -> Path:
        return self.folder / f"chunk-{number:06d}.npz"

    def _fill(self, recorder: Recorder, state: dict[str, Any], *, finished: bool) -> None:
        with KIND.reading(self.folder / STATE):
            chunks = int(forms.array("chunks", state["chunks"], "i", (), least=1))
        for number in range(chunks):
            chunk = KIND.load_arrays(self._chunk(number))
            with KIND.reading(self._chunk(number)):
                recorder.extend(chunk)
        with KIND.reading(self.folder / STATE):
            self._check_instants(recorder, state, finished=finished)
            recorder.gone = float(forms.array("gone", state["gone"], "f", ()))
            saved = {name.removeprefix(ENGINE): a for name, a in state.items() if ENGINE in name}
            recorder.load(saved)
        self._chunks = chunks
        self._frames, self._events = len(recorder.left), len(recorder.events)

    def _check_instants(self, recorder: Recorder, state: dict[str, Any], *, finished: bool) -> None:
        """Check that instants were recorded every so many steps, and whether these are all."""
        frames, engine = len(recorder.left), recorder.engine
        forms.array("frames", state["frames"], "i", (), least=max(1, frames), most=frames)
        steps = np.minimum(self.every * np.arange(frames), self.steps)
        if finished != (steps[-1] == self.steps):
            refuse("finished", f"a run of {self.steps} steps", int(steps[-1]))
        if (
            np.array(recorder.columns["t"]) != engine.start + (engine.before + steps) * engine.dt
        ).any():
            refuse("t", "the times of the steps", "others")


class _RefusedError(Exception):
    """A saved run that is whole, but not the one that was asked for."""


def fingerprint(array: Any) -> str:
    """Return a digest of an array's numbers, to the last bit."""
    content = np.ascontiguousarray(array)
    return hashlib.sha256(content.tobytes()).hexdigest()[:16]


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."
