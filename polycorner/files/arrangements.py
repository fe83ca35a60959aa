"""Arrangements as plain values: bodies, walls and periods, by which motions in files are drawn."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.bodies.arrangement import ORIENTATIONS, Arrangement
from polycorner.bodies.shapes import Body, capsule, compound, disc, polygon, polytope, sphere
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.checks import refuse

MOST_POINTS = 10_000  # of a part in a file, so that hulls of forged ones take no time


def arrangement_entry(arrangement: Arrangement) -> dict[str, Any]:
    """Return an arrangement as plain values."""
    turning = np.asarray(arrangement.turning).tolist()
    period = arrangement.period
    sides = None if period is None else [x if np.isfinite(x) else None for x in map(_real, period)]
    return {
        "bodies": _bodies(arrangement.named),
        "fixed": _bodies(arrangement.fixed),
        "walls": {name: _wall(wall) for name, wall in arrangement.walls.items()},
        "orientations": arrangement.orientations,
        "unit": arrangement.unit,
        "period": sides,
        "turning": turning,
    }


def read_arrangement(place: str, entry: Any) -> Arrangement:
    """Return the arrangement of plain values, all of which are checked.

    Raises
    ------
    TypeError, ValueError
        Naming the entry.
    """
    numbers = forms.many(forms.number())
    turning = entry.get("turning") if isinstance(entry, dict) else None
    told = forms.entries(
        {
            "bodies": forms.mapped(forms.text, _read_body),
            "fixed": forms.mapped(forms.text, _read_body),
            "walls": forms.mapped(forms.text, _read_wall),
            "orientations": forms.word(*ORIENTATIONS),
            "unit": forms.text,
            "period": forms.optional(forms.many(forms.optional(forms.number()))),
            "turning": numbers if isinstance(turning, list) else forms.number(),
        }
    )(place, entry)
    return Arrangement(**told)


def _real(value: Any) -> float:
    return float(value)


def _bodies(bodies: Mapping[str, Body]) -> dict[str, Any]:
    return {
        name: {part: [shape.radius, shape.points.tolist()] for part, shape in body.parts.items()}
        for name, body in bodies.items()
    }


def _wall(wall: Wall) -> dict[str, Any]:
    if isinstance(wall, HalfSpace):
        return {"normal": wall.normal.tolist(), "point": wall.point.tolist()}
    axis = None if wall.axis is None else wall.axis.tolist()
    waves = [[k, *wave] for k, wave in wall.waves.items()]
    told = {"radius": wall.radius, "axis": axis, "point": wall.point.tolist()}
    return told | {"spin": wall.spin, "waves": waves}


def _read_body(place: str, entry: Any) -> Body:
    shape = forms.row(forms.number(), forms.many(forms.many(forms.number())))
    parts = forms.mapped(forms.text, shape)(place, entry)
    made = {name: _part(f"{place}.{name}", *told) for name, told in parts.items()}
    if len(made) == 1 and "" in made:
        return made[""]
    return compound(made)


def _part(place: str, radius: float, points: list[list[float]]) -> Body:
    sizes = {len(point) for point in points}
    if sizes not in ({2}, {3}) or len(points) > MOST_POINTS:
        refuse(place, f"up to {MOST_POINTS} points, all in the plane or all in space", len(points))
    flat = sizes == {2}
    if len(points) == 1:
        return (disc if flat else sphere)(radius, points[0])
    if len(points) == 2:
        return capsule(points[0], points[1], radius)
    return (polygon if flat else polytope)(points, radius)


def _read_wall(place: str, entry: Any) -> Wall:
    numbers = forms.many(forms.number())
    if isinstance(entry, dict) and "normal" in entry:
        return HalfSpace(**forms.entries({"normal": numbers, "point": numbers})(place, entry))
    wave = forms.row(forms.count, forms.number(), forms.number())
    told = forms.entries(
        {
            "radius": forms.number(),
            "axis": forms.optional(numbers),
            "point": numbers,
            "spin": forms.number(),
            "waves": forms.many(wave),
        }
    )(place, entry)
    return Cylinder(**told | {"waves": {k: (a, p) for k, a, p in told["waves"]}})
