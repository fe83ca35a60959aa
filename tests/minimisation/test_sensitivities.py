"""Derivatives of stationary points against closed forms, differences, envelopes and scaling."""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import (
    AnyOf,
    Manifold,
    Polyhedron,
    SmoothFunction,
    certify,
    minimise,
    stationary_on,
)
from polycorner.dumbbells import DumbbellPair
from polycorner.minimisation import sensitivity

M = Manifold.euclidean("x y")
x, y = M.symbols
a, b, R = sympy.symbols("a b R", positive=True)
CORNER = ["A2B1", "A2b", "aB1"]
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
SIZES = {
    "length": {"l": 1},
    "ball_radius": {"r": 1, "rho": -1},
    "rod_radius": {"t": 1},
    "drum_radius": {"R": 1, "rho": 1},
}


def function(name, expression, **parameters):
    return SmoothFunction(name, expression, M, parameters=parameters)


def rest_in_disc(numbers):
    """The point of the disc of radius R that is nearest to (a, b), outside it."""
    disc = function("disc", R**2 - x**2 - y**2, R=numbers["R"])
    away = function("away", ((x - a) ** 2 + (y - b) ** 2) / 2, a=numbers["a"], b=numbers["b"])
    return minimise(Polyhedron(M, disc), away, [0.1, 0.2])


def corner(pair):
    return minimise(pair.polyhedron, pair.energy, pair.nested("R"))


def closed_forms():
    """Derivatives by a, b, R of the rest in the disc, from the expressions for it."""
    distance = sympy.sqrt(a**2 + b**2)
    closed = (R * a / distance, R * b / distance, (distance - R) ** 2 / 2, (distance / R - 1) / 2)
    return sympy.lambdify((a, b, R), [[e.diff(p) for p in (a, b, R)] for e in closed])


CLOSED = closed_forms()


@given(st.floats(0.5, 3), st.floats(0.5, 3), st.floats(0.2, 0.6))
def test_derivatives_are_those_of_the_closed_form(first, second, radius):
    s = sensitivity(rest_in_disc({"a": first, "b": second, "R": radius}), ["a", "b", "R"])
    found = [*s.point, s.energy, s.multipliers["disc"]]
    np.testing.assert_allclose(found, CLOSED(first, second, radius), atol=1e-9)


@given(st.floats(11, 24), st.floats(0.2, 0.8), st.sampled_from([math.inf, 40.0, 125.0]))
def test_the_envelope_theorem_gives_the_same_slope_of_the_energy(length, share, drum):
    s = sensitivity(corner(DumbbellPair(length, 3.0, 3.0 * share, drum)))
    np.testing.assert_allclose(s.energy, s.envelope, atol=1e-10 * abs(s.energy).max())


@given(st.floats(11, 24), st.floats(0.2, 0.8), st.floats(30, 300), st.floats(0, 2))
def test_scaling_all_lengths_scales_the_rest(length, share, drum, weight):
    """Euler's identity: angles and multipliers keep, lengths and energy grow in proportion."""
    pair = DumbbellPair(length, 3.0, 3.0 * share, drum, weight)
    c = corner(pair)
    s = sensitivity(c, SIZES)
    sizes = np.array([getattr(pair, name) for name in SIZES])
    along = s.free[:, 0] * c.problem.scales
    grown = c.point * np.array([0, 1, 0, 0, 1, 0])
    away = (s.point @ sizes - grown) / c.problem.scales
    np.testing.assert_allclose(away - s.free @ (s.free.T @ away), 0, atol=1e-9)
    assert abs(along[[1, 4]]).min() > 0  # what is free is to shift the pair
    assert s.energy @ sizes == pytest.approx(c.energy, rel=1e-12)
    for row in s.multipliers.values():
        assert abs(row @ sizes) < 1e-12


