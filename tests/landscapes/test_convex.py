"""Landscapes of unions of flat pieces, against lattices, vertices, grids and cubical complexes."""

import signal
from fractions import Fraction
from itertools import chain, combinations, pairwise, permutations, product
from math import inf, tau

import networkx as nx
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.landscapes import enumeration
from polycorner.landscapes.convex import convex_landscape
from polycorner.minimisation.problem import pose
from polycorner.polyhedra import nerve

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDE = 4


def landscape(parts, energy, box, manifold=PLANE, **options):
    return convex_landscape(pose(Polyhedron(manifold, parts), energy), box=box, **options)


def tree(found):
    """Exact energies of minima and of merges, where they are doubles."""
    assert found.complete
    events = [m.energy for m in found.minima], [m.energy for m in found.merges]
    assert all(low == high for some in events for low, high in some)
    return tuple([low for low, _ in some] for some in events)


def births_and_merges(heights, links):
    """Where components of a graph are born and merge as nodes and links appear, by definition."""
    births, merges, before = [], [], []
    for level in sorted({*heights.values(), *(w for *_, w in links)}):
        graph = nx.Graph()
        graph.add_nodes_from(node for node, w in heights.items() if w <= level)
        graph.add_edges_from((a, b) for a, b, w in links if w <= level)
        now = [frozenset(part) for part in nx.connected_components(graph)]
        for part in now:
            inside = sum(old <= part for old in before)
            births += [level] * (inside == 0)
            merges += [level] * max(inside - 1, 0)
        before = now
    return births, merges


def spanning(heights, links):
    """A spanning forest along which bottlenecks are those of the graph."""
    graph = nx.Graph((p, q, {"weight": w}) for p, q, w in links)
    graph.add_nodes_from(heights)
    return nx.minimum_spanning_tree(graph)


def along(forest, heights, a, b):
    if not nx.has_path(forest, a, b):
        return inf
    way = nx.shortest_path(forest, a, b)
    return max([heights[a], heights[b], *(forest[p][q]["weight"] for p, q in pairwise(way))])


# ------------------------------------------------------------------------------ boxes on a lattice


@st.composite
def boxes_with_energy(draw, dimension, most):
    """Boxes with whole corners, points and segments among them, and the slopes of an energy."""
    corner, size = st.integers(0, SIDE - 1), st.integers(0, 3)
    boxes = [
        [(a := draw(corner), min(a + draw(size), SIDE)) for _ in range(dimension)]
        for _ in range(draw(st.integers(1, most)))
    ]
    return boxes, [draw(st.integers(-3, 3)) for _ in range(dimension)]


def lattice(boxes, slopes):
    """Whole points and unit edges of a union of boxes, with their energies.

    An affine energy on a complex of cubes: its parts below a height have the components of the
    vertices and edges in them.
    """
    heights, links = {}, []
    for q in product(*(range(SIDE + 1) for _ in slopes)):
        at = [box for box in boxes if all(a <= x <= b for x, (a, b) in zip(q, box, strict=True))]
        if at:
            heights[q] = sum(s * x for s, x in zip(slopes, q, strict=True))
        for k, s in enumerate(slopes):
            if any(q[k] < box[k][1] for box in at):
                links.append((q, (*q[:k], q[k] + 1, *q[k + 1 :]), heights[q] + max(s, 0)))
    return heights, links


def united(symbols, boxes):
    def inside(box):
        return [f for x, (a, b) in zip(symbols, box, strict=True) for f in (x - a, b - x)]

    return AnyOf(*(AllOf(*inside(box)) for box in boxes))


