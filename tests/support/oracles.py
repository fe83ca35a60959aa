"""Slow, independent oracles: definitions written out, in exact or long arithmetic where useful."""

import itertools
import math
from fractions import Fraction

import mpmath
import numpy as np
from exact_algebra import reduced

CONTACTS = ("A1B1", "A1B2", "A2B1", "A2B2", "A1b", "A2b", "aB1", "aB2", "ab")

# ------------------------------------------------------------------------- derivatives and orders


def observed_order(errors, steps, floor):
    """Return the order ``k`` of ``error ~ step**k``; infinite where all errors are below ``floor``.

    The order is the median slope between neighbouring steps whose errors stand above the floor.
    """
    errors, steps = np.asarray(errors, dtype=float), np.asarray(steps, dtype=float)
    kept = errors > floor
    if kept.sum() < 3:
        return math.inf
    return float(np.median(np.diff(np.log(errors[kept])) / np.diff(np.log(steps[kept]))))


def taylor_orders(evaluate, q, v, steps, floor=1e-13):
    """Return the observed orders of ``f(q+hv) - f - h gv`` and ``... - h^2/2 vHv``, for each f.

    ``evaluate(q)`` returns values ``(m,)``, gradients ``(m, n)`` and Hessians ``(m, n, n)``.
    """
    f, g, H = evaluate(q)
    slope, curvature = g @ v, np.einsum("i,mij,j->m", v, H, v)
    shifted = np.array([evaluate(q + h * v)[0] for h in steps])
    h = np.asarray(steps)[:, None]
    first = abs(shifted - f - h * slope)
    second = abs(shifted - f - h * slope - h**2 / 2 * curvature)
    scale = floor * np.maximum(1.0, abs(f))
    return [
        tuple(observed_order(errors[:, i], steps, scale[i]) for errors in (first, second))
        for i in range(len(f))
    ]


