"""Exact data of problems with known lists: polynomials over the rationals and their real roots.

Polynomials are lists of Fractions, the constant first.  Numbers that are not rational are given by
Fractions within 1e-200 of them; what is smaller than 1e-100 is zero.
"""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

import flint

Poly = list[Fraction]
Vector = tuple[Fraction, ...]
BITS = 800
NOTHING = Fraction(1, 10**100)
FINE = 10**220


def sign(x: Fraction) -> int:
    """Return the sign of a number, 0 if it is zero up to what is rounded here."""
    return 0 if abs(x) < NOTHING else 1 if x > 0 else -1


def root(x: Fraction) -> Fraction:
    """Return the square root of a number that is not negative."""
    return Fraction(math.isqrt(x.numerator * FINE**2 // x.denominator), FINE)


def value(p: Sequence[Fraction], x: Fraction) -> Fraction:
    total = Fraction(0)
    for c in reversed(p):
        total = total * x + c
    return total


def derivative(p: Sequence[Fraction]) -> Poly:
    return [k * c for k, c in enumerate(p)][1:]


def added(*polys: Sequence[Fraction]) -> Poly:
    total = [Fraction(0)] * max(map(len, polys))
    for p in polys:
        for k, c in enumerate(p):
            total[k] += c
    return total


def times(p: Sequence[Fraction], q: Sequence[Fraction]) -> Poly:
    total = [Fraction(0)] * max(len(p) + len(q) - 1, 0)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            total[i + j] += a * b
    return total


def power(p: Sequence[Fraction], k: int) -> Poly:
    total = [Fraction(1)]
    for _ in range(k):
        total = times(total, p)
    return total


def with_roots(roots: Iterable[Fraction], leading: Fraction) -> Poly:
    total = [leading]
    for r in roots:
        total = times(total, [-r, Fraction(1)])
    return total


def integral(p: Sequence[Fraction]) -> Poly:
    return [Fraction(0), *(c / (k + 1) for k, c in enumerate(p))]


def homogenised(
    p: Sequence[Fraction], x: Sequence[Fraction], w: Sequence[Fraction], degree: int
) -> Poly:
    """Return ``w^degree p(x / w)`` for polynomials ``x`` and ``w``."""
    parts = (
        times([c], times(power(x, k), power(w, degree - k))) for k, c in enumerate(p) if c != 0
    )
    return added([Fraction(0)], *parts)


def real_roots(p: Sequence[Fraction]) -> list[tuple[Fraction, int]]:
    """Return the real roots of a polynomial that is not zero, with multiplicities."""
    scale = math.lcm(*(c.denominator for c in p))
    whole = [int(c * scale) for c in p]
    before, flint.ctx.prec = flint.ctx.prec, BITS
    try:
        found = flint.fmpz_poly(whole).complex_roots()
        return sorted((fraction(z.real), m) for z, m in found if z.imag == 0)
    finally:
        flint.ctx.prec = before


def fraction(x: flint.arb) -> Fraction:
    """Return the middle of a ball."""
    man, exp = x.mid().man_exp()
    return Fraction(int(man)) * Fraction(2) ** int(exp)
