"""Results of searches without a minimum to find, and on faces."""

import pytest
import sympy as sp

from polycorner import (
    Entrapment,
    Manifold,
    Polyhedron,
    Verdict,
    certify,
    minimise,
    stationary_on,
)

METHODS = ("newton", "slsqp", "scp")
every_method = pytest.mark.parametrize("method", METHODS)
M2, M3 = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = M3.symbols
QUADRANT = Polyhedron(M2, {"right": x, "up": y})


# ------------------------------------------------------------------------ what searches report


EMPTY = {
    "contradictory equations": ((), {"one": x + y - 1, "two": x + y - 2}),
    "opposite half-planes": ({"left": x - 1, "right": -x}, ()),
    "negative everywhere": ({"none": -1 - x**2 - y**2}, ()),
    "equation beside a disk": ({"disk": 1 - x**2 - y**2}, {"line": x - 3}),
}


@every_method
@pytest.mark.parametrize("kind", EMPTY)
def test_an_empty_set_is_infeasible(method, kind):
    parts, equations = EMPTY[kind]
    D = Polyhedron(M2, parts, equations)
    c = minimise(D, x**2 + y**2, [2.0, 0.5], method=method)
    assert c.verdict is Verdict.INFEASIBLE
    assert not c.holds(1)
    assert c.residuals.infeasibility > 0.1
    assert "no point of the polyhedron" in str(c)


UNBOUNDED = {
    "linear": x + y,
    "cubic": y - x - x**3,
    "exponential": y - sp.exp(x),
    "square root": y - sp.sqrt(1 + x**2),
    "no rest at the end": y + sp.exp(-x),
}


@every_method
@pytest.mark.parametrize("kind", UNBOUNDED)
def test_an_energy_without_rest_is_not_called_a_minimum(method, kind):
    if (method, kind) == ("slsqp", "no rest at the end"):
        pytest.skip("stops where exp(-x) is below the tolerance: no floating-point test can tell")
    D = Polyhedron(M2, {"floor": y, "wall": 3 - y})
    c = minimise(D, UNBOUNDED[kind], [2.0, 0.5], method=method)
    assert not c.is_minimum
    assert not c.holds(1e-12)


@pytest.mark.parametrize("kind", ["linear", "cubic", "square root"])
def test_the_descent_says_unbounded(kind):
    D = Polyhedron(M2, {"floor": y})
    assert minimise(D, UNBOUNDED[kind], [2.0, 0.5]).verdict is Verdict.UNBOUNDED


@every_method
def test_a_minimum_inside_has_no_contacts(method):
    D = Polyhedron(M2, {"disk": 4 - x**2 - y**2})
    c = minimise(D, (x - 1) ** 2 + 3 * (y + 0.5) ** 2, [-1.0, 1.0], method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.point == pytest.approx([1, -0.5], abs=1e-9)
    assert c.active == ()
    assert c.multipliers == {}
    assert c.signature == (0, 2, 0)
    assert c.entrapment == {"x": Entrapment.U, "y": Entrapment.U}


def test_a_search_cut_short_says_so():
    D = Polyhedron(M2, {"disk": 10**6 - x**2 - y**2})
    c = minimise(D, x + y / 10, [0.0, 0.0], max_iterations=2)
    assert c.verdict is Verdict.NOT_CONVERGED
    assert c.iterations == 2
    assert minimise(D, x + y / 10, [0.0, 0.0]).verdict is Verdict.STRICT_MINIMUM


def test_a_point_outside_is_said_to_be_outside():
    c = certify(QUADRANT, x + y, [-1e-3, 1])
    assert c.verdict is Verdict.OUTSIDE
    assert not c.holds(1)
    assert c.residuals.infeasibility == pytest.approx(1e-3)


@every_method
def test_a_search_never_answers_that_its_own_point_is_outside(method):
    D = Polyhedron(M2, {"floor": y}, equations={"curve": x**3 + x + y**3 - 1})
    for limit in (1, 2, 3, 5):
        c = minimise(D, (x - y) ** 4, [-2.0, 3.0], method=method, max_iterations=limit)
        assert c.verdict is not Verdict.OUTSIDE


# ------------------------------------------------------------------------------------- faces


def test_stationary_on_finds_what_is_no_minimum():
    # On the parabola the height is stationary at the bottom; leaving it inward, y grows or falls.
    D = Polyhedron(M2, {"under": x**2 - y})
    c = stationary_on(D, -y, [0.3, 0.2], ["under"])
    assert c.point == pytest.approx([0, 0], abs=1e-12)
    assert c.verdict is Verdict.SADDLE
    c = stationary_on(D, y, [0.3, 0.2], ["under"])
    assert c.verdict is Verdict.NOT_STATIONARY
    assert c.multipliers == pytest.approx({"under": -1})


def test_stationary_on_no_face_is_a_free_critical_point():
    D = Polyhedron(M2, {"floor": y + 10})
    c = stationary_on(D, x**2 - y**2 + y, [1, 1], [])
    assert c.point == pytest.approx([0, 0.5], abs=1e-12)
    assert c.verdict is Verdict.SADDLE
    assert c.active == ()


def test_stationary_on_says_when_newton_finds_nothing():
    D = Polyhedron(M2, {"disk": -1 - x**2 - y**2})
    c = stationary_on(D, x, [0.3, 0.1], ["disk"])
    assert not c.is_minimum
    assert c.verdict in {Verdict.NOT_CONVERGED, Verdict.OUTSIDE, Verdict.INFEASIBLE}


def test_a_ball_dropped_straight_onto_a_pin_rolls_off():
    """The top of a disc is a saddle that a straight step does not lead down from."""
    board = Polyhedron(M2, {"pin": x**2 + y**2 - 1, "floor": y + 2})
    c = minimise(board, y, [0.0, 3.0])
    assert c.is_minimum
    assert c.active == ("floor",)


def test_a_saddle_reached_with_a_slight_violation_is_left():
    """Between the branches of a hyperbola, the vertex is a saddle of the abscissa."""
    D = Polyhedron(M2, {"hyperbola": 1 - x**2 + y**2, "disk": 9 - x**2 - y**2})
    assert minimise(D, x, [0.0, 0.0]).is_minimum
