"""The tutorial region against its definition: discs and half-planes, and nothing of the package."""

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import root
from strategies import directions, reals

from polycorner import Manifold, Polyhedron, certify, minimise, stratum_at
from polycorner.models.planar import MAX_TRIES, Tutorial, Wall, meeting_corners, uniform_points
from polycorner.polyhedra import LocalType

REGION = Tutorial()
D = REGION.polyhedron
CORNERS = REGION.corners()
SIDES = REGION.sides(801)
PLANE = Manifold.euclidean("x y")
INWARD = ("AB", "DE", "GA")
STRAIGHT = ("BC", "EF")


# ---------------------------------------------------------------------------------------- oracles


def holds(wall, p):
    """Signed depth behind a wall, from its centre and radius; positive where it holds."""
    n = np.array(wall.normal) / np.linalg.norm(wall.normal)
    if wall.bend == 0:
        return (p - np.array(wall.point)) @ n
    centre, radius = np.array(wall.point) - n / wall.bend, 1 / abs(wall.bend)
    away = np.linalg.norm(p - centre, axis=-1)
    return away - radius if wall.bend > 0 else radius - away


def depth(p):
    return np.min([holds(wall, p) for wall in REGION.walls], axis=0)


def even_odd(polygon, p):
    """Whether a ray to the right crosses a closed polygon an odd number of times."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    spans = (a[:, 1] > p[1]) != (b[:, 1] > p[1])
    a, b = a[spans], b[spans]
    crossing = a[:, 0] + (p[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool((crossing > p[0]).sum() % 2)


OUTLINE = np.vstack([side[:-1] for side in SIDES.values()])


def distance_to_outline(p):
    return float(np.linalg.norm(OUTLINE - p, axis=1).min())


walls = st.builds(
    lambda p, n, k: Wall("w", tuple(p), tuple(n), k),
    st.tuples(reals(2), reals(2)),
    directions(2),
    st.sampled_from([0.0, 1e-7, -1e-7]) | st.floats(0.05, 3) | st.floats(-3, -0.05),
)


# ----------------------------------------------------------------------------------------- region


def test_corners_are_all_feasible_solutions_of_two_of_the_seven_equations():
    found = []
    for one, two in combinations(REGION.walls, 2):
        for start in np.stack(np.meshgrid([-3, -1, 1, 3], [-3, -1, 1, 3]), -1).reshape(-1, 2):
            solution = root(lambda p, a=one, b=two: [holds(a, p), holds(b, p)], start, tol=1e-13)
            if abs(solution.fun).max() < 1e-11 and depth(solution.x) > -1e-9:
                found.append((solution.x, {one.name, two.name}))
    distinct = []
    for point, names in found:
        if all(np.linalg.norm(point - other) > 1e-6 for other, _ in distinct):
            distinct.append((point, names))
    assert len(distinct) == len(CORNERS) == 7
    for point, names in distinct:
        (letter,) = set.intersection(*map(set, names))
        np.testing.assert_allclose(CORNERS[letter], point, atol=1e-10)


def test_corners_are_named_in_order_around_the_region():
    assert list(CORNERS) == list("ABCDEFG")
    x, y = np.array([*CORNERS.values()]).T
    assert (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0
    assert [wall.name for wall in REGION.walls] == ["AB", "BC", "CD", "DE", "EF", "FG", "GA"]
    assert D.names == tuple(wall.name for wall in REGION.walls)


@pytest.mark.parametrize("letter", "ABCDEFG")
def test_every_corner_is_locally_a_quadrant_of_its_two_sides(letter):
    stratum = stratum_at(D, CORNERS[letter])
    assert stratum.local_type is LocalType.QUADRANT
    assert (stratum.dimension, stratum.rank, len(stratum.pieces)) == (0, 2, 1)
    assert all(letter in side for side in stratum.active)


@given(letter=st.sampled_from("ABCDEFG"), u=st.tuples(reals(0.04), reals(0.04)))
def test_two_functions_are_a_chart_that_makes_a_corner_a_quadrant(letter, u):
    """Every small ``u`` is taken near the corner, at a point of the region just when ``u >= 0``."""
    assume(min(map(abs, u)) > 1e-6)
    one, two = (wall for wall in REGION.walls if letter in wall.name)
    inverse = root(lambda p: [holds(one, p) - u[0], holds(two, p) - u[1]], CORNERS[letter])
    assert abs(inverse.fun).max() < 1e-9
    assert np.linalg.norm(inverse.x - CORNERS[letter]) < 0.3
    assert D.contains(inverse.x) == (min(u) >= 0)


@given(side=st.sampled_from(sorted(SIDES)), at=st.floats(0.01, 0.99))
def test_sides_are_faces_of_dimension_one(side, at):
    start, end = (CORNERS[letter] for letter in side)
    wall = next(wall for wall in REGION.walls if wall.name == side)
    point = wall.at((1 - at) * wall.position(start) + at * wall.position(end))
    stratum = stratum_at(D, point)
    assert (stratum.active, stratum.dimension) == ((side,), 1)
    assert stratum.local_type is LocalType.QUADRANT


@pytest.mark.parametrize("wall", REGION.walls, ids=lambda wall: wall.name)
def test_a_wall_touches_the_region_along_one_side_only(wall):
    reach = math.pi / abs(wall.bend) if wall.bend else 20.0
    positions = np.linspace(-reach, reach, 20001)[:-1]
    inside = depth(wall.at(positions)) > -1e-9
    ends = sorted(float(wall.position(CORNERS[letter])) for letter in wall.name)
    np.testing.assert_array_equal(inside, (positions > ends[0]) & (positions < ends[1]))


@given(p=st.tuples(reals(4), reals(4)).map(np.array))
def test_the_implicit_value_tells_inside_from_outside(p):
    assume(distance_to_outline(p) > 0.01)
    inside = even_odd(OUTLINE, p)
    assert D.contains(p) == inside
    assert (D.implicit(p) > 0) == inside
    assert (depth(p) > 0) == inside


# -------------------------------------------------------------------------------------- convexity


@given(side=st.sampled_from(sorted(SIDES)), at=st.floats(0.05, 0.95), step=st.floats(1e-3, 0.04))
def test_the_region_is_not_convex_near_any_point_of_an_inward_arc(side, at, step):
    """However short, a chord of an inward arc leaves the region; other chords do not."""
    wall = next(wall for wall in REGION.walls if wall.name == side)
    first, last = (float(wall.position(CORNERS[letter])) for letter in side)
    centre = first + at * (last - first)
    chord = wall.at([centre - step * (last - first), centre + step * (last - first)])
    sag = depth(chord.mean(axis=0))
    if side in STRAIGHT:
        assert abs(sag) < 1e-12
    else:
        assert (sag < 0) == (side in INWARD)
        assert D.contains(chord.mean(axis=0)) == (side not in INWARD)


def test_the_region_is_not_convex():
    corners = np.array([*CORNERS.values()])
    outside = [(p, q) for p, q in combinations(corners, 2) if depth((p + q) / 2) < -1e-9]
    assert len(outside) == len(INWARD)


@given(u=directions(2), seed=st.integers(0, 10**6))
def test_a_linear_energy_rests_where_the_outline_says(u, seed):
    """Rests are the outline's lowest points nearby that do not fall off into the region."""
    height = OUTLINE @ u
    lowest = (height <= np.roll(height, 1)) & (height <= np.roll(height, -1))
    steps = 0.01 * np.array([[math.cos(a), math.sin(a)] for a in np.linspace(0, 2 * math.pi, 721)])
    expected = [
        p for p in OUTLINE[lowest] if (u @ steps.T)[depth(p + steps) > 0].min(initial=1.0) > -2e-3
    ]
    x, y = REGION.manifold.symbols
    for start in REGION.starts(np.random.default_rng(seed), 4):
        rest = minimise(D, float(u[0]) * x + float(u[1]) * y, start)
        assert rest.is_minimum
        assert min(np.linalg.norm(rest.point - p) for p in expected) < 0.02


