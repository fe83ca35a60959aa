"""Balls in regions: functions against plain geometry, best radii, and optima in closed form."""

import math
import pickle
from fractions import Fraction
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest

from polycorner import certify, prove
from polycorner.models import CirclesIn, SpheresInCube, basin_hopping, read_coordinates

REGIONS = {
    "square": "square",
    "rectangle": (2, "0.7"),
    "circle": "circle",
    "torus": "torus",
    "hexagonal": "hexagonal torus",
    "lattice": ((Fraction(3, 2), "0.5"), (-0.25, 1)),
    "cube": None,
}
LATTICES = {
    "torus": np.eye(2),
    "hexagonal": np.array([[1, 0], [0.5, math.sqrt(0.75)]]),
    "lattice": np.array([[1.5, 0.5], [-0.25, 1.0]]),
}
NAMES = {given: name for name, given in REGIONS.items() if isinstance(given, str)}
SIDES = {"square": (1, 1), "rectangle": (2, 0.7), "cube": (1, 1, 1)}


def model(region, count, equal):
    if region == "cube":
        return SpheresInCube(count, equal)
    return CirclesIn(REGIONS[region], count, equal)


def distance(region, p, q):
    """Return the distance of two points, on a torus of the nearest of many images."""
    if region not in LATTICES:
        return math.dist(p, q)
    images = product(range(-4, 5), repeat=2)
    return min(math.dist(p, q + np.array(image) @ LATTICES[region]) for image in images)


def room(region, p):
    """Return the distance of a point from the border, or half of the way to its own image."""
    if region in SIDES:
        return min(min(x, side - x) for x, side in zip(p, SIDES[region], strict=True))
    if region == "circle":
        return 1 - math.hypot(*p)
    images = [image for image in product(range(-4, 5), repeat=2) if any(image)]
    return min(math.hypot(*(np.array(image) @ LATTICES[region])) for image in images) / 2


def is_packing(region, centres, radii):
    """Whether balls are inside and apart, and no radius is negative."""
    fits = all(room(region, p) >= r >= 0 for p, r in zip(centres, radii, strict=True))
    return fits and all(
        distance(region, centres[i], centres[j]) >= radii[i] + radii[j]
        for i, j in combinations(range(len(centres)), 2)
    )


@pytest.mark.parametrize("equal", [True, False])
@pytest.mark.parametrize("region", REGIONS)
def test_the_polyhedron_is_the_set_of_packings(region, equal, subtests):
    shape, rng = model(region, 3, equal), np.random.default_rng(5)
    seen = set()
    for k in range(60):
        q = shape.starts(rng, 1)[0]
        own = slice(-1, None) if equal else slice(-3, None)
        q[own] *= rng.choice([0.9, 1.1, -0.1]) if k % 3 else rng.uniform(0.8, 1.2, q[own].shape)
        inside = is_packing(region, shape.centres(q), shape.radii(q))
        seen.add(inside)
        with subtests.test(k):
            assert bool(shape.polyhedron.contains(q)) == inside
    assert seen == {True, False}


@pytest.mark.parametrize("region", REGIONS)
def test_equal_radii_are_as_large_as_the_nearest_neighbours_allow(region):
    shape, rng = model(region, 4, equal=True), np.random.default_rng(1)
    for q in shape.starts(rng, 5):
        centres = shape.centres(q)
        nearest = min(distance(region, p, o) for p, o in combinations(centres, 2))
        assert q[-1] == pytest.approx(min(nearest / 2, *[room(region, p) for p in centres]))
        assert shape.energy.value(q) == -q[-1]


def test_other_radii_have_the_largest_sum():
    """For two circles every choice of radii is compared."""
    shape = CirclesIn("square", 2, equal=False)
    centres = np.array([[0.3, 0.4], [0.6, 0.7]])
    q = shape.point(centres)
    apart, rooms = math.dist(*centres), [room("square", p) for p in centres]
    sums = [r + min(rooms[1], apart - r) for r in np.linspace(0, min(rooms[0], apart), 1001)]
    assert -shape.energy.value(q) == pytest.approx(max(sums), abs=1e-9)
    assert is_packing("square", centres, q[-2:] * (1 - 1e-12))


