"""Problems and proofs as plain data, in archives that :mod:`~polycorner.proofs.checker` verifies.

A file of one proof is a zip archive with ``problem.json``: the format, the kind of statement, the
problem (coordinates and their periods; the functions, which are inequalities, equations and the
energy, as one straight-line program with exact constants; the set as a union of intersections), and
the evidence.  Numbers are exact, rational ones as texts.  What follows from them is not stored.

``strict minimum``
    what a :class:`ProvedFace` holds.
``box of parameters``
    the same, with a tree of splits of the box, each node before its halves, and a start in each
    cell.
``minimum between energies``
    what a :class:`~polycorner.proofs.bounded.Witness` holds; fields as nodes of the program.
"""

import io
import json
import math
import os
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

from polycorner.atomic import write_atomically
from polycorner.checks import refuse
from polycorner.formulas.programs import Graph
from polycorner.formulas.ranges import pattern, reads
from polycorner.intervals.enclosures import Formulas, write
from polycorner.minimisation import Problem
from polycorner.proofs.checker.balls import NotShownError
from polycorner.proofs.checker.statements import stated as checked
from polycorner.proofs.parameter_boxes import Interval, ParameterCell, halves
from polycorner.proofs.witnesses import Gauge, Witness
from polycorner.values import Value

PROOF = ("polycorner-proof", 1)
STRICT, BETWEEN, BOX = "strict minimum", "minimum between energies", "box of parameters"
MOST_BRANCHES = 4096
MOST_TURNS = 64  # periods up to this multiple of pi are taken for exact ones


class UncheckedError(Exception):
    """A proof that the checker does not follow, in a sentence."""


def archived(path: str | os.PathLike[str], parts: Mapping[str, bytes]) -> Path:
    """Write the parts of a file as a zip archive; return its path.

    Raises
    ------
    ValueError
        If the name does not end in ``.zip``.
    OSError
        If the file could not be written.
    """
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            # ZipInfo's date is fixed: the same proof is the same file, whenever it is written.
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return write_atomically(path, memory.getvalue(), suffix=".zip")


def stated(
    problem: Problem,
    formulas: Formulas,
    branches: Sequence[Sequence[int]],
    others: Sequence[int] = (),
) -> tuple[dict[str, Any], list[int]]:
    """Return a problem as plain data, and the places of other nodes in its program."""
    manifold, count = problem.polyhedron.manifold, len(formulas.outputs)
    nodes, outputs = program(formulas.graph, (*formulas.outputs, *others))
    data = {
        "coordinates": [*manifold.names, *formulas.free],
        "periods": [*map(period, manifold.periods), *[None] * len(formulas.free)],
        "functions": list(formulas.names),
        "inequalities": problem.inequalities,
        "equations": problem.rows - 1 - problem.inequalities,
        "branches": [list(branch) for branch in branches],
        "nodes": nodes,
        "outputs": outputs[:count],
    }
    return data, outputs[count:]


def program(graph: Graph, outputs: Sequence[int]) -> tuple[list[list[Any]], list[int]]:
    """Return the operations that outputs need, renumbered, and the outputs.

    Selections that are a minimum, a maximum or an absolute value are written as such.
    """
    places: dict[int, int] = {}
    nodes: list[list[Any]] = []
    for a in graph.needed(outputs, partial(reads, graph)):
        op, args = graph.nodes[a]
        found = pattern(graph, a)
        if found:
            op = found.kind.removeprefix("-")
        if op in {"const", "var"}:
            nodes.append([op, str(args[0]) if op == "const" else int(args[0])])
        else:
            nodes.append([op, *(places[b] for b in reads(graph, a))])
        if found and found.kind == "-abs":
            nodes.append(["neg", len(nodes) - 1])
        places[a] = len(nodes) - 1
    return nodes, [places[a] for a in outputs]


def period(value: float) -> str | None:
    """Return a period as an exact number: a multiple of pi if it is one, None for lines.

    >>> period(2 * math.pi), period(0.5), period(math.inf)
    ('2 pi', '1/2', None)
    """
    if not math.isfinite(value):
        return None
    turns = Fraction(value / math.pi).limit_denominator(MOST_TURNS)
    if turns and float(turns) * math.pi == value:
        return f"{turns} pi"
    return str(Fraction(value))


# ----------------------------------------------------------------------------------- single proofs


@dataclass(frozen=True, eq=False)
class ProvedFace(Value):
    """A point that solves the KKT equations of a face, and the symmetries modulo which it is one.

    ``held`` are rows of the active functions and the equations; ``centre`` is near the point, or
    the point itself, and empty for a box of parameters.
    """

    held: tuple[int, ...]
    centre: tuple[Fraction, ...]
    gauges: tuple[Gauge, ...] = ()


