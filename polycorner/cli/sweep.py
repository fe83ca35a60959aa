"""``polycorner sweep``: a parameter study over a grid."""

import os
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from polycorner.cli.lazy import registered
from polycorner.cli.options import GroupedCommand, answer_options, option
from polycorner.cli.output import (
    deliver,
    fail,
    prepare,
    remark,
    shown,
    working,
    write_answer,
    writing,
)
from polycorner.errors import nearest

if TYPE_CHECKING:
    import xarray as xr

    from polycorner.printing import Sheet
    from polycorner.sweeps.study_files import NamedStudy, StudyFile

STORE = "sweep.zarr"
SHOWN = 5  # messages of failed points


def named_files() -> dict[str, Path]:
    """Return the study files of the registered packages by name."""
    from importlib.resources import files

    folders = (Path(str(files(point.module))) for point in registered("studies").values())
    return {file.stem: file for folder in folders for file in sorted(folder.glob("*.toml"))}


def _epilog() -> str:
    """Return the end of the help text, which lists the registered studies."""
    titles = [
        f"  {name:<9} {file.read_text(encoding='utf-8').partition(':')[0].lstrip('# ')}"
        for name, file in named_files().items()
    ]
    folders = sorted({str(file.parent) for file in named_files().values()})
    return EPILOG.format(
        studies="\n".join(titles or ["  (none)"]), folder="\n  ".join(folders or ["(none)"])
    )


EPILOG = """\b
Examples:
  polycorner sweep heading --out out/heading
  polycorner sweep climbing --out out/climbing --workers 8
  polycorner sweep mine.toml --out out/mine --scheduler tcp://scheduler:8786 --resume

\b
STUDY is a TOML file or the name of a study that is installed:
{studies}
Their files, to copy and change, are in
  {folder}

With --out, results are written to DIR/sweep.zarr as they come: after Ctrl-C (exit code 130), a
full disk or a killed process, the same command with --resume computes the missing points.
A finished study is shown again and not computed.
A study "module:function" runs your code; the module is also looked for beside the file.
"""


class SweepCommand(GroupedCommand):
    """A command whose help lists the installed studies."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the end of the help text."""
        self.epilog = _epilog()
        super().format_epilog(ctx, formatter)


@click.command(cls=SweepCommand)
@click.argument("study")
@option("--scheduler", metavar="ADDRESS", help="Compute on the Dask cluster at this address.")
@option("--workers", type=int, help="Processes on this machine. [its processors]")
@option("--resume", is_flag=True, help="Resume a study that was interrupted or killed.")
@option("--retry", is_flag=True, help="Like --resume, and compute failed points again.")
@option("--seed", type=int, help="Seed of the random streams. [that of the file, or 0]")
@answer_options
def sweep(
    study: str, scheduler: str | None, workers: int | None, resume: bool, retry: bool,
    seed: int | None, as_json: bool, out: Path | None,
) -> None:  # fmt: skip
    """Compute a study at every point of its grid."""
    _check(scheduler, workers, seed, resume=resume or retry, out=out)
    prepare(out)
    from polycorner.sweeps.study import SweepError

    store = None if out is None else out / STORE
    try:
        file = _file(study)
        plan = _plan(file)
        if store is not None:
            _check_store(store, resume=resume or retry)
        found = _computed(plan, file.stem, store, scheduler, workers, seed, retry=retry)
        answer = _answer(plan, found, store)
    except (ValueError, TypeError, ImportError, SweepError) as error:
        fail(str(error))
    except KeyboardInterrupt:
        _end_interrupted(store)
    deliver(
        answer,
        lambda: shown(_sheet(answer)),
        lambda folder: _write(plan, found, answer, folder),
        as_json=as_json,
        out=out,
    )
    if answer["interrupted"]:
        _end_interrupted(store)


def _check(
    scheduler: str | None, workers: int | None, seed: int | None, *, resume: bool, out: Path | None
) -> None:
    if scheduler is not None and workers is not None:
        fail("--workers: expected no --scheduler beside it, whose workers are its own; got both")
    if workers is not None and workers < 1:
        fail(f"--workers: expected a whole number >= 1; got {workers}")
    if seed is not None and seed < 0:
        fail(f"--seed: expected a whole number >= 0; got {seed}")
    if resume and out is None:
        fail("--resume: expected --out, the folder of the study to resume; got none")


