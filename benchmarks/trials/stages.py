"""One problem in a process of its own, so that a crash or an endless computation ends there.

A task is a generator of facts (dictionaries), yielded as they become known: what it has yielded
before it is stopped is kept.
"""

import math
import multiprocessing
import resource
import signal
import traceback
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from time import perf_counter
from typing import Any

Facts = dict[str, Any]
Task = Callable[..., Iterator[Facts]]
PATIENCE = 20  # times the processor time, for a busy machine


def staged(task: Task, *arguments: object, seconds: float) -> Facts:
    """Run a task in a child process for at most the given processor time and return its facts.

    An exception is under ``"crash"`` with its traceback; a task that was stopped has
    ``"stopped"``, the time it had.
    """
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    child = context.Process(target=_run, args=(there, seconds, task, arguments), daemon=True)
    child.start()
    there.close()
    facts: Facts = {}
    end = perf_counter() + PATIENCE * seconds
    while (message := _receive(here, end - perf_counter())) is not None:
        facts |= message
    if not facts.pop("finished", False):
        child.kill()
        child.join()
        killed = child.exitcode in {-signal.SIGXCPU, -signal.SIGKILL}
        facts |= {"stopped": seconds} if killed else {"crash": f"exit code {child.exitcode}"}
    child.join()
    here.close()
    return facts


def _receive(connection: Connection, seconds: float) -> Facts | None:
    try:
        message: Facts | None = connection.recv() if connection.poll(max(seconds, 0.0)) else None
    except EOFError:
        return None
    return message


def _run(connection: Connection, seconds: float, task: Task, arguments: tuple[object, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(seconds), math.ceil(seconds) + 1))
    try:
        for facts in task(*arguments):
            connection.send(facts)
    except Exception as error:  # whatever it is, it is the result
        first = f"{type(error).__name__}: {error}"
        connection.send({"crash": first, "traceback": traceback.format_exc()})
    connection.send({"finished": True})
