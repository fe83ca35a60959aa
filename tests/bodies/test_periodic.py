"""Periodic boxes: gaps against all images from the definition, symmetry, what is refused."""

import math
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import AllOf, Polyhedron, skeleton
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
from polycorner.minimisation import Mobility, immobility
from tests.support import arrangements
from tests.support.hulls import margin

seeds = st.integers(0, 2**32 - 1)
NEAR = 1e-7
ROD = capsule([-0.5, 0], [0.5, 0], 0.1)
LONG = capsule([-0.9, 0.1], [0.8, 0.1], 0.08)
TILE = polygon([[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2]])
PEBBLE = polygon([[0, 0], [0.5, 0], [0, 0.3]], 0.05)
TEE = compound([capsule([-0.4, 0], [0.4, 0], 0.06), disc(0.15, at=[0, 0.3])])
STICK = capsule([0, 0, -0.5], [0, 0, 0.5], 0.1)
BRICK = polytope(np.array(np.meshgrid([-0.3, 0.3], [-0.2, 0.2], [-0.1, 0.1])).reshape(3, -1).T)
FLOOR, LID = HalfSpace([0, 1], [0, -0.8]), HalfSpace([0, -1], [0, 0.8])
PIPE = Cylinder(1.0, axis=[1, 0, 0])
TURNED = {"orientations": "all"}

# Arrangement, dimension of the motions, number of exchanges, rotations and shifts.
CASES = {
    "small": (Arrangement([disc(0.1), TILE, disc(0.15)], period=[2.5, 3.0]), 2, 2),
    "rods": (Arrangement([ROD, ROD], period=[1.5, 1.4]), 2, 2 * 2 * 2 * 4),
    "long": (Arrangement([LONG, disc(0.1)], period=[1.1, 2.0]), 2, 2 * 3 * 2),
    "hulls": (Arrangement([PEBBLE, TEE], period=[1.2, 1.4]), 2, 4),
    "channel": (Arrangement([ROD, TEE], {"a": FLOOR, "b": LID}, period=[1.7, None]), 1, 2 * 2),
    "peg": (Arrangement([ROD], fixed={"peg": disc(0.2, at=[3, 1])}, period=[1.4, 1.7]), 0, 2 * 4),
    "shifted": (Arrangement([ROD, TILE], orientations="none", period=[1.3, 0.9]), 2, 6),
    "spinning": (Arrangement([disc(0.3), ROD], **TURNED, period=[1.5, 1.5]), 3, 2 * 4),
    "balls": (Arrangement([sphere(0.3), sphere(0.2)], period=[1, 1, 1]), 3, 8),
    "sticks": (Arrangement([STICK] * 2, period=[1.4, 1.5, 1.4]), 3, 2 * 2 * 2 * 8),
    "alone": (Arrangement([compound([ROD, PEBBLE])], period=[0.9, 1.4]), 2, 1),
    "slab": (Arrangement([STICK, BRICK], period=[1.0, None, 1.5]), 3, 2 * 4 * 6),
    "pipe": (Arrangement([STICK, sphere(0.2)], {"w": PIPE}, period=[1.5, None, math.inf]), 2, 4),
}


def anywhere(a, rng):
    """A random point, positions in several boxes."""
    return arrangements.anywhere(a, rng, np.where(np.isfinite(a.period), 2.0, 0.7))


def images(a, body, other):
    """The images of a body that may be near another one, with what displaces them."""
    parts = [part for one in (body, other) for part in one.parts.values()]
    away = other.markers.mean(axis=0) - body.markers.mean(axis=0)
    near = [round(x / t) if t < math.inf else 0 for x, t in zip(away, a.period, strict=True)]
    span = sum(np.ptp(one.markers, axis=0).max() for one in (body, other))
    span += 2 * max(part.radius for part in parts)
    steps = [
        range(k - math.ceil(span / t) - 1, k + math.ceil(span / t) + 2) if t < math.inf else [0]
        for k, t in zip(near, a.period, strict=True)
    ]
    for some in product(*steps):
        by = np.array([k * t if k else 0.0 for k, t in zip(some, a.period, strict=True)])
        yield any(some), body.moved(by)


def least(a, q):
    """The least margin of any body and any image of another, or of its own."""
    placed = a.placed(q)
    pairs = [*combinations(placed, 2), *((name, name) for name in a.named)]
    found = math.inf
    for first, second in pairs:
        one, two = placed[first], placed[second]
        for displaced, image in images(a, one, two):
            if first == second and not displaced:
                continue
            for p, r in product(image.parts.values(), two.parts.values()):
                away = np.linalg.norm(p.points[:, None] - r.points, axis=-1).min()
                span = np.ptp(p.points, axis=0).max() + np.ptp(r.points, axis=0).max()
                if away - 1.5 * span - p.radius - r.radius < found:
                    found = min(found, margin(p, r))
    return found


