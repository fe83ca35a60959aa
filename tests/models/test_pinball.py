"""Pinball against its definition: a box without discs, triangles and half-rings."""

import dataclasses
import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.ndimage import label, minimum_filter
from scipy.optimize import root
from strategies import reals

from polycorner import Verdict, certify, minimise, skeleton, stratum_at
from polycorner.models.pinball import Pinball
from polycorner.polyhedra import LocalType

BOARD = Pinball()
D, E = BOARD.polyhedron, BOARD.energy
CORNERS = BOARD.corners()
STEP = 0.005
# How far around a point the board is searched for a lower one: less than any obstacle is thick.
AROUND = 0.13


# ---------------------------------------------------------------------------------------- oracles


def in_triangle(corners, p):
    """Whether a point sees the corners go round it; points on a side count as either."""
    a, b, c = (np.array(corner) - p for corner in corners)
    turns = [u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0] for u, v in ((a, b), (b, c), (c, a))]
    return np.all(np.array(turns) > 0, axis=0) | np.all(np.array(turns) < 0, axis=0)


def free(board, p):
    """Whether a ball may be at points ``(..., 2)``."""
    p = np.asarray(p, dtype=float)
    x, y = p[..., 0], p[..., 1]
    result = (x >= 0) & (x <= board.width) & (y >= 0) & (y <= board.height)
    for px, py, radius in board.pins:
        result &= np.hypot(x - px, y - py) >= radius
    for wedge in board.wedges:
        result &= ~in_triangle(wedge, p)
    for cx, cy, inner, outer in board.cups:
        away = np.hypot(x - cx, y - cy)
        result &= ~((away > inner) & (away < outer) & (y < cy))
    return result


def ring(radius, count=3600):
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def profile(board, point, s):
    """How far above a rest the free part begins at a distance ``s`` aside: inf past a wall."""
    x, y = point[0] + s, point[1]
    low, high = y - 1e-7, y + 0.02
    if free(board, [x, low]):
        return low - y
    if not free(board, [x, high]):
        return math.inf
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if free(board, [x, middle]) else (middle, high)
    return high - y


def order_of_growth(board, point, side):
    """The power of the distance with which the lowest free height grows; None past a wall."""
    near, far = (profile(board, point, side * s) for s in (2e-4, 4e-4))
    if math.isinf(near):
        return None
    return 0 if max(abs(near), abs(far)) < 1e-12 else round(math.log2(far / near))


# What the paper's words mean for the lowest height on the two sides of a point in the plane.
KINDS = {
    (1, 1): {"half-V": 2, "half-U": 0, "U": 0, "free": 0},
    (1, None): {"half-V": 2, "half-U": 0, "U": 0, "free": 0},
    (2, 2): {"half-V": 1, "half-U": 0, "U": 1, "free": 0},
    (2, None): {"half-V": 1, "half-U": 1, "U": 0, "free": 0},
    (0, 0): {"half-V": 1, "half-U": 0, "U": 0, "free": 1},
}


def grid_minima(board):
    """Centres of the patches of grid points than which none around them is lower."""
    x, y = np.arange(0, board.width, STEP), np.arange(0, board.height, STEP)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    height = np.where(free(board, points), points[..., 1], np.inf)
    lowest = minimum_filter(height, size=2 * int(AROUND / STEP) + 1, mode="nearest")
    patches, count = label(np.isfinite(height) & (height < lowest + 1.2 * STEP))
    return [points[patches == k].mean(axis=0) for k in range(1, count + 1)]


@st.composite
def boards(draw):
    """Return boards of the size of the default one with a few obstacles anywhere."""
    place = st.tuples(st.floats(0, 6), st.floats(0, 8))
    pins = st.tuples(st.floats(0, 6), st.floats(0, 8), st.floats(0.1, 2))
    wedges = st.tuples(place, place, place).filter(lambda w: area(w) > 0.05)
    cups = st.tuples(st.floats(0, 6), st.floats(0, 8), st.floats(0.2, 1), st.floats(1.1, 2))
    few = {"max_size": 2}
    return Pinball(
        pins=draw(st.lists(pins, **few)),
        wedges=draw(st.lists(wedges, **few)),
        cups=draw(st.lists(cups, **few)),
        tilt=draw(st.floats(0.01, math.pi / 2)),
    )


