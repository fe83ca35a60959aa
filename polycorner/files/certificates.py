"""Certificates as JSON: certified anew when they are loaded, and compared with what was written."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.files.certificate_entries import (
    Entries,
    difference,
    energy_difference,
    entries,
    other_names,
)
from polycorner.files.container import Kind, load_json, read_number, save_json
from polycorner.files.models import described, rebuilt, units_of
from polycorner.minimisation import Certificate, Verdict
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra.strata import check_tolerance

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy
    from polycorner.polyhedra.polyhedron import Polyhedron

KIND = Kind("a certificate", "save_certificate", "polycorner certificate", schema=1)
TOLERANCE = 1e-9


def save_certificate(
    certificate: Certificate,
    path: str | os.PathLike[str],
    *,
    model: object = None,
    units: Mapping[str, str] | None = None,
) -> Path:
    """Write a certificate as JSON; the file appears whole or not at all.

    Parameters
    ----------
    certificate : Certificate
    path : path
        The file; its folder is made if need be.
    model : DumbbellPair, Pinball, SphereCluster, TorusDisks or Tutorial, optional
        The model whose polyhedron it is, or for a pair a section of it.  The class and the
        parameters are written too, and :func:`load_certificate` makes the problem from them.
    units : mapping from str to str, optional
        Units of coordinates, functions and ``energy`` by name.  Those of the package's models are
        known, and a circle of period ``2 pi`` is an angle in ``rad``.

    Returns
    -------
    Path

    Raises
    ------
    TypeError, ValueError
        Naming the argument: if the certificate is not of the model's polyhedron, for instance.
    OSError
        If the file cannot be written.
    """
    if not isinstance(certificate, Certificate):
        msg = f"certificate: expected a Certificate; got {type(certificate).__name__}"
        raise TypeError(msg)
    problem = certificate.problem
    known = None if model is None else _of_model(certificate, model)
    chosen = units_of(problem.polyhedron, problem.energy, units)
    return save_json(KIND, path, entries(certificate, chosen) | {"model": known}, indent=1)


def load_certificate(
    path: str | os.PathLike[str],
    polyhedron: "Polyhedron | None" = None,
    energy: "Energy | None" = None,
    *,
    tolerance: float = TOLERANCE,
) -> Certificate:
    """Read a certificate back and certify it anew.

    Everything that the file says is computed again and compared: names, periods and scales
    exactly; values and gradients of all functions and of the energy up to ``tolerance``, relative
    to the larger of the value and the scaled gradient; multipliers, curvatures and residuals up to
    a thousand times that, relative to the energy's own size; active functions, signature,
    entrapment and verdict exactly.

    Parameters
    ----------
    path : path
        A file that :func:`save_certificate` wrote.
    polyhedron : Polyhedron, optional
    energy : SmoothFunction or sympy.Expr, optional
        Those it was computed for: formulas are not in the file.  They may be left out where the
        file names a model that has them.
    tolerance : float, optional
        Default 1e-9.

    Raises
    ------
    ValueError
        If the file is no certificate or was changed, if it says something else than what is
        computed, naming it, or if the polyhedron or the energy is missing.
    """
    check_tolerance("tolerance", tolerance)
    content = load_json(KIND, path)
    try:
        problem = _problem(content, path, polyhedron, energy)
        differs = other_names(content, problem.polyhedron)
        if not differs:
            found = _read(content, problem)
            differs = difference(content, entries(found), tolerance)
    except (AttributeError, IndexError, KeyError, TypeError) as error:
        raise KIND.refusal(path, f"is damaged ({error!r})") from error
    if differs:
        raise KIND.refusal(path, f"is not what is computed here: {differs}")
    return found


def _of_model(c: Certificate, model: Any) -> Entries:
    """Return the entry of a model, after a check that the certificate is of its polyhedron."""
    entry, d = described(model), c.problem.polyhedron
    heading = d.equations[0].parameters[0] if d.equation_names == ("heading",) else None
    own = _polyhedron(model, heading)
    mine = entries(c)
    differs = other_names(mine, own)
    if not differs:
        twin = replace(c, problem=pose(own, c.problem.energy))
        differs = difference(mine, entries(twin), TOLERANCE)
    if differs:
        msg = f"model: expected the one that the certificate is of; got {model!r}, but {differs}"
        raise ValueError(msg)
    energy = getattr(model, "energy", None)
    its = energy is not None and not energy_difference(
        mine, entries(replace(c, problem=pose(d, energy))), TOLERANCE
    )
    return {**entry, "heading": heading, "has the energy": its}


def _polyhedron(model: Any, heading: float | None) -> "Polyhedron":
    whole = heading is None or not hasattr(model, "section")
    found: Polyhedron = model.polyhedron if whole else model.section(heading)
    return found


def _problem(
    content: Entries,
    path: str | os.PathLike[str],
    polyhedron: "Polyhedron | None",
    energy: "Energy | None",
) -> Problem:
    """Return the problem of the file's model, or of what is given in its place."""
    entry: Entries | None = content["model"]
    given = polyhedron is not None and energy is not None
    model: Any = None if entry is None or given else _model(entry, path)
    if polyhedron is None and entry is not None:
        polyhedron = _polyhedron(model, entry["heading"])
    if polyhedron is None:
        names = ", ".join(row["name"] for row in content["functions"])
        msg = f"polyhedron: expected that of {names}, for {path} names no model; got none"
        raise ValueError(msg)
    if energy is None and entry is not None and entry["has the energy"]:
        energy = model.energy
    if energy is None:
        msg = f"energy: expected that of the certificate, for {path} names none; got none"
        raise ValueError(msg)
    return pose(polyhedron, energy)


def _model(entry: Entries, path: str | os.PathLike[str]) -> Any:
    try:
        return rebuilt(entry)
    except ValueError as error:
        raise KIND.refusal(path, f"is of a model that cannot be made: {error}") from error


def _read(content: Entries, problem: Problem) -> Certificate:
    return Certificate(
        problem,
        np.array([read_number(c["value"]) for c in content["coordinates"]]),
        float(content["tolerance"]),
        float(content["rank tolerance"]),
        str(content["method"]),
        int(content["iterations"]),
        None if content["search"] is None else Verdict[content["search"]],
    )
