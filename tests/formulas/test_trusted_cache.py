"""Machine code is executed: of the cache only what the user has put there is loaded."""

import os
import shutil
import stat
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest
import sympy as sp

import polycorner
from polycorner import Manifold, SmoothFunction
from polycorner.formulas import cache, machine_code, shapes
from polycorner.formulas.bundles import resolve
from polycorner.formulas.cache import cache_folder, clear_cache, read_code, write_code

ROOT = Path(polycorner.__file__).parents[1]
LINE = Manifold.euclidean("x")
posix = pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache folder of its own, which does not exist yet."""
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path / "own" / "cache"))
    return tmp_path / "own" / "cache"


def made(function=sp.cos):
    """Return the value at 1/2 of a function made anew, and where its machine code came from."""
    shapes.forget()
    f = SmoothFunction("f", function(LINE.symbols[0]), LINE)
    return f.value([0.5]), resolve(f)[0].kernel.compiled(0).origin


def exchanged(files):
    one, two = (file.read_bytes() for file in files)
    files[0].write_bytes(two)
    files[1].write_bytes(one)


def renamed(files):
    shutil.copyfile(files[0], files[1])


def forged(files):
    """Junk with a digest that everybody can compute."""
    for file in files:
        junk = b"\x7fELF" + bytes(2000)
        file.write_bytes(sha256(junk).digest() + junk)


def keyed_elsewhere(files):
    """Junk that the user of another cache has kept."""
    for file in files:
        junk = b"\x7fELF" + bytes(2000)
        file.write_bytes(cache._digest(bytes(32), file.stem, junk) + junk)


@pytest.mark.parametrize("spoil", [exchanged, renamed, forged, keyed_elsewhere])
def test_what_was_not_kept_under_this_name_is_compiled_anew(folder, spoil):
    values = [made(function) for function in (sp.cos, sp.sin)]
    assert [origin for _, origin in values] == ["compiled", "compiled"]
    before = [made(function) for function in (sp.cos, sp.sin)]
    assert [origin for _, origin in before] == ["loaded", "loaded"]
    spoil(sorted(folder.rglob("*.o")))
    after = [made(function) for function in (sp.cos, sp.sin)]
    assert [value for value, _ in after] == [value for value, _ in before]
    assert "compiled" in [origin for _, origin in after]
    assert [made(function)[1] for function in (sp.cos, sp.sin)] == ["loaded", "loaded"]


@pytest.mark.parametrize("spoil", [lambda _: b"", lambda key: key[:-1], lambda key: key + b"\0"])
def test_without_its_key_a_cache_begins_anew(folder, spoil):
    made()
    key = folder / "kernels" / "key"
    key.write_bytes(spoil(key.read_bytes()))
    assert [made()[1], made()[1]] == ["compiled", "loaded"]


@posix
def test_a_key_that_others_may_read_is_replaced(folder):
    made()
    key = folder / "kernels" / "key"
    before = key.read_bytes()
    key.chmod(0o644)
    assert [made()[1], made()[1]] == ["compiled", "loaded"]
    assert key.read_bytes() != before
    assert stat.S_IMODE(key.stat().st_mode) == 0o600


def test_the_key_is_made_again_after_clearing(folder):
    write_code("a", b"code")
    clear_cache()
    assert read_code("a") is None
    write_code("a", b"code")
    assert read_code("a") == b"code"
    assert {file.name for file in (folder / "kernels").iterdir()} == {"a.o", "key"}


MANY = """
import sys
from polycorner.formulas.cache import read_code, write_code
for k in range(30):
    write_code(f"{sys.argv[1]}-{k}", sys.argv[1].encode())