def area(wedge):
    a, b, c = map(np.array, wedge)
    return abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]) / 2


# ------------------------------------------------------------------------------------- the region


@given(board=boards(), p=st.tuples(st.floats(-1, 7), st.floats(-1, 9)))
def test_the_region_is_what_the_obstacles_leave_of_the_box(board, p):
    assume(abs(board.polyhedron.implicit(p)) > 1e-9)
    assert board.polyhedron.contains(p) == free(board, p)
    assert (board.polyhedron.implicit(p) > 0) == free(board, p)


def test_the_default_board_is_free_where_the_obstacles_leave_it_so():
    points = np.random.default_rng(0).uniform((-0.2, -0.2), (6.2, 8.2), (20_000, 2))
    np.testing.assert_array_equal(D.contains(points), free(BOARD, points))


@given(board=boards(), p=st.tuples(reals(6), reals(8)))
def test_the_energy_is_the_height_on_the_tilted_board(board, p):
    assert board.energy.value(p) == pytest.approx(p[1] * math.sin(board.tilt), abs=1e-12)


def test_functions_are_called_after_what_they_keep_the_ball_out_of():
    board = Pinball(pins=[(3, 6, 1)], wedges=[((1, 1), (2, 1), (1, 2))], cups=[(4, 3, 1, 2)])
    wedge = ("wedge1.ab", "wedge1.bc", "wedge1.ca")
    cup = ("cup1.hollow", "cup1.shell", "cup1.rim")
    assert board.polyhedron.names == ("left", "right", "floor", "lid", "pin1", *wedge, *cup)
    at = {
        "pin1": (3, 7),
        "wedge1.ab": (1.5, 1),
        "wedge1.bc": (1.5, 1.5),
        "wedge1.ca": (1, 1.5),
        "cup1.hollow": (4, 2),
        "cup1.shell": (4, 1),
        "cup1.rim": (5.5, 3),
    }
    for name, point in at.items():
        assert stratum_at(board.polyhedron, point).active == (name,)


def test_a_wedge_may_be_given_either_way_round():
    one = Pinball(wedges=[((1, 1), (2, 1), (1, 2))])
    two = Pinball(wedges=[((1, 2), (2, 1), (1, 1))])
    points = one.starts(np.random.default_rng(0), 300) - (0, 0.3)
    np.testing.assert_allclose(one.polyhedron.implicit(points), two.polyhedron.implicit(points))


# ---------------------------------------------------------------------------------------- corners


def test_corners_are_all_free_solutions_of_two_equations_that_bound_the_region():
    """Every pair of boundary curves, solved from many starts; kept where the region has a kink."""
    curves = [
        lambda p: p[0],
        lambda p: BOARD.width - p[0],
        lambda p: p[1],
        lambda p: BOARD.height - p[1],
    ]
    for x, y, radius in BOARD.pins:
        curves.append(lambda p, c=(x, y), r=radius: np.hypot(*(p - c)) - r)
    for wedge in BOARD.wedges:
        for a, b in combinations(np.array(wedge), 2):
            curves.append(lambda p, a=a, d=b - a: d[0] * (p - a)[1] - d[1] * (p - a)[0])
    for x, y, inner, outer in BOARD.cups:
        curves += [lambda p, c=(x, y), r=r: np.hypot(*(p - c)) - r for r in (inner, outer)]
        curves.append(lambda p, level=y: p[1] - level)
    found = [np.empty(2) + np.inf]
    for one, two in combinations(curves, 2):
        for start in ((1.0, 2.0), (4.5, 1.0), (2.9, 5.1), (2.5, 4.1), (3.8, 4.9), (5.0, 3.3)):
            solution = root(lambda p, f=one, g=two: [f(p), g(p)], start)
            p = solution.x
            if abs(solution.fun).max() > 1e-9 or np.linalg.norm(found - p, axis=1).min() < 1e-6:
                continue
            share = free(BOARD, p + ring(1e-5)).mean()
            if 0.001 < share < 0.999 and abs(share - 0.5) > 1e-3:
                found.append(p)
    found = np.array(found[1:])
    assert len(found) == len(CORNERS)
    for corner in CORNERS:
        assert np.linalg.norm(found - corner, axis=1).min() < 1e-8


