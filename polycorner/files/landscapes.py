"""Landscapes as JSON: the problem with its formulas, minima, passes and routes."""

import os
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from polycorner import checks
from polycorner.container import JSON, FileKind, number, plain
from polycorner.files.polyhedra import Entries, load_posed, polyhedron_entry
from polycorner.forms import count, entries, flag, made, many, optional, row, text, word
from polycorner.forms import number as real
from polycorner.kinds import checked
from polycorner.landscapes import Landscape, Minimum, Pass, Route, Side
from polycorner.landscapes.barriers import Kind
from polycorner.minimisation.problem import Problem
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from pathlib import Path

    from polycorner.minimisation.problem import Energy
    from polycorner.polyhedra.polyhedron import Polyhedron

KIND = FileKind("landscape", "save_landscape", JSON)


@checked
def save_landscape(landscape: Landscape, path: str | os.PathLike[str]) -> "Path":
    """Write a landscape as JSON, atomically.

    The file holds the formulas of the polyhedron and of the energy as text, minima and passes with
    the values of all functions there, and the vertices of all routes; numbers have all their bits.

    Parameters
    ----------
    landscape : Landscape
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
    problem = landscape.problem
    content = {
        "problem": polyhedron_entry(problem.polyhedron, problem.energy),
        "minima": [_point(problem, one) for one in landscape.minima],
        "passes": [
            _point(problem, p) | {"index": p.index, "sides": plain(p.sides)}
            for p in landscape.passes
        ],
        "proved": landscape.proved,
        "cap": number(landscape.cap),
        "region": landscape.region,
        "notes": list(landscape.notes),
        "euler": landscape.euler,
    }
    return KIND.save_json(path, content)


@checked
def load_landscape(
    path: str | os.PathLike[str],
    polyhedron: "Polyhedron | None" = None,
    energy: "Energy | None" = None,
) -> Landscape:
    """Read a landscape back.

    All functions have to have the values of the file at minima and passes, to ``1e-9`` of the
    larger of value and scaled slope, and the energy those at the vertices of routes, to ``1e-9`` of
    the largest there.  What is proved is taken from the file: no proof is done again.

    Parameters
    ----------
    path : path
        A file that :func:`save_landscape` wrote.
    polyhedron : Polyhedron, optional
        The polyhedron it was computed for; default that of the file, whose annotations, being
        Python functions, are not in it.
    energy : SmoothFunction or sympy.Expr, optional
        The energy it was computed for; default that of the file.

    Raises
    ------
    ValueError
        If the file is no landscape, was changed, or is of another polyhedron or energy.
    """
    found: Landscape = load_posed(KIND, path, polyhedron, energy, _made)
    return found


def _made(content: Entries, problem: Problem) -> tuple[Landscape, str]:
    """Return the landscape, and in what functions differ from the file."""
    read = _read(content, problem)
    minima = tuple(Minimum(**_fields(Minimum, one)) for one in read["minima"])
    passes = tuple(Pass(**_fields(Pass, one)) for one in read["passes"])
    others = {key: read[key] for key in ("proved", "cap", "region", "euler")}
    found = Landscape(problem, minima, passes, notes=tuple(read["notes"]), **others)
    return found, next(_differences(read, problem), "")


# ----------------------------------------------------------------------------------------- entries


def _point(problem: Problem, one: Minimum | Pass) -> Entries:
    (values,) = problem.evaluate(one.point, 0)
    told = {key: plain(getattr(one, key)) for key in ("point", "energy", "active", "kind", "orbit")}
    return told | {"values": plain(values)}


def _fields(kind: Any, read: Entries) -> Entries:
    return {name: read[name] for name in kind.__dataclass_fields__}


# ------------------------------------------------------------------------------------------- forms


def _read(content: Entries, problem: Problem) -> Entries:
    """Return all entries after a check of each number."""
    n, minima = problem.dimension, len(content.get("minima", ()))
    point = made(many(real(), exactly=n), np.array)
    place = {
        "point": point,
        "energy": _bounds,
        "active": made(many(text), tuple),  # walls of a box and of a region among them
        "orbit": checks.whole,
        "values": made(many(real(infinite=True), exactly=problem.rows), np.array),
    }
    route = entries(
        {
            "vertices": made(many(point), np.array),
            "energies": made(many(real()), np.array),
            "top": real(infinite=True),
            "verified": flag,
        }
    )
    side = entries(
        {
            "minimum": optional(partial(checks.whole, most=minima - 1)),  # negative: outside
            "route": optional(made(route, _route)),
        }
    )
    header = {
        "minima": many(entries(place | {"kind": word("isolated", "locus")})),
        "passes": many(
            entries(
                place
                | {
                    "kind": word(*get_args(Kind)),
                    "index": optional(count),
                    "sides": made(many(side), lambda read: tuple(Side(**one) for one in read)),
                }
            )
        ),
        "proved": flag,
        "cap": real(infinite=True),
        "region": flag,
        "notes": many(text),
        "euler": optional(checks.whole),
    }
    read: Entries = entries(header)("", content)
    outside = any((s.minimum or 0) < 0 for p in read["passes"] for s in p["sides"])
    if outside and not read["region"]:
        checks.refuse("region", "true where sides of passes lead outside", read["region"])
    return read


def _bounds(place: str, value: Any) -> tuple[float, float]:
    low, high = row(real(infinite=True), real(infinite=True))(place, value)
    if low > high:
        checks.refuse(place, "a lower number before a higher one", value)
    return low, high


def _route(read: Entries) -> Route:
    if not 0 < len(read["vertices"]) == len(read["energies"]):
        checks.refuse("vertices", "as many as energies", len(read["vertices"]))
    return Route(**read)


def _differences(read: Entries, problem: Problem) -> Iterator[str]:
    """Yield in what functions differ from the file."""
    names = [f.name for f in problem.functions]
    for kind in ("minima", "passes"):
        for k, one in enumerate(read[kind]):
            place = f"{kind}[{k}]"
            found, slopes = problem.evaluate(one["point"], 1)
            limits = DEFAULT.alike * np.maximum(abs(found), np.linalg.norm(slopes, axis=1))
            for i in np.flatnonzero(~np.isclose(one["values"], found, 0.0, limits)):
                written = f"written {one['values'][i]:.12g}, found {found[i]:.12g}"
                yield f"{names[i]!r} at {place}: {written}"
            (low, high), at, limit = one["energy"], found[-1], limits[-1]
            if not low - limit <= at <= high + limit:
                yield f"energy of {place}: written {low:.12g} to {high:.12g}, found {at:.12g}"
            for side in one.get("sides", ()):
                yield from _off_route(place, side.route, problem)


def _off_route(place: str, route: Route | None, problem: Problem) -> Iterator[str]:
    if route is None:
        return
    found = np.atleast_1d(problem.energy.value(route.vertices))
    slopes = np.linalg.norm(problem.energy.gradient(route.vertices) * problem.scales, axis=-1)
    # At a minimum both may vanish, and the energy is known to within that of the whole way.
    limit = DEFAULT.alike * max(abs(found).max(), slopes.max())
    away = np.flatnonzero(~np.isclose(route.energies, found, 0.0, limit))
    if away.size:
        written, here = route.energies[away[0]], found[away[0]]
        yield f"energy along a route of {place}: written {written:.12g}, found {here:.12g}"
    if route.top < route.energies.max() - limit:
        yield f"top of a route of {place}: written {route.top:.12g}, found {found.max():.12g}"
