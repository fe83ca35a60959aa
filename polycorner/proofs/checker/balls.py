"""Numbers, boxes and matrices as balls, and what cannot be shown."""

import math
import re
from collections.abc import Callable, Sequence
from typing import Any

from flint import acb_mat, arb, arb_mat, fmpq

BITS, STEPS = 128, 60
BESIDE = 2.0**-40  # to which points beyond a side are listed: wider than enclosures in doubles
MOST_LETTERS = 4000  # of a number
NUMBER = re.compile(r"(-?[0-9]+)(?:/(0*[1-9][0-9]*))?(?: (pi|e))?|(pi|e)")
ZERO, NAN = arb(0), arb("nan")


class NotShownError(Exception):
    """Something in the file could not be shown."""


def need(condition: object, message: str) -> None:
    if not condition:
        raise NotShownError(message)


def places(numbers: Any, count: int, message: str) -> list[int]:
    """Return numbers of things of which there are ``count``."""
    need(all(type(i) is int and 0 <= i < count for i in numbers), message)
    return list(numbers)


def different(records: Sequence[Any], message: str) -> None:
    need(len({repr(record) for record in records}) == len(records), f"{message} twice")


def nothing(x: arb) -> bool:
    """Whether a number is 0 as far as it is known."""
    return x.contains(0) and abs(x) < arb(2) ** -80


def shown(x: arb) -> bool:
    """Whether a number is shown to be 0."""
    return bool(x == 0)


def square(x: Any) -> Any:
    if not isinstance(x, arb):  # a jet
        return x * x
    return (x.abs_lower() ** 2).union(x.abs_upper() ** 2)


def number(text: str) -> arb:
    """Return a ball for ``"3/2"``, ``"pi"``, ``"e"`` or ``"2 pi"``."""
    need(isinstance(text, str) and len(text) <= MOST_LETTERS, "a number is no text, or too long")
    found = NUMBER.fullmatch(text)
    need(found, f"the number {text}")
    above, below, *units = found.groups() if found else ()
    ratio = arb(fmpq(int(above or 1), int(below or 1)))
    return ratio * (arb.pi() if "pi" in units else arb.const_e() if "e" in units else arb(1))


def sides(record: dict[str, Any], names: Sequence[str], count: int) -> list[list[float]]:
    """Return sides of a box in a record, as doubles."""
    found = [[float.fromhex(text) for text in record[name]] for name in names]
    fine = all(len(side) == count and all(map(math.isfinite, side)) for side in found)
    need(fine and all(a <= b for a, b in zip(*found, strict=True)), f"{record}: sides of a box")
    return found


def hull(lower: Sequence[float], upper: Sequence[float]) -> list[arb]:
    return [arb(a).union(arb(b)) for a, b in zip(lower, upper, strict=True)]


def moved(side: Sequence[float], axis: int, position: float) -> list[float]:
    return [*side[:axis], position, *side[axis + 1 :]]


def dot(x: Sequence[Any], y: Sequence[Any]) -> arb:
    return sum((a * b for a, b in zip(x, y, strict=True)), ZERO)


def turn(x: arb, lower: float, upper: float, period: arb | None) -> arb:
    """Return the multiple of a period that brings ``x`` nearest to the middle of an interval."""
    away = (arb(lower) + arb(upper)) / 2 - x
    return round(float((away / period).mid())) * period if period else ZERO


def column(numbers: Sequence[Any]) -> arb_mat:
    return arb_mat([[x] for x in numbers])


def fitted(a: arb_mat, right: arb_mat) -> list[arb]:
    """Enclose the solution of equations that have one, by nearly an inverse from the left."""
    middle = a.mid().transpose()
    left = (middle * a.mid()).inv().mid() * middle
    return list((left * a).solve(left * right).entries())


def krawczyk(here: Any, there: Any, apart: Sequence[arb]) -> list[arb]:
    """Return the displacements to which Krawczyk's operator maps those of a box.

    ``here`` are values and derivatives of the equations at a point, ``there`` on the box.
    """
    inverse = arb_mat(here[1]).mid().inv().mid()
    defect = arb_mat(len(apart), len(apart), 1) - inverse * arb_mat(there[1])
    return list((defect * column(apart) - inverse * column(here[0])).entries())


def definite(rows: list[list[arb]]) -> bool:
    """Whether all symmetric matrices in an enclosure are positive definite, by elimination."""
    if not rows:
        return True
    (pivot, *row), *rest = rows
    left = [[x - r[0] * y / pivot for x, y in zip(r[1:], row, strict=True)] for r in rest]
    return pivot > 0 and definite(left)


def negatives(form: list[list[arb]]) -> int | None:
    """Return how many eigenvalues of a symmetric matrix are negative; None if not decided."""
    # a matrix of the same inertia, whose eigenvalues are not multiple by structure
    units = [arb(7 * i + 9) / (3 * i + 8) for i in range(len(form))]
    rows = [
        [u * w * x for w, x in zip(units, row, strict=True)]
        for u, row in zip(units, form, strict=True)
    ]
    try:
        found = [x.real for x in acb_mat(arb_mat(rows)).eig()] if rows else []
    except ValueError:
        return None
    return sum(x < 0 for x in found) if all(x < 0 or x > 0 for x in found) else None


def negatives_along(form: list[list[arb]], rows: list[list[arb]]) -> int | None:
    """Return the same on the vectors that rows annihilate: each adds an eigenvalue of each sign."""
    bordered = [[*line, *(row[i] for row in rows)] for i, line in enumerate(form)]
    found = negatives(bordered + [[*row, *[ZERO] * len(rows)] for row in rows])
    return None if found is None else found - len(rows)


def zero(equations: Callable[..., Any], unknowns: list[arb]) -> list[arb] | None:
    """Return a small enclosure of the only zero in a box by Krawczyk's operator, or None."""
    if not unknowns:  # a space of no dimension is one point
        return []
    shown = False
    for _ in range(STEPS):
        centre = [x.mid() for x in unknowns]
        here, there = equations(centre), equations(unknowns)
        try:
            steps = krawczyk(here, there, [x - c for x, c in zip(unknowns, centre, strict=True)])
        except (TypeError, ZeroDivisionError):
            return None
        image = [c + x for c, x in zip(centre, steps, strict=True)]
        pairs = list(zip(unknowns, image, strict=True))
        if not shown and not all(x.contains_interior(y) for x, y in pairs):
            return None
        done = shown and not any(y.rad() < x.rad() for x, y in pairs)
        shown, unknowns = True, [y if y.rad() < x.rad() else x for x, y in pairs]
        if done:
            break
    return unknowns
