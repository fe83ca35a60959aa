"""Rational numbers of a file, and bounds in decimals."""

from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Any

from flint import arb, ctx, fmpq, fmpz

from .balls import need

MOST_DIGITS = 40_000  # characters of a number
MOST_EXPONENT = 200_000  # size of the binary exponent of a number that is printed


def ratio(text: Any) -> fmpq:
    """Return the rational number for ``"-3/2"``."""
    need(isinstance(text, str) and len(text) <= MOST_DIGITS, "numbers are texts of bounded length")
    above, _, below = text.partition("/")
    fine = text.isascii() and above.removeprefix("-").isdecimal() and (below or "1").isdecimal()
    need(fine, f"the number {text[:40]}")
    return fmpq(fmpz(above), fmpz(below or "1"))


def ratios(texts: Any, count: int, name: str) -> list[fmpq]:
    need(isinstance(texts, list) and len(texts) == count, f"{name}: expected {count} numbers")
    return [ratio(text) for text in texts]


def decimal(x: arb, digits: int, up: bool) -> str:
    """Return the upper or the lower bound of a number, rounded outwards."""
    mantissa, exponent = (int(z) for z in (x.upper() if up else x.lower()).man_exp())
    need(abs(exponent) <= MOST_EXPONENT, "a number is too large, or too small, to be printed")
    context = Context(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    above, below = (mantissa << exponent, 1) if exponent >= 0 else (mantissa, 1 << -exponent)
    return str(context.divide(Decimal(above), Decimal(below)))


def decimals(lower: arb, upper: arb) -> tuple[str, str]:
    """Return two bounds, with the digits that they have in common and one or two more."""
    width, size = upper.upper() - lower.lower(), upper.union(lower).abs_upper()
    share = width / size if width > 0 else arb(2) ** -ctx.prec
    digits = max(3, min(2 - int(float(share.log().mid()) / 2.302), ctx.prec // 3))
    return decimal(lower, digits, False), decimal(upper, digits, True)
