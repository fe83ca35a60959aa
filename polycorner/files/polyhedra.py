"""Polyhedra, functions and arrangements as entries of a file, and made again from these."""

import os
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.bodies.arrangement import ORIENTATIONS, Arrangement
from polycorner.bodies.shapes import Body, capsule, compound, disc, polygon, polytope, sphere
from polycorner.bodies.walls import Cylinder, HalfSpace, Wall
from polycorner.checks import refuse
from polycorner.container import FileKind, number, read_number
from polycorner.files.formulas import formula_text, read_formula, symbols
from polycorner.formulas.expressions import as_expression
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold

Entries = dict[str, Any]


def manifold_entry(manifold: Manifold) -> list[Entries]:
    """Return coordinates with their units, periods and scales, and the factors they belong to."""
    columns = zip(manifold.names, manifold.units, manifold.periods, manifold.scales, strict=True)
    kinds = (("sphere", manifold.spheres), ("rotation", manifold.rotations))
    curved = {name: {kind: some[0]} for kind, groups in kinds for some in groups for name in some}
    return [
        {"name": name, "unit": unit, "period": number(period), "scale": scale}
        | curved.get(name, {})
        for name, unit, period, scale in columns
    ]


def read_manifold(entry: Sequence[Entries]) -> Manifold:
    """Return the manifold of :func:`manifold_entry`."""
    return Manifold(
        tuple(c["name"] for c in entry),
        tuple(read_number(c["period"]) for c in entry),
        tuple(float(c["scale"]) for c in entry),
        tuple(c["unit"] for c in entry),
        _groups(entry, "sphere"),
        _groups(entry, "rotation"),
    )


def _groups(entry: Sequence[Entries], kind: str) -> tuple[tuple[str, ...], ...]:
    """Return the names of the coordinates of every factor of a kind."""
    parts = groupby(entry, lambda coordinate: coordinate.get(kind))
    return tuple(tuple(c["name"] for c in some) for first, some in parts if first is not None)


def polyhedron_entry(polyhedron: Polyhedron, energy: SmoothFunction | None = None) -> Entries:
    """Return a polyhedron, and an energy on it, with all formulas as text.

    Annotations are Python functions, of which only the names are written.
    """
    functions = [*polyhedron.functions, *polyhedron.stated, *([energy] if energy else [])]
    families = {id(f.family): f.family for f in functions}
    position = {key: k for k, key in enumerate(families)}

    def entry(f: SmoothFunction) -> Entries:
        return {
            "name": f.name,
            "family": position[id(f.family)],
            "member": f.member_name,
            "reads": [f.manifold.names[i] for i in f.reads],
            "parameters": list(f.parameters),
        }

    return {
        "coordinates": manifold_entry(polyhedron.manifold),
        "families": [_family_entry(family) for family in families.values()],
        "functions": [entry(f) for f in polyhedron.functions],
        "equations": [entry(h) for h in polyhedron.stated],
        "energy": None if energy is None else entry(energy),
        "tree": _tree_entry(polyhedron.tree),
        "annotations": list(polyhedron.annotations),
    }


def read_polyhedron(entry: Entries) -> tuple[Polyhedron, SmoothFunction | None]:
    """Return the polyhedron and the energy of :func:`polyhedron_entry`, without annotations."""
    one = forms.entries(
        {
            "name": forms.text,
            "family": forms.position(len(entry["families"])),
            "member": forms.text,
            "reads": forms.many(forms.text),
            "parameters": forms.many(forms.number()),
        }
    )
    listed = {"functions": forms.many(one), "equations": forms.many(one)}
    forms.entries(listed | {"energy": forms.optional(one)})("", entry)
    manifold = read_manifold(entry["coordinates"])
    families = [_read_family(family) for family in entry["families"]]

    def function(f: Entries) -> SmoothFunction:
        return SmoothFunction.member(
            families[f["family"]],
            f["member"],
            manifold,
            parameters=f["parameters"],
            reads=f["reads"],
            label=f["name"],
        )

    functions = [function(f) for f in entry["functions"]]
    parts = [_read_tree(child, functions) for child in entry["tree"]["all"]]
    polyhedron = Polyhedron(manifold, parts, [function(h) for h in entry["equations"]])
    return polyhedron, None if entry["energy"] is None else function(entry["energy"])


