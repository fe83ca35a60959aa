"""``polycorner sweep``: a function at every point of a grid, for days if need be."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import (
    deliver,
    fail,
    output_options,
    prepare,
    progress_bar,
    write_answer,
    writing,
)
from polycorner.cli.manner import console, remark

if TYPE_CHECKING:
    import xarray as xr

    from polycorner.sweeps.study_files import StudyFile

    Report = Callable[[int, int, int], object]

EPILOG = """\b
Examples:
  polycorner sweep examples/studies/heading.toml --out out/heading
  polycorner sweep examples/studies/climbing.toml --out out/climbing --workers 8
  polycorner sweep mine.toml --out out/mine --scheduler tcp://scheduler:8786 --resume
With --out, results are kept in DIR/sweep.zarr as they come: after Ctrl-C (exit code 130), a
full disk or a killed process, the same command with --resume goes on with what is missing.
A study that is finished is shown again and not computed.
A study "module:function" runs code of yours; the module is looked for beside the file too.
"""
STORE = "sweep.zarr"
SHOWN = 5  # messages of failed points


@click.command(epilog=EPILOG)
@click.argument("study", type=click.Path(path_type=Path), metavar="STUDY.toml")
@click.option("--scheduler", metavar="ADDRESS", help="Compute on the Dask cluster at this address.")
@click.option("--workers", type=int, help="Processes on this machine. [its processors]")
@click.option("--resume", is_flag=True, help="Go on with a study that was stopped or killed.")
@click.option("--retry", is_flag=True, help="Like --resume, and compute failed points once more.")
@click.option("--seed", type=int, help="Seed of the random streams. [the file's, or 0]")
@output_options
def sweep(
    study: Path, scheduler: str | None, workers: int | None, resume: bool, retry: bool,
    seed: int | None, as_json: bool, out: Path | None,
) -> None:  # fmt: skip
    """Compute a study at every point of its grid, and keep what is finished."""
    _check(scheduler, workers, seed, resume=resume or retry, out=out)
    prepare(out)
    from polycorner.sweeps.results import SweepError

    try:
        plan = _plan(study)
        store = None if out is None else out / STORE
        if store is not None:
            _check_store(store, resume=resume or retry)
        found = _computed(plan, study, store, scheduler, workers, seed, retry=retry)
    except (ValueError, TypeError, ImportError, SweepError) as error:
        fail(str(error))
    except KeyboardInterrupt:
        _say_interrupted(out)
        raise click.exceptions.Exit(130) from None
    answer = _answer(plan, found, store)

    def write() -> list[Path]:
        return [] if out is None else _write(plan, found, answer, out)

    deliver(answer, lambda: _print(answer), write, as_json=as_json)
    if answer["interrupted"]:
        _say_interrupted(out)
        raise click.exceptions.Exit(130)


def _check(
    scheduler: str | None, workers: int | None, seed: int | None, *, resume: bool, out: Path | None
) -> None:
    if scheduler is not None and workers is not None:
        fail("--workers: expected no --scheduler beside it, whose workers are its own; got both")
    if workers is not None and workers < 1:
        fail(f"--workers: expected a positive whole number; got {workers}")
    if seed is not None and seed < 0:
        fail(f"--seed: expected a whole number not below 0; got {seed}")
    if resume and out is None:
        fail("--resume: expected --out, the folder of the study to go on with; got none")


def _plan(study: Path) -> "StudyFile":
    from polycorner.sweeps.study_files import read_study

    sys.path.insert(0, str(study.resolve().parent))  # a function of the user's own lies there
    return read_study(study)


def _check_store(store: Path, *, resume: bool) -> None:
    """Refuse to go on with an unfinished study unasked, or to resume what was never begun."""
    from polycorner.sweeps.identity import stored_study

    begun = stored_study(store) is not None
    if resume and not begun:
        fail(f"--resume: expected a study in {store}; got none")
    if begun and not resume:
        from polycorner.sweeps.execution import open_results

        pending = int((open_results(store)["status"].values == 0).sum())
        if pending:
            fail(f"--out: {store} has an unfinished study; --resume goes on with it")


# ----------------------------------------------------------------------------------------- the work


def _computed(
    plan: "StudyFile",
    file: Path,
    store: Path | None,
    scheduler: str | None,
    workers: int | None,
    seed: int | None,
    *,
    retry: bool,
) -> "xr.Dataset":
    from polycorner.sweeps.execution import sweep as compute

    if seed is not None and not plan.random:
        fail(f"--seed: expected none, for {plan.study} draws no random numbers; got {seed}")
    chosen = (seed if seed is not None else plan.seed or 0) if plan.random else None
    with _executor(scheduler, workers) as executor, _told(file.stem) as progress:
        return compute(
            plan.function,
            plan.grid,
            executor=executor,
            rng=chosen,
            fixed=plan.fixed,
            store=store,
            retry=retry,
            progress=progress,
        )


@contextmanager
def _executor(scheduler: str | None, workers: int | None) -> Iterator[Any]:
    """Yield the number of processes, or the client of a cluster."""
    if scheduler is None:
        yield workers or os.cpu_count() or 1
        return
    try:
        from distributed import Client
    except ImportError:
        fail("--scheduler: expected Dask to be installed: pip install 'polycorner[dask]'")
    connect: Any = Client
    try:
        client = connect(scheduler, timeout=10, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        fail(f"--scheduler: expected the address of one that answers; got {scheduler} ({error})")
    with client:
        yield client


@contextmanager
def _told(name: str) -> "Iterator[Report | None]":
    """Show how many points are done, how many failed, and the time left."""
    with progress_bar(name, left=True) as change:
        if change is None:
            yield None
            return

        def progress(done: int, failed: int, total: int) -> None:
            words = f"{name}, {failed} failed" if failed else name
            change(completed=done + failed, total=total, description=words)

        yield progress


def _say_interrupted(out: Path | None) -> None:
    if out is None:
        remark("interrupted; with --out the study could have been gone on with")
    else:
        remark(f"interrupted, kept in {out / STORE}; the same command with --resume goes on")


# --------------------------------------------------------------------------------------- the answer


def _answer(plan: "StudyFile", found: "xr.Dataset", store: Path | None) -> dict[str, Any]:
    import json

    status = found["status"].values
    pending, done, failed = (int((status == flag).sum()) for flag in (0, 1, 2))
    return {
        "study": plan.study,
        "axes": json.loads(found.attrs["study"])["axes"],
        "fixed": plan.fixed,
        "seed": None if found.attrs["seed"] == "none" else int(found.attrs["seed"]),
        "total": int(status.size),
        "done": done,
        "failed": failed,
        "pending": pending,
        "interrupted": found.attrs["complete"] != "finished",
        "results": _results(found),
        "failures": _failures(found),
        "store": None if store is None else str(store),
    }


def _results(found: "xr.Dataset") -> list[dict[str, Any]]:
    """Return name, unit and range of each result that is a number or numbers."""
    import numpy as np

    listed = []
    for name in found.data_vars:
        values = found[name].values
        if name in ("status", "message", "seconds") or values.dtype.kind != "f":
            continue
        finite = values[np.isfinite(values)]
        ends = (float(finite.min()), float(finite.max())) if len(finite) else (None, None)
        unit = found[name].attrs.get("units", "")
        listed.append({"name": str(name), "unit": unit, "least": ends[0], "greatest": ends[1]})
    return listed


def _failures(found: "xr.Dataset") -> list[dict[str, Any]]:
    """Return the messages of failed points, commonest first, each with one of its points."""
    import numpy as np

    places = np.argwhere(found["status"].values == 2)
    counts: dict[str, int] = {}
    first: dict[str, Any] = {}
    messages = found["message"].values
    for place in places:
        words = str(messages[tuple(place)])
        counts[words] = counts.get(words, 0) + 1
        first.setdefault(words, place)
    dims = found["status"].dims
    return [
        {
            "message": words,
            "count": counts[words],
            "point": {
                str(d): found[d].values[k].item() for d, k in zip(dims, first[words], strict=True)
            },
        }
        for words in sorted(counts, key=lambda words: -counts[words])
    ]


def _write(plan: "StudyFile", found: "xr.Dataset", answer: dict[str, Any], out: Path) -> list[Path]:
    from polycorner.pictures import style as plots
    from polycorner.pictures import sweeps

    written = [out / STORE, write_answer(answer, out, "sweep.json")]
    figure = sweeps.draw_study(plan.study, found) if answer["done"] else None
    if figure is not None:
        with writing(out):
            written.append(plots.save(figure, out / f"{plan.study}.png"))
    return written


def _print(answer: dict[str, Any]) -> None:
    from rich import box
    from rich.table import Table

    screen = console()
    screen.print(
        f"{answer['study']}: {answer['done']} of {answer['total']} points done, "
        f"{answer['failed']} failed, {answer['pending']} pending"
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("result", "unit", "least", "greatest"):
        table.add_column(title)
    for row in answer["results"]:
        ends = ["-" if row[k] is None else f"{row[k]:.6g}" for k in ("least", "greatest")]
        table.add_row(row["name"], row["unit"], *ends)
    if answer["results"]:
        screen.print(table)
    for row in answer["failures"][:SHOWN]:
        where = ", ".join(f"{name} = {value}" for name, value in row["point"].items())
        screen.print(
            f"failed at {row['count']} points, first {where}: {row['message']}", markup=False
        )
    if len(answer["failures"]) > SHOWN:
        screen.print(f"and {len(answer['failures']) - SHOWN} other messages")
