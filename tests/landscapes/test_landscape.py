"""Landscapes whose minima, passes and barriers are known by hand."""

from collections.abc import Callable
from heapq import heappop, heappush
from itertools import pairwise
from math import inf

import numpy as np
import pytest
import sympy
from numpy.typing import NDArray
from scipy.ndimage import label

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry
from polycorner.landscapes import Barrier, Landscape, landscape
from polycorner.landscapes.components import components
from polycorner.minimisation.problem import pose
from polycorner.polyhedra import Element
from polycorner.proofs.lists.domains import domain

M = Manifold.euclidean("x y")
X, Y = M.symbols
DISC = Polyhedron(M, {"disc": 9 - X**2 - Y**2})
WELLS = (X**2 - 1) ** 2 + Y**2  # minima 0 at (-1, 0) and (1, 0), a saddle 1 at (0, 0)
SQUARE = [(-4, 4), (-4, 4)]
SPACE = Manifold.euclidean("x y z")


def half(number: int, of: int = 2) -> sympy.Rational:
    """Return an exact fraction."""
    return sympy.Rational(number, of)


def encloses(barrier: Barrier, value: float) -> bool:
    """Whether the bounds of a barrier hold, and agree as far as rounding goes."""
    return barrier.lower <= value <= barrier.upper <= barrier.lower + 1e-9


def is_a_way(found: Landscape, barrier: Barrier) -> bool:
    """Whether the points between the vertices of a route are in the set and below its top."""
    assert barrier.route is not None
    assert barrier.route.verified
    q = barrier.route.vertices
    d, energy = found.problem.polyhedron, found.problem.energy
    # With equations the way is beside the straight pieces, but at the vertices.
    count = 2 if d.equations else 41
    steps = [a + np.linspace(0, 1, count)[:, None] * (b - a) for a, b in pairwise(q)]
    points = np.concatenate(steps)
    inside = np.asarray(d.implicit(points)) >= -1e-9
    for h in d.equations:
        inside &= abs(np.asarray(h.value(points))) < 1e-9
    below = np.asarray(energy.value(points)) <= barrier.upper + 1e-9
    ends = found.minima[barrier.start].point, found.minima[barrier.end].point
    apart = [d.manifold.difference(p, q[k]) for p, k in zip(ends, (0, -1), strict=True)]
    return bool(inside.all() and below.all() and abs(np.array(apart)).max() < 1e-6)


def test_two_wells() -> None:
    """The saddle between two wells is the origin, where the energy is 1."""
    found = landscape(DISC, WELLS, box=SQUARE)
    assert found.complete
    assert len(found.minima) == 2
    assert len(found.passes) == 1
    assert encloses(found.barrier(0, 1), 1.0)
    assert is_a_way(found, found.barrier(0, 1))
    assert found.merges[0].number == 0
    assert not found.loops
    # Of equal depth: either is joined to one not higher at the saddle.
    assert all(low <= 1.0 <= high for low, high in map(found.depth, (0, 1)))


def test_symmetry_carries_a_pass_to_itself() -> None:
    """With the mirror image of one well as the other the list is the same."""
    mirror = Element(lambda q: np.stack([-q[..., 0], q[..., 1]], axis=-1), {})
    found = landscape(DISC, WELLS, box=SQUARE, symmetry=Symmetry(elements=[mirror]))
    assert found.complete
    assert len(found.minima) == 2
    assert len(found.passes) == 1
    assert found.minima[0].orbit == found.minima[1].orbit
    assert {side.minimum for side in found.passes[0].sides} == {0, 1}
    assert encloses(found.barrier(0, 1), 1.0)
    assert is_a_way(found, found.barrier(1, 0))


