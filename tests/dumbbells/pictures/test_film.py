"""Films of pairs and runs say of every instant what the library says."""

import numpy as np
import pytest
from drum_motions import moved

from polycorner import minimise, stratum_at
from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.dumbbells.dynamics.pairs import handedness
from polycorner.dumbbells.pictures.film import HANDS, RIGHT, SINGLE, pair_film, run_film
from polycorner.dumbbells.viewer.board import descent

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
BEGIN = DRUM.nested("R", heading=0.5, clearance=1.5) + np.array([0.08, 0, 0, 0.06, 0, -0.1])


@pytest.fixture(scope="module")
def way():
    return descent(DRUM.polyhedron, DRUM.energy, BEGIN)


def test_a_film_of_a_pair_says_what_the_library_says(way):
    film = pair_film(DRUM, way.points)
    np.testing.assert_allclose(film.times, way.lengths)
    np.testing.assert_array_equal(film.centres.reshape(-1, 4, 3), DRUM.ball_centres(way.points))
    for k, q in enumerate(way.points):
        stratum = stratum_at(DRUM.polyhedron, q, tolerance=1e-6)
        assert tuple(film.contacts[k]) == stratum.active
        assert f"dimension {stratum.dimension}, rank {stratum.rank}, " in film.words[k].stratum
        assert (
            film.words[k].chirality == {"R": "right-handed", "L": "left-handed"}[DRUM.chirality(q)]
        )
    np.testing.assert_array_equal(film.energies["Energy (mm)"], DRUM.energy.value(way.points))


def test_one_configuration_is_a_film_of_one_frame():
    film = pair_film(PLANE, PLANE.nested("L"))
    assert len(film) == 1
    assert list(film.energies) == ["Energy (mm²)"]


def test_a_film_of_a_run_agrees_with_the_polyhedron(way):
    run = moved(DumbbellDrum(count=2), way.points.reshape(-1, 2, 3))
    film = run_film(run)
    assert film.unit == "s"
    for k, q in enumerate(way.points):
        stratum = stratum_at(DRUM.polyhedron, q, tolerance=1e-6)
        assert tuple(film.contacts[k]) == stratum.active
        assert film.words[k].stratum.startswith(
            f"dimension {stratum.dimension}, rank {stratum.rank}, "
        )
        assert film.words[k].chirality == HANDS[handedness(run, k)]
    assert len(run_film(run, frames=7)) == 7


def test_a_film_of_many_counts_dyads_and_leaves_out_who_has_left():
    pair = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested("R")).point.reshape(2, 3)
    q = np.stack([np.concatenate([pair, [[0.3, 200.0, 0.1]]])] * 3)
    film = run_film(moved(DumbbellDrum(count=3), q, leaves=(2, 1)))
    assert [w.chirality for w in film.words] == ["1 right-handed, 0 left-handed dyads"] * 3
    assert film.roles[0].tolist() == [RIGHT, RIGHT, SINGLE]
    assert np.isnan(film.centres[1:, 2]).all()
    assert not np.isnan(film.centres[0]).any()
    assert set(film.contacts[0]) == {"1-2 A2B1", "1-2 A2b", "1-2 aB1"}
    assert film.words[0].stratum == ""
