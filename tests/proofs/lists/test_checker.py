"""Proofs of lists, saved and verified by the stand-alone checker; corrupted files are refused."""

import ast
import json
import operator
import shutil
import subprocess
import sys
import warnings
import zipfile
from pathlib import Path

import flint
import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from proof_files import verdict

from polycorner import AnyOf, Manifold, Polyhedron
from polycorner.errors import NonsmoothWarning
from polycorner.formulas.functions import SmoothFunction
from polycorner.intervals.enclosures import Formulas
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import checker, files
from polycorner.proofs.checker import balls, problem
from polycorner.proofs.checker.__main__ import main
from polycorner.proofs.checker.proof import StoredProof
from polycorner.proofs.lists import search
from polycorner.proofs.lists.enumeration import stationary_points

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
TUBE = Manifold(("z", "t"), (np.inf, 2 * np.pi), (1, 1))
z, t = TUBE.symbols
SPACE = Manifold.euclidean("u v w")
u, v, w = SPACE.symbols

DISC = Polyhedron(PLANE, {"disc": 100 - x**2 - y**2})
SMALL = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2})
BOWL = Polyhedron(PLANE, {"bowl": y - x**2, "lid": 2 - y})
DISCS = Polyhedron(PLANE, [AnyOf(1 - x**2 - y**2, 1 - (x - 1) ** 2 - y**2)])
ARC = Polyhedron(PLANE, {"up": y}, {"circle": 1 - x**2 - y**2})
CAP = Polyhedron(SPACE, {"up": w}, {"sphere": 1 - u**2 - v**2 - w**2})
BOX = Polyhedron(PLANE, {"right": 5 - x, "left": 5 + x, "top": 5 - y, "bottom": 5 + y})
BAND = Polyhedron(PLANE, {"right": 5 - x, "left": 5 + x})
PIPE = Polyhedron(TUBE, {"up": 1 - z, "down": 1 + z})
SIDE = (-11, 11)


def mirror(q):
    return q * [-1, 1]


def swap(q):
    return q[[1, 0]]


def half_turn(q):
    return q + np.array([0, np.pi])


# polyhedron, energy, sides, symmetries, stationary points: known from the literature (Himmelblau's
# function, the camel) or by hand; None where the list depends on the representatives chosen.
CASES = {
    "himmelblau": (DISC, (x**2 + y - 11) ** 2 + (x + y**2 - 7) ** 2, [SIDE, SIDE], (), 9),
    "camel": (
        BOX,
        (4 - sp.Rational(21, 10) * x**2 + x**4 / 3) * x**2 + x * y + 4 * (y**2 - 1) * y**2,
        [(-6, 6), (-6, 6)],
        (),
        15,
    ),
    "parabola": (BOWL, x + y, [(-3, 3), (-1, 3)], (), 1),
    "two discs": (DISCS, x + 2 * y, [(-3, 3), (-3, 3)], (), 2),
    "arc": (ARC, x + 2 * y, [(-3, 3), (-3, 3)], (), 3),
    "cap": (CAP, u * v + 3 * w, [(-1.5, 1.5), (-1.5, 1.5), (-0.1, 1.5)], (), 5),
    "section": (BAND, (x**2 - 1) ** 2 + x / 4, [SIDE, 0.25], (), 3),
    "strip": (SMALL, x**2, [(-2, 2), (-2, 2)], (), 0),
    "four wells": (DISC, x**4 - x**2 + y**4 - y**2, [SIDE, SIDE], (mirror, swap), None),
    "pipe": (PIPE, sp.cos(2 * t) + z**2, [(-2, 2), (-3, 3.2)], (), 4),
    "half turns": (PIPE, sp.cos(2 * t) + z**2, [(-2, 2), None], (half_turn, mirror), None),
    "ridge": (DISC, sp.Max(x, y - x / 2) + sp.Abs(x) / 4 + y, [(-2, 9), (-9, 1)], (), 0),
}


def prove(polyhedron, energy, box, maps=(), most=100_000):
    symmetry = Symmetry(elements=[Element(f, {}) for f in maps])
    return stationary_points(polyhedron, energy, box=box, symmetry=symmetry, max_boxes=most)