def check_passes(found, boxes, heights, links):
    """The sides of each pass are components that reach it from below, and all at its point."""
    for one in found.passes:
        level, place = one.energy[0], tuple(map(int, one.point))
        graph = nx.Graph((a, b) for a, b, w in links if w < level)
        graph.add_nodes_from(q for q, w in heights.items() if w < level)
        parts = list(nx.connected_components(graph))
        reached = [
            next(
                k
                for k, part in enumerate(parts)
                if tuple(map(int, side.route.vertices[-1])) in part
            )
            for side in one.sides
        ]
        assert len(set(reached)) == len(reached) > 1
        around = [  # lower corners of cells at the point
            q
            for q in heights
            if heights[q] < level and max(abs(a - b) for a, b in zip(q, place, strict=True)) <= 1
            if any(
                all(
                    a <= min(x, y) <= max(x, y) <= b
                    for x, y, (a, b) in zip(q, place, box, strict=True)
                )
                for box in boxes
            )
        ]
        assert {k for k, part in enumerate(parts) if part & set(around)} <= set(reached)
        for side in one.sides:
            route = side.route
            assert route.top == route.energies[0] == level
            assert (np.diff(route.energies) <= 0).all()
            np.testing.assert_array_equal(route.vertices[0], one.point)
            np.testing.assert_array_equal(route.vertices[-1], found.minima[side.minimum].point)
            for a, b in pairwise(route.vertices):
                assert any(
                    all(
                        low <= x <= high
                        for q in (a, b)
                        for x, (low, high) in zip(q, box, strict=True)
                    )
                    for box in boxes
                )


@pytest.mark.parametrize("dimension", [2, 3])
def test_unions_of_boxes(dimension):
    """Components and barriers are those of the lattice, ties and pieces without volume too."""
    manifold = Manifold.euclidean([f"x{k}" for k in range(dimension)])

    @given(boxes_with_energy(dimension, 7))
    def check(drawn):
        boxes, slopes = drawn
        energy = sum(s * x for s, x in zip(slopes, manifold.symbols, strict=True))
        parts, side = united(manifold.symbols, boxes), [(-1, SIDE + 1)] * dimension
        found = landscape(parts, sympy.sympify(energy), side, manifold)
        heights, links = lattice(boxes, slopes)
        assert tree(found) == births_and_merges(heights, links)
        places = [tuple(map(int, one.point)) for one in found.minima]
        forest = spanning(heights, links)
        for (i, a), (j, b) in combinations(enumerate(places), 2):
            way, expected = found.barrier(i, j), along(forest, heights, a, b)
            assert way.lower == way.upper == expected
            assert way.proved
            assert expected == inf or way.route.verified
        check_passes(found, boxes, heights, links)

    check()


@given(boxes_with_energy(2, 5), boxes_with_energy(2, 3))
def test_two_unions_at_once(some, others):
    """The intersection of two unions is the union of the intersections."""
    boxes, slopes = some
    common = [
        [(max(a, c), min(b, d)) for (a, b), (c, d) in zip(one, two, strict=True)]
        for one in boxes
        for two in others[0]
    ]
    common = [box for box in common if all(a <= b for a, b in box)]
    parts = AllOf(united((X, Y), boxes), united((X, Y), others[0]))
    found = landscape(parts, slopes[0] * X + slopes[1] * Y, [(0, SIDE), (0, SIDE)])
    assert tree(found) == births_and_merges(*lattice(common, slopes))


# --------------------------------------------------------------------------------- oblique pieces


@st.composite
def wedges(draw, most):
    """Sets of up to three half-planes with small whole coefficients, ``a + b x + c y >= 0``."""
    half = st.tuples(st.integers(-4, 4), st.integers(-3, 3), st.integers(-3, 3))
    half = half.filter(lambda f: f[1] or f[2])
    return draw(st.lists(st.lists(half, min_size=1, max_size=3), min_size=1, max_size=most))


WALLS = [(3, 1, 0), (3, -1, 0), (3, 0, 1), (3, 0, -1)]  # of the square |x|, |y| <= 3


def vertices(functions):
    """All vertices of a polygon: crossings of two lines at which nothing is negative."""
    found = set()
    for (a, b, c), (d, e, f) in combinations(functions, 2):
        if det := b * f - c * e:
            x, y = Fraction(c * d - a * f, det), Fraction(a * e - b * d, det)
            if all(u + v * x + w * y >= 0 for u, v, w in functions):
                found.add((x, y))
    return found


def resolved(unions):
    """The functions of every piece."""
    return [list(chain(*some)) for some in product(*unions)]


