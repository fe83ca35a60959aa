"""Complete lists of corners: against brute force, and with what must stay undecided."""

import itertools
import math
import pickle
import re
import zipfile
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from proof_files import changed, parts_of, verdict

from polycorner import AnyOf, Manifold, Polyhedron
from polycorner.models.planar import Tutorial
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import corners
from polycorner.skeletons import Completeness
from polycorner.tolerances import Tolerances

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SPACE = Manifold.euclidean("u v w")
U, V, W = SPACE.symbols
SIDES = [(-3.0, 3.0), (-3.1, 3.2)]
CUBE = [(-2.0, 2.0), (-2.0, 2.1), (-2.0, 2.2)]
R = sympy.Rational


def points(found):
    return sorted(p.point.round(9).tolist() for p in found)


def test_the_tutorial_region_has_seven_corners_and_its_skeleton_has_no_others():
    region = Tutorial()
    found = corners(region.polyhedron, box=[(-4, 4), (-4, 4)])
    assert found.complete
    assert np.allclose(points(found), sorted(q.tolist() for q in region.corners().values()))
    letters = {frozenset(wall.name for wall in region.walls if c in wall.name) for c in "ABCDEFG"}
    assert {frozenset(p.active) for p in found} == letters
    atlas = found.skeleton()
    assert atlas.complete is Completeness.CORNERS_PROVED
    assert not atlas.notes
    assert (len(atlas.corners), len(atlas.edges), atlas.euler_characteristic) == (7, 7, 1)


def test_corners_that_are_one_within_the_tolerance_are_not_told_apart():
    """A strip of the width 1e-4, which lies between the limits for corners to be one."""
    strip = Polyhedron(PLANE, [X, R(1, 10_000) - X, Y, 1 - Y])
    found = corners(strip, box=SIDES)
    assert Tolerances().corner < 1e-4 < Tolerances.of(1e-6).corner
    assert found.skeleton().complete is Completeness.CORNERS_PROVED
    assert found.skeleton(tolerance=1e-6).complete is not Completeness.CORNERS_PROVED


# Half-planes a x + b y <= c with small whole numbers: their lines often meet in one point.
half_planes = st.lists(
    st.tuples(st.integers(-2, 2), st.integers(-2, 2), st.integers(-1, 3)).filter(
        lambda line: line[:2] != (0, 0) and math.gcd(*line) == 1
    ),
    min_size=2,
    max_size=6,
    unique=True,
)


def vertices(lines):
    """Return the vertices of a polygon with the lines through each, in rational numbers."""
    found = {}
    for (a, b, c), (d, e, f) in itertools.combinations(lines, 2):
        area = a * e - b * d
        if area:
            q = (Fraction(c * e - b * f, area), Fraction(a * f - c * d, area))
            gaps = [w - u * q[0] - v * q[1] for u, v, w in lines]
            inside = min(gaps) >= 0 and abs(q[0]) <= 3 and -3.1 <= q[1] <= 3.2
            if inside:
                found[q] = frozenset(f"f{i + 1}" for i, gap in enumerate(gaps) if gap == 0)
    return found


@settings(max_examples=10)
@given(half_planes)
def test_polygons_have_the_vertices_of_rational_arithmetic(lines):
    """Redundant lines through a vertex are listed with it, but for two that are an equation."""
    d = Polyhedron(PLANE, [c - a * X - b * Y for a, b, c in lines])
    found = corners(d, box=SIDES, max_boxes=2000)
    equations = {f"f{i + 1}" for i, (a, b, c) in enumerate(lines) if (-a, -b, -c) in lines}
    expected = {q: names - equations for q, names in vertices(lines).items()}
    shown = {
        tuple(Fraction(x).limit_denominator(100) for x in p.point.tolist()): frozenset(p.active)
        for p in found
    }
    edge = [q for q in expected if 3 in map(abs, q)]
    if not edge:
        assert all(expected[q] == active for q, active in shown.items())
        assert len(shown) == len(found)
        assert shown == expected
    assert found.complete


