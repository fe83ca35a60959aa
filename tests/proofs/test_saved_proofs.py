"""Proofs of single minima in files: what the checker says of them, and of files that are changed.

A file in which something was changed is refused, or what the checker prints of it is true: the
oracle evaluates the program of the file in plain floating-point numbers, descends from points
around with a method of SciPy, and compares.
"""

import math
import re
from fractions import Fraction
from functools import cache

import flint
import numpy as np
import pytest
import sympy as sp
from packed_circles import circles, torus
from proof_files import described, rewritten, said_alone, verdict, with_value
from scipy.optimize import minimize

from polycorner import AnyOf, Manifold, Polyhedron, certify
from polycorner.formulas.functions import SmoothFunction
from polycorner.intervals.balls import precision
from polycorner.intervals.enclosures import Formulas
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.proofs import prove
from polycorner.proofs.attempt import bits_for
from polycorner.proofs.bounded import BoundedMinimum
from polycorner.proofs.bounded_search import bounded_minimum
from polycorner.proofs.files import save_minimum

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
SPACE = Manifold.euclidean("u v w")
u, v, w = SPACE.symbols
PAIR = Manifold.euclidean("a b c d")
a, b, c, d = PAIR.symbols
ROOT = 0.5**0.5


S = (2**0.5 - 1) / 2
FOUR = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
FIVE = [(S, S), (1 - S, S), (S, 1 - S), (1 - S, 1 - S), (0.5, 0.5)]
SEVEN = [
    (0.523372890561, 0.174457630187), (0.174457630187, 0.174457630187),
    (0.348915260374, 0.825542369813), (0.523372890561, 0.523372890561),
    (0.174457630187, 0.523372890561), (0.7960, 0.7960), (0.825542369813, 0.348915260374),
]  # fmt: skip
ROUND = [1 - x**2 - y**2, 1 - (x - 1) ** 2 - y**2]
SPIN = Symmetry(fields=[(-b, a, -d, c)])
# polyhedron, energy, point, and what is printed of the statement
PROBLEMS = {
    "corner": (
        Polyhedron(PLANE, {"a": x, "b": y - x**2 / 3}), x + 2 * y + x**2, [0, 0],
        "a strict local minimum exactly at x = 0, y = 0; its energy is 0",
    ),
    "face": (
        Polyhedron(PLANE, {"bowl": y - x**2, "lid": 2 - y}), x + sp.sqrt(2) * y, [-ROOT / 2, 0.125],
        "a strict local minimum near",
    ),
    "interior": (
        Polyhedron(PLANE, {"a": 3 - x}), (x - sp.sqrt(2)) ** 2 + sp.exp(y) - y * sp.pi,
        [2**0.5, math.log(math.pi)], "a strict local minimum near",
    ),
    "redundant": (
        Polyhedron(PLANE, {"disc": x**2 + y**2 - 1, "wall": x - 1}), x**2 + y**2, [1, 0],
        'its energy is 1; supported by "wall"',
    ),
    "union": (
        Polyhedron(PLANE, [x + y, AnyOf(*ROUND)]), x - y / 3, [-ROOT, ROOT],
        "a strict local minimum near",
    ),
    "equation": (
        Polyhedron(SPACE, {"a": u - v, "b": v - w, "both": u - w},
                   {"sphere": u**2 + v**2 + w**2 - 1}),
        3 * u - v - 2 * w, [3**-0.5] * 3, 'supported by "a", "b"',
    ),
    "four": (*circles(FOUR), "a strict local minimum exactly at"),
    "five": (*circles(FIVE), "a local minimum within"),
    "seven": (*circles(SEVEN), "for all values of what rattles: x5"),
    "torus": (*torus(), "modulo d/dx0 + d/dx1; modulo d/dy0 + d/dy1"),
}  # fmt: skip


