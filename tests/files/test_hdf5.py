"""NetCDF files that lead to other files, or declare what they do not hold, are refused unread."""

import io

import h5py
import numpy as np
import pytest
from kept_files import motion

from polycorner.files import load_trajectory, save_trajectory
from polycorner.files.motions import check_structure
from polycorner.files.trajectories import KIND
from polycorner.models import textbook

BALL = textbook.bouncing_ball(0.5)
SECRET = np.arange(9.0) + 0.125


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "path.nc"
    return KIND.load(save_trajectory(motion(BALL, 1, 1, "floor"), path))


def replaced(file, name, make):
    """Make a dataset anew under its name, with its attributes and its scales."""
    old = file[name]
    attributes, scales = dict(old.attrs), [dimension[0] for dimension in old.dims]
    del file[name]
    new = make()
    for key, value in attributes.items():
        if key not in ("DIMENSION_LIST", "REFERENCE_LIST"):
            new.attrs[key] = value
    for k, scale in enumerate(scales):
        new.dims[k].attach_scale(scale)


def external(file, folder):
    (folder / "secret").write_bytes(SECRET.tobytes())
    where = [(str(folder / "secret"), 0, SECRET.nbytes)]
    replaced(file, "q", lambda: file.create_dataset("q", (9, 1, 1), "f8", external=where))


def linked(file, folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["q"] = SECRET.reshape(9, 1, 1)
    del file["q"]
    file["q"] = h5py.ExternalLink(str(folder / "other.h5"), "q")


def virtual(file, folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["q"] = SECRET.reshape(9, 1, 1)
    layout = h5py.VirtualLayout((9, 1, 1), "f8")
    layout[...] = h5py.VirtualSource(str(folder / "other.h5"), "q", (9, 1, 1))
    replaced(file, "q", lambda: file.create_virtual_dataset("q", layout))


def loop(file, _):
    file["loop"] = h5py.SoftLink("/loop")


def soft(file, _):
    del file["q"]
    file["q"] = h5py.SoftLink("/v")


def group(file, _):
    file.create_group("more")


def circle(file, _):
    file.create_group("more")["again"] = file["/"]


def named_type(file, _):
    file["kind"] = np.dtype("f8")


def huge(file, _):
    make = file.create_dataset
    replaced(file, "q", lambda: make("q", (10**12, 1, 1), "f8", chunks=(9, 1, 1)))


def empty(file, _):
    replaced(file, "q", lambda: file.create_dataset("q", (9, 1, 1), "f8", chunks=(9, 1, 1)))


def chunk(file, _):
    def make():
        return file.create_dataset("q", (9, 1, 1), "f8", chunks=(99, 1, 1), maxshape=(None, 1, 1))

    replaced(file, "q", make)


def lists(file, _):
    kind = h5py.vlen_dtype(np.dtype("f8"))
    replaced(file, "q", lambda: file.create_dataset("q", (9, 1, 1), kind))


def references(file, _):
    replaced(file, "q", lambda: file.create_dataset("q", (9, 1, 1), h5py.ref_dtype))


def compound(file, _):
    kind = np.dtype([("a", "f8"), ("b", "i4")])
    replaced(file, "q", lambda: file.create_dataset("q", (9, 1, 1), kind))


def packed(file, _):
    replaced(file, "q", lambda: file.create_dataset("q", data=SECRET[:, None, None], scaleoffset=2))


def attribute(file, _):
    file.attrs["more"] = np.array([file["v"].ref], dtype=h5py.ref_dtype)


STRUCTURES = [external, linked, virtual, loop, soft, group, circle, named_type, huge, empty, chunk]
STRUCTURES += [lists, references, compound, packed, attribute]


def not_a_number(file, _):
    file["q"][3] = np.nan


def infinite(file, _):
    file["kinetic"][3] = np.inf


def backwards(file, _):
    file["time"][:] = file["time"][:][::-1]


def stranger(file, _):
    file["touch_body_1"][0] = 10**12


def earlier(file, _):
    file["touch_instant"][0] = -1


def unknown(file, _):
    file["event_kind"][0] = 99


def longer(file, _):
    replaced(file, "q", lambda: file.create_dataset("q", data=np.zeros((9, 1, 1), "i8")))


def no_step(file, _):
    file.attrs["dt"] = -1.0


def deep(file, _):
    file.attrs["system"] = "[" * 100_000


NUMBERS = [not_a_number, infinite, backwards, stranger, earlier, unknown, longer, no_step, deep]


@pytest.mark.parametrize("change", [*STRUCTURES, *NUMBERS])
def test_forged_files_are_refused_in_one_sentence(content, tmp_path, change):
    memory = io.BytesIO(content)
    with h5py.File(memory, "r+") as file:
        change(file, tmp_path)
    path = KIND.save(tmp_path / "path.nc", memory.getvalue())
    with pytest.raises(ValueError, match=r"^path: expected a trajectory") as told:
        load_trajectory(path, BALL)
    assert f"{path} is damaged" in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("change", STRUCTURES)
def test_structures_are_refused_before_anything_is_read(content, tmp_path, monkeypatch, change):
    memory = io.BytesIO(content)
    with h5py.File(memory, "r+") as file:
        change(file, tmp_path)

    def read(*_):
        pytest.fail("a dataset was read")

    with monkeypatch.context() as patch:
        patch.setattr(h5py.Dataset, "__getitem__", read)
        with pytest.raises(ValueError, match=r"^(q|loop|more|kind|/: more) "):
            check_structure(memory.getvalue(), memory)


def test_a_file_as_it_was_written_has_nothing_else(content):
    check_structure(content, io.BytesIO(content))