@pytest.fixture(scope="module")
def proofs(tmp_path_factory):
    """Return the saved proof of a case, made once."""
    folder, made = tmp_path_factory.mktemp("proofs"), {}

    def proof(name):
        if name not in made:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", NonsmoothWarning)
                found = prove(*CASES[name][:4])
            made[name] = folder / f"{name}.zip"
            found.save(made[name])
        return made[name]

    return proof


@pytest.mark.parametrize("name", CASES)
def test_proofs_are_verified(name, proofs):
    fine, line = verdict(proofs(name))
    assert fine, line
    assert "no open box" in line
    if CASES[name][4] is not None:
        assert line.startswith(f"verified: {CASES[name][4]} stationary points")


@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
@pytest.mark.parametrize("name", CASES)
def test_proofs_by_second_derivatives_are_verified(name, monkeypatch, tmp_path):
    """As in long searches; the checker knows nothing of them, and bisects."""
    plain = prove(*CASES[name][:4])
    monkeypatch.setattr(search, "SHARP", 0)
    found = prove(*CASES[name][:4])
    assert np.allclose(*(sorted(p.point.tolist() for p in f) for f in (found, plain)))
    fine, line = verdict(found.save(tmp_path / "list.zip"))
    assert fine, line
    assert "no open box" in line


