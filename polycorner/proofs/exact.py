"""Zeros that no enclosure can show, by exact algebra.

A ball that contains 0 leaves a sign open at every precision where the number *is* zero.  Two
arguments show that it is:

- *At a recognised point.*  Lattice reduction proposes every unknown of an enclosed solution as a
  rational combination of 1 and the irrational constants of the formulas, or of powers of one
  unknown that is the root of a polynomial.  If these numbers lie in
  the box with exactly one solution and the KKT equations hold there identically, they are the
  solution, and functions may be evaluated at it.
- *On the face.*  A function that is a combination of the functions held, with polynomials as
  coefficients, vanishes wherever these do: division, and Buchberger's algorithm in small cases,
  decide membership of the ideal ([CLO] ch. 2).

Values are polynomials in symbols (:mod:`~polycorner.proofs.symbols`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from polycorner.intervals.balls import Ball, ball, exact, integer_relation
from polycorner.intervals.enclosures import Formulas
from polycorner.proofs import polynomials as algebra
from polycorner.proofs.kkt import Enclosure, KKTSystem
from polycorner.proofs.polynomials import Polynomial
from polycorner.proofs.symbols import Symbols, constants, evaluate, opened

MOST_POWERS = 4  # degree of a polynomial of which a coordinate may be a root
MOST_CONSTANTS = 6  # irrational constants among which a number is sought
# Sizes up to which Buchberger's algorithm is tried: symbols, degree, and terms of a polynomial.
MOST_SYMBOLS, MOST_DEGREE, MOST_SUMMANDS = 6, 6, 40


# ------------------------------------------------------------------------------ recognised points


@dataclass(frozen=True, eq=False)
class ExactPoint:
    """An enclosed solution whose unknowns are known exactly, or as zeros of known polynomials.

    ``unknowns`` are coordinates and multipliers, in symbols: constants, and coordinates that are no
    combinations of them; ``zeros`` are polynomials in symbols that vanish.
    """

    unknowns: tuple[Polynomial, ...]
    symbols: Symbols
    zeros: tuple[Polynomial, ...] = ()

    def vanishes(self, formulas: Formulas, row: int) -> bool:
        """Whether a function, which is known to be defined there, is shown to be zero."""
        inputs = self.unknowns[: formulas.dimension]
        (value,) = evaluate(formulas.graph, [formulas.outputs[row]], inputs, self.symbols)
        return value is not None and in_ideal(value, self.zeros)


def recognised(enclosure: Enclosure) -> ExactPoint | None:
    """Return the solution in an enclosure exactly, if it is recognised and shown to be one."""
    system = enclosure.predictor.system
    assert isinstance(system, KKTSystem)
    formulas, symbols = system.formulas, Symbols()
    n = system.dimension
    if formulas.free:
        return None
    sought = constants(formulas, symbols)
    if len(sought) > MOST_CONSTANTS:
        return None
    unknowns = combinations(enclosure.solution, n, sought, symbols)
    for gauge in system.gauges:
        if sum(map(bool, gauge)) == 1:  # a coordinate that is held where it was
            (j,) = np.flatnonzero(gauge)
            unknowns[j] = algebra.number(Fraction(system.anchor[j]))
    known = tuple([p for p in unknowns if p is not None])
    if len(known) < len(unknowns):
        return None
    inside = enclosure.predictor.unknowns(enclosure.candidate)
    if not all(w.contains(symbols.ball(p)) for w, p in zip(inside, known, strict=True)):
        return None
    found = ExactPoint(known, symbols)
    forms = enclosure.linear.forms
    k = len(system.held)
    d = forms.graph.derivative
    slopes = [d(f, i) for f in forms.outputs for i in range(n)]
    values = evaluate(forms.graph, [*forms.outputs[:k], *slopes], known[:n], symbols)
    if any(value is None for value in values) or any(values[:k]):
        return None
    rows = [values[k + n * r : k + n * (r + 1)] for r in range(k + 1)]
    return found if _stationary(system.gauges, system.anchor, rows, found, n) else None


def number_in(x: "Ball", sought: Sequence[Polynomial], symbols: Symbols) -> Polynomial | None:
    """Return the number that a ball is, or may be as a combination of 1 and constants."""
    return algebra.number(exact(x)) if x.is_exact() else _combination(x, sought, symbols)


def _stationary(
    gauges: Sequence[Sequence[float]],
    anchor: Sequence[float],
    rows: Sequence[Sequence[Polynomial]],
    point: ExactPoint,
    n: int,
) -> bool:
    """Whether the energy's gradient, the last row, is the combination of the others."""
    product, unknowns = point.symbols.product, point.unknowns
    normals = [[algebra.number(Fraction(x)) for x in gauge] for gauge in gauges]
    for i in range(n):
        rest = rows[-1][i]
        for weight, row in zip(unknowns[n:], [*rows[:-1], *normals], strict=True):
            rest = algebra.total([rest, product(weight, row[i])], "sub")
        if rest:
            return False
    for normal in normals:
        away: Polynomial = {}
        for p, x, part in zip(unknowns, anchor, normal, strict=False):
            offset = algebra.total([p, algebra.number(Fraction(x))], "sub")
            away = algebra.total([away, product(part, offset)])
        if away:
            return False
    return True


