"""Changes of the pair's skeleton: the closed form from its definition, and bisection."""

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.skeleton import long_rod_length, pair_atlas
from polycorner.dumbbells.statics.skeleton_map import (
    BLUR,
    PairMap,
    Pattern,
    Signature,
    pair_map,
    pattern_at,
    signature_of,
)
from polycorner.skeletons.parts import Completeness

# The file, not the function of the same name that its package exports.
module = sys.modules["polycorner.dumbbells.statics.skeleton_map"]

ROD = 0.4
LONG, SHORT = "long", "short"


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def found(told):
    return pair_map(
        [2.6, 3.4],
        [ROD],
        tolerance=1e-2,
        progress=lambda done, total, _: told.append((done, total)),
    )


# ------------------------------------------------------------------------------------ closed form


class TestLongRodLength:
    def test_it_solves_the_equations_that_define_it(self):
        """A ball touches both balls of the other dumbbell and its rod: three distances, solved."""
        import sympy

        r, t, length = sympy.symbols("r t l", positive=True)
        along, across = sympy.symbols("s p", positive=True)
        ends = [(0, 0), (length, 0)]
        equations = [
            *((along - x) ** 2 + (across - y) ** 2 - (2 * r) ** 2 for x, y in ends),
            across - (r + t),
        ]
        # A rod thinner than the ball, so that the root is real.
        thin = sympy.Rational(1, 3)
        (solution,) = sympy.solve(
            [e.subs({r: 1, t: thin}) for e in equations], [along, across, length], dict=True
        )
        assert float(solution[length]) == pytest.approx(long_rod_length(1.0, 1 / 3), rel=1e-12)
        closed = 2 * sympy.sqrt(4 * r**2 - (r + t) ** 2)
        root = {across: r + t, along: closed / 2, length: closed}
        assert all(sympy.expand(e.subs(root)) == 0 for e in equations)
        for r_, t_ in ((3.0, 1.5), (1.0, 0.01), (2.0, 1.9)):
            assert float(closed.subs({r: r_, t: t_})) == pytest.approx(
                long_rod_length(r_, t_), rel=1e-12
            )

    @given(st.floats(0.5, 4), st.floats(0.02, 0.98), st.floats(0.05, 8))
    def test_above_it_a_ball_fits_on_the_rod_between_the_balls(self, r, share, factor):
        """Slide a ball along the rod and look whether it ever is clear of both balls."""
        t = share * r
        length = factor * r
        along = np.linspace(0, length, 4001)
        clear = np.hypot(np.minimum(along, length - along), r + t) >= 2 * r
        if abs(length - long_rod_length(r, t)) > 1e-3 * r:
            assert clear.any() == (length > long_rod_length(r, t))

    @given(st.floats(0.5, 4), st.floats(0.02, 0.98), st.floats(0.1, 10))
    def test_it_scales_with_the_ball(self, r, share, factor):
        scaled = long_rod_length(factor * r, factor * share * r)
        assert scaled == pytest.approx(factor * long_rod_length(r, share * r), rel=1e-12)

    def test_thick_rods_are_always_long_enough(self):
        """At ``t = (sqrt 3 - 1) r`` it is the least length of a dumbbell, two ball radii."""
        assert long_rod_length(1.0, math.sqrt(3) - 1) == pytest.approx(2)


# ------------------------------------------------------------------------------- a map, computed


