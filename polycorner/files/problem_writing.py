"""Problems as the text of a file."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

from polycorner.checks import about, instance, mapping, refuse
from polycorner.files.formulas import CONSTANTS, FUNCTIONS, formula_text, symbols
from polycorner.files.indexed import is_family
from polycorner.files.problem_numbers import double, exact
from polycorner.files.problem_reading import FORMAT, Range
from polycorner.formulas.functions import SmoothFunction
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold

_DECIMAL = re.compile(r"-?(0|[1-9]\d*)\.\d+(e[+-]?\d+)?")  # TOML needs no quotes for it


def problem_text(
    polyhedron: Polyhedron, energy: SmoothFunction | None, points: Mapping[str, Any],
    box: tuple[Range | None, ...], title: str,
) -> Iterator[str]:  # fmt: skip
    """Yield the lines of a file."""
    manifold = polyhedron.manifold
    if box and len(box) != manifold.size:
        refuse("box", f"{manifold.size} ranges, one for each coordinate", len(box))
    parameters = _Parameters(manifold.names)
    functions = {f: parameters.text(f) for f in (*polyhedron.functions, *polyhedron.stated)}
    terms = [parameters.text(term) for term in energy.terms] if energy is not None else []
    yield f"format = {FORMAT}"
    if title:
        yield f"title = {_quoted(title)}"
    yield from ["coordinates = [", *_coordinates(manifold, box), "]"]
    if _nested(polyhedron.tree):
        yield f"tree = {_tree_text(polyhedron.tree, polyhedron.names)}"
    if energy is not None:
        whole = f"Add({', '.join(terms)})" if len(terms) > 1 else terms[0]
        yield from ["", "[energy]", f"minimise = {_quoted(whole)}"]
        yield from [f"name = {_quoted(energy.name)}"] * (energy.name != "energy")
        yield from [f"unit = {_quoted(energy.unit)}"] * (energy.unit != "")
    if parameters.values:
        yield from ["", "[parameters]"]
        yield from (f"{_quoted(name)} = {_float(x)}" for name, x in parameters.values.items())
    for key, some in (("inequalities", polyhedron.functions), ("equations", polyhedron.stated)):
        if some:
            yield from ["", f"[{key}]", *(_entry(f, functions[f]) for f in some)]
    if points:
        yield from ["", "[points]"]
    for name, point in mapping("points", points).items():
        if not hasattr(point, "__iter__"):
            refuse(f"points.{name}", "numbers", point, TypeError)
        row = [_number_text(f"points.{name}", x) for x in point]
        if len(row) != manifold.size:
            refuse(f"points.{name}", f"{manifold.size} numbers, one for each coordinate", len(row))
        yield f"{_quoted(instance('points', name, str))} = [{', '.join(row)}]"
    yield ""


class _Parameters:
    """The parameters of all functions, one name for each name and value."""

    def __init__(self, taken: Iterable[str]) -> None:
        self.values: dict[str, float] = {}
        self.named: dict[tuple[str, float], str] = {}
        self.taken = {*taken, *FUNCTIONS, *CONSTANTS}

    def text(self, f: SmoothFunction) -> str:
        """Return the formula of a function, in coordinates and these parameters."""
        variables = [f.manifold.names[i] for i in f.reads]
        renamed = dict(zip(f.family.variables, variables, strict=True))
        renamed |= {p: self._name(p, value) for p, value in f.parameter_values.items()}
        formal = f.family.expression(f.member_name)
        new = symbols(renamed.values())
        return formula_text(formal.xreplace({s: new[renamed[str(s)]] for s in formal.free_symbols}))

    def _name(self, parameter: str, value: float) -> str:
        key = (parameter, value)
        if key not in self.named:
            name, k = parameter, 1
            while name in self.taken:
                k += 1
                name = f"{parameter}_{k}"
            self.taken.add(name)
            self.named[key], self.values[name] = name, value
        return self.named[key]


def _coordinates(manifold: Manifold, box: tuple[Range | None, ...]) -> Iterator[str]:
    """Yield entries, one for coordinates in succession that differ in their names only."""
    groups = {some[0]: ("sphere", some) for some in manifold.spheres}
    groups |= {some[0]: ("rotation", some) for some in manifold.rotations}
    left = 0
    default = Manifold(manifold.names, manifold.periods).units
    for i, name in enumerate(manifold.names):
        if left:
            left -= 1
            continue
        kind, some = groups.get(name, ("names", (name,)))
        left = len(some) - 1
        entry = {kind: _quoted(", ".join(some))}
        if math.isfinite(manifold.periods[i]):
            entry["period"] = _float(manifold.periods[i])
        if manifold.scales[i] != 1.0:
            entry["scale"] = _float(manifold.scales[i])
        if manifold.units != default:
            entry["unit"] = _quoted(manifold.units[i])
        if box and (sides := box[i]) is not None:
            entry["box"] = f"[{', '.join(map(_float, sides))}]"
        whole = ", ".join(f"{key} = {value}" for key, value in entry.items())
        yield f"  {entry['names'] if [*entry] == ['names'] else f'{{ {whole} }}'},"


def _entry(f: SmoothFunction, text: str) -> str:
    if is_family(f.name):
        refuse("names", "functions whose names are no families of a file", f.name)
    unit = f", unit = {_quoted(f.unit)}" if f.unit else ""
    formula = f"{{ formula = {_quoted(text)}{unit} }}" if unit else _quoted(text)
    return f"{_quoted(f.name)} = {formula}"


def _nested(tree: Any) -> bool:
    """Whether a tree is more than all functions in their order."""
    leaves = [child for child in tree.children if isinstance(child, int)]
    return bool(tree.union or leaves != [*range(len(tree.children))])


def _tree_text(tree: Any, labels: Sequence[str]) -> str:
    if isinstance(tree, int):
        return _quoted(labels[tree])
    parts = ", ".join(_tree_text(child, labels) for child in tree.children)
    return f"{{ {'any' if tree.union else 'all'} = [{parts}] }}"


def _quoted(text: str) -> str:
    """Return a TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return (
        '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}" for c in escaped) + '"'
    )


def _float(value: float) -> str:
    text = repr(float(value))
    return text if any(c in text for c in ".en") else f"{text}.0"


def _number_text(place: str, value: Any) -> str:
    """Return a number as a file writes it: with all its bits, or as the text that it is."""
    if isinstance(value, str | Fraction | Decimal):
        text = exact(place, str(value))
        return text if _DECIMAL.fullmatch(text) else _quoted(text)
    with about(place):
        return _float(double(place, Decimal(float(value))))
