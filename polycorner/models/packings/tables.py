"""Tables of coordinates as they are published: with white space or commas, headers, indices."""

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.printing import Described
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d{1,3})?", re.ASCII)
COMMENT = re.compile(r"#|%|//|!")
LONGEST = 1000  # characters of a number
Rows = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True)
class CoordinateTable(Checked, Described):
    """Numbers of a table, as they are written.

    Attributes
    ----------
    rows : tuple of tuple of Fraction
        All digits of all numbers.
    names : tuple of str
        The header, or empty.
    """

    rows: Rows
    names: tuple[str, ...] = ()

    @cached_property
    def floats(self) -> Array:
        """The numbers rounded to floats, ``(k, d)``."""
        return np.array(self.rows, dtype=np.float64)

    def __array__(self, dtype: object = None, copy: bool | None = None) -> Array:
        """Return the floats, so that a table can be given where an array is expected."""
        return np.array(self.floats)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.rows)

    @checked
    def part(self, start: int, stop: int) -> "CoordinateTable":
        """Return the columns from ``start`` to ``stop`` (exclusive), counted from 0."""
        width = len(self.rows[0])
        if not 0 <= start < stop <= width:
            checks.refuse("start, stop", f"columns within the {width} of the table", (start, stop))
        rows = tuple([row[start:stop] for row in self.rows])
        return CoordinateTable(rows, self.names[start:stop])

    @checked
    def points(self, manifold: Manifold) -> Array:
        r"""Return the rows as points ``(k, N)`` of a manifold, whose coordinates are in the header.

        Columns may have another order, and further ones are left out.

        Raises
        ------
        ValueError
            For a coordinate without a column, or with two, and columns without a name.

        Examples
        --------
        >>> table = read_coordinates("y,x\n0.5,2\n")
        >>> table.points(Manifold.euclidean("x y")).tolist()
        [[2.0, 0.5]]
        """
        width, named = len(self.rows[0]), "a table whose header has"
        if len(self.names) != width:
            what = f"{named} a word for each of its {width} numbers in a line"
            checks.refuse("manifold", what, [*self.names])
        for name in manifold.names:
            if self.names.count(name) != 1:
                hint = "read with index=False where a first column counts"
                checks.refuse("manifold", f"{named} {name!r} once, {hint}", [*self.names])
        columns = [self.names.index(name) for name in manifold.names]
        return np.asarray(manifold.points(self.floats[:, columns]))

    def __repr__(self) -> str:
        """Return the size."""
        return f"CoordinateTable({len(self.rows)} rows of {len(self.rows[0])} numbers)"


@checked
def read_coordinates(
    table: "str | os.PathLike[str]", *, columns: int | None = None, index: bool | None = None
) -> CoordinateTable:
    r"""Read a table of coordinates, one point in a line.

    Numbers are separated by white space, commas, semicolons or tabs, and are kept with all their
    digits.  Comments begin with ``#``, ``%``, ``!`` or ``//``.  The first line may be a header of
    words, or a single number that is the count of lines to follow, which it has to be.

    Parameters
    ----------
    table : path or str
        The file, or a text of several lines.
    columns : int, optional
        The number of coordinates in a line, without an index; otherwise all lines have to have as
        many as the first one.
    index : bool, optional
        Whether the first column counts the lines and is left out.  By default it does where it
        reads 0, 1, 2, ... or 1, 2, 3, ... in whole numbers without a point, and ``columns``,
        where given, agrees.

    Returns
    -------
    CoordinateTable
        With ``rows`` in fractions and ``floats`` as an array; models take it for an array.

    Raises
    ------
    ValueError
        With the number of the line that is not understood.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> table = read_coordinates("1 -0.25 0.1\n2  0.25 0.1\n")
    >>> table.rows[0]
    (Fraction(-1, 4), Fraction(1, 10))
    """
    if columns is not None:
        checks.whole("columns", columns, least=1)
    if table == "":
        checks.refuse("table", "a file, or a text of several lines", table)
    text = table if isinstance(table, str) and "\n" in table else _content(table)
    text = text.removeprefix("\ufeff")
    lines = list(_lines(text))
    names: tuple[str, ...] = ()
    if lines and not any(NUMBER.fullmatch(word) for word in lines[0][1]):
        names = tuple(lines.pop(0)[1])
    if len(lines) > 1 and len(lines[0][1]) == 1 < len(lines[1][1]):
        _check_count(lines.pop(0), len(lines))
    if not lines:
        checks.refuse("table", "a line of numbers", text)
    width = len(lines[0][1])
    for number, words in lines:
        for word in words:
            if not NUMBER.fullmatch(word) or len(word) > LONGEST:
                _wrong(number, "decimal numbers", word)
            if not math.isfinite(float(re.sub("[dD]", "e", word))):
                _wrong(number, "numbers in the range of doubles", word)
        if len(words) != width:
            _wrong(number, f"{width} numbers, as in line {lines[0][0]}", len(words))
    counted = _counted([words[0] for _, words in lines]) and width > 1
    counted = counted and (columns is None or width == columns + 1)
    skipped = int(counted if index is None else index)
    if columns is not None and width - skipped != columns:
        _wrong(lines[0][0], f"{columns} coordinates", width - skipped)
    if skipped == width:
        _wrong(lines[0][0], "coordinates beside the index", 0)
    rows = tuple([tuple(map(_fraction, words[skipped:])) for _, words in lines])
    return CoordinateTable(rows, names[skipped:] if len(names) == width else names)


def _content(path: "str | os.PathLike[str]") -> str:
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except IsADirectoryError as error:
        msg = f"table: expected a file; {path} is a folder"
        raise ValueError(msg) from error
    except UnicodeDecodeError as error:
        msg = f"table: expected text in UTF-8; {path} has other bytes ({error.reason})"
        raise ValueError(msg) from error


def _lines(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the words of every line that has any, and its number."""
    for number, line in enumerate(text.splitlines(), 1):
        plain = COMMENT.split(line, maxsplit=1)[0].strip()
        if not plain:
            continue
        separated = re.split(r"\s*[,;]\s*", plain) if re.search("[,;]", plain) else plain.split()
        if separated[-1] == "":  # a separator at the end of the line
            separated.pop()
        yield number, separated


def _check_count(line: tuple[int, list[str]], found: int) -> None:
    number, (word,) = line
    if not word.isdecimal() or len(word) > LONGEST or int(word) != found:
        _wrong(number, f"the number of lines that follow, {found}", word)


def _counted(words: list[str]) -> bool:
    """Whether words are whole numbers in succession, from 0 or 1."""
    return words[0] in {"0", "1"} and words == [str(int(words[0]) + k) for k in range(len(words))]


def _fraction(word: str) -> Fraction:
    return Fraction(re.sub("[dD]", "e", word))


def _wrong(line: int, expected: str, got: object) -> None:
    checks.refuse(f"table: line {line}", expected, got)
