"""Descents inside a polyhedron: down the gradient, contact by contact, to the minimum."""

import math

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, minimise, stratum_at
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.viewer.board import descent

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
BEGIN = DRUM.nested("R", heading=0.5, clearance=1.5) + np.array([0.08, 0, 0, 0.06, 0, -0.1])


@pytest.fixture(scope="module")
def way():
    return descent(DRUM.polyhedron, DRUM.energy, BEGIN)


def test_a_descent_falls_inside_the_polyhedron_to_the_minimum(way):
    energies = DRUM.energy.value(way.points)
    assert (np.diff(energies) < 0).all()
    assert DRUM.polyhedron.implicit(way.points).min() > -1e-8
    corner = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested("R"))
    assert way.certificate.is_minimum
    assert set(way.certificate.active) == set(corner.active)
    heading = DRUM.heading(corner.point)
    np.testing.assert_allclose(DRUM.heading(way.points[-1]), heading, atol=1e-9)
    np.testing.assert_allclose(way.points[0], BEGIN)
    assert np.diff(way.lengths).max() < 0.2


def test_a_descent_leaves_along_the_gradient_and_closes_contacts_one_by_one(way):
    scales = DRUM.manifold.scale_array
    first = (way.points[1] - way.points[0]) / scales
    down = -DRUM.energy.gradient(BEGIN) * scales
    assert first @ down == pytest.approx(np.linalg.norm(first) * np.linalg.norm(down))
    strata = [stratum_at(DRUM.polyhedron, q, tolerance=1e-6) for q in way.points]
    dimensions = [stratum.dimension for stratum in strata]
    assert (dimensions[0], dimensions[-1]) == (6, 3)
    assert max(np.diff(dimensions)) <= 1


def test_a_descent_on_a_line_is_known_exactly():
    """Down a slope to a floor, then along the floor to its lowest point."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    found = descent(Polyhedron(M, {"floor": y}), y + x**2 / 20, [2.0, 1.0])
    assert found.certificate.point == pytest.approx([0, 0], abs=1e-12)
    # Without a floor x' = -x/10, y' = -1 from (2, 1): it is reached at x = 2 exp(-1/10).
    grounded = found.points[found.points[:, 1] < 1e-12][0]
    assert grounded[0] == pytest.approx(2 * math.exp(-0.1), rel=0.05)
    assert (np.diff(found.points[:, 0]) <= 0).all()


def test_a_descent_begins_at_the_nearest_point_of_the_polyhedron():
    overlapping = DRUM.nested("L", clearance=-0.5)
    assert not DRUM.polyhedron.contains(overlapping)
    found = descent(DRUM.polyhedron, DRUM.energy, overlapping)
    assert DRUM.polyhedron.implicit(found.points[0]) > -1e-8
    M = Manifold.euclidean("x")
    (x,) = M.symbols
    nowhere = descent(Polyhedron(M, {"low": x - 1, "high": -x - 1}), x, [0.0])
    assert nowhere.points.tolist() == [[0.0]]
    assert nowhere.certificate.verdict.name == "INFEASIBLE"
