"""Generated landscapes: the answers that are known of them, and what judges a landscape."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import sympy

from benchmarks.trials.flooding import Chart, Grid
from benchmarks.trials.generated_landscapes import DRAWS, problem
from benchmarks.trials.known_trees import (
    Curve,
    DegenerateError,
    candidates,
    floods,
    is_minimum,
    known_along,
    known_on,
    known_product,
)
from benchmarks.trials.run_landscapes import trial
from benchmarks.trials.tree_judge import complaints
from polycorner.landscapes import landscape

x, y = sympy.symbols("x y", real=True)
WELLS = (x**2 - 1) ** 2 + y**2
BOX = (2 - x, 2 + x, 2 - y, 2 + y)
SIDES = ((-2.125, 2.125), (-2.125, 2.125))


def chart(energy, *parts, **more):
    """Return an energy on a box in which parts of a tree hold."""
    functions, tree = list(BOX), ["and", 0, 1, 2, 3]
    for part in parts:
        first = len(functions)
        functions += part
        tree.append(("or", *range(first, len(functions))))
    return Chart((x, y), energy, tuple(functions), tuple(tree), SIDES, **more)


class TestAnswersInThePlane:
    @pytest.mark.parametrize(
        ("parts", "height"),
        [
            ([], 1),
            ([[x**2 + y**2 - sympy.Rational(1, 4)]], sympy.Rational(5, 4)),  # at its top
            (
                [[y - 2 * x - sympy.Rational(1, 2), y + 2 * x - sympy.Rational(1, 2)]],
                sympy.Rational(5, 4),
            ),
            ([[y - 2 * x - 1, y + 2 * x - 1, -1.5 - y]], 2),  # at the tips of a triangle
            ([[-x - 1 / sympy.Integer(4), x - 1 / sympy.Integer(4)]], sympy.oo),
        ],
    )
    def test_the_height_of_a_pass_is_that_of_the_closed_form(self, parts, height):
        truth = known_on(chart(WELLS + x / 1000, *parts))
        assert len(truth.energies) >= 2
        (found,) = truth.heights[0, 1]
        assert found == pytest.approx(float(height), abs=1e-2) or found == height

    def test_the_bounds_of_a_flood_meet_as_the_grid_is_refined(self):
        posed = chart(WELLS, [x**2 + y**2 - 0.25])
        widths = []
        for n in (100, 200, 400):
            below, above = floods(Grid(posed, n), [(-1, 0), (1, 0)])
            assert below.heights[0, 1] <= 1.25 <= above.heights[0, 1]
            widths.append(above.heights[0, 1] - below.heights[0, 1])
        assert widths[2] < widths[0] / 2

    def test_a_flood_notices_a_minimum_that_is_not_among_the_seeds(self):
        grid = Grid(chart(WELLS), 200)
        assert grid.above([(-1, 0), (1, 0)]).stray < 1e-3
        assert grid.above([(1, 0)]).stray == pytest.approx(1, abs=0.05)

    @pytest.mark.parametrize(
        ("parts", "cap", "number"),
        [
            ([], np.inf, 1),
            ([], 0.5, 2),
            ([[x**2 + y**2 - 0.25]], np.inf, 0),
            ([[x - 0.5, -0.5 - x, y - 1]], np.inf, 1),
            ([[(x - 1) ** 2 + y**2 - 0.25], [(x + 1) ** 2 + y**2 - 0.25]], np.inf, -1),
        ],
    )
    def test_the_euler_characteristic_counts_parts_less_holes(self, parts, cap, number):
        assert known_on(chart(WELLS + x / 1000, *parts)).euler(cap) == number

    def test_the_euler_characteristic_of_a_torus_with_a_hole(self):
        sides = ((0.0, 2 * np.pi),) * 2
        energy, hole = sympy.cos(x) + sympy.cos(y), 1.5 - sympy.cos(x - 1) - sympy.cos(y)
        torus = Chart((x, y), energy, (hole,), ("and", 0), sides, (True, True))
        assert Grid(torus, 200).euler(np.inf) == -1
        assert Grid(replace(torus, tree=("and",)), 200).euler(np.inf) == 0

    def test_stationary_points_are_those_of_the_polynomial(self):
        found = candidates(Chart((x, y), WELLS, (), ("and",), SIDES))
        assert sorted(np.round(q, 9).tolist() for q in found) == [[-1, 0], [0, 0], [1, 0]]

    @pytest.mark.parametrize(
        ("energy", "parts", "at", "minimum"),
        [
            (y, [[y - x**2]], (0, 0), True),
            (y, [[y + x**2]], (0, 0), False),
            (x + 2 * y, [[x], [y]], (0, 0), True),
            (x - 2 * y, [[x], [y]], (0, 0), False),
            (x + 2 * y, [[x, y]], (0, 0), False),
        ],
    )
    def test_a_minimum_is_what_nothing_beside_it_is_below(self, energy, parts, at, minimum):
        assert is_minimum(chart(energy, *parts), np.array(at, float)) is minimum

    def test_what_is_not_clear_is_refused(self):
        with pytest.raises(DegenerateError):
            is_minimum(chart(y, [[y + x**4]][0]), np.zeros(2))

    def test_a_region_is_left_at_the_lowest_point_of_its_side(self):
        truth = known_on(chart(WELLS + x / 8, region=(sympy.Rational(3, 2) - x,)))
        side = (2.25 - 1) ** 2 + 1.5 / 8
        right = int(truth.points[:, 0].argmax())
        assert truth.heights[right, 2] == pytest.approx((side,))
        walled = chart(WELLS + x / 8, [-x - 1, x - 1.875], region=(sympy.Rational(3, 2) - x,))
        assert known_on(walled).heights[0, 1] == (np.inf,)

    def test_a_sphere_is_known_by_its_longitude_and_latitude(self):
        c = sympy.cos(y)
        energy = -((c * sympy.sin(x)) ** 2) + sympy.sin(y) ** 2 / 2 + c * sympy.cos(x) / 8
        sides = ((0.0, 2 * np.pi), (-np.pi / 2, np.pi / 2))
        truth = known_on(Chart((x, y), energy, (), ("and",), sides, (True, False), poles=True))
        assert len(truth.energies) == 2
        assert truth.heights[0, 1] == pytest.approx((-1 / 8,))


class TestAnswersOnCurvesAndProducts:
    t = sympy.Symbol("t", real=True)

    def test_two_ways_around_a_circle_are_compared(self):
        energy = sympy.cos(2 * self.t) + sympy.cos(self.t) / 8
        curve = Curve(self.t, energy, (), ("and",), (0.0, 2 * np.pi), around=True)
        truth = known_along(curve)
        assert len(truth.energies) == 2
        assert truth.heights[0, 1] == pytest.approx((1 - 1 / 8,))
        cut = replace(curve, functions=(sympy.cos(self.t) + 0.9,), tree=("and", 0))
        assert known_along(cut).heights[0, 1] == pytest.approx((1 + 1 / 8,))

    def test_a_product_agrees_with_a_flood(self):
        first = Curve(x, (x**2 - 1) ** 2 + x / 4, BOX[:2], ("and", 0, 1), (-2.1, 2.1))
        second = Curve(y, sympy.cos(3 * y) + y / 5, BOX[2:], ("and", 0, 1), (-2.1, 2.1))
        truth = known_product([known_along(first), known_along(second)])
        flooded = known_on(chart(first.energy + second.energy))
        assert np.allclose(truth.points, flooded.points)
        for pair, heights in flooded.heights.items():
            assert truth.heights[pair] == pytest.approx(heights)


@pytest.mark.parametrize("number", range(len(DRAWS)), ids=[draw.__name__ for draw in DRAWS])
class TestGenerated:
    def test_two_resolutions_never_disagree(self, number):
        posed = problem(0, number)
        given = getattr(posed.answer, "args", [None])[0]
        if not isinstance(given, Chart) or len(posed.answer.args) > 1:
            pytest.skip("its answer does not come from a grid")
        truth = known_on(given)
        for n in (120, 260):
            below, above = floods(Grid(given, n), list(truth.points))
            for a, b in combinations(range(len(truth.energies)), 2):
                low, high = below.heights[a, b] - 1e-9, above.heights[a, b] + 1e-9
                assert any(low <= height <= high for height in truth.heights[a, b])

    def test_nothing_in_its_landscape_is_false(self, number):
        facts = {}
        for more in trial(problem(0, number)):
            facts |= more
        assert facts["outcome"] in {"complete", "open", "refused"}


@pytest.fixture(scope="module")
def judged():
    posed = problem(0, 1)
    found = landscape(posed.polyhedron, posed.energy, box=posed.box)
    assert found.complete
    return posed, found


class TestJudge:
    def complaints(self, judged, **changed):
        posed, found = judged
        return list(complaints(posed, replace(found, **changed)))

    def test_what_is_right_is_not_complained_of(self, judged):
        assert not self.complaints(judged)

    def test_a_minimum_is_lost_or_listed_twice(self, judged):
        minima = judged[1].minima
        assert self.complaints(judged, minima=minima[1:], passes=())
        assert self.complaints(judged, minima=(*minima, minima[0]))

    def test_a_point_or_an_energy_is_wrong(self, judged):
        first, *others = judged[1].minima
        moved = replace(first, point=first.point + 1e-3)
        raised = replace(first, energy=tuple(e + 1e-6 for e in first.energy))
        assert self.complaints(judged, minima=(moved, *others))
        assert self.complaints(judged, minima=(raised, *others))

    def test_a_pass_is_lost_or_lower_or_higher_or_joins_others(self, judged):
        _, found = judged
        k = found.merges[-1].number
        one, others = found.passes[k], found.passes[:k] + found.passes[k + 1 :]
        assert self.complaints(judged, passes=others)
        for shift in (-1e-6, 1e-6):
            moved = replace(one, energy=tuple(e + shift for e in one.energy))
            sides = tuple(
                replace(s, route=replace(s.route, top=s.route.top + shift)) for s in one.sides
            )
            assert self.complaints(judged, passes=(*others, replace(moved, sides=sides)))
        elsewhere = replace(one, sides=(one.sides[0], one.sides[0]))
        assert self.complaints(judged, passes=(*others, elsewhere))
