"""Complete lists for all values of parameters in intervals."""

import numpy as np
import pytest
import sympy
from proof_files import changed

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry
from polycorner.polyhedra.symmetry import Element
from polycorner.proofs import stationary_points
from polycorner.proofs.checker.balls import NotShownError
from polycorner.proofs.checker.verdict import check

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDES = [(-3.0, 3.0), (-3.0, 3.0)]


def posed(a=1.1, b=2.0):
    """Return the outside of a disc of radius ``a``, and an energy with a centre at ``(b, 0)``."""
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


def test_a_point_that_leaves_the_box_is_not_listed_for_all_values(tmp_path):
    """The centre is at ``x = b``; for some of its values that is beyond the side at 2."""
    whole = Polyhedron(PLANE, {"disc": 100 - X**2 - Y**2})
    energy, sides = posed()[1], {"b": (1.9, 2.1)}
    box = [(0.0, 2.0), (-1.0, 1.0)]
    found = stationary_points(whole, energy, box=box, parameters=sides)
    assert (found.complete, len(found), len(found.open_points)) == (False, 0, 1)
    counts = [len(stationary_points(whole, posed(b=b)[1], box=box)) for b in (1.95, 2.05)]
    assert counts == [1, 0]
    told = check(str(found.save(tmp_path / "beyond.zip")), None, 1)
    assert told.startswith("verified: 0 stationary points, 1 that may be")
    wide = stationary_points(whole, energy, box=[(0.0, 2.2), (-1.0, 1.0)], parameters=sides)
    path = wide.save(tmp_path / "wide.zip")
    assert check(str(path), None, 1).startswith("verified: 1 stationary points, 1 of index 0")
    changed(path, lambda data: data["domain"]["upper"].__setitem__(0, (2.0).hex()))
    with pytest.raises(NotShownError, match="is none of the stationary points"):
        check(str(path), None, 1)


def test_a_locus_that_leaves_the_box_is_not_listed_for_all_values(tmp_path):
    whole = Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2})
    b = sympy.Symbol("b")
    energy = SmoothFunction("E", (X - b) ** 2, PLANE, parameters={"b": 2.0})
    for side, complete in ((2.0, False), (2.2, True)):
        found = stationary_points(
            whole, energy, box=[(0.0, side), (-1.0, 1.0)], parameters={"b": (1.9, 2.1)}
        )
        assert (found.complete, len(found.loci)) == (complete, 1)
        told = check(str(found.save(tmp_path / "locus.zip")), None, 1)
        assert ("1 loci that may be empty" in told) == (not complete)


def test_a_symmetry_that_moves_a_parameter_is_refused(tmp_path):
    """A point that is stationary in ``x`` for one value of ``b`` may go to one that is not."""
    whole = Polyhedron(PLANE, {"disc": 100 - X**2 - Y**2})
    found = stationary_points(whole, posed()[1], box=SIDES, parameters={"b": (1.9, 2.1)})

    def exchange(data):
        turn = {"order": [2, 1, 0], "signs": [1, 1, 1], "shifts": ["0"] * 3}
        data["symmetries"].append(turn)

    path = changed(found.save(tmp_path / "list.zip"), exchange)
    with pytest.raises(NotShownError, match="moves a parameter"):
        check(str(path), None, 1)


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
