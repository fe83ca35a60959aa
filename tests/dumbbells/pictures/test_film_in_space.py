"""Films of rigid dumbbells: balls where the polyhedron has them, roles of the dyads."""

from dataclasses import replace

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import BunchInSpaceRun, drum_for_bunch, follow_in_space
from polycorner.dumbbells.pictures.film import LEFT, RIGHT, SINGLE
from polycorner.dumbbells.pictures.film_in_space import film_in_space
from polycorner.dumbbells.viewer.page import film_page

DRUM = drum_for_bunch(DumbbellDrum(), count=4, top=90.0)


@pytest.fixture(scope="module")
def run() -> BunchInSpaceRun:
    return follow_in_space(DRUM, 2e-3, start=1, dt=1e-3, interval=1e-3)


def test_balls_touch_the_drum_and_are_a_rod_apart(run):
    balls = film_in_space(run).centres
    away = np.hypot(balls[..., 0], balls[..., 2])
    assert away == pytest.approx(np.full(away.shape, DRUM.centre_radius), abs=1e-3)
    rods = balls[..., 1, :] - balls[..., 0, :]
    assert np.linalg.norm(rods, axis=-1) == pytest.approx(np.full(rods.shape[:-1], DRUM.length))
    headings = np.arctan2(np.hypot(rods[0, :, 0], rods[0, :, 2]), rods[0, :, 1])
    assert headings == pytest.approx(abs(run.q[0, :, 2]), abs=0.02)


def test_who_has_left_is_not_drawn_and_dyads_have_their_colours(run):
    present = run.trajectory.present.copy()
    present[1:, 2] = False
    gone = BunchInSpaceRun(replace(run.trajectory, present=present), run.rigid)
    film = film_in_space(gone)
    assert np.isnan(film.centres[1:, 2]).all()
    assert not np.isnan(film.centres[:, [0, 1, 3]]).any()
    for roles, k in zip(film.roles, range(len(gone.times)), strict=True):
        hands = {body: hand for i, j, hand in gone.dyads(k) for body in (i, j)}
        expected = [{1: RIGHT, -1: LEFT, 0: SINGLE}[hands.get(b, 0)] for b in range(4)]
        assert roles.tolist() == expected


def test_a_page_has_the_film(run):
    page = film_page(film_in_space(run, title="Four in space"))
    assert "Four in space" in page
