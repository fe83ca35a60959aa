"""``polycorner paper``: the statements of the paper, checked one by one."""

import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from polycorner.cli import (
    columns,
    command,
    deliver,
    examples,
    fail,
    json_text,
    option,
    output_options,
    prepare,
    verbosity,
    working,
    writing,
)
from polycorner.toolkit import nearest

if TYPE_CHECKING:
    from paper_checks.framework.running import Run

EPILOG = (
    examples(
        "paper",
        "paper --list",
        "paper E4 L5 --out out",
        "paper --section 6 --section C --json",
        "paper --slow --out out",
        "paper figures heading_length solid --out out",
    )
    + """
Exit code 0 if every check ran, whatever it found; 1 if a check failed to run.  Ctrl-C keeps what
was found and names what was not run (exit code 130).  `python -m paper_checks` is the same command.
"""
)
FIGURES = "figures"
ID = re.compile(r'\bClaim\(\s*"(\w+)",\s*"(\w+)"')  # and the section
FIGURE = re.compile(r'\bFigure\(\s*"(\w+)"')


def _completed(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    del parameter
    words = context.params.get("words") or ()
    known = figure_names() if words[:1] == (FIGURES,) else [*claim_ids(), FIGURES]
    return [CompletionItem(name) for name in known if name.startswith(incomplete)]


@command(epilog=EPILOG)
@click.argument("words", nargs=-1, metavar="[ID]... | figures [NAME]...", shell_complete=_completed)
@option(
    "--section", "chosen", multiple=True, metavar="S", group="Claims",
    help="Claims of a section of the paper, 2 to 8, A, B or C; repeat for several.",
)  # fmt: skip
@option("--slow", is_flag=True, group="Claims", help="Also run simulations of several minutes.")
@option("--list", "listing", is_flag=True, group="Claims", help="List the claims, check nothing.")
@option(
    "--workers", type=click.IntRange(1, 64), default=2, group="Claims",
    help="Number of processes.",
)  # fmt: skip
@output_options
def paper(
    words: tuple[str, ...], chosen: tuple[str, ...], slow: bool, listing: bool, workers: int,
    as_json: bool, out: Path | None,
) -> None:  # fmt: skip
    """Check the statements of the paper, or draw its figures.

    Without arguments every claim is checked that does not take long.  The folder of --out gets a
    report to read, report.html, and report.json.  With --quiet the table is the counts alone.
    """
    if words[:1] == (FIGURES,):
        known = figure_names()
        check_names(f"figures: expected {', '.join(known)}", words[1:], known)
        _draw(words[1:], out, chosen, slow=slow, as_json=as_json)
        return
    check_names("ID: expected a claim that --list shows", words, claim_ids())
    known = sections()
    check_names(f"--section: expected one of {', '.join(known)}", chosen, known)
    if listing:
        _list(words, chosen, as_json=as_json)
        return
    prepare(out)
    run = _checked(words, chosen, slow=slow, workers=workers)
    from paper_checks.framework import table
    from paper_checks.framework.records import records

    undrawn: list[str] = []

    def write(folder: Path) -> list[Path]:
        written, found = _write(run, folder, slow=slow)
        undrawn.extend(found)
        return written

    def text() -> str:
        return table.run_text(run, quiet=verbosity().quiet, width=columns())

    deliver(records(run), text, write, as_json=as_json, out=out)
    problems = [*table.problems(run), *undrawn]
    for problem in problems:
        click.echo(f"polycorner: {problem}", err=True)
    if run.missed or problems:
        raise click.exceptions.Exit(130 if run.missed else 1)


def _list(ids: Sequence[str], chosen: Sequence[str], *, as_json: bool) -> None:
    from paper_checks import CLAIMS
    from paper_checks.framework.running import select
    from paper_checks.framework.typesetting import plain, sentence

    claims, _ = select(CLAIMS, chosen, ids, slow=True)
    answer: list[dict[str, Any]] = [
        {
            "id": claim.id,
            "section": claim.section,
            "means": claim.means.value,
            "slow": claim.slow,
            "claim": claim.statement,
        }
        for claim in claims
    ]

    def text() -> str:
        from polycorner.toolkit import Table

        rows = (
            (
                row["id"],
                row["section"],
                row["means"] + (", slow" if row["slow"] else ""),
                plain(sentence(row["claim"])),
            )
            for row in answer
        )
        return Table(("id", "section", "means", "claim"), tuple(rows)).text(columns())

    deliver(answer, text, as_json=as_json)


def _checked(ids: Sequence[str], chosen: Sequence[str], *, slow: bool, workers: int) -> "Run":
    from dataclasses import replace

    from paper_checks import CLAIMS
    from paper_checks.framework.running import run, select

    claims, left_out = select(CLAIMS, chosen, ids, slow=slow)
    with working(f"checking {len(claims)} claims", "claims") as progress:
        return replace(run(claims, workers=workers, progress=progress), slow=left_out)


# ----------------------------------------------------------------------------------------- files


def _write(run: "Run", out: Path, *, slow: bool) -> tuple[list[Path], list[str]]:
    """Write the report; return its files, and the reasons why figures could not be drawn."""
    from paper_checks.figures.embedding import embedded_figures
    from paper_checks.framework.records import markdown, records
    from paper_checks.framework.report import html_report
    from polycorner.toolkit import write_atomically

    with working("drawing the figures"):
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
    names: tuple[str, ...], out: Path | None, chosen: Sequence[str],
    *, slow: bool, as_json: bool,
) -> None:  # fmt: skip
    if out is None:
        fail("figures: expected --out DIR, the folder they go to; got none")
    if chosen:
        fail(f"--section: expected none beside figures; got {chosen[0]}")
    prepare(out)
    from paper_checks.figures import write

    with writing(out), working("drawing", "figures") as progress:
        written = write(out, names or None, slow=slow, progress=progress)
    answer = [str(path) for path in written]
    deliver(answer, str, lambda _: written, as_json=as_json, out=out)


# ----------------------------------------------------------------------------------------- names
# Read from the sources without importing them: importing the checks takes seconds, completing or
# refusing a name must not.


def claim_ids() -> list[str]:
    """Return the ids of all claims and, as ``E4`` for ``E4a`` and ``E4b``, of their groups."""
    ids = [found[0] for source in _sources() for found in ID.findall(source)]
    return sorted({*ids, *map(_group, ids)}, key=_order)


def sections() -> list[str]:
    """Return the sections and appendices of the paper that claims belong to."""
    return sorted({found[1] for source in _sources() for found in ID.findall(source)})


def figure_names() -> list[str]:
    """Return the names of all figures."""
    return sorted(name for source in _sources("figures") for name in FIGURE.findall(source))


def check_names(what: str, given: Iterable[str], known: list[str]) -> None:
    """End the command at the first name that is not known."""
    for name in given:
        if name not in known:
            fail(f"{what}; got {nearest(name, known)}")


def _group(name: str) -> str:
    return name.rstrip("abcdefghijklmnopqrstuvwxyz")


def _order(name: str) -> tuple[str, int, str]:
    number = "".join(filter(str.isdigit, name))
    letter, _, part = name.partition(number)
    return letter, int(number), part


def _sources(folder: str = "") -> Iterator[str]:
    spec = find_spec("paper_checks")
    for place in (spec.submodule_search_locations or ()) if spec else ():
        for file in sorted((Path(place) / folder).rglob("*.py")):
            yield file.read_text(encoding="utf-8")
