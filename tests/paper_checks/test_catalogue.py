"""Every check runs, reaches the verdict recorded in the documentation, and can fail."""

import math
import re
from collections import Counter
from pathlib import Path

import pytest

import paper_checks
from paper_checks import CLAIMS, Claim, Verdict
from paper_checks.figures import FIGURES
from paper_checks.framework.records import SECTIONS
from paper_checks.framework.typesetting import html, plain, sentence

TABLE = Path(paper_checks.__file__).parents[1] / "docs" / "paper_table.md"
ROW = re.compile(r"^\| ([A-Z]\d+[a-z]?) \| (.*) \| ([a-z]+) \| ([a-z ]+) \|$", re.MULTILINE)
NAMES = re.compile(r"\*\*[^*]*\(([A-Z]\d[^)]*)\)\.\*\*")
# Verdicts a wrong statement may get instead of `holds`, and a right one instead of the others.
NO = (Verdict.REFUTED, Verdict.NOT_REPRODUCED, Verdict.CORRECTED)
YES = (Verdict.HOLDS, Verdict.HOLDS_UNDER)


def recorded():
    """Return statement, means and verdict of each claim in the table of the documentation."""
    return {found[1]: found.groups()[1:] for found in ROW.finditer(TABLE.read_text("utf-8"))}


LONG = {"E9", "D14"}  # whose parts are tested by themselves
RECORDED = recorded()
CHECKED = [
    pytest.param(
        claim, id=claim.id, marks=[pytest.mark.slow] if claim.slow or claim.id in LONG else []
    )
    for claim in CLAIMS
]


def test_the_table_has_these_claims_and_no_others():
    assert list(RECORDED) == [claim.id for claim in CLAIMS]


def test_the_page_explains_what_is_corrected_or_refuted_and_names_no_other_claim():
    page = (TABLE.parent / "paper.md").read_text("utf-8")
    named = {name for names in NAMES.findall(page) for name in re.findall(r"[A-Z]\d+[a-z]?", names)}
    assert named <= set(RECORDED)
    no = {verdict.value for verdict in NO}
    wrong = {name for name, (*_, verdict) in RECORDED.items() if verdict in no}
    assert wrong <= named


def test_ids_are_distinct_and_in_the_order_of_the_sections():
    assert max(Counter(claim.id for claim in CLAIMS).values()) == 1
    positions = [list(SECTIONS).index(claim.section) for claim in CLAIMS]
    assert positions == sorted(positions)
    assert {claim.section for claim in CLAIMS} == set(SECTIONS)


def test_claims_are_whole(subtests):
    for claim in CLAIMS:
        with subtests.test(claim.id):
            assert re.fullmatch(r"[A-Z]\d+[a-z]?", claim.id)
            assert claim.statement
            assert claim.place
            assert claim.figure is None or claim.figure in FIGURES
            statement, means, _ = RECORDED[claim.id]
            assert statement == sentence(claim.statement).replace("|", r"\vert ")
            assert means == claim.means.value


@pytest.mark.parametrize("claim", CHECKED)
def test_check(claim: Claim):
    finding = claim.examine()
    assert finding.verdict.value == RECORDED[claim.id][2]
    assert finding.evidence
    assert all(math.isfinite(number) for number in finding.numbers.values())
    assert bool(finding.correction) or finding.verdict not in (
        Verdict.CORRECTED,
        Verdict.HOLDS_UNDER,
    )
    for text in (finding.evidence, finding.correction):
        assert text.count("$") % 2 == 0
        html(text)
        assert "\\" not in plain(text)
    if finding.verdict is Verdict.NOT_TESTABLE:
        assert claim.perturbed is None
        return
    assert claim.perturbed is not None
    other = claim.perturbed()
    assert other.verdict is not finding.verdict
    assert other.verdict in (YES if finding.verdict in NO else NO)
