"""Oracles for enclosures on boxes: exact points in ball arithmetic with many digits."""

from fractions import Fraction

import mpmath
import numpy as np

from polycorner.intervals.balls import ball, bounds, precision
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box

BITS = 160


def precise(number):
    """Return a fraction, or its text, as an mpmath number."""
    number = Fraction(number)
    return mpmath.mpf(number.numerator) / number.denominator


def contains(sides, truth):
    """Whether a number lies between two bounds, given as texts."""
    return precise(sides[0]) <= truth <= precise(sides[1])


def misses(true, low, high):
    """Whether a ball is surely outside of bounds."""
    if not true.is_finite():
        return False
    lower, upper = bounds(true)
    below = np.isfinite(low) and upper < Fraction(float(low))
    return bool(below or (np.isfinite(high) and lower > Fraction(float(high))))


def point(q):
    """Return a point, all its digits taken for exact, as a box in ball arithmetic."""
    return Box([ball(Fraction(float(x))) for x in q])


def inside(rng, lo, hi):
    """Return points of boxes, ends and middles among them."""
    share = rng.choice([0.0, 1.0, 0.5, np.nan], size=lo.shape, p=[0.1, 0.1, 0.1, 0.7])
    share = np.where(np.isnan(share), rng.uniform(size=lo.shape), share)
    return np.clip(lo + share * (hi - lo), lo, hi)


def missed(functions, manifold, enclosures, points):
    """Return where true values and derivatives at points are outside of their enclosures.

    ``enclosures`` are bounds of values, then of gradients, then of Hessians; derivatives are
    compared at points where a neighbourhood decides all branches.
    """
    formulas, rows, found = Formulas(functions, manifold), range(len(functions)), []
    for i, q in enumerate(points):
        with precision(BITS):
            where = point(q)
            for j, value in enumerate(formulas.values(where, rows)):
                if misses(value, enclosures[0][i, j], enclosures[1][i, j]):
                    found.append((i, j))
            for j in rows:
                smooth = formulas.smooth(where, [j])
                if not isinstance(smooth, Undecided):
                    levels = smooth.evaluate(where, len(enclosures) // 2 - 1)
                    found += _derivatives_missed(levels, enclosures, i, j)
    return found


def _derivatives_missed(levels, enclosures, i, j):
    sides = range(enclosures[2].shape[-1] if len(enclosures) > 2 else 0)
    first = [((i, j, k), levels[1][0][k], enclosures[2:4]) for k in sides]
    second = (
        [((i, j, k, p), levels[2][0][k][p], enclosures[4:]) for k in sides for p in sides]
        if len(enclosures) > 4
        else []
    )
    return [at for at, true, (low, high) in first + second if misses(true, low[at], high[at])]
