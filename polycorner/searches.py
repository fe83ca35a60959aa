"""Searches: work that budget, time and Ctrl-C end between two tasks, and that a clock saves.

A search is a state and a queue of tasks.  A task changes the state, may add others, and leaves the
queue when the next one is asked for: whatever ends the search meanwhile, its state then says what
is left to do.
"""

import math
from collections.abc import Callable, Iterable
from enum import Enum
from time import monotonic

from polycorner.progress import Progress, silent

Task = tuple[bool, Callable[[], object]]  # whether the budget allows it, and what it does
Told = tuple[float, float | None, str]  # how far a search has come, as progress takes it


class Ending(Enum):
    """How a search ended."""

    FINISHED = "nothing is left to do"
    BUDGET = "budget or time is used up"
    INTERRUPTED = "Ctrl-C, or as it was asked to"


class Clock:
    """When work in progress is saved: every few seconds, for a small share of the time at most."""

    every, share = 5.0, 0.05  # s between two times of saving at least; of the time at most

    def __init__(self, save: Callable[[], object], every: float | None = None) -> None:
        self._save, self._saved, self._took = save, monotonic(), 0.0
        self.every = self.every if every is None else every

    def tick(self) -> None:
        """Save if it is time."""
        if monotonic() - self._saved >= max(self.every, self._took / self.share):
            self.save()

    def save(self) -> None:
        """Save now."""
        start = monotonic()
        self._save()
        self._saved = monotonic()
        self._took = self._saved - start


def work_through(
    tasks: Iterable[Task],
    told: Callable[[], Told],
    progress: Progress = silent,
    *,
    seconds: float = math.inf,
    clock: Clock | None = None,
) -> Ending:
    """Do the tasks of a search until none is left, budget or time is used up, or Ctrl-C.

    At least one task is done, however short the time, if the budget allows it.  What is ``told``
    is reported after every task; the clock saves between two of them.
    """
    deadline, begun = monotonic() + seconds, False
    try:
        for allowed, work in tasks:
            if begun and clock is not None:
                clock.tick()
            if not allowed or (begun and monotonic() > deadline):
                return Ending.BUDGET
            work()
            begun = True
            progress(*told())
    except KeyboardInterrupt:
        return Ending.INTERRUPTED
    return Ending.FINISHED