def _named() -> "Mapping[str, NamedStudy]":
    """Return the registered studies by name."""
    return {
        name: study
        for point in registered("studies").values()
        for name, study in point.load().items()
    }


def _file(study: str) -> Path:
    """Return the study file: a path, or the file of an installed study."""
    path, known = Path(study), named_files()
    if path.is_file() or path.suffix or path.name != study:
        return path
    if study not in known:
        got = nearest(study, known)
        fail(f"STUDY: expected a TOML file or one of {', '.join(known)}; got {got}")
    return known[study]


def _plan(file: Path) -> "StudyFile":
    from polycorner.sweeps.study_files import read_study

    if file not in named_files().values():
        sys.path.insert(0, str(file.resolve().parent))  # for the user's own functions
    return read_study(file, _named())


def _check_store(store: Path, *, resume: bool) -> None:
    """Refuse to resume an unfinished study unasked; say where there is none."""
    from polycorner.sweeps.store import stored_state

    state = stored_state(store)
    if resume and not state:
        remark(f"nothing to resume in {store}; the study starts from the beginning")
    if state not in ("", "finished") and not resume:
        fail(f"--out: {store} has an unfinished study; --resume computes the missing points")


# ----------------------------------------------------------------------------------------- the work


def _computed(
    plan: "StudyFile", title: str, store: Path | None, scheduler: str | None,
    workers: int | None, seed: int | None, *, retry: bool,
) -> "xr.Dataset":  # fmt: skip
    from polycorner.sweeps.execution import sweep as compute

    if seed is not None and not plan.random:
        fail(f"--seed: expected none, for {plan.study} draws no random numbers; got {seed}")
    chosen = (seed if seed is not None else plan.seed or 0) if plan.random else None
    with _executor(scheduler, workers) as executor, working(title, "points") as progress:
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
        from polycorner.checks import missing_extra

        fail(str(missing_extra("distributed", "dask")))
    connect: Any = Client
    try:
        client = connect(scheduler, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        fail(f"--scheduler: expected the address of one that answers; got {scheduler} ({error})")
    with client:
        yield client


def _end_interrupted(store: Path | None) -> NoReturn:
    """Say, also with ``--quiet``, how to continue, and end with exit code 130."""
    if store is None:
        words = "interrupted; with --out the study could be resumed"
    else:
        words = f"interrupted, kept in {store}; the same command with --resume computes the rest"
    sys.stdout.flush()
    click.echo(f"polycorner: {words}", err=True)
    raise click.exceptions.Exit(130)


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

    failed = found["status"].values == 2
    messages = found["message"].values[failed].tolist()
    first = dict(zip(reversed(messages), np.argwhere(failed)[::-1], strict=True))
    axes = [(str(name), found[name].values) for name in found["status"].dims]
    return [
        {
            "message": message,
            "count": count,
            "point": {
                name: values[k].item()
                for (name, values), k in zip(axes, first[message], strict=True)
            },
        }
        for message, count in Counter(messages).most_common()
    ]


def _write(plan: "StudyFile", found: "xr.Dataset", answer: dict[str, Any], out: Path) -> list[Path]:
    from polycorner.pictures import style as plots

    written = [out / STORE, write_answer(answer, out, "sweep.json")]
    named = _named()
    figure = named[plan.study].figure(found) if answer["done"] and plan.study in named else None
    if figure is not None:
        with writing(out):
            written.append(plots.save(figure, out / f"{plan.study}.png"))
    return written


def _sheet(answer: dict[str, Any]) -> "Sheet":
    from polycorner.printing import Sheet, Table

    rows = (
        (row["name"], row["unit"], *(_number(row[end]) for end in ("least", "greatest")))
        for row in answer["results"]
    )
    head = ("result", "unit", "least", "greatest")
    failures = [
        f"failed at {row['count']} points, first {_point(row['point'])}: {row['message']}"
        for row in answer["failures"][:SHOWN]
    ]
    if len(answer["failures"]) > SHOWN:
        failures.append(f"and {len(answer['failures']) - SHOWN} other messages")
    title = (
        f"{answer['study']}: {answer['done']} of {answer['total']} points done, "
        f"{answer['failed']} failed, {answer['pending']} pending"
    )
    return Sheet(title, (Table(head, tuple(rows), (2, 3)), *failures))


def _point(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"
