"""``polycorner paper``: the statements of the paper, checked one by one."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from polycorner.atomic import write_atomically
from polycorner.cli.common import (
    deliver,
    fail,
    json_text,
    output_options,
    patience,
    prepare,
    progress_bar,
    settings_option,
    writing,
)
from polycorner.cli.manner import manner, timed

if TYPE_CHECKING:
    from paper_checks.framework.running import Run

EPILOG = """\b
Examples:
  polycorner paper
  polycorner paper E4 L5 --out out
  polycorner paper --section 6 --section C --json
  polycorner paper --slow --out out
  polycorner paper figures heading solid --out out
Exit code 0 when every check ran, whatever it found; 1 when a check broke.
Ctrl-C keeps what was found and says what was not run (exit code 130).
`python -m paper_checks` is the same command.
"""
FIGURES = "figures"


@click.command(epilog=EPILOG)
@click.argument("words", nargs=-1, metavar="[ID]... | figures [NAME]...")
@click.option(
    "--section", "sections", multiple=True, metavar="S",
    help="Claims of a section of the paper, 2 to 8, A, B or C; may be given several times.",
)  # fmt: skip
@click.option("--slow", is_flag=True, help="Also what takes long: simulations, for minutes.")
@click.option(
    "--workers", type=click.IntRange(1, 64), default=2, show_default=True, help="Processes."
)
@settings_option
@output_options
def paper(
    words: tuple[str, ...], sections: tuple[str, ...], slow: bool, workers: int, as_json: bool,
    out: Path | None,
) -> None:  # fmt: skip
    """Check the statements of the paper, or draw its figures anew.

    Without arguments every claim is checked that does not take long; the folder of --out gets a
    report to read, report.html, and report.json.  With --quiet the table is the counts alone.
    """
    prepare(out)
    if words[:1] == (FIGURES,):
        _draw(words[1:], out, sections, slow=slow, as_json=as_json)
        return
    run = _checked(words, sections, slow=slow, workers=workers)
    from paper_checks.framework import table
    from paper_checks.framework.records import records

    undrawn: list[str] = []

    def write() -> list[Path]:
        if out is None:
            return []
        written, found = _write(run, out, slow=slow)
        undrawn.extend(found)
        return written

    shown = records(run)
    deliver(shown, lambda: table.print_run(run, quiet=manner().quiet), write, as_json=as_json)
    problems = [*table.problems(run), *undrawn]
    for problem in problems:
        click.echo(f"polycorner: {problem}", err=True)
    if run.missed or problems:
        raise click.exceptions.Exit(130 if run.missed else 1)


def _checked(ids: Sequence[str], sections: Sequence[str], *, slow: bool, workers: int) -> "Run":
    from dataclasses import replace

    from paper_checks import CLAIMS
    from paper_checks.framework.running import run, select

    try:
        claims, left_out = select(CLAIMS, sections, ids, slow=slow)
    except ValueError as error:
        message = str(error)
        fail(f"--{message}" if message.startswith("section") else message)
    words = f"{len(claims)} to be checked"
    with timed(words), progress_bar("checked", total=len(claims)) as change:
        told = change and (lambda done, ids: change(completed=done, note=", ".join(ids)))
        return replace(run(claims, workers=workers, progress=told), slow=left_out)


# ----------------------------------------------------------------------------------------- files


def _write(run: "Run", out: Path, *, slow: bool) -> tuple[list[Path], list[str]]:
    """Write the report and return its files, and why figures of it could not be drawn."""
    from paper_checks.figures.embedding import embedded_figures
    from paper_checks.framework.records import markdown, records
    from paper_checks.framework.report import html_report

    with patience("drawing the figures"):
        figures = embedded_figures(run, slow=slow)
    texts = {
        "report.html": html_report(run, figures),
        "report.json": json_text(records(run)) + "\n",
        "report.md": markdown(run),
    }
    with writing(out):
        for name, text in texts.items():
            write_atomically(out / name, text)
    problems = [f"figure {f.name}: {f.problem}" for f in figures.values() if f.problem]
    return [out / name for name in texts], problems


def _draw(
    names: tuple[str, ...], out: Path | None, sections: Sequence[str],
    *, slow: bool, as_json: bool,
) -> None:  # fmt: skip
    from paper_checks.figures import FIGURES as KNOWN
    from paper_checks.figures import write

    if out is None:
        fail("figures: expected --out DIR, the folder they go to; got none")
    if sections:
        fail("--section: expected none beside figures; got one")
    for name in names:
        if name not in KNOWN:
            fail(f"figures: expected {', '.join(KNOWN)}; got {name!r}")
    drawn: list[str] = []
    total = len(names or [f for f in KNOWN.values() if slow or not f.slow])
    with writing(out), timed(f"{total} to be drawn"), progress_bar("drawn", total=total) as change:

        def progress(name: str) -> None:
            drawn.append(name)
            if change is not None:
                change(completed=len(drawn))

        written = write(out, names or None, slow=slow, progress=progress)
    deliver([str(path) for path in written], lambda: None, lambda: written, as_json=as_json)