def test_tables_have_frames_of_their_own():
    """A table over ``[-1/2, 1/2]^2``, and one of points that are to be far apart in a square."""
    shape = CirclesIn("square", 2)
    for centres, frame in (
        ([[-0.2, -0.1], [0.3, 0.2]], {"origin": -0.5}),
        ([[3.0, 14.0], [8.0, 17.0]], {"origin": (0.0, 10.0), "unit": 10.0}),
    ):
        q = shape.point(centres, **frame)
        assert shape.centres(q) == pytest.approx(np.array([[0.3, 0.4], [0.8, 0.7]]))
        assert q[-1] == pytest.approx(0.2)


def test_coordinates_on_a_torus_are_those_of_the_plane():
    shape = CirclesIn(((2, 1), (-1, 2)), 2)
    q = shape.point([[0.1, 0.2], [0.1 + 2 - 1, 0.2 + 1 + 2 + 0.5]])
    assert q[-1] == pytest.approx(0.25)
    moved = shape.centres(q)[1] - shape.centres(q)[0]
    assert distance("torus", moved, [0, 0.5]) == pytest.approx(0, abs=1e-12)


def regular(count):
    """Return the points of a regular polygon."""
    turns = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(turns), np.sin(turns)])


def corners(r):
    """Return the centres of circles of a radius in the corners of the square."""
    return np.array(list(product((r, 1 - r), repeat=2)))


FIVE = 1 / (2 + 2 * math.sqrt(2))
GRID = np.array(list(product((1, 3, 5), repeat=2))) / 6
KNOWN = {
    "2 in a square": (
        ("square", 2),
        corners(1 / (2 + math.sqrt(2)))[[0, 3]],
        1 / (2 + math.sqrt(2)),
    ),
    "4 in a square": (("square", 4), corners(1 / 4), 1 / 4),
    "5 in a square": (("square", 5), [*corners(FIVE), [0.5, 0.5]], FIVE),
    "9 in a square": (("square", 9), GRID, 1 / 6),
    "2 in a rectangle": (((2, "0.7"), 2), [[0.35, 0.35], [1.65, 0.35]], 0.35),
    "7 in a circle": (("circle", 7), [[0, 0], *(2 / 3 * regular(6))], 1 / 3),
    "2 on the torus": (("torus", 2), [[0, 0], [0.5, 0.5]], math.sqrt(2) / 4),
    "1 on the hexagonal torus": (("hexagonal torus", 1), [[0, 0]], 1 / 2),
}


@pytest.mark.parametrize("name", KNOWN)
def test_best_packings_that_are_known_in_closed_form(name):
    arguments, near, radius = KNOWN[name]
    shape = CirclesIn(*arguments)
    found = basin_hopping(shape, 2, hops=30, below=-radius)
    assert -found.energy == pytest.approx(radius, rel=1e-12)
    radii = shape.radii(found.point) * (1 - 1e-12)
    region = "rectangle" if isinstance(shape.region, tuple) else NAMES[shape.region]
    assert is_packing(region, shape.centres(found.point), radii)
    assert shape.point(near)[-1] == pytest.approx(radius, rel=1e-12)


def test_eight_spheres_in_a_cube():
    found = basin_hopping(SpheresInCube(8), 3, hops=20, below=-0.25)
    assert -found.energy == pytest.approx(0.25, rel=1e-12)


@pytest.mark.parametrize(
    ("shape", "centres"),
    [
        (CirclesIn("square", 5), [*corners(FIVE), [0.5, 0.5]]),
        (CirclesIn("circle", 3), regular(3) / (1 + math.sqrt(0.75))),
        (CirclesIn("torus", 2), [[0, 0], [0.5, 0.5]]),
        (CirclesIn("square", 2, equal=False), corners(1 / (2 + math.sqrt(2)))[[0, 3]]),
    ],
    ids=["square", "circle", "torus", "sum"],
)
def test_best_packings_are_proved(shape, centres):
    q = shape.point(centres)
    proof = prove(certify(shape.polyhedron, shape.energy, q), symmetry=shape.symmetry)
    assert proof.proved, proof.conditions
    low, high = map(float, proof.enclosures["energy"])
    assert low <= shape.energy.value(q) + 1e-12
    assert high >= shape.energy.value(q) - 1e-12