def mismatch(entry: Entries, polyhedron: Polyhedron) -> str:
    """Return in which names, periods or scales a polyhedron differs from entries, or nothing."""
    manifold, written = polyhedron.manifold, read_manifold(entry["coordinates"])
    rows = [
        ("names of the coordinates", written.names, manifold.names),
        ("periods of the coordinates", written.periods, manifold.periods),
        ("scales of the coordinates", written.scales, manifold.scales),
        ("spheres", sum(written.spheres, ()), sum(manifold.spheres, ())),
        ("rotations", sum(written.rotations, ()), sum(manifold.rotations, ())),
        ("functions", tuple(f["name"] for f in entry["functions"]), polyhedron.names),
        (
            "equations",
            tuple(h["name"] for h in entry["equations"]),
            tuple(h.name for h in polyhedron.stated),
        ),
    ]
    for what, one, other in rows:
        if one != other:
            return f"{what}: written {_words(one)}, found {_words(other)}"
    return ""


def load_posed(
    kind: FileKind,
    path: str | os.PathLike[str],
    polyhedron: Polyhedron | None,
    energy: Any,
    read: Callable[[Entries, Problem], tuple[Any, str]],
) -> Any:
    """Return what is read of a file, for its own polyhedron and energy or for others.

    ``read`` returns it and how it differs from what the functions say, or nothing.
    """
    if polyhedron is not None and energy is not None:
        pose(polyhedron, energy)
    content = kind.load_json(path)
    with kind.reading(path):
        forms.entries({"problem": forms.entries({})})("", content)
        own, its = read_polyhedron(content["problem"])
        chosen = own if polyhedron is None else polyhedron
        differs = mismatch(content["problem"], chosen)
        if not differs:
            problem = pose(chosen, its if energy is None else energy)
            found, differs = read(content, problem)
    if differs:
        raise kind.refusal(path, f"is of another polyhedron or energy: {differs}")
    return found


def _words(values: Sequence[Any]) -> str:
    return ", ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in values) or "none"


def _family_entry(family: Family) -> Entries:
    definitions, expressions = family.formulas()
    return {
        "variables": list(family.variables),
        "parameters": list(family.parameters),
        "definitions": {name: formula_text(e) for name, e in definitions.items()},
        "formulas": {name: formula_text(expressions[name]) for name in family.names},
        "unit": family.unit,
        "stationary": list(family.stationary),
    }


def _read_family(entry: Mapping[str, Any]) -> Family:
    variables, parameters = entry["variables"], entry["parameters"]
    known = symbols([*variables, *parameters, *entry["definitions"]])

    def read(texts: Mapping[str, str]) -> dict[str, Any]:
        given = {f"formula {name!r}": text for name, text in texts.items()}
        found = [as_expression(of, read_formula(text, known, of)) for of, text in given.items()]
        return dict(zip(texts, found, strict=True))

    return Family.of(
        read(entry["formulas"]),
        variables,
        parameters,
        read(entry["definitions"]),
        unit=entry["unit"],
        stationary=entry.get("stationary", ()),
    )


def _tree_entry(tree: Any) -> Any:
    if isinstance(tree, int):
        return tree
    return {"any" if tree.union else "all": [_tree_entry(child) for child in tree.children]}


def _read_tree(entry: Any, functions: Sequence[SmoothFunction]) -> Any:
    if isinstance(entry, int):
        forms.position(len(functions))("tree", entry)
        return functions[entry]
    ((word, children),) = entry.items()
    return {"any": AnyOf, "all": AllOf}[word](*[_read_tree(c, functions) for c in children])


# ------------------------------------------------------------------------------------- arrangements

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
