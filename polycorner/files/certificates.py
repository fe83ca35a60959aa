"""Certificates as JSON: the problem with its formulas, the point, and all results at it."""

import os
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.container import JSON, FileKind, number, read_number
from polycorner.files.polyhedra import (
    Entries,
    manifold_entry,
    mismatch,
    polyhedron_entry,
    read_polyhedron,
)
from polycorner.forms import count, entries, many, optional, text, word
from polycorner.forms import number as real
from polycorner.kinds import checked
from polycorner.minimisation import Certificate, Verdict
from polycorner.minimisation.problem import pose
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy
    from polycorner.polyhedra.polyhedron import Polyhedron

KIND = FileKind("certificate", "save_certificate", JSON)
HEADER = entries(
    {
        "coordinates": many(entries({"value": real()})),
        "tolerance": real(above=0, below=1),
        "rank tolerance": real(above=0, below=1),
        "method": text,
        "iterations": count,
        "search": optional(word(*Verdict.__members__)),
    }
)
SOLVED = 1000  # times the tolerance, for what comes out of linear systems


@checked
def save_certificate(certificate: Certificate, path: str | os.PathLike[str]) -> Path:
    """Write a certificate as JSON, atomically.

    The file holds the formulas of the polyhedron and of the energy as text, the point, and all
    results at it: values, gradients, multipliers, curvatures, residuals and the verdict.

    Parameters
    ----------
    certificate : Certificate
    path : path
        The file; its folder is created if it does not exist.

    Returns
    -------
    Path

    Raises
    ------
    TypeError
        If ``certificate`` is none.
    OSError
        If the file cannot be written.
    """
    c = checks.instance("certificate", certificate, Certificate)
    polyhedron, energy = c.problem.polyhedron, c.problem.energy
    point = zip(manifold_entry(polyhedron.manifold), c.point.tolist(), strict=True)
    entries = {
        "verdict": c.verdict.name,
        "sentence": c.verdict.value,
        "coordinates": [coordinate | {"value": number(x)} for coordinate, x in point],
        **_results(c),
        "tolerance": c.tolerance,
        "rank tolerance": c.rank_tolerance,
        "method": c.method,
        "iterations": int(c.iterations),
        "search": None if c.search is None else c.search.name,
        "problem": polyhedron_entry(polyhedron, energy),
    }
    return KIND.save_json(path, entries)


@checked
def load_certificate(
    path: str | os.PathLike[str],
    polyhedron: "Polyhedron | None" = None,
    energy: "Energy | None" = None,
    *,
    tolerance: float = DEFAULT.alike,
) -> Certificate:
    """Read a certificate back and certify its point again.

    The certificate that is returned is a new one, computed from the formulas and the point.  Its
    results have to be those in the file: values and gradients up to ``tolerance``, relative to the
    larger of the value and the scaled gradient; multipliers and curvatures up to a thousand times
    that, relative to the size of the energy; active functions, signature, entrapment and verdict
    exactly.

    Parameters
    ----------
    path : path
        A file that :func:`save_certificate` wrote.
    polyhedron : Polyhedron, optional
        The polyhedron it was computed for; default that of the file, whose annotations, being
        Python functions, are not in it.
    energy : SmoothFunction or sympy.Expr, optional
        The energy it was computed for; default that of the file.
    tolerance : float, optional
        Default 1e-9.

    Raises
    ------
    ValueError
        Naming the file, if it is no certificate or was changed, or if results differ, naming the
        first that does.
    """
    checks.real("tolerance", tolerance, above=0, below=1)
    if polyhedron is not None and energy is not None:
        pose(polyhedron, energy)
    content = KIND.load_json(path)
    with KIND.reading(path):
        HEADER("", content)
        if polyhedron is None or energy is None:
            own, its = read_polyhedron(content["problem"])
            polyhedron, energy = polyhedron or own, energy if energy is not None else its
        differs = mismatch(content["problem"], polyhedron)
        if not differs:
            found = _certificate(content, polyhedron, energy)
            differs = next(_differences(content, found, tolerance), "")
    if differs:
        raise KIND.refusal(
            path, f"is of another polyhedron or energy, or was not computed here: {differs}"
        )
    return found


def _certificate(content: Entries, polyhedron: "Polyhedron", energy: Any) -> Certificate:
    return Certificate(
        pose(polyhedron, energy),
        np.array([read_number(c["value"]) for c in content["coordinates"]]),
        float(content["tolerance"]),
        float(content["rank tolerance"]),
        str(content["method"]),
        int(content["iterations"]),
        None if content["search"] is None else Verdict[content["search"]],
    )