def test_tip_of_three_parts() -> None:
    """Where two of three coordinates are not negative, three octants' unions meet at a point.

    The energy rises along all coordinates: below the origin the parts are apart.
    """
    x, y, z = SPACE.symbols
    two = AnyOf(AllOf(x, y), AllOf(y, z), AllOf(x, z))
    ball = Polyhedron(SPACE, [two, 4 - x**2 - y**2 - z**2])
    found = landscape(ball, x + y * half(11, 10) + z * half(12, 10), box=[(-3, 3)] * 3)
    # At the poles of the ball, along the axis on which a part goes down.
    assert [round(m.energy[0], 9) for m in found.minima] == [-2.4, -2.2, -2.0]
    assert found.complete
    assert [p.kind for p in found.passes] == ["tip"]
    assert sorted(s.minimum for s in found.passes[0].sides if s.minimum is not None) == [0, 1, 2]
    assert len(found.merges) == 2
    assert not found.loops
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert encloses(found.barrier(a, b), 0.0)
        assert is_a_way(found, found.barrier(a, b))


def test_shared_and_repeated_functions() -> None:
    """Positive multiples and functions in several parts change nothing.

    Above both lines the wedge ``y >= |x|`` is closed, its outside is open: ``y >= x or y >= -x``
    has the tip 0 where the two sides of a disc are joined.
    """
    once = Polyhedron(M, [AnyOf(Y - X, Y + X), 4 - X**2 - Y**2])
    twice = Polyhedron(
        M, [AnyOf(Y - X, Y + X), AnyOf(2 * Y - 2 * X, 3 * Y + 3 * X), 4 - X**2 - Y**2]
    )
    for d in (once, twice):
        found = landscape(d, Y, box=[(-3, 3)] * 2)
        assert found.complete
        assert len(found.minima) == 2
        assert [p.kind for p in found.passes] == ["tip"]
        assert encloses(found.barrier(0, 1), 0.0)
        # On the circle of radius 2, at 45 degrees.
        assert all(abs(m.energy[0] + 2**0.5) < 1e-12 for m in found.minima)


def test_route_around_a_circle() -> None:
    """A wall at 0 leaves the way through the seam of a circle, at pi."""
    manifold = Manifold(("a", "h"), (2 * np.pi, inf))
    a, h = manifold.symbols
    d = Polyhedron(manifold, [half(1) - sympy.cos(a), 1 - h**2])
    found = landscape(d, sympy.cos(2 * a) + h**2, box=[None, (-2, 2)])
    assert found.complete
    way = found.barrier(0, 1)
    assert encloses(way, 1.0)
    assert is_a_way(found, way)
    assert way.route is not None
    assert abs(np.diff(way.route.vertices[:, 0])).max() < 2.0  # no turn back around the circle
    assert abs(way.route.vertices[-1, 0] - way.route.vertices[0, 0]) == pytest.approx(np.pi)


def test_equations() -> None:
    """On the unit circle ``-x^2`` has two minima, and two passes, one of which is cut off."""
    for lowest, count in ((-2, 2), (half(-1), 1)):
        ring = Polyhedron(M, [Y - lowest], equations=[X**2 + Y**2 - 1])
        found = landscape(ring, Y / 10 - X**2, box=[(-2, 2)] * 2)
        assert found.complete
        assert len(found.minima) == 2
        assert len(found.passes) == count
        # By hand: y = -1/20 at the minima; the passes are (0, 1) and (0, -1), with 1/10 and -1/10.
        assert all(m.energy[0] <= -1.0025 <= m.energy[1] + 1e-15 for m in found.minima)
        assert encloses(found.barrier(0, 1), -0.1 if count == 2 else 0.1)
        assert is_a_way(found, found.barrier(0, 1))
        assert len(found.loops) == count - 1


