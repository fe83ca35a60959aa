"""Ways of quasi-static systems, against balls that roll down a grid, and gradient flows."""

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import branches, hysteresis

LINE, PLANE = Manifold.euclidean("x"), Manifold.euclidean("x y")
(x,) = LINE.symbols
t = sympy.Symbol("t")
WELL = x**4 / 4 - x**2 / 2 - t * x
FAR = {"far": x + 9}


def diagram(functions, energy, start, value, interval, manifold=LINE, **options):
    def function(name, expression):
        known = {"t": value} if sympy.sympify(expression).has(t) else {}
        return SmoothFunction(name, expression, manifold, parameters=known)

    d = Polyhedron(manifold, [function(name, f) for name, f in functions.items()])
    return branches(minimise(d, function("energy", energy), start), "t", interval, **options)


def roll(values, parameters, k):
    """Return where a ball on a grid moves far as the energy changes, and where it ends.

    Each move is the parameter, and the places before and after.
    """
    moves = []
    for s in parameters:
        row, first = values(s), k
        while True:
            best = min(range(max(k - 1, 0), min(k + 2, len(row))), key=lambda i: row[i])
            if row[best] >= row[k]:
                break
            k = best
        if abs(k - first) > 40:
            moves.append((s, first, k))
    return moves, k


@pytest.mark.parametrize("seed", range(4))
def test_jumps_are_those_of_a_ball_that_rolls_down_a_grid(seed):
    rng = np.random.default_rng(seed)
    c = rng.normal(size=6) * [1, 2, 1, 2, 1, 1]
    left, right = -1.5 - 0.3 * rng.random(), 1.5 + 0.3 * rng.random()
    p = sum(a * sympy.cos(k * x + a) for k, a in enumerate(c, 1))
    grid = np.linspace(left, right, 4001)
    base = sympy.lambdify(x, p)(grid)
    reach = 6.0
    d = diagram({"l": x - left, "r": right - x}, p - t * x, [left], -reach, (-reach, reach))
    loop = hysteresis(d, start=[grid[np.argmin(base + reach * grid)]])
    up = np.linspace(-reach, reach, 1201)
    k = int(np.argmin(abs(grid - d.arcs[loop.legs[0].arc].at(-reach))))
    expected, last = roll(lambda s: base - s * grid, [*up, *up[-2::-1]], k)
    assert len(loop.jumps) == len(expected)
    for jump, (s, i, j) in zip(loop.jumps, expected, strict=True):
        assert jump.parameter == pytest.approx(s, abs=0.02)
        assert jump.start == pytest.approx(grid[i], abs=0.1)
        assert jump.end == pytest.approx(grid[j], abs=0.02)
    assert loop.closed == (abs(last - k) < 10)
    change = loop.legs[0].energies[0] - loop.legs[-1].energies[-1]
    assert loop.work + change == pytest.approx(loop.released, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("seed", range(2))
def test_a_fall_ends_where_the_gradient_flow_does(seed):
    u, v = PLANE.symbols
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, 3))
    waves = sum(3 * a[k] * sympy.cos(2 * u + 3 * b[k] * v + c[k]) for k in range(3))
    energy = waves + u**2 / 2 + v**2 / 2 - 4 * t * u
    d = diagram({"far": u + 90}, energy, [-2.0, 0.5], -2.0, (-2.0, 2.0), PLANE)
    loop = hysteresis(d, (-2.0, 2.0))
    slope = sympy.lambdify((u, v, t), [sympy.diff(-energy, q) for q in (u, v)])
    assert loop.jumps
    for jump in loop.jumps:
        beyond = jump.parameter + 4e-4
        flow = solve_ivp(
            lambda _, q, s=beyond: slope(*q, s), (0, 1e3), jump.start, "LSODA",
            rtol=1e-9, atol=1e-11,
        )  # fmt: skip
        np.testing.assert_allclose(jump.end, flow.y[:, -1], atol=2e-3)


def test_the_area_is_what_is_released():
    """Of a cubic spline: the error falls as the fourth power of the step."""
    d = diagram(FAR, WELL, [-1.0], -0.6, (-0.6, 0.6))
    errors = []
    for between in (0, 1, 3):
        loop = hysteresis(d, between=between)
        assert loop.closed
        assert loop.released == pytest.approx(1.5, abs=1e-9)
        errors.append(abs(loop.work - 1.5))
    assert errors[0] < 1e-3
    assert errors[2] < errors[0] / 60


def test_the_way_does_not_depend_on_stops():
    d = diagram(FAR, WELL, [-1.0], -0.6, (-0.6, 0.6))
    told = []
    once = hysteresis(d, progress=lambda *given: told.append(given))
    assert told[-1] == (len(once.legs), None, "t = -0.6")
    often = hysteresis(d, (-0.6, 0.1, 0.384, 0.5, 0.6, 0.2, -0.384, -0.6))
    assert often.closed
    for one, other in zip(once.jumps, often.jumps, strict=True):
        assert one.parameter == other.parameter
        assert one.released == pytest.approx(other.released, abs=1e-12)
    assert once.work == pytest.approx(often.work, abs=1e-4)


