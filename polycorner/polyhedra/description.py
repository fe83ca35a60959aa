"""Polyhedra as tables: their functions with formulas, and how they are joined."""

from collections.abc import Iterator, Sequence

from polycorner.formulas.functions import SmoothFunction
from polycorner.printing import MOST, Sheet, Table
from polycorner.spaces.manifold import Manifold

LONGEST = 72  # characters of a formula beyond which only its coordinates are listed


def description(
    manifold: Manifold,
    functions: Sequence[SmoothFunction],
    equations: Sequence[SmoothFunction],
    joined: str,
) -> Sheet:
    """Return the sheet of a polyhedron.

    Parameters
    ----------
    manifold : Manifold
        The space of its points.
    functions, equations : sequence of SmoothFunction
        The inequalities ``f >= 0`` and the equations ``h = 0``.
    joined : str
        The and/or tree in words; empty where all inequalities hold together.
    """
    return Sheet(
        f"Polyhedron in {', '.join(_coordinates(manifold))}",
        (
            _table(("inequality", "f >= 0"), functions),
            _table(("equation", "h = 0"), equations),
            f"Joined as {joined}." if joined else "",
        ),
    )


def _coordinates(manifold: Manifold) -> Iterator[str]:
    """Yield the names of the coordinates, those of a sphere or rotation together."""
    for name in manifold.names:
        factor = next((f for f in manifold.factors if name in f.names), None)
        if factor is None:
            yield name
        elif name == factor.names[0]:
            yield f"the unit {factor.kind} ({', '.join(factor.names)})"


def _table(head: tuple[str, str], functions: Sequence[SmoothFunction]) -> Table:
    rows = tuple((f.name, _formula(f)) for f in functions[:MOST])
    hidden = len(functions) - len(rows)
    return Table(head, rows, caption=f"The first {MOST} of {len(functions)}" if hidden else "")


def _formula(f: SmoothFunction) -> str:
    """Return a formula with the values of its parameters, or what it depends on if it is long."""
    definitions, expressions = f.family.formulas()
    reads = ", ".join(f.manifold.names[i] for i in f.reads)
    if definitions or len(str(expressions[f.member_name])) > LONGEST:
        return f"a function of {reads}"
    values = zip(f.family.parameters, f.parameters, strict=True)
    given = ", ".join(f"{name} = {value:g}" for name, value in values)
    return f"{f.expression}{given and f' with {given}'}"