def test_a_sphere() -> None:
    """A quadratic form on the unit sphere, and a nearly linear energy where a quarter is cut out.

    Of ``x^2 + 2 y^2 + 3 z^2`` the minima are 1, at ``+-e_x``, the saddles 2, at ``+-e_y``: one
    joins, the other is a loop.  Where ``x < 0`` and ``y < 0`` are cut out together the two walls
    end in tips at the poles.
    """
    x, y, z = SPACE.symbols
    sphere = [x**2 + y**2 + z**2 - 1]
    found = landscape(
        Polyhedron(SPACE, [], equations=sphere), x**2 + 2 * y**2 + 3 * z**2, box=[(-2, 2)] * 3
    )
    assert found.complete
    assert len(found.minima) == 2
    assert len(found.passes) == 2
    assert len(found.loops) == 1
    assert encloses(found.barrier(0, 1), 2.0)
    cut = Polyhedron(SPACE, [AnyOf(x, y)], equations=sphere)
    found = landscape(cut, x + y + z / 10, box=[(-2, 2)] * 3)
    assert found.complete
    assert len(found.minima) == 2
    assert [p.kind for p in found.passes] == ["tip", "tip"]
    assert len(found.loops) == 1
    assert encloses(found.barrier(0, 1), -0.1)
    assert is_a_way(found, found.barrier(0, 1))


def test_sides_of_a_box_are_walls() -> None:
    """On an arc of a circle minima at its ends are held by the sides of the box."""
    manifold = Manifold(("a", "h"), (2 * np.pi, inf))
    a, h = manifold.symbols
    found = landscape(
        Polyhedron(manifold, [1 - h**2]), sympy.cos(2 * a) + h**2, box=[(-1, 1), (-2, 2)]
    )
    assert found.complete
    assert len(found.minima) == 2
    assert found.notes
    assert encloses(found.barrier(0, 1), 1.0)
    assert all(m.energy[0] <= np.cos(2) + 1e-15 <= m.energy[1] + 1e-14 for m in found.minima)


@pytest.mark.parametrize(("side", "least"), [(1, 0.0), (0, inf)])
def test_what_is_declined_bounds_from_below(side: int, least: float) -> None:
    """A side of the box through a minimum, or a saddle, has a multiplier 0: all is joined there.

    What may be hidden at the height of the saddle is not lower than the minimum.
    """
    found = landscape(DISC, WELLS, box=[(-2, side), (-3, 3)])
    assert not found.complete
    assert any(p.kind == "undecided" for p in found.passes)
    assert all(found.depth(k)[0] == least for k in range(len(found.minima)))


# ------------------------------------------------------------------------------------------- loci


def test_lanes() -> None:
    """Two lanes whose gap is narrow are two components, with two minima each."""
    lanes = AnyOf(Y - half(301, 1000), half(299, 1000) - Y)
    d = Polyhedron(M, [lanes, 1 - Y**2, 4 - X**2])
    found = landscape(d, (X**2 - 1) ** 2, box=[(-3, 3), (-2, 2)])
    assert found.complete
    assert len(found.minima) == 4
    assert len(found.passes) == 2
    upper = [k for k, m in enumerate(found.minima) if m.point[1] > 0.3]
    lower = [k for k in range(4) if k not in upper]
    assert len(upper) == 2
    assert encloses(found.barrier(*upper), 1.0)
    assert encloses(found.barrier(*lower), 1.0)
    assert found.barrier(upper[0], lower[0]).lower == inf


def test_a_route_goes_around_a_hole() -> None:
    """Two passes on opposite sides of a ring: the route between them goes around along the locus.

    ``E`` depends on ``x`` alone; its maxima between 0 and 2, where ``x^2 = 4/3``, are 256/27.
    """
    x, y, z = SPACE.symbols
    gates = [
        AnyOf(y - half(6, 5), x + half(4, 5), -half(13, 10) - x),
        AnyOf(-y - half(6, 5), half(4, 5) - x, x - half(13, 10)),
    ]
    ring = [4 - y**2 - z**2, y**2 + z**2 - 1, half(25, 4) - x**2]
    found = landscape(Polyhedron(SPACE, [*ring, *gates]), x**2 * (x**2 - 4) ** 2, box=[(-3, 3)] * 3)
    assert found.complete
    assert len(found.minima) == 3
    assert len(found.passes) == 2
    outer = [k for k, m in enumerate(found.minima) if abs(m.point[0]) > 1]
    assert encloses(found.barrier(*outer), 256 / 27)
    assert is_a_way(found, found.barrier(*outer))


