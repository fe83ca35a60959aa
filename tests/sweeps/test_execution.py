"""Studies against the loop over their points; random streams, failures, provenance."""

import itertools
import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import sweep_functions
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from polycorner.sweeps import sweep

GRID = {"a": ([0, 1, 2], "mm"), "b": [1, 2, 3, 4]}


def plain(found):
    """Return what does not depend on when and where it was computed."""
    return found.load().drop_vars("seconds").drop_attrs(deep=False)


axes = st.lists(st.integers(-50, 50), min_size=1, max_size=5, unique=True)


@given(axes, axes, axes)
def test_a_study_is_the_loop_over_all_combinations(a, b, c):
    def function(a, b, c):
        return {"value": a + 1000 * b - 7 * c}

    found = sweep(function, {"a": a, "b": b, "c": c})
    expected = [function(*point)["value"] for point in itertools.product(a, b, c)]
    assert found["value"].values.ravel().tolist() == expected
    assert found["value"].dims == ("a", "b", "c")
    assert [found[name].values.tolist() for name in "abc"] == [a, b, c]


def test_numbers_arrays_texts_and_units():
    found = sweep(sweep_functions.mixed, GRID)
    at = found.sel(a=2, b=3)
    assert (at["total"], at["odd"], at["name"].item()) == (32, 0, "2/3")
    assert at["row"].values.tolist() == [0, 1 / 3, 2 / 3]
    assert at["row"].dims == ("row_0",)
    assert (found["total"].attrs, found["a"].attrs) == ({"units": "mm"}, {"units": "mm"})


def test_a_point_that_fails_is_a_row_with_its_sentence():
    found = sweep(sweep_functions.mixed, GRID)
    failed = found["status"] == 2
    assert int(failed.sum()) == 1
    at = found.sel(a=1, b=2)
    assert at["message"].item() == "ValueError: b: expected anything but 2; got 2"
    assert np.isnan(at["total"])
    assert np.isnan(at["row"]).all()
    assert at["name"].item() == ""
    assert (found["message"].values == "").sum() == failed.size - 1
    assert (found["seconds"] >= 0).all()


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        ([1.0], "expected a mapping"),
        ({}, "expected a mapping"),
        ({"x": object()}, "x: expected a number, an array of numbers or a text"),
        ({"x": 1j}, "x: expected a number"),
        ({"x": 2**60}, "x: expected whole numbers up to 2^53"),
        ({"status": 1.0}, "expected names of results"),
        ({"a": 1.0}, "expected names of results"),
        ({"no/name": 1.0}, "expected names of results"),
    ],
)
def test_results_that_cannot_be_kept_are_failures_that_say_so(returned, words):
    found = sweep(lambda a: returned if a else {}, {"a": [1]})
    assert found["status"].values.tolist() == [2]
    assert words in found["message"].values[0]
    assert set(found.data_vars) == {"status", "message", "seconds"}


def test_results_that_change_their_kind_fail_where_they_do():
    def function(a):
        return {0: {"x": 1.0, "y": 2.0}, 1: {"y": 2.0, "x": 1.0}, 2: {"x": 1.0}}.get(
            a, {"x": [1.0, 2.0], "y": 2.0}
        )

    found = sweep(function, {"a": range(4)})
    assert found["status"].values.tolist() == [1, 1, 2, 2]
    assert found["y"].values[:2].tolist() == [2.0, 2.0]
    assert "expected x, y, as at other points; it returned x[2], y" in found["message"].values[3]


def test_leaving_python_is_a_failure_too():
    def function(a):
        raise SystemExit(a)

    assert sweep(function, {"a": [3]})["message"].values[0] == "SystemExit: 3"


# ------------------------------------------------------------------------------- random streams


@given(st.integers(0, 2**63 - 1))
def test_every_point_has_the_stream_its_number_spawns(seed):
    found = sweep(sweep_functions.drawn, {"a": range(2), "b": range(3)}, rng=seed)
    children = np.random.SeedSequence(seed).spawn(6)
    expected = [np.random.default_rng(child).normal() for child in children]
    assert found["x"].values.ravel().tolist() == expected
    assert found.attrs["seed"] == seed


def test_the_default_seed_is_zero_and_a_generator_gives_one():
    grid = {"a": [1], "b": [2, 3]}
    first = sweep(sweep_functions.drawn, grid)
    assert first.attrs["seed"] == 0
    assert "rng" not in first.attrs["fixed"]
    xr.testing.assert_identical(plain(first), plain(sweep(sweep_functions.drawn, grid, rng=0)))
    drawn = sweep(sweep_functions.drawn, grid, rng=np.random.default_rng(7)).attrs["seed"]
    assert drawn == np.random.default_rng(7).integers(2**63)


@pytest.mark.parametrize("workers", [1, 3, 40])
def test_results_do_not_depend_on_the_number_of_workers(workers):
    grid = {"a": range(8), "b": range(9)}
    with ThreadPoolExecutor(workers) as pool:
        found = sweep(sweep_functions.drawn, grid, executor=pool, rng=3)
    xr.testing.assert_identical(plain(found), plain(sweep(sweep_functions.drawn, grid, rng=3)))


# ---------------------------------------------------------------------------------- provenance


def test_the_dataset_tells_where_it_is_from(tmp_path):
    found = sweep(sweep_functions.drawn, {"a": ([1.5], "mm"), "b": [2]}, rng=1, fixed={"pause": 0})
    assert found.attrs["function"] == "sweep_functions:drawn"
    assert json.loads(found.attrs["fixed"]) == {"pause": 0}
    assert json.loads(found.attrs["versions"])[0]["numpy"] == np.__version__
    assert json.loads(found.attrs["study"])["axes"][0] == {
        "name": "a", "unit": "mm", "values": [1.5]
    }  # fmt: skip
    assert found.attrs["complete"] == "finished"
    assert found.attrs["polycorner_sweep"] == 2
    assert found.attrs["command"]
    found.to_netcdf(tmp_path / "found.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "found.nc", engine="h5netcdf") as back:
        assert back["x"].values.tolist() == found["x"].values.tolist()
        assert back.attrs["seed"] == 1


def test_progress_counts_up_to_all_points():
    reports = []
    sweep(sweep_functions.mixed, GRID, progress=lambda *report: reports.append(report))
    assert reports[0] == (0, 12, "")
    assert reports[-1] == (12, 12, "1 failed")
    assert [done for done, _, _ in reports] == sorted(done for done, _, _ in reports)
