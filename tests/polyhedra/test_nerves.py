"""Nerves of unions of flat pieces, against cubical complexes of the same sets."""

import functools
import math
from itertools import combinations, product

import flint
import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Symmetry
from polycorner.polyhedra import Bar, Element, nerve

SIDE = 4  # of the region that pieces are boxes in


def cubes(lows, highs):
    """The cells of the union of boxes with whole corners, as sets of half-integer centres."""
    ranges = [
        [range(2 * a, 2 * b + 1) for a, b in zip(low, high, strict=True)]
        for low, high in zip(lows, highs, strict=True)
    ]
    return {cell for some in ranges for cell in product(*some)}


def betti(cells):
    """Betti numbers modulo 2 of a cubical complex, by ranks of its boundaries."""
    by_dimension = {}
    for cell in sorted(cells):
        by_dimension.setdefault(sum(c % 2 for c in cell), []).append(cell)
    ranks = {}
    for d in range(1, max(by_dimension, default=0) + 1):
        at = {cell: k for k, cell in enumerate(by_dimension[d - 1])}
        matrix = flint.nmod_mat(len(at), len(by_dimension[d]), 2)
        for k, cell in enumerate(by_dimension[d]):
            for i in range(len(cell)):
                if cell[i] % 2:
                    for step in (-1, 1):
                        matrix[at[(*cell[:i], cell[i] + step, *cell[i + 1 :])], k] = 1
        ranks[d] = matrix.rank()
    found = [
        len(some) - ranks.get(d, 0) - ranks.get(d + 1, 0)
        for d, some in sorted(by_dimension.items())
    ]
    while found and not found[-1]:
        found.pop()
    return tuple(found)


@st.composite
def boxes(draw, dimension, most):
    """Boxes with whole corners."""
    count = draw(st.integers(2, most))
    corner = st.integers(0, SIDE - 1)
    lows = [[draw(corner) for _ in range(dimension)] for _ in range(count)]
    sizes = [[draw(st.integers(0, 3)) for _ in range(dimension)] for _ in range(count)]
    return lows, [
        [min(a + s, SIDE) for a, s in zip(*both, strict=True)]
        for both in zip(lows, sizes, strict=True)
    ]


def union(symbols, lows, highs):
    return AnyOf(
        *(
            AllOf(*(x - a for x, a in zip(symbols, low, strict=True)),
                  *(b - x for x, b in zip(symbols, high, strict=True)))
            for low, high in zip(lows, highs, strict=True)
        )
    )  # fmt: skip


@given(boxes(3, 6))
def test_unions_of_boxes_above_every_height(both):
    manifold = Manifold.euclidean("x y z")
    found = nerve(Polyhedron(manifold, union(manifold.symbols, *both)), manifold.symbols[-1])
    cells = cubes(*both)
    for height in range(SIDE + 1):
        above = {cell for cell in cells if cell[2] >= 2 * height}
        assert found.betti(height) == betti(above)
        # A cell counts by its dimension, the number of odd coordinates.
        assert found.euler_characteristic(height) == sum((-1) ** sum(cell) for cell in above)
    assert found.betti() == betti(cells)
    assert set(found.critical) <= set(range(SIDE + 1))


@given(boxes(2, 4), boxes(2, 3))
def test_intersections_of_unions(first, second):
    """Cells of an intersection are products of simplices."""
    manifold = Manifold.euclidean("x y")
    parts = [union(manifold.symbols, *both) for both in (first, second)]
    found = nerve(Polyhedron(manifold, AllOf(*parts)))
    assert found.betti() == betti(cubes(*first) & cubes(*second))
    assert not len(found.heights) or np.isinf(found.heights).all()
    assert all(bar.birth == np.inf for bar in found.bars)


def chain(count, arcs):
    """The longest chain of a relation, None where it has a cycle."""
    graph = nx.DiGraph(arcs)
    graph.add_nodes_from(range(count))
    return len(nx.dag_longest_path(graph)) if nx.is_directed_acyclic_graph(graph) else None


def hard_squares(count):
    """Squares in the unit square whose side is a coordinate, by their definition."""
    names = [f"{axis}{k}" for k in range(count) for axis in "xy"]
    manifold = Manifold.euclidean([*names, "s"])
    *places, s = manifold.symbols
    xs, ys = places[::2], places[1::2]
    apart = [
        AnyOf(xs[j] - xs[i] - s, ys[j] - ys[i] - s, xs[i] - xs[j] - s, ys[i] - ys[j] - s)
        for i, j in combinations(range(count), 2)
    ]
    inside = [f for q in places for f in (q - s / 2, 1 - s / 2 - q)]
    return Polyhedron(manifold, AllOf(*apart, *inside, s - 0.01)), s


@functools.cache
def of_hard_squares(count):
    return nerve(*hard_squares(count))