def test_names_tell_who_touches_what():
    square = CirclesIn("square", 2).polyhedron.names
    assert set(square) == {"1-2", "r-least"} | {
        f"{i}-{side}" for i in (1, 2) for side in ("left", "right", "bottom", "top")
    }
    disc = set(CirclesIn("circle", 2, equal=False).polyhedron.names)
    assert {"1-2", "1-circle", "2-circle", "1-most", "r2-least"} <= disc
    assert "1-2(0,-1)" in CirclesIn("torus", 2).polyhedron.names


def test_sides_are_exact():
    shape = CirclesIn((Fraction(1, 3), "0.1"), 1)
    walls = {f.name: str(f.expression) for f in shape.polyhedron.functions}
    assert walls["1-right"] == "-r - x1 + 1/3"
    assert walls["1-top"] == "-r - y1 + 1/10"


def test_a_model_is_a_value():
    shape = CirclesIn("circle", 4, equal=False)
    again = pickle.loads(pickle.dumps(shape))
    assert again == shape
    q = shape.starts(np.random.default_rng(0), 1)[0]
    assert again.polyhedron.implicit(q) == shape.polyhedron.implicit(q)
    assert again.polyhedron.names == shape.polyhedron.names


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: CirclesIn("triangle", 3), "region"),
        (lambda: CirclesIn((1, 0), 3), "region"),
        (lambda: CirclesIn((1, "x"), 3), "region"),
        (lambda: CirclesIn(((1, 0), (0.9, 1)), 3), "region"),
        (lambda: CirclesIn(((1, 0), (2, 0)), 3), "region"),
        (lambda: CirclesIn((1, math.inf), 3), "region"),
        (lambda: CirclesIn("square", 0), "count"),
        (lambda: SpheresInCube(0), "count"),
        (lambda: CirclesIn("square", 2).point([[0, 0]]), "centres"),
        (lambda: CirclesIn("square", 1).point([[0, math.nan]]), "centres"),
        (lambda: CirclesIn("square", 1).point([[0, 0]], unit=0.0), "unit"),
        (lambda: CirclesIn("square", 1).point([[0, 0]], origin=(1, 2, 3)), "origin"),
    ],
)
def test_wrong_arguments(make, argument):
    with pytest.raises(ValueError, match=f"^{argument}: expected "):
        make()


def test_arguments_of_a_wrong_kind():
    with pytest.raises(TypeError, match=r"^region: expected "):
        CirclesIn(3, 2)
    with pytest.raises(TypeError, match=r"^equal: expected "):
        CirclesIn("square", 2, "yes")


DATA = Path(__file__).parents[3] / "examples" / "data"


def test_kept_coordinates_are_packings():
    """Equal circles shrink as there are more, and two known ones are among them."""
    rows = read_coordinates(DATA / "circles_in_square.csv", index=False).floats
    radii = {}
    for count in range(2, 31):
        shape = CirclesIn("square", count)
        centres = rows[rows[:, 0] == count, 2:]
        radii[count] = shape.point(centres)[-1]
        assert is_packing("square", centres, [radii[count] * (1 - 1e-12)] * count)
    assert all(radii[count] < radii[count - 1] for count in range(3, 31))
    assert radii[16] == pytest.approx(1 / 8, rel=1e-12)
    assert radii[25] == pytest.approx(1 / 10, rel=1e-12)


def test_kept_radii_have_a_large_sum():
    table = read_coordinates(DATA / "26_circles.csv")
    shape = CirclesIn("square", 26, equal=False)
    q = shape.point(table.part(0, 2))
    assert shape.radii(q) == pytest.approx(table.floats[:, 2], abs=1e-9)
    assert is_packing("square", table.floats[:, :2], table.floats[:, 2] * (1 - 1e-12))
    assert table.floats[:, 2].sum() > 2.63598
    assert certify(shape.polyhedron, shape.energy, np.append(q[:52], table.floats[:, 2])).is_minimum