def test_a_way_that_begins_in_the_upper_well_is_closed_after_a_round():
    d = diagram(FAR, WELL, [-1.0], -0.1, (-0.6, 0.6))
    first = hysteresis(d, (0.1, 0.6, -0.6, 0.1), start=[1.1])
    assert not first.closed
    assert len(hysteresis(d, (0.1, 0.6, -0.6, 0.1), start=[-1.0]).jumps) == 2
    assert hysteresis(d, (0.1, 0.3, 0.1), start=[1.1]).closed
    lowest = hysteresis(d, (-0.1, -0.3)).legs[0]
    assert lowest.points[0] < 0


def test_a_wall_that_pushes_does_work():
    """Pushed over the hill at 0 from -1, a ball falls to 1: 1/4 of work, 1/4 released."""
    d = diagram({"wall": x - t}, x**4 / 4 - x**2 / 2, [-1.0], -2.0, (-2.0, 0.5))
    way = hysteresis(d)
    (jump,) = way.jumps
    assert (jump.kind.name, jump.before, jump.after) == ("CORNER_LIMIT", ("wall",), ())
    assert jump.parameter == pytest.approx(0, abs=1e-9)
    assert jump.end == pytest.approx(1)
    assert jump.released == pytest.approx(1 / 4)
    assert way.work == pytest.approx(1 / 4, abs=1e-5)
    assert len(way.diagrams) == 2
    assert not way.closed
    for leg in way.legs:
        pushed = leg.points[:, 0] ** 3 - leg.points[:, 0] if leg.active else 0 * leg.parameters
        np.testing.assert_allclose(leg.forces, pushed, atol=1e-9)


def test_symmetric_branches():
    """A supercritical pitchfork is passed without a jump, a subcritical one is not."""
    sextic = {-1: 1 / 12, 1: 0.0}  # of -+x^4/4 + x^6/6 - t x^2/2, from 0 down to x = 1
    for sign, released in sextic.items():
        d = diagram(FAR, sign * x**4 / 4 + x**6 / 6 - t * x**2 / 2, [0.1], -0.5, (-0.5, 0.5))
        way = hysteresis(d, (-0.5, 0.5))
        assert way.released == pytest.approx(released, abs=1e-9)
        assert not way.note
        assert abs(way.legs[-1].points[-1, 0]) > 0.5


def test_where_the_set_vanishes_the_way_ends():
    u, v = PLANE.symbols
    functions = {"a": v - u, "b": v + u, "c": t - v}
    d = diagram(functions, v + u / 10, [0.0, 0.0], 0.5, (-1.0, 1.0), PLANE)
    way = hysteresis(d, (1.0, -1.0))
    assert way.note == "the component of the set vanishes there"
    assert way.legs[-1].parameters[-1] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "path", [(0.0,), (0.0, 0.0), (-0.6, 0.7), [[0.0, 0.1]], "up", (0.0, float("nan"))]
)
def test_paths_are_checked(path):
    d = diagram(FAR, WELL, [-1.0], -0.6, (-0.6, 0.6))
    with pytest.raises((ValueError, TypeError), match=r"^path: expected"):
        hysteresis(d, path)


@pytest.mark.parametrize("seed", [23, 25])
def test_a_fall_along_walls_ends_where_the_projected_flow_does(seed):
    """In a box the flow is projected by clipping; some wells along the walls are shallow."""
    u, v = PLANE.symbols
    a, b, c = np.random.default_rng(seed).normal(size=(3, 3))
    energy = sum(a[k] * sympy.cos(3 * u + 4 * b[k] * v + c[k]) for k in range(3)) - 3 * t * (u + v)
    box = {"west": u + 1, "east": 1 - u, "south": v + 1, "north": 1 - v}
    loop = hysteresis(diagram(box, energy, [-1.0, -1.0], -2.0, (-2.0, 2.0), PLANE))
    slope = sympy.lambdify((u, v, t), [sympy.diff(-energy, q) for q in (u, v)], "math")
    ends = {
        leg.parameters[-1]: np.sign(leg.parameters[-1] - leg.parameters[0]) for leg in loop.legs
    }
    assert len(loop.jumps) > 5
    for jump in loop.jumps:
        q, beyond = jump.start, jump.parameter + 4e-4 * ends[jump.parameter]
        for _ in range(20_000):
            down = slope(*q, beyond)
            q = [min(max(x + 2e-3 * s, -1), 1) for x, s in zip(q, down, strict=True)]
        np.testing.assert_allclose(jump.end, q, atol=5e-3)
    assert loop.closed
    assert loop.work == pytest.approx(loop.released, rel=1e-6)