def test_a_constant_energy() -> None:
    """Each component of the set is a minimum."""
    two = Polyhedron(M, [AnyOf(1 - X**2 - Y**2, 1 - (X - 3) ** 2 - Y**2)])
    one = Polyhedron(M, [AnyOf(1 - X**2 - Y**2, 1 - (X - half(19, 10)) ** 2 - Y**2)])
    for d, count in ((two, 2), (one, 1)):
        found = landscape(d, sympy.Integer(0), box=[(-2, 5), (-2, 2)])
        assert len(found.minima) == count
        assert not found.passes
        assert found.complete


def test_an_empty_set() -> None:
    """Nothing is found, with proof."""
    found = landscape(Polyhedron(M, [-1 - X**2 - Y**2]), X, box=SQUARE)
    assert found.complete
    assert not found.minima
    assert not found.passes


TORUS = Manifold(("a", "b"), (2 * np.pi, 2 * np.pi))
A, B = TORUS.symbols


@pytest.mark.parametrize(
    ("parts", "count"),
    [
        # Bands along lines whose direction is (p, q) turns: as many as their common divisor.
        ([sympy.cos(2 * A + B) - half(3, 10)], 1),
        ([sympy.cos(2 * A + 2 * B) - half(3, 10)], 2),
        ([sympy.cos(3 * A) - half(3, 10)], 3),
        ([sympy.cos(A) + sympy.cos(B) - half(1, 5)], 1),
        ([sympy.cos(A) * sympy.cos(B) - half(1, 5)], 2),
        ([AnyOf(sympy.cos(A) - half(9, 10), sympy.cos(B) - half(9, 10))], 1),
        ([AnyOf(sympy.cos(2 * A) - half(9, 10), -sympy.cos(2 * A) - half(9, 10))], 4),
    ],
)
def test_components(parts: list[object], count: int) -> None:
    """Numbers of components on a torus, known and from a grid."""
    problem = pose(Polyhedron(TORUS, parts), A * 0)
    box = domain(TORUS, [None, None])
    found = components(problem, box, [], box.lower, box.upper)
    assert not found.open
    assert len(found.parts) == count
    side = np.linspace(-np.pi, np.pi, 240, endpoint=False)
    inside = np.asarray(problem.polyhedron.implicit(np.array(np.meshgrid(side, side)).T)) >= 0
    # Classes of a square that is no torus: those across its sides are one.
    labels = label(np.tile(inside, (2, 2)))[0]
    root = {k: k for k in range(1, int(labels.max()) + 1)}
    for left, right in ((labels[:240], labels[240:]), (labels[:, :240], labels[:, 240:])):
        for i, j in {*zip(left[left > 0].tolist(), right[left > 0].tolist(), strict=True)}:
            old, new = root[i], root[j]
            root = {k: new if r == old else r for k, r in root.items()}
    assert len(set(root.values())) == count
    for part in found.parts:
        start = part.sample + np.array([0.3, 0.2])
        way = part.way(start)
        assert abs(np.asarray(TORUS.difference(way[-1], part.sample))).max() < 1e-9
        points = np.concatenate(
            [p + np.linspace(0, 1, 9)[:, None] * (q - p) for p, q in pairwise(way)]
        )
        assert (np.asarray(problem.polyhedron.implicit(points)) >= -1e-12).all()


def test_components_that_touch_are_open() -> None:
    """At a point where two meet there is no direction for both, so that nothing is decided."""
    problem = pose(Polyhedron(M, [X**2 - Y**2, 1 - X**2]), X * 0)
    box = domain(M, [(-2, 2), (-2, 2)])
    assert components(problem, box, [], box.lower, box.upper).open


