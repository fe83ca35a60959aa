"""Generated problems: every result must be true, and the three methods must agree."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import feasible_around
from polynomials import count, linear, polynomial, quadratic
from scipy.optimize import linprog

from polycorner import (
    AllOf,
    AnyOf,
    Manifold,
    Polyhedron,
    SmoothFunction,
    Verdict,
    certify,
    minimise,
    stationary_on,
)

METHODS = ("newton", "slsqp", "scp")
every_method = pytest.mark.parametrize("method", METHODS)
SPACES = {n: Manifold.euclidean([f"x{i + 1}" for i in range(n)]) for n in (1, 2, 3, 4)}
whole = st.integers(-2, 2).map(float)
# Coefficients of ordinary size: an energy of 1e-308 cannot be told from none.
real = st.just(0.0) | st.floats(1e-6, 2) | st.floats(-2, -1e-6)


# ------------------------------------------------------------------------- linear programmes


@st.composite
def polytopes(draw):
    """A polytope around the origin, often with more faces at a corner than dimensions."""
    n = draw(st.integers(1, 4))
    rows = draw(arrays(float, (draw(st.integers(0, 6)), n), elements=st.sampled_from([-1.0, 0, 1])))
    rows = rows[abs(rows).sum(axis=1) > 0]
    rows = np.vstack([rows, np.eye(n), -np.eye(n)])
    room = draw(arrays(float, len(rows), elements=st.sampled_from([1.0, 2.0])))
    return SPACES[n], rows, room


def half_spaces(manifold, rows, room):
    sides = zip(rows, room, strict=True)
    return [linear(manifold, a, b, f"f{i}") for i, (a, b) in enumerate(sides)]


@every_method
@given(polytope=polytopes(), data=st.data())
def test_linear_programmes_agree_with_the_simplex_method(method, polytope, data):
    manifold, rows, room = polytope
    cost = data.draw(
        arrays(float, manifold.dimension, elements=st.sampled_from([-2.0, -1, 0, 1, 3]))
    )
    assume(cost.any())
    D = Polyhedron(manifold, half_spaces(manifold, rows, room))
    c = minimise(D, linear(manifold, cost, 0.0, "energy"), np.zeros(len(cost)), method=method)
    best = linprog(cost, A_ub=-rows, b_ub=room, bounds=(None, None))
    # Where the lowest face ends at a weakly active one, the second order may stay undecided.
    assert c.is_minimum or (c.verdict is Verdict.UNDECIDED and c.signature[2] > 0)
    assert c.energy == pytest.approx(best.fun, abs=1e-9)
    # Strong duality: the multipliers prove that nothing is lower.
    numbers = {f"f{i}": b for i, b in enumerate(room)}
    assert all(lam >= -1e-9 for lam in c.multipliers.values())
    bound = -sum(lam * numbers[name] for name, lam in c.multipliers.items())
    assert bound == pytest.approx(best.fun, abs=1e-8)
    assert c.residuals.worst < 1e-10


@every_method
@given(polytope=polytopes(), data=st.data())
def test_convex_quadratic_programmes_have_one_point_of_rest(method, polytope, data):
    manifold, rows, room = polytope
    n = manifold.dimension
    root = data.draw(arrays(float, (n, n), elements=real))
    slope = data.draw(arrays(float, n, elements=whole))
    form = root @ root.T + 0.1 * np.eye(n)
    D = Polyhedron(manifold, half_spaces(manifold, rows, room))
    c = minimise(D, quadratic(manifold, form, slope), np.zeros(n), method=method)
    assert c.verdict in {Verdict.STRICT_MINIMUM, Verdict.WEAK_MINIMUM}
    # The multipliers prove it: the gradient is a sum of inward normals, held by closed gaps.
    lam = np.array([c.multipliers.get(f"f{i}", 0.0) for i in range(len(rows))])
    gaps = rows @ c.point + room
    assert (gaps >= -1e-10).all()
    assert (lam >= -1e-9).all()
    assert form @ c.point + slope == pytest.approx(lam @ rows, abs=1e-9)
    assert lam @ gaps == pytest.approx(0, abs=1e-9)


@every_method
def test_a_wall_nearby_that_holds_nothing_is_let_go(method):
    """The wall ``f0`` passes within a thousandth of the point of rest and carries no force."""
    rows = np.array([[-1.0, -1.0, 1.0], [-1.0, 1.0, 0.0], [0.0, 0.0, -1.0]])
    root = np.array([[0, 0, 0.10546875], [1.61328125, -0.84375, -0.6875], [0, 1.16992188, 0]])
    D = Polyhedron(SPACES[3], half_spaces(SPACES[3], rows, np.array([1.0, 1.0, 2.0])))
    energy = quadratic(SPACES[3], root @ root.T + 0.1 * np.eye(3), [-1.0, 0.0, -1.0])
    c = minimise(D, energy, np.zeros(3), method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.active == ("f1",)
    assert 0 < D.values(c.point)[0] < 1e-3


def test_a_corner_of_the_lowest_face_is_a_minimum_along_it():
    # x = 1 is lowest; at (1, 0, 0) two more planes, weakly active, bound that face.
    x, y, z = SPACES[3].symbols
    D = Polyhedron(SPACES[3], {"end": 1 - x, "slope": 1 - x - z, "roof": 1 - x - y - z})
    c = certify(D, -2 * x, [1, 0, 0])
    assert c.active == ("end", "slope", "roof")
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS


@every_method
@pytest.mark.parametrize("distance", [0.3, 3.0, 100.0])
@pytest.mark.parametrize("held", ["equation", "wall"])
def test_a_steep_fall_that_is_not_allowed_does_not_slow_the_descent(method, distance, held):
    """The energy bends down a thousand times more across the line than it bends up along it."""
    x, y = SPACES[2].symbols
    energy = y**2 / 20 - 50 * x**2 + 51 * x
    walls, sections = ([], {"line": x}) if held == "equation" else ({"low": x, "high": 1 - x}, ())
    c = minimise(Polyhedron(SPACES[2], walls, sections), energy, [0.0, distance], method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.point == pytest.approx([0, 0], abs=1e-9)


# ------------------------------------------------------------------ the same function twice


@every_method
def test_the_energy_may_be_one_of_the_constraints(method):
    """How far a gap can close on the set that it bounds: to zero."""
    x, y = SPACES[2].symbols
    floor = SmoothFunction("floor", y - x**2, SPACES[2])
    D = Polyhedron(SPACES[2], [floor, SmoothFunction("wall", x - 1, SPACES[2])])
    c = minimise(D, floor, [2.0, 6.0], method=method)
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert c.energy == pytest.approx(0, abs=1e-12)
    assert c.multipliers == pytest.approx({"floor": 1})


def test_a_face_may_be_where_the_energy_vanishes():
    x, y = SPACES[2].symbols
    floor = SmoothFunction("floor", y - x**2, SPACES[2])
    D = Polyhedron(SPACES[2], [floor, SmoothFunction("wall", x - 1, SPACES[2])])
    c = stationary_on(D, floor, [2.0, 4.1], ["floor", "wall"])
    assert c.point == pytest.approx([1, 1], abs=1e-12)


@every_method
@pytest.mark.parametrize("start", [(1.0, 7.0), (1.0, 1.0)])
def test_both_parts_of_a_union_may_have_the_same_wall(method, start):
    wall = [linear(SPACES[2], [1.0, 0.0], 0.0, label) for label in ("below", "above")]
    _, y = SPACES[2].symbols
    D = Polyhedron(SPACES[2], AnyOf(AllOf(wall[0], y - 5), AllOf(wall[1], 5 - y)))
    x, y = SPACES[2].symbols
    c = minimise(D, x + y**2, start, method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.point == pytest.approx([0, 0], abs=1e-9)


# ------------------------------------------------------------------------------- saddles


@pytest.mark.parametrize("energy", ["x1*x2", "x1**2 - x2**2", "x1*x2 - x2**2", "x1**2*x2 - x2**2"])
@pytest.mark.parametrize("start", [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.5, 0.5)])
def test_the_descent_does_not_rest_on_a_saddle(energy, start):
    D = Polyhedron(SPACES[2], [quadratic(SPACES[2], -2 * np.eye(2), constant=9.0, label="ball")])
    c = minimise(D, sp.sympify(energy, {s.name: s for s in SPACES[2].symbols}), start)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.active == ("ball",)


@every_method
@pytest.mark.parametrize("energy", ["x1*x2", "x1**3 + x1", "x1**2*x2", "x1**3 - x2**3 - x2"])
def test_no_method_gets_lost_in_a_ball(method, energy):
    D = Polyhedron(SPACES[2], [quadratic(SPACES[2], -2 * np.eye(2), constant=9.0, label="ball")])
    E = sp.sympify(energy, {s.name: s for s in SPACES[2].symbols})
    c = minimise(D, E, [1.0, 1.0], method=method)
    assert c.verdict not in {Verdict.INFEASIBLE, Verdict.OUTSIDE, Verdict.UNBOUNDED}
    assert D.contains(c.point, tolerance=1e-9)


# -------------------------------------------------------------------- polynomial programmes


@st.composite
def programmes(draw, *, equation=None, inside=None):
    """Polynomials of degree up to three in a ball around the origin, which is inside.

    ``equation`` says whether there is one, ``inside`` whether the start is; None leaves it open.
    """
    manifold = SPACES[draw(st.integers(2, 3))]
    n = manifold.dimension
    elements = draw(st.sampled_from([whole, real]))

    def member(degree, label, constant):
        numbers = draw(arrays(float, count(manifold, degree), elements=elements))
        assume(abs(numbers).max() > 0.1)
        return polynomial(manifold, degree, numbers, label, constant=constant)

    walls = [
        member(draw(st.integers(1, 2)), f"f{i}", draw(st.floats(0.1, 2)))
        for i in range(draw(st.integers(0, 3)))
    ]
    ball = quadratic(manifold, -2 * np.eye(n), constant=9.0, label="ball")
    sections = (
        [member(draw(st.integers(1, 2)), "h", 0.0)]
        if draw(st.booleans() if equation is None else st.just(equation))
        else []
    )
    D = Polyhedron(manifold, [*walls, ball], sections)
    energy = member(draw(st.integers(1, 3)), "energy", 0.0)
    start = draw(arrays(float, n, elements=st.floats(-2, 2)))
    assume(inside is None or D.contains(start) == inside)
    return D, energy, start


generous = settings(suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])


@every_method
@generous
@given(programme=programmes())
def test_a_certified_minimum_is_one(method, programme):
    D, energy, start = programme
    c = minimise(D, energy, start, method=method)
    if not c.is_minimum:
        assert not c.holds(1)
        return
    assert D.contains(c.point, tolerance=1e-9)
    assert c.residuals.worst < 1e-9
    if D.equations:
        return
    around = feasible_around(D, c.point, (1e-4, 1e-2), np.random.default_rng(3), 2000)
    if len(around):
        lowest = energy.value(around).min()
        assert lowest >= c.energy - 1e-11 * (1 + abs(c.energy))


@every_method
@generous
@given(programme=programmes(equation=False, inside=True))
def test_a_start_inside_a_bounded_set_comes_to_rest(method, programme):
    """In a compact set an energy has a minimum, and a start inside needs no restoring."""
    D, energy, start = programme
    c = minimise(D, energy, start, method=method)
    assert c.verdict not in {Verdict.INFEASIBLE, Verdict.OUTSIDE, Verdict.UNBOUNDED}
    if method == "newton":
        assert c.is_minimum or c.verdict is Verdict.UNDECIDED
        assert c.energy <= float(energy.value(start)) + 1e-12


@generous
@given(programme=programmes(equation=True))
def test_equations_are_met_exactly(programme):
    D, energy, start = programme
    c = minimise(D, energy, start)
    assert c.verdict is not Verdict.UNBOUNDED
    if c.verdict is not Verdict.INFEASIBLE:
        assert abs(D.equation_values(c.point)).max() < 1e-9