@pytest.mark.parametrize("count", [2, 3])
def test_hard_squares_by_orders_alone(count):
    """Common parts reach up to the size ``1/k`` if the longest chain of squares has ``k``."""
    found = of_hard_squares(count)
    pairs = list(combinations(range(count), 2))
    faces = [*"LDRU", "LD", "DR", "RU", "UL"]
    expected = []
    for some in product(faces, repeat=len(pairs)):
        xs, ys = [], []
        for (i, j), face in zip(pairs, some, strict=True):
            xs += [(i, j)] * ("L" in face) + [(j, i)] * ("R" in face)
            ys += [(i, j)] * ("D" in face) + [(j, i)] * ("U" in face)
        longest = chain(count, xs), chain(count, ys)
        if None not in longest:
            expected.append((sum(map(len, some)) - len(some), 1 / max(longest)))
    order = sorted(zip(found.dimensions.tolist(), found.heights.tolist(), strict=True))
    np.testing.assert_allclose(order, sorted(expected), atol=1e-9)


def test_small_squares_are_points():
    """The Poincaré polynomial of distinct points is ``(1 + t) (1 + 2 t)`` ([Arnold])."""
    found = of_hard_squares(3)
    assert found.critical == pytest.approx((1 / 2, 1 / 3))
    assert found.betti(found.critical[0]) == (2, 2)
    assert found.betti(found.critical[1]) == found.betti() == (1, 3, 2)


def test_symmetry_changes_nothing():
    d, s = hard_squares(3)
    swap = {
        "f1": "f3", "f2": "f4", "f3": "f1", "f4": "f2",  # squares 0 and 1
        **{f"f{4 + k}": f"f{8 + k}" for k in range(1, 5)},
        **{f"f{8 + k}": f"f{4 + k}" for k in range(1, 5)},
        **{f"f{12 + k}": f"f{16 + k}" for k in range(1, 5)},
        **{f"f{16 + k}": f"f{12 + k}" for k in range(1, 5)},
    }  # fmt: skip
    group = Symmetry(elements=[Element(lambda q: q[[2, 3, 0, 1, 4, 5, 6]], swap)])
    plain, fewer = of_hard_squares(3), nerve(d, s, symmetry=group)
    assert fewer.betti(0.4) == plain.betti(0.4) == (2, 2)
    np.testing.assert_allclose(fewer.heights, plain.heights)


def test_heights_without_bounds():
    manifold = Manifold.euclidean("x y")
    x, y = manifold.symbols
    found = nerve(Polyhedron(manifold, AnyOf(AllOf(x, y), AllOf(-x, y - 1))), -y)
    assert found.bars == (Bar(0, 0.0, -math.inf),)
    up = nerve(Polyhedron(manifold, AnyOf(AllOf(x - 1, y), AllOf(-x, y - 1, 2 - y))), y)
    assert up.bars == (Bar(0, math.inf, -math.inf), Bar(0, 2.0, -math.inf))
    assert up.critical == (2.0,)


def test_an_equation_cuts():
    manifold = Manifold.euclidean("x y")
    x, y = manifold.symbols
    ring = AllOf(AnyOf(x - 1, -1 - x, y - 1, -1 - y), 2 - x, x + 2, 2 - y, y + 2)
    assert nerve(Polyhedron(manifold, ring)).betti() == (1, 1)
    assert nerve(Polyhedron(manifold, ring, y)).betti() == (2,)
    assert nerve(Polyhedron(manifold, AllOf(ring, x - 3))).betti() == ()


LINE = Manifold.euclidean("x")
INTERVAL = Polyhedron(LINE, [LINE.symbols[0], 1 - LINE.symbols[0]])
SWAP = Symmetry(elements=[Element(lambda q: 1 - q, {"f1": "f2", "f2": "f1"})])
WRONG = Symmetry(elements=[Element(lambda q: 2 * q, {"f1": "f3"})])
UNLISTED = Symmetry(relabel=lambda *_: [])
CIRCLE = Manifold(("a",), (2 * math.pi,), (1.0,))


@pytest.mark.parametrize(
    ("make", "kind", "said"),
    [
        (lambda: nerve(1), TypeError, "polyhedron: expected a Polyhedron"),
        (
            lambda: nerve(Polyhedron(LINE, {"bowl": LINE.symbols[0] ** 2 - 1})),
            ValueError,
            r"polyhedron: expected affine functions; got x\*\*2 - 1",
        ),
        (
            lambda: nerve(INTERVAL, LINE.symbols[0] ** 2),
            ValueError,
            "height: expected affine functions",
        ),
        (
            lambda: nerve(INTERVAL, LINE.symbols[0], symmetry=SWAP),
            ValueError,
            "symmetry: expected symmetries of polyhedron and height",
        ),
        (lambda: nerve(INTERVAL, symmetry=3), TypeError, "symmetry: expected a Symmetry; got int"),
        (lambda: nerve(INTERVAL, symmetry=WRONG), ValueError, "symmetry: expected symmetries"),
        (
            lambda: nerve(INTERVAL, symmetry=UNLISTED),
            ValueError,
            "symmetry: expected a group that is listed in elements",
        ),
        (
            lambda: nerve(Polyhedron(CIRCLE, {"f": 1 + 0 * CIRCLE.symbols[0]})),
            ValueError,
            "polyhedron: expected a manifold of lines",
        ),
    ],
)
def test_what_is_refused(make, kind, said):
    with pytest.raises(kind, match=said):
        make()


def test_a_symmetry_of_the_height_is_taken():
    assert nerve(INTERVAL, symmetry=SWAP).betti() == (1,)