def test_it_stands_alone(proofs, tmp_path):
    """A copy of the folder runs where python-flint is, importing nothing of polycorner."""
    folder = Path(checker.__file__).parent
    shutil.copytree(folder, tmp_path / "checker", ignore=shutil.ignore_patterns("__pycache__"))
    roots = set()
    for file in folder.glob("*.py"):
        nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
        roots |= {a.name.split(".")[0] for n in nodes if isinstance(n, ast.Import) for a in n.names}
        wanted = [n for n in nodes if isinstance(n, ast.ImportFrom)]
        assert all(n.level <= 1 for n in wanted)
        roots |= {n.module.split(".")[0] for n in wanted if n.level == 0}
    assert "flint" in roots
    assert roots <= sys.stdlib_module_names | {"flint"}
    command = [sys.executable, "-m", "checker", str(proofs("parabola")), "--jobs", "2"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == 0
    assert result.stdout.startswith("verified: 1 stationary points")


@pytest.mark.parametrize("option", ["--sample", "--jobs"])
@pytest.mark.parametrize("number", ["0", "-3", "two"])
def test_options_that_are_no_positive_numbers_are_named(option, number, capsys):
    with pytest.raises(SystemExit):
        main(["proof.zip", option, number])
    assert f"argument {option}: invalid positive whole number value" in capsys.readouterr().err


def test_a_file_that_is_not_there_is_no_malformed_one(tmp_path):
    fine, line = verdict(tmp_path / "nothing.zip")
    assert not fine
    assert "cannot be read" in line


def test_loci_without_a_sample_may_be_empty(proofs, tmp_path):
    file = File(proofs("strip"))
    file.data["loci"][0]["sample"] = None
    file.write(tmp_path / "empty.zip")
    assert "1 loci that may be empty" in verdict(tmp_path / "empty.zip")[1]


def test_a_sample_is_called_a_sample(proofs):
    fine, line = verdict(proofs("camel"), "--sample", "20")
    assert fine
    assert "ONLY A SAMPLE of 20 of" in line


# ---------------------------------------------------------------------------- corrupted files


class File:
    """The parts of a saved proof."""

    def __init__(self, path):
        with zipfile.ZipFile(path) as archive:
            self.data = json.loads(archive.read("problem.json"))
            self.codes, self.positions, self.counts, self.directions = (
                np.frombuffer(archive.read(f"{name}.bin"), kind).copy()
                for name, kind in zip(NAMES, ("<i1", "<f8", "<u1", "<f4"), strict=True)
            )
        self.directions = self.directions.reshape(-1, len(self.data["coordinates"]))

    def write(self, path):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("problem.json", json.dumps(self.data))
            for name in NAMES:
                part = self.codes if name == "tree" else getattr(self, name)
                archive.writestr(f"{name}.bin", part.tobytes())


NAMES = ("tree", "positions", "counts", "directions")


def narrow_region(f):
    region = f.data["regions"][0]
    ends = zip(region["lower"], region["upper"], strict=True)
    region["upper"] = [
        ((2 * lo + hi) / 3).hex() for lo, hi in (map(float.fromhex, e) for e in ends)
    ]


def solution_elsewhere(f):
    region = f.data["regions"][0]
    for side in ("sharp_lower", "sharp_upper"):
        region[side][0] = (float.fromhex(region[side][0]) + 1e-9).hex()


def point_and_region_lost(f):
    last = f.data["points"].pop()["region"]
    assert last == len(f.data["regions"]) - 1
    f.data["regions"].pop()


def region_repeated(f):
    f.data["regions"].append(f.data["regions"][0])
    f.data["points"].append({**f.data["points"][0], "region": len(f.data["regions"]) - 1})


def other_constant(f):
    node = next(n for n in reversed(f.data["nodes"]) if n[0] == "const" and n[1] not in "012")
    node[1] = f"{node[1]}1"


def other_operation(f):
    node = next(n for n in reversed(f.data["nodes"]) if n[0] in {"add", "sub"})
    node[0] = "sub" if node[0] == "add" else "add"


def sign_of_symmetry(f):
    f.data["symmetries"][0]["order"] = [0, 1]
    f.data["symmetries"][0]["signs"] = [1, 1]
    f.data["symmetries"][0]["shifts"] = ["0", "1/3"]


def leaf(f):
    """Return the place of the first closed box."""
    return np.argmax(f.codes == -1)


def open_a_leaf(f, code=-2):
    f.codes[leaf(f)] = code


def put(value, *path):
    """Return a change that gives an entry of the data another value."""

    def corrupt(f):
        place = f.data
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value

    return corrupt


def add_one(f, records, name):
    """Add 1 to an entry of the first of some records."""
    f.data[records][0][name] += 1


EVERYWHERE = {
    "turned_direction": lambda f: np.negative(
        row := f.directions[np.cumsum(f.counts)[np.argmax(f.counts == 1)] - 1], out=row
    ),
    "no_direction": lambda f: f.directions.fill(0),
    "directions_not_finite": lambda f: f.directions.fill(np.nan),
    "lost_direction": lambda f: setattr(f, "directions", f.directions[:-1]),
    "uncounted_direction": lambda f: np.subtract.at(f.counts, np.argmax(f.counts > 0), 1),
    "leaf_left_open": open_a_leaf,
    "leaf_split": lambda f: open_a_leaf(f, 0),
    "split_closed": lambda f: np.put(f.codes, 0, -1),
    "unknown_code": lambda f: open_a_leaf(f, -3),
    "axis_that_is_none": lambda f: np.put(f.codes, 0, 5),
    "more_nodes": lambda f: setattr(f, "codes", np.append(f.codes, np.int8(-1))),
    "fewer_nodes": lambda f: setattr(f, "codes", f.codes[:-1]),
    "split_outside": lambda f: np.put(f.positions, -1, 1e3),
    "split_nowhere": lambda f: np.put(f.positions, 0, np.nan),
    "splits_elsewhere": lambda f: np.put(
        f.positions, 0, 0.99 * float.fromhex(f.data["domain"]["upper"][int(f.codes[0])])
    ),
    "wide_region": lambda f: f.data["regions"][0].update(f.data["domain"]),
    "narrow_region": narrow_region,
    "region_without_sides": lambda f: f.data["regions"][0].update(
        lower=[(-np.inf).hex()] * len(f.data["coordinates"])
    ),
    "solution_elsewhere": solution_elsewhere,
    "other_index": lambda f: add_one(f, "regions", "index"),
    "other_index_in_list": lambda f: add_one(f, "points", "index"),
    "other_active_set": lambda f: f.data["regions"][0].update(
        active=[] if f.data["regions"][0]["active"] else [0]
    ),
    "point_not_listed": lambda f: f.data["points"].pop(),
    "point_and_region_lost": point_and_region_lost,
    "point_listed_twice": lambda f: f.data["points"].append(f.data["points"][0]),
    "point_out_of_nothing": lambda f: f.data["points"].append(
        {"region": len(f.data["regions"]), "index": 0}
    ),
    "region_repeated": region_repeated,
    "other_operation": other_operation,
    "unknown_operation": lambda f: operator.setitem(
        next(n for n in f.data["nodes"] if n[0] == "add"), 0, "plus"
    ),
    "operation_on_itself": lambda f: operator.setitem(
        f.data["nodes"][-1], 1, len(f.data["nodes"]) - 1
    ),
    "functions_exchanged": lambda f: f.data["outputs"].reverse(),
    "empty_set": put([], "branches"),
    "whole_space": put([[]], "branches"),
    "unknown_function": lambda f: f.data["branches"][0].append(17),
    "open_boxes_not_counted": lambda f: (open_a_leaf(f), setattr(f, "counts", f.counts[1:])),
    "other_format": put(0, "format", 1),
    "part_missing": lambda f: f.data.pop("regions"),
}


@pytest.mark.parametrize("corrupt", EVERYWHERE.values(), ids=list(EVERYWHERE))
@pytest.mark.parametrize("name", ["parabola", "arc", "two discs"])
def test_corrupted_files_are_refused(name, corrupt, proofs, tmp_path):
    file = File(proofs(name))
    corrupt(file)
    file.write(tmp_path / "corrupted.zip")
    fine, line = verdict(tmp_path / "corrupted.zip")
    assert not fine, line


SOMEWHERE = {
    ("himmelblau", "other_constant"): other_constant,
    ("camel", "other_constant"): other_constant,
    ("two discs", "set_without_a_branch"): lambda f: f.data["branches"].pop(),
    ("half turns", "sign_of_symmetry"): sign_of_symmetry,
    ("half turns", "weights_turned"): lambda f: f.data.update(
        weights=[(-float.fromhex(w)).hex() for w in f.data["weights"]]
    ),
    ("half turns", "no_symmetry"): put([], "symmetries"),
    ("half turns", "symmetry_that_scales"): put(2, "symmetries", 0, "signs", 0),
    ("half turns", "symmetry_without_rank"): put([0, 0], "symmetries", 0, "order"),
    ("strip", "wide_locus"): lambda f: f.data["loci"][0].update(
        lower=[(0.0).hex()], upper=[(3.0).hex()]
    ),
    ("strip", "no_locus"): put([], "loci"),
    ("strip", "locus_in_another_coordinate"): put([1], "loci", 0, "z"),
    ("strip", "locus_elsewhere"): lambda f: f.data["loci"][0].update(
        sharp_lower=[(0.25).hex()], sharp_upper=[(0.5).hex()]
    ),
    ("strip", "locus_off_the_set"): put((2.0).hex(), "loci", 0, "sample", 1),
    **dict.fromkeys(
        [(name, "turned_direction") for name in ("strip", "ridge", "section")],
        EVERYWHERE["turned_direction"],
    ),
}


@pytest.mark.parametrize(
    ("name", "corrupt"),
    [(name, corrupt) for (name, _), corrupt in SOMEWHERE.items()],
    ids=["-".join(key) for key in SOMEWHERE],
)
def test_other_corrupted_files_are_refused(name, corrupt, proofs, tmp_path):
    test_corrupted_files_are_refused(name, corrupt, proofs, tmp_path)


@pytest.mark.parametrize("content", [b"", b"PK", b"not an archive"])
def test_what_is_no_archive_is_refused(content, tmp_path):
    (tmp_path / "some.zip").write_bytes(content)
    assert not verdict(tmp_path / "some.zip")[0]
    assert not verdict(tmp_path / "missing.zip")[0]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32 - 1))