def combinations(
    numbers: "Sequence[Ball]", n: int, sought: Sequence[Polynomial], symbols: Symbols
) -> list[Polynomial | None]:
    """Return rational combinations of 1 and constants that may be the numbers in balls.

    Without constants, powers of one of the first ``n`` numbers are taken, if it is not rational: of
    the first that may be a root of a polynomial of the highest degree.
    """
    found = [_combination(x, sought, symbols) for x in numbers]
    if sought:
        return found
    powers: list[Polynomial] = []
    for x, known in zip(numbers[:n], found, strict=False):
        root = None if known is not None else _root(x, symbols)
        if root and root[1] - 1 > len(powers):
            powers = [root[0]]
            while len(powers) < root[1] - 1:
                powers.append(symbols.product(powers[-1], root[0]))
    return [_combination(x, powers, symbols) for x in numbers] if powers else found


def _root(x: "Ball", symbols: Symbols) -> tuple[Polynomial, int] | None:
    """Return a root of a polynomial that is the number in a ball, perhaps, and the degree."""
    powers = [ball(1), x]
    for degree in range(2, MOST_POWERS + 1):
        powers.append(powers[-1] * x)
        relation = integer_relation(powers[::-1])
        if relation is not None:
            root = symbols.algebraic(relation[::-1], x)
            return None if root is None else (root, degree)
    return None


def _combination(x: "Ball", sought: Sequence[Polynomial], symbols: Symbols) -> Polynomial | None:
    """Return a rational combination of 1 and constants that may be the number in a ball."""
    terms = [algebra.number(1), *sought]
    relation = integer_relation([x, *(symbols.ball(p) for p in terms)])
    if relation is None:
        return None
    result: Polynomial = {}
    for weight, p in zip(relation[1:], terms, strict=True):
        share = algebra.number(Fraction(-weight, relation[0]))
        result = algebra.total([result, algebra.product(share, p)])
    return result


# ------------------------------------------------------------------------------ ideals of a face


def implied(formulas: Formulas, held: Sequence[int], row: int) -> bool:
    """Whether a function is a combination of others and so vanishes wherever they all do.

    It does so where it is defined; that its operations are is for the caller to know.
    """
    symbols = Symbols()
    outputs = [formulas.outputs[i] for i in (row, *held)]
    found = evaluate(formulas.graph, outputs, opened(formulas, symbols), symbols)
    if any(p is None for p in found) or not held:
        return False
    return in_ideal(found[0], found[1:])


def in_ideal(p: Polynomial, generators: Sequence[Polynomial]) -> bool:
    """Whether a polynomial is shown to be a combination of others."""
    from sympy import QQ
    from sympy.polys.groebnertools import groebner
    from sympy.polys.orderings import grevlex
    from sympy.polys.rings import PolyRing

    used = sorted({s for q in (p, *generators) for monomial in q for s in monomial})
    if not used:
        return not p
    ring = PolyRing([f"s{s}" for s in used], QQ, grevlex)

    def written(q: Polynomial) -> Any:
        terms = {
            tuple(m.count(s) for s in used): QQ(w.numerator, w.denominator) for m, w in q.items()
        }
        return ring.from_dict(terms)

    target, basis = written(p), [g for g in map(written, generators) if g]
    if not target or (basis and not target.rem(basis)):
        return True
    small = len(used) <= MOST_SYMBOLS and all(
        len(q) <= MOST_SUMMANDS and max((len(m) for m in q), default=0) <= MOST_DEGREE
        for q in (p, *generators)
    )
    return bool(small and basis) and not target.rem(groebner(basis, ring))
