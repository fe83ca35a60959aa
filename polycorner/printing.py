"""Tables that read alike in a terminal and in a notebook: described once, rendered twice.

The text is plain and aligned, numbers at their decimal points.  The HTML is a fragment without
colours, fonts or scripts of its own, so that it takes on whatever theme it is shown in.
"""

import math
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from itertools import islice

WIDTH = 96  # columns at which sentences are broken in text
MOST = 20  # rows that are shown of a long table


@dataclass(frozen=True)
class Table:
    """Rows of cells under a head.

    Attributes
    ----------
    head : tuple of str
        Titles of the columns; none, and the first column names what is in the others.
    rows : tuple of tuple of str
        The cells.
    numbers : tuple of int
        Positions of the columns that hold numbers.
    caption : str
        What it is a table of, and what was left out.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    caption: str = ""

    def text(self) -> str:
        """Return it as aligned lines."""
        columns = [
            _column(title, cells, number=k in self.numbers)
            for k, (title, *cells) in enumerate(zip(*self._lines(), strict=True))
        ]
        lines = ["  ".join(line).rstrip() for line in zip(*columns, strict=True)]
        return "\n".join([self.caption] * bool(self.caption) + lines[0 if self.head else 1 :])

    def html(self) -> str:
        """Return it as a ``<table>``."""
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
        What is shown.
    parts : tuple of Table or str
        In this order; tables without rows and empty sentences are passed over.
    """

    title: str
    parts: "tuple[Table | str, ...]" = field(default=())

    def _shown(self) -> "list[Table | str]":
        return [part for part in self.parts if (part if isinstance(part, str) else part.rows)]

    def text(self) -> str:
        """Return it as plain text."""
        parts = [
            textwrap.fill(part, WIDTH, break_long_words=False, break_on_hyphens=False)
            if isinstance(part, str)
            else part.text()
            for part in self._shown()
        ]
        return "\n\n".join([f"{self.title}\n{parts[0]}", *parts[1:]] if parts else [self.title])

    def html(self) -> str:
        """Return it as an HTML fragment."""
        parts = [
            f"<p>{escape(part)}</p>" if isinstance(part, str) else part.html()
            for part in self._shown()
        ]
        return f"<div><p><strong>{escape(self.title)}</strong></p>{''.join(parts)}</div>"


class Printed:
    """What is shown as a sheet by ``print`` and in a notebook."""

    def _sheet(self) -> Sheet:
        raise NotImplementedError

    def __str__(self) -> str:
        """Return it as aligned plain text."""
        return self._sheet().text()

    def _repr_html_(self) -> str:
        """Return it as an HTML fragment, for notebooks."""
        return self._sheet().html()


def facts(pairs: Iterable[tuple[str, str]]) -> Table:
    """Return a table of names and what they stand for."""
    return Table((), tuple(pairs))


def listed(
    caption: str,
    head: Sequence[str],
    rows: Iterable[tuple[str, ...]],
    count: int,
    numbers: tuple[int, ...] = (),
) -> Table:
    """Return a table of the first of ``count`` rows whose caption says how many are left out."""
    shown = tuple(islice(rows, MOST))
    left = f" (the first {MOST} of {count})" if count > len(shown) else ""
    return Table(tuple(head), shown, numbers, f"{caption}{left}")


def number(value: float, digits: int = 9) -> str:
    """Return a number in so many significant digits, zero without a sign."""
    return f"{value + 0.0:.{digits}g}"


def names(words: Iterable[str], most: int = 60) -> str:
    """Return names in a row, or how many there are where they would take too much room."""
    every = list(words)
    row = ", ".join(every)
    return row if len(row) <= most else f"{len(every)} functions"


def angle_unit(period: float) -> str:
    """Return ``"rad"`` for a circle measured in radians, nothing for any other coordinate.

    A full turn, or a whole part of it as for headings modulo a half-turn, is such a period.

    >>> [angle_unit(period) for period in (math.tau, math.pi, 1.0, math.inf)]
    ['rad', 'rad', '', '']
    """
    turns = math.tau / period
    return "rad" if round(turns) >= 1 and abs(turns - round(turns)) < 1e-12 * turns else ""


def units(periods: Iterable[float]) -> str:
    """Say in which units the numbers are that bear none.

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
    """Return the coordinates of a point, angles in radians and beside it in degrees."""
    units = [angle_unit(period) for period in periods]
    rows = [(name, number(x)) for name, x in zip(names, point, strict=True)]
    if not any(units):
        return Table(("coordinate", "value"), tuple(rows), (1,))
    turned = [
        (*row, unit, f"{math.degrees(x):.6f} deg" if unit else "")
        for row, unit, x in zip(rows, units, point, strict=True)
    ]
    return Table(("coordinate", "value", "unit", "in degrees"), tuple(turned), (1, 3))


def _column(title: str, cells: Sequence[str], *, number: bool) -> list[str]:
    """Return title and cells of one width, numbers with their points below each other."""
    if number:
        parts = [_split(cell) for cell in cells]
        before = max((len(a) for a, _ in parts), default=0)
        after = max((len(b) for _, b in parts), default=0)
        cells = [f"{a:>{before}}{b:<{after}}" for a, b in parts]
    width = max(map(len, (title, *cells)))
    return [f"{cell:>{width}}" if number else f"{cell:<{width}}" for cell in (title, *cells)]


def _split(cell: str) -> tuple[str, str]:
    """Return what stands before and after the place of the decimal point."""
    whole, point, rest = cell.partition(".")
    return whole, point + rest
