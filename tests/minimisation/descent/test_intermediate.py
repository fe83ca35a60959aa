"""The compiled descent: which file it is made from, and calls from several threads."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import polycorner
from polycorner import minimise
from polycorner.models.planar import Tutorial

START = """
from polycorner import Manifold, Polyhedron, minimise
M = Manifold.euclidean("x y")
x, y = M.symbols
print(*minimise(Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y}), x + y, [1.0, 1.5]).point)
"""


def test_a_changed_stage_is_compiled_again(tmp_path):
    package = tmp_path / "source" / "polycorner"
    shutil.copytree(
        Path(polycorner.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )

    def start():
        places = {"POLYCORNER_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(package.parent)}
        done = subprocess.run(
            [sys.executable, "-c", START],
            cwd=package.parent,
            env={**os.environ, **places},
            capture_output=True,
            text=True,
            check=True,
        )
        return list(map(float, done.stdout.split())), "the search for minima" in done.stderr

    first = start()
    assert first == (pytest.approx([-0.5, 0.25]), False)
    stage = package / "minimisation" / "descent" / "evaluation.py"
    text = stage.read_text()
    shifted = text.replace("F[row] = work[k + o]", "F[row] = work[k + o] - 0.5")
    assert shifted != text
    stage.write_text(shifted)
    assert start() == (pytest.approx([-0.5, 0.75]), True)
    assert start() == (pytest.approx([-0.5, 0.75]), False)
    stage.write_text(text)
    assert start() == first


def test_threads_descend_side_by_side_to_the_same_points():
    tutorial = Tutorial()
    region = tutorial.polyhedron
    x, y = region.manifold.symbols
    starts = tutorial.starts(np.random.default_rng(0), 40)

    def descend(q):
        return minimise(region, (x - 0.3) ** 2 - y**2 / 2, q).point

    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(descend, starts))
    np.testing.assert_array_equal(together, [descend(q) for q in starts])
    assert len(np.unique(np.round(together, 6), axis=0)) > 1