@pytest.mark.parametrize(
    ("parts", "singular", "regular"),
    [
        ([Y - X**2, 2 * X**2 - Y, 1 - Y], [[0, 0]], 4),  # a cusp on either side
        ([1 - (X - 1) ** 2 - Y**2, 1 - (X + 1) ** 2 - Y**2], [[0, 0]], 0),  # discs that touch
        ([(X - 1) ** 2 + Y**2 - 1, (X + 1) ** 2 + Y**2 - 1], [[0, 0]], 0),  # from outside
        ([-(X**2) - (Y - R(1, 3)) ** 2], [[0, R(1, 3)]], 0),  # one point
        ([Y - X**2, Y + X**2, X - Y, 1 - Y], [], 2),  # a cusp that a third curve crosses
        ([AnyOf(1 - X**2 - Y**2, 1 - (X - 2) ** 2 - Y**2)], [[1, 0]], 0),  # a union that touches
    ],
)
def test_singular_corners_are_isolated_by_second_order(parts, singular, regular, tmp_path):
    found = corners(Polyhedron(PLANE, parts), box=SIDES)
    assert found.complete
    assert np.allclose(points(p for p in found if p.singular), np.array(singular, dtype=float))
    assert sum(not p.singular for p in found) == regular
    assert verdict(found.save(tmp_path / "corners.zip"))[0]


def test_an_apex_and_the_tip_of_a_pyramid():
    cone = Polyhedron(SPACE, [W**2 - U**2 - V**2, W, 1 - W])
    found = corners(cone, box=CUBE)
    assert found.complete
    assert [(p.point.tolist(), p.singular) for p in found] == [([0, 0, 0], True)]
    pyramid = Polyhedron(SPACE, [1 - W - U, 1 - W + U, 1 - W - V, 1 - W + V, W])
    found = corners(pyramid, box=CUBE)
    assert found.complete
    assert sorted(len(p.active) for p in found) == [3, 3, 3, 3, 4]
    assert found.skeleton().complete is Completeness.CORNERS_PROVED


@pytest.mark.parametrize(
    ("parts", "count"),
    [
        ([U, V, U + V, 1 - W, 2 + W - U], 2),  # three planes through a line
        ([1 - U**2 - V**2 - W**2, 1 - (U - 1) ** 2 - V**2 - W**2, U - R(1, 2), V], 2),  # a pencil
        ([U, V, U + V], 0),
    ],
)
def test_functions_that_are_combinations_of_others(parts, count, tmp_path):
    found = corners(Polyhedron(SPACE, parts), box=CUBE)
    assert found.complete
    assert len(found) == count
    path = found.save(tmp_path / "corners.zip")
    assert verdict(path)[0]

    def other_weights(data):
        data["relations"][0]["weights"][0] = "7/5"

    fine, line = verdict(changed(path, other_weights))
    assert not fine
    assert "is none" in line


def test_a_plane_as_two_inequalities_is_an_equation(tmp_path):
    found = corners(Polyhedron(SPACE, {"a": U - V, "b": V - U, "c": W, "d": 1 - U}), box=CUBE)
    assert found.complete
    assert [(p.point.tolist(), set(p.active)) for p in found] == [([1, 1, 0], {"c", "d"})]
    assert verdict(found.save(tmp_path / "corners.zip"))[0]


@pytest.mark.parametrize(
    ("parts", "at"),
    [
        ([Y - X**4, 2 * X**4 - Y], [0, 0]),  # the second order says nothing
        ([Y - (X - sympy.sqrt(2)) ** 2, -Y], [math.sqrt(2), 0]),  # not rational
    ],
)
def test_what_is_not_decided_is_returned(parts, at):
    found = corners(Polyhedron(PLANE, parts), box=SIDES, resolution=1e-3, max_boxes=30_000)
    assert not found.complete
    assert not found.points
    rest = found.undecided
    assert ((rest[:, 0] <= at) & (rest[:, 1] >= at)).all(axis=1).any()
    assert "Not complete" in found.statement


def test_pairs_closer_than_the_resolution_are_told_apart_or_undecided():
    """A parabola that misses a line by 1e-18, touches it, or cuts it in two points 2e-9 apart."""
    counts = {}
    for gap in (-1, 0, 1):
        bowl = Y - X**2 + R(gap, 10**18)
        found = corners(Polyhedron(PLANE, [bowl, -Y]), box=SIDES)
        counts[gap] = len(found) if found.complete else None
    assert counts[0] == 1
    assert counts[-1] in {0, None}
    assert counts[1] in {2, None}


def test_a_line_that_leaves_the_set_at_a_kink_is_no_corner_of_a_union():
    """Where the circle of one disc enters the other, only the reentrant corners are corners."""
    union = Polyhedron(PLANE, [AnyOf(1 - X**2 - Y**2, 4 - (X - 1) ** 2 - Y**2)])
    found = corners(union, box=SIDES)
    assert found.complete
    assert points(found) == [[-1.0, 0.0]]  # where one touches the other from inside
    found = corners(Polyhedron(PLANE, [AnyOf(1 - X**2 - Y**2, 9 - X**2 - Y**2), X]), box=SIDES)
    assert found.complete
    assert points(found) == [[0.0, -3.0], [0.0, 3.0]]


