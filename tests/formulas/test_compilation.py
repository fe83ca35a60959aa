"""Cached entry points over several files of compiled code."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import polycorner
from polycorner.formulas.cache import sources_digest
from polycorner.formulas.linking import linked

LEAF = """
import numpy as np
from polycorner.formulas.linking import linked

@linked()
def product(x):
    if x < 0:
        raise ValueError("negative")
    return np.prod(np.array([{factor}, x]))

@linked()
def scaled(x):
    return product(x) if x != 0 else 0
"""
ENTRY = """
from numba import njit
from polycorner.formulas.cache import sources_digest
from leaves import leaf

def compiled(sources):
    @njit(cache=True)
    def entry(x):
        _ = sources
        return leaf.scaled(x)
    return entry

entry = compiled(sources_digest("leaves"))
"""
START = """
from leaves.entries import entry
try:
    entry(-1)
except ValueError as error:
    assert str(error) == "negative"
print(entry(5), sum(entry.stats.cache_hits.values()))
"""


@pytest.fixture
def stages(tmp_path):
    """Write a package of two compiled files."""
    folder = tmp_path / "leaves"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "leaf.py").write_text(LEAF.format(factor=2))
    (folder / "entries.py").write_text(ENTRY)
    return folder


def start(folder):
    done = subprocess.run(
        [sys.executable, "-c", START],
        env={
            **os.environ,
            "NUMBA_CACHE_DIR": str(folder.parent / "cache"),
            "PYTHONPATH": os.pathsep.join(
                [str(folder.parent), str(Path(polycorner.__file__).parents[1])]
            ),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.returncode, done.stderr
    result, hits = map(int, done.stdout.split())
    return result, hits


def test_an_entry_point_is_compiled_again_when_any_stage_changes(stages):
    assert start(stages) == (10, 0)
    assert start(stages) == (10, 1)
    (stages / "leaf.py").write_text(LEAF.format(factor=3))
    assert start(stages) == (15, 0)
    assert start(stages) == (15, 1)


def test_python_cannot_call_what_is_only_linked():
    twice = linked()(lambda x: 2 * x)
    with pytest.raises(SystemError):
        twice(5)


def test_the_digest_depends_on_names_and_bytes(stages, monkeypatch):
    monkeypatch.syspath_prepend(str(stages.parent))
    digests = [sources_digest("leaves")]
    (stages / "leaf.py").write_text(LEAF.format(factor=4))
    digests.append(sources_digest("leaves"))
    (stages / "leaf.py").rename(stages / "twig.py")
    digests.append(sources_digest("leaves"))
    assert len(set(digests)) == 3


def test_only_packages_have_a_digest():
    with pytest.raises(ValueError, match="package: expected the name of an importable package"):
        sources_digest("json.decoder")
