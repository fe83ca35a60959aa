"""Diagrams of equilibria over a parameter as JSON: the problem's formulas, arcs and events."""

import os
from collections.abc import Iterator
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.branches import Arc, BranchEvent, BranchKind, Diagram
from polycorner.container import JSON, FileKind, plain
from polycorner.files.polyhedra import Entries, load_posed, polyhedron_entry
from polycorner.forms import (
    Form,
    count,
    entries,
    flag,
    made,
    many,
    mapped,
    position,
    row,
    text,
    word,
)
from polycorner.forms import number as real
from polycorner.kinds import checked
from polycorner.minimisation.parametric import lifted_problem
from polycorner.minimisation.problem import Problem
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from pathlib import Path

    from polycorner.minimisation.problem import Energy
    from polycorner.polyhedra.polyhedron import Polyhedron

KIND = FileKind("diagram", "save_diagram", JSON)


@checked
def save_diagram(diagram: Diagram, path: str | os.PathLike[str]) -> "Path":
    """Write a diagram of equilibria as JSON, atomically.

    The file holds the formulas of the polyhedron and of the energy as text, all points of arcs with
    multipliers and energies, and the events; numbers have all their bits.

    Parameters
    ----------
    diagram : Diagram
    path : path
        The file; its folder is created if it does not exist.

    Returns
    -------
    Path

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    problem = diagram.problem
    content = {"problem": polyhedron_entry(problem.polyhedron, problem.energy)}
    for field in fields(diagram)[1:]:  # all but the problem
        content[field.name] = plain(getattr(diagram, field.name))
    return KIND.save_json(path, content)


@checked
def load_diagram(
    path: str | os.PathLike[str],
    polyhedron: "Polyhedron | None" = None,
    energy: "Energy | None" = None,
) -> Diagram:
    """Read a diagram back.

    At all points of arcs the active functions have to vanish, the energy to have its value and to
    be stationary with the multipliers, as far as these are finite, to ``1e-6`` of scaled
    derivatives; and events have to be at the ends of their arcs.  Kinds and indices are taken from
    the file.

    Parameters
    ----------
    path : path
        A file that :func:`save_diagram` wrote.
    polyhedron : Polyhedron, optional
        The polyhedron it was computed for; default that of the file, whose annotations, being
        Python functions, are not in it.
    energy : SmoothFunction or sympy.Expr, optional
        The energy it was computed for; default that of the file.

    Raises
    ------
    ValueError
        If the file is no diagram, was changed, or is of another polyhedron or energy.
    """

    def read(content: Entries, problem: Problem) -> tuple[Diagram | None, str]:
        if differs := _lacking(content, problem):
            return None, differs
        diagram = _read(content, problem)
        return diagram, next(_differences(diagram), "")

    found: Diagram = load_posed(KIND, path, polyhedron, energy, read)
    return found


def _lacking(content: Entries, problem: Problem) -> str:
    """Return which parameters a problem has not, or nothing."""
    rates = entries({"rates": mapped(text, real())})("", content)["rates"]
    written = ", ".join(rates) or "none"
    found = [name for name, values in problem.parameter_values.items() if len(values) == 1]
    if rates and rates.keys() <= {*found}:
        return ""
    return f"parameters with one value: written {written}, found {', '.join(found) or 'none'}"


def _read(content: Entries, problem: Problem) -> Diagram:
    """Return the diagram after a check of each number."""
    n, names = problem.dimension, problem.polyhedron.names
    stated = {*problem.stated(dict.fromkeys([f.name for f in problem.functions[:-1]], np.zeros(1)))}
    arcs, events = (len(content.get(key, ())) for key in ("arcs", "events"))
    numbers, point = made(many(real()), np.array), made(many(real(), exactly=n), np.array)
    active = made(many(word(*names)), tuple)
    header: Entries = entries(
        {"rates": mapped(text, real()), "value": real(), "interval": row(real(), real())}
    )("", content)
    low, high = header["interval"]
    if not low < high:
        checks.refuse("interval", "two ascending numbers", [low, high])
    arc = entries(
        {
            "active": active,
            "parameters": made(many(real(least=low, most=high)), np.array),
            "points": made(many(point), lambda read: np.array(read).reshape(-1, n)),
            "multipliers": mapped(word(*stated), made(many(real(infinite=True)), np.array)),
            "energies": numbers,
            "index": count,
            "events": row(*2 * [position(events, least=-1)]),
        }
    )
    event = entries(
        {
            "kind": made(word(*BranchKind.__members__), lambda name: BranchKind[name]),
            "parameter": real(least=low, most=high),
            "point": point,
            "before": active,
            "after": active,
            "functions": active,
            "arcs": made(many(position(arcs)), tuple),
            "note": text,
        }
    )
    read: Entries = entries(
        {
            "parameter": text,
            "arcs": many(partial(_arc, arc)),
            "events": many(made(event, lambda one: BranchEvent(**one))),
            "closed": flag,
        }
    )("", content)
    lists = {key: tuple(read[key]) for key in ("arcs", "events")}
    diagram = Diagram(problem, **header | read | lists)
    for k, one in enumerate(diagram.events):
        for i, j in enumerate(one.arcs):
            if k not in diagram.arcs[j].events:
                checks.refuse(f"events[{k}].arcs[{i}]", "an arc that ends there", j)
    return diagram


def _arc(form: Form, place: str, value: Any) -> Arc:
    read = form(place, value)
    lengths = {len(read[key]) for key in ("parameters", "points", "energies")}
    lengths |= {len(values) for values in read["multipliers"].values()}
    if len(lengths) > 1 or min(lengths) < 2:
        checks.refuse(place, "two points or more, each with its numbers", sorted(lengths))
    if (np.diff(read["parameters"]) < 0).any() or not np.ptp(read["parameters"]) > 0:
        checks.refuse(f"{place}.parameters", "ascending numbers", "others")
    return Arc(**read)


def _differences(diagram: Diagram) -> Iterator[str]:
    """Yield in what functions and events differ from the file."""
    problem = diagram.problem
    lifted, manifold = lifted_problem(problem, tuple(diagram.rates)), problem.polyhedron.manifold
    for k, arc in enumerate(diagram.arcs):
        for j in range(len(arc.parameters)):
            yield from _off(f"point {j} of arcs[{k}]", arc, j, diagram, lifted)
        for end, which in ((0, arc.events[0]), (-1, arc.events[1])):
            if which < 0:
                continue
            event = diagram.events[which]
            away = manifold.chord(event.point, arc.points[end]) / problem.scales
            far = max(abs(away).max(), abs(event.parameter - arc.parameters[end]))
            if not far <= DEFAULT.near:
                yield f"events[{which}]: written {far:.3g} from an end of arcs[{k}]"


def _off(place: str, arc: Arc, j: int, diagram: Diagram, lifted: Problem) -> Iterator[str]:
    """Yield in what a point of an arc is no equilibrium of its face, or has another energy."""
    n, m = diagram.problem.dimension, lifted.inequalities
    at = [*arc.points[j], *diagram.values_at(float(arc.parameters[j])).values()]
    found, slopes, bends = lifted.evaluate(np.array(at), 2)
    scales = diagram.problem.scales
    slopes, bends = slopes[:, :n] * scales, bends[:, :n, :n] * np.outer(scales, scales)
    # Along a free arc the slope of the energy is zero.
    sizes = np.linalg.norm(slopes, axis=1) + np.linalg.norm(bends, axis=(1, 2))
    names = [f.name for f in lifted.functions]
    held = [names.index(name) for name in arc.active] + [*range(m, lifted.rows - 1)]
    limits = DEFAULT.same * sizes
    for i in held:
        if not abs(found[i]) <= limits[i]:
            yield f"{names[i]!r} at {place}: written as zero, found {found[i]:.12g}"
    if not lifted.polyhedron.is_union:
        for i in np.flatnonzero(~(found[:m] >= -limits[:m])):
            yield f"{names[i]!r} at {place}: written as met, found {found[i]:.12g}"
    energy, limit = arc.energies[j], DEFAULT.alike * max(abs(found[-1]), sizes[-1])
    if not abs(energy - found[-1]) <= limit:
        yield f"energy at {place}: written {energy:.12g}, found {found[-1]:.12g}"
    lam = np.array([values[j] for values in arc.multipliers.values()])
    told = [names.index(name) for name in arc.multipliers]
    if np.isfinite(lam).all():  # they are not where gradients become dependent
        left = slopes[-1] - lam @ slopes[told]
        others = slopes[[i for i in held if i not in told]].T  # of equations that normalise vectors
        left -= others @ np.linalg.lstsq(others, left, rcond=None)[0]
        if not abs(left).max() <= DEFAULT.same * (sizes[-1] + abs(lam) @ sizes[told]):
            yield f"multipliers at {place}: the energy is not stationary with them"