class TestComputed:
    def test_the_atlas_changes_where_the_closed_form_says(self, found):
        exact = 2 * math.sqrt(4 - (1 + ROD) ** 2)
        ((low, high),) = found.change_brackets
        assert low <= exact <= high
        assert high - low <= 1e-2
        assert found.explained.all()
        assert len(found.missed) == 0
        np.testing.assert_array_equal(found.deviations, [0.0])
        np.testing.assert_allclose(found.closed_form, [exact], rtol=1e-12)
        np.testing.assert_array_equal(found.change_rods, [ROD])

    def test_signatures_below_above_and_at_it(self, found):
        below, above = (found.signatures[k] for k in found.change_kinds[0])
        (at,) = (found.signatures[k] for k in found.critical)
        np.testing.assert_array_equal(found.table, found.change_kinds)
        assert (below.labelled, below.ordered, below.pattern.counts) == (
            (8, 12, 4), (2, 3, 1), (2, 2, 1),
        )  # fmt: skip
        assert (above.labelled, above.ordered, above.pattern.counts) == (
            (16, 28, 12), (4, 7, 3), (4, 5, 2),
        )  # fmt: skip
        assert below.pattern.corners == (("C300_L", 1), ("C300_R", 1))
        assert [kind for kind, _ in above.pattern.corners] == ["Delta_L", "Delta_R", "E_L", "E_R"]
        assert above.pattern.motions == tuple(
            (motion, 1)
            for motion in (
                "020 Delta_L E_L", "020 Delta_R E_R", "110 Delta_L E_R", "110 Delta_R E_L",
                "200 E_L E_R",
            )
        )  # fmt: skip
        # The ball that just fits touches both balls and the rod: two such contacts in each corner.
        assert at.pattern.corners == (("C320_L", 1), ("C320_R", 1))
        assert at.labelled == below.labelled
        assert all(s.sound for s in (below, above, at))

    @pytest.mark.parametrize("which", [0, 1])
    def test_two_ways_to_the_pattern(self, found, which):
        """Up to relabelling from the outset, and labelled first with orbits taken at the end."""
        length = float(found.lengths[which])
        assert pattern_at(length, ROD, seed=3) == found.signatures[found.table[0, which]].pattern

    def test_progress_counts_to_what_was_expected(self, found, told):
        done = [state[0] for state in told]
        assert done == list(range(1, len(told) + 1))
        assert told[-1][0] == told[-1][1]
        assert all(d <= e for d, e in told)
        # Two atlases, one at the closed form, and halvings from 0.8 to 1e-2.
        assert len(told) == 3 + math.ceil(math.log2(0.8 / 1e-2))
        assert len(found.signatures) == 3

    def test_an_atlas_that_is_not_whole_is_not_sound(self):
        atlas = pair_atlas(DumbbellPair(2.5, 1, ROD))
        assert signature_of(atlas).sound
        whole = atlas.skeleton
        cut = replace(whole, faces=whole.faces[1:])
        apart = replace(whole, components={**whole.components, 6: 2})
        early = replace(whole, complete=Completeness.BUDGET)
        for skeleton in (cut, apart, early):
            assert not signature_of(replace(atlas, skeleton=skeleton)).sound
        # A face is missing, so that relabellings do not carry the atlas to itself.
        alone = signature_of(replace(atlas, skeleton=cut))
        assert alone.labelled == alone.ordered == alone.pattern.counts == (8, 12, 3)

    @pytest.mark.parametrize(
        ("length", "rod"), [(2.0, 0.05), (2.0, 0.72), (2.0, 0.75), (2.01, 0.98), (40.0, 0.5)]
    )
    def test_the_far_ends_of_the_range_follow_the_closed_form_too(self, length, rod):
        """Balls of a dumbbell that touch, rods nearly as thick as balls, very long rods."""
        counts = (4, 5, 2) if length > long_rod_length(1.0, rod) else (2, 2, 1)
        assert pattern_at(length, rod).counts == counts

    @pytest.mark.parametrize("apart", [1e-4, -1e-4])
    def test_near_the_closed_form_corners_are_still_told_apart(self, apart):
        exact = long_rod_length(1.0, ROD)
        assert pattern_at(exact + apart, ROD).counts == ((4, 5, 2) if apart > 0 else (2, 2, 1))


# ---------------------------------------------------------------------- the bisection by itself


def signature(name, n=1):
    """Return a signature that is told from others by a name."""
    return Signature((n, n, n), (n, n, n), Pattern((n, n, n), ((name, 1),), ()), sound=True)


def stepped(patch, thresholds):
    """Replace the atlas by a function of the length alone that changes at given thresholds."""

    def at(length):
        return signature(f"S{sum(length > x for x in thresholds)}")

    patch.setattr(module, "pair_atlas", lambda pair: pair)
    patch.setattr(module, "signature_of", lambda pair: at(pair.length))
    patch.setattr(module, "pattern_at", lambda length, _: at(length).pattern)


