"""What ``tolerance``, ``rank_tolerance`` and ``options`` of a search change."""

import math

import pytest
from skeleton_shapes import counts, polytope

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.polyhedra import LocalType, WalkOptions
from polycorner.skeletons import Budget, resume
from polycorner.tolerances import Tolerances


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8, 1e-10])
@pytest.mark.parametrize("tolerances", [7, 15])
def test_edges_are_found_down_to_ten_tolerances(tolerance, tolerances):
    """A corner of a triangle is cut off by a short edge."""
    length = tolerances * tolerance
    cut = length / math.sqrt(2)
    D = polytope([[-1, 0], [0, -1], [-1, -1], [1, 1]], [0, 0, -cut, 2])
    found = skeleton(D, [[0.5, 0.4]], tolerance=tolerance)
    lengths = [edge.length for edge in found.edges if edge.active == ("f3",)]
    assert counts(found)[0] == 4
    if tolerances > 10:
        # The corners are sums of numbers of the order of 1.
        assert lengths == pytest.approx([length], abs=1e-15)
    else:
        assert lengths == []
    limit = f"is shorter than {10 * tolerance:g} scale units"
    assert any(limit in note for note in found.notes) is (tolerances < 10)


@pytest.mark.parametrize("rank_tolerance", [4e-3, 6e-3])
def test_the_rank_tolerance_decides_what_is_dependent(rank_tolerance):
    """Of unit normals at an angle ``pi - a`` the singular values have the ratio ``tan(a / 2)``."""
    angle = 1e-2
    D = polytope([[0, -1], [-math.tan(angle), 1], [1, 0]], [0, 0, 1])
    found = skeleton(D, [[0.5, angle / 4]], rank_tolerance=rank_tolerance)
    (tip,) = [corner for corner in found.corners if corner.active == ("f1", "f2")]
    assert counts(found) == (3, 3, 1)
    assert tip.singular is (math.tan(angle / 2) < rank_tolerance)
    assert (tip.local_type is LocalType.QUADRANT) is not tip.singular


def test_a_search_goes_on_with_the_tolerances_it_began_with():
    angle = 1e-2
    D = polytope([[0, -1], [-math.tan(angle), 1], [1, 0]], [0, 0, 1])
    chosen = {"tolerance": 3e-7, "rank_tolerance": 6e-3}
    found = resume(skeleton(D, [[0.5, angle / 4]], budget=Budget(edges=1), **chosen))
    assert found.state.quotient.tolerances == Tolerances.of(**chosen)
    assert [corner.singular for corner in found.corners if "f3" not in corner.active] == [True]


def test_careful_walks_take_shorter_steps_to_the_same_corners():
    plane = Manifold.euclidean("x y")
    x, y = plane.symbols
    D = Polyhedron(plane, {"bowl": y - x**2, "lid": 2 - y})
    usual, careful = (
        skeleton(D, [[0.0, 1.0]], options=options, budget=Budget(edges=1))
        for options in (None, WalkOptions.careful())
    )
    usual, careful = resume(usual), resume(careful)
    assert careful.state.quotient.options == WalkOptions.careful()
    assert counts(usual) == counts(careful) == (2, 2, 1)
    points = [sum(len(edge.polyline) for edge in found.edges) for found in (usual, careful)]
    assert points[1] > 1.5 * points[0]
    for corner, other in zip(usual.corners, careful.corners, strict=True):
        assert corner.point == pytest.approx(other.point, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("turn", 1.6, ValueError),
        ("turn", "small", TypeError),
        ("first_step", 0.6, ValueError),
        ("shortest_step", 0.3, ValueError),
        ("tip", 0.0, ValueError),
        ("link_extent", -1, ValueError),
        ("distances", (3e-3, 1e-3), TypeError),
        ("radii", (), ValueError),
        ("samples", (1e-3, 1e-2), ValueError),
    ],
)
def test_options_are_checked(name, value, kind):
    with pytest.raises(kind, match="_step" if "_step" in name else name):
        WalkOptions(**{name: value})