@pytest.fixture(scope="session")
def saved(tmp_path_factory):
    """Return a function that saves a problem's proof once, and the path."""
    folder = tmp_path_factory.mktemp("proofs")

    @cache
    def file(name):
        if name in BETWEEN:
            return between(folder / f"{name}.zip", *BETWEEN[name])
        if name == "spin":
            apart = Polyhedron(PAIR, {"apart": (a - c) ** 2 + (b - d) ** 2 - 1})
            energy = a**2 + b**2 + 2 * (c**2 + d**2)
            found = certify(apart, energy, [0.4, 0.8 / 1.5, -0.2, -0.4 / 1.5])
            return prove(found, symmetry=SPIN).save(folder / "spin.zip")
        return prove(certify(*PROBLEMS[name][:3])).save(folder / f"{name}.zip")

    return file


def between(path, polyhedron, energy, point):
    """Save a minimum that may be shown in another way as one between two energies."""
    found = certify(polyhedron, energy, point)
    formulas = Formulas(found.problem.functions, polyhedron.manifold)
    shown = bounded_minimum(found.problem, formulas, found.point, (), found.tolerances, 30)
    assert isinstance(shown, BoundedMinimum)
    with precision(bits_for(30)):
        return save_minimum(path, found.problem, formulas, shown.witness, bits_for(30))


# To second order, across a contact; and a coordinate that rattles.
BETWEEN = {
    "second order": (Polyhedron(PLANE, {"bowl": y - x**2, "lid": 2 - y}), x + y, [-0.5, 0.25]),
    "room": (
        Polyhedron(SPACE, {"a": u, "b": v, "c": u + v, "low": w + 1 + u, "high": 1 - w - v}),
        u + v, [0.0, 0.0, 0.25],
    ),
}  # fmt: skip
NAMES = [*(name for name in PROBLEMS if name != "seven"), *BETWEEN, "spin"]


@pytest.mark.parametrize("name", PROBLEMS)
def test_saved_proofs_are_verified(name, saved):
    fine, line = verdict(saved(name))
    assert fine, line
    assert PROBLEMS[name][3] in line


def test_minima_to_second_order_are_verified(saved):
    fine, line = verdict(saved("second order"))
    assert fine, line
    assert "a local minimum near x = -0.5" in line


def test_what_rattles_has_room(saved):
    fine, line = verdict(saved("room"))
    assert fine, line
    assert "for all values of what rattles: w (side " in line


def test_rotations_are_checked_by_algebra(saved):
    fine, line = verdict(saved("spin"))
    assert fine, line
    assert "modulo (-1*b) d/da + (a) d/db + (-1*d) d/dc + (c) d/dd" in line


def test_saving_leaves_the_working_precision(saved):
    before = flint.ctx.prec
    saved("corner")
    assert flint.ctx.prec == before


def test_the_checker_runs_without_polycorner(saved, tmp_path):
    assert said_alone(saved("torus"), tmp_path) == verdict(saved("torus"))[1]


def test_what_is_not_proved_is_not_saved(tmp_path):
    saddle = prove(certify(Polyhedron(PLANE, {"a": 3 - x}), x**2 - y**2, [0.0, 0.0]))
    with pytest.raises(ValueError, match="save: expected a proof of which all conditions are"):
        saddle.save(tmp_path / "saddle.zip")


def test_what_the_checker_cannot_follow_is_not_saved(tmp_path):
    quadrant = Polyhedron(PLANE, {"a": x, "b": y})
    proof = prove(certify(quadrant, x**2 + 4 * x * y + y**2, [0.0, 0.0]))
    assert proof.proved
    with pytest.raises(ValueError, match="expected a proof that the checker follows; it says"):
        proof.save(tmp_path / "quadrant.zip")


# ------------------------------------------------------------------------------------- the oracle

PLAIN = {
    "add": lambda p, q: p + q, "sub": lambda p, q: p - q, "mul": lambda p, q: p * q,
    "div": lambda p, q: p / q, "neg": lambda p: -p, "square": lambda p: p * p,
    "pow": lambda p, q: p**q, "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "sin": np.sin,
    "cos": np.cos, "tan": np.tan, "abs": abs, "min": min, "max": max, "atan": np.arctan,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "erf": math.erf, "atan2": np.arctan2,
    "asin": np.arcsin, "acos": np.arccos,
}  # fmt: skip


