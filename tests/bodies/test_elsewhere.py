"""Distances in space against FCL, and derivatives against differences."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycorner import AllOf, Polyhedron
from polycorner.bodies import Arrangement, capsule, compound, polytope, sphere

CUBE = np.array(np.meshgrid([-1, 1], [-0.6, 0.6], [-0.4, 0.4])).reshape(3, -1).T
BODIES = {
    "ball": sphere(0.7),
    "rod": capsule([0, 0, -0.8], [0, 0, 0.8], 0.4),
    "block": polytope(CUBE),
    "dumbbell": compound(
        [
            sphere(0.5, at=[0, 0, -1]),
            sphere(0.5, at=[0, 0, 1]),
            capsule([0, 0, -1], [0, 0, 1], 0.2),
        ]
    ),
}


def parts_of_fcl(fcl, body):
    """The parts of a body in its place as FCL's shapes."""
    for part in body.parts.values():
        points = part.points
        if len(points) == 1:
            yield fcl.Sphere(part.radius), fcl.Transform(np.eye(3), points[0])
        elif len(points) == 2:
            along = points[1] - points[0]
            frame, _ = Rotation.align_vectors([along], [[0, 0, 1]])
            shape = fcl.Capsule(part.radius, np.linalg.norm(along))
            yield shape, fcl.Transform(frame.as_matrix(), points.mean(axis=0))
        else:
            faces = np.array([[3, *simplex] for simplex in oriented(points)])
            yield fcl.Convex(points, len(faces), faces.ravel()), fcl.Transform()


def oriented(points):
    """Triangles of the hull, counterclockwise from outside."""
    hull = ConvexHull(points)
    for (i, j, k), plane in zip(hull.simplices, hull.equations, strict=True):
        normal = np.cross(points[j] - points[i], points[k] - points[i])
        yield (i, j, k) if normal @ plane[:3] > 0 else (i, k, j)


@pytest.mark.parametrize("second", BODIES)
@pytest.mark.parametrize("first", BODIES)
def test_distances_and_overlaps_are_those_of_fcl(first, second):
    fcl = pytest.importorskip("fcl")
    rng = np.random.default_rng([len(first), len(second)])
    a = Arrangement([BODIES[first], BODIES[second]])
    gaps = Polyhedron(a.manifold, AllOf(*a.contacts(excluded=False)))
    sharp = first == second == "block"
    apart = together = 0
    for _ in range(60):
        turns = Rotation.random(2, random_state=np.random.RandomState(rng.integers(2**31)))
        shift = rng.uniform(-2.2, 2.2, 3)
        q = a.point({"1": ([0, 0, 0], turns[0]), "2": (shift, turns[1])})
        placed = a.placed(q)
        shapes = [
            [fcl.CollisionObject(*some) for some in parts_of_fcl(fcl, body)]
            for body in placed.values()
        ]
        pairs = [(one, two) for one in shapes[0] for two in shapes[1]]
        hit = any(
            fcl.collide(*pair, fcl.CollisionRequest(), fcl.CollisionResult()) for pair in pairs
        )
        assert a.polyhedron.contains(q) == (not hit)
        if hit:
            together += 1
            continue
        apart += 1
        if sharp:
            continue
        request = fcl.DistanceRequest(enable_signed_distance=False)
        expected = min(fcl.distance(*pair, request, fcl.DistanceResult()) for pair in pairs)
        # FCL's iterations stop near 1e-5; test_overlaps compares to the last digits.
        assert gaps.implicit(q) == pytest.approx(expected, abs=1e-4)
    assert apart
    assert together


@pytest.mark.parametrize("orientations", ["needed", "all", "none"])
@pytest.mark.parametrize("pair", [("rod", "rod"), ("block", "rod"), ("dumbbell", "ball")])
def test_derivatives_are_those_of_differences(pair, orientations):
    """Along lines, of first and second order."""
    rng = np.random.default_rng([len(pair[0]), len(orientations)])
    a = Arrangement([BODIES[kind] for kind in pair], orientations=orientations)
    space, h = a.manifold, 1e-4
    for _ in range(20):
        turns = Rotation.random(2, random_state=np.random.RandomState(rng.integers(2**31)))
        if orientations == "none":
            turns = [None, None]
        shift = 3 * Rotation.random(random_state=np.random.RandomState(1)).apply([1, 0, 0])
        q = a.point({"1": ([0, 0, 0], turns[0]), "2": (shift, turns[1])})
        v = rng.standard_normal(space.size)
        values, gradients, hessians = a.polyhedron.evaluate(q, 2)
        ahead, behind = a.polyhedron.values(q + h * v), a.polyhedron.values(q - h * v)
        # Where a nearest point changes its feature in between, second derivatives jump.
        jumps = abs(a.polyhedron.hessians(q + h * v) - a.polyhedron.hessians(q - h * v))
        smooth = jumps.max(axis=(1, 2)) < 0.1
        assert smooth.sum() > len(smooth) / 2
        slope = (ahead - behind) / (2 * h)
        np.testing.assert_allclose((gradients @ v)[smooth], slope[smooth], atol=1e-5, rtol=1e-5)
        bend = (ahead + behind - 2 * values) / h**2
        expected = np.einsum("fij,i,j->f", hessians, v, v)
        np.testing.assert_allclose(expected[smooth], bend[smooth], atol=1e-3, rtol=1e-3)
