"""Functions of a union that vanish where the set does not depend on them."""

from polycorner import AllOf, AnyOf, Manifold, Polyhedron
from polycorner.landscapes import landscape

M = Manifold.euclidean("x y")
x, y = M.symbols


def test_one_that_vanishes_all_along_a_locus():
    """Two segments on the line ``x = 0``, where ``y^2 > 1`` makes up for ``x >= 0``."""
    rest = AnyOf(y**2 - 1, x)
    found = landscape(
        Polyhedron(M, AllOf(4 * y**2 - 9, 4 - y**2, rest)),
        x**2,
        box=[(-1, 1), (-3, 3)],
    )
    assert found.complete
    assert [m.kind for m in found.minima] == ["locus", "locus"]
    assert sorted(m.point[1] > 0 for m in found.minima) == [False, True]
    assert not found.passes
    assert found.barrier(0, 1).lower == found.barrier(0, 1).upper == float("inf")


def test_one_that_vanishes_at_a_saddle():
    either = AnyOf(9 - x**2 - y**2, x)
    found = landscape(Polyhedron(M, either), (y**2 - 1) ** 2 + x**2, box=[(-1, 1), (-2, 2)])
    assert found.complete
    assert [(p.kind, len(p.sides)) for p in found.passes] == [("saddle", 2)]
    assert len(found.minima) == 2
    low, high = found.barrier(0, 1).rise
    assert low <= 1 <= high
    assert high - low < 1e-9