def save_face(
    path: str | os.PathLike[str], problem: Problem, formulas: Formulas, face: ProvedFace, bits: int
) -> Path:
    """Save a strict minimum."""
    evidence = _of_face(problem, face, bits) | {"centre": texts(face.centre)}
    return _save(path, STRICT, problem, formulas, face.gauges, evidence)


def _of_face(problem: Problem, face: ProvedFace, bits: int) -> dict[str, Any]:
    m = problem.inequalities
    return {
        "bits": bits,
        "scales": texts(map(Fraction, problem.scales.tolist())),
        "active": [i for i in face.held if i < m],
        "equations": [i for i in face.held if i >= m],
    }


def save_cells(
    path: str | os.PathLike[str],
    problem: Problem,
    formulas: Formulas,
    face: ProvedFace,
    sides: Mapping[str, Interval],
    cells: Sequence[ParameterCell],
    bits: int,
) -> Path:
    """Save strict minima for all parameters in a box."""
    ends = tuple(sides.values())
    evidence = _of_face(problem, face, bits) | {
        "lower": [a.hex() for a, _ in ends],
        "upper": [b.hex() for _, b in ends],
        "tree": list(_tree(problem, ends, sides, cells)),
    }
    return _save(path, BOX, problem, formulas, face.gauges, evidence)


def _tree(
    problem: Problem,
    ends: tuple[Interval, ...],
    whole: Mapping[str, Interval],
    cells: Sequence[ParameterCell],
) -> Iterator[dict[str, Any]]:
    """Yield the nodes of the subdivision, from the halves that are taken again."""
    known = {tuple(cell.parameters.values()): cell for cell in cells}
    waiting = [ends]
    while waiting:
        sides = waiting.pop()
        if sides in known:
            bounds = (known[sides].bounds[x] for x in problem.polyhedron.manifold.names)
            yield {"start": texts((Fraction(a) + Fraction(b)) / 2 for a, b in bounds)}
            continue
        first, second = halves(sides, whole)
        axis = next(a for a, (x, y) in enumerate(zip(first, second, strict=True)) if x != y)
        yield {"axis": axis, "at": first[axis][1].hex()}
        waiting += [second, first]


def save_minimum(
    path: str | os.PathLike[str], problem: Problem, formulas: Formulas, witness: Witness, bits: int
) -> Path:
    """Save a minimum between two energies; see :mod:`~polycorner.proofs.bounded`."""
    evidence = {
        "bits": bits,
        "scales": texts(map(Fraction, problem.scales.tolist())),
        "order": witness.order,
        "centre": texts(witness.centre),
        "inner": texts(witness.inner),
        "supports": list(witness.supports),
        "equations": list(witness.equations),
        "weights": texts(witness.weights),
        "reach": text(witness.reach),
        "room": [[j, text(x)] for j, x in witness.room.items()],
        "direction": texts(witness.direction),
    }
    return _save(path, BETWEEN, problem, formulas, witness.gauges, evidence)


def _save(
    path: str | os.PathLike[str],
    kind: str,
    problem: Problem,
    formulas: Formulas,
    gauges: Sequence[Gauge],
    evidence: Mapping[str, Any],
) -> Path:
    n = problem.dimension
    fields = [write(formulas.graph, f) for gauge in gauges for f in gauge.field.components]
    data, nodes = stated(problem, formulas, _branches(problem), fields)
    sections = [
        {"field": nodes[k * n : (k + 1) * n], "normal": texts(gauge.normal)}
        for k, gauge in enumerate(gauges)
    ]
    parameters = [*range(n, n + len(formulas.free))]
    data |= {"parameters": parameters, "evidence": {**evidence, "gauges": sections}}
    data = {"format": list(PROOF), "kind": kind, **data}
    try:
        checked(data)
    except NotShownError as error:
        raise UncheckedError(str(error)) from error
    return archived(path, {"problem.json": json.dumps(data, indent=1).encode()})


def _branches(problem: Problem) -> list[list[int]]:
    """Return the set as a union of intersections."""
    _, unions = problem.polyhedron.unions
    count = math.prod(map(len, unions))
    if count > MOST_BRANCHES:
        refuse("save", f"a union of at most {MOST_BRANCHES} intersections", count)
    pieces = problem.polyhedron.signs_to_pieces([0] * problem.inequalities)
    return [sorted(piece) for piece in pieces]


def texts(numbers: Any) -> list[str]:
    """Return exact numbers as texts."""
    return [text(x) for x in numbers]


def text(x: Fraction) -> str:
    """Return an exact number of any length as a text.

    >>> text(Fraction(-3, 2)), text(Fraction(7))
    ('-3/2', '7')
    """
    above, below = (f"{Decimal(part):f}" for part in (x.numerator, x.denominator))
    return above if x.denominator == 1 else f"{above}/{below}"