def test_changed_boxes_cover_what_they_did_or_are_refused(seed, proofs, tmp_path_factory):
    """Moved splits and exchanged directions give another proof, or none; the list is the same."""
    rng = np.random.default_rng(seed)
    file = File(proofs("parabola"))
    some = rng.random(len(file.positions)) < 0.1
    file.positions[some] += rng.normal(0, 0.1, some.sum())
    file.directions = file.directions[rng.permutation(len(file.directions))]
    path = tmp_path_factory.mktemp("changed") / "changed.zip"
    file.write(path)
    fine, line = verdict(path)
    assert not fine or line.startswith("verified: 1 stationary points")


# ------------------------------------------------------------------------------- kinks, formulas


@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
@pytest.mark.parametrize("energy", [sp.Abs(x) + y**2, sp.Max(x, -2 * x) + y**2])
def test_a_minimum_at_a_kink_on_the_side_of_the_domain_is_not_lost(energy, tmp_path):
    """At ``x = 0`` the derivative on the one side of the kink is not all there is."""
    found = prove(DISC, energy, [(0, 3), (-2, 1)], most=20_000)
    assert not found.complete
    assert (abs(found.undecided) < 1e-3).all(axis=(1, 2)).any()
    found.save(tmp_path / "kink.zip")
    fine, line = verdict(tmp_path / "kink.zip")
    assert fine, line
    assert f"complete outside {len(found.undecided)} open boxes" in line


