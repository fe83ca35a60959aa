"""The study of how fast pairs turn: without noise, mirrored, and against the energy balance."""

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics import dyads
from polycorner.dumbbells.dynamics.dyads import heading_at_shift
from polycorner.dumbbells.studies import turning


def results(heading, strength, **given):
    rng = np.random.default_rng(3)
    usual = {"duration": 6.0, "after": 2.0, "spin": 0.04, "dt": 1e-3}
    found = turning(heading, "kicks", strength, 0.003, rng=rng, **(usual | given))
    return {name: float(value) for name, (value, _) in found.items()}


def test_without_noise_pairs_turn_by_what_few_impacts_there_are():
    found = results(8.0, 0.0)
    for name in ("single", "weight"):
        assert found[name] == pytest.approx(0.0, abs=1e-6)
    assert 0 <= found["rate"] < 0.01
    assert 0 <= found["impacts"] < 0.01
    assert found["at"] == pytest.approx(8.0, abs=0.05)


def test_impacts_of_dumbbells_that_roll_turn_pairs_of_either_hand_away_from_zero():
    for hand in ("right", "left"):
        found = results(4.0, 40.0, hand=hand, part="rolling")
        assert found["single"] == pytest.approx(0.0, abs=1e-6)
        assert found["rate"] > 5 * found["rate_error"]
        assert 0.3 < found["impacts"] / found["rate"] < 1.2


def test_the_weights_part_follows_from_single_dumbbells():
    drum = DumbbellDrum()
    found = results(14.0, 50.0)
    least = heading_at_shift(drum, dyads.offsets(drum)[1])
    away = np.degrees(np.sin(2 * np.radians(found["at"] - least)) / 2)
    assert found["single"] < 0
    expected = found["single"] * dyads.return_ratio(drum) * away
    assert found["weight"] == pytest.approx(expected, rel=1e-12)
    assert found["pressing"] == dyads.pressing(drum, found["at"])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"hand": "both"}, "hand: expected 'right' or 'left'"),
        ({"part": "some"}, "part: expected"),
        ({"duration": 1.0}, "duration: expected"),
    ],
)
def test_what_is_wrong_is_named(wrong, words):
    with pytest.raises(ValueError, match=words):
        results(4.0, 30.0, **wrong)