def at_walls(a, q):
    """The least distance of a body from a wall."""
    found = math.inf
    for wall, name in product(a.walls.values(), a.named):
        for part in a.placed(q)[name].parts.values():
            if isinstance(wall, HalfSpace):
                room = (part.points - wall.point) @ wall.normal
            else:
                room = wall.radius - np.linalg.norm(part.points[:, 1:], axis=1)
            found = min(found, room.min() - part.radius)
    return found


@pytest.mark.parametrize("case", CASES)
def test_a_placement_is_free_if_no_image_overlaps(case):
    a, rng = CASES[case][0], np.random.default_rng(len(case))
    free = []
    for _ in range(40):
        q = anywhere(a, rng)
        expected = min(least(a, q), at_walls(a, q))
        if abs(expected) > NEAR:
            assert a.polyhedron.contains(q) == (expected > 0)
            free.append(expected > 0)
    assert any(free)
    assert not all(free)


@pytest.mark.parametrize("case", ["rods", "long", "channel", "peg", "balls", "sticks"])
def test_the_least_gap_is_the_distance_of_the_nearest_images(case):
    a, rng = CASES[case][0], np.random.default_rng(len(case))
    gaps = Polyhedron(a.manifold, AllOf(*a.contacts(excluded=False)))
    apart = 0
    for _ in range(60):
        q = anywhere(a, rng)
        expected = min(least(a, q), at_walls(a, q))
        if 0 < expected < 0.1:
            assert gaps.implicit(q) == pytest.approx(expected, abs=1e-9)
            apart += 1
    assert apart > 3


@given(seeds, st.sampled_from(sorted(CASES)))
def test_shifts_by_periods_change_no_placement(seed, case):
    """By the periods of the circles no gap changes, by those of the box gaps change places."""
    a, rng = CASES[case][0], np.random.default_rng(seed)
    q, d = anywhere(a, rng), a.dimension
    k = rng.integers(len(a.placements))
    at = a.placements[k].at.start
    circles, gaps = np.zeros(a.manifold.size), np.zeros(a.manifold.size)
    for axis in range(d):
        if math.isfinite(a.period[axis]):
            circles[at + axis] = rng.integers(-2, 3) * a.manifold.periods[at + axis]
            gaps[at + axis] = rng.integers(-2, 3) * a.period[axis]
    before = a.polyhedron.values(q)
    np.testing.assert_allclose(a.polyhedron.values(q + circles), before, atol=1e-9)
    after = a.polyhedron.values(q + gaps)
    np.testing.assert_allclose(np.sort(after), np.sort(before), atol=1e-9)
    assert a.polyhedron.contains(q + gaps, tolerance=1e-9) == a.polyhedron.contains(
        q, tolerance=1e-9
    )


@given(seeds, st.sampled_from(sorted(CASES)))
def test_gaps_are_smooth_where_bodies_touch(seed, case):
    """A gap below a tenth of the thinnest body is continuous: it jumps by images far away only."""
    a, rng = CASES[case][0], np.random.default_rng(seed)
    q, d = anywhere(a, rng), a.dimension
    k = rng.integers(len(a.placements))
    at = a.placements[k].at.start
    # The displacement from the first body, or the origin, at the cut.
    axis = next(i for i in range(d) if math.isfinite(a.period[i]))
    other = a.placements[0].at.start if k else None
    centre = q[other + axis] if other is not None else 0.0
    q[at + axis] = centre + a.manifold.periods[at + axis] / 2
    step = np.zeros(a.manifold.size)
    step[at + axis] = 1e-9
    rounded = Polyhedron(a.manifold, AllOf(*a.contacts(excluded=False)))
    before, after = rounded.values(q - step), rounded.values(q + step)
    jumps = abs(after - before) > 1e-6
    union = np.array([not name.count(".e") for name in rounded.names])
    assert (np.minimum(before, after)[jumps & union] > 0).all()


@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_differences(case):
    a, rng = CASES[case][0], np.random.default_rng(len(case))
    h = 1e-5
    for _ in range(3):
        q = anywhere(a, rng)
        v = rng.standard_normal(a.manifold.size)
        ahead, behind = a.polyhedron.values(q + h * v), a.polyhedron.values(q - h * v)
        gradients = np.array([a.polyhedron.gradients(q + s * h * v) for s in (-1, 0, 1)])
        close = abs(gradients[2] - gradients[0]).max(axis=1) < 1e-2
        assert close.mean() > 0.9
        slopes = (ahead - behind) / (2 * h)
        np.testing.assert_allclose((gradients[1] @ v)[close], slopes[close], atol=1e-3)


