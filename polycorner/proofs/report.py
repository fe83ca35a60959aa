"""Proofs as tables."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from polycorner.printing import Sheet, Table, facts, titled, units

if TYPE_CHECKING:
    from collections.abc import Mapping

    from polycorner.proofs.arguments import Interval
    from polycorner.proofs.proof import Proof

MOST_CELLS = 5


def proof_line(p: "Proof") -> str:
    """Return a proof in one line."""
    left = ", ".join(f"{name} {status}" for name, status in p.conditions.items())
    return "Proof(proved)" if p.proved else f"Proof(not proved: {left})"


def proof_sheet(p: "Proof") -> Sheet:
    """Return a proof as tables of its conditions and its enclosures."""
    modulo = f", modulo {'; '.join(p.symmetry)}" if p.symmetry else ""
    verdict = f"strict local minimum{modulo}: proved" if p.proved else "not proved"
    conditions = [(name, f"{status}: {p.reasons[name]}") for name, status in p.conditions.items()]
    return Sheet(
        "Proof",
        (
            facts(
                (
                    ("verdict", verdict),
                    ("active", ", ".join(p.active) or "none"),
                    *conditions,
                    *_parameters(p),
                )
            ),
            Table(("enclosed", "lower bound", "upper bound"), tuple(_enclosures(p)), (1, 2)),
            units(p.certificate.problem.polyhedron.manifold.periods) if p.enclosures else "",
        ),
    )


def _enclosures(p: "Proof") -> Iterator[tuple[str, str, str]]:
    manifold = p.certificate.problem.polyhedron.manifold
    periods = dict(zip(manifold.names, manifold.periods, strict=True))
    for name, (lower, upper) in p.enclosures.items():
        yield titled(name, periods.get(name, float("inf"))), lower, upper


def _parameters(p: "Proof") -> Iterator[tuple[str, str]]:
    if not p.parameters:
        return
    share = f"{100 * p.proved_fraction:.6g} % proved in {len(p.cells)} cells"
    yield "parameters", f"{_sides(p.parameters)}: {share}"
    for cell in p.undecided[:MOST_CELLS]:
        yield "undecided", f"{_sides(cell.parameters)}: {cell.reason}"
    if len(p.undecided) > MOST_CELLS:
        yield "undecided", f"and {len(p.undecided) - MOST_CELLS} more cells"


def _sides(box: "Mapping[str, Interval]") -> str:
    return ", ".join(f"{name} in [{a:g}, {b:g}]" for name, (a, b) in box.items())
