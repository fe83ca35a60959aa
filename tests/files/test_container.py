"""Files that tell when they were changed."""

import hashlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import __version__
from polycorner.files.container import (
    Kind,
    load_json,
    number,
    read_number,
    save_json,
    sealed,
    unsealed,
)

KIND = Kind("a thing", "save_thing", "polycorner thing", schema=3, unsealed=1)
CONTENT = {"name": "x", "values": [1.5, -0.0, 1e-300], "nested": {"deep": None}}


def test_what_is_saved_is_loaded(tmp_path):
    path = save_json(KIND, tmp_path / "new" / "folder" / "thing.json", CONTENT)
    read = load_json(KIND, path)
    assert {name: read[name] for name in CONTENT} == CONTENT
    assert read["polycorner thing"] == 3
    assert read["written by"]["polycorner"] == __version__
    assert [entry.name for entry in path.parent.iterdir()] == ["thing.json"]


def test_the_layout_may_change_and_nothing_else(tmp_path):
    path = save_json(KIND, tmp_path / "thing.json", CONTENT, indent=2)
    read = json.loads(path.read_text())
    path.write_text(json.dumps(dict(reversed(read.items()))))
    assert load_json(KIND, path) == read
    path.write_text(json.dumps(read | {"name": "y"}))
    with pytest.raises(
        ValueError, match=r"thing\.json was changed after it was written \(digest\)"
    ):
        load_json(KIND, path)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"a": 1', "[]", "3", '{"other": 1}'])
def test_what_is_something_else_is_refused(tmp_path, text):
    path = tmp_path / "thing.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"^path: expected a thing that save_thing wrote; .* is "):
        load_json(KIND, path)


@pytest.mark.parametrize("schema", [0, -1, True, None, "3", 2.0])
def test_a_version_is_a_positive_whole_number(tmp_path, schema):
    path = save_json(KIND, tmp_path / "thing.json", CONTENT | {KIND.key: schema})
    with pytest.raises(ValueError, match="is something else"):
        load_json(KIND, path)


def test_a_newer_file_is_refused_with_both_versions(tmp_path):
    later = Kind(KIND.words, KIND.writer, KIND.key, schema=4)
    path = save_json(later, tmp_path / "thing.json", CONTENT)
    expected = f"has version 4 of polycorner {__version__}, and polycorner {__version__} reads up"
    with pytest.raises(ValueError, match=f"{expected} to version 3"):
        load_json(KIND, path)


def test_a_digest_may_be_missing_in_old_files_only(tmp_path):
    path = tmp_path / "thing.json"
    path.write_text(json.dumps({KIND.key: 1, "name": "x"}))
    assert load_json(KIND, path)["name"] == "x"
    for entries in ({KIND.key: 2}, {KIND.key: 1, "sha256": "0" * 64}):
        path.write_text(json.dumps(entries))
        with pytest.raises(ValueError, match="digest"):
            load_json(KIND, path)


@pytest.mark.parametrize("written", ["NaN", "Infinity", "1e999"])
def test_numbers_that_json_does_not_have_are_refused(tmp_path, written):
    path = save_json(KIND, tmp_path / "thing.json", CONTENT)
    path.write_text(path.read_text().replace("1.5", written))
    with pytest.raises(ValueError, match="digest"):
        load_json(KIND, path)


@given(st.floats())
def test_every_number_survives(x):
    again = read_number(json.loads(json.dumps(number(x), allow_nan=False)))
    assert repr(again) == repr(x)  # nan and the sign of zero as well


@pytest.mark.parametrize("written", ["word", True, None, [1.0]])
def test_what_is_no_number_is_none(written):
    with pytest.raises((KeyError, TypeError)):
        read_number(written)


# -------------------------------------------------------------------------------------------- bytes


@given(st.binary(max_size=200))
def test_a_seal_is_the_digest_of_what_is_before_it(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("sealed") / "thing"
    path.write_bytes(sealed(content))
    assert path.read_bytes().endswith(hashlib.sha256(content).hexdigest().encode() + b"\n")
    assert unsealed(KIND, path) == (content, True)


MARKED = b"polycorner_sealed and more"


@given(st.integers(0, len(sealed(MARKED)) - 1), st.integers(1, 255))
def test_a_byte_that_was_changed_is_noticed(tmp_path_factory, position, change):
    path = tmp_path_factory.mktemp("sealed") / "thing"
    whole = bytearray(sealed(MARKED))
    whole[position] ^= change
    path.write_bytes(bytes(whole))
    with pytest.raises(ValueError, match="was changed after it was written"):
        unsealed(KIND, path)


@pytest.mark.parametrize("length", range(len(b"polycorner_sealed"), len(sealed(MARKED)) + 2))
def test_a_file_that_was_cut_or_grew_is_noticed(tmp_path, length):
    path = tmp_path / "thing"
    whole = sealed(MARKED)
    path.write_bytes((whole + b"..")[:length])
    if length == len(whole):
        assert unsealed(KIND, path) == (MARKED, True)
    else:
        with pytest.raises(ValueError, match="was changed after it was written"):
            unsealed(KIND, path)


def test_bytes_that_never_had_a_seal_have_none(tmp_path):
    path = tmp_path / "thing"
    path.write_bytes(b"something")
    assert unsealed(KIND, path) == (b"something", False)