FORMULAS = (
    sp.sin(x), sp.cos(x * y), sp.tan(x / 2), sp.asin(x / 3), sp.acos(y / 4), sp.atan(x - y),
    sp.sinh(x), sp.cosh(y), sp.tanh(x * y), sp.exp(x - y), sp.log(x + y), sp.sqrt(x + y),
    sp.erf(x), x / y, (x + y) ** sp.Rational(5, 3), (x + y) ** y, sp.atan2(x, y), x**3 - y**-2,
    sp.Abs(x - y), sp.Min(x, y), sp.Max(x**2, y), sp.Piecewise((x, x < y), (y * x, True)),
    sp.sqrt(x**2 + y**2), sp.pi * x + sp.E * y, sp.Max(0, sp.Min(1, x * y)),
)  # fmt: skip


@pytest.mark.parametrize("formula", FORMULAS, ids=str)
@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
def test_derivatives_are_those_of_sympy(formula, monkeypatch):
    monkeypatch.setattr(flint.ctx, "prec", 128)
    formulas = Formulas([SmoothFunction("f", formula, PLANE)], PLANE)
    nodes, outputs = files.program(formulas.graph, formulas.outputs)
    posed = stated(nodes, outputs).p
    place = {x: sp.Rational(5, 8), y: sp.Rational(7, 4)}
    box = [flint.arb(float(value), 2.0**-30) for value in place.values()]
    v = posed.values(box)
    gradient, hessian = posed.forms(v, 0, {}, 2)

    def holds(ball, expression):
        exact = flint.arb(str(sp.N(expression.doit().subs(place), 30)), 1e-25)
        return ball.overlaps(exact) and ball.rad() < 1e-6 * (1 + abs(exact))

    assert holds(v[outputs[0]], formula)
    zero = flint.arb(0)
    for i, a in enumerate((x, y)):
        assert holds(gradient.get(i, zero), sp.diff(formula, a))
        for j, b in enumerate((x, y)):
            assert holds(hessian.get((i, j), zero), sp.diff(formula, a, b))


def stated(nodes, outputs, **more):
    """Return a problem without inequalities in the unit square, with its proof."""
    sides = {"lower": [(0.0).hex()] * 2, "upper": [(1.0).hex()] * 2}
    empty = {name: [] for name in ("regions", "loci", "symmetries", "fixed", "parameters")}
    data = {"format": problem.FORMAT, "coordinates": ["x", "y"], "periods": [None, None]}
    data |= {"inequalities": 0, "equations": 0, "branches": [[]], "domain": sides}
    data |= {"minima_only": False, "functions": ["E"], "weights": [(0.0).hex()] * 2}
    return StoredProof({**data, **empty, "nodes": nodes, "outputs": outputs, **more})


