"""Section 7, static claims: expected verdicts, and the checks against independent computations."""

import math

import numpy as np
import pytest

from paper_checks import Verdict
from paper_checks.section6.experiment import EXPERIMENT, PLANE
from paper_checks.section7 import dyads, tilt
from polycorner import SmoothFunction, minimise


def test_other_counts_of_components_are_refuted():
    for components, of in ((1, 5), (2, 7), (2, 4)):
        assert dyads.touching_set(components, of).verdict is Verdict.REFUTED


def test_the_neighbourhood_is_that_of_its_inequalities():
    rng = np.random.default_rng(3)
    q = np.concatenate([dyads.drawn(rng)[::4000], EXPERIMENT.placements(rng, 100)])
    inside = dyads.in_neighbourhood(EXPERIMENT, q)
    assert 0 < inside.sum() < len(q)
    for one, found in zip(q, inside, strict=True):
        a1, a2, b1, b2 = EXPERIMENT.ball_centres(one)
        lines = ((a1, b1, b2), (a2, b1, b2), (b1, a1, a2), (b2, a1, a2))
        near = []
        for p, start, end in lines:
            u = (end - start) / np.linalg.norm(end - start)
            near.append(np.linalg.norm(p - start - ((p - start) @ u) * u))
        far = [np.linalg.norm(a - b) for a in (a1, a2) for b in (b1, b2)]
        assert found == (max(near) < 6 and max(far) < 2 * math.sqrt(16**2 + 3**2))


def test_nested_pairs_lie_in_the_neighbourhood_and_others_do_not():
    nested = [PLANE.nested(hand, heading=h) for hand in "LR" for h in (0.0, 0.7, 1.5)]
    assert dyads.in_neighbourhood(PLANE, np.array(nested)).all()
    others = [PLANE.side_by_side(), PLANE.end_to_end()]
    assert not dyads.in_neighbourhood(PLANE, np.array(others)).any()


def test_the_chirality_is_the_one_of_the_library():
    q = EXPERIMENT.placements(np.random.default_rng(9), 200)
    lead, turn = dyads.handedness(EXPERIMENT, q)
    signs = {"R": 1, "L": -1}
    for one, a, b in zip(q, lead, turn, strict=True):
        hand = EXPERIMENT.chirality(one)
        if hand is not None:
            assert a > 0
            assert np.sign(b) == signs[hand]


@pytest.mark.parametrize("share", [0.48, 0.5, 0.504])
def test_a_tilted_pair_falls_into_the_corner_that_is_claimed(share):
    """The stationary point of the face is where a descent from a nested pair ends, too."""
    pair = EXPERIMENT
    found = tilt.tilted(share, tilt.TILT)
    energy = found.problem.energy
    assert isinstance(energy, SmoothFunction)
    rest = minimise(pair.polyhedron, energy, pair.nested("R"))
    assert rest.is_minimum
    np.testing.assert_allclose(pair.heading(rest.point), pair.heading(found.point), atol=1e-9)


def test_just_outside_the_shares_a_contact_opens():
    low, high = tilt.range_of_shares(tilt.TILT)
    for share, inside in ((low + 1e-4, True), (low - 1e-4, False), (high - 1e-4, True)):
        assert tilt.tilted(share, tilt.TILT).is_minimum is inside
    assert not tilt.tilted(high + 1e-4, tilt.TILT).is_minimum
