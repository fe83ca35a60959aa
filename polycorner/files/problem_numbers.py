"""Numbers in problem files, and tables of coordinates beside them, read with all their digits."""

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

from polycorner.checks import about, instance, names, refuse
from polycorner.container import FileError
from polycorner.files.formulas import BITS, LARGEST, LONG

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