def differences(f, q, digits=60):
    """Return value, gradient and Hessian of vector-valued ``f`` by differences in long arithmetic.

    With 60 digits and steps of ``1e-15`` the truncation is of relative size ``1e-30``.
    """
    with mpmath.workdps(digits):
        h = mpmath.mpf(10) ** (-digits // 4)
        q = [mpmath.mpf(float(x)) for x in q]
        n = len(q)

        def at(*moves):
            moved = list(q)
            for i, sign in moves:
                moved[i] += sign * h
            return [mpmath.mpf(x) for x in f(moved)]

        here = at()
        plus, minus = ([at((i, s)) for i in range(n)] for s in (1, -1))
        m = len(here)
        gradient, hessian = np.empty((m, n)), np.empty((m, n, n))
        for i in range(n):
            for k in range(m):
                gradient[k, i] = (plus[i][k] - minus[i][k]) / (2 * h)
                hessian[k, i, i] = (plus[i][k] - 2 * here[k] + minus[i][k]) / h**2
        for i, j in itertools.combinations(range(n), 2):
            corners = [(s * t, at((i, s), (j, t))) for s in (1, -1) for t in (1, -1)]
            for k in range(m):
                mixed = sum(sign * values[k] for sign, values in corners) / (4 * h**2)
                hessian[k, i, j] = hessian[k, j, i] = mixed
        return np.array([float(x) for x in here]), gradient, hessian


def agree(computed, exact, tolerance=1e-12):
    """Assert that levels agree relative to the larger of 1 and the largest entry of a function."""
    for f, g in zip(computed, exact, strict=True):
        size = np.maximum(1.0, abs(g).reshape(len(g), -1).max(axis=1))
        worst = (abs(f - g).reshape(len(g), -1).max(axis=1) / size).max()
        assert worst <= tolerance, f"level {g.ndim - 1} differs by {worst:.2g}"


def ulps(computed, exact):
    """Return the error of a float in units in the last place of the exact number."""
    return float(
        abs(mpmath.mpf(float(computed)) - exact) / mpmath.mpf(np.spacing(abs(float(exact))))
    )


class Dual:
    """``a + b e`` with ``e^2 = 0``: forward derivatives in any field, here in the fractions."""

    def __init__(self, a, b=0):
        self.a, self.b = a, b

    def __add__(self, other):
        return Dual(self.a + other.a, self.b + other.b)

    def __sub__(self, other):
        return Dual(self.a - other.a, self.b - other.b)

    def __neg__(self):
        return Dual(-self.a, -self.b)

    def __mul__(self, other):
        return Dual(self.a * other.a, self.a * other.b + self.b * other.a)

    def __truediv__(self, other):
        a = self.a / other.a
        return Dual(a, (self.b - a * other.b) / other.a)


# ------------------------------------------------------------------------------------ and/or trees


def holds(tree, truth):
    """Return the truth of an and/or tree: an index, ``("all", ...)`` or ``("any", ...)``."""
    if isinstance(tree, int):
        return bool(truth[tree])
    word, children = tree
    return {"all": all, "any": any}[word](holds(child, truth) for child in children)


def implicit(tree, values):
    """Return the minimum over "all" and the maximum over "any" of numbers."""
    if isinstance(tree, int):
        return values[tree]
    word, children = tree
    parts = [implicit(child, values) for child in children]
    return {"all": min, "any": max}[word](parts)


def truth_table(signs):
    """Yield every choice of truth for the functions with sign 0; the others are decided."""
    options = [(True,) if s > 0 else (False,) if s < 0 else (True, False) for s in signs]
    yield from itertools.product(*options)


# --------------------------------------------------------------------------------- linear algebra


def exact_rank(rows):
    """Return the rank of an integer matrix by elimination in fractions."""
    return len(reduced([[Fraction(int(x)) for x in row] for row in rows])[1])


def fastest_rate(a, e):
    """Return ``max min_i a_i d`` over ``|d_j| <= 1``, ``e d = 0``, by trying every vertex."""
    m, n = a.shape
    both = np.hstack([np.vstack([e, -e]), np.zeros((2 * len(e), 1))])
    moving = np.hstack([a, -np.ones((m, 1))])
    sides = np.vstack([moving, both, np.eye(n, n + 1), -np.eye(n, n + 1)])
    bounds = np.concatenate([np.zeros(m + len(both)), -np.ones(2 * n)])
    best = -math.inf
    for chosen in itertools.combinations(range(len(sides)), n + 1):
        square = sides[list(chosen)]
        if abs(np.linalg.det(square)) < 1e-12:
            continue
        corner = np.linalg.solve(square, bounds[list(chosen)])
        if (sides @ corner >= bounds - 1e-9).all():
            best = max(best, corner[-1])
    return best


# --------------------------------------------------------------------------------------- dumbbells


def renamed(name, images):
    """Return a contact after its balls and rods were renamed, the part of A first."""
    parts = (name[:2], name[2:]) if name[1].isdigit() else (name[:1], name[1:])
    return "".join(sorted((images.get(part, part) for part in parts), key=str.lower))


def balls(pair, q):
    """Return the centres of A1, A2, B1, B2 ``(..., 4, 3)`` from the definition.

    Half the length times the heading's sine is the half chord; it subtends ``asin(chord / rho)``.
    """
    q = np.asarray(q, dtype=float)
    centres = []
    for k in (0, 3):
        for sign in (-1, 1):
            lateral = sign * pair.length / 2 * np.sin(q[..., k + 2])
            along = q[..., k + 1] + sign * pair.length / 2 * np.cos(q[..., k + 2])
            if math.isinf(pair.drum_radius):
                centres.append(np.stack([q[..., k] + lateral, along, 0 * along], axis=-1))
                continue
            rho = pair.drum_radius - pair.ball_radius
            phi = q[..., k] + np.arcsin(lateral / rho)
            centres.append(np.stack([rho * np.sin(phi), along, -rho * np.cos(phi)], axis=-1))
    return np.stack(centres, axis=-2)


def from_segment(p, start, end):
    """Return the distance of points from segments: from the nearest point of the segment."""
    u = end - start
    at = np.clip(np.sum((p - start) * u, -1) / np.sum(u * u, -1), 0, 1)
    return np.linalg.norm(p - start - at[..., None] * u, axis=-1)


def between_segments(a1, a2, b1, b2):
    """Return the distance of segments by narrowing in on the nearest point of the first one.

    The distance from a convex set is convex along a line, so thirds can be discarded.
    """
    low, high = np.zeros(a1.shape[:-1]), np.ones(a1.shape[:-1])

    def far(s):
        return from_segment(a1 + s[..., None] * (a2 - a1), b1, b2)

    for _ in range(100):
        left, right = (2 * low + high) / 3, (low + 2 * high) / 3
        further = far(left) > far(right)
        low, high = np.where(further, left, low), np.where(further, high, right)
    return np.minimum(far((low + high) / 2), np.minimum(far(low * 0), far(low * 0 + 1)))


def gaps(pair, q):
    """Return the nine gaps ``(..., 9)`` in the order of ``CONTACTS``, by minimisation."""
    a1, a2, b1, b2 = (balls(pair, q)[..., i, :] for i in range(4))
    r, t = pair.ball_radius, pair.rod_radius
    apart = [np.linalg.norm(a - b, axis=-1) - 2 * r for a in (a1, a2) for b in (b1, b2)]
    apart += [from_segment(a, b1, b2) - r - t for a in (a1, a2)]
    apart += [from_segment(b, a1, a2) - r - t for b in (b1, b2)]
    apart += [between_segments(a1, a2, b1, b2) - 2 * t]
    return np.stack(apart, axis=-1)


def sampled_rod_distance(pair, q, points=2001):
    """Return the distance of the rods of one placement from densely sampled points on both."""
    a1, a2, b1, b2 = balls(pair, q)
    s = np.linspace(0, 1, points)[:, None]
    first, second = a1 + s * (a2 - a1), b1 + s * (b2 - b1)
    return min(float(np.linalg.norm(second - p, axis=1).min()) for p in first)


def long_gaps(pair, q):
    """Return the nine gaps of one placement in long arithmetic, from minimisation over the square.

    The squared distance of ``A(s)`` and ``B(t)`` is a convex quadratic: its least value lies at
    the critical point if that is inside the square, otherwise on one of the four sides.
    """
    centres = long_balls(pair, q)
    r, t = mpmath.mpf(pair.ball_radius), mpmath.mpf(pair.rod_radius)
    a, b = centres[:2], centres[2:]
    apart = [_norm(_minus(p, c)) - 2 * r for p in a for c in b]
    ends = [_from_segment(p, *b) for p in a] + [_from_segment(p, *a) for p in b]
    apart += [end - r - t for end in ends]
    return [*apart, _between(a, b, ends) - 2 * t]


def long_balls(pair, q):
    """Return the four centres in long arithmetic."""
    half = mpmath.mpf(pair.length) / 2
    centres = []
    for k in (0, 3):
        for sign in (-1, 1):
            lateral = sign * half * mpmath.sin(q[k + 2])
            along = q[k + 1] + sign * half * mpmath.cos(q[k + 2])
            if math.isinf(pair.drum_radius):
                centres.append((q[k] + lateral, along, mpmath.mpf(0)))
                continue
            rho = mpmath.mpf(pair.drum_radius) - mpmath.mpf(pair.ball_radius)
            phi = q[k] + mpmath.asin(lateral / rho)
            centres.append((rho * mpmath.sin(phi), along, -rho * mpmath.cos(phi)))
    return centres


def long_energy(pair, q):
    """Return the sum of heights of balls and weighted rod centres, in long arithmetic.

    In the plane: half the weighted sum of squared lateral positions.
    """
    centres, w = long_balls(pair, q), mpmath.mpf(pair.rod_weight)
    if math.isinf(pair.drum_radius):
        middles = [(centres[i][0] + centres[i + 1][0]) / 2 for i in (0, 2)]
        half = [(centres[i + 1][0] - centres[i][0]) / 2 for i in (0, 2)]
        rods = sum(m**2 + d**2 for m, d in zip(middles, half, strict=True))
        return [(sum(c[0] ** 2 for c in centres) + w * rods) / 2]
    heights = [pair.drum_radius + c[2] for c in centres]
    rods = [(heights[i] + heights[i + 1]) / 2 for i in (0, 2)]
    return [sum(heights) + w * sum(rods)]


def _minus(p, q):
    return tuple(x - y for x, y in zip(p, q, strict=True))


def _dot(u, v):
    return sum(x * y for x, y in zip(u, v, strict=True))


def _norm(u):
    return mpmath.sqrt(_dot(u, u))


def _from_segment(p, start, end):
    u = _minus(end, start)
    at = min(max(_dot(_minus(p, start), u) / _dot(u, u), mpmath.mpf(0)), mpmath.mpf(1))
    return _norm(tuple(x - y - at * z for x, y, z in zip(p, start, u, strict=True)))


def _between(a, b, sides):
    u, v, w = _minus(a[1], a[0]), _minus(b[1], b[0]), _minus(a[0], b[0])
    normal = mpmath.matrix([[_dot(u, u), -_dot(u, v)], [-_dot(u, v), _dot(v, v)]])
    if mpmath.det(normal) > mpmath.mpf(10) ** -40:
        s, t = mpmath.lu_solve(normal, mpmath.matrix([-_dot(u, w), _dot(v, w)]))
        if 0 < s < 1 and 0 < t < 1:
            return _norm(tuple(x + s * y - t * z for x, y, z in zip(w, u, v, strict=True)))
    return min(sides)
