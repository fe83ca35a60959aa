"""What a certificate says, as entries of a file, and where two of them differ."""

from collections.abc import Iterator
from dataclasses import asdict
from itertools import zip_longest
from typing import Any

import numpy as np

from polycorner.files.container import number, read_number
from polycorner.files.models import Units
from polycorner.minimisation import Certificate
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array

SOLVED = 1000  # times the tolerance, for what comes out of linear systems
Entries = dict[str, Any]


def entries(c: Certificate, units: Units | None = None) -> Entries:
    """Return a certificate as what JSON can hold."""
    d, manifold = c.problem.polyhedron, c.problem.polyhedron.manifold
    units = units or Units({}, {})
    columns = zip(manifold.names, c.point.tolist(), manifold.periods, manifold.scales, strict=True)
    rows, m = _rows(c, units), len(d.functions)
    return {
        "verdict": c.verdict.name,
        "sentence": c.verdict.value,
        "coordinates": [
            {
                "name": name,
                "value": number(x),
                "unit": units.coordinates.get(name),
                "period": number(period),
                "scale": scale,
            }
            for name, x, period, scale in columns
        ],
        "energy": rows[-1],
        "functions": rows[:m],
        "equations": rows[m:-1],
        "multipliers unique": bool(c.multipliers_unique),
        "signature": list(c.signature),
        "curvatures": [number(x) for x in c.curvatures.tolist()],
        "entrapment": {way: kind.value for way, kind in c.entrapment.items()},
        "residuals": {name: number(x) for name, x in asdict(c.residuals).items()},
        "reference": number(c.analysis.reference),
        "tolerance": c.tolerance,
        "rank tolerance": c.rank_tolerance,
        "method": c.method,
        "iterations": int(c.iterations),
        "search": None if c.search is None else c.search.name,
    }


def _rows(c: Certificate, units: Units) -> list[Entries]:
    """Return what is known of every inequality, every equation and the energy, in this order."""
    d = c.problem.polyhedron
    values, gradients = c.problem.evaluate(c.point, 1)
    names = (*d.names, *d.equation_names, c.problem.energy.name)
    slopes = (gradients / c.problem.scales).tolist()
    rows: list[Entries] = [
        {
            "name": name,
            "value": number(value),
            "unit": units.functions.get(name),
            "gradient": [number(x) for x in slope],
        }
        for name, value, slope in zip(names, values.tolist(), slopes, strict=True)
    ]
    rows[-1]["unit"] = units.energy
    active, multipliers, ranges = set(c.active), c.multipliers, c.multiplier_ranges
    for row in rows[: len(d.functions)]:
        row["active"] = row["name"] in active
    for row in rows[:-1]:
        if row["name"] in multipliers:
            row["multiplier"] = number(multipliers[row["name"]])
            row["multiplier range"] = [number(x) for x in ranges[row["name"]]]
    return rows


# -------------------------------------------------------------------------------------- differences


def other_names(written: Entries, polyhedron: Polyhedron) -> str:
    """Return which names, periods or scales of a polyhedron are others than those written."""
    manifold = polyhedron.manifold
    columns = {"name": manifold.names, "period": manifold.periods, "scale": manifold.scales}
    rows = {"functions": polyhedron.names, "equations": polyhedron.equation_names}
    told = [
        (f"{key}s of the coordinates", [c[key] for c in written["coordinates"]], values)
        for key, values in columns.items()
    ]
    told += [(key, [row["name"] for row in written[key]], names) for key, names in rows.items()]
    for what, one, values in told:
        other = [number(x) if isinstance(x, float) else x for x in values]
        if one != other:
            return f"{what}: written {_list(one)}, found {_list(other)}"
    return ""


def difference(written: Entries, anew: Entries, tolerance: float) -> str:
    """Return the first thing on which entries and those made anew differ, in words, or nothing."""
    pairs = zip_longest(_measured(written), _measured(anew), fillvalue=("", np.empty(0), 1.0))
    found = next((said for pair in pairs if (said := _apart(*pair, tolerance))), "")
    for (what, one), (_, other) in zip(_decided(written), _decided(anew), strict=True):
        if not found and one != other:
            found = f"{what}: written {_list(one)}, found {_list(other)}"
    return found


def energy_difference(written: Entries, anew: Entries, tolerance: float) -> str:
    """Return on what of the energy itself two certificates differ, or nothing."""
    scales = _scales(anew)
    pairs = zip(_of_row(written["energy"], scales), _of_row(anew["energy"], scales), strict=True)
    return next((said for pair in pairs if (said := _apart(*pair, tolerance))), "")


Measure = tuple[str, Array, float]


def _decided(e: Entries) -> Iterator[tuple[str, Any]]:
    """Yield what is decided by the numbers."""
    yield "active functions", [row["name"] for row in e["functions"] if row["active"]]
    for key in ("multipliers unique", "signature", "entrapment", "verdict"):
        yield key, e[key]


def _measured(e: Entries) -> Iterator[Measure]:
    """Yield values, gradients, multipliers, curvatures and residuals with what they are to."""
    scales = _scales(e)
    for row in (*e["functions"], *e["equations"], e["energy"]):
        yield from _of_row(row, scales)
    size = SOLVED * read_number(e["reference"])
    for row in (*e["functions"], *e["equations"]):
        if "multiplier" in row:
            pull = np.linalg.norm(_numbers(row["gradient"]) * scales)
            key = "multiplier" if e["multipliers unique"] else "multiplier range"
            yield f"{key} of {row['name']!r}", _numbers(row[key]) * pull, size
    yield "curvatures", _numbers(e["curvatures"]), size
    yield "residuals", _numbers([*e["residuals"].values()]), float(SOLVED)


def _of_row(row: Entries, scales: Array) -> Iterator[Measure]:
    value, gradient = _numbers(row["value"]), _numbers(row["gradient"]) * scales
    slope = float(abs(gradient).max())
    yield f"value of {row['name']!r}", value, max(float(abs(value).max()), slope)
    yield f"scaled gradient of {row['name']!r}", gradient, slope


def _apart(one: Measure, other: Measure, tolerance: float) -> str:
    """Return the words for two measures that differ; sizes are those of the second."""
    (what, a, _), (_, b, size) = one, other
    same = a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=tolerance * size, equal_nan=True)
    return "" if same else f"{what}: written {_list(a)}, found {_list(b)}"


def _scales(e: Entries) -> Array:
    return _numbers([c["scale"] for c in e["coordinates"]])


def _numbers(written: Any) -> Array:
    values = written if isinstance(written, list) else [written]
    return np.array([read_number(x) for x in values], dtype=np.float64)


def _list(values: Any) -> str:
    if isinstance(values, dict):
        return _list([f"{key} {value}" for key, value in values.items()])
    if not isinstance(values, list | np.ndarray):
        return str(values)
    words = [f"{x:.12g}" if isinstance(x, float) else str(x) for x in values]
    return ", ".join(words) or "none"