def test_equations_circles_and_fixed_coordinates():
    tube = Manifold(("z", "t"), (math.inf, math.tau))
    z, t = tube.symbols
    d = Polyhedron(tube, {"up": sympy.sin(t)}, {"section": z - sympy.cos(t)})
    found = corners(d, box={"z": (-2, 2)})
    assert found.complete
    assert sorted(p.point[0].round(9) for p in found) == [-1, 1]
    line = Manifold.euclidean("a b")
    a, b = line.symbols
    apart = Polyhedron(line, {"apart": (b - a) ** 2 - 1})
    found = corners(apart, box={"a": 0.0, "b": (-9, 9)})
    assert found.complete
    assert points(found) == [[0, -1], [0, 1]]
    with pytest.raises(ValueError, match="box"):
        corners(Polyhedron(line, {"apart": (b - a**2) ** 2 - 1}), box={"a": 0.0, "b": (-9, 9)})


def mirror(q):
    return q * [-1, 1]


def test_a_symmetry_halves_the_search_and_not_the_list():
    d = Polyhedron(PLANE, [Y - X**2, 2 * X**2 - Y, 1 - Y])
    whole = corners(d, box=[(-3, 3), (-3, 3)])
    symmetry = Symmetry(elements=[Element(mirror, {})])
    half = corners(d, box=[(-3, 3), (-3, 3)], symmetry=symmetry)
    assert whole.complete
    assert half.complete
    assert points(whole) == points(half)
    assert max(p.orbit for p in half) == 2
    assert half.tally.boxes < whole.tally.boxes


def test_the_number_of_workers_changes_nothing(tmp_path):
    ball = Polyhedron(SPACE, [W**2 - U**2 - V**2, W, 1 - W, 1 - U - V])
    files = []
    for workers in (1, 2, 8):
        found = corners(ball, box=CUBE, workers=workers)
        files.append(parts_of(found.save(tmp_path / f"{workers}.zip")))
    assert files[0] == files[1] == files[2]


def test_a_fourth_function_through_corners_with_an_irrational_coordinate():
    """Where ``b`` is 0 or pi, two distances are one; ``y`` is the root of 3/4."""
    space = Manifold(("x", "y", "b"), periods=(math.inf, math.inf, math.tau))
    x, y, b = space.symbols
    s = sympy.sin(b)
    parts = {
        "over": sympy.sqrt(x**2 + (y - s) ** 2) - 1,
        "under": sympy.sqrt(x**2 + (y + s) ** 2) - 1,
        "wall": x - sympy.Rational(1, 2),
        "leaning": x - sympy.Rational(1, 2) + s / 3,
    }
    found = corners(Polyhedron(space, parts), box=[(0.3, 0.9), (-2, 2.1), None])
    at = [p for p in found.points if len(p.active) == 4]
    assert found.complete
    assert sorted(np.round(abs(p.point), 9).tolist() for p in at) == [
        [0.5, round(math.sqrt(0.75), 9), round(abs(turn), 9)] for turn in (0, 0, math.pi, math.pi)
    ]


def test_clusters_of_three_spheres():
    """One at the origin, one on the axis, one in the plane: a triangle and its mirror image."""
    d = Polyhedron(
        SPACE, {"ab": U**2 - 1, "ac": V**2 + W**2 - 1, "bc": (U - V) ** 2 + W**2 - 1, "right": U}
    )
    found = corners(d, box=[(0, 2), (-2, 2), (-2, 2.1)])
    assert found.complete
    assert np.allclose(points(found), [[1, 0.5, -math.sqrt(0.75)], [1, 0.5, math.sqrt(0.75)]])


def test_clusters_of_four_spheres():
    """The tetrahedron and its mirror image are all clusters in which all six pairs touch."""
    space = Manifold.euclidean("a b c x y z")
    a, b, c, *last = space.symbols
    centres = [(0, 0, 0), (a, 0, 0), (b, c, 0), last]
    pairs = {
        f"d{i}{j}": sum((u - v) ** 2 for u, v in zip(centres[i], centres[j], strict=True)) - 1
        for i, j in itertools.combinations(range(4), 2)
    }
    d = Polyhedron(space, {**pairs, "right": a, "up": c})
    box = [(0, 2), (-2, 2), (0, 2.1), (-2, 2), (-2, 2.1), (-2, 2.2)]
    found = corners(d, box=box)
    assert found.complete
    height = math.sqrt(2 / 3)
    expected = [1, 0.5, math.sqrt(3) / 2, 0.5, math.sqrt(3) / 6]
    assert np.allclose(points(found), [[*expected, -height], [*expected, height]])