def rest(pair, near):
    """Everything that a rest consists of, modulo the axial shift that is free."""
    c = minimise(pair.polyhedron, pair.energy, near)
    q = c.point
    return np.array([*q[[0, 2, 3, 5]], q[4] - q[1], c.energy, *c.multipliers.values()])


def invariants(s, k):
    p = s.point[:, k]
    return np.array(
        [*p[[0, 2, 3, 5]], p[4] - p[1], s.energy[k], *(row[k] for row in s.multipliers.values())]
    )


@pytest.mark.parametrize("name", SIZES)
def test_central_differences_approach_the_derivatives_with_the_square_of_the_step(name):
    pair = replace(PAIR, rod_radius=1.0, drum_radius=20.0)
    c = corner(pair)
    exact = invariants(sensitivity(c, SIZES), list(SIZES).index(name))
    value = getattr(pair, name)
    steps = value * np.array([0.04, 0.02, 0.01])
    errors = []
    for h in steps:
        up, down = (rest(replace(pair, **{name: value + side * h}), c.point) for side in (1, -1))
        errors.append(abs((up - down) / (2 * h) - exact).max())
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.9 < order < 2.1
    assert errors[-1] < 1e-2 * abs(exact).max()


def test_derivatives_hold_where_the_corner_is_no_minimum():
    """Beyond the critical thickness the point is stationary on its face, and moves on smoothly."""

    def found(t):
        pair = replace(PAIR, rod_radius=t)
        start = pair.nested("R", clearance=0.0)
        return stationary_on(pair.polyhedron, pair.energy, start, CORNER)

    c, h = found(2.95), 1e-4
    assert not c.is_minimum
    s = sensitivity(c, ["t"])
    slope = (found(2.95 + h).multipliers["A2b"] - found(2.95 - h).multipliers["A2b"]) / (2 * h)
    assert s.multipliers["A2b"][0] == pytest.approx(slope, rel=1e-5)


def test_parameters_of_ones_own_follow_the_chain_rule():
    c = corner(PAIR)
    plain = sensitivity(c, ["r", "rho"])
    together = sensitivity(c, {"ball_radius": {"r": 1, "rho": -1}})
    np.testing.assert_allclose(together.point[:, 0], plain.point @ [1, -1], atol=1e-12)
    np.testing.assert_allclose(together.of("theta1"), plain.of("theta1") @ [1, -1], atol=1e-12)
    assert together.parameters == ("ball_radius",)


def test_all_parameters_unless_some_are_named():
    assert set(sensitivity(corner(PAIR)).parameters) == {"l", "r", "t", "rho", "R", "w"}


def test_a_function_with_the_same_parameters_moves_with_them():
    """Active gaps stay closed and open ones open as differences say; the energy is one, too."""
    c = corner(PAIR)
    s = sensitivity(c, SIZES)
    np.testing.assert_allclose(s.of(PAIR.energy), s.energy, atol=1e-12)
    gaps = dict(zip(PAIR.polyhedron.names, PAIR.polyhedron.functions, strict=True))
    for name in CORNER:
        np.testing.assert_allclose(s.of(gaps[name]), 0, atol=1e-12)
    h = 1e-4
    for k, name in enumerate(SIZES):
        up, down = (replace(PAIR, **{name: getattr(PAIR, name) + d}) for d in (h, -h))
        values = [
            p.polyhedron.values(minimise(p.polyhedron, p.energy, c.point).point)[0]
            for p in (up, down)
        ]
        assert s.of(gaps["A1B1"])[k] == pytest.approx((values[0] - values[1]) / (2 * h), abs=1e-6)


def test_prediction_errs_by_the_square_of_the_change():
    numbers = {"a": 1.0, "b": 2.0, "R": 0.5}
    s = sensitivity(rest_in_disc(numbers), ["a", "b", "R"])
    steps, errors = np.array([0.04, 0.02, 0.01]), []
    for h in steps:
        moved = rest_in_disc({"a": 1.0 + h, "b": 2.0, "R": 0.5 - h}).point
        errors.append(np.linalg.norm(s.predict({"a": h, "R": -h}) - moved))
    assert 1.9 < np.polyfit(np.log(steps), np.log(errors), 1)[0] < 2.1


