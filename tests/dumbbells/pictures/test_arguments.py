"""Wrong arguments of pictures and pages: one table of call, exception and argument named."""

import copy
import math
import pickle

import numpy as np
import pytest
from elsewhere import called

from polycorner import Manifold
from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.dumbbells.pictures import (
    drum_scene,
    forbidden_solid,
    pair_film,
    pair_scene,
    write_movie,
    write_scene,
)
from polycorner.dumbbells.viewer import descent, write_page
from polycorner.dumbbells.viewer.board import Board

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
NESTED = DRUM.nested("L")
LINE = Manifold.euclidean("x")
(X,) = LINE.symbols


def film(q, **more):
    return lambda _: pair_film(DRUM, q, **more)


def solid(pair, **more):
    return lambda _: forbidden_solid(pair, 8, **more)


WRONG = [
    (film(np.zeros((3, 5))), ValueError, "q"),
    (film(np.zeros((0, 6))), ValueError, "q"),
    (film(np.full(6, math.inf)), ValueError, "q"),
    (film([NESTED, NESTED], times=[0.0, 0.0]), ValueError, "times"),
    (film([NESTED, NESTED], times=[0.0]), ValueError, "times"),
    (solid(PLANE, period=3.0), ValueError, "period"),
    (solid(DRUM, period=math.pi, mean_heading=0.0), ValueError, "period"),
    (solid(DRUM), ValueError, "mean_heading"),
    (lambda _: drum_scene(DumbbellDrum(count=2), np.zeros((3, 3))), ValueError, "q"),
    (lambda _: drum_scene(DumbbellDrum(), [[math.nan] * 3]), ValueError, "q"),
    (lambda _: pair_scene(DRUM, [math.nan] * 6), ValueError, "q"),
    (lambda at: write_scene(pair_scene(DRUM, NESTED), at / "a.obj"), ValueError, "path"),
    (lambda at: write_page("", at / "page.txt"), ValueError, "path"),
    (lambda at: write_movie(None, at / "motion.avi"), TypeError, "run"),
]


@pytest.mark.parametrize(("call", "error", "argument"), WRONG)
def test_wrong_arguments_are_named(call, error, argument, tmp_path):
    with pytest.raises(error, match=rf"^{argument}: expected (.|\n)*; got"):
        call(tmp_path)
    assert not list(tmp_path.iterdir())


# ------------------------------------------------------------------------------------------- values

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