def by_vertices(unions, slopes):
    """Births and merges from vertices of all pieces and of all their common parts."""

    def least(*pieces):
        corners = vertices(sorted({*WALLS, *(f for piece in pieces for f in piece)}))
        return min((slopes[0] * x + slopes[1] * y for x, y in corners), default=inf)

    pieces = resolved(unions)
    heights = {k: h for k, one in enumerate(pieces) if (h := least(one)) < inf}
    links = [(j, k, least(pieces[j], pieces[k])) for j, k in combinations(heights, 2)]
    return births_and_merges(heights, [link for link in links if link[2] < inf])


def oblique(unions, slopes):
    halves = {f: f[0] + f[1] * X + f[2] * Y for union in unions for piece in union for f in piece}
    parts = AllOf(*(AnyOf(*(AllOf(*(halves[f] for f in p)) for p in u)) for u in unions))
    return landscape(parts, slopes[0] * X + slopes[1] * Y, [(-3, 3), (-3, 3)])


@given(
    wedges(3),
    wedges(3),
    st.tuples(st.integers(-2, 2), st.integers(-2, 2)),
    st.sampled_from([1, 0.1, 1 / 3]),
)
def test_oblique_pieces_by_their_vertices(one, two, slopes, unit):
    """Doubles are taken for the fractions that they are, however long."""
    unions = [[[tuple(unit * x for x in f) for f in piece] for piece in u] for u in (one, two)]
    exact = [[[tuple(map(Fraction, f)) for f in piece] for piece in u] for u in unions]
    found, (births, merges) = oblique(unions, slopes), by_vertices(exact, slopes)
    for events, expected in ((found.minima, births), (found.merges, merges)):
        assert len(events) == len(expected)
        for event, exact in zip(events, expected, strict=True):
            low, high = event.energy
            assert Fraction(low) <= exact <= Fraction(high)
            assert high <= np.nextafter(low, inf)


def on_a_grid(unions, slopes, widened, step):
    """Points of a grid in the pieces, functions allowed to miss by some of their slopes, and steps.

    Two neighbours in one piece are joined by the segment between them.
    """
    ticks = np.arange(-3, 3 + step / 2, step)
    grid = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1)
    energy = grid @ np.array(slopes, dtype=float)
    inside = [
        np.all([a + grid @ [b, c] >= -widened * (abs(b) + abs(c)) for a, b, c in piece], axis=0)
        for piece in resolved(unions)
    ]
    heights = {q: energy[q] for q in map(tuple, np.argwhere(np.any(inside, axis=0)).tolist())}
    links = []
    for (i, j), (di, dj) in product(heights, ((1, 0), (0, 1), (1, 1), (1, -1))):
        p, q = (i, j), (i + di, j + dj)
        if q in heights and (widened or any(piece[p] and piece[q] for piece in inside)):
            links.append((p, q, max(heights[p], heights[q])))
    return ticks, heights, links


def some_oblique(rng):
    """Two unions of three pieces of two half-planes."""
    slopes = [(b, c) for b, c in product(range(-3, 4), repeat=2) if b or c]
    return [
        [
            [(int(rng.integers(-1, 4)), *rng.choice(slopes).tolist()) for _ in range(2)]
            for _ in "abc"
        ]
        for _ in "ab"
    ]


def test_barriers_between_those_on_two_grids():
    """Grid paths inside pieces bound barriers from above, those of a widened set from below."""
    rng, step, tight = np.random.default_rng(3), 0.15, 0
    for _ in range(12):
        unions, slopes = some_oblique(rng), rng.integers(-2, 3, 2).tolist()
        found = oblique(unions, slopes)
        ticks, heights, links = on_a_grid(unions, slopes, 0.0, step)
        _, wider, farther = on_a_grid(unions, slopes, step / 2, step)
        # A minimum and points of the grid in a piece around it are joined by segments.
        at = {q: (1.0, *ticks[list(q)]) for q in heights}
        for (k, one), piece in product(enumerate(found.minima), map(np.array, resolved(unions))):
            if (piece @ (1.0, *one.point) >= -1e-9).all():
                inside = [q for q in at if (piece @ at[q] >= 0).all()]
                links += [(k, q, max(heights[q], one.energy[1])) for q in inside]
        heights |= {k: one.energy[1] for k, one in enumerate(found.minima)}
        inner, outer = spanning(heights, links), spanning(wider, farther)
        near = [tuple(np.rint((m.point + 3) / step).astype(int).tolist()) for m in found.minima]
        for i, j in combinations(range(len(near)), 2):
            way, most = found.barrier(i, j), along(inner, heights, i, j)
            least = along(outer, wider, near[i], near[j]) - sum(map(abs, slopes)) * step / 2
            assert least - 1e-9 <= way.lower <= way.upper <= most + 1e-9
            tight += most - least < 1
    assert tight > 5


