"""The notebooks run from the first cell to the last, and show what a notebook can show."""

import ast
import json
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from polycorner.pictures import MotionFilm

FOLDER = Path(__file__).parents[1] / "examples" / "notebooks"
# What the last cell answers, and how many figures and films there are.
ANSWERS = {
    "granular_motion": (lambda answer: answer[1] < answer[0] < 6 and answer[2], 1, 1),
    "gripper": (lambda answer: answer == (True, "strict local minimum"), 2, 0),
    "packings": (lambda answer: answer[0], 1, 0),
}


def shown(cell, names):
    """Run a cell as a notebook does, and return the value of its last expression."""
    lines = [line for line in cell["source"] if not line.startswith("%")]
    tree = ast.parse("".join(lines))
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last else None


def test_every_notebook_has_an_answer():
    assert {file.stem for file in FOLDER.glob("*.ipynb")} == set(ANSWERS)


@pytest.mark.parametrize("name", ANSWERS)
def test_a_notebook_runs(name):
    content = json.loads((FOLDER / f"{name}.ipynb").read_text())
    assert (content["nbformat"], content["nbformat_minor"]) == (4, 5)
    cells = [cell for cell in content["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
    names = {}
    values = [shown(cell, names) for cell in cells]
    right, figures, films = ANSWERS[name]
    assert right(values[-1])
    assert sum(isinstance(value, Figure) for value in values) == figures
    assert sum(isinstance(value, MotionFilm) for value in values) == films
    for value in values:
        if hasattr(value, "_repr_html_") and not isinstance(value, Figure):
            assert value._repr_html_().startswith("<")
