"""Corners where gradients have several relations, from the definition."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, Symmetry
from polycorner.polyhedra.cones import rank, unit_rows
from polycorner.polyhedra.quotients import Quotient
from polycorner.skeletons import branches
from polycorner.skeletons.branched_corners import branched_figure
from polycorner.skeletons.branches import common_zeros
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.folds import fold_figure
from polycorner.skeletons.singularities import SingularPoint
from polycorner.skeletons.vertex_figures import Ranks, corner_rank
from polycorner.tolerances import DEFAULT

few = settings(max_examples=settings.default.max_examples // 8)
FOUR = Manifold.euclidean("t a b c")
t, a, b, c = FOUR.symbols
weight = st.floats(0.3, 2.0)


def corner(D, at=None):
    q = np.zeros(D.manifold.size) if at is None else np.array(at, dtype=float)
    quotient = Quotient(D, Symmetry(), DEFAULT, 100.0).near([q])
    active = quotient.at(q).active()
    return SingularPoint(quotient, q, sorted(active)), active


def opened(figure, active):
    return Counter((active - ray.active, ray.dependent) for ray in figure.rays)


# --------------------------------------------------------------------------------- quadratic forms


@given(st.integers(0, 10**6), st.integers(0, 4))
def test_two_conics_meet_in_the_points_they_are_made_to_go_through(seed, through):
    """Conics through given points are the null space of the values of the monomials there."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((through, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    i, j = np.triu_indices(3)
    basis = np.linalg.svd(points[:, i] * points[:, j])[2][through:] if through else np.eye(6)
    forms = np.zeros((2, 3, 3))
    for form, entries in zip(forms, rng.standard_normal((2, len(basis))) @ basis, strict=True):
        form[i, j] += entries / 2
        form[j, i] += entries / 2
    found = common_zeros(forms, DEFAULT.rank)
    if found is None:
        return  # they nearly touch
    assert len(found) in {0, 2, 4}
    assert len(found) >= through
    for d in found:
        assert np.einsum("i,kij,j->k", d, forms, d) == pytest.approx(0, abs=1e-6)
    for p in points:
        assert max((abs(p @ d) for d in found), default=0.0) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("form", [[[1, 0], [0, 0]], [[0, 0], [0, 0]]])
def test_a_double_zero_is_none_that_is_told(form):
    assert common_zeros(np.array([form], dtype=float), DEFAULT.rank) is None


@given(st.integers(0, 10**6))
@few
def test_ranks_of_sets_from_the_relations_of_all(seed):
    rng = np.random.default_rng(seed)
    slopes = rng.integers(-1, 2, (7, 4)).astype(float)
    slopes = unit_rows(slopes[slopes.any(axis=1)])
    some = frozenset(np.flatnonzero(rng.random(len(slopes)) < 0.6).tolist())
    if some:
        assert Ranks(slopes, DEFAULT).of(some) == rank(slopes[sorted(some)], DEFAULT.rank)


# ------------------------------------------------------------------------------------------ corners


@pytest.mark.parametrize("scale", [1.0, 1e-3])
@given(weight, weight)
@few
def test_two_relations_on_one_flap(scale, p, q):
    """``p y_3 = t^2 - a`` and ``q y_4 = t^2 - b`` besides ``a``, ``b``, and ``c``, which is free.

    On an edge two of the first four open, one of each sum, at ``+t`` and ``-t``: but ``a`` opens
    alone of its sum where ``y_3`` stays zero.  With ``c``, which opens by itself at ``t = 0``, both
    relations persist.
    """
    M = Manifold.euclidean("t a b c", scale=scale)
    t, a, b, c = (symbol / scale for symbol in M.symbols)
    point, active = corner(Polyhedron(M, [a, b, (t**2 - a) / p, (t**2 - b) / q, c]))
    figure = branched_figure(point, active, *corner_rank(point, active))
    expected = Counter({(frozenset(pair), False): 2 for pair in ((0, 1), (0, 3), (1, 2), (2, 3))})
    expected[frozenset([4]), True] = 1
    assert opened(figure, active) == expected
    for ray in figure.rays:
        values = point.quotient.at(ray.sample.q).values
        assert abs(values[sorted(ray.active)]).max() < 1e-11
        assert (np.delete(values, sorted(ray.active)) > 0).all()


@given(weight, st.sampled_from([-1.0, 1.0]), st.floats(-1.0, 1.0))
@few
def test_edges_at_folds_are_those_that_their_table_gives(p, sign, mixed):
    """``f + p a + sign b = (t + mixed c)^2``: along ``c`` the relation persists."""
    D = Polyhedron(FOUR, [a, b, c, (t + mixed * c) ** 2 - p * a - sign * b])
    point, active = corner(D)
    rank, full = corner_rank(point, active)
    expected, figure = (make(point, active, rank, full) for make in (fold_figure, branched_figure))
    assert opened(figure, active) == opened(expected, active)
    assert not figure.notes


@pytest.mark.parametrize("length", [1e-3, 1e-4])
def test_dependent_edges_that_are_short(length):
    """Of the edge along ``c``, on which the relation persists, the end is near."""
    D = Polyhedron(FOUR, [a, b, c, t**2 - a - b, length - c])
    point, active = corner(D)
    figure = fold_figure(point, active, *corner_rank(point, active))
    assert opened(figure, active)[frozenset([2]), True] == 1
    assert not figure.notes


def test_a_corner_that_a_walk_misses_by_the_root_of_the_tolerance():
    """Where ``a`` and ``b`` vanish and ``t`` is small, the others are of its square."""
    D = Polyhedron(FOUR, [a, b, t**2 - a, t**2 - b, c])
    quotient = Quotient(D, Symmetry(), DEFAULT, 100.0).near([np.zeros(4)])
    registry = Explorer(quotient, [], np.random.default_rng(0)).registry
    missed = quotient.at(np.array([2e-4, 0, 0, 0]))
    assert missed.active() == {0, 1, 4}
    assert registry.find(missed)[0] == registry.find(quotient.at(np.zeros(4)))[0] == 0
    assert registry.records[0].active == {0, 1, 2, 3, 4}
    assert registry.records[0].point.q == pytest.approx(0, abs=1e-9)


def test_too_many_sets_of_functions_are_a_note(monkeypatch):
    """Five functions vanish at the apex of a pyramid over a pentagon."""
    space = Manifold.euclidean("x y z")
    x, y, z = space.symbols
    turns = np.linspace(0, 2 * np.pi, 5, endpoint=False)
    D = Polyhedron(space, [-z - np.cos(turn) * x - np.sin(turn) * y for turn in turns])
    point, active = corner(D)
    registry = Explorer(point.quotient, [], np.random.default_rng(0)).registry
    found = registry.figure(point.quotient.at(point.q), active)
    assert (len(found.rays), found.notes) == (5, ())
    monkeypatch.setattr(branches, "MAX_SETS", 9)
    (note,) = registry.figure(point.quotient.at(point.q), active).notes
    assert "not followed" in note
