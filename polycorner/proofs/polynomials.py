"""Polynomials with rational coefficients in symbols without a fixed list."""

from collections.abc import Sequence
from fractions import Fraction

# A sum of products of symbols: exponents are repetitions, and 1 is the empty product.
Polynomial = dict[tuple[int, ...], Fraction]

MOST_TERMS = 20_000  # products of terms up to which polynomials are multiplied


class TooLargeError(Exception):
    """A polynomial exceeds ``MOST_TERMS``."""


def number(value: Fraction | int) -> Polynomial:
    """Return a constant polynomial."""
    return {(): Fraction(value)} if value else {}


def constant(p: Polynomial) -> Fraction | None:
    """Return the value of a constant polynomial, or None for another."""
    return p.get((), Fraction(0)) if all(not monomial for monomial in p) else None


def total(parts: Sequence[Polynomial], op: str = "add") -> Polynomial:
    """Return the sum or the difference of two polynomials, or the negative of one."""
    result = dict(parts[0])
    if op == "neg":
        return {monomial: -weight for monomial, weight in result.items()}
    sign = 1 if op == "add" else -1
    for monomial, weight in parts[1].items():
        result[monomial] = result.get(monomial, Fraction(0)) + sign * weight
    return {monomial: weight for monomial, weight in result.items() if weight}


def product(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return the product; TooLargeError where it has too many terms."""
    if len(u) * len(v) > MOST_TERMS:
        raise TooLargeError
    result: Polynomial = {}
    for first, a in u.items():
        for second, b in v.items():
            monomial = tuple(sorted(first + second))
            result[monomial] = result.get(monomial, Fraction(0)) + a * b
    return {monomial: weight for monomial, weight in result.items() if weight}
