"""What ``tolerance`` and ``rank_tolerance`` of a search change."""

import math

import pytest
from skeleton_shapes import counts, polytope

from polycorner import skeleton
from polycorner.polyhedra import LocalType
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
