"""What joins below a point: the theorems of passes against counts on grids, from the definition.

Near a point with independent gradients the functions that vanish and coordinates along their common
zeros are coordinates, ``u`` and ``y``, in which the energy is ``sum lam_i u_i + Q(y)``.  The cells
of a grid with ``E < 0`` in the set are counted in classes of cells that share a face; no cell has a
``u_i = 0``, and cells that meet at an edge are not joined.
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import label

from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.landscapes.pieces import parted
from polycorner.spaces.manifold import Array

CELLS = 14  # along an axis: even, so that none lies at 0


def random_tree(rng: np.random.Generator, leaves: Sequence[int], union: bool) -> object:
    """Return a nested tree ``(union, children)`` with each of some leaves in it."""
    if len(leaves) == 1:
        return leaves[0]
    count = rng.integers(2, len(leaves) + 1)
    places = np.append(np.arange(count), rng.integers(0, count, len(leaves) - count))
    order = rng.permutation(leaves)
    parts = [order[places == k].tolist() for k in range(count)]
    # Some functions occur twice, in several parts.
    for part in parts:
        if rng.random() < 0.4:
            part.append(int(rng.choice([k for k in order if k not in part] or part)))
    return union, [random_tree(rng, sorted(set(part)), not union) for part in parts]


def holds(tree: object, signs: Sequence[NDArray[np.bool_]]) -> NDArray[np.bool_]:
    """Whether a tree holds, by which of its leaves do."""
    if isinstance(tree, int):
        return signs[tree]
    union, children = tree
    parts = [holds(child, signs) for child in children]
    return reduce(np.logical_or if union else np.logical_and, parts)


def polyhedron(tree: object, names: str) -> Polyhedron:
    """Return the set of a tree of coordinates."""
    manifold = Manifold.euclidean(names)
    functions = Polyhedron(manifold, list(manifold.symbols)).functions

    def part(tree: object) -> object:
        if isinstance(tree, int):
            return functions[tree]
        union, children = tree
        return (AnyOf if union else AllOf)(*map(part, children))

    return Polyhedron(manifold, [part(tree)])


def counted(tree: object, lam: Array, squares: Sequence[int]) -> int:
    """Count the components of cells in the set in which the energy is negative."""
    side = (np.arange(CELLS) - (CELLS - 1) / 2) * 2 / CELLS
    axes = np.meshgrid(*[side] * (len(lam) + len(squares)), indexing="ij", sparse=True)
    u, y = axes[: len(lam)], axes[len(lam) :]
    energy = sum((c * x for c, x in zip(lam, u, strict=True)), np.zeros((1,) * len(axes)))
    energy = energy + sum((s * x**2 for s, x in zip(squares, y, strict=True)), 0.0)
    inside = np.broadcast_to(holds(tree, [x >= 0 for x in u]), energy.shape)
    return int(label(inside & (energy < 0))[1])


def stated(tree: object, count: int, index: int) -> int:
    """Return the number of sides by the theorems of the module ``passes``."""
    d = polyhedron(tree, " ".join(f"u{i}" for i in range(count)))
    active = frozenset(range(count))
    pieces = d.signs_to_pieces([0] * count)
    if pieces == [active]:
        return {0: 0, 1: 2}.get(index, 1)
    # Functions that do not matter leave a direction of descent: the point is not critical.
    if frozenset().union(*pieces) != active or index:
        return 1
    return len(parted(active, pieces))


def trees(seed: int, most: int) -> list[tuple[object, int]]:
    """Return random trees in which all of 1 to ``most`` functions occur."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(60):
        count = int(rng.integers(1, most + 1))
        found.append((random_tree(rng, range(count), bool(rng.integers(2))), count))
    return found


@pytest.mark.parametrize("squares", [(), (1,), (-1,), (1, -1), (-1, -1)])
def test_sides_of_unions(squares: tuple[int, ...]) -> None:
    """Number of components below a point with positive multipliers, of index 0, 1 and 2."""
    rng = np.random.default_rng(len(squares))
    seen = set()
    for tree, count in trees(7, 4 if len(squares) < 2 else 3):
        lam = rng.uniform(0.5, 2.0, count)
        index = sum(s < 0 for s in squares)
        expected = counted(tree, lam, squares)
        assert stated(tree, count, index) == expected, (tree, lam)
        seen.add(expected)
    # The trees are of all kinds: minima, no passes, passes.
    assert seen >= ({0, 1, 2} if sum(s < 0 for s in squares) == 0 else {1})


def test_negative_multipliers_make_no_pass() -> None:
    """Where a multiplier is negative what lies below is connected, whatever the tree is."""
    rng = np.random.default_rng(3)
    for tree, count in trees(5, 4):
        lam = rng.uniform(0.5, 2.0, count)
        lam[rng.integers(count)] *= -1
        for squares in ((), (1,), (-1,)):
            assert counted(tree, lam, squares) == 1, (tree, lam)


def test_three_parts_and_more() -> None:
    """All but one of ``n`` functions: each two parts need all of them, so that none are joined."""
    for n in (3, 4, 5):
        tree = (True, [(False, [k for k in range(n) if k != i]) for i in range(n)])
        assert stated(tree, n, 0) == counted(tree, np.ones(n), ()) == n
