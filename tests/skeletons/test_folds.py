"""Vertex figures at folds, from the definition and against the search of their links."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, Symmetry
from polycorner.polyhedra.quotients import Quotient
from polycorner.skeletons import End, explorer
from polycorner.skeletons.dependence import follow_edge
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.parts import arc_length
from polycorner.tolerances import DEFAULT

SPACE = Manifold.euclidean("t a b")
t, a, b = SPACE.symbols
few = settings(max_examples=settings.default.max_examples // 8)


def figure(D, at=None):
    q = np.zeros(D.manifold.size) if at is None else np.array(at, dtype=float)
    point = Quotient(D, Symmetry(), DEFAULT, 100.0).near([q]).at(q)
    explorer = Explorer(point.quotient, [], np.random.default_rng(0))
    return explorer.registry.figure(point, point.active())


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
    monkeypatch.setattr(explorer, "fold_figure", lambda *_: None)
    assert opened(figure(D)) == opened(found)


@given(weight, st.floats(-2, 2))
@few
def test_a_function_of_weight_zero_does_not_open_alone_where_the_form_is_positive(p, mixed):
    found = figure(fold(p, 0.0, bent=mixed**2 / 4 + 0.2, mixed=mixed))
    assert opened(found) == expected((p, 0.0, 1.0))
    assert not found.notes


@pytest.mark.parametrize("mixed", [0.0, 0.5])
def test_an_edge_along_which_the_relation_persists(mixed):
    """Where ``a`` and ``(t + mixed b / 2)^2 - a`` vanish, so does the square, with its slope."""
    found = figure(fold(1.0, 0.0, bent=mixed**2 / 4, mixed=mixed))
    assert not found.notes
    (along,) = [ray for ray in found.rays if ray.active == {0, 2}]
    assert along.sample.q[0] == pytest.approx(-mixed / 2 * along.sample.q[2], abs=1e-12)
    assert along.sample.q[1] == pytest.approx(0, abs=1e-12)
    place = [ray is along for ray in found.rays].index(True)
    between = [s for s in found.sectors if place in s.rays]
    assert sorted(sorted(s.active) for s in between) == [[0], [0], [2], [2]]


@given(weight, weight)
@few
def test_an_edge_along_which_two_functions_open(p, q):
    """With ``c`` and ``d`` at least zero, ``t^2 + (p c - q d)^2 <= 0`` is a ray."""
    four = Manifold.euclidean("t a c d")
    x, y, c, d = four.symbols
    found = figure(Polyhedron(four, [y, c, d, x**2 + (p * c - q * d) ** 2 - y]))
    (along,) = [ray for ray in found.rays if ray.active == {0, 3}]
    there = along.sample.q
    assert there == pytest.approx([0, 0, there[2], p / q * there[2]], abs=1e-12)
    assert not found.notes


SIX = Manifold.euclidean("t s c d e g")
x, y, c, d, e, g = SIX.symbols


def dependent_parts(form):
    """Return what opens of ``c, d, e, g`` along the edges and faces where ``t^2 + S`` vanishes.

    There ``s`` and ``t^2 + S - s``, which may not be negative, stay zero.
    """
    found = figure(Polyhedron(SIX, [c, d, e, g, y, x**2 + form - y]))
    rays = [ray for ray in found.rays if {4, 5} <= ray.active]
    assert not found.notes
    assert all(ray.dependent for ray in rays)
    return tuple(
        sorted(["cdeg"[k] for k in range(4) if k not in part.active] for part in parts)
        for parts in (rays, [sector for sector in found.sectors if {4, 5} <= sector.active])
    )


def test_faces_along_which_three_functions_open_and_the_relation_persists():
    """``c + d = e`` is a plane in the octant, between ``c = e`` and ``d = e``; ``g`` is free."""
    rays, sectors = dependent_parts((c + d - e) ** 2)
    assert rays == [["c", "e"], ["d", "e"], ["g"]]
    assert sectors == [["c", "d", "e"], ["c", "e", "g"], ["d", "e", "g"]]


def test_an_edge_along_which_three_functions_open():
    """``c = d = e`` is a ray, and with ``g``, which is free, a face."""
    rays, sectors = dependent_parts((c - d) ** 2 + (d - e) ** 2)
    assert rays == [["c", "d", "e"], ["g"]]
    assert sectors == [["c", "d", "e", "g"]]


def test_no_face_where_the_form_is_negative_beside_the_plane_of_two_edges():
    """``(c + d - e) (c + 2 d - e)`` is negative inside: only ``c = e`` is an end of both planes."""
    rays, sectors = dependent_parts((c + d - e) * (c + 2 * d - e) + 4 * g**2)
    assert ["c", "e"] in rays
    assert ["c", "d", "e"] not in sectors


@pytest.mark.parametrize("sign", [1, -1])
def test_a_dependent_edge_out_of_a_corner_of_full_rank(sign):
    """Where ``a`` and ``sign (b - t)^2 - a`` vanish."""
    found = figure(Polyhedron(SPACE, [a, b, t, sign * (b - t) ** 2 - a]))
    assert (found.rank, found.full, found.singular) == (3, 3, False)
    (along,) = [ray for ray in found.rays if ray.dependent]
    assert along.active == {0, 3}
    assert along.sample.q == pytest.approx(along.sample.q[0] * np.array([1, 0, 1]), abs=1e-12)
    assert along.sample.q[0] > 0


def test_a_face_around_the_corner_on_which_two_functions_open():
    """``a = 0`` and ``t^2 = 4 c d - c^2 - d^2``: one nappe of a cone."""
    four = Manifold.euclidean("t a c d")
    x, y, c, d = four.symbols
    found = figure(Polyhedron(four, [y, c, d, x**2 + c**2 + d**2 - 4 * c * d - y]))
    assert [s.rays for s in found.sectors if s.active == {0, 3}] == [()]


def test_no_edge_leaves_where_higher_orders_exclude_it():
    """``t^2 + (c - d)^2 + c^3 = 0`` has no solution but zero where ``c`` is not negative."""
    four = Manifold.euclidean("t a c d")
    x, y, c, d = four.symbols
    found = figure(Polyhedron(four, [y, c, d, x**2 + (c - d) ** 2 + c**3 - y]))
    assert not [ray for ray in found.rays if ray.active == {0, 3}]
    assert not found.notes


def test_two_flaps_leave_faces_around_the_corner(monkeypatch):
    """On ``a = t^2 + b^2`` and on ``a = 0``: the link of the corner is two circles."""
    D = Polyhedron(SPACE, [a, t**2 + 2 * b**2 + t * b - a])
    found = figure(D)
    assert (found.rank, found.full, found.rays) == (1, 3, ())
    monkeypatch.setattr(explorer, "fold_figure", lambda *_: None)
    around = Counter(sector.active for sector in figure(D).sectors)
    assert Counter(sector.active for sector in found.sectors) == around
    for sector in found.sectors:
        point = Quotient(D, Symmetry(), DEFAULT, 100.0).near([sector.sample.q]).at(sector.sample.q)
        assert point.active() == sector.active


def test_with_two_flaps_a_function_of_weight_zero_opens_on_a_cone():
    """``x^2 + y^2 = b^2 / 2 + a`` where the last function stays zero: a cone where ``a`` does."""
    four = Manifold.euclidean("x y a b")
    x, y, z, c = four.symbols
    found = figure(Polyhedron(four, [z, c, x**2 + y**2 + x * c - c**2 / 4 - z]))
    assert (found.rank, found.full, found.rays, found.notes) == (2, 4, (), ())
    opens = {frozenset({0, 1, 2}) - sector.active: sector for sector in found.sectors}
    assert set(opens) == {frozenset([0]), frozenset([1]), frozenset([2])}
    p, q, height, along = opens[frozenset([1])].sample.q
    assert p**2 + q**2 + p * along - along**2 / 4 == pytest.approx(0, abs=1e-15)
    assert along > 0
    assert height == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("scale", [1.0, 30.0])
def test_a_dependent_edge_is_followed_around_half_a_circle(scale):
    """The flap, which is radial, turns by as much as the edge."""
    space = Manifold(("x", "y", "a"), scales=(scale,) * 3)
    x, y, z = space.symbols
    wall = (x**2 + y**2 - scale**2) ** 2 / scale**3 - z
    D, corner = Polyhedron(space, [y, z, wall]), [scale, 0.0, 0.0]
    found, quotient = figure(D, corner), Quotient(D, Symmetry(), DEFAULT, 100.0).near([])
    (along,) = [ray for ray in found.rays if ray.active == {1, 2}]
    walk = follow_edge(along.start(quotient), along.direction, along.active)
    assert walk.end is End.CORNER
    assert walk.points[-1] == pytest.approx([-scale, 0, 0], abs=1e-9 * scale)
    assert np.linalg.norm(walk.points, axis=1) == pytest.approx(scale, rel=1e-12)
    points = np.vstack([[scale, 0, 0], walk.points])
    assert arc_length(quotient, points, [1, 2]) == pytest.approx(np.pi, abs=1e-10)


def test_a_function_of_weight_zero_opens_along_two_edges_where_the_form_is_negative():
    """Opening ``b`` alone leaves ``t^2 = b^2``."""
    found = figure(fold(1.0, 0.0, bent=-1.0))
    alone = [ray for ray in found.rays if ray.active == {0, 2}]
    ends = sorted((ray.sample.q[0] / ray.sample.q[2]).round(6) for ray in alone)
    assert ends == [-1, 1]
