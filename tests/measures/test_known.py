"""Clusters of sticky spheres against slow ways from the definitions.

Weights of rigid clusters by inertia, springs and counted permutations; edges and rates by hinges
that are followed in small steps from every contact of a cluster, without any symmetry number.
"""

import math
from functools import cache

import numpy as np
import pytest

from polycorner import skeleton
from polycorner.measures import SampleOptions, Weighting, face_weights, measure, rates
from polycorner.models import SphereCluster

TOUCH = 1e-7


@cache
def clusters(n, dimension=3):
    model = SphereCluster(n, dimension)
    return model, skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)


@cache
def pairs(n):
    return [(i, j) for i in range(n) for j in range(i + 1, n)]


def gaps(x):
    i, j = np.array(pairs(len(x))).T
    return ((x[i] - x[j]) ** 2).sum(axis=1) - 1


def slopes(x, held):
    """Gradients of gaps by hand."""
    found = np.zeros((len(held), *x.shape))
    for row, k in enumerate(held):
        i, j = pairs(len(x))[k]
        found[row, i], found[row, j] = 2 * (x[i] - x[j]), 2 * (x[j] - x[i])
    return found.reshape(len(held), -1)


def motions(x):
    """Velocities of translations and rotations about the centroid, one row each."""
    n, d = x.shape
    moved = [np.tile(e, (n, 1)) for e in np.eye(d)]
    for a in range(d):
        for b in range(a):
            turn = np.zeros((d, d))
            turn[a, b], turn[b, a] = 1, -1
            moved.append((x - x.mean(axis=0)) @ turn)
    return np.array(moved).reshape(len(moved), -1)


def density(x, held):
    """Volume of the motions over that of the gradients."""
    T, A = motions(x), slopes(x, held)
    return math.sqrt(np.linalg.det(T @ T.T) / np.linalg.det(A @ A.T))


def symmetry_number(x):
    """How many permutations keep all distances, found sphere by sphere."""
    d = np.linalg.norm(x[:, None] - x[None], axis=2)

    def count(image):
        i = len(image)
        if i == len(x):
            return 1
        fitting = [
            k
            for k in range(len(x))
            if k not in image and all(abs(d[k, image[j]] - d[i, j]) < 1e-5 for j in range(i))
        ]
        return sum(count([*image, k]) for k in fitting)

    return count([])


