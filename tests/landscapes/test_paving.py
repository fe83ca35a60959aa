"""Barriers from below: against floods of fine grids, closed forms, and by what a paving is."""

import heapq
import math

import numpy as np
import pytest
import sympy

from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.landscapes import landscape, paved_barrier
from polycorner.landscapes import paving as module
from polycorner.landscapes.heights import Heights
from polycorner.minimisation.problem import pose
from polycorner.proofs.lists.domains import domain
from polycorner.searches import Ending

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
SPACE = Manifold.euclidean("u v w")
u, v, w = SPACE.symbols
TORUS = Manifold(("a", "b"), (math.tau, math.tau))
a, b = TORUS.symbols
BOX = [(-4, 4), (-4, 4)]
DISC = 9 - x**2 - y**2


def flooded(problem, start, end, side=3.0, step=0.025):
    """Return the height at which a flood from the start reaches the end, on a grid.

    Steps lead to eight neighbours, through points of the set in their middle as well.
    """
    ticks = np.linspace(-side, side, 4 * round(side / step) + 1)
    points = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1)
    inside = problem.polyhedron.contains(points)
    heights = np.where(inside, problem.energy.value(points), np.inf)
    first, last = (tuple(2 * np.rint((q + side) / step).astype(int)) for q in (start, end))
    best = {first: heights[first]}
    waiting = [(heights[first], first)]
    while waiting:
        level, (i, j) = heapq.heappop(waiting)
        if (i, j) == last:
            return level
        if level > best[i, j]:
            continue
        for di in (-2, 0, 2):
            for dj in (-2, 0, 2):
                k, m = i + di, j + dj
                if 0 <= k < len(ticks) and 0 <= m < len(ticks):
                    top = max(level, heights[i + di // 2, j + dj // 2], heights[k, m])
                    if top < best.get((k, m), np.inf):
                        best[k, m] = top
                        heapq.heappush(waiting, (top, (k, m)))
    return np.inf


def wells(rng, count=3):
    """Return a sum of wells in a bowl, and places near the lowest points of two of them."""
    places = rng.uniform(-1.6, 1.6, (count, 2)).round(3)
    energy = 0.15 * (x**2 + y**2)
    for (p, q), depth in zip(
        places.tolist(), rng.uniform(0.7, 1.4, count).round(3).tolist(), strict=True
    ):
        energy -= depth * sympy.exp(-4 * ((x - p) ** 2 + (y - q) ** 2))
    return energy, *(np.rint(places[:2] / 0.025) * 0.025)


def obstacles(rng):
    """Return a union around a triangle, and a disc that is cut out."""
    middle, turn = rng.uniform(-0.8, 0.8, 2).round(3), round(rng.uniform(0, 2), 3)
    sides = [
        sympy.Float(math.cos(turn + k)) * (x - middle[0])
        + sympy.Float(math.sin(turn + k)) * (y - middle[1])
        - 0.3
        for k in (0, 2.1, 4.2)
    ]
    p, q = rng.uniform(-1.5, 1.5, 2).round(3)
    return {"triangle": AnyOf(*sides), "disc": DISC, "hole": (x - p) ** 2 + (y - q) ** 2 - 0.16}


@pytest.mark.parametrize("seed", range(12))
def test_a_flood_on_a_grid_is_not_lower_and_not_much_higher(seed):
    rng = np.random.default_rng(seed)
    while True:
        energy, start, end = wells(rng)
        problem = pose(Polyhedron(PLANE, obstacles(rng)), energy)
        if problem.polyhedron.contains(np.array([start, end])).all():
            break
    above = flooded(problem, start, end)
    found = paved_barrier(problem, BOX, start, [end], max_boxes=20_000)
    assert found.lower <= above + 1e-3
    assert above <= found.lower + 0.05


@pytest.mark.parametrize("seed", [0, 3, 4, 6])
def test_lists_with_proof_say_the_same(seed):
    rng = np.random.default_rng(seed)
    energy = wells(rng)[0]
    polyhedron = Polyhedron(PLANE, obstacles(rng))
    listed = landscape(polyhedron, energy, box=BOX)
    assert listed.complete
    for k in range(1, len(listed.minima)):
        barrier = listed.barrier(0, k)
        ends = listed.minima[0].point, [listed.minima[k].point]
        found = paved_barrier(pose(polyhedron, energy), BOX, *ends, until=barrier.upper - 1e-6)
        assert barrier.lower - 2e-6 <= found.lower <= barrier.upper


CASES = {
    "two wells": (Polyhedron(PLANE, {"disc": DISC}), (x**2 - 1) ** 2 + y**2, [-1, 0], [1, 0], 1.0),
    "the tip of an obstacle": (
        Polyhedron(PLANE, {"disc": DISC, "roof": AnyOf(y - x / 2 - 1, y + 2 * x / 5 - 1)}),
        y + y**2 / 5, [-2, 0.5], [2, 0.5], 1.2,
    ),
    "a curve": (
        Polyhedron(PLANE, {"disc": DISC}, [x**2 / 4 + y**2 - 1]),
        # By the branch y < 0 it is lower, and the ends are highest.
        (x**2 - 2) ** 2 + y / 10, [-1.5, -math.sqrt(7) / 4], [1.5, -math.sqrt(7) / 4], 3.9,
    ),
    "a torus": (
        Polyhedron(TORUS, {"f": sympy.cos(a) + sympy.cos(b) + 1.5}),
        -sympy.cos(2 * a) + 0.3 * sympy.sin(b), [0, 0], [math.pi, 0], 0.7,
    ),
    "a sphere by its equation": (
        Polyhedron(SPACE, {"ball": 4 - u**2 - v**2 - w**2}, [u**2 + v**2 + w**2 - 1]),
        2 * u**2 - v**2, [0, 1, 0], [0, -1, 0], 0.0,
    ),
    "around a ball in space, over a circle of passes": (
        Polyhedron(SPACE, {"ball": 9 - u**2 - v**2 - w**2, "hole": u**2 + v**2 + w**2 - 0.25}),
        (u**2 - 1) ** 2 + v**2 + w**2, [-1, 0, 0], [1, 0, 0], 1.25,
    ),
}  # fmt: skip


def test_closed_forms(subtests):
    for name, (polyhedron, energy, start, end, value) in CASES.items():
        with subtests.test(name):
            n = polyhedron.manifold.size
            sides = [(-4, 4)] * n if polyhedron.manifold is not TORUS else [None] * 2
            near = 1e-3 if "circle" in name else 1e-5
            found = paved_barrier(pose(polyhedron, energy), sides, start, [end], until=value - near)
            assert found.ending is Ending.FINISHED
            assert value - near <= found.lower <= value


def test_the_height_of_a_pass_on_a_wall():
    # On the wall y = 1 - x^2 the energy is (1 - x^2)(1 + x/10), greatest at a root of a quadratic.
    wall = Polyhedron(PLANE, {"disc": DISC, "wall": y - 1 + x**2})
    root = (-2 + math.sqrt(4 + 0.12)) / 0.6
    value = (1 - root**2) * (1 + root / 10)
    ends = [-1.4, -0.9], [[1.4, -0.9]]
    found = paved_barrier(pose(wall, y + x * y / 10), BOX, *ends, until=value - 1e-8)
    assert value - 1e-8 <= found.lower <= value


def test_what_is_not_connected_is_so_at_every_energy():
    two = Polyhedron(PLANE, {"disc": DISC, "apart": x**2 - 1e-4})
    found = paved_barrier(pose(two, y), BOX, [-1, 0], [[1, 0], [2, 0]])
    assert found.lower == math.inf
    assert found.ending is Ending.FINISHED
    assert not len(found.way)


def test_a_crack_of_no_width_joins():
    # Both halves contain the line x = 0.
    touching = Polyhedron(PLANE, {"disc": DISC, "apart": x**2})
    assert paved_barrier(pose(touching, y), BOX, [-1, 0], [[1, 0]], max_boxes=20_000).lower <= 0


def test_a_line_is_a_way():
    line = Polyhedron(PLANE, {"disc": DISC, "up": y, "down": -y})
    found = paved_barrier(pose(line, 1 - x**2), BOX, [-1, 0], [[1, 0]], until=0.999)
    assert 0.999 <= found.lower <= 1


BOWL = y**2 + x**2 / 4


def test_leaving_a_region_and_a_box():
    whole = pose(Polyhedron(PLANE, {"disc": DISC}), BOWL)
    # Where x is 1 first, and where the box ends first.
    region = {"left": 1 - x, "low": 1 - y}
    leaving = paved_barrier(whole, BOX, [0, 0], region=region)
    assert 0.25 - 1e-6 <= leaving.lower <= 0.25
    sides = paved_barrier(whole, [(-1.5, 1.2), (-2, 0.5)], [0, 0])
    assert 0.25 - 1e-6 <= sides.lower <= 0.25
    walls = paved_barrier(whole, [(-1.5, 1.2), (-2, 0.5)], [0, 0], region=region, walled=True)
    assert 0.25 - 1e-6 <= walls.lower <= 0.25
    # A bowl with a notch: a ring that is open where x > 0 and |y| < 1/4.
    notch_of = AllOf(x, y + 0.25, 0.25 - y)
    ring = AnyOf(1 - x**2 - y**2, x**2 + y**2 - 4, notch_of)
    notch = pose(Polyhedron(PLANE, {"ring": ring}), y + x**2)
    # It is left at the lower corner of the notch with the outer circle: y = -1/4, x^2 + y^2 = 4.
    corner = -1 / 4 + 4 - 1 / 16
    through = paved_barrier(notch, [(-3, 3), (-3, 3)], [0, -1], until=corner - 1e-4)
    assert corner - 1e-4 <= through.lower <= corner
    cage = pose(Polyhedron(PLANE, {"ring": AnyOf(1 - x**2 - y**2, x**2 + y**2 - 4)}), y + x**2)
    assert paved_barrier(cage, [(-3, 3), (-3, 3)], [0, -1]).lower == math.inf


def test_two_fingers_squeeze_a_bolt():
    # The height is the squared distance of two point fingers in the frame of an endless bolt, with
    # a shank |y| < 1 and a head |y| < 2, 0 < x < 1: how far must they open to get off it?  One
    # waits in the corner between shank and head while the other one gets over the head's edge.
    fingers = Manifold.euclidean("x1 y1 x2 y2")
    pairs = np.reshape(fingers.symbols, (2, 2))
    outside = [
        AnyOf(*sides)
        for p, q in pairs
        for sides in ((q - 1, -1 - q, p - 0.5), (q - 2, -2 - q, -p, p - 1))
    ]
    problem = pose(Polyhedron(fingers, outside), sum((pairs[0] - pairs[1]) ** 2))
    over = [(-1, 1), (0, 1), (0, 2), (1, 2), (1, -2), (1, -2)]
    waiting = [(-1, -1), (0, -1), (0, -1), (0, -1), (0, -1), (0, -2)]
    corners = np.hstack(
        [
            over,
            waiting,
        ]
    ).astype(float)
    t = np.linspace(0, 5, 5001)
    way = np.stack([np.interp(t, range(6), column) for column in corners.T], axis=1)
    assert problem.polyhedron.contains(way).all()
    heights = problem.energy.value(way)
    assert heights.max() == 10
    assert heights[-1] == 1
    found = paved_barrier(
        problem, [(-4, 4)] * 4, corners[0], [corners[-1]], walled=True, until=9.9, max_boxes=10**6
    )
    assert 9.9 <= found.lower <= 10


def test_a_way_around_a_circle_is_found_at_its_seam():
    # From 3 to -3 it is shorter over pi than over 0, where the energy is higher.
    circle = Manifold(("t",), (math.tau,))
    (t,) = circle.symbols
    problem = pose(Polyhedron(circle, {"f": 2 + sympy.cos(t)}), sympy.cos(t) + 3 * sympy.cos(2 * t))
    over = paved_barrier(problem, [None], [3.0], [[-3.0]])
    start = math.cos(3) + 3 * math.cos(6)
    assert start < 2
    assert 2 - 1e-6 <= over.lower <= 2
    # Turned by whole periods, and with another cut, it is the same.
    again = paved_barrier(problem, [(0, math.tau)], [3.0 - 2 * math.tau], [[-3.0 + math.tau]])
    assert 2 - 1e-6 <= again.lower <= 2
    part = paved_barrier(problem, [(-3.1, 3.1)], [3.0], [[-3.0]], walled=True)
    assert 4 - 1e-6 <= part.lower <= 4


def test_boxes_cover_the_set_and_are_linked_where_they_touch():
    rng = np.random.default_rng(5)
    twisted = sympy.cos(a) + sympy.cos(2 * b + 1) + 0.5
    cases = [
        pose(Polyhedron(PLANE, obstacles(rng)), wells(rng)[0]),
        pose(Polyhedron(TORUS, {"f": twisted}), sympy.sin(a + b) + sympy.cos(b)),
        pose(Polyhedron(SPACE, {"f": 1.5 - u * v, "g": w**2 - u}), u * v + w + v**2),
    ]
    for problem in cases:
        manifold = problem.polyhedron.manifold
        n = manifold.size
        found = domain(manifold, [(-2, 2)] * n if manifold is not TORUS else [None] * n)
        points = rng.uniform(found.lower, found.upper, (20_000, n))
        points = points[problem.polyhedron.contains(points)]
        near = points[:2] * 0 + points[0]
        search = module._Refinement(Heights(problem), found, [near, near], False, np.inf, 1e-6)
        for _ in range(7):
            c = search.cells
            search.divide(np.flatnonzero(rng.uniform(size=len(c)) < 0.7))
        c = search.cells
        holds = ((c.lower <= points[:, None]) & (points[:, None] <= c.upper)).all(axis=2)
        assert holds.any(axis=1).all()
        assert (~holds | (c.weight[0] <= problem.energy.value(points)[:, None])).all()
        # Two boxes touch if their middles are no farther apart than half their sides together.
        middles, half = (c.upper + c.lower) / 2, (c.upper - c.lower) / 2
        gaps = abs(manifold.difference(middles[:, None], middles[None])) - half[:, None] - half
        touching = {(i, j) for i, j in np.argwhere((gaps <= 1e-14).all(axis=2)).tolist() if i < j}
        links = [tuple(sorted(link)) for link in c.links.tolist()]
        assert len(links) == len(set(links))
        assert touching <= set(links)
        assert all((gaps[i, j] <= 1e-11).all() for i, j in links)


def test_bounds_err_by_the_square_of_the_size_at_a_pass_on_a_wall():
    wall = Polyhedron(PLANE, {"disc": DISC, "wall": x - y**2 / 3})
    heights = Heights(pose(wall, sympy.exp(x) - y**2 + x * y))
    errors = []
    for size in (0.1, 0.05, 0.025):
        lower, upper = np.array([[-0.4, -0.6]]) * size, np.array([[0.6, 0.4]]) * size
        points = np.random.default_rng(0).uniform(lower, upper, (100_000, 2))
        inside = points[wall.contains(points)]
        least = (np.exp(inside[:, 0]) - inside[:, 1] ** 2 + inside[:, 0] * inside[:, 1]).min()
        found = heights.least(lower, upper)[0][0, 0]
        assert found <= least
        errors.append(least - found)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1.8).all()


def test_a_bound_is_kept_when_it_ends_early():
    problem = pose(Polyhedron(PLANE, {"disc": DISC}), (x**2 - 1) ** 2 + y**2)

    def stop(done, total, note):
        assert total is None
        assert "at least" in note
        if done > 2500:
            raise KeyboardInterrupt

    ends = [-1, 0], [[1, 0]]
    stopped = paved_barrier(problem, BOX, *ends, progress=stop)
    assert stopped.ending is Ending.INTERRUPTED
    short = paved_barrier(problem, BOX, *ends, max_boxes=2500)
    assert short.ending is Ending.BUDGET
    assert short.boxes <= 2500
    whole = paved_barrier(problem, BOX, *ends)
    assert short.lower <= stopped.lower <= whole.lower <= 1
    # The way leads over the pass, and all that is on it is close to the set.
    assert abs(stopped.way).max() < 3.5
    assert abs(stopped.way[:, 0]).min() < 0.1


def test_arguments_are_checked():
    problem = pose(Polyhedron(PLANE, {"disc": DISC}), y)
    ends = [-1, 0], [[1, 0]]
    with pytest.raises(ValueError, match="start: expected a point of the set"):
        paved_barrier(problem, BOX, [5, 0], [[1, 0]])
    with pytest.raises(ValueError, match="start: expected a point of the set in the region"):
        paved_barrier(problem, BOX, [-1, 0], region={"right": x})
    with pytest.raises(ValueError, match="ends: expected 2 finite numbers"):
        paved_barrier(problem, BOX, [-1, 0], [[1, 0, 0]])
    with pytest.raises(ValueError, match="ends: expected an end"):
        paved_barrier(problem, BOX, [-1, 0], walled=True)
    with pytest.raises(ValueError, match="ends: expected a place in the box"):
        paved_barrier(problem, [(-2, 0), (-2, 2)], [-1, 0], [[1, 0]], walled=True)
    with pytest.raises(ValueError, match="two finite numbers for y"):
        paved_barrier(problem, {"x": (-4, 4)}, *ends)
    with pytest.raises(TypeError, match="problem"):
        paved_barrier(problem.polyhedron, BOX, *ends)
    ball = Manifold.sphere("p q r")
    on_sphere = pose(Polyhedron(ball, {"up": ball.symbols[2]}), ball.symbols[0])
    with pytest.raises(ValueError, match="lines and circles"):
        paved_barrier(on_sphere, BOX, [1, 0, 0], [[0, 1, 0]])
