"""Bodies with smaller radii and sizes: the gaps of bodies made so, and where they jam."""

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycorner import minimise
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    scaled,
    sphere,
    thinned,
)


def plane(r):
    """Bodies in the plane, all radii smaller by 0.3 - r; the peg keeps its own."""
    return Arrangement(
        {
            "A": capsule([-0.5, 0], [0.5, 0], r),
            "B": compound([disc(r + 0.1), disc(r, at=[0, 0.7])]),
            "C": polygon([[0, 0], [1, 0], [0, 1]], r),
        },
        {"floor": HalfSpace([0, 1], [0, -2])},
        {"peg": disc(0.2)},
        period=[1.6, None],
    )


def space(r):
    """Bodies in space."""
    walls = {"floor": HalfSpace([0, 0, 1], [0, 0, -2]), "drum": Cylinder(3.0, axis=[0, 0, 1])}
    rod = capsule([0, 0, -0.5], [0, 0, 0.5], r)
    return Arrangement([rod, sphere(r, at=[0, 0.2, 0]), rod], walls, orientations="all")


@given(st.integers(0, 2**32 - 1), st.sampled_from([plane, space]), st.floats(0.01, 0.3))
def test_gaps_are_those_of_thinner_bodies(seed, make, r):
    rng = np.random.default_rng(seed)
    thick, thin = make(0.3), make(r)
    places = {}
    for name in thick.named:
        turn = rng.uniform(-3, 3)
        if thick.dimension == 3:
            turn = Rotation.random(random_state=np.random.RandomState(rng.integers(2**31)))
        places[name] = (rng.uniform(-2, 2, thick.dimension), turn)
    d = thinned(thick)
    q = np.append(thick.point(places), 0.3 - r)
    # Images are counted by the radii, so that thinner bodies may have fewer.
    found = dict(zip(d.names, d.values(q), strict=True))
    assert (found.pop("full"), found.pop("thin")) == pytest.approx((0.3 - r, r))
    expected = thin.polyhedron.values(thin.point(places))
    if make is space:
        # The gap of a cylinder is (R^2 - d^2) / 2R with R less the radius.
        np.testing.assert_allclose([*found.values()], expected, atol=1e-9)
    assert d.contains(q) == thin.polyhedron.contains(thin.point(places))


def test_a_ball_and_a_rod_in_a_pipe():
    """Side by side, they grow to a quarter of its width; lids keep them from sliding apart."""
    rod = capsule([0, 0, -1], [0, 0, 1], 0.45)
    lids = {"low": HalfSpace([0, 0, 1], [0, 0, -2]), "high": HalfSpace([0, 0, -1], [0, 0, 2])}
    a = Arrangement([rod], {"pipe": Cylinder(1.0, axis=[0, 0, 1]), **lids}, {"core": rod})
    d = thinned(a)
    t = d.manifold.symbols[-1]
    placed = a.point({"1": ([0.6, 0.1, 0], Rotation.from_rotvec([0.02, 0.01, 0]))})
    jammed = minimise(d, t, np.append(placed, 0.3))
    # The core keeps its radius: 0.45 + 2 r = 1.
    assert 0.45 - jammed.point[-1] == pytest.approx(0.275, abs=1e-9)


TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def sized_plane(c):
    """Bodies in the plane, ``c`` times as large as those for 1; the peg keeps its size."""
    corners = c * np.array([[-0.5, -0.4], [0.9, 0], [0, 1]])
    return Arrangement(
        {
            "A": capsule([-0.5 * c, 0], [0.6 * c, 0], 0.1 * c),
            "B": compound([disc(0.2 * c), disc(0.1 * c, at=[0, 0.7 * c])]),
            "C": polygon(corners, 0.1 * c),
            "D": polygon(corners),
        },
        {"floor": HalfSpace([0, 1], [0, -2]), "drum": Cylinder(3.0, point=[0.0, 0.5])},
        {"peg": disc(0.2, at=[0, 0.3]), "block": polygon([[2, 2], [3, 2], [2, 3]])},
    )


def sized_space(c):
    rod = capsule([0, 0, -0.5 * c], [0, 0, 0.7 * c], 0.1 * c)
    return Arrangement(
        [rod, polytope(c * TETRAHEDRON), polytope(c * TETRAHEDRON + [0, 0, 0.2 * c])],
        {"floor": HalfSpace([0, 0, 1], [0, 0, -2]), "drum": Cylinder(4.0, axis=[0, 0, 1])},
        {"post": capsule([1, 1, -1], [1, 1, 1], 0.3)},
    )


def random_places(arrangement, rng):
    turns = 3.0 * rng.uniform(-1, 1, len(arrangement.named))
    if arrangement.dimension == 3:
        turns = [Rotation.from_quat(rng.standard_normal(4)) for _ in turns]
    return {
        name: (rng.uniform(-2, 2, arrangement.dimension), turn)
        for name, turn in zip(arrangement.named, turns, strict=True)
    }


@pytest.mark.parametrize("make", [sized_plane, sized_space])
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.05, 1.0))
def test_gaps_are_those_of_smaller_bodies(make, seed, size):
    whole, smaller = make(1.0), make(size)
    places = random_places(whole, np.random.default_rng(seed))
    d = scaled(whole)
    q = np.append(whole.point(places), size)
    *found, full, small = d.values(q)
    assert (full, small) == pytest.approx((1 - size, size - 0.01))
    there = smaller.point(places)
    expected = dict(zip(smaller.polyhedron.names, smaller.polyhedron.values(there), strict=True))
    known = dict(zip(d.names[:-2], found, strict=True))
    assert set(known) == set(expected)
    lengths = {n for n in known if not n.endswith(("angle", "left1", "right1", "left2", "right2"))}
    for name in lengths:  # others are products of lengths, of which the signs count
        assert known[name] == pytest.approx(expected[name], abs=1e-9)
    assert d.contains(q) == smaller.polyhedron.contains(there)


def test_a_long_rod_and_its_own_image():
    """A rod that is held along a periodic box is as long as the box at the size 1 / 1.2."""
    a = Arrangement([capsule([-0.5, 0], [0.5, 0], 0.1)], period=[1.0, 3.0])
    d = scaled(a)
    *_, theta, size = d.manifold.symbols
    best = minimise(d, -10 * sympy.cos(theta) - size, [0, 0, 0.05, 0.5])
    assert best.point[-1] == pytest.approx(1 / 1.2, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "kind", "said"),
    [
        (lambda: thinned(1), TypeError, "arrangement: expected an Arrangement"),
        (
            lambda: thinned(Arrangement([disc(1), polygon([[0, 0], [1, 0], [0, 1]])])),
            ValueError,
            "arrangement: expected rounded bodies, which have a radius; got '2'",
        ),
        (lambda: thinned(Arrangement([disc(1)] * 2), "2t"), ValueError, "names"),
        (lambda: scaled(1), TypeError, "arrangement: expected an Arrangement"),
        (
            lambda: scaled(Arrangement([disc(1)] * 2), least=0.0),
            ValueError,
            "least: expected a number > 0 and < 1; got 0.0",
        ),
    ],
)
def test_what_is_refused(make, kind, said):
    with pytest.raises(kind, match=said):
        make()