@pytest.mark.parametrize("seed", range(3))
def test_lists_with_proof_say_the_same(seed):
    """Of pieces in general position."""
    rng = np.random.default_rng(seed)
    unions = [
        [[(a + rng.uniform(-0.3, 0.3), b, c) for a, b, c in piece] for piece in union]
        for union in some_oblique(rng)
    ]
    slopes = rng.uniform(-2, 2, 2).tolist()
    found = oblique(unions, slopes)
    listed = enumeration.landscape(
        found.problem.polyhedron, found.problem.energy, box=[(-3, 3), (-3, 3)]
    )
    assert listed.complete
    for some, others in ((found.minima, listed.minima), (found.merges, listed.merges)):
        np.testing.assert_allclose(
            [one.energy for one in some], [one.energy for one in others], atol=1e-9
        )


# ----------------------------------------------------------------------------------- hard squares


def hard_squares(count, width=1, height=1):
    """Squares in a rectangle whose side is a coordinate, by their definition."""
    names = [f"{axis}{k}" for k in range(count) for axis in "xy"]
    manifold = Manifold.euclidean([*names, "s"])
    *places, s = manifold.symbols
    xs, ys = places[::2], places[1::2]
    apart = [
        AnyOf(xs[j] - xs[i] - s, ys[j] - ys[i] - s, xs[i] - xs[j] - s, ys[i] - ys[j] - s)
        for i, j in combinations(range(count), 2)
    ]
    inside = [f for x in xs for f in (x - s / 2, width - s / 2 - x)]
    inside += [f for y in ys for f in (y - s / 2, height - s / 2 - y)]
    box = [(0, width), (0, height)] * count + [(0.01, max(width, height))]
    return Polyhedron(manifold, AllOf(*apart, *inside)), -s, box


def fifteen(count, width, height):
    """Components of the placements of unit squares in a rectangle of whole sides.

    They are those of a complex of cubes whose vertices are squares in cells, and whose edges move
    one square to an empty cell beside it ([ABKMS] sec. 3).
    """
    cells = list(product(range(width), range(height)))
    graph = nx.Graph()
    for places in permutations(cells, count):
        graph.add_node(places)
        for k, (x, y) in enumerate(places):
            for cell in ((x + 1, y), (x, y + 1)):
                if cell in cells and cell not in places:
                    graph.add_edge(places, (*places[:k], cell, *places[k + 1 :]))
    return nx.number_connected_components(graph)


@pytest.mark.parametrize(
    ("count", "width", "height"), [(2, 1, 2), (2, 2, 2), (3, 2, 2), (3, 2, 3), (4, 2, 2), (3, 3, 3)]
)
def test_hard_squares_as_the_cubical_complex_says(count, width, height):
    d, energy, box = hard_squares(count, width, height)
    found = convex_landscape(pose(d, energy), box=box, cap=-1)
    higher = sum(-1 < one.energy[0] for one in found.minima + found.merges)
    assert found.complete
    assert higher == 0
    assert len(found.minima) - len(found.merges) == fifteen(count, width, height)


def test_hard_squares_by_their_nerve():
    d, energy, box = hard_squares(2)
    found = convex_landscape(pose(d, energy), box=box)
    s = d.manifold.symbols[-1]
    bars = [bar for bar in nerve(d, s).bars if bar.dimension == 0]
    sizes = [-one.energy[0] for one in found.minima], [-one.energy[0] for one in found.merges]
    np.testing.assert_allclose(sizes[0], [bar.birth for bar in bars], atol=1e-9)
    ends = sorted((bar.death for bar in bars if bar.death > -inf), reverse=True)
    np.testing.assert_allclose(sizes[1], ends, atol=1e-9)


