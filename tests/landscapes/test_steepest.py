"""Steepest descents: inside the set, ever lower, and along the flow of the negative gradient."""

import math

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.landscapes.steepest import steepest
from polycorner.minimisation.problem import pose

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
BOX = {"west": X + 3, "east": 3 - X, "south": Y + 3, "north": 3 - Y}
BENT = (X**2 - 1) ** 2 + (Y - X**2 / 2) ** 2 + X * Y / 4


def falls_inside(problem, points, stride):
    heights = problem.energy.value(points)
    lengths = np.linalg.norm(np.diff(points, axis=0) / problem.scales, axis=1)
    assert (np.diff(heights) < 0).all()
    assert problem.polyhedron.implicit(points).min() > -1e-8
    # Projections on curved walls lengthen steps to second order.
    assert lengths.max(initial=0.0) < stride * (1 + stride)


def test_paths_converge_to_the_flow_of_the_gradient_in_first_order():
    problem = pose(Polyhedron(PLANE, BOX), BENT)

    def flow(_, q):
        slope = problem.energy.gradient(q)
        return -slope / np.linalg.norm(slope)

    start, length = np.array([-0.1, 2.0]), 1.5
    exact = solve_ivp(flow, (0, length), start, rtol=1e-10, atol=1e-12).y[:, -1]
    errors = []
    for count in (60, 120, 240):
        points = steepest(problem, start, length / count)
        falls_inside(problem, np.array(points), length / count)
        errors.append(np.linalg.norm(points[count] - exact))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 0.8).all()
    assert (orders < 1.3).all()


@pytest.mark.parametrize("seed", range(6))
def test_descents_around_obstacles_stay_inside_and_end_where_nothing_leads_down(seed):
    """At the end, every direction that is allowed rises, up to the length of a last step."""
    rng = np.random.default_rng(seed)
    discs = [(X - a) ** 2 + (Y - b) ** 2 - c**2 for a, b, c in rng.uniform(0.2, 0.9, (3, 3))]
    problem = pose(Polyhedron(PLANE, AllOf(*BOX.values(), *discs)), BENT + Y)
    start = np.array([rng.uniform(-2.5, 2.5), 2.5])
    points = np.array(steepest(problem, start, 0.1))
    falls_inside(problem, points, 0.1)
    turn = rng.uniform(0, math.tau, 400)
    around = points[-1] + 0.1 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    around = around[np.asarray(problem.polyhedron.contains(around))]
    assert (problem.energy.value(around) > problem.energy.value(points[-1]) - 5e-3).all()


def test_a_descent_in_a_union_changes_branches_and_ends_at_its_lowest_point():
    """Down a chain of overlapping discs, the lowest of which is to the right."""
    centres = [(0, 4), (1, 3), (2, 2), (3, 1)]
    chain = Polyhedron(PLANE, AnyOf(*[1 - (X - a) ** 2 - (Y - b) ** 2 for a, b in centres]))
    problem = pose(chain, Y - X / 2)
    points = np.array(steepest(problem, np.array([-0.3, 4.5]), 0.05))
    falls_inside(problem, points, 0.05)
    low = np.array([3, 1]) + np.array([1 / 2, -1]) / math.hypot(1 / 2, 1)
    assert np.linalg.norm(points[-1] - low) < 0.05


def test_a_descent_on_a_sphere_follows_a_meridian():
    sphere = Manifold.sphere("u")
    problem = pose(Polyhedron(sphere, {}), sphere.symbols[2])
    points = np.array(steepest(problem, np.array([0.6, 0.0, 0.8]), 0.05))
    assert abs(points[:, 1]).max() < 1e-12
    assert np.allclose(np.linalg.norm(points, axis=1), 1)
    assert points[-1] == pytest.approx([0, 0, -1], abs=0.05)


def test_no_wall_that_is_thicker_than_a_step_is_crossed():
    """The wall is flat away from it: Newton's steps do not see it."""
    wall = sp.Rational(1, 2) - sp.exp(-((10 * X) ** 2))
    problem = pose(Polyhedron(PLANE, {"wall": wall, **BOX}), (X - 2) ** 2 + Y**2)
    edge = -math.sqrt(math.log(2)) / 10
    for x in np.linspace(-2, -0.2, 7):
        end = steepest(problem, np.array([x, 1.0]), 0.1)[-1]
        assert end == pytest.approx([edge, 0], abs=0.05)


def test_a_start_outside_is_moved_in_and_an_empty_set_has_no_descent():
    problem = pose(Polyhedron(PLANE, {"low": Y}), Y + X**2)
    points = steepest(problem, np.array([1.0, -2.0]), 0.1)
    assert points[0] == pytest.approx([1.0, 0.0], abs=1e-9)
    nowhere = pose(Polyhedron(PLANE, {"low": Y - 1, "high": -Y - 1}), X)
    assert steepest(nowhere, np.zeros(2), 0.1) == []
