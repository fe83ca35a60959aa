"""What a check is: a claim restated, and a finding with the numbers that decide it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum


class Outcome(Enum):
    """What became of a claim."""

    HOLDS = "holds"
    HOLDS_UNDER = "holds under stated conditions"
    CORRECTED = "corrected"
    REFUTED = "refuted"
    NOT_TESTABLE = "not testable"


@dataclass(frozen=True)
class Finding:
    """The outcome of a check.

    Attributes
    ----------
    outcome : Outcome
        What became of the claim.
    evidence : str
        A sentence, its numbers computed when the check ran.
    figures : mapping from str to float
        Those numbers.
    """

    outcome: Outcome
    evidence: str
    figures: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, restated, with the check that decides it.

    Attributes
    ----------
    id : str
        A letter and a number, such as ``E4``.
    section : str
        Where in the paper.
    statement : str
        The claim in our words.
    means : str
        ``symbolic``, ``proof``, ``numerical`` or ``simulation``.
    check : callable
        Returns the finding.
    """

    id: str
    section: str
    statement: str
    means: str
    check: Callable[[], Finding]