@cache
def constant(text):
    return float(sp.sympify(text.replace(" pi", "*pi")))


def plain(data, q):
    """Return the functions of a file at a point in floating-point numbers."""
    found = []
    for op, *args in data["nodes"]:
        if op == "const":
            found.append(constant(args[0]))
        else:
            given = [q[args[0]]] if op == "var" else [found[i] for i in args]
            found.append(given[0] if op == "var" else PLAIN[op](*given))
    return np.array([found[i] for i in data["outputs"]], dtype=float)


def lowest(data, centre, reach):
    """Return the least energies that descents in a box around a point reach in the set."""
    m, k = data["inequalities"], data["equations"]
    rng, found = np.random.default_rng(0), []
    for branch in data["branches"]:
        rows = sorted({*branch})
        limits = [
            {"type": kind, "fun": lambda q, part=part: plain(data, q)[part]}
            for kind, part in (("ineq", rows), ("eq", list(range(m, m + k)))) if part
        ]  # fmt: skip
        for _ in range(3):
            sides = np.column_stack([centre - reach, centre + reach])
            start = rng.uniform(*sides.T)
            got = minimize(
                lambda q: plain(data, q)[-1], start, constraints=limits, bounds=sides,
                method="SLSQP", options={"ftol": 1e-14, "maxiter": 300},
            )  # fmt: skip
            f = plain(data, got.x)
            if min(f[rows], default=0) > -1e-8 and abs(f[m:-1]).max(initial=0) < 1e-8:
                found.append(got.fun)
    return found


ENERGY = re.compile(r"its energy is (?:between (\S+) and ([^;]+)|([^;]+))")


def judge(data, line):
    """Check that what is printed of a file is true, up to the accuracy of doubles."""
    evidence = data["evidence"]
    centre = np.array([float(Fraction(z)) for z in evidence["centre"]])
    printed = re.search(r"(?:near|exactly at) (\w+ = [^;]*)", line)
    if printed:  # the point may lie elsewhere than the centre of the file
        pairs = re.findall(r"(\w+) = ([^,;]+)", printed[1])
        centre = np.array([float(Fraction(dict(pairs)[name])) for name in data["coordinates"]])
    low, high, exact = ENERGY.search(line).groups()
    low, high = (float(Fraction(z)) for z in ((exact, exact) if exact else (low, high)))
    n, m, k = len(data["coordinates"]), data["inequalities"], data["equations"]
    assert line.endswith(f"{n} coordinates, {m} inequalities, {k} equations")
    loose = [data["coordinates"].index(z) for z in re.findall(r"(\w+) \(side", line)]
    reach = np.where(np.isin(np.arange(n), loose), 0, 1e-3)
    energies = lowest(data, centre, reach)
    assert energies
    assert low - 1e-7 <= min(energies) <= high + 1e-7
    rng = np.random.default_rng(1)
    if loose:
        halves = np.zeros(n)
        halves[loose] = [float(z) / 2 for z in re.findall(r"\(side (\S+)\)", line)]
        inside = [plain(data, rng.uniform(centre - halves, centre + halves)) for _ in range(50)]
        assert all(f[:m].min() > -1e-8 for f in inside)
    for field in re.findall(r"modulo ([^;]+)", line):
        vector = np.zeros(n)
        for word, name in re.findall(r"(?:\(([^()]+)\) )?d/d(\w+)", field):
            at = dict(zip(data["coordinates"], centre, strict=True))
            vector[data["coordinates"].index(name)] = float(sp.sympify(word or "1").subs(at))
        here, there = plain(data, centre), plain(data, centre + 1e-6 * vector)
        assert abs(here[-1] - there[-1]) < 1e-10


