"""Surfaces, films, descents and boards as values: they travel, and their arrays are read-only."""

import copy
import math
import pickle

import pytest
from elsewhere import called

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures import forbidden_solid, pair_film
from polycorner.dumbbells.viewer import descent
from polycorner.dumbbells.viewer.board import Board

PAIR = DumbbellPair(16, 3, 1.5)


def summary(solid, film, path, board):
    """Return numbers that the values compute, those computed on demand included."""
    return (
        solid.volume,
        len(solid.corners),
        len(film),
        float(path.lengths[-1]),
        path.certificate.verdict.value,
        board.certificate.energy,
    )


@pytest.fixture(scope="module")
def values():
    path = descent(PAIR.polyhedron, PAIR.energy, PAIR.nested("R", heading=0.3, clearance=1.0))
    solid = forbidden_solid(PAIR, 16, period=math.pi)
    return solid, pair_film(PAIR, path.points), path, Board.of(PAIR)


def test_values_are_sent_to_a_spawned_process_after_use(values):
    used = summary(*values)
    assert called(summary, *values) == pytest.approx(used)
    assert summary(*copy.deepcopy(values)) == pytest.approx(used)


def test_arrays_are_read_only_also_after_unpickling(values):
    for solid, film, path, _ in (values, pickle.loads(pickle.dumps(values))):
        arrays = [solid.caps, solid.inside, solid.labels, solid.active, solid.bounds]
        arrays += [film.times, film.centres, film.roles, path.points]
        arrays += [*film.energies.values(), *film.contacts[-1].values()]
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