def test_routes_of_hard_squares():
    """Three squares leave their cyclic order at a third of the width, and move without overlap."""
    d, energy, box = hard_squares(3)
    found = convex_landscape(pose(d, energy), box=box)
    way = found.barrier(0, 1)
    assert -1 / 3 <= way.upper == np.nextafter(way.lower, 0)
    for a, b in pairwise(way.route.vertices):
        between = a + np.linspace(0, 1, 11)[:, None] * (b - a)
        assert d.contains(between, tolerance=1e-14).all()
        assert (-between[:, -1] <= way.upper).all()


# --------------------------------------------------------------------------------- special cases


def test_pieces_that_are_points_and_meet_in_points():
    corner = AllOf(X, Y, -X, -Y)
    found = landscape(corner, Y, [(-1, 1), (-1, 1)])
    assert tree(found) == ([0.0], [])
    assert found.minima[0].kind == "isolated"
    assert set(found.minima[0].active) == {"f1", "f2", "f3", "f4"}
    # Two cones that meet in their tops, and a third one beside them.
    cones = AnyOf(AllOf(Y + X, Y - X), AllOf(-Y - X, X - Y), AllOf(X - Y, X + Y, X - 1))
    found = landscape(cones, Y, [(-2, 2), (-2, 2)])
    assert tree(found) == ([-2.0], [])
    assert found.minima[0].kind == "locus"
    found = landscape(cones, X, [(-2, 2), (-2, 2)])
    assert tree(found) == ([-2.0, -2.0], [0.0])
    (top,) = found.passes
    assert top.point.tolist() == [0.0, 0.0]
    assert len(top.sides) == 2
    assert set(top.active) == {"f1", "f2", "f3", "f4"}
    assert (top.kind, top.index) == ("tip", 0)


def test_three_components_at_one_point():
    thirds = AnyOf(AllOf(Y - 2 * X, -Y), AllOf(Y - X, Y - 2 * X, X), AllOf(Y + 2 * X, -X, -Y))
    star = AnyOf(AllOf(X + Y, -X - Y, X), AllOf(X - Y, Y - X, X), AllOf(X + 3 * Y, -X - 3 * Y, X))
    found = landscape(star, -X, [(-1, 1), (-1, 1)])
    assert tree(found) == ([-1.0] * 3, [0.0] * 2)
    assert [len(one.sides) for one in found.passes] == [3]
    assert landscape(thirds, Y, [(-1, 1), (-1, 1)]).complete


def test_repeated_pieces_and_repeated_functions():
    twice = AnyOf(AllOf(X, 1 - X, Y), AllOf(1 - X, X, Y), AllOf(2 * X, 2 - 2 * X, 3 * Y))
    assert tree(landscape(twice, Y, [(-2, 2), (-2, 2)])) == ([0.0], [])


def test_nothing_is_left():
    found = landscape(AnyOf(AllOf(X - 1, -X), AllOf(X - 5, Y)), Y, [(-2, 2), (-2, 2)])
    assert tree(found) == ([], [])
    assert tree(landscape([X], Y, [(-2, -1), (0, 1)])) == ([], [])


def test_sides_of_the_box_cut_what_is_unbounded():
    assert tree(landscape(AnyOf(X - 1, -1 - X), Y, [(-4, 4), (-4, 4)])) == ([-4.0, -4.0], [])
    assert tree(landscape([X], Y, {"y": (-4, 4), "x": (-1, 8)})) == ([-4.0], [])
    flat = landscape(AnyOf(X - 1, -1 - X), X, {"x": (-2, 2), "y": 1})
    assert [one.kind for one in flat.minima] == ["isolated", "isolated"]


def test_a_constant_energy():
    found = landscape(AnyOf(X - 1, -1 - X), sympy.Integer(3), [(-4, 4), (-4, 4)])
    assert tree(found) == ([3.0, 3.0], [])
    assert [one.kind for one in found.minima] == ["locus", "locus"]


