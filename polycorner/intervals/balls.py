"""Ball arithmetic: numbers with an error bound, their operations and derivatives.

A ball is a midpoint and a radius; an operation on balls returns a ball that contains all its
results for arguments in the given balls, rounding included ([Johansson]).  No other module
imports the library behind it, FLINT.

FLINT has one working precision for the whole process, shared by all threads.  What depends on it
therefore runs inside :func:`precision`, which one thread at a time may enter.
"""

import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from functools import lru_cache
from math import ceil
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.operations import OPERATIONS, Operation
from polycorner.formulas.programs import Payload

if TYPE_CHECKING:
    from flint import arb, arb_mat

Ball: TypeAlias = "arb"
Matrix: TypeAlias = "arb_mat"
# Result of a comparison of balls: None where both answers are possible.
Truth: TypeAlias = bool | None


_TURN = RLock()


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Set the working precision to ``bits`` binary digits inside the block.

    Blocks of different threads take turns; a thread may nest its own.  The precision before the
    block is restored after it, however it ends.
    """
    from flint import ctx

    with _TURN:
        before = ctx.prec
        try:
            ctx.prec = bits
            yield
        finally:
            ctx.prec = before


def current_precision() -> int:
    """Return the working precision in binary digits."""
    from flint import ctx

    return int(ctx.prec)


def ball(middle: "Fraction | float | Ball", radius: "Fraction | float | Ball" = 0) -> Ball:
    """Return a ball that contains every number within ``radius`` of ``middle``."""
    from flint import arb

    return arb(_plain(middle), _plain(radius))


def between(lower: Fraction | float, upper: Fraction | float) -> Ball:
    """Return a ball that contains the interval from ``lower`` to ``upper``."""
    return ball(lower).union(ball(upper))


def _plain(number: "Fraction | float | Ball") -> Any:
    from flint import fmpq

    if isinstance(number, Fraction):
        return fmpq(number.numerator, number.denominator)
    return number


def constant(value: Payload) -> Ball:
    """Return a ball about a fraction, ``"pi"`` or ``"e"``."""
    from flint import arb

    if value == "pi":
        return arb.pi()
    if value == "e":
        return arb.const_e()
    return ball(Fraction(value))


# ---------------------------------------------------------------------------------- linear algebra


def balls(numbers: NDArray[np.float64]) -> "list[Ball]":
    """Return numbers as balls without radius."""
    return [ball(x) for x in numbers.tolist()]


def matrix(rows: "Sequence[Sequence[Any]]") -> Matrix:
    """Return a matrix of balls."""
    from flint import arb_mat

    return arb_mat([list(row) for row in rows])


def column(vector: "Sequence[Any]") -> Matrix:
    """Return a matrix of one column."""
    return matrix([[entry] for entry in vector])


def identity(size: int) -> Matrix:
    """Return the unit matrix."""
    return matrix([[int(i == j) for j in range(size)] for i in range(size)])


def entries(vector: Matrix) -> "list[Ball]":
    """Return the entries of a matrix of one column."""
    return list(vector.entries())


def midpoints(balls: "Sequence[Ball]") -> "list[Ball]":
    """Return the midpoints, as balls without radius."""
    return [b.mid() for b in balls]


def middles(balls: "Sequence[Any]") -> NDArray[np.float64]:
    """Return the midpoints of balls, or of rows of balls, as doubles."""
    return np.array([middles(x) if isinstance(x, list | tuple) else float(x.mid()) for x in balls])


def left_inverse(rows: "Sequence[Sequence[Ball]]") -> "Matrix | None":
    """Return an approximate pseudoinverse of a matrix's midpoint; None where it is not finite."""
    middle = middles(rows)
    return matrix(np.linalg.pinv(middle).tolist()) if np.isfinite(middle).all() else None


def middle_inverse(rows: "Sequence[Sequence[Ball]]") -> "Matrix | None":
    """Return an approximate inverse of a matrix's midpoint, or None where it is singular."""
    try:
        return matrix([midpoints(row) for row in rows]).inv().mid()
    except ZeroDivisionError:
        return None


