"""Saved lists: what a file says is exactly the problem."""

import json
import math

import numpy as np
import pytest
import sympy as sp
from proof_files import parts_of

from polycorner import AnyOf, Manifold, Polyhedron
from polycorner.formulas.functions import SmoothFunction
from polycorner.intervals.enclosures import Formulas
from polycorner.proofs import files
from polycorner.proofs.lists.enumeration import stationary_points

PLANE = Manifold(("x", "t"), (math.inf, math.tau), (1, 1))
x, t = PLANE.symbols
LINES = Manifold.euclidean("x t")
DISCS = Polyhedron(PLANE, [AnyOf(1 - x**2, 1 - (x - sp.Rational(1, 3)) ** 2)])
OPERATIONS = {
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b,
    "neg": lambda a: -a, "sin": math.sin, "min": min, "max": max, "abs": abs, "sqrt": math.sqrt,
}  # fmt: skip


@pytest.fixture(scope="module")
def found():
    return stationary_points(DISCS, x + sp.cos(t), box={"x": (-2.0, 2.0)}, max_boxes=50)


@pytest.fixture(scope="module")
def parts(found, tmp_path_factory):
    return parts_of(found.save(tmp_path_factory.mktemp("files") / "list.zip"))


def test_the_problem_is_stated_with_exact_numbers(parts):
    data = json.loads(parts["problem.json"])
    assert data["coordinates"] == ["x", "t"]
    assert data["periods"] == [None, "2 pi"]
    assert sorted(data["branches"]) == [[0], [1]]
    assert ["const", "-1/3"] in data["nodes"]
    assert [float.fromhex(s) for s in data["domain"]["lower"]] == [-2, -np.nextafter(math.pi, 4)]


def test_the_subdivision_is_a_tree_whose_open_leaves_are_the_undecided_boxes(parts, found):
    codes = np.frombuffer(parts["tree.bin"], "<i1")
    splits, closed, opened = (codes >= 0).sum(), (codes == -1).sum(), (codes == -2).sum()
    assert splits + 1 == closed + opened
    assert len(parts["positions.bin"]) == 8 * splits
    counts = np.frombuffer(parts["counts.bin"], "<u2")
    assert len(counts) == closed
    assert len(parts["directions.bin"]) == 8 * counts.sum()
    assert opened == len(found.undecided) == json.loads(parts["problem.json"])["open"]


def test_a_file_is_the_same_whenever_it_is_written(found, tmp_path, monkeypatch):
    written = []
    for moment in (1.0e9, 1.7e9):
        monkeypatch.setattr("time.time", lambda moment=moment: moment)
        written.append(found.save(tmp_path / "list.zip").read_bytes())
    assert written[0] == written[1]


@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
@pytest.mark.parametrize(
    ("formula", "operation"),
    [
        (sp.Min(x, t), "min"),
        (sp.Max(x, t), "max"),
        (sp.Abs(x - t), "abs"),
        (-sp.Abs(x), "abs"),
        (sp.Max(-1, sp.Min(x * t, 1)), "max"),
        (sp.sqrt(x**2 + t**2) * sp.sin(x) - sp.Rational(2, 3), "sqrt"),
    ],
)
def test_programs_compute_their_functions(formula, operation):
    formulas = Formulas([SmoothFunction("f", formula, LINES)], LINES)
    nodes, (output,) = files.program(formulas.graph, formulas.outputs)
    assert operation in {op for op, *_ in nodes}
    assert not {op for op, *_ in nodes} & {"select", "lt", "le"}
    for point in ((0.5, 0.25), (-1.5, 2.0), (3.0, -0.125)):
        values = []
        for op, *args in nodes:
            if op == "const":
                values.append(float(sp.Rational(args[0])))
            else:
                given = point[args[0]] if op == "var" else [values[a] for a in args]
                values.append(given if op == "var" else OPERATIONS[op](*given))
        assert values[output] == pytest.approx(float(formula.subs({x: point[0], t: point[1]})))


@pytest.mark.parametrize(
    ("value", "text"),
    [(math.inf, None), (math.tau, "2 pi"), (math.pi / 3, "1/3 pi"), (0.75, "3/4"), (1.1, None)],
)
def test_periods_are_multiples_of_pi_or_the_doubles_they_are(value, text):
    assert files.period(value) == (text if text or math.isinf(value) else str(sp.Rational(1.1)))


def test_a_name_without_the_suffix_is_refused(found, tmp_path):
    with pytest.raises(ValueError, match=r"\.zip"):
        found.save(tmp_path / "list.json")
    assert not list(tmp_path.iterdir())
