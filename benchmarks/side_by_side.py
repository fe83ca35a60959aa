"""Timing tasks side by side: interleaved rounds, medians, ratios; a table and a JSON file.

Other processes slow all tasks of a round alike, so the ratio of two tasks is taken round by round,
and the median of those ratios is reported.
"""

import json
import os
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from polycorner.atomic import write_atomically

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results"

Times = dict[str, list[float]]
Growth = Callable[[list[dict[str, Any]]], Any]  # exponents, of rows of figures


def seconds(task: Callable[[], object], clock: Callable[[], float] = perf_counter) -> float:
    """Return the duration of one call, in seconds."""
    start = clock()
    task()
    return clock() - start


def interleave(
    tasks: Mapping[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = perf_counter,
) -> Times:
    """Return the times of every task in each of several rounds, after one round to warm up.

    Every round begins with another task, so that no task always follows the same one.  The clock
    may be that of the processor, for tasks of one thread beside other work.
    """
    times: Times = {name: [] for name in tasks}
    order = list(tasks)
    for task in tasks.values():
        task()
    for _ in range(rounds):
        for name in order:
            times[name].append(seconds(tasks[name], clock))
        order.append(order.pop(0))
    return times


def ratio(times: Sequence[float], reference: Sequence[float]) -> float:
    """Return the median over rounds of ``times / reference``."""
    return statistics.median(a / b for a, b in zip(times, reference, strict=True))


def difference(times: Sequence[float], reference: Sequence[float]) -> float:
    """Return the median over rounds of ``times - reference``."""
    return statistics.median(a - b for a, b in zip(times, reference, strict=True))


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print rows under their columns, the first aligned left and the others right."""
    cells = [[str(cell) for cell in row] for row in (columns, *rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    print(f"\n{title}")
    for row in cells:
        head, *others = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        tail = (cell.strip().rjust(w) for cell, w in zip(others, widths[1:], strict=True))
        print("  " + "   ".join([head, *tail]))


def write(name: str, figures: Mapping[str, Any]) -> None:
    """Write results, and the machine and software, to ``benchmarks/results/<name>.json``."""
    content = {"measured on": machine(), **figures}
    write_atomically(RESULTS / f"{name}.json", json.dumps(content, indent=2) + "\n")


def machine() -> dict[str, str]:
    """Return a description of the machine and the software versions."""
    from llvmlite import binding

    return {
        "processor": binding.get_host_cpu_name(),
        "cores": str(os.cpu_count()),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def fresh(*arguments: str, folder: Path) -> None:
    """Run a fresh interpreter of this environment in a folder, with this checkout importable."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.DEVNULL,
        check=True,
    )


def peak(code: str) -> float:
    """Return the peak memory, in MiB, of a fresh interpreter that runs code beside these files."""
    run = subprocess.run(
        [sys.executable, "-c", f"{code}; import side_by_side; print(side_by_side.used())"],
        cwd=ROOT / "benchmarks",
        capture_output=True,
        text=True,
        check=True,
    )
    return float(run.stdout)


def used() -> float:
    """Return the peak memory of this process in MiB, on Linux.

    `getrusage` is unsuitable: a process inherits the peak of its parent.
    """
    status = Path("/proc/self/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return round(int(line.split()[1]) / 1024, 1)


def alone(script: str, sizes: str, results: Path, kinds: Mapping[str, Growth]) -> None:
    """Run a script with ``--one KIND:COUNT`` for every size, one process and one thread each.

    What each prints last is a row of figures.  It replaces the row of its kind and count in the
    results, where growth of a kind stands beside them as soon as there are two.
    """
    kept = json.loads(results.read_text()) if results.exists() else {"runs": []}
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    for size in sizes.split():
        command = [sys.executable, script, "--one", size]
        done = subprocess.run(
            command, check=True, capture_output=True, text=True, env={**os.environ, **single}
        )
        row = json.loads(done.stdout.splitlines()[-1])
        print(row, flush=True)
        same = (row["kind"], row["count"])
        kept["runs"] = [r for r in kept["runs"] if (r["kind"], r["count"]) != same] + [row]
        kept["runs"].sort(key=lambda r: (r["kind"], r["count"]))
        for kind, growth in kinds.items():
            rows = [r for r in kept["runs"] if r["kind"] == kind]
            if len(rows) > 1:
                kept[f"growth of {kind}"] = growth(rows)
        write_atomically(results, json.dumps(kept, indent=1) + "\n")
