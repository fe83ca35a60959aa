"""Basins: shares that are known from areas, and numbers that do not depend on how they are got."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry, Verdict, minimise
from polycorner.landscapes import Basins, Landscape, Minimum, basins, minimum_of
from polycorner.minimisation import Problem, minima
from polycorner.minimisation.abundance import share_interval
from polycorner.minimisation.problem import pose
from polycorner.polyhedra import Element

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
RADIUS = X**2 + Y**2
SQUARE = [(-2, 2), (-2, 2)]
DISC = Polyhedron(PLANE, {"disc": 4 - RADIUS})
WELLS = (RADIUS - 1) ** 2 - (X**3 - 3 * X * Y**2) / 2  # one at every third of a turn
# A pocket of a pond, and a ring around it that is level along its inner wall.
POND = Polyhedron(PLANE, AllOf(4 - RADIUS, AnyOf(1 - RADIUS, 4 * RADIUS - 9)))


def agrees(count, total, share):
    """Whether a share is in the exact 99.9 % interval of what was counted."""
    low, high = binomtest(count, total).proportion_ci(0.999, method="exact")
    return low <= share <= high


def third_of_a_turn(q):
    c, s = -0.5, math.sqrt(3) / 2
    return np.array([c * q[0] - s * q[1], s * q[0] + c * q[1]])


def third(q):
    return third_of_a_turn(third_of_a_turn(q))


TURNS = Symmetry(elements=(Element(third_of_a_turn, {}), Element(third, {})))


def landscape_of(polyhedron, energy, *points, orbits=None):
    """Return a landscape of the minima that descents from points reach, without passes."""
    found = [minimise(polyhedron, energy, point) for point in points]
    assert all(c.is_minimum for c in found)
    kinds = ["isolated" if c.signature[2] == 0 else "locus" for c in found]
    several = tuple(
        Minimum(c.point, (c.energy, c.energy), c.active, kind, k if orbits is None else orbits[k])
        for k, (c, kind) in enumerate(zip(found, kinds, strict=True))
    )
    return Landscape(pose(polyhedron, energy), several, (), proved=False)


# ------------------------------------------------------------------------------- known areas


def test_a_wall_across_a_box_divides_it_by_areas():
    """The parts are convex, and so is the energy: each has one minimum, its basin is all of it."""
    left, right = Y - 2 * X - 1 / 5, 2 * X - Y - 2 / 5
    walled = Polyhedron(PLANE, AllOf(X + 1, 2 - X, Y, 1 - Y, AnyOf(left, right)))
    found = basins(walled, RADIUS + X * Y / 2 + Y, starts=800, box=[(-1, 2), (0, 1)], rng=3)
    # The left part ends at x = (y - 0.2)/2, the right one begins at (y + 0.4)/2, on average at:
    ends = (1 / 2 - 1 / 5) / 2, (1 / 2 + 2 / 5) / 2
    areas = np.array([ends[0] + 1, 2 - ends[1]])
    on_left = [2 * c.point[0] < c.point[1] for c in found.minima]
    assert len(found.minima) == 2
    for count, is_left in zip(found.counts, on_left, strict=True):
        assert agrees(count, found.descents, areas[0 if is_left else 1] / areas.sum())
    side = found.points[:, 1] - 2 * found.points[:, 0] >= 1 / 5
    assert np.array_equal(side, np.array(on_left)[found.ends])


def test_mirror_images_share_a_double_well_equally():
    walls = {"west": X + 2, "east": 2 - X, "south": Y, "north": 2 - Y}
    found = basins(Polyhedron(PLANE, walls), (X**2 - 1) ** 2 + Y, starts=600, box=[(-2, 2), (0, 2)])
    assert len(found.minima) == 2
    assert all(agrees(count, 600, 1 / 2) for count in found.counts)


def test_a_barrier_on_a_line_is_where_basins_meet():
    line = Manifold.euclidean("x")
    (x,) = line.symbols
    energy = (x**2 - 1) ** 2 + x / 4
    box = Polyhedron(line, {"low": x + 2, "high": 2 - x})
    top = sorted(np.roots([4, 0, -4, 1 / 4]).real)[1]
    found = basins(box, energy, starts=300, box=[(-2, 2)], rng=1)
    lower = found.points[:, 0] < top
    assert np.array_equal(found.ends, np.where(lower, 0, 1))


def test_three_wells_of_a_disc_are_a_third_each_and_one_modulo_the_symmetry():
    found = basins(DISC, WELLS, starts=1000, box=SQUARE, rng=2)
    assert len(found.minima) == 3
    assert all(agrees(count, 1000, 1 / 3) for count in found.counts)
    # No steepest descent crosses the axes of the mirror images: sectors are basins.
    well = np.array([c.point for c in found.minima])[found.ends]
    assert ((found.points * well).sum(axis=1) > 0).all()
    turned = np.arctan2(found.points[:, 1], found.points[:, 0])
    turned -= np.arctan2(well[:, 1], well[:, 0])
    assert (np.cos(turned) > 1 / 2).all()
    one = basins(DISC, WELLS, starts=300, box=SQUARE, rng=2, symmetry=TURNS)
    assert (len(one.minima), one.shares) == (1, (1.0,))


def test_a_locus_has_the_share_of_its_ring():
    found = basins(POND, RADIUS, starts=600, box=SQUARE, rng=5)
    level = [c.verdict for c in found.minima]
    assert level == [Verdict.STRICT_MINIMUM, Verdict.MINIMUM_ALONG_LOCUS]
    areas = 1, 4 - 9 / 4
    assert all(
        agrees(count, 600, area / sum(areas))
        for count, area in zip(found.counts, areas, strict=True)
    )


def test_what_runs_away_is_counted_by_verdict():
    beach = Polyhedron(PLANE, AllOf(1 - Y**2, AnyOf(-X - 1 / 2, X)))
    found = basins(beach, Y**2 - X, starts=60, box=[(-2, 1), (-1, 1)], rng=4)
    assert [c.point.round(6).tolist() for c in found.minima] == [[-0.5, 0.0]]
    assert set(found.elsewhere) == {Verdict.UNBOUNDED}
    assert agrees(found.counts[0], 60, 1.5 / 2.5)
    assert found.counts[0] + found.elsewhere[Verdict.UNBOUNDED] == 60
    assert (found.points[found.ends == -1, 0] >= 0).all()
    assert "UNBOUNDED" in str(found)


def test_placements_on_a_sphere_are_uniform_by_area():
    """Caps of heights 1/2 and 1 have areas in that proportion ([Archimedes])."""
    sphere = Manifold.sphere("u")
    z = sphere.symbols[2]
    caps = Polyhedron(sphere, AnyOf(z - 1 / 2, -z))
    found = basins(caps, z, starts=400)
    heights = [c.point[2].round(6) for c in found.minima]
    assert heights == [-1, 0.5]
    assert all(agrees(n, 400, share) for n, share in zip(found.counts, (2 / 3, 1 / 3), strict=True))


# ------------------------------------------------------------------------------ landscapes


def test_minima_of_a_landscape_keep_their_numbers():
    ways = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0)]
    found = basins(landscape_of(DISC, WELLS, *ways), starts=200, box=SQUARE)
    free = basins(DISC, WELLS, starts=200, box=SQUARE)
    assert found.known == 3
    assert sorted(found.counts) == sorted(free.counts)
    for k, c in enumerate(found.minima):
        assert np.allclose(c.point, minimise(DISC, WELLS, ways[k]).point, atol=1e-6)
        assert ((found.points[found.ends == k] * c.point).sum(axis=1) > 0).all()


def test_minima_that_a_landscape_lacks_come_last():
    some = landscape_of(DISC, WELLS, (1.0, 0.0))
    found = basins(some, starts=100, box=SQUARE)
    assert (found.known, len(found.minima)) == (1, 3)
    assert "The last 2 of the minima are not among those of the landscape." in str(found)
    none = basins(landscape_of(POND, RADIUS, (0, 0), (2, 0)), starts=[[0.5, 0.5]])
    assert (none.counts, none.shares) == ((1, 0), (1.0, 0.0))
    assert none.intervals[1][0] == 0 < none.intervals[1][1]


def test_the_first_minimum_of_an_orbit_counts_for_all_modulo_the_symmetry():
    ways = [(1.0, 0.0), (-1.0, 1.7), (-1.0, -1.7)]
    three = landscape_of(DISC, WELLS, *ways, orbits=(0, 0, 0))
    found = basins(three, starts=50, box=SQUARE, symmetry=TURNS)
    assert found.counts == (50, 0, 0)


def test_a_point_belongs_to_the_minimum_its_descent_reaches():
    pond = landscape_of(POND, RADIUS, (0.3, 0.1), (1.8, 0.0))
    assert [m.kind for m in pond.minima] == ["isolated", "locus"]
    rng = np.random.default_rng(0)
    for angle, radius in zip(
        rng.uniform(-math.pi, math.pi, 8), (0.2, 0.9, 1.6, 1.9) * 2, strict=True
    ):
        q = radius * np.array([math.cos(angle), math.sin(angle)])
        assert minimum_of(pond, q) == (0 if radius < 1 else 1)
    some = landscape_of(DISC, WELLS, (1.0, 0.0))
    assert minimum_of(some, (0.9, 0.1)) == 0
    assert minimum_of(some, (-0.5, 0.8)) is None
    assert minimum_of(some, (-0.5, 0.8), symmetry=TURNS) == 0


# ----------------------------------------------------------------------- how they are found


def same(one: Basins, other: Basins):
    assert np.array_equal(one.points, other.points)
    assert np.array_equal(one.ends, other.ends)
    assert one.elsewhere == other.elsewhere
    points = zip(one.minima, other.minima, strict=True)
    assert all(np.array_equal(a.point, b.point) for a, b in points)


def test_shares_depend_on_the_generator_and_not_on_workers():
    ways = {"starts": 90, "box": SQUARE, "rng": 7}
    here = basins(DISC, WELLS, **ways)
    same(here, basins(DISC, WELLS, **ways))
    same(here, basins(DISC, WELLS, executor=2, **ways))
    assert not np.array_equal(here.points, basins(DISC, WELLS, **ways | {"rng": 8}).points)
    several = minima(DISC, WELLS, executor=2, **ways)
    long = basins(DISC, WELLS, stride=math.inf, **ways)
    assert several.counts == minima(DISC, WELLS, **ways).counts == long.counts


def test_shares_do_not_depend_on_short_strides():
    ways = {"starts": 100, "box": SQUARE}
    fine = basins(DISC, WELLS, stride=0.05, **ways)
    assert np.array_equal(fine.ends, basins(DISC, WELLS, **ways).ends)


@pytest.mark.parametrize("executor", [None, 1])
def test_an_interruption_returns_what_was_found(executor):
    def stop(done, _total, _note):
        if done == 30:
            raise KeyboardInterrupt

    whole = basins(DISC, WELLS, starts=100, box=SQUARE)
    part = basins(DISC, WELLS, starts=100, box=SQUARE, executor=executor, progress=stop)
    assert part.interrupted
    assert not whole.interrupted
    assert (part.descents, sum(part.counts)) == (30, 30)
    assert np.array_equal(part.points, whole.points[:30])
    assert "Interrupted" in str(part)


@pytest.mark.parametrize(("count", "draws"), [(0, 5), (5, 5), (3, 7), (40, 1000), (999, 1000)])
def test_intervals_are_those_of_wilson(count, draws):
    expected = binomtest(count, draws).proportion_ci(0.95, method="wilson")
    assert np.allclose(share_interval(count, draws), expected, rtol=1e-9, atol=1e-12)
    seen = count / draws
    for p in share_interval(count, draws):
        if 0 < p < 1:
            assert math.isclose((seen - p) ** 2, 1.959963984540054**2 * p * (1 - p) / draws)


def test_without_draws_every_share_is_possible():
    assert share_interval(0, 0) == (0.0, 1.0)


def test_arguments_are_refused_in_a_sentence():
    some = landscape_of(DISC, WELLS, (1.0, 0.0))
    with pytest.raises(ValueError, match=re.escape("energy: expected None with a landscape")):
        basins(some, WELLS)
    with pytest.raises(TypeError, match="energy: expected"):
        basins(DISC)
    with pytest.raises(TypeError, match="landscape: expected"):
        minimum_of(Problem(DISC, pose(DISC, WELLS).energy), (0.0, 0.0))
    with pytest.raises(ValueError, match="box: expected"):
        basins(some)
    (one,) = some.minima
    low, high = one.energy
    raised = replace(some, minima=(replace(one, energy=(low + 1, high + 1)),))
    with pytest.raises(ValueError, match="landscape: expected minima; a descent from number 0"):
        basins(raised, starts=3, box=SQUARE)


def test_the_table_has_shares_with_error_bars():
    found = basins(DISC, WELLS, starts=60, box=SQUARE)
    text = str(found)
    for count, (low, high) in zip(found.counts, found.intervals, strict=True):
        assert f"{count / 60:.2%}" in text
        assert f"{low:.2%}" in text
        assert f"{high:.2%}" in text
    assert repr(found).startswith("Basins(0: ")
