"""Corners with dependent gradients against integrals over harmonic wells."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from polycorner import Manifold, Polyhedron, Symmetry, skeleton
from polycorner.measures import Weighting, measure
from polycorner.measures.wells import confined
from polycorner.models import SphereCluster
from polycorner.polyhedra.quotients import Quotient

M = Manifold.euclidean("x y z")
x, y, z = M.symbols
ORIGIN = np.zeros(3)


def weight(D, q, stiffness, rows=None, equations=()):
    quotient = Quotient(D, equations=equations)
    rows = range(len(D.functions)) if rows is None else rows
    return confined(quotient, list(rows), np.asarray(q), stiffness, 1e-12)


@pytest.mark.parametrize("bowl", [0.4, 3.0])
def test_a_fold_with_a_stress_and_a_flex(bowl):
    """``k / 2 pi int exp(-k (y^2 + (b x^2 - y)^2) / 2)``, exactly for every ``k``."""
    plane = Manifold(("x", "y"), scales=(0.5, 2.0))
    u, v = plane.symbols
    k = 7.0
    exact, _ = dblquad(
        lambda v, u: k / math.tau * math.exp(-k * (v**2 + (bowl * u**2 - v) ** 2) / 2),
        -6, 6, -12, 12, epsabs=1e-10,
    )  # fmt: skip
    D = Polyhedron(plane, {"floor": v, "bowl": bowl * u**2 - v})
    found = weight(D, [0.0, 0.0], k)
    assert found == pytest.approx(exact / (0.5 * 2.0), rel=1e-7)  # in scaled coordinates


def test_two_flexes():
    """Over ``z`` by hand: ``k / 2 pi sqrt(pi / k) int exp(-k b^2 / 4)``."""
    k = 11.0
    D = Polyhedron(M, {"floor": z, "bowl": x**2 + x * y + 3 * y**2 - z})
    exact, _ = dblquad(
        lambda v, u: math.exp(-k * (u**2 + u * v + 3 * v**2) ** 2 / 4), -4, 4, -3, 3, epsabs=1e-11
    )
    assert weight(D, ORIGIN, k) == pytest.approx(exact * math.sqrt(k / math.pi) / 2, rel=1e-8)


def test_a_bowl_between_two_stresses():
    """Of ``(x^2 - y^2)^2 + (x y)^2`` neither form is definite, but both together are."""
    k = 5.0
    D = Polyhedron(M, {"a": z, "b": x**2 - y**2 - z, "c": x * y - z})
    exact, _ = dblquad(
        lambda v, u: math.exp(-k * least(u, v) / 2), -5, 5, -5, 5, epsabs=1e-10
    )  # fmt: skip

    assert weight(D, ORIGIN, k) == pytest.approx(
        exact * (k / math.tau) ** 1.5 * math.sqrt(math.tau / 3 / k), rel=1e-7
    )


def least(u, v):
    """``min over z of z^2 + (f - z)^2 + (g - z)^2``."""
    heights = np.array([0.0, u**2 - v**2, u * v])
    return ((heights - heights.mean()) ** 2).sum()


def test_a_flex_along_an_equation():
    """On the unit circle ``1 - x = angle^2 / 2``, although its gradient is normal to the circle."""
    plane = Manifold.euclidean("x y")
    u, v = plane.symbols
    D = Polyhedron(plane, {"stop": 1 - u}, {"circle": 5 * (u**2 + v**2 - 1)})
    k = 300.0
    exact = math.sqrt(k / math.tau) * quad(lambda t: math.exp(-k * t**4 / 8), -3, 3)[0]
    assert weight(D, [1.0, 0.0], k, rows=[0], equations=(1,)) == pytest.approx(exact, rel=1e-7)


def test_more_contacts_than_dimensions():
    """``(k / 2 pi)^(m / 2) int exp(-k |A q|^2 / 2)``; without stresses it is the determinant."""
    k = 4.0
    D = Polyhedron(M, {"a": z + x, "b": z - x, "c": z + y, "d": z - y})
    assert weight(D, ORIGIN, k) == pytest.approx(math.sqrt(k / math.tau) / 4, rel=1e-12)
    assert weight(D, ORIGIN, k, rows=[0, 1, 2]) == pytest.approx(1 / 2, rel=1e-12)


@pytest.mark.parametrize(
    "functions",
    [
        {"floor": y, "cubic": x**3 - y, "side": z},
        {"floor": y, "twice": 2 * y, "side": z},
        {"floor": z, "saddle": x**2 - 2 * y**2 - z},
        {"floor": z},
    ],
)
def test_what_is_not_rigid_to_second_order_has_no_weight(functions):
    assert math.isnan(weight(Polyhedron(M, functions), ORIGIN, 9.0))


def test_a_fold_of_an_atlas_has_its_share():
    """Its energy counts, too; without a stiffness it is declined, and others have all."""
    plane = Manifold.euclidean("x y")
    u, v = plane.symbols
    D = Polyhedron(plane, {"floor": v, "bowl": u**2 - v, "left": u + 1, "right": 2 - u})
    atlas = skeleton(D, [[0.5, 0.1], [-0.5, 0.1]])
    (fold,) = (k for k, c in enumerate(atlas.corners) if set(c.active) == {"floor", "bowl"})
    declined = measure(atlas, edges=False)
    assert math.isnan(declined.corners[fold])
    assert any("give a stiffness" in note for note in declined.notes)
    k, shift = 50.0, 0.7
    found = measure(
        atlas, edges=False, weighting=Weighting(stiffness=k, energy=u + shift, temperature=0.5)
    )
    exact = weight(Polyhedron(plane, {"floor": v, "bowl": u**2 - v}), [0.0, 0.0], k)
    assert found.corners[fold] == pytest.approx(exact * math.exp(-2 * shift), rel=1e-9)
    assert not found.notes


def test_hexagon_of_seven_discs():
    """Twelve contacts hold eleven coordinates: the springs' determinant, of seven discs."""
    model = SphereCluster(7, 2)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    k = 40.0
    found = measure(atlas, edges=False, weighting=Weighting(stickiness=math.inf, stiffness=k))
    (at,) = (i for i, c in enumerate(atlas.corners) if len(c.active) == 12)
    turn = np.arange(6) * math.tau / 6
    places = np.vstack([[0.0, 0.0], np.stack([np.cos(turn), np.sin(turn)], axis=1)])
    rows = []
    for i in range(7):
        for j in range(i):
            if np.linalg.norm(places[i] - places[j]) < 1.1:
                row = np.zeros((7, 2))
                row[i], row[j] = 2 * (places[i] - places[j]), 2 * (places[j] - places[i])
                rows.append(row.ravel())
    stiff = np.sort(np.linalg.eigvalsh(np.transpose(rows) @ rows))[3:]
    moments = 7**2 * 6  # of two translations and of a rotation, whose moment of inertia is 6
    exact = math.sqrt(k / math.tau) * math.sqrt(moments / stiff.prod()) / 12
    assert found.corners[at] == pytest.approx(exact, rel=1e-9)
    assert found.probabilities[at] == 1