# ------------------------------------------------------------------------------------------ results


def _results(c: Certificate) -> Entries:
    rows, m = _rows(c), len(c.problem.polyhedron.functions)
    return {
        "energy": rows[-1],
        "functions": rows[:m],
        "equations": rows[m : m + len(c.problem.polyhedron.stated)],
        "multipliers unique": bool(c.multipliers_unique),
        "signature": list(c.signature),
        "curvatures": [number(x) for x in c.curvatures.tolist()],
        "entrapment": {way: kind.value for way, kind in c.entrapment.items()},
        "residuals": {name: number(x) for name, x in asdict(c.residuals).items()},
    }


def _rows(c: Certificate) -> list[Entries]:
    """Return the results for every inequality, every equation and the energy, in this order."""
    d, energy = c.problem.polyhedron, c.problem.energy
    values, gradients = c.problem.evaluate(c.point, 1)
    slopes = (gradients / c.problem.scales).tolist()
    every = (*d.functions, *d.equations, energy)
    rows: list[Entries] = [
        {
            "name": f.name,
            "value": number(value),
            "unit": f.unit,
            "gradient": [number(x) for x in slope],
        }
        for f, value, slope in zip(every, values.tolist(), slopes, strict=True)
    ]
    active, multipliers, ranges = set(c.active), c.multipliers, c.multiplier_ranges
    for row in rows[: len(d.functions)]:
        row["active"] = row["name"] in active
    for row in rows[:-1]:
        if row["name"] in multipliers:
            row["multiplier"] = number(multipliers[row["name"]])
            row["multiplier range"] = [number(x) for x in ranges[row["name"]]]
    return rows


def _differences(written: Entries, c: Certificate, tolerance: float) -> Iterator[str]:
    """Yield the results that are not those written, in words."""
    found, scales, size = _results(c), c.problem.scales, SOLVED * c.analysis.reference
    # Names, written and found numbers, and the size to which a difference is relative.
    evaluated: list[tuple[str, Any, Any, Any]] = []
    solved: list[tuple[str, Any, Any, Any]] = []
    for one, other in zip(_every_row(written), _every_row(found), strict=True):
        name, slopes = other["name"], _numbers(other["gradient"]) * scales
        slope = float(np.nan_to_num(abs(slopes)).max())
        value = np.nan_to_num(abs(read_number(other["value"])))
        evaluated.append((f"value of {name!r}", one["value"], other["value"], max(value, slope)))
        evaluated.append(
            (f"gradient of {name!r}", one["gradient"], other["gradient"], slope / scales)
        )
        key = "multiplier" if found["multipliers unique"] else "multiplier range"
        pull = np.linalg.norm(slopes) or 1.0
        solved.append((f"{key} of {name!r}", one.get(key, []), other.get(key, []), size / pull))
    solved.append(("curvatures", written["curvatures"], found["curvatures"], size))
    residuals = [list(entry["residuals"].values()) for entry in (written, found)]
    solved.append(("residuals", residuals[0], residuals[1], float(SOLVED)))
    for what, one, other, allowed in (*evaluated, *solved):
        a, b = _numbers(one), _numbers(other)
        limit = tolerance * allowed
        if a.shape != b.shape or not np.allclose(a, b, rtol=0.0, atol=limit, equal_nan=True):
            yield f"{what}: written {_words(a)}, found {_words(b)}"
    for key in ("multipliers unique", "signature", "entrapment"):
        if written[key] != found[key]:
            yield f"{key}: written {written[key]}, found {found[key]}"
    active = [[row["name"] for row in e["functions"] if row["active"]] for e in (written, found)]
    if active[0] != active[1]:
        yield f"active functions: written {active[0]}, found {active[1]}"
    if written["verdict"] != c.verdict.name:
        yield f"verdict: written {written['verdict']}, found {c.verdict.name}"


def _every_row(e: Entries) -> list[Entries]:
    return [*e["functions"], *e["equations"], e["energy"]]


def _numbers(written: Any) -> Any:
    values = written if isinstance(written, list) else [written]
    return np.array([read_number(x) for x in values], dtype=np.float64)


def _words(values: Any) -> str:
    return ", ".join(f"{x:.12g}" for x in values) or "none"
