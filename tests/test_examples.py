"""Every example runs and gives the number it is there for; so does the README."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from examples import ex01_heading, ex02_own_polyhedron, ex03_ridge

ROOT = Path(__file__).parents[1]


def test_every_example_has_a_test():
    files = {path.stem for path in (ROOT / "examples").glob("ex*.py")}
    assert files == {"ex01_heading", "ex02_own_polyhedron", "ex03_ridge"}


def test_heading():
    result = ex01_heading.main()
    assert result.right == pytest.approx(-result.left, abs=1e-9)
    assert result.paper == pytest.approx(math.degrees(math.atan(3 / 16)))
    assert abs(result.right - result.plane) < 1e-3 < abs(result.right - result.paper)
    assert 1.9 < result.order < 2.1


def test_heading_figure(tmp_path):
    ex01_heading.draw(tmp_path / "heading.png")
    assert (tmp_path / "heading.png").read_bytes().startswith(b"\x89PNG")


def test_own_polyhedron():
    certificate = ex02_own_polyhedron.main()
    golden = ex02_own_polyhedron.GOLDEN
    np.testing.assert_allclose(certificate.point, [golden, golden**2], atol=1e-12)
    assert certificate.signature() == (2, 0, 0)


def test_ridge():
    rest, corner = ex03_ridge.main()
    np.testing.assert_allclose(rest.point, [0.0, -2.0], atol=1e-12)
    assert rest.is_minimum
    assert not corner.is_minimum


def test_readme_code_runs_as_printed():
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    assert blocks
    scope: dict = {}
    for block in blocks:
        exec(block, scope)
    np.testing.assert_allclose(scope["c"].point, [-0.5, 0.25], atol=1e-12)
