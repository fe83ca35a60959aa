"""Results of the claims as JSON and as a table in Markdown."""

from collections import Counter
from typing import Any

from paper_checks.framework.claims import Means, Verdict
from paper_checks.framework.running import Result, Run
from paper_checks.framework.typesetting import sentence

VERDICTS = (*(verdict.value for verdict in Verdict), "error")
# Kinds of action for an author.
TO_DO = ("To correct", "Not found in simulations", "Conditions to state")
# Subjects of the paper's sections; A, B and C are its appendices.
SECTIONS = {
    "2": "The experiment and its coordinates",
    "3": "Observations",
    "4": "The motion of a single dumbbell explained",
    "5": "The configuration space of a pair",
    "6": "Minima of the energy",
    "7": "The motion of dyads",
    "8": "Conclusion",
    "A": "Friction of a single dumbbell",
    "B": "Curvilinear polyhedra",
    "C": "Minimising an energy on a polyhedron",
}


def section_name(section: str) -> str:
    """Return the heading of a section: its number and subject."""
    kind = "Appendix" if section.isalpha() else "Section"
    return f"{kind} {section}: {SECTIONS[section]}"


def counts(run: Run) -> dict[str, int]:
    """Return the number of claims with each verdict, in the order of the verdicts."""
    counted = Counter(result.verdict for result in run.results)
    return {verdict: counted[verdict] for verdict in VERDICTS if counted[verdict]}


def to_act_on(run: Run) -> dict[str, tuple[Result, ...]]:
    """Return the results an author would act on, by kind of action, in the order of the paper."""
    groups: dict[str, list[Result]] = {title: [] for title in TO_DO}
    for result in run.results:
        if (title := _to_do(result)) is not None:
            groups[title].append(result)
    return {title: tuple(group) for title, group in groups.items() if group}


def _to_do(result: Result) -> str | None:
    correct, simulate, state = TO_DO
    verdict = None if result.finding is None else result.finding.verdict
    if verdict is Verdict.HOLDS_UNDER:
        return state
    if verdict in (Verdict.REFUTED, Verdict.NOT_REPRODUCED, Verdict.CORRECTED):
        return simulate if result.claim.means is Means.SIMULATION else correct
    return None


def records(run: Run) -> list[dict[str, Any]]:
    """Return one object for each claim that was checked."""
    return [_record(result) for result in run.results]


def _record(result: Result) -> dict[str, Any]:
    claim, finding = result.claim, result.finding
    return {
        "id": claim.id,
        "section": claim.section,
        "claim": claim.statement,
        "means": claim.means.value,
        "verdict": result.verdict,
        "evidence": result.error if finding is None else finding.evidence,
        "correction": "" if finding is None else finding.correction,
        "place": claim.place,
        "numbers": {} if finding is None else dict(finding.numbers),
        "figure": claim.figure,
        "seconds": round(result.seconds, 3),
    }


def markdown(run: Run) -> str:
    """Return a table of the claims, section by section, for the documentation."""
    lines: list[str] = []
    section = ""
    for result in run.results:
        claim = result.claim
        if claim.section != section:
            section = claim.section
            lines += ["", f"## {section_name(section)}", "", *_HEAD]
        statement = sentence(claim.statement).replace("|", r"\vert ")
        lines.append(f"| {claim.id} | {statement} | {claim.means.value} | {result.verdict} |")
    return "\n".join(lines[1:]) + "\n"


_HEAD = ("| | claim | means | verdict |", "|---|---|---|---|")
