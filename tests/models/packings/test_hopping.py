"""Basin hopping: one seed gives one search, however it is cut, and no file is taken on trust."""

import json

import numpy as np
import pytest

from polycorner.container import FileError
from polycorner.models import CirclesIn, PointsOnSphere, basin_hopping
from polycorner.models.packings.hopping import SEARCHES, CornerDescent
from polycorner.searches import Ending

MODEL = CirclesIn("square", 7)


def test_one_seed_gives_one_search():
    one, other = (basin_hopping(MODEL, 4, hops=6) for _ in range(2))
    assert one.point.tolist() == other.point.tolist()
    assert (one.hops, one.found_after) == (other.hops, other.found_after)
    assert one.ending is Ending.BUDGET


def test_a_search_in_parts_is_the_whole(tmp_path):
    whole = basin_hopping(MODEL, 4, hops=6, patience=2)
    for hops in (2, 3, 6, 6):
        parts = basin_hopping(MODEL, 4, hops=hops, patience=2, keep=tmp_path / "search.json")
        assert parts.hops == hops
    assert parts.point.tolist() == whole.point.tolist()
    assert parts.found_after == whole.found_after


def test_an_interruption_keeps_what_was_found(tmp_path):
    def stop(done, _total, _note):
        if done == 2:
            raise KeyboardInterrupt

    keep = tmp_path / "search.json"
    found = basin_hopping(MODEL, 4, hops=6, keep=keep, progress=stop)
    assert (found.hops, found.ending) == (2, Ending.INTERRUPTED)
    again = basin_hopping(MODEL, 4, hops=6, keep=keep)
    assert again.point.tolist() == basin_hopping(MODEL, 4, hops=6).point.tolist()


def test_a_search_ends_where_it_reaches_a_level():
    found = basin_hopping(CirclesIn("square", 2), 0, hops=50, below=-0.29)
    assert found.ending is Ending.FINISHED
    assert found.hops < 50
    assert found.energy < -0.29


def test_bodies_that_rattle_end_in_the_middle_of_their_room():
    """Seven circles: six are held, and the seventh is moved away from all it could touch."""
    found = basin_hopping(MODEL, 1, hops=100, below=-0.174457630187)
    q, r = found.point, found.point[-1]
    centres = MODEL.centres(q)
    gaps = np.linalg.norm(centres[:, None] - centres, axis=2) - 2 * r + np.eye(7)
    walls = np.minimum(centres, 1 - centres).min(axis=1) - r
    least = np.minimum(gaps.min(axis=1), walls)
    assert (least > 1e-3).sum() == 1
    assert least.min() > -1e-12
    assert found.certificate.is_minimum


@pytest.mark.parametrize(
    "model",
    [CirclesIn("circle", 5, equal=False), PointsOnSphere(6, "tammes")],
    ids=["sum", "sphere"],
)
def test_the_slope_of_soft_functions_is_that_of_their_value(model):
    descent, rng = CornerDescent(model), np.random.default_rng(2)
    q = model.starts(rng, 1)[0]
    weights, stiffness = rng.random(descent.rows.count) + 0.5, 3.0
    u = q / descent.scales + 0.1 * rng.standard_normal(len(q))
    _, slope = descent._soft(u, weights, stiffness)
    errors = []
    direction = rng.standard_normal(len(u))
    for h in (1e-3, 1e-4):
        values = [descent._soft(u + s * h * direction, weights, stiffness)[0] for s in (1, -1)]
        errors.append(abs((values[0] - values[1]) / (2 * h) - slope @ direction))
    assert errors[1] < 1e-5 * max(1.0, abs(slope @ direction))


def test_a_file_of_another_search_is_refused(tmp_path):
    keep = tmp_path / "search.json"
    basin_hopping(MODEL, 4, hops=1, keep=keep)
    with pytest.raises(ValueError, match=r"^keep: expected a search of .*count=8"):
        basin_hopping(CirclesIn("square", 8), 4, hops=2, keep=keep)
    with pytest.raises(ValueError, match=r"^keep: expected .* patience 3"):
        basin_hopping(MODEL, 4, hops=2, patience=3, keep=keep)


@pytest.mark.parametrize(
    ("entry", "value"),
    [
        ("counts", [1, 2]),
        ("counts", [-1, 0, 0]),
        ("points", [[0.1], [0.1]]),
        ("points", [["a"], None]),
        ("points", None),
        ("random", {"bit_generator": "PCG64"}),
        ("random", "dice"),
        ("patience", "many"),
    ],
)
def test_a_changed_file_is_refused(entry, value, tmp_path):
    keep = tmp_path / "search.json"
    basin_hopping(MODEL, 4, hops=1, keep=keep)
    entries = SEARCHES.load_json(keep)
    entries.pop("written by")
    SEARCHES.save_json(keep, json.loads(json.dumps(entries | {entry: value})))
    with pytest.raises(FileError, match="is damaged"):
        basin_hopping(MODEL, 4, hops=2, keep=keep)


@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"hops": 0}, "hops"),
        ({"seconds": 0.0}, "seconds"),
        ({"patience": 0}, "patience"),
        ({"below": float("nan")}, "below"),
    ],
)
def test_wrong_arguments(options, argument):
    with pytest.raises(ValueError, match=f"^{argument}: expected "):
        basin_hopping(MODEL, 0, **options)
    with pytest.raises(TypeError, match=r"^model: expected something with polyhedron"):
        basin_hopping("square")