def test_the_height_has_two_minima_as_it_could_not_on_a_convex_region():
    _, y = REGION.manifold.symbols
    minima = [letter for letter, point in CORNERS.items() if certify(D, y, point).is_minimum]
    assert minima == ["A", "B"]
    assert certify(D, y, CORNERS["A"]).energy > certify(D, y, CORNERS["B"]).energy + 0.1


# ------------------------------------------------------------------------------- sizes and starts


@given(size=st.floats(1e-3, 1e3))
def test_a_larger_region_is_the_same_region_enlarged(size):
    larger = Tutorial(size)
    assert larger.manifold.scales == (size, size)
    for letter, point in larger.corners().items():
        np.testing.assert_allclose(point, size * CORNERS[letter], rtol=1e-9)
        assert stratum_at(larger.polyhedron, point).local_type is LocalType.QUADRANT


def test_starts_are_uniform_in_the_region():
    """Their mean is the region's centroid, from the polygon of its outline."""
    (x, y), (x1, y1) = OUTLINE.T, np.roll(OUTLINE, -1, axis=0).T
    cross = x * y1 - x1 * y
    centroid = np.array([((x + x1) * cross).sum(), ((y + y1) * cross).sum()]) / (3 * cross.sum())
    starts = REGION.starts(np.random.default_rng(3), 20_000)
    assert starts.shape == (20_000, 2)
    assert D.contains(starts).all()
    error = starts.std(axis=0) / math.sqrt(len(starts))
    assert (abs(starts.mean(axis=0) - centroid) < 5 * error).all()