def test_equations_hold():
    ring = AnyOf(X - 1, -1 - X, Y - 1, -1 - Y)
    d = Polyhedron(PLANE, ring, [X - Y])
    assert tree(convex_landscape(pose(d, X), box=[(-2, 2), (-2, 2)])) == ([-2.0, 1.0], [])


def test_a_cap():
    stairs = AnyOf(AllOf(X, 1 - X), AllOf(X - 2, 3 - X), Y - 2)
    box = [(0, 3), (0, 3)]
    assert tree(landscape(stairs, Y, box)) == ([0.0, 0.0], [2.0])
    low = landscape(stairs, Y, box, cap=1.5)
    assert tree(low) == ([0.0, 0.0], [])
    way = low.barrier(0, 1)
    assert (way.lower, way.upper) == (1.5, inf)
    assert tree(landscape(stairs, Y, box, cap=2)) == ([0.0, 0.0], [2.0])


def test_numbers_that_are_no_doubles():
    """Bounds of energies are the doubles about fractions; doubles are the fractions they are."""
    third = sympy.Rational(1, 3)
    found = landscape(AnyOf(AllOf(X, third - X), X - 2 * third), X / 7, [(0, 1), (0, 1)])
    low, high = found.minima[1].energy
    assert Fraction(low) < Fraction(2, 21) < Fraction(high) == Fraction(np.nextafter(low, 1))
    found = landscape([X - 0.1 - Y], X, [(0, 1), (0.2, 1)])
    assert Fraction(found.minima[0].energy[0]) <= Fraction(0.1) + Fraction(0.2)
    assert Fraction(found.minima[0].energy[1]) >= Fraction(0.1) + Fraction(0.2)


def test_what_is_not_of_this_kind():
    box = [(-1, 1), (-1, 1)]
    assert landscape([X - Y**2], Y, box) is None
    assert landscape([X], Y**2, box) is None
    assert landscape([X - sympy.sqrt(2) * Y], Y, box) is None
    assert landscape([sympy.sqrt(2) ** 2 - X], Y, box) is not None
    turning = Manifold(("z", "t"), (inf, tau))
    z = turning.symbols[0]
    assert landscape([z], z, [(-1, 1), None], turning) is None


@pytest.mark.parametrize("box", [[(0, 1)], [(0, 1), None], [(0, 1), (0, inf)], {"u": (0, 1)}])
def test_a_box_has_finite_sides(box):
    with pytest.raises(ValueError, match=r"^box.*: .*got"):
        landscape([X], Y, box)


@given(boxes_with_energy(2, 6), boxes_with_energy(2, 4), st.integers(1, 40))
def test_what_is_known_when_a_search_ends_early(some, others, most):
    """All that is below the cap to which it came, and nothing above."""
    parts = AllOf(united((X, Y), some[0]), united((X, Y), others[0]))
    energy, box = some[1][0] * X + some[1][1] * Y, [(0, SIDE), (0, SIDE)]
    whole = tree(landscape(parts, energy, box))
    found = landscape(parts, energy, box, max_pieces=most)
    assert tree(found) == tuple([w for w in events if w < found.cap] for events in whole)
    assert bool(found.notes) == (found.cap < inf)
    for i, j in combinations(range(len(found.minima)), 2):
        assert found.barrier(i, j).lower <= found.cap


def test_ctrl_c_ends_a_search():
    def interrupt(*_):
        signal.raise_signal(signal.SIGINT)

    stairs = AnyOf(AllOf(X, 1 - X), AllOf(X - 2, 3 - X, Y - 1), Y - 2)
    found = landscape(stairs, Y, [(0, 3), (0, 3)], progress=interrupt)
    assert tree(found) == ([], [])
    assert found.cap == 0.0


def test_progress_is_told():
    told = []
    landscape(AnyOf(X, -X), Y, [(0, 1), (0, 1)], progress=lambda *report: told.append(report))
    assert [done for done, *_ in told] == [2.0, 3.0]
