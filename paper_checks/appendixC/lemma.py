"""The minimisation lemma of appendix C: its proof, and the role of each hypothesis.

Lemma.  Let ``C`` contain 0 and let ``x_i >= 0`` on ``C`` for ``i <= p``; let ``f`` be smooth near 0
with (1) ``df/dx_i > 0`` at 0 for ``i <= p``, (2) ``df/dx_j = 0`` at 0 for ``p < j <= p + q``,
(3) the Hessian in these ``q`` variables positive definite at 0, (4) ``f`` independent of the last
``r``.  Then 0 is a local minimum of ``f`` on ``C``.

Proof.  By (4), ``f = g(u, v)`` with ``u`` the first ``p``, ``v`` the next ``q`` variables.  Split

    f(x) - f(0) = [g(u, v) - g(0, v)] + [g(0, v) - g(0, 0)].

The first bracket is the sum of ``u_i`` times the mean of ``dg/du_i`` over the segment from
``(0, v)`` to ``(u, v)``; near 0 the derivative is at least ``a/2``, ``a`` its least value at 0, and
``u_i >= 0`` on ``C``.  The second is, by (2), half of ``v H v`` with the Hessian at some point
between, at least ``h/2`` near 0, ``h`` its least eigenvalue at 0.  So, in a small cube,

    f(x) - f(0) >= a/2 (u_1 + ... + u_p) + h/4 |v|^2 >= 0,

with equality only for ``u = 0`` and ``v = 0``.  Where both vanish, ``f = f(0)`` by (4), and the
argument applies to every such point: the minimum is attained along the locus
``x_1 = ... = x_{p+q} = 0`` in ``C``.

Of smoothness, only a continuous first derivative, and a second one at 0 along ``v``, are used.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np
import sympy

X = sympy.symbols("x1:6", real=True)
S = sympy.Symbol("s", positive=True)
STEPS = tuple(sympy.Rational(1, 10**k) for k in range(1, 7))
INSIDE = "$x_i \\ge 0$ on $C$"
SMOOTH = "f is continuously differentiable"

Split = tuple[int, int, int]


@dataclass(frozen=True)
class Example:
    """A function with its ``(p, q, r)``, and a path in ``C`` towards 0, given for ``s > 0``."""

    f: sympy.Expr
    split: Split
    path: tuple[sympy.Expr, ...]

    @property
    def variables(self) -> tuple[sympy.Symbol, ...]:
        """The coordinates."""
        return tuple(X[: sum(self.split)])

    def restricted(self, *kept: sympy.Symbol) -> sympy.Expr:
        """Return ``f`` with all other coordinates zero."""
        return sympy.simplify(self.f.subs({x: 0 for x in self.variables if x not in kept}))

    def slopes(self) -> list[sympy.Expr]:
        """Return the first derivatives at 0."""
        return [self.restricted(x).diff(x).subs(x, 0) for x in self.variables]

    def hessian(self) -> sympy.Matrix:
        """Return the second derivatives at 0 in the ``q`` variables."""
        p, q, _ = self.split
        curved = self.variables[p : p + q]
        zero = dict.fromkeys(curved, 0)
        return sympy.Matrix(
            q, q, lambda i, j: self.restricted(*curved).diff(curved[i], curved[j]).subs(zero)
        )

    def hypotheses(self) -> dict[str, bool]:
        """Return the hypotheses that hold."""
        p, q, _ = self.split
        slopes, hessian = self.slopes(), self.hessian()
        return {
            INSIDE: all(bool(x.is_nonnegative) for x in self.path[:p]),
            "(1)": all(bool(slope > 0) for slope in slopes[:p]),
            "(2)": all(slope == 0 for slope in slopes[p : p + q]),
            "(3)": q == 0 or bool(hessian.is_positive_definite),
            "(4)": not self.f.free_symbols & set(self.variables[p + q :]),
            SMOOTH: bool(self.f.is_polynomial(*self.variables)),
        }

    def along_path(self) -> sympy.Expr:
        """Return ``f - f(0)`` on the path."""
        here = self.f.subs(dict(zip(self.variables, self.path, strict=True)))
        return sympy.simplify(here - self.restricted())

    def falls(self) -> bool:
        """Whether ``f < f(0)`` at points of the path arbitrarily near to 0."""
        change = self.along_path()
        return all(bool(change.subs(S, step) < 0) for step in STEPS)


def counterexamples() -> dict[str, Example]:
    """Return, for each hypothesis, a function that violates it alone and has no minimum at 0.

    The function that violates (4) is constant where the other variables vanish.  The one that is
    not smooth is differentiable at 0, ``|f - x1 - x2^2| <= 2 |x2|^{3/2}``, and equals ``x2^2`` for
    ``x1 = 0`` and ``x1`` for ``x2 = 0``.
    """
    x1, x2, x3 = X[:3]
    bump = 4 * x1 * x2**4 / (sympy.Abs(x1) + x2**4) ** 2
    return {
        INSIDE: Example(x1 + x2**2, (1, 1, 0), (-S, sympy.S.Zero)),
        "(1)": Example(x2**2 - x1**2, (1, 1, 0), (S, sympy.S.Zero)),
        "(2)": Example(x1 + x2 + x2**2, (1, 1, 0), (sympy.S.Zero, -S)),
        "(3)": Example(x1 - x2**4, (1, 1, 0), (sympy.S.Zero, S)),
        "(4)": Example(x1 + x2**2 + 2 * x2 * x3, (1, 1, 1), (sympy.S.Zero, -S, S)),
        SMOOTH: Example(
            x1 + x2**2 - 2 * sympy.Abs(x2) ** sympy.Rational(3, 2) * bump, (1, 1, 0), (S**4, S)
        ),
    }


def random_example(rng: np.random.Generator, split: Split) -> Example:
    """Return a random polynomial with integer coefficients that satisfies the hypotheses."""
    p, q, r = split
    used = X[: p + q]
    curved = used[p:]

    def draw() -> int:
        return int(rng.integers(-6, 7))

    f = sum((int(rng.integers(1, 5)) * x for x in used[:p]), sympy.S.Zero)
    root = sympy.Matrix(q, q, lambda *_: draw())
    vector = sympy.Matrix(curved)
    if q:
        f += (vector.T * (root * root.T + sympy.eye(q)) * vector)[0] / 2
    f += sum(draw() * u * x for u in used[:p] for x in used)
    f += sum(draw() * x * y * z for x in used for y in used for z in used)
    f += sum(draw() * x**2 * y**2 for x in used for y in used)
    return Example(sympy.expand(f), split, (S,) * p + (sympy.S.Zero,) * (q + r))


def _swing(polynomial: sympy.Expr, used: tuple[sympy.Symbol, ...], size: Fraction) -> Fraction:
    """Return a bound of ``|polynomial - its value at 0|`` on the cube of half-width ``size``."""
    terms = _terms(polynomial, used)
    return sum((abs(c) * size ** sum(m) for m, c in terms if any(m)), Fraction(0))


def _terms(
    polynomial: sympy.Expr, used: tuple[sympy.Symbol, ...]
) -> list[tuple[tuple[int, ...], Fraction]]:
    """Return exponents and coefficients."""
    found = sympy.Poly(polynomial, *used).terms()
    return [(m, Fraction(int(c.p), int(c.q))) for m, c in found]


@cache
def cube(example: Example) -> tuple[Fraction, Fraction, Fraction] | None:
    """Carry out the proof: return ``(half-width, a, h)`` of a cube in which its bounds hold.

    All arithmetic is exact.  ``h`` is 1 if the Hessian minus the identity is positive semidefinite;
    the Hessian moves by at most ``q`` times the largest change of an entry.
    """
    p, q, _ = example.split
    used = example.variables[: p + q]
    slopes = [Fraction(int(slope)) for slope in example.slopes()[:p]]
    hessian = example.hessian()
    if not all(example.hypotheses().values()):
        return None
    if q and not (hessian - sympy.eye(q)).is_positive_semidefinite:
        return None
    at_wall = example.restricted(*used[p:])
    seconds = [at_wall.diff(x, y) for x in used[p:] for y in used[p:]]
    a, h, size = min(slopes, default=Fraction(1)), Fraction(1), Fraction(1)
    for _ in range(60):
        steep = all(
            _swing(example.f.diff(x), used, size) <= slope / 2
            for x, slope in zip(used[:p], slopes, strict=True)
        )
        if steep and q * max((_swing(e, used, size) for e in seconds), default=0) <= h / 2:
            return size, a, h
        size /= 2
    return None


def bound_holds(example: Example, rng: np.random.Generator, points: int) -> bool:
    """Test the inequality of the proof at random points of its cube, in exact arithmetic."""
    found = cube(example)
    if found is None:
        return False
    (size, a, h), (p, q, _) = found, example.split
    terms = _terms(example.f, example.variables)
    for _ in range(points):
        x = [size * Fraction(int(k), 1000) for k in rng.integers(-1000, 1001, len(example.path))]
        x[:p] = [abs(u) for u in x[:p]]
        least = a / 2 * sum(x[:p]) + h / 4 * sum(v**2 for v in x[p : p + q])
        rise = sum(c * math.prod(map(pow, x, m)) for m, c in terms if any(m))
        if rise < least:
            return False
    return True


def first_bracket_is_an_integral(example: Example) -> bool:
    """Check ``g(u, v) - g(0, v) = sum u_i int_0^1 dg/du_i(s u, v) ds`` term by term."""
    p = example.split[0]
    u = example.variables[:p]
    scaled = {x: S * x for x in u}
    total = sum(
        x
        * sympy.integrate(
            sympy.expand(example.f.diff(x).subs(scaled, simultaneous=True)), (S, 0, 1)
        )
        for x in u
    )
    at_wall = example.f.subs(dict.fromkeys(u, 0))
    return bool(sympy.expand(example.f - at_wall - total) == 0)
