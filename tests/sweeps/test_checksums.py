"""Integrity of stores: every changed bit and every missing file is found, and the file is named."""

import shutil

import numpy as np
import pytest
import sweep_functions
from hypothesis import given
from hypothesis import strategies as st

from polycorner.sweeps import open_results, sweep

GRID = {"a": ([0, 1, 2], "mm"), "b": [1, 2, 3, 4], "h": ["R", "L"]}


def function(a, b, h):
    return sweep_functions.mixed(a, b) | {"hand": h}


@pytest.fixture(scope="module", params=["finished", "interrupted"])
def store(request, tmp_path_factory):
    """A store; of an interrupted study, the last points are pending."""
    path = tmp_path_factory.mktemp("store") / "s"
    if request.param == "finished":
        sweep(function, GRID, store=path)
        return path

    def stop(done, _total, _note):
        if done > 15:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(function, GRID, store=path, progress=stop)
    return path


def files(store):
    return sorted(file for file in store.rglob("*") if file.is_file())


def refused(store, file):
    """Both ways to use a store refuse it and name the file."""
    for use in (open_results, lambda path: sweep(function, GRID, store=path)):
        with pytest.raises(ValueError, match="store: expected") as error:
            use(store)
        assert str(file) in str(error.value)


@given(st.data())
def test_every_flipped_bit_is_found(store, data):
    file = data.draw(st.sampled_from(files(store)))
    content = file.read_bytes()
    bit = data.draw(st.integers(0, 8 * len(content) - 1))
    changed = bytearray(content)
    changed[bit // 8] ^= 1 << bit % 8
    try:
        file.write_bytes(changed)
        refused(store, file)
    finally:
        file.write_bytes(content)


@given(st.data())
def test_files_that_are_cut_are_found(store, data):
    file = data.draw(st.sampled_from(files(store)))
    content = file.read_bytes()
    try:
        file.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
        refused(store, file)
    finally:
        file.write_bytes(content)


def test_missing_files_of_a_finished_study_are_found(tmp_path):
    sweep(function, GRID, store=tmp_path / "s")
    for file in files(tmp_path / "s"):
        store = shutil.copytree(tmp_path / "s", tmp_path / "copy", dirs_exist_ok=True)
        missing = store / file.relative_to(tmp_path / "s")
        missing.unlink()
        array = store / missing.relative_to(store).parts[0]
        if missing.name == "zarr.json" and missing.parent == store:
            with pytest.raises(ValueError, match="cannot be read"):
                open_results(store)
        else:
            refused(store, array)
        shutil.rmtree(store)


def test_what_is_intact_opens(store):
    found = open_results(store)
    done = found["status"].values == 1
    whole = sweep(function, GRID)
    np.testing.assert_array_equal(found["total"].values[done], whole["total"].values[done])