def test_a_skeleton_says_where_its_corners_are_not_those_of_the_list():
    bowl = Polyhedron(PLANE, {"bowl": Y - X**2, "lid": 2 - Y})
    part = corners(bowl, box=[(-1, 3), (-3, 3)])
    assert part.complete
    assert len(part) == 1
    atlas = part.skeleton()
    assert atlas.complete is Completeness.EXHAUSTED
    assert any("corner 1 of the skeleton is 0 corners of the list" in note for note in atlas.notes)
    cut_off = corners(bowl, box=SIDES, max_boxes=3).skeleton(starts=[[0.0, 1.0]])
    assert cut_off.complete is Completeness.EXHAUSTED
    assert any("not complete" in note for note in cut_off.notes)


def test_lists_are_values(tmp_path):
    found = corners(Polyhedron(PLANE, {"bowl": Y - X**2, "lid": 2 - Y}), box=SIDES)
    again = pickle.loads(pickle.dumps(found))
    files = [each.save(tmp_path / f"{k}.zip") for k, each in enumerate((found, again))]
    assert len({zipfile.ZipFile(file).read("problem.json") for file in files}) == 1
    assert "Proved: the polyhedron has exactly 2 corners" in str(found)
    with pytest.raises(ValueError, match=r"\.zip"):
        found.save(tmp_path / "list.json")


# ---------------------------------------------------------------------------- corrupted files

CUSP = Polyhedron(PLANE, [Y - X**2, 2 * X**2 - Y, 1 - Y])


def last(data, name):
    """Return the entry of the region of the singular corner."""
    return next(r for r in data["regions"] if name in r)


def drop_corner(data):
    data["points"].pop()


def add_function(data):
    data["points"][0]["active"] = [0, 1, 2]


def call_it_twice(data):
    data["points"].append(data["points"][0])


def drop_region(data):
    data["regions"].pop(0)
    data["points"] = [p for p in data["points"] if p["region"] > 0]
    for p in data["points"]:
        p["region"] -= 1


def move_apex(data):
    last(data, "exact")["exact"][0] = "1/1000"


def forget_relation(data):
    last(data, "exact")["combination"] = ["0", "0"]


def turn_relation(data):
    entry = last(data, "exact")
    entry["combination"] = [f"-{x}".replace("--", "") for x in entry["combination"]]


def claim_critical(data):
    last(data, "exact")["critical"] = [0]


def shift_box(data):
    box = data["regions"][0]
    for side in ("lower", "upper"):
        box[side] = [(float.fromhex(x) + 10).hex() for x in box[side]]


def another_branch(data):
    data["branches"] = [[0, 1]]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (drop_corner, "is not listed"),
        (add_function, "are active"),
        (call_it_twice, "listed twice"),
        (drop_region, "leaf"),
        (move_apex, "no common zero"),
        (forget_relation, "not isolated"),
        (turn_relation, "not isolated"),
        (claim_critical, "does not vanish|singular"),
        (shift_box, "no single common zero"),
        (another_branch, "is none of the corners|leaf|is not listed|are active"),
    ],
)
def test_corrupted_files_are_refused(change, why, tmp_path):
    path = corners(CUSP, box=SIDES).save(tmp_path / "corners.zip")
    assert verdict(path)[0]
    fine, line = verdict(changed(path, change))
    assert not fine
    assert re.search(why, line)


@pytest.mark.parametrize(
    ("change", "kind", "name"),
    [
        ({"box": [(-1, 1)]}, ValueError, "box"),
        ({"resolution": 0.0}, ValueError, "resolution"),
        ({"max_boxes": 0}, ValueError, "max_boxes"),
        ({"max_seconds": -1}, ValueError, "max_seconds"),
        ({"progress": 1}, TypeError, "progress"),
        ({"symmetry": 1}, TypeError, "symmetry"),
    ],
)
def test_bad_arguments_are_named(change, kind, name):
    arguments = {"box": [(-1, 1), (-1, 1)], **change}
    with pytest.raises(kind, match=name):
        corners(CUSP, **arguments)
    with pytest.raises(TypeError, match="polyhedron"):
        corners(X, box=[])