def test_the_singular_cluster_of_nine_spheres():
    """Along its flex, the least energy of springs and their stiffness across, in small steps."""
    model = SphereCluster(9)
    atlas = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    (at,) = (i for i, c in enumerate(atlas.corners) if c.singular)
    q, k = atlas.corners[at].point, 1e9
    pairs = [tuple(int(s) - 1 for s in name.split("-")) for name in atlas.corners[at].active]
    i, j = np.array(pairs).T
    motions = model.symmetry.directions(model.manifold, q)

    def springs(q):
        p = q.reshape(9, 3)
        rows = np.zeros((len(pairs), 9, 3))
        for row, (a, b) in zip(rows, pairs, strict=True):
            row[a], row[b] = 2 * (p[a] - p[b]), 2 * (p[b] - p[a])
        return ((p[i] - p[j]) ** 2).sum(axis=1) - 1, rows.reshape(len(pairs), -1)

    def across(q):
        """Second derivative of half the sum of squares."""
        f, J = springs(q)
        H = J.T @ J
        for value, (a, b) in zip(f, pairs, strict=True):
            for s, t, sign in ((a, a, 2), (b, b, 2), (a, b, -2), (b, a, -2)):
                H[3 * s : 3 * s + 3, 3 * t : 3 * t + 3] += sign * value * np.eye(3)
        return H

    flex = np.linalg.svd(np.vstack([springs(q)[1], motions]))[2][-1]
    others = np.linalg.svd(np.vstack([motions, flex]))[2][7:]
    s = np.linspace(-0.05, 0.05, 61)
    heights = np.empty_like(s)
    for n, size in enumerate(s):
        p = q + size * flex
        for _ in range(8):
            f, J = springs(p)
            p = p - others.T @ np.linalg.solve(others @ across(p) @ others.T, others @ J.T @ f)
        f, _ = springs(p)
        stiff = np.linalg.eigvalsh(others @ across(p) @ others.T)
        heights[n] = math.exp(-k * (f @ f) / 2) / math.sqrt(stiff.prod())
    orbit = math.sqrt(np.linalg.det(motions @ motions.T))
    exact = orbit * math.sqrt(k / math.tau) * np.trapezoid(heights, s)
    found = measure(atlas, edges=False, weighting=Weighting(stickiness=math.inf, stiffness=k))
    assert found.corners[at] * found.corner_orders[at] == pytest.approx(exact, rel=2e-3)
    softer = measure(atlas, edges=False, weighting=Weighting(stiffness=k / 1e4))
    assert found.corners[at] == pytest.approx(10 * softer.corners[at], rel=1e-9)


def test_symmetry_without_motions_is_used():
    """A mirror halves the fold that it keeps."""
    plane = Manifold.euclidean("x y")
    u, v = plane.symbols
    from polycorner.polyhedra import Element

    D = Polyhedron(plane, {"floor": v, "bowl": u**2 - v, "left": u + 1, "right": 1 - u})
    mirror = Symmetry(elements=[Element(lambda q: q * [-1, 1], {"left": "right", "right": "left"})])
    weighting = Weighting(stiffness=9.0)
    whole = measure(skeleton(D, [[0.5, 0.1], [-0.5, 0.1]]), weighting=weighting)
    half = measure(skeleton(D, [[0.5, 0.1], [-0.5, 0.1]], symmetry=mirror), weighting=weighting)
    assert half.corners.sum() == pytest.approx(whole.corners.sum() / 2)


def test_stiffness_is_a_positive_number():
    with pytest.raises(ValueError, match="stiffness"):
        Weighting(stiffness=-1.0)
