"""Thinned and scaled arrangements: bodies in their places, symmetries, minima and pictures."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import minima, minimise, prove, skeleton
from polycorner.bodies import (
    Arrangement,
    HalfSpace,
    box,
    capsule,
    disc,
    polygon,
    polytope,
    scaled,
    sphere,
    thinned,
)
from polycorner.pictures import draw_arrangement

# Not about its origin, so that what turns it onto itself shifts it as well.
TRIANGLE = polygon([[3, 0], [4, 0], [3.5, 0.75**0.5]], 0.2)
SQUARE = polygon([[0, 0], [1, 0], [1, 1], [0, 1]])
CORNERS = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]

PLANE = Arrangement({"A": TRIANGLE, "B": TRIANGLE, "C": disc(0.3)}, box([-9, -9], [9, 9]))
FREE = Arrangement({"A": SQUARE, "B": SQUARE, "C": capsule([-1, 0], [1, 0], 0.2)})
SPACE = Arrangement(
    {"A": polytope(CORNERS, 0.1), "B": sphere(0.3), "C": sphere(0.3)},
    {"floor": HalfSpace([0, 0, 1], [0, 0, -5])},
)
PERIODIC = Arrangement([capsule([-0.4, 0], [0.4, 0], 0.2)] * 2, period=[1.5, 2.0])


def everywhere(a, rng):
    """A placement of all bodies anywhere, turned anyhow."""
    placed = {}
    for p in a.placements:
        turn = (
            rng.uniform(-3, 3)
            if a.dimension == 2
            else Rotation.random(random_state=rng.integers(99))
        )
        placed[p.name] = (rng.uniform(-4, 4, a.dimension), turn)
    return a.point(placed)


CASES = [
    (make, a)
    for make, several in ((thinned, (PLANE, SPACE, PERIODIC)), (scaled, (PLANE, FREE, SPACE)))
    for a in several
]


@pytest.mark.parametrize(("make", "a"), CASES)
def test_bodies_have_the_sizes_of_their_gaps(make, a):
    rng, d = np.random.default_rng(3), make(a)
    for size in (0.05, 0.09):
        q = np.append(everywhere(a, rng), size)
        smaller = d.at(q)
        own = dict(zip(d.names, d.values(q), strict=True))
        gaps = dict(zip(smaller.polyhedron.names, smaller.polyhedron.values(q[:-1]), strict=True))
        shared = [name for name in gaps if name in own]  # thinner bodies may have fewer images
        assert len(shared) > 3
        np.testing.assert_allclose([own[n] for n in shared], [gaps[n] for n in shared], atol=1e-9)
        for name, body in d.placed(q).items():
            given = a.placed(q[:-1])[name]
            for part, shape in body.parts.items():
                before = given.parts[part]
                least = before.radius - size if make is thinned else size * before.radius
                assert shape.radius == pytest.approx(least)


@pytest.mark.parametrize(("make", "a"), CASES)
def test_symmetries_keep_sizes_and_gaps(make, a):
    rng, d = np.random.default_rng(4), make(a)
    q = np.append(everywhere(a, rng), 0.07)
    values = dict(zip(d.names, d.values(q), strict=True))
    for group in (d.symmetry, d.full_symmetry):
        assert len(group.elements) > 0
        for g in group.elements:
            image = g.apply(q)
            assert image[-1] == q[-1]
            found = dict(zip(d.names, d.values(image), strict=True))
            renamed = {name: found[g.names.get(name, name)] for name in d.names}
            np.testing.assert_allclose([*renamed.values()], [*values.values()], atol=1e-8)


def test_motions_of_the_whole_change_no_gap_and_sizes_are_told_apart():
    d = thinned(Arrangement([TRIANGLE] * 2))
    q = np.append(everywhere(d.arrangement, np.random.default_rng(5)), 0.1)
    group = pickle.loads(pickle.dumps(d.symmetry))
    along = group.directions(d.manifold, q) * d.manifold.scale_array
    assert along.shape == (3, 7)
    assert not along[:, -1].any()
    np.testing.assert_allclose(d.gradients(q) @ along.T, 0, atol=1e-9)
    other = np.append(q[:-1], 0.15)
    assert np.abs(group.invariants(q) - group.invariants(other)).max() > 0.01


def test_minima_are_counted_modulo_symmetry():
    """Two discs in a square lie along either diagonal, in either order: one minimum of four."""
    d = thinned(Arrangement([disc(0.5)] * 2, box([0, 0], [1, 1])))
    t = d.manifold.symbols[-1]
    bounds = [[0, 1]] * 4 + [[0, 0.5]]
    every = minima(d, t, starts=30, rng=1, box=bounds)
    some = minima(d, t, starts=30, rng=1, box=bounds, symmetry=d.full_symmetry)
    assert (len(every), len(some)) == (4, 1)
    assert prove(some[0], symmetry=d.symmetry).proved
    assert 0.5 - some[0].point[-1] == pytest.approx(1 / (2 + 2**0.5))


@pytest.mark.parametrize("make", [thinned, scaled])
def test_pictures_show_bodies_of_their_sizes(make):
    d = make(Arrangement([disc(0.5)] * 2, box([0, 0], [1, 1])))
    last, start = d.manifold.symbols[-1], 0.4 if make is thinned else 0.1
    best = minimise(d, last if make is thinned else -last, [0.2, 0.3, 0.7, 0.6, start])
    small = np.append(best.point[:-1], start)
    figure = draw_arrangement(d, [best.point, small])
    areas = []
    for axes in figure.axes:
        outlines = [patch.get_xy() for patch in axes.patches if len(patch.get_xy()) > 20]
        x, y = np.concatenate(outlines).T
        areas.append(np.ptp(x) * np.ptp(y))
    assert areas[0] == pytest.approx(1, abs=0.01)  # they touch all four walls
    assert areas[1] < 0.8


def test_sizes_that_no_body_has_are_refused():
    d = thinned(Arrangement([disc(0.5)] * 2, box([0, 0], [9, 9])))
    with pytest.raises(ValueError, match=r"at which bodies have sizes; got 0\.5"):
        d.at([1, 1, 5, 5, 0.5])
    with pytest.raises(ValueError, match="at which bodies have sizes; got -1"):
        scaled(PLANE).at([*everywhere(PLANE, np.random.default_rng(1)), -1.0])


def test_a_skeleton_says_where_thin_discs_meet_and_have_no_distance_with_slopes():
    """Discs of the radius 0 meet in a corner of the box, where a distance has no derivative."""
    d = thinned(Arrangement([disc(0.5)] * 2, box([0, 0], [1, 1])))
    jammed = minimise(d, d.manifold.symbols[-1], [0.2, 0.3, 0.7, 0.6, 0.4])
    found = skeleton(d, [jammed.point])
    assert any("1-2 has no derivative at the corner (" in note for note in found.notes)
    (lowest,) = [c for c in found.corners if np.allclose(c.point, jammed.point)]
    assert len(lowest.edges) == 5  # a simple corner in five dimensions