def test_starts_depend_on_the_generator_alone():
    first, again = (REGION.starts(np.random.default_rng(5), 9) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert REGION.starts(np.random.default_rng(0), 0).shape == (0, 2)


@pytest.mark.parametrize("size", ["1", None, True, 1j, [1.0]])
def test_the_size_is_a_number(size):
    with pytest.raises(TypeError, match=r"^size: expected a number > 0; got "):
        Tutorial(size)


@pytest.mark.parametrize("size", [0.0, -1, math.nan, math.inf])
def test_the_size_is_positive_and_finite(size):
    finite = "finite " if math.isinf(size) else ""
    with pytest.raises(ValueError, match=rf"^size: expected a {finite}number > 0; got "):
        Tutorial(size)


@pytest.mark.parametrize(
    ("rng", "count", "argument", "kind"),
    [
        ("dice", 1, "rng", TypeError),
        (-1, 1, "rng", ValueError),
        (0, -1, "count", ValueError),
        (0, 1.5, "count", TypeError),
        (0, True, "count", TypeError),
        (0, "3", "count", TypeError),
    ],
)
def test_the_error_of_starts_names_the_argument(rng, count, argument, kind):
    with pytest.raises(kind, match=rf"^{argument}: expected [^\n]+; got "):
        REGION.starts(rng, count)


def test_a_seed_stands_for_its_generator():
    np.testing.assert_array_equal(REGION.starts(3, 2), REGION.starts(np.random.default_rng(3), 2))


def test_a_set_without_room_is_refused():
    x, _ = PLANE.symbols
    line = Polyhedron(PLANE, [x, -x])
    rng = np.random.default_rng(0)
    says = rf"^polyhedron: expected room inside the box; got none in {MAX_TRIES} random points$"
    with pytest.raises(ValueError, match=says):
        uniform_points(line, (-1, -1), (1, 1), rng, 1)


# ------------------------------------------------------------------------------------------ walls


@given(wall=walls, p=st.tuples(reals(3), reals(3)).map(np.array))
def test_a_wall_holds_on_the_side_that_its_disc_or_half_plane_says(wall, p):
    expected = holds(wall, p)
    assume(abs(expected) > 1e-7)
    assert (wall.function(PLANE).value(p) > 0) == (expected > 0)


@given(wall=walls, at=st.floats(-0.99, 0.99))
def test_a_wall_is_parametrised_by_arc_length_and_has_unit_gradient(wall, at):
    s = at * min(math.pi / abs(wall.bend), 10.0) if wall.bend else 10 * at
    f, p = wall.function(PLANE), wall.at(s)
    assert abs(f.value(p)) < 1e-13 * (1 + abs(s)) ** 2
    assert np.linalg.norm(f.gradient(p)) == pytest.approx(1, abs=1e-12)
    assert float(wall.position(p)) == pytest.approx(s, abs=1e-7)
    tangent = (wall.at(s + 1e-5) - wall.at(s - 1e-5)) / 2e-5
    np.testing.assert_allclose(tangent @ tangent, 1, atol=1e-8)
    assert np.cross(np.append(tangent, 0), np.append(f.gradient(p), 0))[2] > 0.999


@given(one=walls, two=walls)
def test_meetings_are_where_one_wall_changes_sides_of_the_other(one, two):
    """Counted along the first wall in steps far shorter than the chords that are allowed."""
    assume(abs(one.bend) > 0.01)
    s = np.linspace(-math.pi, math.pi, 4001)[:-1] / one.bend
    along = holds(two, one.at(s))
    changes = int(((along >= 0) != (np.roll(along, 1) >= 0)).sum())
    turning = (along - np.roll(along, 1)) * (np.roll(along, -1) - along) <= 0
    assume(abs(along[turning]).min() > 1e-4)
    points = one.meetings(two)
    assert len(points) == changes
    for p in points:
        assert abs(holds(one, p)) < 1e-8
        assert abs(holds(two, p)) < 1e-8


@given(p=st.tuples(reals(2), reals(2)), n=directions(2), m=directions(2))
def test_two_straight_walls_meet_once_unless_they_are_parallel(p, n, m):
    assume(abs(n[0] * m[1] - n[1] * m[0]) > 1e-3)
    one, two = Wall("one", p, tuple(n)), Wall("two", (1.0, 0.5), tuple(m))
    (point,) = one.meetings(two)
    np.testing.assert_allclose([holds(one, point), holds(two, point)], 0, atol=1e-11)
    assert one.meetings(Wall("aside", (9.0, 9.0), tuple(-n))).shape == (0, 2)


def test_circles_of_one_centre_share_no_points():
    one, two = Wall("one", (0, 1), (0, 1), 1.0), Wall("two", (0, 2), (0, 1), 0.5)
    assert one.meetings(two).shape == (0, 2)
    assert one.meetings(one).shape == (0, 2)


def test_walls_that_touch_share_a_point_in_which_no_corner_is():
    one, two = Wall("one", (0, 0), (0, 1), 1.0), Wall("two", (0, 0), (0, -1), 0.25)
    np.testing.assert_allclose(one.meetings(two), [[0, 0]], atol=1e-12)
    lens = Polyhedron(PLANE, [one.function(PLANE), two.function(PLANE)])
    assert len(meeting_corners(lens, [one, two])) == 0


def test_an_arc_keeps_away_from_the_far_side_of_its_circle():
    circle = Wall("circle", (0, 1), (0, 1), 1.0)
    arc = circle.arc([1, 0], [-1, 0], 5)
    np.testing.assert_allclose(np.linalg.norm(arc, axis=1), 1)
    np.testing.assert_allclose(arc[2], [0, 1], atol=1e-12)
