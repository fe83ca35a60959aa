"""What became of the claims, as a table in the terminal."""

import sys
from typing import TYPE_CHECKING

from paper_checks.framework.claims import Claim, Verdict
from paper_checks.framework.records import counts, section_name, to_act_on
from paper_checks.framework.running import Result, Run
from paper_checks.framework.typesetting import plain, sentence

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

STYLES = {
    Verdict.HOLDS.value: "green",
    Verdict.HOLDS_UNDER.value: "cyan",
    Verdict.CORRECTED.value: "yellow",
    Verdict.REFUTED.value: "red",
    Verdict.NOT_TESTABLE.value: "dim",
    "error": "bold red",
}


def print_run(run: Run, *, quiet: bool = False) -> None:
    """Print claims with their verdicts and evidence, what to act on, and the counts.

    Quiet prints the counts alone.
    """
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)
    if not quiet:
        _print_claims(console, run)
        _print_to_act_on(console, run)
    told = ", ".join(f"{number} {verdict}" for verdict, number in counts(run).items())
    console.print(f"{len(run.results)} claims: {told}" if told else "0 claims", soft_wrap=True)
    if run.slow:
        console.print(f"left out, too slow without --slow: {_ids(run.slow)}", soft_wrap=True)


def problems(run: Run) -> list[str]:
    """Say which checks broke, and which were not reached."""
    told = [f"{result.claim.id}: {result.error}" for result in run.errors]
    return told + ([f"interrupted; not run: {_ids(run.missed)}"] if run.missed else [])


def _ids(claims: tuple[Claim, ...]) -> str:
    return ", ".join(claim.id for claim in claims)


def _print_claims(console: "Console", run: Run) -> None:
    from rich.table import Table

    section = ""
    for result in run.results:
        if result.claim.section != section:
            section = result.claim.section
            console.print(f"\n[bold]{section_name(section)}[/bold]")
        table = Table.grid(padding=(0, 2))
        table.add_column(width=5, style="bold")
        table.add_column(width=max(map(len, STYLES)))
        table.add_column(ratio=1)
        table.add_row(result.claim.id, _verdict(result), _words(result))
        console.print(table)


def _verdict(result: Result) -> "Text":
    from rich.text import Text

    return Text(result.verdict, style=STYLES[result.verdict])


def _words(result: Result) -> "Text":
    from rich.text import Text

    text = Text(plain(sentence(result.claim.statement)))
    finding = result.finding
    text.append(
        "\n" + (result.error if finding is None else plain(sentence(finding.evidence))), style="dim"
    )
    if finding is not None and finding.correction:
        text.append("\n→ " + plain(sentence(finding.correction)), style=STYLES[result.verdict])
    return text


def _print_to_act_on(console: "Console", run: Run) -> None:
    groups = to_act_on(run)
    if not groups:
        return
    console.print("\n[bold]What an author would act on[/bold]")
    for title, group in groups.items():
        console.print(f"\n{title}", style="italic")
        for result in group:
            console.print(_line(result))
    console.print()


def _line(result: Result) -> "Text":
    found = result.finding
    words = "" if found is None else plain(sentence(found.correction or found.evidence))
    line = _verdict(result)
    line.append(f"  {result.claim.id}, {plain(result.claim.place)}: ", style="default")
    line.append(words, style="default")
    return line
