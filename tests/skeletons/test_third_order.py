"""Edges of corners that are told by second and third derivatives, from the definition."""

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.skeletons import Completeness

SPACE = Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
PLANE = Manifold.euclidean("x y")
u, v = PLANE.symbols


def wedge(height):
    """Return the points between a plane and a graph over it, where ``0 <= x <= 1`` and ``y >= 0``.

    The height is positive where ``x > y`` and zero where they are equal.
    """
    names = ("floor", "roof", "side", "back", "front")
    return Polyhedron(SPACE, dict(zip(names, (z, height - z, y, x, 1 - x), strict=True)))


@pytest.mark.parametrize("height", [(x - y) * (x + y), (x - y) * (x**2 + y**2)])
def test_a_roof_that_meets_the_floor_along_an_edge_out_of_a_corner(height):
    """Both are level at the corner, so that no first derivative tells where they meet."""
    found = skeleton(wedge(height), [(0.7, 0.2, 0.01)])
    kinds = sorted(tuple(sorted(edge.active)) for edge in found.edges)
    at_front = [("floor", "front"), ("front", "roof"), ("front", "side")]
    assert kinds == sorted([*at_front, ("floor", "roof"), ("floor", "side"), ("roof", "side")])
    assert found.complete is Completeness.EXHAUSTED
    assert len(found.corners) == 4


@pytest.mark.parametrize("sign", [1, -1])
def test_a_function_that_opens_to_third_order_does_not_vanish_along_an_edge(sign):
    """Of ``v`` and ``v + u^3`` the smaller one is zero along the edge, the other one opens."""
    box = {"flat": v, "bent": v + sign * u**3, "left": u, "right": 1 - u, "top": 2 - v}
    found = skeleton(Polyhedron(PLANE, box), [(0.5, 1.2)])
    kinds = sorted(sorted(edge.active) for edge in found.edges)
    assert kinds == sorted([["flat" if sign > 0 else "bent"], ["left"], ["right"], ["top"]])
    assert found.complete is Completeness.EXHAUSTED


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5, 1e6])
def test_rounding_errors_far_from_the_origin_open_nothing(away):
    """Three functions vanish along an edge, at which two are independent, wherever the set is."""
    M = Manifold.euclidean("x y z")
    corner = away * np.array([1 / 3, 2 / 7, 3 / 11])
    x, y, z = (s - c for s, c in zip(M.symbols, corner, strict=True))
    walls = {"a": x, "b": y, "c": x + 2 * y + (x**2 + y**2) / 3}
    D = Polyhedron(M, {**walls, "low": z, "high": 1 - z, "ball": 4 - x**2 - y**2 - z**2})
    atlas = skeleton(D, [corner + 0.5])
    assert (len(atlas.corners), len(atlas.edges), len(atlas.faces)) == (6, 9, 5)
    assert ("a", "b", "c") in {edge.active for edge in atlas.edges}