def test_a_corner_is_a_union_just_where_its_angle_is_larger_than_straight():
    kinds = {True: LocalType.UNION, False: LocalType.QUADRANT}
    shares = [free(BOARD, corner + ring(1e-5)).mean() for corner in CORNERS]
    assert {share > 0.5 for share in shares} == {True, False}
    for corner, share in zip(CORNERS, shares, strict=True):
        stratum = stratum_at(D, corner)
        assert abs(share - 0.5) > 0.01
        assert stratum.local_type is kinds[bool(share > 0.5)]
        assert (stratum.dimension, stratum.rank) == (0, 2)


def test_walking_finds_the_same_corners_and_the_holes():
    """Euler: one, less one for every obstacle that touches no wall; counted on a grid."""
    atlas = skeleton(D, [(x, y + radius) for x, y, radius in BOARD.pins])
    walked = np.array([corner.point for corner in atlas.corners])
    assert len(walked) == len(CORNERS)
    for corner in CORNERS:
        assert np.linalg.norm(walked - corner, axis=1).min() < 1e-8
    x, y = np.arange(-0.1, 6.1, 0.02), np.arange(-0.1, 8.1, 0.02)
    solid = ~free(BOARD, np.stack(np.meshgrid(x, y), axis=-1))
    outside_and_holes = label(solid, np.ones((3, 3)))[1]
    assert atlas.euler_characteristic == 1 - (outside_and_holes - 1)


triangles = st.tuples(
    st.tuples(st.floats(1, 5), st.floats(1, 7)),
    st.tuples(st.floats(1, 5), st.floats(1, 7)),
    st.tuples(st.floats(1, 5), st.floats(1, 7)),
)
ledges = st.builds(
    lambda x, y, w, d: ((x, y), (x + w, y), (x + w / 3, y - d)),
    st.floats(1, 3),
    st.floats(3, 6),
    st.floats(0.5, 2),
    st.floats(0.5, 2),
)


@given(wedge=(triangles | ledges).filter(lambda w: area(w) > 0.05), tilt=st.floats(0.01, 1.5))
def test_nothing_rests_on_a_concave_corner(wedge, tilt):
    """Each of two pieces that meet would have to hold the ball alone, from different sides."""
    board = Pinball(pins=(), wedges=[wedge], cups=(), tilt=tilt)
    for corner in wedge:
        assert stratum_at(board.polyhedron, corner).local_type is LocalType.UNION
        assert certify(board.polyhedron, board.energy, corner).verdict is Verdict.NOT_STATIONARY


# ------------------------------------------------------------------------------------------ rests


def test_balls_rest_where_no_free_point_around_them_is_lower():
    near = ring(1e-4) * np.linspace(0.01, 1, 3600)[:, None]
    for start in BOARD.starts(np.random.default_rng(1), 150):
        rest = minimise(D, E, start)
        assert rest.is_minimum
        assert rest.energy <= E.value(start)
        around = rest.point + near
        lowest = around[free(BOARD, around)][:, 1].min()
        assert lowest > rest.point[1] - 1e-9


def test_every_minimum_on_a_grid_is_a_rest_held_as_its_profile_says():
    """A ball let go just above each grid minimum stays there; powers of growth give its kinds."""
    minima = grid_minima(BOARD)
    assert len(minima) == 7
    seen = set()
    for centre in minima:
        rest = minimise(D, E, centre + np.array([0, 2 * STEP]))
        assert rest.is_minimum
        assert np.linalg.norm(rest.point - centre) < 0.05
        growth = {order_of_growth(BOARD, rest.point, side) for side in (-1, 1)}
        orders = (*sorted(growth - {None}), None) if None in growth else tuple(growth) * 2
        assert rest.entrapment_counts == KINDS[orders]
        seen.add(orders)
    assert seen == set(KINDS)


