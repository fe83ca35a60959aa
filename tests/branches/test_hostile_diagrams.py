"""Saved diagrams that are made to harm: refused in one line, within bounded time and memory."""

import copy
import json
import os

import pytest
import sympy
from proof_files import parts_of

from polycorner import Manifold, Polyhedron, SmoothFunction
from polycorner.branches import branches, prove_branches
from polycorner.minimisation.methods import stationary_on
from tests.proofs.lists.test_hostile_files import chain, packed, refused

LINE = Manifold.euclidean("x")
(x,), t = LINE.symbols, sympy.Symbol("t")


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Return the parts of a saved diagram."""
    energy = SmoothFunction("energy", t * x - x**2 / 2, LINE, parameters={"t": 0.5})
    found = stationary_on(Polyhedron(LINE, {"wall": x}), energy, [0], ("wall",))
    proof = prove_branches(branches(found, "t", (-1.0, 1.0)), box=[(-1, 3)])
    path = proof.save(tmp_path_factory.mktemp("hostile") / "diagram.zip")
    return parts_of(path)


def with_data(parts, change):
    data = json.loads(parts["problem.json"])
    change(data)
    return packed({**parts, "problem.json": json.dumps(data)}.items())


def all_points(value):
    def change(data):
        for arc in data["arcs"]:
            arc["points"] = [[value for _ in row] for row in arc["points"]]

    return change


def many(data, count, key):
    data[key] = [copy.deepcopy(data[key][0]) for _ in range(count)]


def many_coordinates(data, count=20_000):
    data["coordinates"] = [f"x{i}" for i in range(count)]
    data["periods"], data["scales"] = [None] * count, ["1"] * count
    data["parameters"] = [count - 1]
    data["domain"] = {"lower": ["-0x1p+0"] * count, "upper": ["0x1p+0"] * count}


def many_functions(data, count=10_000):
    data["inequalities"], data["branches"] = count, [[*range(count)]]
    data["functions"], data["weights"] = ["f"] * (count + 1), ["1"] * (count + 1)
    data["outputs"] = [data["outputs"][0]] * count + data["outputs"][-1:]


def far_points(data):
    """Points so far apart that no number of halvings helps."""
    for arc in data["arcs"]:
        arc["points"] = [arc["points"][0], [(1e300).hex() for _ in arc["points"][0]]] * 100


def symmetries(count):
    one = {"order": [0], "signs": [1], "functions": [0]}
    return lambda data: data.update(symmetries=[one] * count)


DIGITS = "9" * 10**6
HOSTILE = {
    "no arcs": lambda data: data.update(arcs=[]),
    "no events": lambda data: data.update(events=[]),
    "very many arcs": lambda data: many(data, 20_000, "arcs"),
    "very many events": lambda data: many(data, 100_000, "events"),
    "points that are no numbers": all_points("nan"),
    "points without end": all_points("inf"),
    "points far away": all_points("0x1p+99999999999"),
    "points that are no texts": all_points(1.0),
    "one point": all_points("0x0p+0"),
    "far points": far_points,
    "long weights": lambda data: data.update(weights=[DIGITS] * 2),
    "weights of nothing": lambda data: data.update(weights=["0", "1"]),
    "negative weights": lambda data: data.update(weights=["1", "-1"]),
    "scales divided by 0": lambda data: data.update(scales=["1/0", "1"]),
    "an empty interval": lambda data: data.update(interval=["0x0p+0", "0x0p+0"]),
    "an interval without end": lambda data: data.update(interval=["-inf", "inf"]),
    "an interval that is none": lambda data: data.update(interval=["nan", "nan"]),
    "many coordinates": many_coordinates,
    "many functions": many_functions,
    "many symmetries": symmetries(100_000),
    "a symmetry of nothing": lambda data: data.update(symmetries=[{}]),
    "towers of powers": lambda data: data.update(chain("pow", 200)),
    "towers of exponentials": lambda data: data.update(chain("exp", 2000)),
    "squares of squares": lambda data: data.update(chain("mul", 5000, "3/2")),
    "sines": lambda data: data.update(chain("sin", 10_000)),
    "a long constant": lambda data: data.update(chain("exp", 3, DIGITS)),
    "a box without end": lambda data: data.update(
        domain={"lower": ["-inf", "-0x1p+0"], "upper": ["inf", "0x1p+0"]}
    ),
    "a box for another interval": lambda data: data["domain"]["upper"].__setitem__(1, "0x1p-1"),
    "a box that is fixed": lambda data: data.update(fixed=[0]),
    "a parameter too few": lambda data: data.update(parameters=[]),
    "a parameter too many": lambda data: data.update(parameters=[0, 1]),
    "a union": lambda data: data.update(branches=[[0], []]),
    "another format": lambda data: data.update(format=["polycorner-diagram", 2]),
    "the format of a list": lambda data: data.update(format=["polycorner-stationary-list", 1]),
    "the format of a proof": lambda data: data.update(format=["polycorner-proof", 1]),
    "a format that is a number": lambda data: data.update(format=1),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_numbers_are_refused_in_a_line(name, good, tmp_path):
    (tmp_path / "file.zip").write_bytes(with_data(good, HOSTILE[name]))
    refused(tmp_path / "file.zip")


FILES = {
    "a bomb": lambda parts: packed({**parts, "tree.bin": bytes(1 << 28)}.items()),
    "deep lists": lambda parts: packed({**parts, "problem.json": b"[" * 10**5}.items()),
    "entries twice": lambda parts: packed(
        {**parts, "problem.json": b'{"open": 1, ' + parts["problem.json"][1:]}.items()
    ),
    "noise": lambda parts: packed({**parts, "problem.json": os.urandom(1 << 16)}.items()),
    "no box": lambda parts: packed([("problem.json", parts["problem.json"])]),
}


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_refused_in_a_line(name, good, tmp_path):
    (tmp_path / "file.zip").write_bytes(FILES[name](good))
    refused(tmp_path / "file.zip")


def test_a_truncated_file_is_refused(good, tmp_path):
    content = packed(good.items())
    for end in (0, 1, 21, len(content) // 3, len(content) // 2, len(content) - 1):
        (tmp_path / "short.zip").write_bytes(content[:end])
        refused(tmp_path / "short.zip")
