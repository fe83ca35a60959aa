"""Answers of the live page are those of the library, and only messages in range are understood."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, certify, minimise, stratum_at
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.placements import relative_placements
from polycorner.dumbbells.viewer.board import (
    BUTTONS,
    MESSAGE,
    Board,
    UnknownMessageError,
    atlas_place,
    coordinates,
    descent,
    parsed,
    sliders_for,
    trail,
)

DRUM, PLANE = DumbbellPair(16, 3, 1.5, 125), DumbbellPair(16, 3, 1.5)
SLIDERS = sliders_for(DRUM, 125.0)
BOARDS = {pair: Board.of(pair) for pair in (DRUM, PLANE)}


@given(st.sampled_from([DRUM, PLANE]), st.lists(st.floats(-1, 1), min_size=6, max_size=6))
def test_a_reading_is_what_the_library_says(pair, shares):
    board = BOARDS[pair]
    start = board.moved(
        {n: s * SLIDERS[n].high / 4 for n, s in zip(coordinates(), shares, strict=True)}
    )
    q, reading = np.array(start.q), start.reading()
    stratum = stratum_at(pair.polyhedron, q, tolerance=1e-6)
    gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q).tolist(), strict=True))
    assert reading["gaps"] == gaps
    np.testing.assert_array_equal(reading["centres"], pair.ball_centres(q).ravel())
    words = reading["words"]
    assert words["energy"].split()[0] == f"{pair.energy.value(q):.6f}"
    assert words["chirality"][0] == (pair.chirality(q) or "none").lower()[0]
    inside = bool(pair.polyhedron.contains(q))
    assert inside is (words["stratum"] != "outside the polyhedron")
    assert inside is (words["multipliers"] != "none: the dumbbells overlap")
    assert [name for name, _ in reading["contacts"]] == list(stratum.active)
    json.dumps(reading, allow_nan=False)


@pytest.mark.parametrize("pair", [DRUM, PLANE])
@pytest.mark.parametrize(("button", "hand"), [("right", "R"), ("left", "L")])
def test_a_fall_ends_where_the_minimiser_does(pair, button, hand):
    last, fall = BOARDS[pair].pressed(button).fall()
    corner = minimise(pair.polyhedron, pair.energy, pair.nested(hand))
    np.testing.assert_allclose(pair.heading(last.q), pair.heading(corner.point), atol=1e-9)
    assert fall["verdict"] == corner.verdict.value
    found = certify(pair.polyhedron, pair.energy, last.q)
    words = fall["last"]["words"]
    for name, value in found.multipliers.items():
        assert f"{name} {value:.6f}" in words["multipliers"]
    assert words["multipliers"].endswith(" mm" if pair.is_plane else " mm/mm")
    assert words["rest"] == corner.verdict.value
    assert words["stratum"].startswith("dimension 3, rank 3")
    heights = [float(frame["words"]["energy"].split()[0]) for frame in fall["frames"]]
    assert heights == sorted(heights, reverse=True)
    assert last.moved({"axial_A": last.values["axial_A"]}).reading()["words"] == words


def test_a_fall_from_an_overlap_begins_at_a_place_without():
    board = BOARDS[DRUM].moved(dict.fromkeys(coordinates(), 0.0))
    assert board.reading()["words"]["contacts"] == "none"
    last, fall = board.fall()
    if fall["frames"][0]["words"]["stratum"] == "outside the polyhedron":
        assert "no point of the polyhedron was reached" in fall["verdict"]
        assert last.q == board.q
    else:
        assert DRUM.polyhedron.implicit(last.q) > -1e-8


def test_on_a_face_where_the_weight_is_not_balanced_the_multipliers_are_called_a_fit():
    apart = PLANE.side_by_side()  # ball on ball twice, at the same height
    board = BOARDS[PLANE]
    q = dict(zip(coordinates(), (apart * board.units).tolist(), strict=True))
    words = board.moved({k: v + (20.0 if "lateral" in k else 0) for k, v in q.items()}).words
    assert words["contacts"] == "A1B1, A2B2"
    assert words["multipliers"].endswith("(least squares: the contacts do not balance the weight)")
    assert words["rest"].startswith("not a minimum")


def test_the_shape_changes_and_places_along_the_wall_stay():
    board = BOARDS[DRUM]
    other = board.moved({"drum_radius": 60.0, "length": 20.0})
    assert (other.pair.drum_radius, other.pair.length) == (60.0, 20.0)
    flat = other.pressed("plane")
    assert flat.pair.is_plane
    back = flat.moved({"ball_radius": 2.5, "drum_radius": 70.0}).pressed("drum")
    assert (back.pair.drum_radius, back.pair.ball_radius) == (70.0, 2.5)
    for one in (other, flat, back):
        for name in coordinates():
            assert one.values[name] == pytest.approx(board.values[name])
    with pytest.raises(ValueError, match=r"^rod_radius: expected"):
        board.moved({"rod_radius": 4.0})


@given(st.sampled_from([DRUM, PLANE]), st.integers(0, 2**32 - 1))
def test_a_place_in_the_atlas_is_where_the_same_bodies_are(pair, seed):
    """Back from the atlas there are the same gaps, up to the names of balls."""
    q = pair.placements(np.random.default_rng(seed), 1)[0]
    place = atlas_place(pair, q) / [1, 1, pair.length / 2]
    heading = None if pair.is_plane else (q[2] + q[5]) / 2
    same = relative_placements(pair, place, mean_heading=heading)
    assert pair.polyhedron.implicit(same) == pytest.approx(pair.polyhedron.implicit(q), abs=1e-9)


def test_a_trail_is_cut_where_it_leaves_the_atlas():
    q = np.zeros((9, 6))
    q[:, 4], q[:, 5] = 30.0, np.linspace(1.0, 2.0, 9)  # past a quarter turn
    pieces = trail(PLANE, q)
    assert [len(piece) for piece in pieces] == [5, 4]
    assert sum(pieces[0][:, 2] > 0) == 5
    assert sum(pieces[1][:, 2] < 0) == 4


# ----------------------------------------------------------------------------------------- messages


@given(
    st.dictionaries(
        st.sampled_from(sorted(SLIDERS)), st.floats(0, 1), min_size=1, max_size=len(SLIDERS)
    )
)
def test_every_value_in_range_is_understood_and_comes_back(shares):
    values = {
        name: SLIDERS[name].low + share * (SLIDERS[name].high - SLIDERS[name].low)
        for name, share in shares.items()
    }
    assert parsed(json.dumps(values), SLIDERS) == values
    placed = {name: value for name, value in values.items() if name in coordinates()}
    for board in BOARDS.values():
        shown = board.moved(placed).values
        for name, value in placed.items():
            apart = shown[name] - value
            assert abs(math.remainder(apart, 360.0) if "heading" in name else apart) < 1e-9


def test_all_sliders_fit_in_one_message():
    longest = {name: -1 / 3 * slider.high for name, slider in SLIDERS.items()}
    assert len(json.dumps(longest)) < MESSAGE


@pytest.mark.parametrize("button", [name for name, _ in BUTTONS])
def test_buttons_are_understood(button):
    assert parsed(json.dumps(button), SLIDERS) == button


@pytest.mark.parametrize(
    "message",
    [
        "",
        "fall",  # not JSON
        '"delete"',
        "[]",
        "{}",
        "null",
        "3",
        '["fall"]',
        '{"fall": 1}',
        '{"heading_A": "1"}',
        '{"heading_A": true}',
        '{"heading_A": null}',
        '{"heading_A": NaN}',
        '{"heading_A": Infinity}',
        '{"heading_A": 1e999}',
        '{"heading_A": 180.5}',
        '{"rod_radius": 0}',
        '{"heading_A": 1, "file": "/etc/passwd"}',
        '{"heading_A": ' + "9" * 400 + "}",
        "[" * 500,
        '{"heading_A": [1]}',
        '{"__class__": 1}',
    ],
)
def test_everything_else_is_refused(message):
    with pytest.raises(UnknownMessageError, match=r"^([a-zA-Z_]+: )?expected [a-zA-Z]"):
        parsed(message, SLIDERS)


# --------------------------------------------------------------------------------- steepest descent

BEGIN = DRUM.nested("R", heading=0.5, clearance=1.5) + np.array([0.08, 0, 0, 0.06, 0, -0.1])


@pytest.fixture(scope="module")
def way():
    return descent(DRUM.polyhedron, DRUM.energy, BEGIN)


def test_a_descent_falls_inside_the_polyhedron_to_the_minimum(way):
    energies = DRUM.energy.value(way.points)
    assert (np.diff(energies) < 0).all()
    assert DRUM.polyhedron.implicit(way.points).min() > -1e-8
    corner = minimise(DRUM.polyhedron, DRUM.energy, DRUM.nested("R"))
    assert way.certificate.is_minimum
    assert set(way.certificate.active) == set(corner.active)
    heading = DRUM.heading(corner.point)
    np.testing.assert_allclose(DRUM.heading(way.points[-1]), heading, atol=1e-9)
    np.testing.assert_allclose(way.points[0], BEGIN)
    assert np.diff(way.lengths).max() < 0.2


def test_a_descent_leaves_along_the_gradient_and_closes_contacts_one_by_one(way):
    scales = DRUM.manifold.scale_array
    first = (way.points[1] - way.points[0]) / scales
    down = -DRUM.energy.gradient(BEGIN) * scales
    assert first @ down == pytest.approx(np.linalg.norm(first) * np.linalg.norm(down))
    strata = [stratum_at(DRUM.polyhedron, q, tolerance=1e-6) for q in way.points]
    dimensions = [stratum.dimension for stratum in strata]
    assert (dimensions[0], dimensions[-1]) == (6, 3)
    assert max(np.diff(dimensions)) <= 1


def test_a_descent_on_a_line_is_known_exactly():
    """Down a slope to a floor, then along the floor to its lowest point."""
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    found = descent(Polyhedron(M, {"floor": y}), y + x**2 / 20, [2.0, 1.0])
    assert found.certificate.point == pytest.approx([0, 0], abs=1e-12)
    # Without a floor x' = -x/10, y' = -1 from (2, 1): it is reached at x = 2 exp(-1/10).
    grounded = found.points[found.points[:, 1] < 1e-12][0]
    assert grounded[0] == pytest.approx(2 * math.exp(-0.1), rel=0.05)
    assert (np.diff(found.points[:, 0]) <= 0).all()


def test_a_descent_begins_at_the_nearest_point_of_the_polyhedron():
    overlapping = DRUM.nested("L", clearance=-0.5)
    assert not DRUM.polyhedron.contains(overlapping)
    found = descent(DRUM.polyhedron, DRUM.energy, overlapping)
    assert DRUM.polyhedron.implicit(found.points[0]) > -1e-8
    M = Manifold.euclidean("x")
    (x,) = M.symbols
    nowhere = descent(Polyhedron(M, {"low": x - 1, "high": -x - 1}), x, [0.0])
    assert nowhere.points.tolist() == [[0.0]]
    assert nowhere.certificate.verdict.name == "INFEASIBLE"