TURNS = {
    "half a turn": {"order": [0, 1], "signs": [1, 1], "shifts": ["0", "1/2"]},
    "mirror": {"order": [0, 1], "signs": [1, -1], "shifts": ["0", "0"]},
    "mirror and half a turn": {"order": [0, 1], "signs": [-1, -1], "shifts": ["0", "1/2"]},
}
ENERGIES = [sp.cos(2 * y), sp.sin(2 * y) ** 2, sp.sin(y) ** 2, sp.cos(y), sp.sin(y), sp.sin(3 * y)]
ENERGIES += [sp.exp(sp.cos(2 * y)) / (2 + sp.cos(4 * y)), x * sp.cos(y), x**2 - sp.Abs(sp.sin(y))]
ENERGIES += [
    sp.sqrt(2 + sp.sin(y)),
    sp.cos(y + sp.pi / 4) ** 2,
    sp.tan(x * sp.cos(y)),
    x * sp.sin(y),
]


@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("energy", ENERGIES, ids=str)
def test_algebra_shows_the_symmetries_and_no_others(energy, turn, monkeypatch):
    monkeypatch.setattr(flint.ctx, "prec", 128)
    formulas = Formulas([SmoothFunction("E", energy, PLANE)], PLANE)
    nodes, outputs = files.program(formulas.graph, formulas.outputs)
    g = TURNS[turn]
    shift = np.pi if g["shifts"][1] == "1/2" else 0.0
    compute = sp.lambdify((x, y), energy)
    q = np.random.default_rng(0).uniform(0, 1, (2, 50))
    image = compute(g["signs"][0] * q[0], g["signs"][1] * q[1] + shift)
    more = {"periods": [None, "2 pi"], "symmetries": [g]}
    if np.allclose(image, compute(*q)):
        proof = stated(nodes, outputs, **more)
        assert (proof.symmetries[0].proved, proof.periodic) == (True, [])
    else:
        with pytest.raises(balls.NotShownError, match="changes the problem"):
            stated(nodes, outputs, **more)


@pytest.mark.parametrize("level", ["-1", "1/2"])
def test_a_locus_of_an_energy_that_selects_by_another_coordinate_is_refused(level, monkeypatch):
    """The energy is (x - 1/4)^2 or (x - 3/4)^2, whichever ``y < level`` asks for."""
    monkeypatch.setattr(flint.ctx, "prec", 128)
    nodes = [["var", 0], ["var", 1], ["const", "1/4"], ["const", "3/4"], ["const", level]]
    nodes += [["sub", 0, 2], ["sub", 0, 3], ["mul", 5, 5], ["mul", 6, 6], ["lt", 1, 4]]
    nodes += [["select", 9, 7, 8]]
    point = [(0.75).hex()]
    locus = {"z": [0], "index": 0, "sample": None, "lower": [(0.5).hex()], "upper": [(1.0).hex()]}
    locus |= {"sharp_lower": point, "sharp_upper": point}
    if level == "-1":  # which no point of the domain is below
        assert stated(nodes, [10], loci=[locus]).loci[0].index == 0
    else:
        with pytest.raises(balls.NotShownError, match="locus"):
            stated(nodes, [10], loci=[locus])


@pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")
@pytest.mark.parametrize("formula", FORMULAS, ids=str)
@given(seed=st.integers(0, 2**32 - 1))
def test_boxes_enclose_what_their_points_give(formula, seed):
    """Values and gradients at points of a box lie in those of the box, where these are finite."""
    rng, before = np.random.default_rng(seed), flint.ctx.prec
    formulas = Formulas([SmoothFunction("f", formula, PLANE)], PLANE)
    nodes, outputs = files.program(formulas.graph, formulas.outputs)
    posed = stated(nodes, outputs).p
    lower = rng.uniform(-1, 2, 2)
    upper = lower + rng.exponential(0.5, 2)
    points = [rng.uniform(lower, upper) for _ in range(8)]
    found = [forms(posed, balls.hull(lower, upper))]
    found += [forms(posed, balls.hull(q, q)) for q in points]
    flint.ctx.prec = before
    (value, slopes), *inside = found
    for v, g in inside:
        if v.is_finite() and value.is_finite():
            assert value.contains(v)
        if slopes is not None and g is not None:
            for i in (0, 1):
                a, b = slopes.get(i, flint.arb(0)), g.get(i, flint.arb(0))
                assert a.contains(b) or not a.is_finite()


def forms(problem, box):
    v = problem.values(box)
    found = problem.forms(v, 0, {})
    return v[problem.outputs[0]], found and found[0]
