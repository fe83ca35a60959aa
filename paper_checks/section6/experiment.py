"""The paper's dumbbells from their definition, and proofs of their minima.

The definitions follow [GMBN] sec. 2 and 5 independently of the library's own formulas, so that a
check may compare the two.  Every proof is found once and cached.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import permutations

import sympy

from polycorner import Proof, prove
from polycorner.dumbbells import DumbbellPair, DyadMinimum, dyad_minima

Interval = tuple[Fraction, Fraction]

EXPERIMENT = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
SHORTER = DumbbellPair(length=14, ball_radius=3, rod_radius=1.5, drum_radius=125)
BUNCH = DumbbellPair(length=8, ball_radius=2, rod_radius=0.5, drum_radius=125)
PLANE = replace(EXPERIMENT, drum_radius=math.inf)
CORNER = ("A2B1", "A2b", "aB1")
DEGREES = 180 / sympy.pi
DIGITS = 40


@cache
def rests(pair: DumbbellPair) -> dict[str, DyadMinimum]:
    """Return the loci ``delta_R``, ``delta_L`` and ``G`` of a pair by name."""
    return {entry.name: entry for entry in dyad_minima(pair)}


@cache
def proof(pair: DumbbellPair, name: str) -> Proof:
    """Return the interval proof about one of the loci."""
    return prove(rests(pair)[name].certificate)


def enclosed(found: Proof, expression: sympy.Expr) -> Interval:
    """Return bounds of a function of the coordinates at a proved point."""
    low, high = found.enclose(sympy.sympify(expression))
    return Fraction(low), Fraction(high)


def multiplier(found: Proof, contact: str) -> Interval:
    """Return bounds of a contact's multiplier at a proved point."""
    low, high = found.enclosures[f"multiplier {contact}"]
    return Fraction(low), Fraction(high)


def has(side: Interval, number: float | Fraction | sympy.Expr) -> bool:
    """Whether a number lies in an interval; irrational numbers are taken to forty digits."""
    if isinstance(number, sympy.Rational):
        value = Fraction(int(number.p), int(number.q))
    elif isinstance(number, sympy.Expr):
        value = Fraction(str(sympy.N(number, DIGITS)))
    else:
        value = Fraction(number)
    return side[0] <= value <= side[1]


def middle(side: Interval) -> float:
    """Return the middle of an interval."""
    return float(sum(side) / 2)


def times(first: Interval, second: Interval) -> Interval:
    """Return the product of two intervals."""
    ends = [a * b for a in first for b in second]
    return min(ends), max(ends)


def determinant(rows: Sequence[Sequence[Interval]]) -> Interval:
    """Return bounds of a determinant by Leibniz' sum."""
    low = high = Fraction(0)
    for order in permutations(range(len(rows))):
        turns = sum(order[i] > order[j] for j in range(len(order)) for i in range(j))
        term = (Fraction(1), Fraction(1))
        for row, column in enumerate(order):
            term = times(term, rows[row][column])
        sign = Fraction((-1) ** turns)
        ends = times(term, (sign, sign))
        low, high = low + ends[0], high + ends[1]
    return low, high


def exact(number: float) -> sympy.Rational:
    """Return a floating-point number as the fraction it is."""
    return sympy.Rational(Fraction(number))


@cache
def centres(pair: DumbbellPair) -> dict[str, sympy.Matrix]:
    """Return the centres of the four balls in the coordinates of ``M x M``.

    A dumbbell is a chord of length ``l`` between two points of the cylinder of radius
    ``R - r``, its middle at azimuth ``phi`` and its projection along the axis ``l cos theta``;
    ``z`` is upwards.  In the plane the cylinder is developed and all heights are zero.
    """
    names = dict(zip(pair.manifold.names, pair.manifold.symbols, strict=True))
    half = exact(pair.length) / 2
    found = {}
    for body, k in (("A", 1), ("B", 2)):
        across = names[f"x{k}" if pair.is_plane else f"phi{k}"]
        along = names[f"y{k}" if pair.is_plane else f"eta{k}"]
        theta = names[f"theta{k}"]
        for ball, sign in ((1, -1), (2, 1)):
            axial = along + sign * half * sympy.cos(theta)
            side = sign * half * sympy.sin(theta)
            if pair.is_plane:
                found[f"{body}{ball}"] = sympy.Matrix([across + side, axial, 0])
                continue
            rho = exact(pair.centre_radius)
            depth = rho * sympy.sqrt(1 - (half * sympy.sin(theta) / rho) ** 2)
            x = depth * sympy.sin(across) + side * sympy.cos(across)
            z = -depth * sympy.cos(across) + side * sympy.sin(across)
            found[f"{body}{ball}"] = sympy.Matrix([x, axial, z])
    return found


def height(pair: DumbbellPair) -> sympy.Expr:
    """Return the energy: the heights of the four centres above the floor of the drum."""
    floor = exact(pair.drum_radius)
    return sum((floor + centre[2] for centre in centres(pair).values()), sympy.S.Zero)


def between(pair: DumbbellPair, first: str, second: str) -> sympy.Expr:
    """Return the distance of two centres."""
    apart = centres(pair)[first] - centres(pair)[second]
    return sympy.sqrt(apart.dot(apart))


def to_axis(pair: DumbbellPair, ball: str) -> sympy.Expr:
    """Return the distance of a centre from the axial line of the other dumbbell."""
    other = "B" if ball[0] == "A" else "A"
    start, end = (centres(pair)[f"{other}{k}"] for k in (1, 2))
    normal = (centres(pair)[ball] - start).cross(end - start)
    return sympy.sqrt(normal.dot(normal)) / exact(pair.length)
