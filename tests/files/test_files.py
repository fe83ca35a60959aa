"""Every kind of file: changed, cut, newer, or on a full disk."""

import errno
import gzip
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from kept_files import same_atlas, same_certificate, same_motion, same_run

from polycorner import Manifold, Polyhedron, minimise, simulate, skeleton
from polycorner import files as door
from polycorner.dumbbells.dynamics import files as drum_files
from polycorner.files import certificates as certificate_files
from polycorner.files import skeletons as atlas_files
from polycorner.files import trajectories as trajectory_files
from polycorner.models import textbook as scenes

OLD = Path(__file__).parents[1] / "data" / "run_v1.nc.gz"
M = Manifold.euclidean("x y")
X, Y = M.symbols
BOWL = Polyhedron(M, {"bowl": Y - X**2, "lid": 2 - Y})
BALL = scenes.bouncing_ball(0.5)


@dataclass(frozen=True)
class Sample:
    """Something to save, how, and how to see that it came back."""

    value: Any
    save: Callable
    load: Callable
    same: Callable
    home: Any


def certificate(_):
    return Sample(
        minimise(BOWL, X + Y, [1.0, 1.5]),
        door.save_certificate,
        lambda path: door.load_certificate(path, BOWL, X + Y),
        same_certificate,
        certificate_files,
    )


def atlas(_):
    return Sample(
        skeleton(BOWL, [[0.0, 1.0]]),
        door.save_skeleton,
        lambda path: door.load_skeleton(path, BOWL),
        same_atlas,
        atlas_files,
    )


def trajectory(_):
    return Sample(
        simulate(BALL, BALL.state([1.0]), 1.0, 1e-3, every=100),
        door.save_trajectory,
        lambda path: door.load_trajectory(path, BALL),
        same_motion,
        trajectory_files,
    )


def run(folder):
    path = folder / "old.nc"
    path.write_bytes(gzip.decompress(OLD.read_bytes()))
    load, save = drum_files.load_run, drum_files.save_run
    return Sample(load(path), save, load, same_run, drum_files)


@pytest.fixture(scope="module", params=[certificate, atlas, trajectory, run])
def sample(request, tmp_path_factory):
    return request.param(tmp_path_factory.mktemp("sample"))


@pytest.fixture(scope="module")
def whole(sample, tmp_path_factory):
    """Return the bytes of the file."""
    return sample.save(sample.value, tmp_path_factory.mktemp("whole") / "file").read_bytes()


def loaded_or_refused(sample, content, folder):
    """Check that bytes give either the very value or one sentence; return which."""
    path = folder / "file"
    path.write_bytes(content)
    try:
        read = sample.load(path)
    except ValueError as error:
        sentence = str(error)
        assert sentence.startswith("path: expected ")
        assert str(path) in sentence
        assert "\n" not in sentence
        return False
    sample.same(read, sample.value)
    return True


def test_the_file_itself_is_loaded(sample, whole, tmp_path):
    assert loaded_or_refused(sample, whole, tmp_path)


@given(data=st.data())
def test_bytes_changed_anywhere_are_noticed(sample, whole, tmp_path_factory, data):
    content = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] ^= data.draw(st.integers(1, 255))
    loaded_or_refused(sample, bytes(content), tmp_path_factory.mktemp("changed"))


@given(share=st.floats(0, 1))
def test_a_file_that_was_cut_is_noticed(sample, whole, tmp_path_factory, share):
    length = int(share * len(whole))
    loaded = loaded_or_refused(sample, whole[:length], tmp_path_factory.mktemp("cut"))
    assert not loaded or length >= len(whole) - 1  # JSON may lack its last line's end


@given(lost=st.integers(2, 300))
def test_a_file_that_lacks_its_end_is_noticed(sample, whole, tmp_path_factory, lost):
    assert not loaded_or_refused(sample, whole[:-lost], tmp_path_factory.mktemp("cut"))


@given(data=st.data())
def test_a_piece_that_was_overwritten_is_noticed(sample, whole, tmp_path_factory, data):
    """Zeros or other bytes over a stretch, as disks and transfers leave them."""
    start = data.draw(st.integers(0, len(whole) - 1))
    piece = data.draw(st.one_of(st.just(bytes(512)), st.binary(min_size=1, max_size=64)))
    content = (whole[:start] + piece + whole[start + len(piece) :])[: len(whole)]
    loaded = loaded_or_refused(sample, content, tmp_path_factory.mktemp("piece"))
    assert not loaded or content.split() == whole.split()


@pytest.mark.parametrize("content", [b"", b"\0" * 4096, b"{}", b"\x89HDF\r\n\x1a\n" + bytes(600)])
def test_other_bytes_are_something_else(sample, tmp_path, content):
    assert not loaded_or_refused(sample, content, tmp_path)


def test_a_newer_file_is_refused_naming_both_versions(sample, tmp_path, monkeypatch):
    kind = sample.home.KIND
    with monkeypatch.context() as patch:
        patch.setattr(sample.home, "KIND", replace(kind, schema=kind.schema + 1))
        path = sample.save(sample.value, tmp_path / "file")
    told = rf"has version {kind.schema + 1} of polycorner .* reads up to version {kind.schema}$"
    with pytest.raises(ValueError, match=told):
        sample.load(path)


def full(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("name", ["pathlib.Path.write_bytes", "os.fsync", "os.replace"])
def test_a_full_disk_is_one_sentence_and_leaves_nothing(sample, tmp_path, monkeypatch, name):
    with monkeypatch.context() as patch:
        patch.setattr(name, full)
        with pytest.raises(
            OSError, match="No space left on device: nothing was written to"
        ) as told:
            sample.save(sample.value, tmp_path / "file")
    assert told.value.errno == errno.ENOSPC
    assert not list(tmp_path.iterdir())


def test_every_byte_of_a_small_file_counts(tmp_path):
    """A bit of every byte, and every length: only what JSON does not mind goes through."""
    sample = certificate(None)
    whole = sample.save(sample.value, tmp_path / "file").read_bytes()
    for place in range(len(whole)):
        content = bytearray(whole)
        content[place] ^= 1 << place % 8
        if loaded_or_refused(sample, bytes(content), tmp_path):
            assert json.loads(content) == json.loads(whole)
    kept = [n for n in range(len(whole)) if loaded_or_refused(sample, whole[:n], tmp_path)]
    assert kept == [len(whole) - 1]
