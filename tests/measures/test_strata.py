"""Weights of corners and edges: determinants and quadrature, against definitions."""

import math

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, Symmetry, skeleton
from polycorner.measures import Weighting, measure
from polycorner.models import SphereCluster

ROOT = math.sqrt(2)
SURFACE = Weighting(gradients=False)


def parabola(scales=(1.0, 1.0), bowl=1.0, energy=False):
    M = Manifold(("x", "y"), scales=scales)
    x, y = M.symbols
    D = Polyhedron(M, {"parabola": bowl * (y - x**2), "lid": 2 - y})
    return (skeleton(D, [[0.1, 1.0]]), x) if energy else skeleton(D, [[0.1, 1.0]])


def by_name(found, name):
    return found.edges[[edge.active for edge in found.skeleton.edges].index((name,))]


def clusters(n, dimension=3):
    model = SphereCluster(n, dimension)
    found = skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)
    return model, found


class TestParabolaAndLid:
    def test_lengths(self):
        found = measure(parabola(), weighting=SURFACE)
        length = ROOT * 3 + math.asinh(2 * ROOT) / 2
        assert by_name(found, "parabola") == pytest.approx(length, rel=1e-9)
        assert by_name(found, "lid") == pytest.approx(2 * ROOT, rel=1e-9)
        assert found.corners == pytest.approx([1, 1])

    @pytest.mark.parametrize(("a", "b", "bowl"), [(1, 1, 1), (0.4, 2.5, 1), (1.7, 0.6, 3)])
    def test_weights_belong_to_the_functions_and_all_scales_give_the_same(self, a, b, bowl):
        """``delta(c f) = delta(f) / c``; along the parabola ``ds / |df| = dx``."""
        found = measure(parabola((a, b), bowl))
        assert by_name(found, "parabola") * a * b == pytest.approx(2 * ROOT / bowl, rel=1e-8)
        assert by_name(found, "lid") * a * b == pytest.approx(2 * ROOT, rel=1e-8)
        assert found.corners * a * b == pytest.approx(2 * [1 / (2 * ROOT * bowl)], rel=1e-8)

    def test_energies_weigh_points(self):
        atlas, x = parabola(energy=True)
        found = measure(atlas, weighting=Weighting(energy=3 * x, temperature=2.0))
        expected = (math.exp(1.5 * ROOT) - math.exp(-1.5 * ROOT)) / 1.5
        assert by_name(found, "lid") == pytest.approx(expected, rel=1e-9)
        assert by_name(found, "parabola") == pytest.approx(expected, rel=1e-9)
        corners = sorted(math.exp(side * 1.5 * ROOT) / (2 * ROOT) for side in (-1, 1))
        assert sorted(found.corners) == pytest.approx(corners, rel=1e-8)

    def test_resistance_and_what_is_near_an_end(self):
        """On the lid ``w = exp(-E)``: both integrals by the trapezoidal rule."""
        atlas, x = parabola(energy=True)
        found = measure(atlas, weighting=Weighting(energy=x))
        k = [edge.active for edge in atlas.edges].index(("lid",))
        s = np.linspace(-ROOT, ROOT, 20001)
        passed = np.concatenate([[0], np.cumsum(np.diff(np.exp(s)))])
        whole = passed[-1]
        near = np.trapezoid(np.exp(-s) * (1 - passed / whole), s)
        left = int(atlas.edges[k].polyline[0, 0] > 0)
        assert found.resistances[k] == pytest.approx(whole, rel=1e-8)
        assert found.near[k, left] == pytest.approx(near, rel=1e-6)
        assert found.near[k].sum() == pytest.approx(found.edges[k], rel=1e-12)

    def test_stickiness_by_name(self):
        found = measure(parabola(), weighting=Weighting(stickiness={"lid": 5.0}))
        assert found.partition[1] == pytest.approx(2 * ROOT * 6, rel=1e-9)
        assert found.partition[0] == pytest.approx(5 / ROOT, rel=1e-8)


class TestClusters:
    def test_octahedron_is_four_percent(self):
        """Of six sticky spheres, 1 : 24, as measured ([MABM])."""
        found = measure(clusters(6)[1])
        assert sorted(found.probabilities) == pytest.approx([0.04, 0.96], abs=1e-9)

    @pytest.mark.parametrize(("n", "dimension"), [(4, 2)])
    def test_equal_spheres_are_counted_once(self, n, dimension):
        """Without relabelling there are ``n!`` times as many, of symmetric ones, too."""
        model, atlas = clusters(n, dimension)
        labelled = Symmetry(tangents=model.symmetry.tangents, invariants=model.distances)
        every = measure(skeleton(model.polyhedron, model.starts(), symmetry=labelled))
        found = measure(atlas)
        assert every.corners.sum() == pytest.approx(math.factorial(n) * found.corners.sum())
        assert every.edges.sum() == pytest.approx(math.factorial(n) * found.edges.sum())

    @pytest.mark.parametrize(("n", "dimension"), [(6, 3), (6, 2), (7, 3)])
    def test_every_contact_of_a_cluster_opens_along_one_edge(self, n, dimension):
        """Of the images of an edge, ``|S_corner| / |S_edge|`` ends are at any one corner."""
        atlas = clusters(n, dimension)[1]
        found = measure(atlas)
        ends = np.zeros(len(atlas.corners))
        for edge, order in zip(atlas.edges, found.edge_orders, strict=True):
            for corner in edge.ends:
                ends[corner] += found.corner_orders[corner] / order
        assert ends.tolist() == [len(corner.active) for corner in atlas.corners]

    def test_redundant_contacts_are_declined(self):
        M = Manifold.euclidean("x y z")
        x, y, z = M.symbols
        D = Polyhedron(M, {"a": z + x, "b": z - x, "c": z + y, "d": z - y, "lid": 1 - z})
        found = measure(skeleton(D, [[0.0, 0.0, 0.5]]))
        assert np.isnan(found.corners).sum() == 1
        assert any("more contacts than dimensions" in note for note in found.notes)

    def test_equations_leave_their_surface(self):
        """Great circles on a sphere: quarters of circles of length ``pi / 2``, corners at 1."""
        M = Manifold.euclidean("x y z")
        x, y, z = M.symbols
        D = Polyhedron(M, {"a": x, "b": y, "c": z}, {"ball": 3 * (x**2 + y**2 + z**2 - 1)})
        found = measure(skeleton(D, [[0.6, 0.6, math.sqrt(0.28)]]))
        assert found.edges == pytest.approx(3 * [math.pi / 2], rel=1e-9)
        assert found.corners == pytest.approx(3 * [1.0], rel=1e-9)


def test_limit_and_finite_stickiness_agree_on_corners():
    atlas = clusters(5)[1]
    finite, limit = measure(atlas, weighting=Weighting(stickiness=7.0)), measure(atlas)
    assert finite.sticky_corners == pytest.approx(limit.corners * 7.0**9)
    assert limit.partition[1] == 0


def test_symbols_of_an_energy_are_checked():
    atlas = parabola()
    with pytest.raises(ValueError, match="energy"):
        measure(atlas, weighting=Weighting(energy=sympy.Symbol("w")))