# ------------------------------------------------------------------------------- what is changed

ARITIES = [("add", "sub", "mul", "div", "min", "max"), ("neg", "exp", "abs", "sqrt", "sin")]


def alternatives(value):
    """Return other values of an entry."""
    if isinstance(value, bool) or value is None:
        return ["1", True]
    if isinstance(value, int):
        return [value + 1, value - 1, 0, 1, -1, 10**6]
    if isinstance(value, list):
        return [value[:-1], [*value, value[0]], value[::-1], []] if value else [[0]]
    if re.fullmatch(r"-?\d+(/\d+)?", value):
        z = Fraction(value)
        some = [
            -z,
            z + 1,
            2 * z,
            z / 2,
            Fraction(0),
            z + Fraction(1, 2**70),
            z + Fraction(1, 10**5),
        ]
        return [*(str(z) for z in some), "1/0", "nan", "1e3", " 1", "0x1"]
    same = next((ops for ops in ARITIES if value in ops), ("other",))
    return [op for op in same if op != value]


def entries(value, place=(), most=5):
    """Yield the places of entries; of long lists a few."""
    if place and not isinstance(value, dict):
        yield place
    if isinstance(value, dict):
        for key, part in value.items():
            yield from entries(part, (*place, key))
    elif isinstance(value, list):
        step = max(1, len(value) // most)
        for i in range(0, len(value), step):
            yield from entries(value[i], (*place, i))


@pytest.mark.parametrize("name", NAMES)
def test_whatever_is_changed_what_is_printed_is_true(name, saved, tmp_path):
    original = described(saved(name))
    truth, count, path = verdict(saved(name))[1], 0, tmp_path / "changed.zip"
    judge(original, truth)
    for place in entries(original):
        part = original
        for key in place:
            part = part[key]
        for value in alternatives(part):
            data = with_value(original, place, value)
            fine, line = verdict(rewritten(path, data))
            same_problem = place[0] in {"evidence", "periods"} and line == truth
            if fine and not same_problem:
                judge(data, line)
            count += not fine
    assert count > 50


# -------------------------------------------------------------------------- boxes of parameters


@pytest.fixture(scope="session")
def box(tmp_path_factory):
    """Return the file of a wall at ``x = beta^2`` for a box of ``beta``, and of a slope."""
    beta, slope = sp.symbols("beta slope", real=True)
    walls = [
        SmoothFunction("wall", x - beta**2, PLANE, parameters={"beta": 0.7}),
        SmoothFunction("far", 5 - x, PLANE),
    ]
    energy = SmoothFunction("E", slope * x + (y - sp.sin(x)) ** 2, PLANE, parameters={"slope": 1.0})
    found = certify(Polyhedron(PLANE, walls), energy, [0.49, math.sin(0.49)])
    proof = prove(found, parameters={"beta": (0.5, 2.0), "slope": (0.5, 1.0)})
    return proof.save(tmp_path_factory.mktemp("boxes") / "box.zip")


def bounds(line):
    """Return bounds of coordinates and energy that are printed of a box."""
    found = re.findall(r"between (\S+) and ([^,;]+)", line)
    return [(float(low), float(high)) for low, high in found]


def test_boxes_of_parameters_are_verified(box):
    fine, line = verdict(box)
    assert fine, line
    assert "for all beta from 0.5 to 2.0 and slope from 0.5 to 1.0 there is a strict" in line
    for beta in np.linspace(0.5, 2, 7):
        for slope in (0.5, 0.8, 1.0):
            point = beta**2, math.sin(beta**2), slope * beta**2
            assert all(a <= z <= b for z, (a, b) in zip(point, bounds(line), strict=True))


def test_changed_boxes_are_refused_or_true(box, tmp_path):
    original, truth = described(box), verdict(box)[1]
    refused = 0
    for key in ("lower", "upper", "active", "bits"):
        for place in entries(original["evidence"][key], ("evidence", key), 2):
            part = original
            for k in place:
                part = part[k]
            some = alternatives(part)[:4]
            if isinstance(part, str) and "0x" in part:
                z = float.fromhex(part)
                some = [a.hex() for a in (-z, z + 1, z / 2, 1.1 * z, math.inf, math.nan)]
            for value in some:
                data = with_value(original, place, value)
                fine, line = verdict(rewritten(tmp_path / "changed.zip", data))
                refused += not fine
                if fine and key in {"lower", "upper"}:
                    (a, c), (b, d) = (
                        [float.fromhex(z) for z in data["evidence"][k]] for k in ("lower", "upper")
                    )
                    assert f"beta from {a} to {b} and slope from {c} to {d}" in line
                    assert c > 0  # elsewhere the wall does not hold
                    ends = a * a, b * b, (a + b) ** 2 / 4
                    low, high = bounds(line)[0]
                    assert all(low <= z <= high for z in ends)
                elif fine:
                    assert line.split("; ")[0] == truth.split("; ")[0]
    assert refused > 5


def test_a_tree_covers_all_of_its_box(box, tmp_path):
    data = described(box)
    tree = data["evidence"]["tree"]
    for changed in (tree[:-1], [*tree, tree[-1]], [], tree[1:]):
        data["evidence"]["tree"] = changed
        fine, line = verdict(rewritten(tmp_path / "changed.zip", data))
        assert not fine, line


# --------------------------------------------------------------------------------- wrong proofs


def test_other_energies_than_those_of_minima_are_refused(saved, tmp_path):
    for name in ("corner", "face", "interior", "union", "five", "torus", "second order", "room"):
        data = described(saved(name))
        data["nodes"].append(["neg", data["outputs"][-1]])
        data["outputs"][-1] = len(data["nodes"]) - 1
        fine, line = verdict(rewritten(tmp_path / "negative.zip", data))
        assert not fine, line


@pytest.mark.parametrize("name", ["five", "torus", "second order"])
def test_boxes_that_are_too_large_are_refused(name, saved, tmp_path):
    data = described(saved(name))
    data["evidence"]["reach"] = "10"
    fine, line = verdict(rewritten(tmp_path / "wide.zip", data))
    assert not fine, line


def test_room_that_is_too_large_is_refused(saved, tmp_path):
    data = described(saved("room"))
    data["evidence"]["room"][0][1] = "2"
    fine, line = verdict(rewritten(tmp_path / "room.zip", data))
    assert not fine
    assert "leave room to what rattles" in line


def test_inner_points_outside_of_the_set_are_refused(saved, tmp_path):
    data = described(saved("five"))
    data["evidence"]["inner"] = data["evidence"]["centre"]
    fine, line = verdict(rewritten(tmp_path / "outside.zip", data))
    assert not fine
    assert "the inner point is not in the set" in line


HOSTILE = {
    "a number of a million digits": lambda d: d["evidence"]["centre"].__setitem__(0, "1" * 10**6),
    "bits without end": lambda d: d["evidence"].update(bits=10**9),
    "powers of powers": lambda d: towers(d, "mul"),
    "exponentials of exponentials": lambda d: towers(d, "exp"),
    "deep lists": lambda d: d["evidence"].update(room=nested(900)),
}


def towers(data, op):
    """Replace a function by a tower of operations on a coordinate."""
    nodes = data["nodes"]
    nodes.append(["var", 0])
    for _ in range(300):
        last = len(nodes) - 1
        nodes.append([op, last, last] if op == "mul" else [op, last])
    data["outputs"][0] = len(nodes) - 1


def nested(depth):
    found = []
    for _ in range(depth):
        found = [found]
    return found


@pytest.mark.parametrize("change", HOSTILE.values(), ids=list(HOSTILE))
def test_hostile_numbers_are_refused(change, saved, tmp_path):
    data = described(saved("four"))
    change(data)
    fine, line = verdict(rewritten(tmp_path / "hostile.zip", data))
    assert not fine, line
    assert len(line) < 1000