# ---------------------------------------------------------------------------------------- regions


def test_two_ways_out_do_not_meet() -> None:
    """Minima that are joined to the outside below the saddle are not joined with each other.

    ``(s - 1)^2 (9 - 4 s)`` with ``s = x^2`` has its maximum 125/108 at ``s = 11/6``; the barrier
    between the wells is 9, at ``x = 0``.
    """
    energy = (X**2 - 1) ** 2 * (9 - 4 * X**2) + Y**2
    walls = {"left": X + half(7, 5), "right": half(7, 5) - X}
    found = landscape(DISC, energy, box=[(-1.45, 1.45), (-1, 1)], region=walls)
    assert found.complete
    assert len(found.minima) == 2
    assert encloses(found.barrier(0, 1), 9.0)
    assert is_a_way(found, found.barrier(0, 1))
    for k in (0, 1):
        assert encloses(found.escape(k), 125 / 108)
        assert found.depth(k)[0] > 8.9
    assert len(found.merges) == 1


def test_exits_where_the_energy_falls_inwards() -> None:
    """On a wall across a bowl the lowest point is the way out; without a way it is a cage."""
    found = landscape(DISC, X**2 + Y**2, box=SQUARE, region={"right": 1 - X})
    assert found.complete
    assert encloses(found.escape(0), 1.0)
    assert found.passes[0].kind == "exit"
    beyond = landscape(DISC, X**2 + Y**2, box=SQUARE, region={"right": 4 - X})
    assert beyond.complete
    assert beyond.escape(0).lower == beyond.escape(0).upper == inf


def test_regions_are_intersections() -> None:
    """Unions are refused, and so is what the set has already, or a multiple of it."""
    with pytest.raises(ValueError, match="region: expected inequalities that all hold"):
        landscape(DISC, X**2 + Y**2, box=SQUARE, region=[AnyOf(1 - X, 1 - Y)])
    with pytest.raises(ValueError, match="region: expected"):
        landscape(DISC, X**2 + Y**2, box=SQUARE, region=[DISC.functions[0]])
    with pytest.raises(ValueError, match="region: expected"):
        landscape(DISC, X**2 + Y**2, box=SQUARE, region=[18 - 2 * X**2 - 2 * Y**2])
    with pytest.raises(ValueError, match="region: expected inequalities of coordinates; got 0"):
        landscape(DISC, X**2 + Y**2, box=SQUARE, region=0)


def test_regions_on_circles_are_periodic() -> None:
    """``1 - a`` jumps at the seam of a circle, where the region would be left unseen."""
    manifold = Manifold(("a", "h"), (2 * np.pi, inf))
    a, h = manifold.symbols
    strip, energy = Polyhedron(manifold, [1 - h**2]), sympy.sin(a) + h**2
    with pytest.raises(ValueError, match="expected a function with the period"):
        landscape(strip, energy, box=[None, (-2, 2)], region=[1 - a])
    # The half circle ends at -1 - pi/2 and pi/2 - 1, where the energy is -cos 1 and cos 1.
    half_circle = landscape(strip, energy, box=[None, (-2, 2)], region=[sympy.cos(a + 1)])
    assert encloses(half_circle.escape(0), -np.cos(1.0))


# ----------------------------------------------------------------------------- what is not decided


def test_an_interrupted_search_bounds_from_below() -> None:
    """After any number of boxes lower bounds hold, and depths admit minima not yet found."""
    energy = WELLS + X / 10
    whole = landscape(DISC, energy, box=SQUARE)
    truth = [whole.barrier(0, 1), whole.depth(1)]
    for most in (1, 10, 40, 100, 300):
        found = landscape(DISC, energy, box=SQUARE, max_boxes=most)
        assert not found.complete or most > 100
        for k, m in enumerate(found.minima):
            if m.point[0] > 0:
                assert found.depth(k)[0] <= truth[1][1]
            elif not found.complete:
                assert found.depth(k)[0] < inf
        if len(found.minima) == 2:
            assert found.barrier(0, 1).lower <= truth[0].upper