def rigid_weight(x):
    """Square root of the moments of inertia, over vibrations and the symmetry number ([HGB])."""
    d = x.shape[1]
    flat = np.pad(x - x.mean(axis=0), ((0, 0), (0, 3 - d)))
    inertia = sum((p @ p) * np.eye(3) - np.outer(p, p) for p in flat)
    moments = np.linalg.det(inertia) if d == 3 else inertia[2, 2]
    springs = slopes(x, np.flatnonzero(gaps(x) < TOUCH))
    stiff = np.sort(np.linalg.eigvalsh(springs.T @ springs))[d * (d + 1) // 2 :]
    return math.sqrt(moments / stiff.prod()) / symmetry_number(x)


@pytest.mark.parametrize(("n", "dimension", "declined"), [
    (5, 3, 0), (6, 3, 0), (7, 3, 0), (8, 3, 0), (9, 3, 1), (6, 2, 0), (7, 2, 1),
])  # fmt: skip
def test_shares_of_all_rigid_clusters(n, dimension, declined):
    _, atlas = clusters(n, dimension)
    found = measure(atlas, edges=False)
    known = ~np.isnan(found.corners)
    expected = np.array([rigid_weight(c.point.reshape(n, dimension)) for c in atlas.corners])
    assert (~known).sum() == declined
    shares = expected[known] / expected[known].sum()
    assert found.probabilities[known] == pytest.approx(shares, rel=1e-6)


def hinge(x, opened, step):
    """Follow a rigid cluster as a contact opens until another closes; return points and lengths.

    Small steps along the only motion that keeps the other contacts, each corrected by Newton.
    """
    held = [k for k in np.flatnonzero(gaps(x) < TOUCH) if k != opened]
    others = [k for k in range(len(gaps(x))) if k not in held]
    tangent, points, lengths = None, [x], []

    def moved(x, size):
        """One step of the given size, by the rule of the midpoint, orthogonal to all motions."""
        y = x.ravel() + size * way(x) / 2
        y = x.ravel() + size * way(y.reshape(x.shape))
        for _ in range(3):
            J = np.vstack([slopes(y.reshape(x.shape), held), motions(x)])
            y = y - np.linalg.pinv(J[: len(held)]) @ gaps(y.reshape(x.shape))[held]
        return y.reshape(x.shape)

    def way(x):
        v = np.linalg.svd(np.vstack([slopes(x, held), motions(x)]))[2][-1]
        ahead = slopes(x, [opened])[0] @ v if tangent is None else tangent @ v
        return v if ahead > 0 else -v

    while True:
        tangent = way(points[-1])
        y = moved(points[-1], step)
        away = gaps(y)[others]
        if len(lengths) > 2 and away.min() <= 0:
            low, high = 0.0, step
            for _ in range(40):
                middle = (low + high) / 2
                low, high = (
                    (low, middle)
                    if gaps(moved(points[-1], middle))[others].min() < 0
                    else (middle, high)
                )
            points.append(moved(points[-1], high))
            lengths.append(high)
            return points, np.array(lengths), held
        points.append(y)
        lengths.append(step)


def hinges(n, dimension, step=0.04):
    """Return for every cluster its hinges: kind of the other end, mass and resistance."""
    _, atlas = clusters(n, dimension)
    known = [c.point.reshape(n, dimension) for c in atlas.corners]

    def kind(x):
        apart = [np.sort(gaps(y)) - np.sort(gaps(x)) for y in known]
        return min(range(len(known)), key=lambda k: abs(apart[k]).max())

    found = []
    for x in known:
        one = []
        for opened in np.flatnonzero(gaps(x) < TOUCH):
            points, lengths, held = hinge(x, opened, step)
            w = np.array([density(p, held) for p in points])
            # The density is regular; the trapezoidal rule is off by the square of the step.
            mass = (lengths * (w[1:] + w[:-1]) / 2).sum()
            resistance = (lengths * (1 / w[1:] + 1 / w[:-1]) / 2).sum()
            one.append((kind(points[-1]), mass, resistance))
        found.append(one)
    return known, found


@pytest.mark.parametrize(("n", "dimension"), [(5, 3), (6, 3), (5, 2), (6, 2)])
def test_hinges_followed_from_every_contact(n, dimension):
    """Floppy clusters of one motion, and rates to leading order, of labelled spheres.

    An edge is met from both ends; of ``n! / |S|`` labelled copies of a cluster each has its hinges.
    """
    known, found = hinges(n, dimension)
    _, atlas = clusters(n, dimension)
    kappa, diffusion = 200.0, 0.7
    weighed = measure(atlas, weighting=Weighting(stickiness=kappa))
    total = sum(
        mass / 2 / symmetry_number(x)
        for x, one in zip(known, found, strict=True)
        for _, mass, _ in one
    )
    # Off by the square of the step: the sum by 5e-5 for 0.04, by 1.2e-5 for 0.02, rates by 2e-4.
    assert weighed.edges.sum() == pytest.approx(total, rel=1e-4)
    expected = np.zeros((len(known), len(known)))
    for a, (x, one) in enumerate(zip(known, found, strict=True)):
        weight = density(x, np.flatnonzero(gaps(x) < TOUCH))
        for b, _, resistance in one:
            expected[a, b] += diffusion / (kappa * resistance * weight)
    np.fill_diagonal(expected, 0.0)
    matrix = rates(weighed, diffusion=diffusion, edges=False).matrix
    np.fill_diagonal(matrix := matrix.copy(), 0.0)
    assert matrix == pytest.approx(expected, rel=4e-4, abs=1e-12)


def rolled(angles):
    """A tetrahedron, a sphere that rolls on its pair 1-2, one on 3-4; and what the angles move."""
    root = math.sqrt(0.5)
    core = np.array([[1.0, 0, -root], [-1, 0, -root], [0, 1, root], [0, -1, root]]) / 2
    places, moved = list(core), []
    for axis, height, angle in ((0, -root / 2, angles[0]), (1, root / 2, angles[1])):
        side, away = np.eye(3)[1 - axis], np.array([0, 0, np.sign(height)])
        radius = math.sqrt(0.75)
        places.append(
            np.array([0, 0, height]) + radius * (math.cos(angle) * away + math.sin(angle) * side)
        )
        moved.append(radius * (math.cos(angle) * side - math.sin(angle) * away))
    x = np.array(places)
    tangents = np.zeros((2, 6, 3))
    tangents[0, 4], tangents[1, 5] = moved
    return x, tangents.reshape(2, -1)


def face_by_quadrature(nodes):
    """Over both angles, between their limits: a sphere rolls from one face to the next.

    At either end it lies on a face, a dihedral angle from the face of the core; the two
    spheres never meet.  The contacts have eight symmetries.
    """
    most = math.pi - 1.5 * math.acos(1 / 3)
    s, w = np.polynomial.legendre.leggauss(nodes)
    total = 0.0
    for a, one in zip(most * s, most * w, strict=True):
        for b, two in zip(most * s, most * w, strict=True):
            x, tangents = rolled((a, b))
            held = np.flatnonzero(abs(gaps(x)) < TOUCH)
            assert len(held) == 10
            assert gaps(x).min() > -TOUCH
            T = motions(x)
            across = tangents - (tangents @ np.linalg.pinv(T)) @ T
            total += one * two * density(x, held) * math.sqrt(np.linalg.det(across @ across.T))
    return total / 8


def test_a_floppy_cluster_of_two_motions():
    """Six spheres: a tetrahedron with two that roll on opposite pairs, and all faces together."""
    model, atlas = clusters(6)
    exact = face_by_quadrature(12)
    assert exact == pytest.approx(face_by_quadrature(16), rel=1e-8)
    contacts = {"1-2", "1-3", "1-4", "2-3", "2-4", "3-4", "1-5", "2-5", "3-6", "4-6"}
    kinds = [model.symmetry.representative(face.active) for face in atlas.faces]
    at = kinds.index(model.symmetry.representative(contacts))
    options = SampleOptions(step=0.15, sideways=0.05, reach=0.25, every=5, gain=0.3, lose=0.3)
    found = face_weights(measure(atlas), points=10_000, rng=1, options=options)
    one = found.by_face[at]
    assert abs(one.value - exact) < 4 * one.error < 0.4 * exact
    assert sum(e.value for e in found.by_face) == pytest.approx(found.total.value)
    assert len(found.by_contacts) == len(atlas.faces)
