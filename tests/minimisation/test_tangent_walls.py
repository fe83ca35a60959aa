"""Walls that only touch what equations define: they take nothing away, and hold nothing.

The oracle parametrises the set, or knows it as one without the walls.
"""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, certify, minima, minimise
from polycorner.formulas import Family

seeds = st.integers(0, 2**32 - 1)
offsets = st.floats(-8, -4).map(lambda power: 10.0**power)
FEW = settings(max_examples=4)
PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols


def quadratic(n):
    """``u.Q.u/2 + c.u + d`` as a family, so that random members compile once."""
    u = sp.symbols(f"u:{n}")
    names = [*(f"q{i}_{j}" for i in range(n) for j in range(i, n)), *(f"c{i}" for i in range(n))]
    p = iter(sp.symbols([*names, "d"]))
    form = sum(next(p) * u[i] * u[j] for i in range(n) for j in range(i, n))
    form += sum(next(p) * v for v in u) + next(p)
    return Family.of({"f": form}, [f"u{i}" for i in range(n)], [*names, "d"])


FAMILIES = {n: quadratic(n) for n in (2, 3, 4, 5, 7, 10)}


def space(n):
    return Manifold.euclidean(" ".join(f"u{i}" for i in range(n)))


def member(n, label, Q, c, d):
    """``u.Q.u + c.u + d``."""
    Q = np.asarray(Q) + np.asarray(Q).T - np.diag(np.diag(Q))
    numbers = [*Q[np.triu_indices(n)], *c, d]
    return SmoothFunction.member(FAMILIES[n], "f", space(n), parameters=numbers, label=label)


def half_space(n, label, normal, point):
    return member(n, label, np.zeros((n, n)), normal, -float(np.dot(normal, point)))


def quadric(n, label, A, centre):
    """``(u - c).A.(u - c) - 1``."""
    return member(n, label, A, -2 * A @ centre, float(centre @ A @ centre) - 1)


def rotation(n, rng):
    return np.linalg.qr(rng.standard_normal((n, n)))[0]


def ellipsoid(n, rng, walls):
    """Return an ellipsoid with half-spaces that touch it, the points, and the lowest point."""
    turn, centre = rotation(n, rng), rng.standard_normal(n)
    A = (turn * rng.uniform(0.3, 3, n)) @ turn.T
    normals = rng.standard_normal((walls, n))
    reach = np.linalg.solve(A, normals.T).T
    touched = centre + reach / np.sqrt(np.einsum("ij,ij->i", normals, reach))[:, None]
    pieces = [
        half_space(n, f"w{i}", -v * rng.uniform(0.5, 2), p)
        for i, (v, p) in enumerate(zip(normals, touched, strict=True))
    ]
    D = Polyhedron(space(n), pieces, [quadric(n, "shell", A, centre)])
    slope = rng.standard_normal(n)
    way = np.linalg.solve(A, slope)
    lowest = centre - way / np.sqrt(slope @ way)
    return D, slope, touched, lowest


def linear(n, slope):
    return member(n, "E", np.zeros((n, n)), slope, 0.0)


@pytest.mark.parametrize("method", ["newton", "slsqp"])
@pytest.mark.parametrize("n", [2, 3, 5, 10])
@FEW
@given(seed=seeds)
@example(seed=19463)  # the circle falls by 0.0025 only where it touches a wall
@example(seed=552)
def test_a_unit_vector_with_bounds(n, method, seed):
    """On the sphere ``c.u`` is least at ``-c/|c|``; ``|u_i| <= 1`` is true there anyway."""
    rng = np.random.default_rng(seed)
    box = [
        half_space(n, f"w{i}{s}", -s * np.eye(n)[i], s * np.eye(n)[i])
        for i in range(n)
        for s in (1, -1)
    ]
    D = Polyhedron(space(n), box, [quadric(n, "sphere", np.eye(n), np.zeros(n))])
    slope, start = rng.standard_normal((2, n))
    # Nearer to a wall than the tolerance it counts as touched, though its gradient is not parallel;
    # SciPy's search may already end beside one that is a little farther away.
    beside = 1e-8 if method == "newton" else 1e-4
    assume(abs(slope).max() < (1 - beside) * np.linalg.norm(slope))
    c = minimise(D, linear(n, slope), start / np.linalg.norm(start), method=method)
    assert c.verdict.name == "STRICT_MINIMUM"
    assert c.point == pytest.approx(-slope / np.linalg.norm(slope), abs=1e-6)