def test_an_equation_counts_as_a_held_function():
    section = function("line", x + a * y - 1, a=2.0)
    energy = function("square", (x**2 + y**2) / 2)
    d = Polyhedron(M, {"far": 10 - x}, {"line": section})
    s = sensitivity(minimise(d, energy, [1.0, 0.0]), ["a"])  # at (1, a) / (1 + a^2)
    np.testing.assert_allclose(s.point[:, 0], [-4 / 25, -3 / 25], atol=1e-12)
    assert list(s.multipliers) == ["line"]
    assert s.multipliers["line"][0] == pytest.approx(-4 / 25)  # of 1 / (1 + a^2)


def test_without_contacts_the_point_follows_the_energy():
    d = Polyhedron(M, {"far": 10 - x})
    s = sensitivity(minimise(d, function("e", (x - a) ** 2 + y**2, a=1.0), [0.0, 1.0]))
    np.testing.assert_allclose(s.point[:, 0], [1, 0], atol=1e-12)
    assert s.energy[0] == pytest.approx(0, abs=1e-12)


def test_the_shortest_derivative_is_orthogonal_to_free_directions():
    c = corner(PAIR)
    s = sensitivity(c, SIZES)
    assert s.free.shape == (6, 1)
    scaled = s.point / c.problem.scales[:, None]
    np.testing.assert_allclose(s.free.T @ scaled, 0, atol=1e-12)


def test_table_names_everything_that_moves():
    table, units = str(sensitivity(corner(PAIR), SIZES)).split("\n\n")
    for word in ("d/d drum_radius", "theta1 (rad)", "eta1 ", "energy", "multiplier A2b"):
        assert word in table
    assert len(table.splitlines()) == 2 + 6 + 1 + 3
    assert "radians" in units


# ------------------------------------------------------------------------------------ refusals


def floor(value):
    return function("floor", y - a, a=value)


REFUSED = {
    "one-sided": lambda: certify(Polyhedron(M, floor(0.0)), x**2 + y**2, [0, 0]),
    "not stationary on the face": lambda: certify(Polyhedron(M, floor(0.0)), x**2 + x + y, [0, 0]),
    "does not lie in": lambda: certify(Polyhedron(M, floor(0.0)), x**2 + y, [0, -1]),
    "dependent": lambda: certify(
        Polyhedron(M, {"l": x + y - 0, "r": y - x, "floor": floor(0.0)}), y, [0, 0]
    ),
    "not free": lambda: certify(Polyhedron(M, floor(0.0)), x**4 + y, [0, 0]),
    "several pieces": lambda: certify(
        Polyhedron(M, AnyOf(floor(0.0), function("wall", y - 2 * x))), x**2 + y**2 + y, [0, 0]
    ),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_points_that_need_not_move_smoothly_are_refused_with_the_reason(reason):
    with pytest.raises(ValueError, match=f"^certificate: .*{reason}"):
        sensitivity(REFUSED[reason](), ["a"])


def test_a_parameter_that_ends_a_freedom_is_refused():
    energy = function("e", y + b * x, b=0.0)
    c = minimise(Polyhedron(M, floor(0.0)), energy, [0.3, 1.0])
    np.testing.assert_allclose(sensitivity(c, ["a"]).point[:, 0], [0, 1], atol=1e-12)
    with pytest.raises(ValueError, match=r"^parameters: .* got b,"):
        sensitivity(c, ["a", "b"])


def test_coordinates_are_quantities():
    s = sensitivity(corner(PAIR), SIZES)
    assert s.of("theta1") == pytest.approx(s.of("theta2"), abs=1e-12)
