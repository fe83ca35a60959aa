"""Problems whose answer is known exactly.

In coordinates ``u`` a problem is a quadratic programme with rational data,

``E = (u-c) H (u-c) / 2 + g (u-c) + third d^3 + fourth d^4 + kink max(0, d - edge)``,
``d = (u-c)_1``, ``f_j = a_j (u-c) - b_j``,

and the library sees it in bent coordinates ``q``: ``u_i = q_i + alpha_i q_i^3 + gamma_i
(sinh q_i - q_i) + beta_i q_(i+1)^2``, a change of coordinates with a smooth inverse, so that minima
are minima in both.  All data are dyadic fractions, which floating-point parameters carry exactly.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import mpmath
import numpy as np
import sympy as sp
from exact_algebra import ZERO

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, certify, minimise
from polycorner.formulas.families import Family
from polycorner.polyhedra.symmetry import Symmetry

UNBOUNDED = ("saddle", "faint curvature", "beyond second order")
BEYOND = ("third", "fourth", "kink", "edge")


@lru_cache
def family(n):
    """Return energy and functions of ``n`` bent coordinates with all numbers left open."""
    q = sp.symbols(f"q1:{n + 1}", real=True)
    d = sp.symbols(f"d1:{n + 1}", real=True)
    letters = {letter: sp.symbols(f"{letter}1:{n + 1}", real=True) for letter in "cgzywv"}
    definitions = {}
    for i in range(n):
        alpha, gamma, beta = (letters[letter][i] for letter in "zyw")
        bent = q[i] + alpha * q[i] ** 3 + gamma * (sp.sinh(q[i]) - q[i])
        if i + 1 < n:
            bent += beta * q[i + 1] ** 2
        definitions[f"d{i + 1}"] = bent - letters["c"][i]
    form = [[sp.Symbol(f"h{min(i, j)}_{max(i, j)}", real=True) for j in range(n)] for i in range(n)]
    third, fourth, kink, edge = beyond = sp.symbols(BEYOND, real=True)
    expressions = {
        "energy": sum(form[i][j] * d[i] * d[j] for i in range(n) for j in range(n)) / 2
        + sum(g * x for g, x in zip(letters["g"], d, strict=True))
        + third * d[0] ** 3
        + fourth * d[0] ** 4
        + kink * sp.Max(0, d[0] - edge),
        "f": sum(v * x for v, x in zip(letters["v"], d, strict=True)) - sp.Symbol("b", real=True),
    }
    names = [f"h{i}_{j}" for i in range(n) for j in range(i, n)]
    names += [symbol.name for letter in "cgzywv" for symbol in letters[letter]]
    names += ["b", *(symbol.name for symbol in beyond)]
    return Family.of(expressions, [x.name for x in q], names, definitions)


@dataclass(frozen=True)
class Programme:
    """A problem in ``u``, bent into ``q``; ``groups`` are sets of functions joined by *or*."""

    kind: str
    form: tuple
    slope: tuple
    normals: tuple
    offsets: tuple
    centre: tuple
    bends: tuple
    groups: tuple = ()
    third: Fraction = ZERO
    fourth: Fraction = ZERO
    kink: Fraction = ZERO
    edge: Fraction = ZERO
    minimum: bool = False  # whether c is known to be a strict, nowhere degenerate minimum
    scales: tuple = ()
    invariant: tuple = ()  # a direction in u along which nothing changes

    @property
    def n(self):
        return len(self.slope)

    def posed(self):
        """Return the polyhedron and the energy that the library sees."""
        n, bound = self.n, family(self.n)
        manifold = Manifold(tuple(f"q{i + 1}" for i in range(n)), scales=self.scales or (1.0,) * n)
        alpha, gamma, beta = self.bends

        def member(name, label, normal, offset):
            rows = [self.form[i][j] for i in range(n) for j in range(i, n)]
            numbers = [*rows, *self.centre, *self.slope, *alpha, *gamma, *beta, *normal, offset]
            numbers += [getattr(self, word) for word in BEYOND]
            numbers = [float(x) for x in numbers]
            return SmoothFunction.member(bound, name, manifold, parameters=numbers, label=label)

        sides = zip(self.normals, self.offsets, strict=True)
        faces = [member("f", f"f{j}", a, b) for j, (a, b) in enumerate(sides)]
        joined = {j for group in self.groups for j in group}
        parts = [faces[j] for j in range(len(faces)) if j not in joined]
        parts += [AnyOf(*(faces[j] for j in group)) for group in self.groups]
        energy = member("energy", "energy", (ZERO,) * n, ZERO)
        return Polyhedron(manifold, AllOf(*parts)), energy

    def start(self):
        """Return the point ``c`` in the coordinates ``q``, rounded."""
        alpha, gamma, beta = self.bends
        q = [0.0] * self.n
        for i in reversed(range(self.n)):
            shear = float(beta[i]) * q[i + 1] ** 2 if i + 1 < self.n else 0.0
            goal = mpmath.mpf(float(self.centre[i])) - shear

            def bent(x, i=i, goal=goal):
                return x + float(alpha[i]) * x**3 + float(gamma[i]) * (mpmath.sinh(x) - x) - goal

            q[i] = float(mpmath.findroot(bent, goal))
        return np.array(q)

    @property
    def symmetry(self):
        """The constant field in ``q`` that may be declared: none where coordinates are bent."""
        bent = any(x for row in self.bends for x in row)
        known = not bent and bool(self.invariant)
        return Symmetry(fields=[list(map(float, self.invariant))] if known else [])

    def certificate(self, q, *, search):
        """Certify ``q``, or what a search from there finds where the energy is bounded below."""
        polyhedron, energy = self.posed()
        return (minimise if search and self.kind not in UNBOUNDED else certify)(
            polyhedron, energy, q
        )

    def straightened(self, proof):
        """Return rational bounds of ``u - c`` from a proof's enclosure of ``q``."""
        alpha, gamma, beta = self.bends
        sides = [[Fraction(x) for x in proof.enclosures[f"q{i + 1}"]] for i in range(self.n)]
        found = []
        for i, (lower, upper) in enumerate(sides):
            ends = [x + alpha[i] * x**3 for x in (lower, upper)]
            if gamma[i]:
                ends = [
                    e + gamma[i] * (_sinh(x, up=up) - x)
                    for e, x, up in zip(ends, (lower, upper), (False, True), strict=True)
                ]
            if i + 1 < self.n and beta[i]:
                squares = [x * x for x in sides[i + 1]]
                least = ZERO if sides[i + 1][0] <= 0 <= sides[i + 1][1] else min(squares)
                shears = sorted((beta[i] * least, beta[i] * max(squares)))
                ends = [ends[0] + shears[0], ends[1] + shears[1]]
            found.append((ends[0] - self.centre[i], ends[1] - self.centre[i]))
        return found


def _sinh(x, *, up):
    """Return a rational bound of ``sinh x``, good to a hundred digits."""
    with mpmath.workdps(120):
        y = mpmath.sinh(mpmath.mpf(x.numerator) / x.denominator)
        sign, mantissa, exponent, _ = y._mpf_
        value = Fraction(-mantissa if sign else mantissa) * Fraction(2) ** exponent
    slack = Fraction(1, 10**100) * (1 + abs(value))
    return value + slack if up else value - slack