def test_a_lower_minimum_that_is_not_smooth() -> None:
    """It is in an undecided box, as low as that: the other one is no lowest minimum for sure."""
    energy = WELLS + 2 * abs(X - 1) - X
    with pytest.warns(UserWarning, match="may jump"):
        found = landscape(DISC, energy, box=SQUARE, max_boxes=1500)
    assert not found.complete
    assert all(found.depth(k)[0] < inf for k in range(len(found.minima)))


@pytest.mark.parametrize(("cap", "minima"), [(0.5, 2), (0.0, 1), (-1.0, 0)])
def test_cap(cap: float, minima: int) -> None:
    """Nothing above the cap is told, and barriers are at least the cap."""
    found = landscape(DISC, WELLS + X / 10, box=SQUARE, cap=cap)
    # The minima are near -1/10 and 1/10, the pass near 1.
    assert found.complete
    assert len(found.minima) == minima
    assert not found.passes
    if minima == 2:
        assert found.barrier(0, 1).lower == cap
        assert found.barrier(0, 1).upper == inf


def test_a_section_is_named() -> None:
    """Where orbits meet a section twice, points of one orbit are told apart, and a note says so."""
    d = Polyhedron(TORUS, [2 + sympy.cos(A - 2 * B)])
    found = landscape(d, sympy.cos(A - 2 * B), box={"a": 0.0})
    assert len(found.minima) == 2
    assert any("a = 0" in note for note in found.notes)


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ({"cap": float("nan")}, "cap: expected"),
        ({"cap": "high"}, "cap: expected"),
        ({"region": "x"}, "expected"),
        ({"region": {"disc": 1 - X}}, "distinct names"),
        ({"symmetry": 3}, "symmetry: expected a Symmetry"),
        ({"box": [(0, 1)]}, "box: expected"),
        ({"box": [(1, 0), (0, 1)]}, "box"),
        ({"resolution": 0}, "resolution: expected"),
        ({"max_boxes": 0}, "max_boxes: expected"),
        ({"max_seconds": -1}, "max_seconds: expected"),
        ({"workers": 0}, "workers: expected"),
        ({"progress": 3}, "progress: expected"),
    ],
)
def test_wrong_arguments(wrong: dict[str, object], match: str) -> None:
    """One sentence names the argument, what was expected and what came."""
    given: dict[str, object] = {"box": SQUARE, **wrong}
    call: Callable[..., Landscape] = landscape
    with pytest.raises((TypeError, ValueError), match=match):
        call(DISC, WELLS, **given)


# ------------------------------------------------------------------------------------ flood fill

GRID = np.linspace(-2.05, 2.05, 240)


def flooded(heights: NDArray[np.float64], start: tuple[int, int]) -> NDArray[np.float64]:
    """Return the least height of a way of cells that share sides, from one to every other one."""
    least = np.full(heights.shape, inf)
    least[start] = heights[start]
    waiting = [(heights[start], start)]
    while waiting:
        height, (i, j) = heappop(waiting)
        for there in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
            if max(there) < len(heights) and min(there) >= 0:
                new = max(height, heights[there])
                if new < least[there]:
                    least[there] = new
                    heappush(waiting, (new, there))
    return least