class TestBisection:
    @given(
        st.lists(st.floats(2.01, 5.99), min_size=0, max_size=3, unique=True),
        st.floats(0.05, 0.95),
        st.sampled_from([0.1, 1e-3, 1e-6]),
    )
    def test_changes_that_a_cell_or_the_bisection_sees_are_bracketed(
        self, thresholds, rod, tolerance
    ):
        with pytest.MonkeyPatch.context() as patch:
            stepped(patch, thresholds)
            found = pair_map([2, 3, 4, 5, 6], [rod], tolerance=tolerance)
        widths = np.diff(found.change_brackets, axis=1)
        assert (widths <= tolerance + 1e-12).all()
        for (low, high), (below, above) in zip(
            found.change_brackets, found.change_kinds, strict=True
        ):
            passed = [x for x in thresholds if low <= x < high]
            assert passed
            kinds = [found.signatures[k].pattern.corners[0][0] for k in (below, above)]
            numbers = [int(kind[1:]) for kind in kinds]
            assert numbers[1] - numbers[0] == len(passed)
        # A step function only goes up, so that no change hides between equal neighbours.
        bracketed = sum(
            sum(low <= x < high for x in thresholds) for low, high in found.change_brackets
        )
        assert bracketed == len(thresholds)

    def test_neighbours_with_the_same_pattern_keep_their_cell_as_bracket(self):
        """Where only labels tell two signatures apart the faster way cannot refine."""
        with pytest.MonkeyPatch.context() as patch:
            stepped(patch, [])
            one = signature("S0")
            other = replace(one, labelled=(2, 2, 2))
            patch.setattr(module, "signature_of", lambda pair: one if pair.length < 2.7 else other)
            found = pair_map([2, 2.5, 3], [0.9], tolerance=0.01)
        np.testing.assert_array_equal(found.change_brackets, [[2.5, 3.0]])

    def test_rows_are_bisected_one_by_one(self):
        with pytest.MonkeyPatch.context() as patch:
            stepped(patch, [])
            at = long_rod_length
            patch.setattr(
                module, "signature_of",
                lambda pair: signature(LONG if pair.length > at(1, pair.rod_radius) else SHORT),
            )  # fmt: skip
            patch.setattr(
                module, "pattern_at",
                lambda length, rod: signature(LONG if length > at(1, rod) else SHORT).pattern,
            )  # fmt: skip
            found = pair_map([2, 3, 4], [0.1, 0.3, 0.5, 0.8], tolerance=1e-5)
        np.testing.assert_array_equal(found.change_rods, [0.1, 0.3, 0.5])
        assert found.explained.all()
        assert len(found.missed) == 0
        assert found.table.shape == (4, 3)
        assert (found.critical >= 0).tolist() == [True, True, True, False]


class TestComparison:
    """Of a map made up by hand with the closed form."""

    def made(self, brackets, rods=(0.1, 0.5, 0.8)):
        return PairMap(
            np.array([2.0, 6.0]), np.array(rods), np.zeros((len(rods), 2), dtype=int),
            (signature("S0"), signature("S1")), np.array([rod for rod, *_ in brackets]),
            np.array([bracket for _, *bracket in brackets]).reshape(-1, 2),
            np.zeros((len(brackets), 2), dtype=int), np.zeros(len(rods), dtype=int),
        )  # fmt: skip

    def test_a_change_elsewhere_is_not_explained_and_the_expected_one_is_missed(self):
        exact = long_rod_length(1.0, 0.1)
        found = self.made([(0.1, exact - 1e-3, exact + 1e-3), (0.5, 4.0, 4.1)])
        assert found.explained.tolist() == [True, False]
        assert found.deviations[1] == pytest.approx(4.0 - long_rod_length(1.0, 0.5))
        assert found.missed.tolist() == [0.5]

    @pytest.mark.parametrize(("off", "explained"), [(0.5 * BLUR, True), (2 * BLUR, False)])
    def test_what_corners_that_are_not_told_apart_can_be_off_is_allowed(self, off, explained):
        exact = long_rod_length(1.0, 0.5)
        for bracket in ((exact + off, exact + off + 1e-3), (exact - off - 1e-3, exact - off)):
            assert self.made([(0.5, *bracket)]).explained.tolist() == [explained]

    def test_nothing_is_expected_where_rods_are_always_long_enough(self):
        assert self.made([], rods=(0.8, 0.9)).missed.tolist() == []
        assert self.made([], rods=(0.1, 0.8)).missed.tolist() == [0.1]
