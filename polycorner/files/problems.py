"""Problems as TOML files: a polyhedron, an energy and points, by hand or by the library."""

import math
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.atomic import write_atomically
from polycorner.checks import about, instance, mapping, refuse
from polycorner.container import FileError, one_sentence
from polycorner.files.formulas import CONSTANTS, DEEPEST, FUNCTIONS, formula_text, symbols
from polycorner.files.indexed import is_family
from polycorner.files.problem_reading import (
    FORMAT,
    MOST_BYTES,
    Range,
    Reader,
    double,
    exact,
    limited,
)
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

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


@dataclass(frozen=True, eq=False)
class ProblemFile(Checked):
    """The contents of a problem file.

    Attributes
    ----------
    polyhedron : Polyhedron
    energy : SmoothFunction or None
        What is minimised: the negative of what the file maximises.
    maximised : bool
        Whether the file states the negative of the energy.
    points : mapping from str to (n,) array
        Points by name, vectors of spheres and rotations as they are written.
    exact : mapping from str to tuple of str
        The same numbers as the file writes them, with all digits: decimals or fractions.
    box : tuple of (float, float) or None
        Where random points are sought, for each coordinate; None for a whole circle or sphere.
    title : str
    """

    polyhedron: Polyhedron
    energy: SmoothFunction | None = None
    maximised: bool = False
    points: Mapping[str, Array] = field(default_factory=dict)
    exact: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    box: tuple[Range | None, ...] = ()
    title: str = ""


@checked
def load_problem(path: str | os.PathLike[str]) -> ProblemFile:
    """Read a problem from a TOML file; nothing in it is executed.

    ::

        title = "Three equal circles in the unit square"
        coordinates = ["(x[i], y[i]) for i in 1..3", "r"]
        energy.maximise = "r"

        [inequalities]
        "wall[i] for i in 1..3" = "r <= x[i] <= 1 - r"
        "floor[i] for i in 1..3" = "r <= y[i] <= 1 - r"
        "gap[i,j] for i in 1..3 for j in i+1..3" = "(x[i]-x[j])**2 + (y[i]-y[j])**2 - 4*r**2"

        [points]
        table = { file = "circles.csv", then = ["0.2543330950302498"] }

    :doc:`/problems` describes all keys.

    Parameters
    ----------
    path : path
        Tables of points that the file names are read from its folder, or from folders in it.

    Raises
    ------
    ValueError
        Naming file, line and key, what was expected and what came.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "bowl.toml"
    >>> _ = path.write_text('''
    ... coordinates = ["x", "y"]
    ... energy.minimise = "x + y"
    ... inequalities.bowl = "y >= x**2"
    ... points.start = [0, "1/3"]
    ... ''')
    >>> problem = load_problem(path)
    >>> problem.polyhedron.names, problem.points["start"].round(2).tolist()
    (('bowl',), [0.0, 0.33])
    """
    file = Path(path)
    content = limited(file)

    def refusal(why: str) -> ValueError:
        return FileError(f"{file}{_line(content.decode(errors='replace'), why)}: {why}")

    with one_sentence(refusal):
        try:
            entries = tomllib.loads(content.decode(), parse_float=Decimal)
        except (ValueError, RecursionError) as error:
            msg = f"expected a TOML file that can be read; got {error}"
            raise ValueError(msg) from error
        reader = Reader(entries, file.parent)
        energy, maximised = reader.energy()
        points = dict(reader.points())
        return ProblemFile(
            reader.polyhedron(),
            energy,
            maximised,
            {name: np.array([float(Fraction(x)) for x in row]) for name, row in points.items()},
            points,
            tuple(reader.box),
            reader.title,
        )


@checked
def save_problem(
    path: str | os.PathLike[str],
    polyhedron: Polyhedron,
    energy: "SmoothFunction | sympy.Expr | None" = None,
    points: Mapping[str, Any] | None = None,
    *,
    box: Sequence[Range | None] = (),
    title: str = "",
) -> Path:
    """Write a polyhedron, an energy on it and points as a file that :func:`load_problem` reads.

    The file contains formulas with all definitions written out and no Python functions:
    annotations are left out.  Parameters of one name with several values get a number.

    Parameters
    ----------
    path : path
        Ends in ``.toml`` where commands are to read it.
    polyhedron : Polyhedron
    energy : SmoothFunction or sympy.Expr, optional
        To be minimised.
    points : mapping from str to sequence, optional
        Points by name: numbers with all their bits, or decimals and fractions as text.
    box : sequence of (float, float) or None, optional
        Where random points are sought, for each coordinate.
    title : str, optional

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        For names that stand for families in such a file, formulas beyond what is read, and points
        with another number of coordinates.
    OSError
        If it cannot be written.
    """
    if energy is not None and not isinstance(energy, SmoothFunction):
        energy = SmoothFunction("energy", energy, polyhedron.manifold)
    with about("polyhedron"):
        try:
            text = "\n".join(problem_text(polyhedron, energy, points or {}, tuple(box), title))
        except RecursionError:
            refuse("formulas", f"at most {DEEPEST} operations in each other", "deeper ones")
        if len(text.encode()) > MOST_BYTES:
            refuse("formulas", f"at most {MOST_BYTES} bytes", len(text.encode()))
        reader = Reader(tomllib.loads(text, parse_float=Decimal), Path())
        reader.polyhedron(), reader.energy(), [*reader.points()]  # it is read, here or never
    return write_atomically(path, text)


def _line(text: str, why: str) -> str:
    """Return the line of the key that a sentence begins with, where it stands there once."""
    if (written := re.search(r"\(at line (\d+)", why)) is not None:
        return f", line {written[1]}"
    place = why.split(": ", maxsplit=1)[0].partition(".")
    key = place[2] or place[0].partition("[")[0]
    pattern = rf"^\s*(?:[\w.]+\.)?[\"']?{re.escape(key)}[\"']?\s*="
    while key and "." in key and not re.search(pattern, text, re.MULTILINE):
        key = key.rpartition(".")[0]
        pattern = rf"^\s*(?:[\w.]+\.)?[\"']?{re.escape(key)}[\"']?\s*="
    found = [text.count("\n", 0, m.end()) + 1 for m in re.finditer(pattern, text, re.MULTILINE)]
    return f", line {found[0]}" if len(found) == 1 else ""