def obstacles(rng: np.random.Generator) -> tuple[Polyhedron, sympy.Expr]:
    """Return a disc without some triangles and discs, and an energy with some wells."""

    def exact(value: float) -> sympy.Rational:
        return sympy.Rational(round(1000 * float(value)), 1000)

    parts: list[object] = [4 - X**2 - Y**2]
    energy = exact(rng.uniform(-0.3, 0.3)) * Y + exact(rng.uniform(0, 0.3)) * X
    for _ in range(3):
        x, y = (exact(v) for v in rng.uniform(-1.3, 1.3, 2))
        width, depth = exact(rng.uniform(2, 5)), exact(rng.uniform(0.5, 1.5))
        energy -= depth * sympy.exp(-width * ((X - x) ** 2 + (Y - y) ** 2) / 2)
        u, v = X - exact(rng.uniform(-1, 1)), Y - exact(rng.uniform(-1, 1))
        r, turn = exact(rng.uniform(0.2, 0.45)), rng.uniform(0, 7)
        turns = [(exact(np.cos(turn + k)), exact(np.sin(turn + k))) for k in (0, 2.0944, 4.1888)]
        corner = AnyOf(*[c * u + s * v - r / 2 for c, s in turns])
        parts.append(corner if rng.random() < 0.6 else u**2 + v**2 - r**2)
    return Polyhedron(M, parts), energy


@pytest.mark.parametrize("seed", range(6))
def test_flood_fill(seed: int) -> None:
    """Barriers among obstacles are those of a grid, as far as its cells can tell."""
    d, energy = obstacles(np.random.default_rng(seed))
    found = landscape(d, energy, box=[(-2.2, 2.2)] * 2)
    assert found.complete
    assert len(found.minima) > 1
    points = np.stack(np.meshgrid(GRID, GRID, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = np.asarray(d.implicit(points)) >= 0
    heights = np.where(inside, found.problem.energy.value(points), inf)
    side = len(GRID)
    cells = []
    for m in found.minima:
        near = np.flatnonzero(
            inside & (abs(points - m.point).max(axis=1) < 3 * (GRID[1] - GRID[0]))
        )
        best = near[abs(heights[near] - m.energy[0]).argmin()]
        cells.append(divmod(int(best), side))
    room = 0.05  # what cells are too coarse for
    for a, cell in enumerate(cells):
        least = flooded(heights.reshape(side, side), cell)
        for b in range(a):
            barrier, grid = found.barrier(a, b), float(least[cells[b]])
            assert barrier.upper - barrier.lower < 1e-9
            assert barrier.lower <= grid + room
            deep = grid - max(found.minima[k].energy[1] for k in (a, b)) > room
            assert not deep or grid == inf or grid - room <= barrier.upper


@pytest.mark.parametrize("seed", [2, 4, 13])
def test_flat_landscapes_in_two_ways(seed: int) -> None:
    """By linear programmes, and by the list of critical points: passes that merge are the same.

    Declaring a symmetry, though without elements, takes the second way.
    """
    rng = np.random.default_rng(seed)

    def exact(value: float) -> sympy.Rational:
        return sympy.Rational(round(1000 * float(value)), 1000)

    parts = []
    for _ in range(4):
        x, y, turn = *rng.uniform(-1, 1, 2), rng.uniform(0, 7)
        u, v = X - exact(x), Y - exact(y)
        turns = [(exact(np.cos(turn + k)), exact(np.sin(turn + k))) for k in (0, 1.9, 4.3)]
        parts.append(AnyOf(*[c * u + s * v - exact(rng.uniform(0.2, 0.4)) for c, s in turns]))
    d, energy = Polyhedron(M, parts), exact(rng.uniform(0.3, 1)) * X + Y
    flat = landscape(d, energy, box=[(-2, 2)] * 2)
    listed = landscape(d, energy, box=[(-2, 2)] * 2, symmetry=Symmetry())
    assert flat.complete
    assert listed.complete
    assert len(flat.minima) == len(listed.minima) > 1
    order = [
        min(range(len(listed.minima)), key=lambda k: abs(listed.minima[k].point - m.point).max())
        for m in flat.minima
    ]
    assert sorted(order) == list(range(len(order)))
    for a in range(len(order)):
        for b in range(a):
            one, other = flat.barrier(a, b), listed.barrier(order[a], order[b])
            assert one.lower <= other.upper
            assert other.lower <= one.upper