def test_the_unit_circle_in_its_box():
    box = {"east": 1 - x, "west": 1 + x, "north": 1 - y, "south": 1 + y}
    D = Polyhedron(PLANE, box, {"circle": x**2 + y**2 - 1})
    assert minimise(D, x + y, [0.6, 0.8]).energy == pytest.approx(-np.sqrt(2))
    for energy, least in ((x + y, -np.sqrt(2)), (x - 100 * y, -np.sqrt(10001)), (-y, -1.0)):
        found = minima(D, energy, starts=30, box=[(-1, 1), (-1, 1)])
        assert [c.energy for c in found] == pytest.approx([least])
        assert found.counts == (30,)


@FEW
@given(seed=seeds, n=st.sampled_from([2, 3, 4]), walls=st.integers(1, 3))
def test_an_ellipsoid_with_walls_that_touch_it(seed, n, walls):
    rng = np.random.default_rng(seed)
    D, slope, _, lowest = ellipsoid(n, rng, walls)
    found = minima(D, linear(n, slope), starts=lowest + rng.standard_normal((6, n)))
    assert len(found) == 1
    assert found[0].verdict.name == "STRICT_MINIMUM"
    assert found[0].point == pytest.approx(lowest, abs=1e-6)


@settings(max_examples=25)
@given(seed=seeds, n=st.sampled_from([2, 3, 4]), off=offsets)
@example(seed=0, n=2, off=1e-5)
def test_beside_the_point_of_contact_nothing_is_called_a_minimum(seed, n, off):
    """The energy falls along the shell, to first order, at the contact and all around it."""
    rng = np.random.default_rng(seed)
    D, slope, touched, _ = ellipsoid(n, rng, 1)
    normal = D.functions[0].gradient(touched[0])
    along = rng.standard_normal(n)
    along -= normal * (normal @ along) / (normal @ normal)
    for p in (touched[0] + off * along, touched[0] - off * along, touched[0]):
        assert not certify(D, linear(n, slope), p).is_minimum


@pytest.mark.parametrize("power", [2, 3, 4])
@pytest.mark.parametrize("slope", [1.0, -1.0, 30.0])
def test_a_curve_with_a_line_that_touches_it(power, slope):
    """On ``y = x^p >= 0``, beside the origin, ``E = slope x + y`` is stationary nowhere."""
    D = Polyhedron(PLANE, {"line": y}, {"curve": y - x**power})
    for at in (1e-8, 1e-6, 1e-5, 1e-4, 1e-3):
        for side in (1, -1):
            p = [side * at, 0.0]
            assert not certify(D, slope * x + y, p).is_minimum


@FEW
@given(seed=seeds)
def test_a_parabola_turned_about_its_tangent(seed):
    """With ``v = u^2 >= 0``, ``a v + b u`` is least at ``u = -b / 2 a``."""
    rng = np.random.default_rng(seed)
    turn, (a, b, left, right) = rotation(2, rng), rng.uniform(0.5, 2, 4)
    across, along = turn
    parabola = member(2, "parabola", -np.outer(along, along), across, 0.0)
    D = Polyhedron(space(2), [half_space(2, "line", across, np.zeros(2))], [parabola])
    starts = [u * along + u * u * across for u in (-left, right, 0.1, 1e-3)]
    found = minima(D, linear(2, a * across + b * along), starts=np.array(starts))
    u = -b / (2 * a)
    assert len(found) == 1
    assert found[0].point == pytest.approx(u * along + u * u * across, abs=1e-7)


def test_a_minimum_at_the_point_of_contact_stays_one():
    D = Polyhedron(PLANE, {"north": 1 - y}, {"circle": x**2 + y**2 - 1})
    for energy in (-y, -y - x**2 / 4):
        assert certify(D, energy, [0, 1]).is_minimum
        assert certify(D, energy, [1e-9, 1 + 1e-9]).is_minimum
        c = minimise(D, energy, [0.6, -0.8])
        assert c.is_minimum
        assert c.point == pytest.approx([0, 1], abs=1e-7)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 5e-11])
def test_a_wall_that_cuts_a_little_off_holds_its_corner(gap):
    """However small the angle at an exact corner, it is one; ``x + y`` is least on its right."""
    corner = np.sqrt(gap * (2 - gap))
    D = Polyhedron(PLANE, {"north": 1 - y - gap}, {"circle": x**2 + y**2 - 1})
    assert certify(D, x + y, [corner, 1 - gap]).verdict.name == "STRICT_MINIMUM"
    assert not certify(D, x + y, [-corner, 1 - gap]).is_minimum
