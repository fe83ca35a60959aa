"""What an atlas in a file says of its corners and edges, checked against the polyhedron."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from polycorner.files.container import number, read_number
from polycorner.polyhedra.strata import distances
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.registry import CornerRecord
from polycorner.skeletons.tracing import Curve
from polycorner.skeletons.walks import DRIFT
from polycorner.spaces.manifold import Array

VALUES = 1e-9  # by how much, in scale units, functions may differ from their values in the file


def corner_entry(explorer: Explorer, record: CornerRecord) -> dict[str, Any]:
    """Return a corner as entries: the point, the active functions, and the values of all."""
    names = explorer.polyhedron.names
    return {
        "point": record.point.q.tolist(),
        "active": [names[i] for i in sorted(record.active)],
        "values": [number(x) for x in record.point.values.tolist()],
    }


def symmetry_entry(explorer: Explorer) -> dict[str, Any]:
    """Return what can be told of a symmetry without its formulas."""
    symmetry = explorer.symmetry
    spots = [record.point.q for record in explorer.records] + [c.points[0] for c in explorer.curves]
    motions = len(symmetry.directions(explorer.manifold, spots[0])) if spots else None
    return {
        "motions": motions,
        "elements": len(symmetry.elements),
        "relabels": bool(symmetry.relabels),
    }


def fault(explorer: Explorer, content: dict[str, Any]) -> str:
    """Return the first thing in which an atlas does not fit its polyhedron, or nothing."""
    return next(_faults(explorer, content), "")


def _faults(explorer: Explorer, content: dict[str, Any]) -> Iterator[str]:
    yield from _symmetry_faults(explorer, content["symmetry"])
    for k, (record, entry) in enumerate(zip(explorer.records, content["corners"], strict=True)):
        yield from _corner_faults(explorer, k, record, entry)
    for k, curve in enumerate(explorer.curves):
        yield from _end_faults(explorer, k, curve)
        yield from _edge_faults(explorer, k, curve)
    yield from _number_faults(explorer)


def _symmetry_faults(explorer: Explorer, written: dict[str, Any]) -> Iterator[str]:
    here = symmetry_entry(explorer)
    if written != here:
        yield f"symmetry: written {_words(written)}, found {_words(here)}"


def _words(entry: dict[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in entry.items())


def _corner_faults(
    explorer: Explorer, k: int, record: CornerRecord, entry: dict[str, Any]
) -> Iterator[str]:
    names, point = explorer.polyhedron.names, record.point
    if not record.active:
        yield f"corner {k} is on none of the functions"
    values = np.array([read_number(x) for x in entry["values"]])
    slopes = np.linalg.norm(point.gradients, axis=1)
    size = VALUES * np.maximum(slopes, abs(point.values))
    same = np.isclose(values, point.values, rtol=0.0, atol=size, equal_nan=True)
    for i in np.flatnonzero(~same):
        name = [*names, *explorer.polyhedron.equation_names][i]
        yield f"{name!r} at corner {k}: written {values[i]:.12g}, found {point.values[i]:.12g}"
    active = [names[i] for i in sorted(record.active)]
    if entry["active"] != active:
        written = ", ".join(entry["active"])
        yield f"active functions at corner {k}: written {written}, found {', '.join(active)}"


def _end_faults(explorer: Explorer, k: int, curve: Curve) -> Iterator[str]:
    """Yield ends of an edge that no ray of a corner is."""
    for half in (curve.start, curve.stop):
        if half is None:
            continue
        corner, ray = half
        if not (0 <= corner < len(explorer.records)) or not (
            0 <= ray < len(explorer.records[corner].figure.rays)
        ):
            yield f"edge {k} ends at corner {corner}, edge {ray} there, which is not"
    if curve.start is not None:
        record = explorer.records[curve.start[0]]
        if record.figure.rays[curve.start[1]].active != curve.active:
            yield f"edge {k} is not on the functions of the ray that it leaves corner {corner} by"
        if not np.array_equal(record.point.q, curve.points[0]):
            yield f"edge {k} does not begin at its corner"


def _edge_faults(explorer: Explorer, k: int, curve: Curve) -> Iterator[str]:
    d, limit = explorer.polyhedron, max(DRIFT, explorer.quotient.tolerance)
    away, m = _distances(explorer, curve.points), len(d.functions)
    held = np.abs(away[:, [*sorted(curve.active), *range(m, away.shape[1])]])
    if not (held <= limit).all():
        yield f"edge {k}: a point is {np.nanmax(held):.2g} scale units off the functions it is on"
    if (d.implicit_of(away[:, :m]) < -limit).any():
        yield f"edge {k} leaves the polyhedron"


def _distances(explorer: Explorer, points: Array) -> Array:
    """Return signed distances ``f / |grad f|`` in scale units at points ``(k, n)``."""
    values, gradients = explorer.polyhedron.bundle.evaluate(points, 1)
    return np.array(
        [distances(*at) for at in zip(values, gradients * explorer.scales, strict=True)]
    )


def _number_faults(explorer: Explorer) -> Iterator[str]:
    """Yield positions of corners, rays and edges that are not there."""
    corners, edges = len(explorer.records), len(explorer.curves)
    for k, record in enumerate(explorer.records):
        if not all(ray in record.orbit and 0 <= edge < edges for ray, edge in record.edges.items()):
            yield f"corner {k} has edges that are not there"
    for corner, ray in explorer.pending:
        if not (0 <= corner < corners and 0 <= ray < len(explorer.records[corner].figure.rays)):
            yield f"edge {ray} of corner {corner} is to be walked, and is not there"
    for edge, _ in explorer.tried:
        if not 0 <= edge < edges:
            yield f"a face beside edge {edge} was crossed, which is not there"
