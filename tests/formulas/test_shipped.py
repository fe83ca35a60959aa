"""Compiled functions whose intermediate code a package contains."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import polycorner
from polycorner.formulas.tables import Layout
from polycorner.measures.chain.intermediate import SHIPPED as CHAIN
from polycorner.minimisation.descent.intermediate import SHIPPED as DESCENT
from polycorner.motion.engine.intermediate import SHIPPED as ENGINE
from polycorner.motion.hulls.intermediate import SHIPPED as HULLS
from polycorner.proofs.lists.intermediate import SHIPPED as LISTS

ALL = {shipped.file: shipped for shipped in (CHAIN, DESCENT, LISTS, HULLS, *ENGINE.values())}


@pytest.mark.parametrize("shipped", ALL.values(), ids=ALL)
def test_the_package_contains_the_code_as_it_is(shipped):
    """After a change of what is compiled, `make intermediate` makes it anew."""
    assert shipped.text.startswith(shipped.head)


@pytest.mark.parametrize("shipped", ALL.values(), ids=ALL)
def test_what_the_package_contains_is_for_any_machine(shipped):
    """No path of a file, no instruction of one processor, no address of an object of Python."""
    code = shipped.text.removeprefix(shipped.head)
    for name in shipped.names:
        assert f"@{name}(" in code
    for words in (".py", "/", "llvm.x86", "target triple", "inttoptr (i64", "@Py", "@NRT"):
        assert words not in code.replace("@NRT_incref", "").replace("@NRT_decref", "")


LEAF = """
import numpy as np
from polycorner.formulas.linking import linked

@linked()
def quotient(x):
    parts = np.zeros(3, np.int64)
    parts[1] = {factor} * 60
    return parts.sum() // x
"""
ENTRIES = """
import numpy as np
from polycorner.formulas.intermediate import intermediate_code
from polycorner.formulas.linking import linked
from leaves import leaf

@linked()
def divide(x):
    return leaf.quotient(x), np.int64(7)

@linked()
def twice(x):
    return leaf.quotient(x) + leaf.quotient(x), x

def made():
    print("made")
    return intermediate_code({"divide": divide, "twice": twice}, arguments=1)
"""
START = """
import sys
from polycorner.formulas.cache import cache_folder
from polycorner.formulas.shipped import Shipped

def make():
    from leaves.entries import made
    return made()

leaves = Shipped(
    package="leaves", file="leaves.ll.xz", make=make, names=("divide", "twice"),
    arguments=1, results=2, what="leaves", seconds=1, patience={patience},
)
if "write" in sys.argv:
    leaves.write()
divide, twice = leaves.functions
try:
    divide(0)
except ZeroDivisionError as error:
    assert str(error)
    print(*divide(5), *twice(6))
print(*sorted("quick" in p.name for p in cache_folder().glob("kernels/*.o")))
"""


@pytest.fixture
def leaves(tmp_path):
    """Write a package of two compiled files."""
    folder = tmp_path / "leaves"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "leaf.py").write_text(LEAF.format(factor=2))
    (folder / "entries.py").write_text(ENTRIES)
    return folder


def start(folder, cache, *arguments, patience=0.0):
    """Return what the functions give, how often intermediate code was made, and what is cached.

    Of each file of machine code, whether it was made quickly.
    """
    places = [folder.parent, Path(polycorner.__file__).parents[1]]
    done = subprocess.run(
        [sys.executable, "-c", START.format(patience=patience), *arguments],
        env={
            **os.environ,
            "POLYCORNER_CACHE_DIR": str(folder.parent / cache),
            "PYTHONPATH": os.pathsep.join(map(str, places)),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.returncode, done.stderr
    *made, results, kept = done.stdout.splitlines()
    return list(map(int, results.split())), len(made), kept


def test_code_is_made_anew_only_if_a_file_was_changed(leaves):
    at_first, changed = [24, 7, 40, 6], [36, 7, 60, 6]
    assert start(leaves, "one") == (at_first, 1, "False")
    assert start(leaves, "one") == (at_first, 0, "False")  # machine code from the cache
    assert start(leaves, "two", "write") == (at_first, 1, "False True")
    assert start(leaves, "three") == (at_first, 0, "False True")  # from the intermediate code
    (leaves / "leaf.py").write_text(LEAF.format(factor=3))
    assert start(leaves, "three") == (changed, 1, "False False True")


def test_code_is_optimised_once_it_was_used_for_long_enough(leaves):
    """In whichever process; quick code does the same, and raises the same."""
    results = [24, 7, 40, 6]
    assert start(leaves, "one", "write", patience=60.0) == (results, 1, "True")
    assert start(leaves, "one", patience=60.0) == (results, 0, "True")
    assert start(leaves, "one") == (results, 0, "False True")
    assert start(leaves, "one", patience=60.0) == (results, 0, "False True")


def test_a_table_holds_numbers_addresses_and_lengths():
    layout = Layout.of(a="real m 2", n="whole", x="real", b="flag m", none="whole *")
    given = np.arange(6.0).reshape(3, 2), -5, 0.5, np.ones(3, dtype=bool), np.zeros(0, dtype=int)
    given[3].flags.writeable = False
    table, arrays = layout.table(given)
    half = int(np.float64(0.5).view(np.int64))
    assert np.frombuffer(table, dtype=np.int64).tolist() == [
        given[0].ctypes.data, 3, 2, -5, half, given[3].ctypes.data, 3, given[4].ctypes.data, 0
    ]  # fmt: skip
    assert arrays[0] is given[0]
    _, (copied, *_) = layout.table((given[0][:, ::-1], *given[1:]))
    assert copied.flags.c_contiguous
    with pytest.raises(ValueError, match="a: expected an array of 2 dimensions; got 1"):
        layout.table((np.zeros(3), *given[1:]))
