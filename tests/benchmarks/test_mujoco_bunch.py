"""A bunch moved by MuJoCo: who is past the end leaves, and stays away."""

import argparse
from importlib.util import find_spec

import numpy as np
import pytest
from drum_in_space import figures_of
from mujoco_bunch import INTERVAL, WATCHED, followed, main, scene

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import drum_for_bunch, scattered

OPTIONS = argparse.Namespace(
    count=6, top=25.0, duration=2 * INTERVAL, dt=2e-3, segments=720, impratio=100.0, slipping=False
)


@pytest.mark.skipif(find_spec("mujoco") is None, reason="MuJoCo is not installed")
def test_those_past_the_end_leave_at_once():
    drum = drum_for_bunch(DumbbellDrum(), count=6, top=25.0)
    start = scattered(drum, np.random.default_rng(1))
    past = start[:, 1] > 25.0
    assert 0 < past.sum() < 6
    run = followed(OPTIONS, 1)
    assert {k for _, k in run.exits} == set(np.flatnonzero(past))
    assert all(time == pytest.approx(WATCHED) for time, _ in run.exits)
    assert (run.present == [[True] * 6, ~past, ~past]).all()
    assert run.q[:, past] == pytest.approx(np.broadcast_to(run.q[0, past], (3, past.sum(), 4)))
    stay = run.q[-1, ~past, 1]  # those across the axis roll down to the bottom
    assert ((stay > drum.ball_radius) & (stay < start[~past, 1])).all()
    figures = figures_of(run)
    assert (figures["left"], figures["present"]) == (past.sum(), 6 - past.sum())
    assert figures["s"] == 2 * INTERVAL


def test_the_scene_is_that_of_the_drum():
    drum = drum_for_bunch(DumbbellDrum(sliding=(0.4, 0.2), rolling=(0.1, 0.05)), count=6, top=25.0)
    sticking = scene(drum, OPTIONS)
    slipping = scene(drum, argparse.Namespace(**vars(OPTIONS) | {"slipping": True}))
    assert (sticking.mu_slide, sticking.mu_roll) == (0.4, 0.1)
    assert (slipping.mu_slide, slipping.mu_roll) == (0.2, 0.05)
    assert (sticking.tilt, sticking.spin, sticking.count) == (drum.tilt, drum.spin, 6)
    assert sticking.drum_length > drum.top


@pytest.mark.parametrize("wrong", [["--starts", "0"], ["--dt", "0.1"], ["--duration", "0"]])
def test_options_are_checked(wrong, capsys):
    with pytest.raises(SystemExit):
        main(wrong)
    assert f"{wrong[0]}: expected" in capsys.readouterr().err
