"""Matrices of islands, against dense ones, and the order of elimination, against its definition."""

from itertools import combinations
from typing import Any, NamedTuple

import networkx as nx
import numpy as np
import pytest

from polycorner.motion.engine import island_matrix, ordering
from tests.support.stages import callable_stage


class Work(NamedTuple):
    """The arrays that the order of elimination needs, of whatever record."""

    bodies: Any
    order: Any
    awake: Any
    listed: Any
    number: Any
    degree: Any
    first_of_degree: Any
    queue: Any
    first_neighbour: Any
    link: Any
    link_status: Any
    mark: Any
    place: Any
    row_start: Any
    columns: Any


list_bodies = callable_stage(ordering.list_bodies)
find_neighbours = callable_stage(ordering.find_neighbours)
eliminate_all = callable_stage(ordering.eliminate_all)
solve_matrix = callable_stage(island_matrix.solve_matrix)


def workspace(pairs, n, room):
    """Return the workspace for blocks of these bodies, in any order."""
    blocks = np.array([(i, -1) for i in range(n)] + [*pairs, *pairs], dtype=np.int64)
    np.random.default_rng(0).shuffle(blocks)
    shapes = {"queue": (n, 2), "link": (2 * room + 1, 2), "link_status": 2}
    shapes |= {"row_start": n + 1, "columns": room + 1}
    arrays = {name: np.zeros(shapes.get(name, n), dtype=np.int64) for name in Work._fields[3:]}
    return Work(blocks, np.arange(len(blocks)), np.ones(n, dtype=np.int64), **arrays)


def ordered(pairs, n, room=None):
    """Return the workspace after the bodies were ordered, or None where there is no room."""
    work = workspace(pairs, n, n * n if room is None else room)
    blocks = len(work.order)
    assert list_bodies(work, work, work, work, 0, blocks) == n
    fits = find_neighbours(work, work, work, work, 0, blocks, n) and eliminate_all(work, work, n)
    return work if fits else None


def random_pairs(rng, n, share):
    return [pair for pair in combinations(range(n), 2) if rng.random() < share]


@pytest.mark.parametrize(("n", "share"), [(1, 0), (2, 1), (7, 0.3), (12, 1), (40, 0.08), (30, 0)])
def test_the_body_with_the_fewest_neighbours_is_next(n, share):
    """The graph is eliminated as the definition says, and rows are the neighbours that are left."""
    pairs = random_pairs(np.random.default_rng(n), n, share)
    work = ordered(pairs, n)
    place = {int(i): int(work.place[v]) for v, i in enumerate(work.listed)}
    assert sorted(place.values()) == [*range(n)]
    left = nx.Graph(pairs)
    left.add_nodes_from(range(n))
    for p, i in enumerate(sorted(place, key=place.__getitem__)):
        around = list(left[i])
        assert len(around) == min(dict(left.degree).values())
        row = work.columns[work.row_start[p] : work.row_start[p + 1]]
        assert row.tolist() == sorted(place[j] for j in around)
        left.add_edges_from(combinations(around, 2))
        left.remove_node(i)


@pytest.mark.parametrize("room", [3, 5])
def test_a_matrix_that_does_not_fit_is_refused(room):
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    assert ordered(pairs, 4, room) is None
    assert ordered(pairs, 4, 6) is not None


@pytest.mark.parametrize("K", [4, 8])
@pytest.mark.parametrize(("n", "share"), [(1, 0), (2, 1), (6, 1), (30, 0.1), (40, 0), (25, 0.3)])
def test_systems_are_solved(n, share, K):
    rng = np.random.default_rng(n)
    work = ordered(random_pairs(rng, n, share), n)
    A = np.zeros((n, n, K, K))
    A[np.arange(n), np.arange(n)] = rng.normal(size=(n, K, K)) + 3 * K * n * np.eye(K)
    starts, count = work.row_start, int(work.row_start[n])
    matrix = np.zeros((n + 2 * count, K, K))
    matrix[:n] = A[np.arange(n), np.arange(n)]
    for p in range(n):
        for e in range(starts[p], starts[p + 1]):
            j = work.columns[e]
            A[p, j], A[j, p] = rng.normal(size=(2, K, K))
            matrix[n + e], matrix[n + count + e] = A[p, j], A[j, p]
    b = rng.normal(size=n * K)
    x = b.copy()
    assert solve_matrix(matrix.ravel(), x, n, K, starts, work.columns)
    dense = A.transpose(0, 2, 1, 3).reshape(n * K, n * K)
    np.testing.assert_allclose(x, np.linalg.solve(dense, b), rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("column", range(4))
def test_a_matrix_without_a_pivot_is_refused(column):
    matrix = np.tile(np.eye(4), (2, 1, 1))
    matrix[:, :, column] = 0.0
    work = ordered([], 2)
    assert not solve_matrix(matrix.ravel(), np.ones(8), 2, 4, work.row_start, work.columns)


def test_stiff_rows_do_not_spoil_the_others():
    """Contacts weigh up to 1e10 times as much as masses; elimination must not mix them up."""
    rng = np.random.default_rng(1)
    n, K = 5, 4
    work = ordered([(i, i + 1) for i in range(n - 1)], n)
    rows = rng.normal(size=(n - 1, 2 * K))
    dense = np.eye(n * K)
    listed = work.place[:n]
    for i, row in enumerate(rows):
        J = np.zeros(n * K)
        a, b = (int(listed[list(work.listed).index(k)]) for k in (i, i + 1))
        J[a * K : a * K + K], J[b * K : b * K + K] = row[:K], row[K:]
        dense += 1e10 * np.outer(J, J)
    blocks = dense.reshape(n, K, n, K).transpose(0, 2, 1, 3)
    starts, count = work.row_start, int(work.row_start[n])
    matrix = np.zeros((n + 2 * count, K, K))
    matrix[:n] = blocks[np.arange(n), np.arange(n)]
    for p in range(n):
        for e in range(starts[p], starts[p + 1]):
            matrix[n + e] = blocks[p, work.columns[e]]
            matrix[n + count + e] = blocks[work.columns[e], p]
    b = rng.normal(size=n * K)
    x = b.copy()
    assert solve_matrix(matrix.ravel(), x, n, K, starts, work.columns)
    backward = np.abs(dense @ x - b).max() / (np.abs(dense).max() * np.abs(x).max())
    assert backward < 1e-15
