"""The parts of a problem file, each checked when it is read."""

import ast
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

from polycorner.checks import about, instance, names, refuse
from polycorner.container import FileError
from polycorner.files.formulas import (
    BITS,
    CONSTANTS,
    FUNCTIONS,
    LARGEST,
    LONG,
    read_formula,
    symbols,
)
from polycorner.files.indexed import Indexed, comparisons, is_family, syntax
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.periodicity import check_function
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold

Table = dict[str, Any]
MOST_BYTES = 4 * LARGEST  # of a file
NUMBER = re.compile(r"[+-]?(\d+/\d+|(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,4})?)")


def check_keys(place: str, table: Table, keys: Sequence[str]) -> None:
    """Raise ValueError for a key that is none of some."""
    with about(place or "keys"):
        names(place or "keys", table, keys)


def double(place: str, value: Any) -> float:
    """Return the double nearest to a number of a file, which TOML reads as a decimal."""
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        refuse(place, "a number", value)
    found = math.inf
    with suppress(OverflowError):
        found = float(value)
    if not math.isfinite(found):
        refuse(place, "a finite number", str(value)[:LONG])
    return found


def flat(place: str, entry: Any) -> Iterator[Any]:
    """Yield the items of a list, and those of lists in it."""
    for item in instance(place, entry, list):
        if isinstance(item, list):
            yield from (x for x in item)
        else:
            yield item


def exact(place: str, value: Any) -> str:
    """Return the text of a number: a decimal or a fraction, short enough to be worked out."""
    text = str(value) if isinstance(value, int | Decimal) and not isinstance(value, bool) else value
    if not isinstance(text, str) or len(text) > BITS // 4 or not NUMBER.fullmatch(text):
        refuse(place, 'decimals, or fractions such as "1/3"', value)
    try:
        finite = math.isfinite(float(Fraction(text)))
    except (OverflowError, ZeroDivisionError):
        finite = False
    if not finite:
        refuse(place, "finite numbers", text)
    return text


def table_of(place: str, entry: Table, folder: Path) -> list[str]:
    """Return the numbers of a file of coordinates, row by row, and those that follow."""
    check_keys(place, entry, ("file", "columns", "then"))
    if "file" not in entry:
        refuse(
            place,
            "a list of numbers, or a table with a value for each coordinate, or file",
            [*entry],
        )
    name = instance(f"{place}.file", entry["file"], str)
    file = (folder / name).resolve()
    if not file.is_relative_to(folder.resolve()) or not name.strip() or "\0" in name:
        refuse(f"{place}.file", "a file in the folder of the problem", name)
    columns = instance(f"{place}.columns", entry.get("columns", []), list)
    for k in columns:
        if isinstance(k, bool) or not isinstance(k, int) or k < 1:
            refuse(f"{place}.columns", "numbers of columns, counted from 1", columns)
    rows = [*_rows(f"{place}.file", name, limited(file).decode())]
    for number, row in rows:
        if len(row) != len(rows[0][1]) or max(columns, default=0) > len(row):
            wanted = max(len(rows[0][1]), *columns, 0)
            refuse(f"{place}.file", f"{wanted} numbers in line {number} of {name}", len(row))
    chosen = [x for _, row in rows for x in ([row[k - 1] for k in columns] or row)]
    return [*chosen, *flat(f"{place}.then", entry.get("then", []))]


