"""The disk cache of the entry points."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import polycorner

START = """
import json
from polycorner.minimisation.descent import entry_points
from polycorner import Manifold, Polyhedron, minimise
M = Manifold.euclidean("x y")
x, y = M.symbols
found = minimise(Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y}), x + y, [1.0, 1.5])
stats = entry_points.descend.stats
print(json.dumps([
    found.point.tolist(), sum(stats.cache_hits.values()), sum(stats.cache_misses.values())
]))
"""


@pytest.mark.slow
def test_only_a_changed_stage_is_compiled_again(tmp_path):
    package = tmp_path / "source" / "polycorner"
    shutil.copytree(
        Path(polycorner.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )
    places = {name: str(tmp_path / name) for name in ("NUMBA_CACHE_DIR", "POLYCORNER_CACHE_DIR")}

    def start():
        done = subprocess.run(
            [sys.executable, "-c", START],
            cwd=package.parent,
            env={**os.environ, **places, "PYTHONPATH": str(package.parent)},
            capture_output=True,
            text=True,
            check=True,
        )
        return json.loads(done.stdout)

    first, again = start(), start()
    assert first == [pytest.approx([-0.5, 0.25]), 0, 1]
    assert again == [first[0], 1, 0]

    stage = package / "minimisation" / "descent" / "evaluation.py"
    text = stage.read_text()
    shifted = text.replace("F[row] = work[k + o]", "F[row] = work[k + o] - 0.5")
    assert shifted != text
    stage.write_text(shifted)
    assert start() == [pytest.approx([-0.5, 0.75]), 0, 1]

    stage.write_text(text)
    assert start() == [first[0], 1, 0]
