"""Overhead of a parameter study beyond its points, and ten thousand certified headings.

The points of the first part do nothing, or sleep for 20 ms; the remaining time of a study is its
overhead, given per point.  Studies keep their results in a store.  The references submit the same
calls and collect the results in memory: `map` of the executor itself, joblib, `dask.delayed`.
"""

import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from side_by_side import interleave, print_table, seconds, write

from polycorner.dumbbells.studies import heading
from polycorner.sweeps import sweep

WORKERS, ROUNDS, SLEEP = 2, 3, 0.02
COUNTS = {0.0: 2000, SLEEP: 500}  # points that do nothing, and points that sleep

Tasks = dict[str, Callable[[], object]]


def point(a: int, b: int, pause: float = 0.0) -> Mapping[str, Any]:
    """Return three numbers, after a pause if wanted."""
    if pause:
        time.sleep(pause)
    return {"x": a + b, "y": (a - b, "mm"), "z": a * b}


def call(given: tuple[int, int, float]) -> Mapping[str, Any]:
    return point(*given)


def study(executor: Any, pause: float, *, kept: bool = True) -> None:
    grid = {"a": range(20), "b": range(COUNTS[pause] // 20)}
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "s.zarr" if kept else None
        found = sweep(point, grid, executor=executor, fixed={"pause": pause}, store=store)
        assert int((found["status"].values == 1).sum()) == COUNTS[pause]


def calls(pause: float) -> list[tuple[int, int, float]]:
    return [(a, b, pause) for a in range(20) for b in range(COUNTS[pause] // 20)]


def plain(executor: Executor, pause: float) -> None:
    list(executor.map(call, calls(pause)))


def with_joblib(backend: str, pause: float) -> None:
    from joblib import Parallel, delayed

    Parallel(n_jobs=WORKERS, backend=backend)(delayed(call)(given) for given in calls(pause))


def with_delayed(client: Any, pause: float) -> None:
    from dask import delayed

    client.gather(client.compute([delayed(call, pure=False)(given) for given in calls(pause)]))


@contextmanager
def cluster() -> Iterator[Any]:
    """Yield the client of a scheduler here and two workers, each a process of its own."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=WORKERS, threads_per_worker=1, processes=True, dashboard_address=None
        ) as local,
        Client(local) as client,
    ):
        yield client


def on_threads(pause: float) -> Tasks:
    pool = ThreadPoolExecutor(WORKERS)
    tasks: Tasks = {
        "threads: map": lambda: plain(pool, pause),
        "threads: sweep, in memory": lambda: study(pool, pause, kept=False),
        "threads: sweep": lambda: study(pool, pause),
    }
    if find_spec("joblib"):
        tasks["threads: joblib"] = lambda: with_joblib("threading", pause)
    return tasks


def on_processes(pause: float) -> Tasks:
    pool = ProcessPoolExecutor(WORKERS, mp_context=multiprocessing.get_context("spawn"))
    tasks: Tasks = {
        "processes: map": lambda: plain(pool, pause),
        "processes: sweep": lambda: study(pool, pause),
    }
    if find_spec("joblib"):
        tasks["processes: joblib"] = lambda: with_joblib("loky", pause)
    return tasks


def on_dask(client: Any, pause: float) -> Tasks:
    return {
        "Dask: delayed": lambda: with_delayed(client, pause),
        "Dask: sweep": lambda: study(client, pause),
    }


def overheads(tasks: Tasks, pause: float) -> dict[str, float]:
    """Return milliseconds a point beyond what its pauses take on two workers."""
    times = interleave(tasks, ROUNDS)
    count = COUNTS[pause]
    return {
        name: 1e3 * (statistics.median(taken) / count - pause / WORKERS)
        for name, taken in times.items()
    }


def headings() -> dict[str, float]:
    """Time ten thousand certified headings on two processes, in a store."""
    grid = {
        "length": (np.linspace(11, 40, 100), "mm"),
        "rod_radius": (np.linspace(0.3, 2.8, 100), "mm"),
    }
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "s.zarr"
        before = time.process_time()
        taken = seconds(lambda: sweep(heading, grid, executor=WORKERS, store=kept))
        spent = time.process_time() - before
        found = sweep(heading, grid, store=kept)
        points = float(np.nanmedian(found["seconds"].values))
        return {
            "seconds": round(taken, 1),
            "processor seconds of the process that hands out and keeps": round(spent, 2),
            "ms a point on its worker, median": round(1e3 * points, 2),
            "done": int((found["status"].values == 1).sum()),
            "failed": int((found["status"].values == 2).sum()),
            "largest residual": float(np.nanmax(found["residual"].values)),
        }


def main() -> None:
    figures: dict[str, dict[str, float]] = {}
    for pause in COUNTS:
        found = overheads(on_threads(pause), pause) | overheads(on_processes(pause), pause)
        if find_spec("distributed"):
            with cluster() as client:
                found |= overheads(on_dask(client, pause), pause)
        what = f"{1e3 * pause:.0f} ms" if pause else "nothing"
        figures[f"points that take {what}"] = {k: round(ms, 3) for k, ms in found.items()}
        rows = [(name, f"{ms:.3f}") for name, ms in found.items()]
        print_table(f"Overhead of points that take {what}", ["", "ms a point"], rows)
    ten_thousand = headings()
    print_table("Ten thousand certified headings, two processes", ["", ""], [*ten_thousand.items()])
    write("sweep", {"overhead, ms a point": figures, "10,000 headings": ten_thousand})


if __name__ == "__main__":
    main()
