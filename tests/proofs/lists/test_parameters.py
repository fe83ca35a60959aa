"""Complete lists for all values of parameters in intervals."""

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry
from polycorner.polyhedra.symmetry import Element
from polycorner.proofs import stationary_points
from polycorner.proofs.checker.verdict import check

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDES = [(-3.0, 3.0), (-3.0, 3.0)]


def posed(a=1.1, b=2.0):
    """Return the outside of a disc of radius ``a``, and an energy with a centre at ``(b, 0)``."""
    import sympy

    radius, centre = sympy.symbols("a b")
    disc = SmoothFunction("disc", X**2 + Y**2 - radius**2, PLANE, parameters={"a": a})
    energy = SmoothFunction("E", (X - centre) ** 2 + 2 * Y**2, PLANE, parameters={"b": b})
    return Polyhedron(PLANE, [disc]), energy


def mirrored(q):
    return q * np.array([1.0, -1.0])


def test_one_list_holds_for_every_value(tmp_path):
    sides = {"a": (1.0, 1.01), "b": (1.99, 2.0)}
    mirror = Symmetry(elements=[Element(mirrored, {})])
    found = stationary_points(*posed(), box=SIDES, parameters=sides, symmetry=mirror)
    assert found.complete
    assert found.parameters == sides
    rng = np.random.default_rng(1)
    for a, b in [(1.0, 1.99), (1.01, 2.0), *rng.uniform([1, 1.99], [1.01, 2], (5, 2)).tolist()]:
        single = stationary_points(*posed(a, b), box=SIDES)
        assert single.complete
        assert len(single) == len(found)
        for p in single:
            holding = [q for q in found if ((q.lower <= p.lower) & (p.upper <= q.upper)).all()]
            assert [q.index for q in holding] == [p.index]
    assert sorted(p.index for p in found) == [0, 1]
    assert "for all a in [1, 1.01], b in [1.99, 2]" in found.statement
    told = check(str(found.save(tmp_path / "disc.zip")), None, 1)
    assert told.startswith("verified: 2 stationary points")


def test_an_interval_in_which_the_list_changes_is_not_complete():
    """The centre comes out of the disc: the point on the circle becomes one outside."""
    found = stationary_points(
        *posed(), box=SIDES, parameters={"b": (1.0, 1.2)}, resolution=0.05, max_boxes=20_000
    )
    assert not found.complete
    left = [*found.undecided, *([p.lower, p.upper] for p in found.open_points)]
    for place in ([1.1, 0.0], [1.15, 0.0], [1.2, 0.0]):
        assert any(((lower <= place) & (place <= upper)).all() for lower, upper in left)


def test_lists_over_parameters_have_no_certificates():
    found = stationary_points(*posed(), box=SIDES, parameters={"a": (1.0, 1.01)})
    with pytest.raises(ValueError, match="expected a list for one value"):
        found.certificates()


@pytest.mark.parametrize(
    ("sides", "kind", "words"),
    [
        ({}, TypeError, "parameters: expected a mapping"),
        ({"c": (1, 2)}, ValueError, "parameters"),
        ({"a": (2, 1)}, ValueError, "parameters: expected finite lower < upper"),
        ({"a": 1.0}, TypeError, "parameters: expected"),
    ],
)
def test_parameters_are_known_names_with_intervals(sides, kind, words):
    with pytest.raises(kind, match=words):
        stationary_points(*posed(), box=SIDES, parameters=sides)
