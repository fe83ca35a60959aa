"""All stationary points of a polynomial in the plane on sets bounded by lines and circles.

A point is a candidate if the energy's gradient vanishes there, or its derivative along a line or a
circle (on which it is a rational function of one parameter), or if two curves meet.  It is
stationary if it lies in the set and, in each branch of the set that contains it, the gradient is in
the cone of the gradients of the functions that vanish, or no curve leads from it into the branch.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

from benchmarks.trials.exact import (
    Poly,
    Vector,
    added,
    derivative,
    homogenised,
    integral,
    real_roots,
    root,
    sign,
    times,
    value,
)

ZERO, ONE = Fraction(0), Fraction(1)
Matrix = tuple[tuple[Fraction, ...], ...]


class Place(NamedTuple):
    """A stationary point.

    Attributes
    ----------
    point : tuple of Fraction
    active : frozenset of int
        Functions that vanish there.
    ways : mapping from frozenset of int to int
        Sets of them with which it is a nondegenerate KKT point, all multipliers being positive,
        and the negative eigenvalues along their face.
    """

    point: Vector
    active: frozenset[int]
    ways: Mapping[frozenset[int], int]

    @property
    def index(self) -> int | None:
        """The negative eigenvalues along the face of all of them; None at a degenerate point."""
        return self.ways.get(self.active)


@dataclass(frozen=True)
class Curve:
    """A function ``bent (x^2 + y^2) + a x + b y + c``: a line or a circle where it vanishes."""

    bent: Fraction
    a: Fraction
    b: Fraction
    c: Fraction

    def at(self, q: Vector) -> Fraction:
        """Return the value at a point."""
        return self.bent * (q[0] ** 2 + q[1] ** 2) + self.a * q[0] + self.b * q[1] + self.c

    def gradient(self, q: Vector) -> Vector:
        """Return the gradient at a point."""
        return 2 * self.bent * q[0] + self.a, 2 * self.bent * q[1] + self.b

    @property
    def centre(self) -> Vector:
        """The centre of a circle."""
        return -self.a / (2 * self.bent), -self.b / (2 * self.bent)

    def written(self, x: Any, y: Any) -> Any:
        """Return the function of two symbols."""
        from sympy import Rational

        bent, a, b, c = (
            Rational(t.numerator, t.denominator) for t in (self.bent, self.a, self.b, self.c)
        )
        return bent * (x**2 + y**2) + a * x + b * y + c

    def parametrised(self) -> tuple[Poly, Poly, Poly]:
        """Return polynomials ``X, Y, W`` with the curve ``(X / W, Y / W)``, one point apart."""
        if not self.bent:
            size = self.a**2 + self.b**2
            foot = -self.c * self.a / size, -self.c * self.b / size
            return [foot[0], -self.b], [foot[1], self.a], [ONE]
        x, y = self.centre
        square = x**2 + y**2 - self.c / self.bent
        radius = root(square)
        if radius**2 != square:
            msg = f"a circle without a rational radius: {self}"
            raise ValueError(msg)
        return [x + radius, ZERO, x - radius], [y, 2 * radius, y], [ONE, ZERO, ONE]


def line(a: Fraction, b: Fraction, c: Fraction) -> Curve:
    """Return ``a x + b y + c``."""
    return Curve(ZERO, a, b, c)


def disc(x: Fraction, y: Fraction, radius: Fraction, inside: bool = True) -> Curve:
    """Return ``radius^2 - (x - x0)^2 - (y - y0)^2``, or its opposite."""
    s = Fraction(1 if inside else -1)
    return Curve(-s, 2 * s * x, 2 * s * y, s * (radius**2 - x**2 - y**2))


@dataclass(frozen=True)
class Energy:
    """A sum of products ``P(u) Q(v)`` with ``(u, v) = B (q - shift)``.

    ``critical`` are the points ``(u, v)`` where both derivatives vanish.
    """

    terms: tuple[tuple[tuple[Fraction, ...], tuple[Fraction, ...]], ...]
    turn: Matrix
    shift: Vector
    critical: tuple[Vector, ...]

    def local(self, q: Sequence[Fraction]) -> Vector:
        """Return ``(u, v)``."""
        apart = [a - b for a, b in zip(q, self.shift, strict=True)]
        return tuple(
            sum((m * x for m, x in zip(row, apart, strict=True)), ZERO) for row in self.turn
        )

    def derivatives(self, q: Vector) -> tuple[Vector, Matrix]:
        """Return gradient and Hessian."""
        u, v = self.local(q)
        g, h = [ZERO] * 2, [ZERO] * 3
        for p, r in self.terms:
            jets = [
                (value(f, s), value(derivative(f), s), value(derivative(derivative(f)), s))
                for f, s in ((p, u), (r, v))
            ]
            (p0, p1, p2), (r0, r1, r2) = jets
            g = [g[0] + p1 * r0, g[1] + p0 * r1]
            h = [h[0] + p2 * r0, h[1] + p1 * r1, h[2] + p0 * r2]
        (a, b), (c, d) = self.turn
        rows = ((a, c), (b, d))
        gradient = tuple(x * g[0] + y * g[1] for x, y in rows)
        hessian = tuple(
            tuple(x * (h[0] * z + h[1] * t) + y * (h[1] * z + h[2] * t) for z, t in rows)
            for x, y in rows
        )
        return gradient, hessian

    def slope(self, x: Poly, y: Poly, w: Poly) -> Poly:
        """Return the numerator of the derivative along a curve."""
        ends = [added(p, times([-s], w)) for p, s in ((x, self.shift[0]), (y, self.shift[1]))]
        u, v = (
            added(*(times([m], e) for m, e in zip(row, ends, strict=True))) for row in self.turn
        )
        degree = max(len(p) + len(r) - 2 for p, r in self.terms)
        whole = [ZERO]
        for p, r in self.terms:
            parts = homogenised(p, u, w, len(p) - 1), homogenised(r, v, w, len(r) - 1)
            rest = homogenised([ONE], u, w, degree - len(p) - len(r) + 2)
            whole = added(whole, times(times(*parts), rest))
        slope = added(
            times(derivative(whole), w), times([Fraction(-degree)], times(whole, derivative(w)))
        )
        while slope and not slope[-1]:
            slope.pop()
        return slope

    def written(self, x: Any, y: Any) -> Any:
        """Return the energy as a formula."""
        from sympy import Rational

        def number(t: Fraction) -> Any:
            return Rational(t.numerator, t.denominator)

        apart = [s - number(t) for s, t in zip((x, y), self.shift, strict=True)]
        u, v = (number(a) * apart[0] + number(b) * apart[1] for a, b in self.turn)
        return sum(
            sum(number(c) * u**k for k, c in enumerate(p))
            * sum(number(c) * v**k for k, c in enumerate(r))
            for p, r in self.terms
        )


def separable(
    slopes: Sequence[Sequence[Fraction]],
    roots: Sequence[Sequence[Fraction]],
    turn: Matrix,
    shift: Vector,
) -> Energy:
    """Return the sum of the integrals of two polynomials with these roots."""
    p, q = (tuple(integral(s)) for s in slopes)
    critical = tuple((u, v) for u in roots[0] for v in roots[1])
    return Energy(((p, (ONE,)), ((ONE,), q)), turn, shift, critical)


def meeting(f: Curve, g: Curve) -> list[Vector]:
    """Return where two curves meet; nothing for curves that coincide."""
    if g.bent and not f.bent:
        f, g = g, f
    if f.bent and g.bent:  # the radical line
        share = g.bent / f.bent
        g = Curve(ZERO, g.a - share * f.a, g.b - share * f.b, g.c - share * f.c)
    if not (g.a or g.b):
        return []
    if not f.bent:
        det = f.a * g.b - f.b * g.a
        return [((f.b * g.c - f.c * g.b) / det, (f.c * g.a - f.a * g.c) / det)] if det else []
    size = g.a**2 + g.b**2
    x, y = f.centre
    off = (g.a * x + g.b * y + g.c) / size
    foot = x - off * g.a, y - off * g.b
    square = (x**2 + y**2 - f.c / f.bent - off**2 * size) / size
    if square < 0:
        return []
    far = root(square)
    return [(foot[0] - s * g.b, foot[1] + s * g.a) for s in sorted({far, -far})]


@dataclass(frozen=True)
class PlanarProblem:
    """An energy on a union of intersections of sets ``f >= 0``."""

    energy: Energy
    curves: tuple[Curve, ...]
    branches: tuple[frozenset[int], ...]
    constant_allowed: bool = False

    def candidates(self) -> Iterator[Vector]:
        """Yield the points that may be stationary."""
        (a, b), (c, d) = self.energy.turn
        det = a * d - b * c
        for u, v in self.energy.critical:
            q = (d * u - b * v) / det, (a * v - c * u) / det
            yield q[0] + self.energy.shift[0], q[1] + self.energy.shift[1]
        for f, g in combinations(self.curves, 2):  # before points that roots only approximate
            yield from meeting(f, g)
        for f in self.curves:
            x, y, w = f.parametrised()
            slope = self.energy.slope(x, y, w)
            if not slope and not self.constant_allowed:
                msg = f"the energy is constant on {f}"
                raise ValueError(msg)
            if not slope:
                continue
            for t, _ in real_roots(slope):
                yield value(x, t) / value(w, t), value(y, t) / value(w, t)
            if f.bent:  # the point that the parameter does not reach
                yield x[2], y[2]

    def firsts(self) -> tuple[int, ...]:
        """Return the first function that each one is a positive multiple of."""
        rows = [(f.bent, f.a, f.b, f.c) for f in self.curves]
        return tuple(next(j for j, g in enumerate(rows) if _multiple(f, g)) for f in rows)

    def places(self) -> list[Place]:
        """Return the stationary points; the first of positive multiples stands for all."""
        found: list[Place] = []
        first = self.firsts()
        branches = {frozenset(first[i] for i in b) for b in self.branches}
        for q in self.candidates():
            if any(not (sign(q[0] - p[0]) or sign(q[1] - p[1])) for p, _, _ in found):
                continue
            signs = [sign(f.at(q)) for f in self.curves]
            least = [b for b in branches if not any(other < b for other in branches)]
            zeros = frozenset(i for i in frozenset().union(*least) if not signs[i])
            inside = [b for b in least if all(signs[i] >= 0 for i in b)]
            if inside and all(self.rests(q, sorted(b & zeros)) for b in inside):
                found.append(Place(q, zeros, self.ways(q, zeros.intersection(*inside))))
        return found

    def rests(self, q: Vector, active: Sequence[int]) -> bool:
        """Whether no direction into the intersection decreases the energy."""
        pull, _ = self.energy.derivatives(q)
        rows = [self.curves[i].gradient(q) for i in active]
        if not (sign(pull[0]) or sign(pull[1])):
            return True
        for i, j in combinations(range(len(rows)), 2):
            if not sign(_cross(rows[i], rows[j])) and sign(_dot(rows[i], rows[j])) < 0:
                if self.isolated(q, active[i], active[j]):
                    return True
                if not sign(_cross(rows[i], pull)):
                    return True
        if any(not sign(_cross(g, pull)) and sign(_dot(g, pull)) > 0 for g in rows):
            return True
        for f, g in combinations(rows, 2):
            det = _cross(f, g)
            if sign(det) and sign(_cross(pull, g) / det) >= 0 and sign(_cross(f, pull) / det) >= 0:
                return True
        return False

    def isolated(self, q: Vector, i: int, j: int) -> bool:
        """Whether two sets that touch from opposite sides have no other point near ``q``."""
        f, g = self.curves[i], self.curves[j]
        a, b = (_dot(h.gradient(q), h.gradient(q)) for h in (f, g))
        # curvatures over lengths of gradients, squares apart: f = |df| n + bent s^2
        return sign(_signed_square(f.bent) * b + _signed_square(g.bent) * a) < 0

    def ways(self, q: Vector, zeros: frozenset[int]) -> dict[frozenset[int], int]:
        """Return which functions that vanish make it a nondegenerate KKT point.

        All do where two of them do: the energy's gradient is in the interior of their cone.
        """
        sets = (frozenset(c) for count in range(3) for c in combinations(zeros, count))
        found = ((face, self.index(q, face)) for face in sets)
        ways = {face: index for face, index in found if index is not None}
        return {**ways, zeros: 0} if any(len(face) == 2 for face in ways) else ways

    def index(self, q: Vector, zeros: frozenset[int]) -> int | None:
        """Return the index along a face where all that is needed is strict, otherwise None."""
        pull, bent = self.energy.derivatives(q)
        rows = [self.curves[i].gradient(q) for i in sorted(zeros)]
        if len(rows) == 2:
            det = _cross(*rows)
            if not sign(det):
                return None
            shares = _cross(pull, rows[1]) / det, _cross(rows[0], pull) / det
            return 0 if min(map(sign, shares)) > 0 else None
        if not rows and (sign(pull[0]) or sign(pull[1])):
            return None
        if not rows:
            det = bent[0][0] * bent[1][1] - bent[0][1] ** 2
            trace = bent[0][0] + bent[1][1]
            return {1: 0 if trace > 0 else 2, -1: 1, 0: None}[sign(det)]
        (g,), (k,) = rows, zeros
        if sign(_cross(g, pull)):
            return None
        share = _dot(g, pull) / _dot(g, g)
        along = (-g[1], g[0])
        curved = sum(
            along[i] * (bent[i][j] - (share * 2 * self.curves[k].bent if i == j else 0)) * along[j]
            for i in (0, 1)
            for j in (0, 1)
        )
        return {1: 0, -1: 1, 0: None}[sign(curved)] if sign(share) > 0 else None


def _multiple(a: Sequence[Fraction], b: Sequence[Fraction]) -> bool:
    """Whether a vector is a positive multiple of another one."""
    pairs = list(zip(a, b, strict=True))
    crossed = all(x * v == y * u for x, y in pairs for u, v in pairs)
    return crossed and sum(x * y for x, y in pairs) > 0


def _dot(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[1] - a[1] * b[0]


def _signed_square(x: Fraction) -> Fraction:
    return x * abs(x)
