"""Sets of friction and noise, judged by numbers that are made up."""

import numpy as np
import pytest

from paper_checks import Verdict
from paper_checks.appendixA.torque import DRUM
from paper_checks.framework.disturbances import CAPTIONS, TEXT, Disturbance
from paper_checks.section3 import together
from paper_checks.section3.together import Judged
from paper_checks.section7.driven import Settled
from paper_checks.section7.moving import Wandering

KICKS = [Disturbance("kicks", float(k), 0.003) for k in range(3, 6)]


@pytest.fixture
def made_up(monkeypatch):
    """Kicks of 3 meet everything, of 4 turn left-handed pairs too far, of 5 make zigzags narrow."""

    def settled(noise, _time, tilt=7.0, **_):
        left = -15.5 - 3 * (noise.strength == 4)
        right = np.full(5, 14.5 if tilt else 14.0)
        return Settled(right, np.full(5, left), 0.1, -0.2, (5, 5), 0.0)

    def wandering(noise, _time, _friction):
        return Wandering(1.0, (1.0, 2.0) if noise.strength == 5 else (4.5, 5.5), 9.0)

    monkeypatch.setattr(together, "settled", settled)
    monkeypatch.setattr(together, "wandering", wandering)
    monkeypatch.setattr(together, "singles", lambda *_: Judged(True, "fallen"))
    monkeypatch.setattr(together, "_leaving", lambda *_: Judged(True, "41, 30 R"))
    together.judged.cache_clear()
    yield tuple((TEXT, kick, 1.0) for kick in KICKS)
    together.judged.cache_clear()


def test_a_set_has_to_meet_all_criteria(made_up):
    found = together.one_set_meets_all(made_up)
    assert found.verdict is Verdict.HOLDS_UNDER
    assert [found.numbers[f"missed_{k}"] for k in range(3)] == [0, 1, 1]
    assert "kicks of 3 " in found.correction
    others = together.one_set_meets_all(made_up[1:])
    assert others.verdict is Verdict.REFUTED
    assert "more than 6 of the criteria, and no set meets: all at once" in others.correction
    never = together.one_set_meets_all(made_up[1:2])
    assert "no set meets: headings ±15°" in never.correction
    assert "14.5°, -18.5°" in found.evidence
    some = together.one_set_meets_all(made_up[1:2], criteria=("zigzags of 5°",))
    assert some.verdict is Verdict.HOLDS_UNDER


def test_no_set_is_hidden_in_the_table(made_up):
    head, _, *rows = together.table(made_up).splitlines()
    names = [cell.strip() for cell in head.strip("|").split("|")]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    assert len(cells) == len(made_up)
    assert [row[names.index("bunch")] for row in cells] == ["yes: 41, 30 R", "–", "–"]
    assert [row[names.index("tilt")] for row in cells] == [
        "yes: level 14.0°",
        "–",
        "yes: level 14.0°",
    ]


def test_friction_of_the_text_is_that_of_the_drum_and_captions_have_more_sliding():
    assert TEXT.of(DRUM) == DRUM
    drum = CAPTIONS.of(DRUM)
    assert drum.sliding == pytest.approx((0.1 / np.sin(np.radians(8)), 0.48), abs=2e-3)
    assert drum.rolling == DRUM.rolling
    assert drum.rubbing == (0.1, 0.1)


def test_kicks_act_in_addition_to_another_kind_of_noise():
    both = Disturbance("chatter", 0.4, 0.01, kicks=60.0)
    drum, noise = both.acting_on(DRUM, 3)
    alone = Disturbance("kicks", 60.0, 0.003).acting_on(DRUM, 3)[1]
    assert drum == DRUM
    assert (noise.chatter, noise.seed) == (0.4, 3)
    assert (noise.kicks, noise.kick_time) == (alone.kicks, alone.kick_time)
    assert str(both).startswith("chatter of 0.4 and kicks of 60 mm/s")
    assert [both._replace(kicks=k).step(2e-3, kicked=1e-3) for k in (0.0, 60.0)] == [2e-3, 1e-3]
