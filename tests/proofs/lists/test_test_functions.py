"""Test functions of global optimisation on boxes and discs, counted twice.

The second way is algebra: critical points by resultants, those on sides and circles as roots of
polynomials in one parameter.
"""

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron
from polycorner.proofs import stationary_points

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
T = sp.Symbol("t", real=True)
HIMMELBLAU = (X**2 + Y - 11) ** 2 + (X + Y**2 - 7) ** 2
CAMEL = (4 - sp.Rational(21, 10) * X**2 + X**4 / 3) * X**2 + X * Y + (4 * Y**2 - 4) * Y**2
BOOTH = (X + 2 * Y - 7) ** 2 + (2 * X + Y - 5) ** 2
ROSENBROCK = (1 - X) ** 2 + 10 * (Y - X**2) ** 2
SEXTIC = (X**3 - 3 * X) ** 2 + (Y - X) ** 4 / 4 + Y**2 / 3


def real(polynomial, symbol):
    """Return the real roots of a polynomial."""
    roots = sp.Poly(polynomial, symbol).nroots(40, maxsteps=500)
    return [sp.re(r) for r in roots if abs(sp.im(r)) < 1e-25]


def free(energy):
    """Return the critical points in the plane: a resultant, then the common roots."""
    slopes = energy.diff(X), energy.diff(Y)
    found = []
    for a in real(sp.resultant(*map(sp.expand, slopes), Y), X):
        ends = real(slopes[1].subs(X, a), Y)
        found += [(a, b) for b in ends if abs(slopes[0].subs({X: a, Y: b})) < 1e-15]
    return found


def on_curve(energy, x, y, slope):
    """Return the points of a rational curve at which the energy is critical along it.

    ``slope`` is the gradient of the function that vanishes there; a point rests if its multiplier
    is positive.
    """
    along = sp.numer(sp.together(energy.subs({X: x, Y: y}, simultaneous=True).diff(T)))
    found = []
    for t in real(sp.expand(along), T):
        at = {X: x.subs(T, t), Y: y.subs(T, t)}
        pull = sum(energy.diff(s).subs(at) * g.subs(at) for s, g in zip((X, Y), slope, strict=True))
        if pull > 0:
            found.append((at[X], at[Y]))
    return found


def of_disc(energy, radius):
    circle = radius * (1 - T**2) / (1 + T**2), radius * 2 * T / (1 + T**2)
    inside = [(a, b) for a, b in free(energy) if a**2 + b**2 < radius**2]
    return inside + on_curve(energy, *circle, (-2 * X, -2 * Y))


def of_square(energy, side):
    inside = [(a, b) for a, b in free(energy) if max(abs(a), abs(b)) < side]
    for s in map(sp.sympify, (side, -side)):
        on = on_curve(energy, s, T, (-s, sp.Integer(0)))
        inside += [(a, b) for a, b in on if abs(b) < side]
        on = on_curve(energy, T, s, (sp.Integer(0), -s))
        inside += [(a, b) for a, b in on if abs(a) < side]
        for r in (side, -side):
            slopes = [energy.diff(c).subs({X: s, Y: r}) for c in (X, Y)]
            if slopes[0] * s < 0 and slopes[1] * r < 0:
                inside.append((s, r))
    return inside


def agree(found, expected):
    mine = sorted(np.round([p.point for p in found], 8).tolist())
    theirs = sorted(np.round(np.array(expected, dtype=float), 8).tolist())
    assert len(mine) == len(theirs)
    np.testing.assert_allclose(mine, theirs, atol=2e-8)


# Energy, radius of the disc or half the side of the square, minima in the literature where all of
# them lie inside.
CASES = {
    "himmelblau 6": (HIMMELBLAU, 6, 4),
    "himmelblau 4": (HIMMELBLAU, 4, 4),
    "himmelblau 7/2": (HIMMELBLAU, sp.Rational(7, 2), None),
    "camel 3": (CAMEL, 3, 6),
    "camel 1": (CAMEL, 1, None),
    "booth 5": (BOOTH, 5, 1),
    "booth 2": (BOOTH, 2, None),
    "rosenbrock 2": (ROSENBROCK, 2, 1),
    "sextic 2": (SEXTIC, 2, None),
}


@pytest.mark.parametrize("shape", ["disc", "square"])
@pytest.mark.parametrize("case", CASES)
def test_all_stationary_points_are_those_of_algebra(case, shape):
    energy, size, minima = CASES[case]
    disc = {"disc": size**2 - X**2 - Y**2}
    square = {"right": size - X, "left": size + X, "top": size - Y, "bottom": size + Y}
    reach = float(size) + 0.25
    found = stationary_points(
        Polyhedron(PLANE, disc if shape == "disc" else square), energy, box=[(-reach, reach)] * 2
    )
    assert found.complete
    agree(found, (of_disc if shape == "disc" else of_square)(energy, size))
    assert minima in {None, len(found.minima)}


def shubert(s):
    return sum(k * sp.cos((k + 1) * s + k) for k in range(1, 6))


def places(side):
    """Return the critical points of Shubert's sum of cosines, and the ends, with signs.

    The signs are those of the sum, of its second derivative, and of its derivative outward.
    """
    f = sp.lambdify(T, [shubert(T).diff(T, k) for k in range(3)])
    grid = np.linspace(-side, side, 40_001)
    slopes = np.array(f(grid)[1])
    found = []
    for k in np.flatnonzero(slopes[:-1] * slopes[1:] < 0):
        t = grid[k]
        for _ in range(30):
            t -= f(t)[1] / f(t)[2]
        found.append((t, f(t)[0], f(t)[2], 0))
    return [*found, *((t, f(t)[0], 0, f(t)[1] * np.sign(t)) for t in (-side, side))]


def of_shubert(side):
    """Return the minima of the product of two such sums, those on sides and at corners included.

    Where both factors are critical the second derivatives are f'' g and f g''; at an end the
    derivative outward has to be negative.  Where both factors vanish there is a saddle.
    """
    return [
        (a, b)
        for a, p, bent, out in places(side)
        for b, q, also_bent, also_out in places(side)
        if (bent * q > 0 or out * q < 0) and (p * also_bent > 0 or p * also_out < 0)
    ]


@pytest.mark.parametrize(("side", "inner", "all_"), [(2, 24, 33), (10, 722, 761)])
def test_minima_of_shuberts_function(side, inner, all_):
    """The count of 760 in the literature is neither that of the open square nor of the closed."""
    square = {"right": side - X, "left": side + X, "top": side - Y, "bottom": side + Y}
    reach = side + 0.25
    energy = shubert(X) * shubert(Y)
    found = stationary_points(Polyhedron(PLANE, square), energy, box=[(-reach, reach)] * 2)
    assert found.complete
    agree(found.minima, of_shubert(side))
    assert (len(found.minima), sum(not p.active for p in found.minima)) == (all_, inner)
    if side == 10:
        values = sorted(found.problem.energy.value(p.point) for p in found.minima)
        assert values[17] < -186.73 < values[18]  # the eighteen global ones
