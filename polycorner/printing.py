"""Tables and sentences of results, rendered as plain text and as HTML.

The text is aligned, numbers at their decimal points.  The HTML is a fragment without colours,
fonts or scripts of its own, so that it follows the theme of the page that shows it.
"""

import math
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields
from html import escape
from itertools import islice, zip_longest
from typing import Any

import numpy as np

WIDTH = 96  # columns at which sentences are wrapped unless a width is given
GAP = 2  # columns between two columns of a table
FEW_NUMBERS = 6  # up to which an array is shown
MOST_ROWS = 20  # rows that are shown of a long table


@dataclass(frozen=True)
class Table:
    """Rows of cells under a head.

    Attributes
    ----------
    head : tuple of str
        Titles of the columns.  Without titles the first column names the contents of the others.
    rows : tuple of tuple of str
        The cells.
    numbers : tuple of int
        Positions of the columns that hold numbers.
    caption : str
        A line above the table.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    caption: str = ""

    def text(self, width: int | None = None) -> str:
        """Return aligned lines.

        Parameters
        ----------
        width : int, optional
            Columns at which cells of words are wrapped, between words.  Where that is not enough,
            each row becomes lines of titles and values.  No word is ever cut.
        """
        columns = [
            _column(title, cells, number=k in self.numbers)
            for k, (title, *cells) in enumerate(zip(*self._lines(), strict=True))
        ]
        widths = None if width is None else self._widths(columns, width)
        if width is not None and widths is None:
            lines = self._records(width)
        else:
            lines = [
                line
                for row in list(zip(*columns, strict=True))[0 if self.head else 1 :]
                for line in _wrapped(row, widths)
            ]
        caption = self.caption if width is None else _filled(self.caption, width)
        return "\n".join([caption] * bool(caption) + lines)

    def _widths(self, columns: list[list[str]], width: int) -> list[int] | None:
        """Return widths of the columns that fit, or None where no wrapping makes them fit."""
        widths = [len(cells[0]) for cells in columns]
        least = [
            size if k in self.numbers else max(map(_longest_word, cells))
            for k, (size, cells) in enumerate(zip(widths, columns, strict=True))
        ]
        room = width - GAP * (len(widths) - 1)
        if sum(least) > room:
            return None
        while sum(widths) > room:
            shrinkable = [k for k, size in enumerate(widths) if size > least[k]]
            widths[max(shrinkable, key=lambda k: widths[k])] -= 1
        return widths

    def _records(self, width: int) -> list[str]:
        """Return the table as lines of titles and values, a blank line between its rows."""
        head, *rows = self._lines()
        if not self.head:
            return [line for name, *rest in rows for line in (name, *_indented(rest, width))]
        size = max(map(len, head))
        lines: list[str] = []
        for row in rows:
            lines += [""] * bool(lines)
            for title, cell in zip(head, row, strict=True):
                if size + GAP + _longest_word(cell) <= width:
                    lines += _wrapped((f"{title:<{size}}", cell), [size, width - size - GAP])
                else:
                    lines += [title, *_indented([cell], width)]
        return lines

    def html(self) -> str:
        """Return a ``<table>``."""
        caption = f'<caption style="text-align: left">{escape(self.caption)}</caption>'
        head = "".join(self._cell("th", k, title, "col") for k, title in enumerate(self.head))
        body = "".join(
            "<tr>"
            + "".join(
                self._cell("td" if k else "th", k, cell, "" if k else "row")
                for k, cell in enumerate(row)
            )
            + "</tr>"
            for row in self.rows
        )
        return (
            '<table style="border-collapse: collapse; margin: 0 0 1em; font-size: inherit">'
            + (caption if self.caption else "")
            + (f"<thead><tr>{head}</tr></thead>" if self.head else "")
            + f"<tbody>{body}</tbody></table>"
        )

    def _lines(self) -> tuple[tuple[str, ...], ...]:
        width = max((len(row) for row in (self.head, *self.rows)), default=0)
        return (self.head or ("",) * width, *self.rows)

    def _cell(self, tag: str, k: int, cell: str, scope: str) -> str:
        side = "right; font-variant-numeric: tabular-nums" if k in self.numbers else "left"
        style = f"text-align: {side}; vertical-align: top; padding: 0.1em 1.2em 0.1em 0"
        scoped = f' scope="{scope}"' if scope else ""
        return f'<{tag}{scoped} style="{style}">{escape(cell)}</{tag}>'


@dataclass(frozen=True)
class Sheet:
    """A title, and tables and sentences under it.

    Attributes
    ----------
    title : str
        A line above the rest; may be empty.
    parts : tuple of Table or str
        Tables and sentences in this order; those without rows or words are skipped.
    """

    title: str
    parts: "tuple[Table | str, ...]" = field(default=())

    def _shown(self) -> "list[Table | str]":
        return [part for part in self.parts if (part if isinstance(part, str) else part.rows)]

    def text(self, width: int | None = None) -> str:
        """Return plain text, in lines of a given width as far as its words allow."""
        parts = [
            _filled(part, width or WIDTH) if isinstance(part, str) else part.text(width)
            for part in self._shown()
        ]
        title = [_filled(self.title, width or 10**6)] * bool(self.title)
        return "\n\n".join(["\n".join([*title, *parts[:1]]), *parts[1:]])

    def html(self) -> str:
        """Return an HTML fragment."""
        parts = [
            f"<p>{escape(part)}</p>" if isinstance(part, str) else part.html()
            for part in self._shown()
        ]
        title = f"<p><strong>{escape(self.title)}</strong></p>" if self.title else ""
        return f"<div>{title}{''.join(parts)}</div>"


class Printed:
    """Base of results that ``print`` and notebooks show as a sheet."""

    def _sheet(self) -> Sheet:
        """Return what is shown; every result has its own."""
        raise NotImplementedError

    @property
    def sheet(self) -> Sheet:
        """The result as a title, tables and sentences."""
        return self._sheet()

    def __str__(self) -> str:
        """Return aligned plain text."""
        return self._sheet().text()

    def _repr_html_(self) -> str:
        """Return an HTML fragment for notebooks."""
        return self._sheet().html()


def facts(pairs: Iterable[tuple[str, str]]) -> Table:
    """Return a table of names and values without titles."""
    return Table((), tuple(pairs))


def listed(
    caption: str,
    head: Sequence[str],
    rows: Iterable[tuple[str, ...]],
    count: int,
    numbers: tuple[int, ...] = (),
) -> Table:
    """Return the first of ``count`` rows as a table whose caption says that rows are left out."""
    shown = tuple(islice(rows, MOST_ROWS))
    left = f" (the first {MOST_ROWS} of {count})" if count > len(shown) else ""
    return Table(tuple(head), shown, numbers, f"{caption}{left}".strip())


def number(value: float, digits: int = 9) -> str:
    """Return a number with the given significant digits, zero without a sign."""
    return f"{value + 0.0:.{digits}g}"


def names(words: Iterable[str], most: int = 60) -> str:
    """Return names separated by commas, or their number where the list would be too long."""
    every = list(words)
    row = ", ".join(every)
    return row if len(row) <= most else f"{len(every)} functions"


def few(words: Iterable[str], most: int = 60) -> str:
    """Return names separated by commas, the middle ones left out where they would be too many.

    >>> few("abcdefgh", 12)
    'a, b, ..., h'
    """
    every = list(words)
    first = every
    while len(first) > 1 and len(", ".join(first)) > most:
        first = first[: (len(first) + 1) // 2]
    while len(every) > len(first) > 1 and len(", ".join([*first, "...", every[-1]])) > most:
        first = first[:-1]
    return ", ".join(every if len(first) == len(every) else [*first, "...", every[-1]])


def brief(value: Any, most: int = 60) -> str:
    """Return a value in one line, of long ones the beginning, and of large arrays the shape.

    >>> brief(np.zeros((30, 2))), brief(3.0)
    ('30 x 2 numbers', '3.0')
    """
    if isinstance(value, np.ndarray) and value.size > FEW_NUMBERS:
        return f"{' x '.join(map(str, value.shape))} numbers"
    if isinstance(value, tuple | list) and len(repr(value)) > most:
        return f"{len(value)} values"
    text = " ".join(str(value).split())
    return text if len(text) <= most else f"{text[: most - 3]}..."


class Described(Printed):
    """Base of dataclasses that are shown by their fields."""

    def _sheet(self) -> Sheet:
        made: Any = self
        rows = ((f.name, brief(getattr(self, f.name))) for f in fields(made) if f.repr)
        return Sheet(type(self).__name__, (facts(rows),))


def angle_unit(period: float) -> str:
    """Return ``"rad"`` for a circle measured in radians, nothing for any other coordinate.

    Such a circle has the period of a full turn, or of a whole fraction of it: headings modulo a
    half-turn have half of it.

    >>> [angle_unit(period) for period in (math.tau, math.pi, 1.0, math.inf)]
    ['rad', 'rad', '', '']
    """
    turns = math.tau / period
    return "rad" if round(turns) >= 1 and abs(turns - round(turns)) < 1e-12 * turns else ""


def units(periods: Iterable[float]) -> str:
    """Return a sentence on the units of numbers that are printed without one.

    >>> units([math.tau, math.inf])
    'Angles are in radians, all else in the units of the model.'
    """
    if any(map(angle_unit, periods)):
        return "Angles are in radians, all else in the units of the model."
    return "Numbers are in the units of the model."


def titled(name: str, period: float) -> str:
    """Return the title of a column of values of a coordinate, with its unit.

    >>> titled("phi", math.tau), titled("x", math.inf)
    ('phi (rad)', 'x')
    """
    unit = angle_unit(period)
    return f"{name} ({unit})" if unit else name


def coordinates(names: Sequence[str], periods: Sequence[float], point: Sequence[float]) -> Table:
    """Return a table of the first coordinates of a point, angles in radians and in degrees."""
    units = [angle_unit(period) for period in periods]
    rows = [(name, number(x)) for name, x in zip(names, point, strict=True)]
    if not any(units):
        return listed("", ("coordinate", "value"), rows, len(rows), (1,))
    turned = [
        (*row, unit, f"{math.degrees(x):.6f} deg" if unit else "")
        for row, unit, x in zip(rows, units, point, strict=True)
    ]
    return listed("", ("coordinate", "value", "unit", "in degrees"), turned, len(turned), (1, 3))


def _column(title: str, cells: Sequence[str], *, number: bool) -> list[str]:
    """Return title and cells padded to one width, numbers aligned at their decimal points."""
    if number:
        parts = [_split(cell) for cell in cells]
        before = max((len(a) for a, _ in parts), default=0)
        after = max((len(b) for _, b in parts), default=0)
        cells = [f"{a:>{before}}{b:<{after}}" for a, b in parts]
    width = max(map(len, (title, *cells)))
    return [f"{cell:>{width}}" if number else f"{cell:<{width}}" for cell in (title, *cells)]


def _split(cell: str) -> tuple[str, str]:
    """Return the text before and from the decimal point."""
    whole, point, rest = cell.partition(".")
    return whole, point + rest


def _wrapped(row: Sequence[str], widths: Sequence[int] | None) -> list[str]:
    """Return the lines of a row, its cells wrapped where widths are given."""
    if widths is None:
        return [(" " * GAP).join(row).rstrip()]
    cells = [
        [cell] if len(cell) <= width else _filled(cell.rstrip(), width).split("\n")
        for cell, width in zip(row, widths, strict=True)
    ]
    return [
        (" " * GAP)
        .join(f"{part:<{width}}" for part, width in zip(parts, widths, strict=True))
        .rstrip()
        for parts in zip_longest(*cells, fillvalue="")
    ]


def _indented(cells: Iterable[str], width: int) -> list[str]:
    """Return wrapped cells on indented lines of their own."""
    return [
        " " * GAP + line
        for cell in cells
        for line in _filled(cell.strip(), width - GAP).split("\n")
    ]


def _filled(text: str, width: int) -> str:
    return textwrap.fill(text, width, break_long_words=False, break_on_hyphens=False)


def _longest_word(cell: str) -> int:
    return max(map(len, cell.split()), default=0)
