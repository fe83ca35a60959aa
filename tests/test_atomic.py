"""Atomic writing: whole or untouched on a full disk, in a read-only folder, after a kill."""

import errno
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from polycorner.atomic import PART, replace_atomically, write_atomically


def full(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def half(path, content):
    with path.open("wb") as file:
        file.write(content[: len(content) // 2])
    full()


def test_a_file_replaces_another_and_leaves_nothing_else(tmp_path):
    path = write_atomically(tmp_path / "new" / "thing.txt", "first")
    assert write_atomically(path, b"second") == path
    assert path.read_bytes() == b"second"
    with replace_atomically(path) as temporary:
        assert temporary.suffix == ".txt"
        assert temporary.parent == path.parent
        temporary.write_text("third")
        assert path.read_bytes() == b"second"
    assert path.read_text() == "third"
    assert [entry.name for entry in path.parent.iterdir()] == ["thing.txt"]


@pytest.mark.parametrize(
    ("name", "instead"),
    [
        ("pathlib.Path.write_bytes", half),
        ("os.fsync", full),
        ("os.replace", full),
        ("pathlib.Path.mkdir", full),
    ],
)
def test_a_full_disk_leaves_the_old_file(tmp_path, monkeypatch, name, instead):
    path = write_atomically(tmp_path / "thing", b"before")
    with monkeypatch.context() as patch:
        patch.setattr(name, instead)
        with pytest.raises(
            OSError, match=r"No space left on device: nothing was written to .*thing$"
        ) as told:
            write_atomically(path, b"something much longer")
    assert told.value.errno == errno.ENOSPC
    assert path.read_bytes() == b"before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["thing"]


@pytest.mark.parametrize("error", [RuntimeError("drawing"), KeyboardInterrupt()])
def test_an_exception_while_writing_passes_and_leaves_the_old_file(tmp_path, error):
    path = write_atomically(tmp_path / "thing", b"before")

    def write():
        with replace_atomically(path) as temporary:
            temporary.write_bytes(b"half")
            raise error

    with pytest.raises(type(error)):
        write()
    assert path.read_bytes() == b"before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["thing"]


def test_an_error_without_a_number_keeps_its_words(tmp_path):
    message = "the encoder failed"
    with (
        pytest.raises(OSError, match=r"^the encoder failed: nothing was written to .*film$"),
        replace_atomically(tmp_path / "film"),
    ):
        raise OSError(message)


def test_a_folder_that_is_a_file_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="nothing was written to"):
        write_atomically(tmp_path / "file" / "thing", b"")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_one_sentence(tmp_path):
    path = write_atomically(tmp_path / "thing", b"before")
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(PermissionError, match="nothing was written to"):
            write_atomically(path, b"after")
    finally:
        tmp_path.chmod(0o700)
    assert path.read_bytes() == b"before"


KILLED = """
import os, signal, sys
from polycorner.atomic import replace_atomically
with replace_atomically(sys.argv[1]) as temporary:
    temporary.write_bytes(b"half of it")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_a_killed_process_leaves_the_old_file(tmp_path):
    path = write_atomically(tmp_path / "thing.nc", b"before")
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == b"before"
    assert all(PART in entry.name for entry in tmp_path.iterdir() if entry != path)


def test_a_symbolic_link_keeps_pointing_to_its_file(tmp_path):
    write_atomically(tmp_path / "real", b"before")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_atomically(tmp_path / "link", b"after")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"after"


def test_permissions_are_those_of_any_new_file(tmp_path):
    usual = tmp_path / "usual"
    usual.touch()
    path = write_atomically(tmp_path / "thing", b"")
    assert Path(path).stat().st_mode == usual.stat().st_mode


def test_a_required_suffix_is_checked(tmp_path):
    with pytest.raises(ValueError, match=r"^path: expected a name ending in \.html; got 'a\.txt'"):
        write_atomically(tmp_path / "a.txt", "", suffix=".html")


WRITES = re.compile(
    r"\.write_text\(|\.write_bytes\(|\.to_netcdf\([^)]*path|open\([^)]*[\"'][wax]b?[\"']"
    r"|(?<!self)(?<!kind)(?<!KIND)\.(?:savefig|export|save)\((?:path|file_name|folder|out|target)\b"
    r"|\.replace\((?:path|target)\)"
)


@pytest.mark.parametrize("package", ["polycorner", "paper_checks"])
def test_every_file_is_written_atomically(package):
    """Nothing in the packages opens a file for writing, or saves under the final name.

    The key of the cache gets its name by a link, so that of several processes one makes it.
    """
    root = Path(__file__).parents[1]
    found = [
        f"{path.relative_to(root)}: {line.strip()}"
        for path in sorted((root / package).rglob("*.py"))
        if path.name != "atomic.py"
        for line in path.read_text().splitlines()
        if not line.lstrip().startswith(">>>")  # of an example, in a folder of its reader
        if WRITES.search(line) and (path.name, line.split(".")[0].strip()) != ("cache.py", "part")
    ]
    assert found == []
