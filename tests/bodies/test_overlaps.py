"""Placements without overlap, against distances and depths from their definitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycorner import AllOf, Polyhedron
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    sphere,
)
from tests.support.arrangements import anywhere
from tests.support.hulls import margin

seeds = st.integers(0, 2**32 - 1)
NEAR = 1e-7


def convex(rng, d, count):
    """Vertices of a random hull, in order in the plane."""
    points = rng.standard_normal((count, d)) * rng.uniform(0.3, 2.0, d)
    return points[ConvexHull(points).vertices]


def some_body(rng, d, kind):
    """A random body of a kind, away from its origin."""
    at, radius = 0.5 * rng.standard_normal(d), rng.uniform(0.1, 1.0)
    if kind == "ball":
        return (disc if d == 2 else sphere)(radius, at=at)
    if kind == "rod":
        return capsule(at, at + rng.standard_normal(d), radius)
    hull = polygon if d == 2 else polytope
    return hull(convex(rng, d, 6), 0.0 if kind == "sharp" else radius)


def least(a, q):
    """The least margin of two bodies in their places."""
    placed = list(a.placed(q).values())
    return min(
        margin(p, r)
        for k, one in enumerate(placed)
        for two in placed[:k]
        for p in one.parts.values()
        for r in two.parts.values()
    )


@pytest.mark.parametrize("orientations", ["needed", "all", "none"])
@pytest.mark.parametrize("second", ["ball", "rod", "rounded", "sharp"])
@pytest.mark.parametrize("first", ["ball", "rod", "rounded", "sharp"])
@pytest.mark.parametrize("d", [2, 3])
def test_a_placement_is_free_if_no_point_is_in_both(d, first, second, orientations):
    rng = np.random.default_rng([d, len(first), len(second), len(orientations)])
    bodies = [some_body(rng, d, first), some_body(rng, d, second)]
    a = Arrangement(bodies, orientations=orientations)
    free = []
    for _ in range(75):
        q = anywhere(a, rng, 1.7)
        expected = least(a, q)
        if abs(expected) > NEAR:
            assert a.polyhedron.contains(q) == (expected > 0)
            free.append(expected > 0)
    assert any(free)
    assert not all(free)


@pytest.mark.parametrize("kinds", [("ball", "sharp"), ("rod", "rounded"), ("rounded", "sharp")])
@pytest.mark.parametrize("d", [2, 3])
def test_the_least_gap_is_the_distance(d, kinds):
    rng = np.random.default_rng([d, *map(len, kinds)])
    a = Arrangement([some_body(rng, d, kind) for kind in kinds])
    gaps = Polyhedron(a.manifold, AllOf(*a.contacts(excluded=False)))
    apart = 0
    for _ in range(60):
        q = anywhere(a, rng, 3.0)
        one, two = (next(iter(body.parts.values())) for body in a.placed(q).values())
        expected, radius = margin(one, two), one.radius + two.radius
        if expected > NEAR - radius:
            assert gaps.implicit(q) == pytest.approx(expected, abs=1e-9)
            apart += 1
    assert apart > 20


@settings(max_examples=5 * settings().max_examples // 25)  # each compiles shapes of its own
@given(seeds, st.sampled_from([2, 3]))
def test_compounds_fixed_bodies_and_walls(seed, d):
    rng = np.random.default_rng(seed)
    ball, rod, hull = (some_body(rng, d, kind) for kind in ("ball", "rod", "sharp"))
    normal, axis = rng.standard_normal((2, d))
    walls = {"floor": HalfSpace(normal, -2 * normal / np.linalg.norm(normal))}
    if d == 3:
        walls["drum"] = Cylinder(3.0, axis=axis)
    walls["shell"] = Cylinder(3.5, point=0.1 * normal)
    a = Arrangement(
        {"A": compound({"x": ball, "y": rod}), "B": ball},
        walls=walls,
        fixed={"C": hull},
    )
    for _ in range(20):
        q = anywhere(a, rng, 1.7)
        bodies = a.placed(q)
        expected = min(least(a, q), *(inner(bodies[name], walls) for name in "AB"))
        if abs(expected) > NEAR:
            assert a.polyhedron.contains(q) == (expected > 0)


def inner(body, walls):
    """How far a body is inside all walls, from many points of its surface's hull."""
    found = []
    for part in body.parts.values():
        for name, wall in walls.items():
            away = part.points - wall.point
            if name == "floor":
                room = away @ wall.normal
            else:
                along = 0 if wall.axis is None else np.outer(away @ wall.axis, wall.axis)
                room = wall.radius - np.linalg.norm(away - along, axis=1)
            found.append(room.min() - part.radius)
    return min(found)


def test_bodies_that_cross_or_contain_each_other_overlap():
    bar = [[-3, -0.2], [3, -0.2], [3, 0.2], [-3, 0.2]]
    for radius in (0.0, 0.05):
        a = Arrangement([polygon(bar, radius), polygon(bar, radius)])
        assert not a.polyhedron.contains(a.point({"1": [0, 0], "2": ([0, 0], np.pi / 2)}))
        assert a.polyhedron.contains(a.point({"1": [0, 0], "2": ([0, 3.4], np.pi / 2)}))
    rods = Arrangement([capsule([-3, 0], [3, 0], 0.1)] * 2)
    assert not rods.polyhedron.contains(rods.point({"1": [0, 0], "2": ([0, 0], 1.0)}))
    inside = Arrangement([polygon(bar, 0.01), disc(0.01)])
    assert not inside.polyhedron.contains(inside.point({"1": [0, 0], "2": [0.5, 0]}))


def test_cubes_with_parallel_edges_are_separated_by_their_faces():
    cube = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    a = Arrangement([polytope(cube)] * 2)
    for shift, free in (([2.01, 0.5, 0.3], True), ([1.99, 0.5, 0.3], False), ([0, 0, 0], False)):
        assert a.polyhedron.contains(a.point({"1": [0, 0, 0], "2": shift})) == free
    # Two edges that cross at right angles: no face separates.
    up = Rotation.from_euler("y", 45, degrees=True)
    across = Rotation.from_euler("x", 45, degrees=True)
    for height, free in ((2 * np.sqrt(2) + 1e-3, True), (2 * np.sqrt(2) - 1e-3, False)):
        q = a.point({"1": ([0, 0, 0], up), "2": ([0, 0, height], across)})
        assert a.polyhedron.contains(q) == free
