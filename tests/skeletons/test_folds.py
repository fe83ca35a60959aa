"""Vertex figures at folds, from the definition and against the search of their links."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, Symmetry
from polycorner.skeletons import links
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.points import Quotient

SPACE = Manifold.euclidean("t a b")
t, a, b = SPACE.symbols
ORIGIN = np.zeros(3)
few = settings(max_examples=settings.default.max_examples // 8)


def figure(D):
    point = Quotient.near(D, Symmetry(), 1e-8, 100.0, [ORIGIN]).at(ORIGIN)
    explorer = Explorer(point.quotient, [], np.random.default_rng(0))
    return explorer.registry.figure(point, point.active())[1]


def opened(found):
    """Return how often which functions open along rays and, with its rays, on each sector."""
    every = frozenset(range(3))
    rays = [(every - ray.active, np.sign(ray.sample.q[0]).item()) for ray in found.rays]
    sectors = [(every - s.active, frozenset(rays[i] for i in s.rays)) for s in found.sectors]
    return Counter(rays), Counter(sectors)


def expected(weights):
    """Return the same where ``w . f = t^2``: one function is ``t^2 / w``, of two the sum is."""
    positive = [k for k in range(3) if weights[k] > 0]
    rays = [(frozenset([k]), sign) for k in positive for sign in (-1.0, 1.0)]
    sectors = []
    for pair in ((0, 1), (0, 2), (1, 2)):
        ends = [ray for ray in rays if ray[0] <= set(pair)]
        if len(ends) == 4:  # the sum of both is positive only where t is not zero
            sides = [[ray for ray in ends if ray[1] == sign] for sign in (-1.0, 1.0)]
            sectors += [(frozenset(pair), frozenset(side)) for side in sides]
        elif ends:  # one function follows from the other and t, of both signs
            sectors.append((frozenset(pair), frozenset(ends)))
    return Counter(rays), Counter(sectors)


def fold(p, q, bent=0.0, mixed=0.0):
    return Polyhedron(SPACE, [a, b, t**2 + bent * b**2 + mixed * t * b - p * a - q * b])


weight = st.floats(0.3, 3.0)
sign = st.sampled_from([-1.0, 1.0])


@given(weight, weight, sign, sign)
@few
def test_functions_with_positive_weights_open(p, q, first, second):
    weights = (first * p, second * q, 1.0)
    found = figure(fold(*weights[:2]))
    assert opened(found) == expected(weights)
    assert (found.rank, found.full, found.notes) == (2, 3, ())


@pytest.mark.parametrize("q", [0.7, 0.0, -0.7])
def test_the_search_of_the_link_finds_the_same(q, monkeypatch):
    D = fold(1.3, q, bent=0.4 * (q == 0))
    found = figure(D)
    monkeypatch.setattr(links, "fold_figure", lambda *_: None)
    assert opened(figure(D)) == opened(found)


@given(weight, st.floats(-2, 2))
@few
def test_a_function_of_weight_zero_does_not_open_alone_where_the_form_is_positive(p, mixed):
    found = figure(fold(p, 0.0, bent=mixed**2 / 4 + 0.2, mixed=mixed))
    assert opened(found) == expected((p, 0.0, 1.0))
    assert not found.notes


@pytest.mark.parametrize("mixed", [0.0, 0.5])
def test_an_edge_along_which_gradients_stay_dependent_is_noted(mixed):
    found = figure(fold(1.0, 0.0, bent=mixed**2 / 4, mixed=mixed))
    assert [note for note in found.notes if "dependent gradients: not followed" in note]
    assert sorted(sorted(ray.active) for ray in found.rays) == [[0, 1], [0, 1], [1, 2], [1, 2]]


def test_a_function_of_weight_zero_opens_along_two_edges_where_the_form_is_negative():
    """Opening ``b`` alone leaves ``t^2 = b^2``."""
    found = figure(fold(1.0, 0.0, bent=-1.0))
    alone = [ray for ray in found.rays if ray.active == {0, 2}]
    ends = sorted((ray.sample.q[0] / ray.sample.q[2]).round(6) for ray in alone)
    assert ends == [-1, 1]