def _rows(place: str, name: str, text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a table with commas or blanks between numbers, and their lines.

    What follows ``#`` is a comment; a first line without any number is a head.
    """
    head = True
    for number, line in enumerate(text.splitlines(), 1):
        content = line.partition("#")[0].strip()
        parts = [x.strip() for x in content.split(",")] if "," in content else content.split()
        if not content or (head and not any(map(NUMBER.fullmatch, parts))):
            head = head and not content
            continue
        head = False
        for part in parts:
            if not NUMBER.fullmatch(part):
                refuse(f"{place}", f"numbers in line {number} of {name}", part)
        yield number, parts


def limited(file: Path) -> bytes:
    """Return the content of a file, unless that is too long."""
    with file.open("rb") as opened:
        content = opened.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        msg = f"{file}: expected a file of at most {MOST_BYTES} bytes; got a longer one"
        raise FileError(msg)
    return content


Range = tuple[float, float]
Functions = Mapping[str, SmoothFunction]
FORMAT = 1
KEYS = (
    "format", "title", "coordinates", "parameters", "inequalities", "equations", "tree", "energy",
    "points",
)  # fmt: skip
COORDINATE = ("names", "sphere", "rotation", "period", "scale", "unit", "box")

_POINT = re.compile(r"\w[\w-]{0,99}")


class Reader:
    """The parts of a file, each checked when it is read."""

    def __init__(self, content: Table, folder: Path) -> None:
        check_keys("", content, KEYS)
        self.content, self.folder = content, folder
        if self._of("format", int, FORMAT) != FORMAT:
            refuse("format", f"{FORMAT}", content["format"])
        self.title: str = self._of("title", str, "")
        self.bound: dict[str, float] = {}
        self.indexed = Indexed({}, {})
        self._parameters()
        self.box: list[Range | None] = []
        self.manifold = self._manifold()
        known = (*self.manifold.names, *self.bound)
        names_twice = [n for n in (*self.indexed.numbers, *self.indexed.constants) if n in known]
        for name in [*names_twice, *(p for p in self.bound if p in self.manifold.names)]:
            refuse(f"parameters.{name}", "a name that no coordinate has", name)
        self.symbols = symbols(known)

    def _of(self, key: str, kind: type, default: Any) -> Any:
        found = self.content.get(key, default)
        if isinstance(found, bool) or not isinstance(found, kind):
            refuse(key, _WORDS[kind], found)
        return found

    def polyhedron(self) -> Polyhedron:
        """Return the set."""
        inequalities = self._made("inequalities", (ast.LtE, ast.GtE))
        equations = self._made("equations", (ast.Eq,))
        return Polyhedron(self.manifold, self._tree(inequalities), [*equations.values()])

    def _parameters(self) -> None:
        for name, value in self._of("parameters", dict, {}).items():
            place = f"parameters.{name}"
            if name in FUNCTIONS or name in CONSTANTS:
                refuse(place, "a name that no function or constant has", name)
            if isinstance(value, int) and not isinstance(value, bool):
                self.indexed.numbers[name] = value
            elif isinstance(value, Decimal):
                self.bound[name] = double(place, value)
            elif isinstance(value, str):
                exact = {name: self._constant(place, value)}
                self.indexed.constants |= Indexed({}, exact).constants
            else:
                refuse(place, "a number, or a formula in quotes", value)

    def _constant(self, place: str, text: str) -> str:
        """Return the formula of a number."""
        with about(place):
            written = self.indexed.written(syntax(text), {})
        read_formula(written, {}, place)
        return f"({written})"

    def _manifold(self) -> Manifold:
        columns: list[tuple[str, float, float, str]] = []
        groups: dict[str, list[tuple[str, ...]]] = {"sphere": [], "rotation": []}
        for k, entry in enumerate(self._of("coordinates", list, [])):
            place = f"coordinates[{k}]"
            table = {"names": entry} if isinstance(entry, str) else entry
            check_keys(place, instance(place, table, dict), COORDINATE)
            kinds = [kind for kind in ("names", "sphere", "rotation") if kind in table]
            if len(kinds) != 1:
                refuse(place, "one of names, sphere, rotation", ", ".join(table))
            period, scale = (self._number(place, table, key, 1.0) for key in ("period", "scale"))
            unit = instance(f"{place}.unit", table.get("unit", ""), str)
            box = self._box(place, table, lines="period" not in table and kinds == ["names"])
            for some in self._names(f"{place}.{kinds[0]}", table[kinds[0]]):
                if kinds[0] in groups:
                    groups[kinds[0]].append(some)
                columns += [
                    (name, period if "period" in table else math.inf, scale, unit) for name in some
                ]
                self.box += [box] * len(some)
        if not columns:
            refuse(
                "coordinates",
                'a list of names, such as ["x", "y"]',
                self.content.get("coordinates"),
            )
        names_, periods, scales, units = zip(*columns, strict=True)
        given = tuple(groups["sphere"]), tuple(groups["rotation"])
        units = units if any(units) else ()
        with about("coordinates"):
            return Manifold(names_, periods, scales, units, *given)

    def _names(self, place: str, text: Any) -> Iterator[tuple[str, ...]]:
        with about(place):
            for tree, indices in self.indexed.members(instance("names", text, str)):
                parts = tree.elts if isinstance(tree, ast.Tuple) else [tree]
                yield tuple(self.indexed.name(p, indices, coordinate=True) for p in parts)

    def _number(self, place: str, table: Table, key: str, default: float) -> float:
        """Return a positive number, or that of a formula."""
        value, place = table.get(key, default), f"{place}.{key}"
        if isinstance(value, str):
            found = read_formula(self._constant(place, value), {}, place)
            value = Decimal(repr(float(found))) if found.is_real else value
        if isinstance(value, float):
            return value
        return double(place, value)

    def _box(self, place: str, table: Table, *, lines: bool) -> Range | None:
        if "box" not in table:
            return None
        sides = table["box"]
        if not lines or not isinstance(sides, list) or len(sides) != 2:
            refuse(f"{place}.box", "two numbers, for coordinates on lines", sides)
        low, high = (double(f"{place}.box", side) for side in sides)
        if not low < high:
            refuse(f"{place}.box", "a lower number before a higher one", sides)
        return low, high

    def _functions(
        self, key: str, allowed: tuple[type, ...]
    ) -> Iterator[tuple[str, tuple[str, str]]]:
        """Yield name, formula and unit of every function of a table."""
        found: set[str] = set()
        for header, entry in self._of(key, dict, {}).items():
            place = f"{key}.{header}"
            text, unit = _formula_entry(place, entry)
            for name, tree, indices in self._members(place, header, text):
                with about(place):
                    sides = comparisons(tree, allowed)
                    texts = [self.indexed.written(side, indices) for side in sides]
                for label, written in zip(_labels(name, len(sides)), texts, strict=True):
                    if label in found:
                        refuse(place, "names that differ", label)
                    found.add(label)
                    yield label, (written, unit)

    def _members(
        self, place: str, header: str, text: str
    ) -> Iterator[tuple[str, ast.expr, Mapping[str, int]]]:
        """Yield name, formula and indices of every member of a family, or of one function."""
        with about(place):
            tree = syntax(text)
            if not is_family(header):
                yield header, tree, {}
                return
            for node, indices in self.indexed.members(header):
                yield self.indexed.name(node, indices), tree, indices

    def _made(self, key: str, allowed: tuple[type, ...]) -> dict[str, SmoothFunction]:
        """Return the functions of a table; those of one unit are one family."""
        written = dict(self._functions(key, allowed))
        expressions = {
            name: read_formula(text, self.symbols, f"{key}.{name}")
            for name, (text, _) in written.items()
        }
        found: dict[str, SmoothFunction] = {}
        for unit in dict.fromkeys(unit for _, unit in written.values()):
            some = {name: e for name, e in expressions.items() if written[name][1] == unit}
            found |= self._family(some, unit, periodic=key == "inequalities")
        return {name: found[name] for name in written}

    def _family(
        self, some: Mapping[str, Any], unit: str, *, periodic: bool = True
    ) -> dict[str, SmoothFunction]:
        used = {str(s) for e in some.values() for s in e.free_symbols}
        values = {name: value for name, value in self.bound.items() if name in used}
        family = Family.of(some, self.manifold.names, values, unit=unit)
        numbers = tuple(values.values())
        made = {
            name: SmoothFunction.member(family, name, self.manifold, parameters=numbers)
            for name in some
        }
        for f in made.values():
            check_function(f, periodic=periodic)
        return made

    def energy(self) -> tuple[SmoothFunction | None, bool]:
        """Return what is minimised, and whether the file maximises its negative."""
        if "energy" not in self.content:
            return None, False
        if isinstance(self.content["energy"], str):  # a formula alone is minimised
            self.content["energy"] = {"minimise": self.content["energy"]}
        table = self._of("energy", dict, {})
        check_keys("energy", table, ("minimise", "maximise", "name", "unit"))
        kinds = [key for key in ("minimise", "maximise") if key in table]
        if len(kinds) != 1:
            refuse("energy", "one of minimise, maximise", ", ".join(table) or None)
        place, (key,) = f"energy.{kinds[0]}", kinds
        name, unit = (
            instance(f"energy.{k}", table.get(k, d), str)
            for k, d in (("name", "energy"), ("unit", ""))
        )
        with about(place):
            written = self.indexed.written(syntax(instance(place, table[key], str)), {})
        found = read_formula(written, self.symbols, place)
        found = -found if key == "maximise" else found
        if not found.is_Add or len(found.args) <= LONG:
            return self._family({name: found}, unit)[name], key == "maximise"
        terms = {f"{name}{k}": e for k, e in enumerate(found.as_ordered_terms())}
        parts = self._family(terms, unit)  # sparse where it is large
        return SmoothFunction.sum(name, parts.values()), key == "maximise"

    def _tree(self, functions: Functions) -> Any:
        if "tree" not in self.content:
            return [*functions.values()]
        mentioned: set[str] = set()
        root = self._group("tree", self.content["tree"], functions, mentioned)
        rest = [f for name, f in functions.items() if name not in mentioned]
        return [*root.parts, *rest] if isinstance(root, AllOf) else [root, *rest]

    def _group(self, place: str, entry: Any, functions: Functions, mentioned: set[str]) -> Any:
        if not isinstance(entry, dict) or [*entry] not in (["any"], ["all"]):
            refuse(place, "a table with the one key any or all", entry)
        ((word, children),) = entry.items()
        place = f"{place}.{word}"
        parts: list[Any] = []
        for k, child in enumerate(instance(place, children, list)):
            if isinstance(child, str):
                chosen = [*self._chosen(f"{place}[{k}]", child, functions)]
                mentioned.update(f.name for f in chosen)
                parts += chosen
            else:
                parts.append(self._group(f"{place}[{k}]", child, functions, mentioned))
        if not parts:
            refuse(place, "at least one name", children)
        return {"any": AnyOf, "all": AllOf}[word](*parts)

    def _chosen(self, place: str, text: str, functions: Functions) -> Iterator[SmoothFunction]:
        labels: Iterable[str] = [text]
        if text not in functions and is_family(text):
            with about(place):
                labels = [self.indexed.name(node, i) for node, i in self.indexed.members(text)]
        for label in labels:
            with about(place):
                names("tree", [label], functions)
            yield functions[label]

    def points(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Yield the numbers of every point as they are written."""
        for name, written in self._of("points", dict, {}).items():
            place, entry = f"points.{name}", written
            if not _POINT.fullmatch(name):
                refuse("points", "names of letters, digits, _ and -, which name files, too", name)
            if isinstance(written, dict) and set(written) == set(self.manifold.names):
                entry = [written[coordinate] for coordinate in self.manifold.names]
            row = (
                table_of(place, entry, self.folder)
                if isinstance(entry, dict)
                else [*flat(place, entry)]
            )
            if len(row) != self.manifold.size:
                expected = f"{self.manifold.size} numbers, one for each coordinate"
                refuse(place, expected, f"{len(row)} numbers")
            yield name, tuple(exact(place, x) for x in row)


def _labels(name: str, count: int) -> list[str]:
    return [name] if count == 1 else [f"{name}.{k}" for k in range(1, count + 1)]


def _formula_entry(place: str, entry: Any) -> tuple[str, str]:
    table = {"formula": entry} if isinstance(entry, str) else entry
    if not isinstance(table, dict) or "formula" not in table:
        refuse(place, "a formula in quotes, or a table with formula and unit", entry)
    check_keys(place, table, ("formula", "unit"))
    text, unit = (
        instance(f"{place}.{key}", table.get(key, ""), str) for key in ("formula", "unit")
    )
    return text, unit


_WORDS = {int: "a whole number", str: "a text in quotes", dict: "a table", list: "a list"}
