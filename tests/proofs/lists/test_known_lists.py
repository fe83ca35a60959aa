"""Lists of generated problems are the known ones, or say that they are not complete."""

from fractions import Fraction as Q

import numpy as np
import pytest
from hypothesis import settings

from benchmarks.trials import falsified, known_lists
from benchmarks.trials.known import complaints
from benchmarks.trials.planar import Energy, PlanarProblem, disc, line, separable
from polycorner.proofs import stationary_points

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
SEED, MANY = 11, 25
EACH = max(2, settings.default.max_examples // 300)
IDENTITY = ((Q(1), Q(0)), (Q(0), Q(1)))
HERE = (Q(0), Q(0))


def found(posed, most, *, minima_only=False):
    return stationary_points(
        posed.polyhedron, posed.energy, box=posed.box, symmetry=posed.symmetry,
        resolution=1e-3, max_boxes=most, minima_only=minima_only,
    )  # fmt: skip


def judge(posed, most):
    """Complain about a list that is false; return whether it is complete."""
    if posed.refused:
        with pytest.raises(ValueError, match=r"symmetry|box"):
            found(posed, most)
        return False
    listed = found(posed, most)
    assert not list(complaints(posed, listed)), (posed, listed)
    return listed.complete


@pytest.mark.parametrize("draw", known_lists.DRAWS, ids=lambda draw: draw.__name__)
def test_no_false_list_in_a_few_problems_of_every_kind(draw):
    for number in range(EACH):
        judge(known_lists.drawn(draw, np.random.default_rng([SEED, number])), 600)


@pytest.mark.parametrize("draw", known_lists.DRAWS, ids=lambda draw: draw.__name__)
def test_minima_alone_are_those_of_the_whole_list(draw):
    for number in range(EACH):
        posed = known_lists.drawn(draw, np.random.default_rng([SEED + 1, number]))
        if posed.refused:
            continue
        every, minima = (found(posed, 600, minima_only=only) for only in (False, True))
        if every.complete and minima.complete:
            places = [
                sorted(np.round(p.point, 6).tolist() for p in some if p.is_minimum)
                for some in (every, minima)
            ]
            assert places[0] == places[1]
            assert sum(place.is_minimum for place in every.loci) == len(minima.loci)
        elif minima.complete:
            assert len(minima) == sum(p.index == 0 for p in posed.points)
        assert minima.complete or not every.complete


@pytest.mark.slow
@pytest.mark.parametrize("draw", known_lists.DRAWS, ids=lambda draw: draw.__name__)
def test_no_false_list_in_many_problems_of_every_kind(draw):
    for number in range(EACH, MANY):
        judge(known_lists.drawn(draw, np.random.default_rng([SEED, number])), 10_000)


@pytest.mark.parametrize("name", ["discs", "near_kinks", "loci", "mirrors", "domain_sides"])
def test_falsified_proofs_are_refused(name):
    (draw,) = (d for d in known_lists.DRAWS if d.__name__ == name)
    changes = set()
    for number in range(EACH):
        posed = known_lists.drawn(draw, np.random.default_rng([SEED, number]))
        for change, said in falsified.tried(posed, found(posed, 300)):
            assert (said == "verified") == (change == "as saved"), (change, said)
            changes.add(change)
    assert "as saved" in changes


# ------------------------------------------------------------------------------------- the oracle


def bowl(x, y):
    return separable([[-x, Q(1)], [-y, Q(1)]], [[x], [y]], IDENTITY, HERE)


def test_the_distance_from_a_point_rests_twice_on_a_circle_and_outside_once():
    round_ = disc(Q(0), Q(0), Q(5))
    places = PlanarProblem(bowl(Q(6), Q(8)), (round_,), (frozenset([0]),)).places()
    assert [(p.point, p.index) for p in places] == [((3, 4), 0)]
    outside = disc(Q(0), Q(0), Q(5), inside=False)
    places = PlanarProblem(bowl(Q(6), Q(8)), (outside,), (frozenset([0]),)).places()
    assert sorted((p.point, p.index) for p in places) == [((-3, -4), 1), ((6, 8), 0)]


def test_a_union_has_no_rest_where_another_branch_goes_on():
    """The wedge of two half-planes is left at its tip by the union of them, not by the wedge."""
    walls = line(Q(1), Q(1), Q(0)), line(Q(-1), Q(1), Q(0))
    height = bowl(Q(0), Q(-1))
    both, either = (frozenset([0, 1]),), (frozenset([0]), frozenset([1]))
    assert [p.point for p in PlanarProblem(height, walls, both).places()] == [HERE]
    places = PlanarProblem(height, walls, either).places()
    half = Q(1, 2)
    assert sorted(p.point for p in places) == [(-half, -half), (half, -half)]


def test_sets_that_touch_from_outside_meet_in_a_place_of_rest():
    left, right = disc(Q(-1), Q(0), Q(1)), disc(Q(1), Q(0), Q(1))
    (place,) = PlanarProblem(bowl(Q(2), Q(3)), (left, right), (frozenset([0, 1]),)).places()
    assert (place.point, place.index) == (HERE, None)


def test_products_rest_where_both_factors_vanish():
    """x y is stationary at 0, a saddle; on the unit circle at four points."""
    saddle = Energy((((Q(0), Q(1)), (Q(0), Q(1))),), IDENTITY, HERE, (HERE,))
    round_ = disc(Q(0), Q(0), Q(1))
    places = PlanarProblem(saddle, (round_,), (frozenset([0]),)).places()
    assert [p.index for p in places if p.point == HERE] == [1]
    on = [p.point for p in places if p.point != HERE]
    assert all(abs(2 * x * x - 1) < Q(1, 10**100) and x * y < 0 for x, y in on)
    assert len(on) == 2