"""


def test_of_processes_that_begin_together_one_makes_the_key(folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    running = [
        subprocess.Popen([sys.executable, "-W", "error", "-c", MANY, str(n)], env=environment)
        for n in range(4)
    ]
    assert [process.wait() for process in running] == [0] * 4
    kept = [read_code(f"{n}-{k}") for n in range(4) for k in range(30)]
    assert kept == [str(n).encode() for n in range(4) for _ in range(30)]
    names = {file.name for file in (folder / "kernels").iterdir()}
    assert names == {"key", *(f"{n}-{k}.o" for n in range(4) for k in range(30))}


@pytest.mark.parametrize(
    "what",
    [
        "__version__",
        "version",
        "platform.python_version",
        "llvmlite.__version__",
        "llvm.get_host_cpu_name",
    ],
)
def test_names_of_code_depend_on_versions_and_processor(monkeypatch, what):
    before, *path, name = machine_code.machine_key(), *what.split(".")
    at = getattr(machine_code, path[0]) if path else machine_code
    other = "0.0.0" if isinstance(getattr(at, name), str) else lambda *_: "0.0.0"
    monkeypatch.setattr(at, name, other)
    assert machine_code.machine_key() != before


# ----------------------------------------------------------------------------------------- folders


@posix
@pytest.mark.parametrize("mode", [0o770, 0o720, 0o707, 0o702, 0o777, 0o1777, 0o2775])
@pytest.mark.parametrize("below", [".", "kernels"])
def test_a_folder_that_others_may_write_in_is_not_read(folder, mode, below):
    place = folder / below
    place.mkdir(parents=True)
    place.chmod(mode)
    cache._prepared.cache_clear()
    with pytest.warns(RuntimeWarning, match=r"may write in it.*POLYCORNER_CACHE_DIR") as caught:
        used = cache_folder()
    assert len(caught) == 1
    assert folder not in (used, *used.parents)
    assert stat.S_IMODE(used.stat().st_mode) == 0o700
    assert [made()[1], made()[1]] == ["compiled", "loaded"]
    assert list(folder.rglob("*.o")) == []


@posix
def test_a_folder_of_somebody_else_is_not_read(folder, monkeypatch):
    folder.mkdir(parents=True)
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    with pytest.warns(RuntimeWarning, match=r"others own .*POLYCORNER_CACHE_DIR"):
        assert cache_folder() != folder


@posix
@pytest.mark.parametrize("mask", [0o000, 0o002, 0o077])
def test_new_folders_are_for_the_user_alone(folder, mask):
    before = os.umask(mask)
    try:
        write_code("a", b"code")
    finally:
        os.umask(before)
    assert read_code("a") == b"code"
    for place in (folder.parent, folder, folder / "kernels"):
        assert stat.S_IMODE(place.stat().st_mode) == 0o700
    assert stat.S_IMODE((folder / "kernels" / "key").stat().st_mode) == 0o600


@posix
def test_a_link_leads_to_a_folder_that_is_judged(folder, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    folder.parent.mkdir()
    folder.symlink_to(elsewhere, target_is_directory=True)
    assert cache_folder() == folder
    cache._prepared.cache_clear()
    elsewhere.chmod(0o777)
    with pytest.warns(RuntimeWarning, match="may write in it"):
        assert cache_folder() != folder


def test_a_relative_folder_does_not_follow_the_working_directory(tmp_path, monkeypatch):
    cache._prepared.cache_clear()
    (tmp_path / "first").mkdir()
    (tmp_path / "second").mkdir()
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", "relative")
    monkeypatch.chdir(tmp_path / "first")
    assert cache_folder() == tmp_path / "first" / "relative"
    monkeypatch.chdir(tmp_path / "second")
    assert cache_folder() == tmp_path / "first" / "relative"
    cache._prepared.cache_clear()


def homeless(path):
    if path.startswith("~"):
        msg = "could not determine the home directory"
        raise RuntimeError(msg)
    return path


@pytest.mark.parametrize(
    "expanded", [str, homeless]
)  # with older and newer versions of platformdirs
def test_without_a_home_a_temporary_folder_serves(tmp_path, monkeypatch, expanded):
    cache._prepared.cache_clear()
    for variable in ("POLYCORNER_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr("os.path.expanduser", expanded)  # no HOME, no entry in passwd
    monkeypatch.chdir(tmp_path)
    with pytest.warns(RuntimeWarning, match=r"no home folder.*POLYCORNER_CACHE_DIR"):
        assert cache_folder().is_dir()
    assert list(tmp_path.iterdir()) == []
    cache._prepared.cache_clear()
