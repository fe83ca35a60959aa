"""The command ``polycorner cache``: where the cache is, how large, and an empty one."""

import json

import commands
import pytest

from polycorner.formulas.cache import cache_folder


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """A cache of its own with two files in it."""
    chosen = tmp_path / "cache"
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(chosen))
    (cache_folder() / "kernels").mkdir()
    (chosen / "kernels" / "a.o").write_bytes(b"12345")
    (chosen / "atlas-0.json").write_text("{}")
    return chosen


def test_folder_and_size_are_shown(capsys, folder):
    code, out, err = commands.run(capsys, "cache")
    assert (code, err) == (0, "")
    assert str(folder) in out
    assert "2 files" in out
    found = commands.answer(capsys, "cache")
    assert found == {"folder": str(folder), "files": 2, "bytes": 7, "cleared": False}


def test_clearing_empties_the_folder(capsys, folder):
    code, out, _ = commands.run(capsys, "cache", "--clear", "--json")
    assert (code, json.loads(out)["files"], json.loads(out)["cleared"]) == (0, 2, True)
    assert list(folder.iterdir()) == []
    assert commands.answer(capsys, "cache")["files"] == 0
