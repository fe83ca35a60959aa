"""Every bad argument of a dumbbell pair is refused in a sentence that names it."""

import dataclasses
import math

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellPair

GOOD = {"length": 16, "ball_radius": 3, "rod_radius": 1.5, "drum_radius": 125, "rod_weight": 0}
DRUM = DumbbellPair(**GOOD)


NO_NUMBERS = ["16", None, True, np.True_, 1j, [16.0], np.array(16.0), math]
SIZES = [name for name in GOOD if name != "rod_weight"]
REFUSED = [  # what is changed, the exception, the argument that is blamed
    *(({name: bad}, TypeError, name) for name in GOOD for bad in NO_NUMBERS),
    *(({name: bad}, ValueError, name) for name in GOOD for bad in (math.nan, -math.inf, -1.0)),
    *(({name: 0.0}, ValueError, name) for name in SIZES),
    *(({name: math.inf}, ValueError, name) for name in GOOD if name != "drum_radius"),
    ({"rod_radius": 3.0}, ValueError, "rod_radius"),
    ({"rod_radius": 4.0}, ValueError, "rod_radius"),
    ({"length": 5.9}, ValueError, "length"),
    ({"drum_radius": 10.9}, ValueError, "length"),  # the dumbbell does not fit into the drum
    ({"length": 244.5}, ValueError, "length"),
    ({"drum_radius": 1.0}, ValueError, "drum_radius"),  # smaller than a ball
    ({"drum_radius": 3.0}, ValueError, "drum_radius"),
]


@pytest.mark.parametrize(("changes", "kind", "blamed"), REFUSED)
def test_a_bad_size_is_refused_in_one_line(changes, kind, blamed):
    with pytest.raises(kind, match=rf"^{blamed}: expected .*; got ") as caught:
        DumbbellPair(**GOOD | changes)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("changes", [{"length": 6.0}, {"drum_radius": 11.0}, {"rod_radius": 2.999}])
def test_the_extreme_sizes_are_allowed(changes):
    pair = DumbbellPair(**GOOD | changes)
    assert np.isfinite(pair.polyhedron.values(pair.end_to_end())).all()


def test_whole_and_numpy_numbers_are_kept_as_floats():
    pair = DumbbellPair(np.int64(16), np.float32(3), 1.5, 125)
    assert pair == DumbbellPair(16.0, 3.0, 1.5, 125.0, 0.0)
    assert all(type(value) is float for value in dataclasses.astuple(pair))
    assert hash(pair) == hash(DRUM)


def test_the_plane_is_the_default():
    assert DumbbellPair(16, 3, 1.5).is_plane
    assert not DRUM.is_plane


def test_coordinates_are_named_after_what_they_are():
    assert DRUM.manifold.names == ("phi1", "eta1", "theta1", "phi2", "eta2", "theta2")
    assert DRUM.manifold.periods == (math.tau, math.inf, math.tau) * 2
    plane = DumbbellPair(16, 3, 1.5).manifold
    assert plane.names == ("x1", "y1", "theta1", "x2", "y2", "theta2")
    assert plane.periods == (math.inf, math.inf, math.tau) * 2


@pytest.mark.parametrize("pair", [DRUM, DumbbellPair(16, 3, 1.5)], ids=["drum", "plane"])
@pytest.mark.parametrize("coordinate", range(6))
def test_a_unit_displacement_moves_a_ball_by_about_its_radius(pair, coordinate):
    q = pair.nested("R")
    step = 1e-6 * np.eye(6)[coordinate] * pair.manifold.scale_array
    moved = np.linalg.norm(pair.ball_centres(q + step) - pair.ball_centres(q), axis=1).max() / 1e-6
    assert moved == pytest.approx(pair.ball_radius, rel=0.01)


@pytest.mark.parametrize("q", [[0.0] * 5, [0.0] * 7, [math.nan] + [0.0] * 5, 0.0, ["a"] * 6])
@pytest.mark.parametrize(
    "method", ["ball_centres", "developed", "chirality", "mirror", "swap", "canonical", "heading"]
)
def test_a_bad_placement_is_refused(method, q):
    with pytest.raises((ValueError, TypeError), match=r"^q: "):
        getattr(DRUM, method)(q)
