"""Every kind of file: changed in a bit, cut, overwritten, newer, or on a full disk."""

import errno
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from kept_files import motion, same_atlas, same_certificate, same_graph, same_motion

from polycorner import Manifold, Polyhedron, minimise, skeleton
from polycorner import files as room
from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics import files as run_files
from polycorner.files import certificates as certificate_files
from polycorner.files import graphs as graph_files
from polycorner.files import skeletons as skeleton_files
from polycorner.files import trajectories as trajectory_files
from polycorner.models import textbook
from polycorner.motion.noise import Noise

M = Manifold.euclidean("x y")
X, Y = M.symbols
BOWL = Polyhedron(M, {"bowl": Y - X**2, "lid": 2 - Y})
BALL = textbook.bouncing_ball(0.5)


@dataclass(frozen=True)
class Sample:
    """A value to save, how, and a check that it came back."""

    value: Any
    save: Callable
    load: Callable
    same: Callable
    module: Any


def certificate():
    value = minimise(BOWL, X + Y, [1.0, 1.5])
    return Sample(
        value, room.save_certificate, room.load_certificate, same_certificate, certificate_files
    )


def atlas():
    value = skeleton(BOWL, [[0.0, 1.0]])
    return Sample(value, room.save_skeleton, room.load_skeleton, same_atlas, skeleton_files)


def graph():
    value = skeleton(BOWL, [[0.0, 1.0]])

    def same(read, saved):
        same_graph(read, room.skeleton_graph(saved))

    return Sample(value, room.save_graph, room.load_graph, same, graph_files)


def trajectory():
    def load(path):
        return room.load_trajectory(path, BALL)

    value = motion(BALL, 1, 1, "floor")
    return Sample(value, room.save_trajectory, load, same_motion, trajectory_files)


def run():
    drum = DumbbellDrum(floor=True, top=60.0, tilt=0.5, spin=0.02)
    path = motion(drum, 1, 4, "floor1")
    noise = Noise(chatter=0.3, kicks={"phi": 1e-3}, kick_time=0.02, seed=7)
    value = replace(path, noise=noise, every=20, t_end=0.8)
    return Sample(value, run_files.save_run, run_files.load_run, same_motion, run_files)


@pytest.fixture(scope="module", params=[certificate, atlas, graph, trajectory, run])
def sample(request):
    return request.param()


@pytest.fixture(scope="module")
def whole(sample, tmp_path_factory):
    """Return the bytes of the file."""
    return sample.save(sample.value, tmp_path_factory.mktemp("whole") / "file").read_bytes()


def refused(sample, content, folder):
    """Check that bytes are refused in one sentence that names the file."""
    path = folder / "file"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"^path: expected a ") as told:
        sample.load(path)
    assert str(path) in str(told.value)
    assert "\n" not in str(told.value)


def test_the_value_comes_back_to_the_last_bit(sample, tmp_path):
    path = sample.save(sample.value, tmp_path / "new" / "folder" / "file")
    sample.same(sample.load(path), sample.value)
    assert [entry.name for entry in path.parent.iterdir()] == ["file"]


@given(data=st.data())
def test_a_single_flipped_bit_is_noticed(sample, whole, tmp_path_factory, data):
    content = bytearray(whole)
    position = data.draw(st.integers(0, 8 * len(content) - 1))
    content[position // 8] ^= 1 << position % 8
    refused(sample, bytes(content), tmp_path_factory.mktemp("flipped"))


@given(data=st.data())
def test_a_piece_that_was_overwritten_is_noticed(sample, whole, tmp_path_factory, data):
    """Zeros or other bytes over a stretch, as disks and transfers leave them."""
    start = data.draw(st.integers(0, len(whole) - 1))
    piece = data.draw(st.one_of(st.just(bytes(512)), st.binary(min_size=1, max_size=64)))
    content = (whole[:start] + piece + whole[start + len(piece) :])[: len(whole)]
    if content != whole:
        refused(sample, content, tmp_path_factory.mktemp("piece"))


@given(share=st.floats(0, 1, exclude_max=True))
def test_a_file_that_was_cut_is_noticed(sample, whole, tmp_path_factory, share):
    refused(sample, whole[: int(share * len(whole))], tmp_path_factory.mktemp("cut"))


@pytest.mark.parametrize("content", [b"", b"\0" * 4096, b"{}", b"\x89HDF\r\n\x1a\n" + bytes(600)])
def test_other_bytes_are_something_else(sample, tmp_path, content):
    refused(sample, content, tmp_path)


def test_a_newer_file_is_refused_naming_both_versions(sample, tmp_path, monkeypatch):
    kind = sample.module.KIND
    with monkeypatch.context() as patch:
        patch.setattr(sample.module, "KIND", replace(kind, version=kind.version + 1))
        path = sample.save(sample.value, tmp_path / "file")
    told = rf"has version {kind.version + 1}, .* reads up to version {kind.version}$"
    with pytest.raises(ValueError, match=told):
        sample.load(path)


def test_a_file_of_another_kind_is_refused_naming_it(sample, tmp_path):
    other = trajectory() if sample.module is certificate_files else certificate()
    path = other.save(other.value, tmp_path / "file")
    with pytest.raises(ValueError, match=r"^path: expected a .*file is "):
        sample.load(path)


def full(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("name", ["pathlib.Path.write_bytes", "os.fsync", "os.replace"])
def test_a_full_disk_leaves_the_old_file(sample, tmp_path, monkeypatch, name):
    path = sample.save(sample.value, tmp_path / "file")
    before = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(name, full)
        with pytest.raises(OSError, match=r"nothing was written to .*file$") as told:
            sample.save(sample.value, path)
    assert told.value.errno == errno.ENOSPC
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_other_programs_read_the_files(tmp_path):
    """The last line is an entry, a comment, or bytes after the end."""
    import json

    import networkx as nx
    import xarray as xr

    for make in (certificate, atlas):
        sample = make()
        assert json.loads(sample.save(sample.value, tmp_path / "file").read_text())["written by"]
    sample = graph()
    nx.read_graphml(sample.save(sample.value, tmp_path / "file"))
    sample = trajectory()
    with xr.open_dataset(sample.save(sample.value, tmp_path / "file"), engine="h5netcdf") as data:
        np.testing.assert_array_equal(data.q, sample.value.q)
