"""All claims, in the order of the paper's sections."""

from itertools import chain

from paper_checks import (
    appendixA,
    appendixB,
    appendixC,
    section2,
    section3,
    section4,
    section5,
    section6,
    section7,
    section8,
)
from paper_checks.framework.claims import Claim
from paper_checks.framework.records import SECTIONS

ORDER = tuple(SECTIONS)  # sections of the paper first, then appendices
PARTS = (section2, section3, section4, section5, section6, section7, section8)
APPENDICES = (appendixA, appendixB, appendixC)

CLAIMS: tuple[Claim, ...] = tuple(
    sorted(
        chain.from_iterable(part.CLAIMS for part in (*PARTS, *APPENDICES)),
        key=lambda claim: ORDER.index(claim.section),
    )
)