def test_rests_in_closed_form():
    """The bottom of a cup, and pockets of a pin with a wall and with another pin."""
    cup, half, wall_pin = BOARD.cups[0], BOARD.cups[1], BOARD.pins[7]
    one, two = np.array(BOARD.pins[5]), np.array(BOARD.pins[6])
    apart = two[:2] - one[:2]
    across = np.array([-apart[1], apart[0]]) / np.linalg.norm(apart)
    lift = math.sqrt(one[2] ** 2 - apart @ apart / 4)
    bottoms = {
        ("cup1.hollow",): (cup[0], cup[1] - cup[2]),
        ("right", "cup2.hollow"): (half[0], half[1] - half[2]),
        ("left", "pin8"): (0.0, wall_pin[1] + math.sqrt(wall_pin[2] ** 2 - wall_pin[0] ** 2)),
        ("pin6", "pin7"): one[:2] + apart / 2 + lift * across,
    }
    for active, bottom in bottoms.items():
        rest = certify(D, E, bottom)
        assert (rest.active, rest.is_minimum) == (active, True)
        assert rest.energy == pytest.approx(bottom[1] * math.sin(BOARD.tilt))


def test_the_top_of_a_pin_is_no_place_to_rest():
    for x, y, radius in BOARD.pins[:5]:
        assert certify(D, E, [x, y + radius]).verdict is Verdict.SADDLE


def test_no_minimum_is_asserted_in_the_cusp_between_two_pins_that_touch():
    """A ball would rest there, but the set goes on below, through the single point of contact."""
    board = Pinball(pins=[(2, 4, 0.5), (3, 4, 0.5)], wedges=(), cups=())
    cusp = certify(board.polyhedron, board.energy, [2.5, 4.0])
    assert cusp.stratum.local_type is LocalType.DEGENERATE
    assert cusp.verdict is Verdict.NOT_STATIONARY
    assert not any(np.allclose(c, [2.5, 4]) for c in board.corners())


# ------------------------------------------------------------------------------------- arguments


@given(board=boards(), seed=st.integers(0, 10**6))
def test_starts_are_free(board, seed):
    points = np.random.default_rng(seed).uniform((0, 0), (6, 8), (500, 2))
    assume(free(board, points).mean() > 0.05)
    starts = board.starts(np.random.default_rng(seed), 20)
    assert starts.shape == (20, 2)
    assert free(board, starts).all()


def test_a_board_is_a_value():
    given_as_lists = Pinball(pins=[[1, 2, 0.5]], wedges=[], cups=np.empty((0, 4)))
    assert given_as_lists == Pinball(pins=((1.0, 2.0, 0.5),), wedges=(), cups=())
    assert hash(given_as_lists) == hash(dataclasses.replace(given_as_lists))
    assert Pinball().tilt == pytest.approx(math.radians(6.5))


def test_a_board_without_room_says_so():
    full = Pinball(pins=[(3, 4, 20)], wedges=(), cups=())
    with pytest.raises(ValueError, match=r"^polyhedron: expected room inside the box; got none"):
        full.starts(np.random.default_rng(0), 1)


@pytest.mark.parametrize(
    ("argument", "value", "kind"),
    [
        ("width", 0, ValueError),
        ("height", math.inf, ValueError),
        ("tilt", -0.1, ValueError),
        ("tilt", 1.6, ValueError),
        ("pins", [(1, 2)], ValueError),
        ("pins", [(1, 2, 0.0)], ValueError),
        ("pins", [(1, 2, math.nan)], ValueError),
        ("pins", [(1, 2), (1, 2, 3)], ValueError),
        ("pins", 3, ValueError),
        ("wedges", [(1, 2, 3)], ValueError),
        ("wedges", [((1, 1), (2, 2), (3, 3))], ValueError),
        ("wedges", [((1, 1), (1, 1), (1, 1))], ValueError),
        ("cups", [(1, 2, 1, 1)], ValueError),
        ("cups", [(1, 2, -1, 1)], ValueError),
        ("width", "6", TypeError),
        ("tilt", True, TypeError),
        ("pins", "pins", TypeError),
        ("cups", None, TypeError),
        ("wedges", [[[True] * 2] * 3], TypeError),
    ],
)
def test_the_error_names_the_argument(argument, value, kind):
    with pytest.raises(kind, match=rf"^{argument}: expected [^\n]+; got "):
        Pinball(**{argument: value})
