"""The container: a last line with kind, version and digest, in every format."""

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import __version__
from polycorner.container import BINARY, JSON, XML, FileKind, number, read_number

KIND = FileKind("thing", "save_thing", JSON)
CONTENT = {"name": "x", "values": [1.5, -0.0, 1e-300], "nested": {"deep": None}}
REFUSAL = r"^path: expected a thing that save_thing wrote; .*thing\.json "


def test_entries_are_read_back_and_any_reader_of_json_sees_them(tmp_path):
    path = KIND.save_json(tmp_path / "new" / "folder" / "thing.json", CONTENT)
    read = KIND.load_json(path)
    assert {name: read[name] for name in CONTENT} == CONTENT
    assert read["written by"]["polycorner"] == __version__
    written = json.loads(path.read_text())
    kind, version, *_ = written.pop("polycorner").split()
    assert (written, kind, version) == (read, "thing", "1")


@pytest.mark.parametrize("around", [JSON, XML, BINARY])
@given(body=st.binary(max_size=300))
def test_any_bytes_are_read_back(tmp_path_factory, around, body):
    kind = replace(KIND, around=around)
    path = kind.save(tmp_path_factory.mktemp("any") / "thing.json", body)
    assert kind.load(path) == body


def test_arrays_are_read_back_and_numpy_sees_them(tmp_path):
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array("word"), "c": np.zeros(0)}
    kind = replace(KIND, around=BINARY)
    path = kind.save_arrays(tmp_path / "thing.npz", arrays)
    for read in (kind.load_arrays(path), np.load(path)):
        assert list(read) == list(arrays)
        for name, array in arrays.items():
            np.testing.assert_array_equal(read[name], array, strict=True)
    with pytest.raises(ValueError, match="Object arrays cannot be loaded"):
        kind.load_arrays(kind.save_arrays(path, {"code": np.array([print])}))


def header(shape, kind="<f8"):
    return f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"


def npy(shape, numbers=b"", kind="<f8"):
    """Return an array as NumPy writes it, of a declared shape."""
    text = header(shape, kind).encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + numbers


@pytest.mark.parametrize(
    ("content", "packing"),
    [
        (npy("(10**12,)"), zipfile.ZIP_STORED),
        (npy("(1000000000000,)"), zipfile.ZIP_STORED),
        (npy("(-1,)", bytes(8)), zipfile.ZIP_STORED),
        (npy("(3,)", bytes(8)), zipfile.ZIP_STORED),
        (npy("(1,)", bytes(8), "|O"), zipfile.ZIP_STORED),
        (npy("(1,)", bytes(8), "V999999999999"), zipfile.ZIP_STORED),
        (npy("(" * 3000), zipfile.ZIP_STORED),
        (b"nothing", zipfile.ZIP_STORED),
        (npy("(1000000,)", bytes(8000000)), zipfile.ZIP_DEFLATED),
        (npy("(1,)", bytes(8)), zipfile.ZIP_BZIP2),
    ],
)
def test_archives_that_declare_more_than_they_hold_are_refused(tmp_path, content, packing):
    kind, memory = replace(KIND, around=BINARY), io.BytesIO()
    with zipfile.ZipFile(memory, "w", packing) as archive:
        archive.writestr("a.npy", content)
    path = kind.save(tmp_path / "thing.json", memory.getvalue())
    with pytest.raises(ValueError, match=REFUSAL + "is damaged"):
        kind.load_arrays(path)


@pytest.mark.parametrize(
    "text",
    [
        b'{"a": ' + b"[" * 100_000 + b"]" * 100_000 + b",",
        b'{"a": ' + b"9" * 5000 + b",",
        b'{"a": NaN,',
        b'{"a": "\xff",',
        b'{"a": 1, "b",',
        b"",
    ],
)
def test_json_that_python_cannot_read_is_refused(tmp_path, text):
    path = KIND.save(tmp_path / "thing.json", text)
    with pytest.raises(ValueError, match=REFUSAL + "is damaged") as told:
        KIND.load_json(path)
    assert len(str(told.value)) < 1000


@pytest.mark.parametrize("around", [JSON, XML, BINARY])
def test_every_flipped_bit_is_noticed(tmp_path, around):
    kind = replace(KIND, around=around)
    path = kind.save(tmp_path / "thing.json", b"some content\n")
    whole = path.read_bytes()
    for position in range(8 * len(whole)):
        content = bytearray(whole)
        content[position // 8] ^= 1 << position % 8
        path.write_bytes(content)
        with pytest.raises(ValueError, match=REFUSAL):
            kind.load(path)


@pytest.mark.parametrize("around", [JSON, XML, BINARY])
def test_every_other_length_is_noticed(tmp_path, around):
    kind = replace(KIND, around=around)
    path = kind.save(tmp_path / "thing.json", b"some content\n")
    whole = path.read_bytes()
    for content in (*(whole[:n] for n in range(len(whole))), whole + b"\n", whole + whole):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=REFUSAL):
            kind.load(path)


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b'{"other": 1}\n', b"\0" * 4096, b"\xff\xfe"])
def test_other_files_are_something_else(tmp_path, text):
    (tmp_path / "thing.json").write_bytes(text)
    with pytest.raises(ValueError, match=REFUSAL + "is something else"):
        KIND.load(tmp_path / "thing.json")


def test_another_kind_and_a_newer_version_are_named(tmp_path):
    path = replace(KIND, name="heap").save_json(tmp_path / "thing.json", CONTENT)
    with pytest.raises(ValueError, match=REFUSAL + "is a heap$"):
        KIND.load_json(path)
    replace(KIND, version=4).save_json(path, CONTENT)
    told = f"has version 4, and polycorner {__version__} reads up to version 1$"
    with pytest.raises(ValueError, match=REFUSAL + told):
        KIND.load_json(path)


@given(st.floats())
def test_every_number_survives(x):
    again = read_number(json.loads(json.dumps(number(x), allow_nan=False)))
    assert repr(again) == repr(x)  # nan and the sign of zero as well


@pytest.mark.parametrize("written", ["word", True, None, [1.0]])
def test_only_numbers_are_read_as_numbers(written):
    with pytest.raises((KeyError, TypeError)):
        read_number(written)
