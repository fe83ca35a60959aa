"""Results of a run of the claims as text for the terminal."""

import textwrap
from collections.abc import Iterator

import click

from paper_checks.framework.claims import Claim, Verdict
from paper_checks.framework.records import counts, section_name, to_act_on
from paper_checks.framework.running import Result, Run
from paper_checks.framework.typesetting import plain, sentence

COLOURS = {
    Verdict.HOLDS.value: "green",
    Verdict.HOLDS_UNDER.value: "cyan",
    Verdict.CORRECTED.value: "yellow",
    Verdict.REFUTED.value: "red",
    Verdict.NOT_REPRODUCED.value: "magenta",
    Verdict.NOT_TESTABLE.value: "bright_black",
    "error": "red",
}
INDENT = 7  # columns before the evidence of a claim
WIDTH = 120


def run_text(run: Run, *, quiet: bool = False, width: int = WIDTH) -> str:
    """Return claims with verdicts and evidence, corrections to act on, and the counts.

    Verdicts are coloured by ANSI sequences; ``quiet`` returns the counts alone.
    """
    lines = [] if quiet else [*_claims(run, width), *_to_act_on(run, width)]
    told = ", ".join(f"{number} {verdict}" for verdict, number in counts(run).items())
    lines.append(f"{len(run.results)} claims: {told}" if told else "0 claims")
    if run.slow:
        lines.append(f"left out as slow (add --slow): {_ids(run.slow)}")
    return "\n".join(lines)


def problems(run: Run) -> list[str]:
    """Return a line for each check that failed to run, and one for those not reached."""
    told = [f"{result.claim.id}: {result.error}" for result in run.errors]
    return told + ([f"interrupted; not run: {_ids(run.missed)}"] if run.missed else [])


def _ids(claims: tuple[Claim, ...]) -> str:
    return ", ".join(claim.id for claim in claims)


def _claims(run: Run, width: int) -> Iterator[str]:
    section = ""
    for result in run.results:
        if result.claim.section != section:
            section = result.claim.section
            yield from ("", click.style(section_name(section), bold=True))
        finding = result.finding
        yield f"{result.claim.id:<{INDENT}}{_verdict(result)}"
        yield _indented(result.claim.statement, width)
        evidence = result.error if finding is None else finding.evidence
        yield click.style(_indented(evidence, width), dim=True)
        if finding is not None and finding.correction:
            yield _indented(finding.correction, width, "→ ")


def _to_act_on(run: Run, width: int) -> Iterator[str]:
    groups = to_act_on(run)
    if not groups:
        return
    yield from ("", click.style("What an author would act on", bold=True))
    for title, group in groups.items():
        yield from ("", title)
        for result in group:
            found = result.finding
            words = "" if found is None else found.correction or found.evidence
            yield f"{_verdict(result)}  {result.claim.id}, {plain(result.claim.place)}:"
            yield _indented(words, width)
    yield ""


def _verdict(result: Result) -> str:
    return click.style(result.verdict, fg=COLOURS[result.verdict])


def _indented(text: str, width: int, mark: str = "") -> str:
    """Return a sentence wrapped between words, to the right of the ids."""
    space = " " * INDENT
    return textwrap.fill(
        mark + plain(sentence(text)),
        width,
        initial_indent=space,
        subsequent_indent=space + " " * len(mark),
        break_long_words=False,
        break_on_hyphens=False,
    )
