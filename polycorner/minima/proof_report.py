"""Proofs as readable text."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from polycorner.minima.proof import Proof

MOST_CELLS = 5


def proof_text(p: "Proof") -> str:
    """Return a proof as a table of its conditions and enclosures."""
    modulo = f", modulo {'; '.join(p.symmetry)}" if p.symmetry else ""
    verdict = f"strict local minimum{modulo}: proved" if p.proved else "not proved"
    rows = [("verdict", verdict), ("active", ", ".join(p.active) or "none")]
    for name, status in p.conditions.items():
        rows.append((name, f"{status}: {p.reasons[name]}"))
    if p.parameters:
        rows += _parameters(p)
    rows += [(name, f"[{lower}, {upper}]") for name, (lower, upper) in p.enclosures.items()]
    width = max(len(name) for name, _ in rows)
    return "\n".join(f"{name:<{width}}  {text}" for name, text in rows)


def _parameters(p: "Proof") -> list[tuple[str, str]]:
    sides = ", ".join(f"{name} in [{a:g}, {b:g}]" for name, (a, b) in p.parameters.items())
    share = f"{100 * p.proved_fraction:.6g} % proved in {len(p.cells)} cells"
    rows = [("parameters", f"{sides}: {share}")]
    for cell in p.undecided[:MOST_CELLS]:
        where = ", ".join(f"{name} in [{a:g}, {b:g}]" for name, (a, b) in cell.parameters.items())
        rows.append(("undecided", f"{where}: {cell.reason}"))
    if len(p.undecided) > MOST_CELLS:
        rows.append(("undecided", f"and {len(p.undecided) - MOST_CELLS} more cells"))
    return rows