@pytest.mark.parametrize("case", CASES)
def test_motions_keep_gaps_and_tell_orbits_apart(case):
    a, count, _ = CASES[case]
    rng = np.random.default_rng(len(case))
    q = anywhere(a, rng)
    tangents = a.symmetry.directions(a.manifold, q) * a.manifold.scale_array
    assert len(tangents) == count
    if not count:
        assert a.symmetry.invariants is None
        return
    step = rng.standard_normal(count) @ tangents
    assert np.abs(a.polyhedron.gradients(q) @ step).max() < 1e-9
    shifts = [i for i, t in enumerate(a.manifold.periods) if math.isfinite(t)]
    turns = rng.integers(-2, 3, len(shifts))
    around = q.copy()
    around[shifts] += turns * np.array(a.manifold.periods)[shifts]
    np.testing.assert_allclose(a.symmetry.invariants(around), a.symmetry.invariants(q), atol=1e-9)
    assert arrangements.rank_of_invariants(a, q) == a.manifold.dimension - count


@pytest.mark.parametrize("case", CASES)
def test_exchanges_and_shifts_rename_gaps(case):
    a, _, count = CASES[case]
    elements = a.symmetry.elements
    assert len(elements) + 1 == count
    arrangements.assert_renamed(a, elements, anywhere(a, np.random.default_rng(len(case))))


def test_two_discs_on_a_torus():
    """Modulo translations and exchanges: a hole, or a square that is left of the torus."""
    small = Arrangement([disc(0.2)] * 2, period=[1, 1])
    assert small.manifold.periods == (1, 1, 1, 1)
    assert small.polyhedron.names == ("1-2",)
    found = skeleton(
        small.polyhedron, [small.point({"1": [0, 0], "2": [0.5, 0.5]})], symmetry=small.symmetry
    )
    assert (len(found.corners), len(found.edges)) == (0, 1)
    large = Arrangement([disc(0.3)] * 2, period=[1, 1])
    assert large.manifold.periods == (2, 2, 2, 2)
    found = skeleton(
        large.polyhedron, [large.point({"1": [0, 0], "2": [0.5, 0.5]})], symmetry=large.symmetry
    )
    assert (len(found.corners), len(found.edges)) == (2, 2)
    for corner in found.corners:
        x, y = np.sort(abs((corner.point[2:] - corner.point[:2] + 0.5) % 1 - 0.5))
        assert (x, y) == pytest.approx((math.sqrt(0.36 - 0.25), 0.5))


def test_a_lattice_of_pegs_holds_a_disc():
    """A disc between a peg and its images: a corner, from which there is no way."""
    a = Arrangement([disc(0.3)], fixed={"peg": disc(math.sqrt(0.5) - 0.3)}, period=[1, 1])
    q = a.point({"1": [0.5, 0.5]})
    assert immobility(a.polyhedron, q).mobility is Mobility.FIRST_ORDER
    loose = Arrangement([disc(0.3)], fixed={"peg": disc(0.38)}, period=[1, 1])
    found = skeleton(loose.polyhedron, [q], symmetry=loose.symmetry)
    assert (len(found.corners), len(found.edges)) == (4, 4)


def test_without_a_period_nothing_changes():
    a = Arrangement([ROD, TILE])
    b = Arrangement([ROD, TILE], period=[math.inf, None])
    assert a.manifold == b.manifold
    assert a.polyhedron.names == b.polyhedron.names


@pytest.mark.parametrize(
    ("make", "kind", "said"),
    [
        (lambda: Arrangement([ROD], period=[1.0]), ValueError, "period: expected 2 lengths"),
        (lambda: Arrangement([ROD], period=2.0), ValueError, "period: expected 2 lengths"),
        (lambda: Arrangement([ROD], period="ab"), ValueError, "period: expected 2 lengths"),
        (lambda: Arrangement([ROD], period=["a", 1.0]), TypeError, "period: expected a number > 0"),
        (lambda: Arrangement([ROD], period=[-1.0, 1.0]), ValueError, "period: .* got -1.0"),
        (lambda: Arrangement([ROD], period=[0, 1.0]), ValueError, "period: .* got 0"),
        (lambda: Arrangement([ROD], period=[math.nan, 1]), ValueError, "period"),
        (lambda: Arrangement([ROD], period=[0.19, 1]), ValueError, "least width of '1'; got 0.19"),
        (lambda: Arrangement([disc(1)], period=[1.9, 9]), ValueError, "least width of '1'"),
        (
            lambda: Arrangement([ROD], orientations="none", period=[1.1, 1.1]),
            ValueError,
            "periods in which '1' does not overlap its image",
        ),
        (
            lambda: Arrangement([ROD], {"a": HalfSpace([1, 1], [0, 0])}, period=[3, None]),
            ValueError,
            "walls: expected walls parallel to the directions that have a period; got 'a'",
        ),
        (
            lambda: Arrangement([ROD], {"a": Cylinder(3.0)}, period=[3, None]),
            ValueError,
            "walls: .*got 'a'",
        ),
    ],
)
def test_what_is_refused(make, kind, said):
    with pytest.raises(kind, match=said):
        make()
