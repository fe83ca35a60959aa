"""Long runs of dumbbells in the drum, which can be stopped, killed, and gone on with."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import __version__
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.checkpoints import Checkpoint
from polycorner.interrupts import first_interrupt
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import whole_steps, whole_stride
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.motion.trajectory import Trajectory

INTERVAL = 0.1  # s between records of a long run
FRAMES = 1000  # records of a short one
SAVING = 10_000  # steps between checkpoints


@dataclass(frozen=True, eq=False)
class DrumRun:
    """A motion in the drum with all that it depends on.

    Attributes
    ----------
    drum : DumbbellDrum
    noise : Noise
    trajectory : Trajectory
    duration : float
        The time asked for, in s.
    every : int
        Steps between records.
    steps_per_second : float
        Steps done in a second of the computer's time, the first record left out, which includes
        loading the compiled core; nan if there is no other.
    """

    drum: DumbbellDrum
    noise: Noise
    trajectory: "Trajectory"
    duration: float
    every: int
    steps_per_second: float = math.nan

    @property
    def finished(self) -> bool:
        """Whether the run went on to its end."""
        return self.trajectory.effort.steps >= round(self.duration / self.trajectory.dt)

    @property
    def start(self) -> Array:
        """Where the dumbbells were put, ``(N, 4)``."""
        return np.asarray(self.trajectory.q[0])


@dataclass(frozen=True)
class Saving:
    """Where a run is saved, and how often.

    Attributes
    ----------
    folder : path
        It is made if need be and cleared of an older run unless that is resumed.
    every : int
        Save after so many steps, rounded up to a record.
    resume : bool
        Go on with what is there.
    """

    folder: str | PathLike[str]
    every: int = SAVING
    resume: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.every, bool) or not isinstance(self.every, int) or self.every < 1:
            msg = f"every: expected a positive whole number of steps; got {self.every!r}"
            raise ValueError(msg)


def run(
    drum: DumbbellDrum,
    q: ArrayLike,
    duration: float,
    *,
    dt: float = 1e-3,
    noise: Noise | None = None,
    every: int | None = None,
    saving: Saving | None = None,
    progress: Callable[[float], None] | None = None,
) -> DrumRun:
    """Follow dumbbells from rest on the drum at ``q``, saving what is done now and then.

    A run that is resumed gives the trajectory of one that was never stopped, bit for bit, on the
    same machine and version.  The first Ctrl-C ends a run after the step under way and keeps what
    was done; a second one ends it at once.

    Parameters
    ----------
    drum : DumbbellDrum
    q : (N, 3) or (N, 4) array
        ``phi, eta, theta`` (and ``psi``) of each dumbbell.
    duration, dt : float
        Time to simulate and step, in s.
    noise : Noise, optional
    every : int, optional
        Record every so many steps; default every 0.1 s, or a thousand times if that is more often.
    saving : Saving, optional
        Where and how often to save, and whether to go on from there; by default nothing is saved.
    progress : callable, optional
        Called with the time after every record.

    Returns
    -------
    DrumRun

    Raises
    ------
    TypeError, ValueError
        Naming the argument; also if a checkpoint is of a run with other parameters.
    """
    from polycorner.motion.recorder import Recorder

    noise = noise or Noise()
    engine = drum.engine(q, dt=dt, noise=noise)
    steps = whole_steps(duration, dt)
    stride = whole_stride(every, steps) if every is not None else default_stride(duration, dt)
    recorder = Recorder(engine)
    book = None
    if saving is not None:
        chosen = parameters(drum, q, duration, dt, noise)
        book = Checkpoint(saving.folder, chosen | {"every": stride})
    if book is not None and saving is not None and saving.resume:
        book.restore(recorder)
    else:
        if book is not None:
            book.clear()
        recorder.instant()
    often = SAVING if saving is None else saving.every
    rate = _follow(recorder, steps, stride, book, often, progress)
    path = recorder.trajectory(drum.bodies)
    return DrumRun(drum, noise, path, float(duration), stride, rate)


def _follow(
    recorder: Any,
    steps: int,
    stride: int,
    book: Checkpoint | None,
    often: int,
    progress: Callable[[float], None] | None,
) -> float:
    """Advance to the end or to Ctrl-C and return the steps per second."""
    engine = recorder.engine
    saved = engine.steps
    counted, spent, warm = 0, 0.0, False
    asked = threading.Event()
    with first_interrupt(asked.set):
        while engine.steps < steps and not asked.is_set():
            before, clock = engine.steps, time.perf_counter()
            recorder.advance(min(stride, steps - before))
            if warm:
                counted += engine.steps - before
                spent += time.perf_counter() - clock
            warm = True
            recorder.instant()
            if book is not None and engine.steps - saved >= often:
                book.save(recorder)
                saved = engine.steps
            if progress is not None:
                progress(engine.time)
        if book is not None and (engine.steps > saved or not book.exists):
            book.save(recorder)
    return counted / spent if spent > 0 else math.nan


def default_stride(duration: float, dt: float) -> int:
    """Return the steps between two records: 0.1 s, or a thousandth of a short run."""
    return max(1, round(min(INTERVAL, duration / FRAMES) / dt))


def parameters(
    drum: DumbbellDrum, q: ArrayLike, duration: float, dt: float, noise: Noise
) -> dict[str, Any]:
    """Return all that a run depends on."""
    chosen = {"version": __version__, "duration": float(duration), "dt": float(dt)}
    chosen |= {"start": np.array(q, dtype=np.float64).tolist()}
    chosen |= {f"drum.{name}": value for name, value in asdict(drum).items()}
    return chosen | {
        "chatter": noise.chatter,
        "correlation_time": noise.correlation_time,
        "kicks": sorted(noise.kicks.items()),
        "seed": noise.seed,
    }