def solve_exactly(
    rows: "Sequence[Sequence[Fraction]]", right: "Sequence[Fraction]"
) -> list[Fraction] | None:
    """Return the solution of linear equations in fractions, or None where they are singular."""
    from flint import fmpq_mat

    left = fmpq_mat([[_plain(x) for x in row] for row in rows])
    try:
        found = left.solve(fmpq_mat([[_plain(x)] for x in right]))
    except ZeroDivisionError:
        return None
    return [Fraction(int(x.p), int(x.q)) for x in found.entries()]


def dot(u: "Sequence[Any]", v: "Sequence[Any]") -> Ball:
    """Return the sum of products."""
    return sum((a * b for a, b in zip(u, v, strict=True)), ball(0))


def integer_relation(numbers: "Sequence[Ball]") -> list[int] | None:
    """Return small whole numbers with which the sum of some balls may vanish.

    The first of them is not zero.  It is found by lattice reduction ([LLL]) and proves nothing.
    None where it is as long as one for random numbers known to this accuracy would be.
    """
    from flint import fmpz_mat

    radius = max(exact(x.rad()) for x in numbers)
    bits = min(current_precision(), _bits(1 / radius) if radius else current_precision())
    scaled = [round(exact(x.mid()) * 2**bits) for x in numbers]
    n = len(numbers)
    rows = [[*(int(i == j) for j in range(n)), scaled[i]] for i in range(n)]
    for row in fmpz_mat(rows).lll().tolist():
        found = [int(entry) for entry in row[:n]]
        if found[0]:
            return found if sum(m.bit_length() for m in found) <= bits // 2 else None
    return None


@lru_cache(maxsize=64)
def roots(coefficients: tuple[int, ...], bits: int) -> "list[Any]":
    """Return enclosures of the roots of a polynomial, which are apart; real ones are real.

    The constant is the first coefficient.  The precision, which the caller has set, is part of what
    is remembered.
    """
    from flint import fmpz_poly

    assert bits == current_precision()
    found: Any = fmpz_poly(list(coefficients)).complex_roots()
    return [root for root, _ in found]


def _bits(number: Fraction) -> int:
    return max(0, number.numerator.bit_length() - number.denominator.bit_length())


MOST_DIGITS = 10_000  # decimal ones that may be asked for
BITS_PER_DIGIT, GUARD_BITS = 3.3220, 64


def bits_for(digits: int) -> int:
    """Return the working precision in binary digits for a number of decimal digits."""
    return ceil(digits * BITS_PER_DIGIT) + GUARD_BITS


# ------------------------------------------------------------------------------- bounds of a ball


def exact(number: Ball) -> Fraction:
    """Return a ball without radius as a fraction."""
    mantissa, exponent = (int(part) for part in number.man_exp())
    return Fraction(mantissa) * Fraction(2) ** exponent


def bounds(number: Ball) -> tuple[Fraction, Fraction]:
    """Return exact lower and upper bounds of a finite ball."""
    return exact(number.lower()), exact(number.upper())


