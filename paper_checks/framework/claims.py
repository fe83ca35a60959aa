"""Claims of the paper, and findings with numbers computed when the check runs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum

from polycorner.toolkit import checks


class Verdict(Enum):
    """Outcome of the check of a claim."""

    HOLDS = "holds"
    HOLDS_UNDER = "holds under stated conditions"
    CORRECTED = "corrected"
    REFUTED = "refuted"
    NOT_REPRODUCED = "not reproduced"  # of simulations, which try some friction and noise only
    NOT_TESTABLE = "not testable"


class Means(Enum):
    """Means by which a claim is checked, the strongest first."""

    SYMBOLIC = "symbolic"
    PROOF = "proof"
    NUMERICAL = "numerical"
    SIMULATION = "simulation"


@dataclass(frozen=True)
class Finding:
    """Result of a check.

    Attributes
    ----------
    verdict : Verdict
        Whether the claim holds.
    evidence : str
        One to three sentences. Every number and expression in it was computed when the check ran.
        Formulas are TeX between dollars.
    numbers : mapping from str to float
        Those numbers by name; all finite.
    correction : str
        The right statement if the printed one is corrected, or the condition under which it
        holds; what an author would act on.
    """

    verdict: Verdict
    evidence: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    correction: str = ""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, restated, with the check that decides it.

    Attributes
    ----------
    id : str
        A letter and a number, such as ``E4``; a part of a claim has one more letter, ``E4a``.
    section : str
        Section of the paper: ``2`` to ``8``, ``A``, ``B`` or ``C``.
    place : str
        Place in that section, in words.
    statement : str
        The claim in our words and symbols. Formulas are TeX between dollars.
    means : Means
        The strongest means that applies.
    check : callable
        Takes no arguments, returns the finding.
    perturbed : callable or None
        The same check of a deliberately wrong statement.  Its verdict has to differ, which shows
        that the check can fail. None only for a claim that is not testable.
    slow : bool
        Whether the check takes more than about ten seconds.
    figure : str or None
        Name of the figure in ``paper_checks.figures`` that shows the claim.
    """

    id: str
    section: str
    place: str
    statement: str
    means: Means
    check: Callable[[], Finding]
    perturbed: Callable[[], Finding] | None
    slow: bool = False
    figure: str | None = None

    def examine(self) -> Finding:
        """Return what the check finds; a simulation alone does not refute what was observed."""
        finding = self.check()
        checks.instance("check", finding, Finding)
        if self.means is Means.SIMULATION and finding.verdict is Verdict.REFUTED:
            return replace(finding, verdict=Verdict.NOT_REPRODUCED)
        return finding
