"""Certificates of large polyhedra as text: numbers and counts, no lists of thousands of names."""

from polycorner.minimisation.lemma import Residuals
from polycorner.minimisation.sparse_analysis import SparseAnalysis
from polycorner.minimisation.verdicts import Verdict
from polycorner.printing import Sheet, facts, number


def sparse_sheet(
    a: SparseAnalysis, verdict: Verdict, energy: float, residuals: Residuals, note: str
) -> Sheet:
    """Return a table of the numbers of a certificate, and its explanation."""
    problem = a.local.problem
    rows = (
        ("verdict", verdict.value),
        ("energy", number(energy, 12)),
        ("coordinates", str(problem.dimension)),
        ("active", f"{len(a.active)} of {problem.inequalities} inequalities"),
        ("equations", str(len(problem.polyhedron.equations))),
        ("infeasibility", f"{residuals.infeasibility:.1e}"),
        ("stationarity", f"{residuals.stationarity:.1e}"),
        ("complementarity", f"{residuals.complementarity:.1e}"),
    )
    return Sheet("Certificate", (facts(rows), sparse_explanation(a, verdict, note)))


def sparse_explanation(a: SparseAnalysis, verdict: Verdict, note: str) -> str:
    """Explain a verdict in a few sentences of numbers."""
    problem, first = a.local.problem, a.first
    words = verdict.value
    lines = [
        f"{words[0].upper()}{words[1:]}.",
        (
            f"Of {problem.inequalities} inequalities {len(a.active)} are active; with "
            f"{len(problem.polyhedron.equations)} equations their gradients have rank "
            f"{first.rank}. {len(a.unmoved)} of {problem.dimension} coordinates are read by no "
            "function with a positive multiplier."
        ),
    ]
    if a.obstacle:
        lines.append(f"{a.obstacle[0].upper()}{a.obstacle[1:]}.")
    elif len(a.active):
        values = first.values[: len(a.active)]
        lines.append(
            f"Multipliers of unit gradients lie between {values.min():.3g} and {values.max():.3g}; "
            f"the gradient of the energy is met up to {first.residual:.1e}."
        )
    return "\n".join([*lines, note] if note else lines)
