"""What atlases and studies send to workers and get back, in bytes, and what they keep.

Numbers of spheres are arguments, by default 6 7 8 9; ten take a minute, and 0.4 GiB.
"""

import os
import pickle
import resource
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import Future
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from bench_sweep import cluster
from side_by_side import print_table, write

from polycorner import Skeleton, skeleton
from polycorner.dumbbells.studies import heading
from polycorner.files import save_skeleton
from polycorner.models import SphereCluster
from polycorner.sweeps import sweep
from polycorner.workers import Inline, Shared, Workers

GRID = {
    "length": (np.linspace(11, 40, 40), "mm"),
    "rod_radius": (np.linspace(0.3, 2.8, 25), "mm"),
}


class Weighing(Inline):
    """An executor that computes at once and weighs what would have travelled.

    Attributes
    ----------
    calls : dict of lists of (int, int, int, float)
        By function: of every call the bytes of its arguments without the shared value and of the
        shared value, the bytes of its result, and the processor time in s.
    """

    def __init__(self) -> None:
        self.calls: dict[str, list[tuple[int, int, int, float]]] = {}

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Compute a call and weigh it."""
        before = time.process_time()
        future = super().submit(fn, *args, **kwargs)
        taken = time.process_time() - before
        shared = sum(len(pickle.dumps(part)) for part in args if isinstance(part, Shared))
        sent = len(pickle.dumps((fn, args, kwargs))) - shared
        call = (sent, shared, len(pickle.dumps(future.result())), taken)
        self.calls.setdefault(fn.__name__, []).append(call)
        return future

    def figures(self, name: str) -> dict[str, float]:
        """Return what is to be told of the calls of a function."""
        sent, shared, back, seconds = zip(*self.calls[name], strict=True)
        return {
            f"{name}: tasks": len(sent),
            f"{name}: shared bytes": shared[0],
            f"{name}: bytes of a task": round(statistics.mean(sent)),
            f"{name}: bytes of a result": round(statistics.mean(back)),
            f"{name}: largest result": max(back),
            f"{name}: ms a task": round(1e3 * statistics.mean(seconds), 2),
            f"{name}: s of all tasks": round(sum(seconds), 2),
        }

    @property
    def seconds(self) -> float:
        """Processor time of all calls."""
        return sum(call[-1] for calls in self.calls.values() for call in calls)


def atlas(count: int, executor: Any) -> tuple[Skeleton, float]:
    """Return an atlas, and the processor time of this process."""
    model = SphereCluster(count)
    before = time.process_time()
    found = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry, executor=executor)
    return found, time.process_time() - before


def of_atlas(count: int) -> dict[str, float]:
    """Weigh the walks and vertex figures of an atlas, and its file."""
    scale = Weighing()
    found, taken = atlas(count, Workers(scale, lambda: 1))
    figures = scale.figures("walked") | scale.figures("figured")
    # Weighing counts here.
    figures["s of the process that searches"] = round(taken - scale.seconds, 2)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "atlas.json"
        before = time.process_time()
        save_skeleton(found, path)
        figures["s to save"] = round(time.process_time() - before, 2)
        figures["bytes of its file"] = path.stat().st_size
    figures["MiB so far"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    return figures


def of_study() -> dict[str, float]:
    """Weigh the batches of a thousand certified headings, and their store."""
    heading(16.0, 1.5)  # loads the search
    scale = Weighing()
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "s.zarr"
        found = sweep(heading, GRID, executor=scale, store=store)
        files = [path for path in store.rglob("*") if path.is_file()]
        kept = sum(path.stat().st_size for path in files)
    points = found["status"].size
    (calls,) = scale.calls.values()
    sent, shared, back, seconds = (sum(column) for column in zip(*calls, strict=True))
    return {
        "points": points,
        "batches": len(calls),
        "shared bytes of a batch": shared // len(calls),
        "bytes sent a point": round(sent / points),
        "bytes of a result": round(back / points),
        "bytes stored a point": round(kept / points),
        "ms a point": round(1e3 * seconds / points, 2),
    }


def on_dask(counts: list[int]) -> dict[str, dict[str, float]]:
    """Walk atlases on two workers of Dask; the scheduler's time counts as this process's."""
    figures = {}
    with cluster() as client:
        atlas(5, client)
        for count in counts:
            before = time.perf_counter()
            _, taken = atlas(count, client)
            figures[f"{count} spheres"] = {
                "s of the process that searches": round(taken, 2),
                "s of wall time": round(time.perf_counter() - before, 2),
            }
    return figures


def main() -> None:
    counts = [int(count) for count in sys.argv[1:]] or [6, 7, 8, 9]
    atlas(5, None)  # loads the kernels
    atlases = {f"{count} spheres": of_atlas(count) for count in counts}
    head = ["", *atlases]
    names = atlases[head[1]]
    print_table("Atlases", head, [(n, *(a[n] for a in atlases.values())) for n in names])
    study = of_study()
    print_table("A study of certified headings", ["", ""], [*study.items()])
    figures: dict[str, Any] = {"atlases": atlases, "study": study, "load": os.getloadavg()[0]}
    if find_spec("distributed"):
        figures["Dask"] = dask = on_dask(counts)
        rows = [(name, *taken.values()) for name, taken in dask.items()]
        print_table("Two workers of Dask", ["", "s of this process", "s of wall time"], rows)
    write("messages", figures)


if __name__ == "__main__":
    main()
