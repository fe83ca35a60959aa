"""Checks run in separate processes, and their results."""

import os
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from multiprocessing import active_children, get_context

from paper_checks.framework.claims import Claim, Finding
from polycorner.toolkit import Progress, checks, serve, silent

# Each process has a core of its own; threads of the linear algebra would compete for it.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

# Result sent back by a process: the finding or None, the error, seconds.
Examined = tuple[Finding | None, str, float]


@dataclass(frozen=True)
class Result:
    """A claim with the outcome of its check: a finding, or an error in one line."""

    claim: Claim
    finding: Finding | None
    error: str = ""
    seconds: float = 0.0

    @property
    def verdict(self) -> str:
        """The verdict in words, ``error`` if the check raised an exception."""
        return "error" if self.finding is None else self.finding.verdict.value


@dataclass(frozen=True)
class Run:
    """Results in the order of the claims, and the claims that were not checked.

    Attributes
    ----------
    results : tuple of Result
        Results of all checks that ran.
    slow : tuple of Claim
        Claims left out because their checks are slow.
    missed : tuple of Claim
        Claims not reached because the run was interrupted.
    """

    results: tuple[Result, ...]
    slow: tuple[Claim, ...] = ()
    missed: tuple[Claim, ...] = ()

    @property
    def errors(self) -> tuple[Result, ...]:
        """The results of checks that raised an exception."""
        return tuple(result for result in self.results if result.finding is None)


def select(
    claims: Sequence[Claim],
    sections: Iterable[str] = (),
    ids: Iterable[str] = (),
    *,
    slow: bool = False,
) -> tuple[tuple[Claim, ...], tuple[Claim, ...]]:
    """Return the selected claims, and those left out of the selection because they are slow.

    An id stands for its parts too: ``E4`` for ``E4a`` and ``E4b``. Slow claims selected by id are
    never left out.

    Raises
    ------
    ValueError
        For a section or an id that no claim has.
    """
    wanted = tuple(claims)
    sections, ids = tuple(sections), tuple(ids)
    known = dict.fromkeys(claim.section for claim in claims)
    checks.names("section", sections, known)
    for name in ids:
        if not any(_is_called(claim, name) for claim in claims):
            checks.refuse("id", f"one such as {claims[0].id} or {claims[-1].id}", name)
    if sections:
        wanted = tuple(claim for claim in wanted if claim.section in sections)
    if ids:
        wanted = tuple(c for c in wanted if any(_is_called(c, name) for name in ids))
        return wanted, ()
    left_out = () if slow else tuple(claim for claim in wanted if claim.slow)
    return tuple(claim for claim in wanted if claim not in left_out), left_out


def _is_called(claim: Claim, name: str) -> bool:
    return name in (claim.id, claim.id.rstrip("abcdefghijklmnopqrstuvwxyz"))


def run(
    claims: Sequence[Claim],
    *,
    workers: int = 2,
    progress: Progress = silent,
    catalogue: str = "paper_checks",
) -> Run:
    """Check claims in several processes.

    A check that raises, or whose process dies, is an error of that claim; all others still run.
    Claims of one letter go to one process as far as possible, because they share intermediate
    results. Ctrl-C ends the processes; the results so far are kept.

    Parameters
    ----------
    claims : sequence of Claim
        Claims to check.
    workers : int, optional
        Number of processes.
    progress : callable, optional
        Called as ``progress(done, claims, ids being checked)`` whenever a check begins or ends;
        see :class:`~polycorner.progress.Progress`.
    catalogue : str, optional
        Module in whose ``CLAIMS`` the processes look up the claims.
    """
    found: dict[str, Result] = {}
    others = set(active_children())
    queue = _Queue(claims, workers)
    lanes = [_Lane(catalogue, number) for number in range(min(workers, len(claims)))]
    try:
        with _single_threads():
            _check_all(lanes, queue, found, len(claims), progress)
    except KeyboardInterrupt:
        for child in set(active_children()) - others:
            child.terminate()
    finally:
        for lane in lanes:
            lane.close()
    return Run(
        results=tuple(found[claim.id] for claim in claims if claim.id in found),
        missed=tuple(claim for claim in claims if claim.id not in found),
    )


def _check_all(
    lanes: "list[_Lane]",
    queue: "_Queue",
    found: dict[str, Result],
    total: int,
    progress: Progress,
) -> None:
    while True:
        for lane in lanes:
            if lane.future is None and (claim := queue.next(lane.number)) is not None:
                lane.start(claim)
        busy = [lane for lane in lanes if lane.future is not None]
        ids = [lane.claim.id for lane in busy if lane.claim is not None]
        progress(len(found), total, ", ".join(ids))
        if not busy:
            return
        wait([lane.future for lane in busy if lane.future is not None], None, FIRST_COMPLETED)
        for lane in busy:
            if (result := lane.collect()) is not None:
                found[result.claim.id] = result


class _Queue:
    """Claims in groups by letter; a process finishes its group, then helps with another."""

    def __init__(self, claims: Sequence[Claim], workers: int) -> None:
        groups: dict[str, deque[Claim]] = {}
        for claim in claims:
            groups.setdefault(claim.id[:1], deque()).append(claim)
        # Slow groups start first, so that none of them is left for a single process at the end.
        self._waiting = sorted(groups.values(), key=lambda group: -sum(c.slow for c in group))
        self._own: list[deque[Claim]] = [deque() for _ in range(workers)]

    def next(self, number: int) -> Claim | None:
        """Return the next claim for a process, None when nothing is left."""
        own = self._own[number]
        if not own and self._waiting:
            own = self._own[number] = self._waiting.pop(0)
        if own:
            return own.popleft()
        fullest = max(self._own, key=len)
        return fullest.pop() if fullest else None


class _Lane:
    """One process and the claim that it checks."""

    def __init__(self, catalogue: str, number: int) -> None:
        self.catalogue, self.number = catalogue, number
        self.claim: Claim | None = None
        self.future: Future[Examined] | None = None
        self._executor: ProcessPoolExecutor | None = None

    def start(self, claim: Claim) -> None:
        """Start the check of a claim."""
        if self._executor is None:
            # Forking a process that runs threads is not safe.
            self._executor = ProcessPoolExecutor(1, get_context("spawn"), serve)
        self.claim = claim
        self.future = self._executor.submit(_examine, self.catalogue, claim.id)

    def collect(self) -> Result | None:
        """Return the result if the check has ended."""
        if self.future is None or self.claim is None or not self.future.done():
            return None
        claim, future = self.claim, self.future
        self.claim = self.future = None
        try:
            finding, error, seconds = future.result()
        except BrokenProcessPool:
            self.close()
            self._executor = None
            return Result(claim, None, "the process that ran the check ended abruptly")
        return Result(claim, finding, error, seconds)

    def close(self) -> None:
        """End the process once it is idle."""
        if self._executor is not None:
            self._executor.shutdown(wait=True, cancel_futures=True)


def _examine(catalogue: str, name: str) -> Examined:
    """Run the check of one claim, in a worker process."""
    (claim,) = (claim for claim in import_module(catalogue).CLAIMS if claim.id == name)
    start = time.perf_counter()
    try:
        finding = claim.examine()
        finding, error = replace(finding, numbers=dict(finding.numbers)), ""
    except Exception as problem:  # every exception is a result of this claim
        finding, error = None, " ".join(f"{type(problem).__name__}: {problem}".split())
    return finding, error, time.perf_counter() - start


@contextmanager
def _single_threads() -> Iterator[None]:
    """Limit processes started in this context to one thread each."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