def decimals(
    lower: Fraction, upper: Fraction, digits: int, *, inwards: bool = False
) -> tuple[str, str]:
    """Return decimal bounds of ``digits`` significant digits, rounded outwards (or inwards).

    >>> decimals(Fraction(1, 3), Fraction(2, 3), 4)
    ('0.3333', '0.6667')
    """
    largest = max(abs(lower), abs(upper))
    if not largest:
        return "0", "0"
    place = _magnitude(largest) - digits
    unit = Fraction(10) ** place
    down, up = lower // unit, -(-upper // unit)
    if inwards:
        down, up = -(-lower // unit), upper // unit
    return _decimal(down, place), _decimal(up, place)


def _magnitude(number: Fraction) -> int:
    """Return ``k`` with ``10^(k-1) <= number < 10^k``."""
    bits = number.numerator.bit_length() - number.denominator.bit_length()
    k = bits * 30103 // 100000 - 1
    while Fraction(10) ** k <= number:
        k += 1
    return k


def _decimal(count: int, place: int) -> str:
    """Write ``count * 10^place``; with an exponent where zeros would outnumber the digits."""
    from flint import fmpz

    digits = str(fmpz(abs(count)))
    sign = "-" if count < 0 else ""
    if count == 0:
        return "0"
    if place >= 0 or len(digits) + place < -len(digits):
        head, tail = digits[0], digits[1:]
        power = place + len(tail)
        short = f"{sign}{digits}{'0' * max(place, 0)}"
        return short if 0 <= place <= 6 else f"{sign}{head}{'.' if tail else ''}{tail}e{power}"
    digits = digits.rjust(1 - place, "0")
    return f"{sign}{digits[:place]}.{digits[place:]}"


# -------------------------------------------------------------------------------------- operations


def square(x: Ball) -> Ball:
    """Return ``x^2``, which is never negative."""
    y = x * x
    return y if y > 0 else y.nonnegative_part()


def _less(x: Ball, y: Ball) -> Truth:
    return True if x < y else False if x >= y else None


def _at_most(x: Ball, y: Ball) -> Truth:
    return True if x <= y else False if x > y else None


def _not(x: Truth) -> Truth:
    return None if x is None else not x


def _and(x: Truth, y: Truth) -> Truth:
    return False if x is False or y is False else None if x is None or y is None else True


def _or(x: Truth, y: Truth) -> Truth:
    return _not(_and(_not(x), _not(y)))


def _select(condition: Truth, yes: Ball, no: Ball) -> Ball:
    return yes.union(no) if condition is None else yes if condition else no


@lru_cache(maxsize=1)
def operations() -> dict[str, Callable[..., Any]]:
    """Return the ball operation for each operation of a program."""
    from flint import arb

    return {
        **{name: getattr(arb, name) for name in OPERATIONS},
        "square": square,
        "neg": operator.neg,
        "add": operator.add,
        "sub": operator.sub,
        "mul": operator.mul,
        "div": operator.truediv,
        "pow": operator.pow,
        "atan2": arb.atan2,
        "lt": _less,
        "le": _at_most,
        "not": _not,
        "and": _and,
        "or": _or,
        "select": _select,
    }


def _whole(number: Ball) -> bool:
    return bool(number.is_exact() and number.is_integer())


# For each operation that is not analytic everywhere: the reason it may fail to be on a box, and the
# condition on its arguments under which it is analytic on the whole box.
ANALYTIC: dict[str, tuple[str, Callable[..., bool]]] = {
    **{name: known.analytic for name, known in OPERATIONS.items() if known.analytic},
    "div": ("a denominator may reach 0", lambda _, y: y != 0),
    "pow": (
        "the base of a power may reach 0",
        lambda x, y: x > 0 or (_whole(y) and (y >= 0 or x != 0)),
    ),
    "atan2": ("the arguments of atan2 may reach its cut", lambda y, x: x > 0 or y != 0),
}


class _Balls:
    """Balls as an algebra, for the rules of elementary functions."""

    const = staticmethod(lambda value: value if isinstance(value, int) else constant(value))
    add, sub, div, neg = operator.add, operator.sub, operator.truediv, operator.neg

    @staticmethod
    def mul(a: Ball, b: Ball) -> Ball:
        """Return a product, or a square."""
        return square(a) if a is b else a * b

    @staticmethod
    def unary(op: str, a: Ball) -> Ball:
        """Return an elementary function."""
        value: Ball = operations()[op](a)
        return value


def _slope(known: Operation) -> Callable[..., Any]:
    return lambda x, y: known.slope(_Balls, x[0], y, 1)


# Partial derivatives of each operation with respect to its arguments, from the arguments and the
# value.  They are not finite where the operation is not differentiable, except atan2 on its cut.
PARTIALS: dict[str, tuple[Callable[..., Any], ...]] = {
    "neg": (lambda *_: -1,),
    "add": (lambda *_: 1, lambda *_: 1),
    "sub": (lambda *_: 1, lambda *_: -1),
    "mul": (lambda x, _: x[1], lambda x, _: x[0]),
    "square": (lambda x, _: 2 * x[0],),
    "div": (lambda x, _: 1 / x[1], lambda x, y: -y / x[1]),
    **{name: (_slope(known),) for name, known in OPERATIONS.items()},
    "pow": (lambda x, _: x[1] * x[0] ** (x[1] - 1), lambda x, y: y * x[0].log()),
    "atan2": (
        lambda x, _: x[1] / (square(x[0]) + square(x[1])),
        lambda x, _: -x[0] / (square(x[0]) + square(x[1])),
    ),
}


def narrower(x: Ball, y: Ball) -> Ball:
    """Return the narrower of two enclosures of the same quantity."""
    return y if y.is_finite() and (not x.is_finite() or y.rad() < x.rad()) else x
