"""The statements of [GMBN], each restated and checked; ``CLAIMS`` in the order of its sections."""

from itertools import chain

from paper_checks import (
    conclusion,
    dyads,
    dyads_moving,
    energetics,
    friction,
    geometry,
    minimisation,
    observed,
    polyhedra,
    strata,
)
from paper_checks.claims import Claim, Finding, Means, Verdict
from paper_checks.records import SECTIONS

ORDER = tuple(SECTIONS)  # the paper's sections, then its appendices

CLAIMS: tuple[Claim, ...] = tuple(
    sorted(
        chain(
            geometry.CLAIMS,
            observed.CLAIMS,
            strata.CLAIMS,
            energetics.CLAIMS,
            dyads.CLAIMS,
            dyads_moving.CLAIMS,
            conclusion.CLAIMS,
            friction.CLAIMS,
            polyhedra.CLAIMS,
            minimisation.CLAIMS,
        ),
        key=lambda claim: ORDER.index(claim.section),
    )
)

__all__ = ["CLAIMS", "Claim", "Finding", "Means", "Verdict"]
