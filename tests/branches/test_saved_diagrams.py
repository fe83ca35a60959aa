"""Proofs of diagrams in files: what the checker says of them, and of files that are changed.

A file in which something was changed is refused, or what is said of it is true: the oracle reads
the program of the file as formulas in SymPy and finds all equilibria on a line at some values of
the parameter, as roots of polynomials.
"""

import copy
import json
import re
from collections import Counter
from functools import cache
from itertools import combinations
from math import pi

import commands
import flint
import pytest
import sympy
from proof_files import described, parts_of, rewritten, said_alone, verdict, with_value, write
from stored_problems import formulas

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry, minimise
from polycorner.branches import BranchProofOptions, branches, prove_branches
from polycorner.minimisation.methods import stationary_on
from polycorner.polyhedra import Element
from polycorner.proofs.checker.diagrams import StoredDiagram
from tests.branches.test_normal_forms import CASES, diagram
from tests.proofs.lists.test_forged_lists import forgeries

x, y, t = sympy.symbols("x y t")
LINE, PLANE = Manifold.euclidean("x"), Manifold.euclidean("x y")
CROSSINGS = {"transcritical"}
BRIEF = BranchProofOptions(max_boxes=300)


def function(name, formula, manifold=LINE, value=0.5):
    known = {"t": value} if sympy.sympify(formula).has(t) else {}
    return SmoothFunction(name, formula, manifold, parameters=known)


def on_a_line(functions, energy, start, active, value=0.5):
    d = Polyhedron(LINE, [function(name, f, LINE, value) for name, f in functions.items()])
    found = stationary_on(d, function("energy", energy, LINE, value), [start], active)
    return branches(found, "t", (-1.0, 1.0))


# On a line: the diagram, and a box.
MADE = {
    "corner limit": (lambda: on_a_line({"wall": x}, -(x**2) / 2 + t * x, 0, ("wall",)), (-1, 3)),
    "fold": (lambda: on_a_line({"far": x + 10}, x**3 / 3 - t * x, 0.5**0.5, ()), (-2, 2)),
    "opens": (lambda: on_a_line({"wall": x}, (x - t) ** 2, 0.5, ()), (-1, 2)),
    "vanishes": (lambda: on_a_line({"a": x, "b": t - x}, x + x**2 / 3, 0, ("a",)), (-2, 2)),
    "exchange": (lambda: on_a_line({"a": x, "b": x - t}, x + x**2 / 9, 0.5, ("b",)), (-2, 2)),
    "lens": (lambda: on_a_line({"a": t - x**2}, x + x**2 / 9, -(0.5**0.5), ("a",)), (-2, 2)),
}  # fmt: skip
FORGED = [*MADE]
MADE["pitchfork"] = (  # which takes the checker longer than all others
    lambda: on_a_line({"far": x + 10}, x**4 / 4 - t * x**2 / 2, 0.5**0.5, ()),
    (-2, 2),
)


@pytest.fixture(scope="session")
def saved(tmp_path_factory):
    """Return a function that saves a proof once, of a diagram with or without a box."""
    folder = tmp_path_factory.mktemp("diagrams")

    @cache
    def file(name, box=True):
        make, side = MADE[name]
        proof = prove_branches(make(), box=[side] if box else None)
        assert proof.proved
        return proof.save(folder / f"{name} {box}.zip")

    return file


EVENT = re.compile(r"([a-z ]+) between (\S+) and ([^,)]+)")


@pytest.mark.parametrize("case", sorted(CASES.keys() - CROSSINGS))
def test_normal_forms_are_verified(case, tmp_path):
    functions, energy, start, value, kind, where, _ = CASES[case]
    d = diagram(functions, energy, start, value)
    proof = prove_branches(d, box=[(-3, 3), (-3, 3)])
    before = flint.ctx.prec
    fine, line = verdict(proof.save(tmp_path / "proof.zip"))
    assert flint.ctx.prec == before
    assert fine, line
    assert "and no other equilibria" in line
    assert f"{len(d.arcs)} arcs" in line
    for index, number in Counter(arc.index for arc in d.arcs).items():
        assert f"{number} of index {index}" in line
    ((name, low, high),) = EVENT.findall(line)
    assert name.strip("( ") == kind.lower().replace("_", " ")
    assert float(low) <= where <= float(high) < float(low) + 1e-9
    assert (
        "nothing is said of other curves"
        in verdict(prove_branches(d).save(tmp_path / "curves.zip"))[1]
    )


def test_a_neck_is_no_point(tmp_path):
    """Where ``y^2 < t + x^2`` pinches off, the point below it ends at ``t = 0``."""
    d = Polyhedron(PLANE, [function("neck", t + x**2 - y**2, PLANE), function("far", y + 5, PLANE)])
    found = stationary_on(d, function("energy", y, PLANE), [0, -(0.5**0.5)], ("neck",))
    proof = prove_branches(branches(found, "t", (-1.0, 1.0)))
    fine, line = verdict(proof.save(tmp_path / "neck.zip"))
    assert fine, line
    assert "dependent between" in line


def test_a_circle_and_an_equation(tmp_path):
    """A pendulum in a field that turns; and a point on a circle, right of a wall that moves."""
    circle = Manifold(("theta",), (2 * pi,))
    (theta,), (a, b) = circle.symbols, sympy.symbols("a b")
    energy = SmoothFunction(
        "energy", -(1 + b) * sympy.cos(theta - a), circle, parameters={"a": 0.0, "b": 0.0}
    )
    d = Polyhedron(circle, {})
    starts = [stationary_on(d, energy, [q], ()) for q in (0.0, 3.0)]
    proof = prove_branches(branches(starts, {"a": 1.0, "b": 0.5}, (0.0, 2.0)), box=[None])
    fine, line = verdict(proof.save(tmp_path / "circle.zip"))
    assert fine, line
    assert "2 arcs (1 of index 0, 1 of index 1)" in line
    assert "no other equilibria" in line

    wall, on = function("wall", x - t, PLANE, -0.5), {"circle": x**2 + y**2 - 1}
    d = Polyhedron(PLANE, [wall], on)
    starts = [stationary_on(d, y, [0, s], ()) for s in (-1, 1)]
    proof = prove_branches(branches(starts, "t", (-0.5, 0.5)), box=[(-2, 2), (-2, 2)])
    fine, line = verdict(proof.save(tmp_path / "equation.zip"))
    assert fine, line
    assert [name.strip("( ") for name, *_ in EVENT.findall(line)] == ["closes", "corner limit"]


def mirrored(symmetry):
    """Return the proof of a ball between two walls that part, pressed against both."""
    d = Polyhedron(PLANE, [function("a", y - x + t, PLANE), function("b", y + x + t, PLANE)])
    energy = function("energy", -(x**2) / 2 + y**2 + 2 * y + x * x * t, PLANE)
    found = stationary_on(d, energy, [0, -0.5], ("a", "b"))
    return prove_branches(branches(found, "t", (-1.0, 1.25)), symmetry=symmetry)


MIRROR = Symmetry(elements=[Element(lambda q: q * [-1, 1], {"a": "b", "b": "a"})])


def test_what_vanishes_together_by_symmetry(tmp_path):
    """The corner of two walls is left where both multipliers, ``1 - t``, vanish."""
    proof = mirrored(MIRROR)
    assert proof.proved
    fine, line = verdict(path := proof.save(tmp_path / "mirror.zip"))
    assert fine, line
    ((_, low, high),) = EVENT.findall(line)
    assert float(low) <= 1 <= float(high)
    data, parts = described(path), parts_of(path)
    for change in (
        {"symmetries": []},
        {"symmetries": [{"order": [0, 1], "signs": [1, 1], "functions": [1, 0]}]},
        {"symmetries": [{"order": [0, 1], "signs": [-1, 1], "functions": [0, 1]}]},
        {"symmetries": [{"order": [1, 0], "signs": [-1, 1], "functions": [1, 0]}]},
        {"symmetries": [{"order": [0, 1], "signs": [-1, 2], "functions": [1, 0]}]},
    ):
        assert not verdict(rewritten(tmp_path / "forged.zip", data | change, parts))[0]


def test_the_checker_runs_without_polycorner(saved, tmp_path):
    assert said_alone(saved("fold"), tmp_path) == verdict(saved("fold"))[1]


def test_what_is_not_proved_is_not_saved(tmp_path):
    functions, energy, start, value, *_ = CASES["transcritical"]
    crossing = prove_branches(diagram(functions, energy, start, value))
    with pytest.raises(ValueError, match="save: expected a diagram of which all arcs and events"):
        crossing.save(tmp_path / "crossing.zip")
    make, _ = MADE["fold"]
    with pytest.raises(ValueError, match="zip"):
        prove_branches(make()).save(tmp_path / "fold.json")


def test_open_boxes_are_not_saved(tmp_path):
    energy = function("energy", (x**2 - 1) ** 2 / 4 + t * x / 10)
    d = Polyhedron(LINE, {"far": x + 10})
    some = branches(minimise(d, energy, [1.0]), "t", (-1.0, 1.0))
    with pytest.raises(ValueError, match="save: expected a box without open parts"):
        prove_branches(some, box=[(-3, 3)], options=BRIEF).save(tmp_path / "open.zip")


def test_saving_twice_gives_the_same_file(saved, tmp_path):
    make, side = MADE["corner limit"]
    again = prove_branches(make(), box=[side]).save(tmp_path / "again.zip")
    assert again.read_bytes() == saved("corner limit").read_bytes()


# ------------------------------------------------------------------------------------- the oracle


def equilibria(data, value):
    """Return all equilibria on the line as (active, index, place), in exact arithmetic."""
    at = {t: sympy.Rational(value)}
    *f, energy = [e.subs(at) for e in formulas(data, [x, t])]
    found = []
    for active in ((), *combinations(range(len(f)), 1)):
        (held,) = [f[i] for i in active] or [sympy.diff(energy, x)]
        for root in set(sympy.real_roots(sympy.Poly(held, x))) if held.has(x) else ():
            others = [g.subs(x, root) for i, g in enumerate(f) if i not in active]
            if active:
                slope = sympy.diff(energy, x) / sympy.diff(held, x)
                good, index = slope.subs(x, root) > 0, 0
            else:
                bent = sympy.diff(energy, x, 2).subs(x, root)
                good, index = True, int(bool(bent < 0))
            if good and all(g > 0 for g in others):
                found.append((active, index, float(root)))
    return found


def judge(data):
    """Check arcs against all equilibria at some values of the parameter."""
    before = flint.ctx.prec
    stored = StoredDiagram(data)
    flint.ctx.prec = before
    low, high = (float.fromhex(z) for z in data["interval"])
    for share in (0.11, 0.37, 0.61, 0.93):
        value = round(low + share * (high - low), 9)
        exact = equilibria(data, value)
        there = Counter(
            (arc.face.active, record["index"])
            for arc, record in zip(stored.arcs, data["arcs"], strict=True)
            if stored.events[record["events"][0]].x[1]
            < value
            < stored.events[record["events"][1]].x[1]
        )
        assert not there - Counter(e[:2] for e in exact)
        if data["domain"] is not None:
            a, b = (float.fromhex(data["domain"][side][0]) for side in ("lower", "upper"))
            assert not Counter(e[:2] for e in exact if a <= e[2] <= b) - there


# ------------------------------------------------------------------------------ what is changed

PROBLEM = ("inequalities", "equations", "branches", "nodes", "outputs", "interval", "domain")


def fields(data, path=()):
    """Yield the places of values in nested lists and dictionaries, with these.

    Of nodes all, of the points along an arc the first, of arcs and events all.
    """
    yield path, data
    keys = data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ()
    for key in list(keys)[:1] if path[-1:] == ("points",) else keys:
        yield from fields(data[key], (*path, key))


def sentence(line):
    """Return a verdict without numbers that depend on the proof and names that say nothing."""
    line = re.sub(r" between \S+ and [^,)]+|\d+ leaves", "", line)
    return re.sub(r"over \S+ from|the box \S+ from|for all \S+ from", "", line)


@pytest.mark.parametrize("box", [False, True])
@pytest.mark.parametrize("name", FORGED)
def test_what_is_said_of_a_forged_file_is_true(name, box, saved, tmp_path):
    parts = parts_of(saved(name, box))
    data, (fine, line) = json.loads(parts["problem.json"]), verdict(saved(name, box))
    assert fine, line
    judge(data)
    posed = [data[key] for key in PROBLEM]
    some = fields(data) if not box else ((p, v) for p, v in fields(data) if p[:1] != ("arcs",))
    refused = 0
    for path, value in some:
        for forged in forgeries(value):
            told = with_value(data, path, forged)
            verified, said = verdict(rewritten(tmp_path / "forged.zip", told, parts))
            refused += not verified
            if not verified:
                assert "\n" not in said
                continue
            if [told[key] for key in PROBLEM] == posed:
                assert sentence(said) == sentence(line), (path, value, forged)
            else:
                judge(told)
    assert refused > 50


KINDS = ("fold", "opens", "closes", "exchange", "corner_limit", "branch", "dependent", "vanishes")
KINDS += ("end", "far", "undecided", "re_entrant", "FOLD", "")


def changes_of_arc(data, k):
    """Yield places of an arc and what may not be there."""
    for index in (-1, 0, 1, 2):
        yield ("arcs", k, "index"), index
    for active in ([], [0], [1], [0, 0], [0, 1]):
        yield ("arcs", k, "active"), active
    for side in (0, 1):
        for event in range(len(data["events"])):
            yield ("arcs", k, "events", side), event
        for zeros in ([], [0], [1], [2], [3], [4], [5], [0, 1], [1, 4]):
            yield ("arcs", k, "zeros", side), zeros
    points = data["arcs"][k]["points"]
    yield ("arcs", k, "points"), points[::-1]
    yield ("arcs", k, "points"), points[:1]


def changes(data):
    """Yield places and what has to be refused there, whatever else is in a file."""
    arcs, events = data["arcs"], data["events"]
    for k in range(len(arcs)):
        yield ("arcs",), arcs[:k] + arcs[k + 1 :]
        yield ("arcs",), [*arcs, arcs[k]]
        yield from changes_of_arc(data, k)
    for k in range(len(events)):
        yield ("events",), events[:k] + events[k + 1 :]
        yield ("events",), [*events, events[k]]
        for kind in KINDS:
            yield ("events", k, "kind"), kind


def stated_twice(data):
    """Return a file with all arcs and events twice."""
    count = len(data["events"])
    again = [arc | {"events": [e + count for e in arc["events"]]} for arc in data["arcs"]]
    return data | {"arcs": data["arcs"] + again, "events": data["events"] * 2}


def nudged(data):
    """Return the same, where the arcs differ in the last digits of their points."""
    told = copy.deepcopy(stated_twice(data))
    for arc in told["arcs"][len(data["arcs"]) :]:
        row = arc["points"][-1]
        row[0] = (float.fromhex(row[0]) + 1e-12).hex()
    return told


@pytest.mark.parametrize("name", MADE)
def test_wrong_diagrams_are_refused(name, saved, tmp_path):
    parts = parts_of(saved(name, False))
    data = json.loads(parts["problem.json"])
    told = [(place, with_value(data, place, value)) for place, value in changes(data)]
    told += [("all twice", stated_twice(data)), ("all twice, nearly", nudged(data))]
    for what, forged in told:
        if forged != data:
            fine, line = verdict(rewritten(tmp_path / "wrong.zip", forged, parts))
            assert not fine, what
            assert line.count("\n") == 0
            assert len(line) < 1100


def test_an_arc_and_its_events_are_not_left_out_of_a_box(tmp_path):
    """A double well has three equilibria: with any of them dropped a box is not free of others."""
    energy = function("energy", (x**2 - 1) ** 2 / 4 + t * x / 10)
    d = Polyhedron(LINE, {"far": x + 10})
    starts = [stationary_on(d, energy, [q], ()) for q in (-1.0, 0.0, 1.0)]
    proof = prove_branches(branches(starts, "t", (-1.0, 1.0)), box=[(-3, 3)])
    path = proof.save(tmp_path / "three.zip")
    assert verdict(path)[0]
    parts, data = parts_of(path), described(path)
    for k in range(3):
        told = copy.deepcopy(data)
        gone = told["arcs"].pop(k)["events"]
        told["events"] = [e for j, e in enumerate(told["events"]) if j not in gone]
        for arc in told["arcs"]:
            arc["events"] = [e - sum(g < e for g in gone) for e in arc["events"]]
        fine, line = verdict(rewritten(tmp_path / "two.zip", told, parts))
        assert not fine
        assert "leaf" in line
        # Without the box the file is true: nothing is said of others.
        fine, line = verdict(rewritten(tmp_path / "two.zip", told | {"domain": None}, parts))
        assert fine, line
        assert "2 arcs" in line
        assert "nothing is said of other curves" in line


def test_a_box_is_covered_by_its_parts(saved, tmp_path):
    """A wider box, other nodes, places, numbers of directions: each is refused."""
    parts, data = parts_of(saved("corner limit")), described(saved("corner limit"))
    tree, places, counts = (parts[f"{name}.bin"] for name in ("tree", "positions", "counts"))
    wrong = [
        {"tree.bin": tree[:-1]}, {"tree.bin": tree + tree[-1:]}, {"tree.bin": b""},
        {"tree.bin": tree.replace(b"\xff", b"\xfe", 1)}, {"tree.bin": b"\x05" + tree[1:]},
        {"positions.bin": places[:-8]}, {"positions.bin": places + places[-8:]},
        {"positions.bin": places[8:16] + places[8:]}, {"counts.bin": counts[:-2]},
        {"counts.bin": b"\x01" + counts[1:]}, {"directions.bin": bytes(8)},
    ]  # fmt: skip
    for change in wrong:
        assert not verdict(write(tmp_path / "wrong.zip", parts | change))[0], change
    for side, factor in (("lower", 2.0), ("upper", 2.0)):
        for axis in (0, 1):
            told = copy.deepcopy(data)
            z = float.fromhex(told["domain"][side][axis])
            told["domain"][side][axis] = (factor * z).hex()
            fine, line = verdict(rewritten(tmp_path / "wide.zip", told, parts))
            if fine:  # the box is another one, which the line states
                assert axis == 0
                judge(told)
                assert f"{factor * z}" in line
    missing = {name: content for name, content in parts.items() if name != "tree.bin"}
    assert not verdict(write(tmp_path / "missing.zip", missing))[0]


def test_the_command_says_what_is_verified(saved, tmp_path, capsys):
    code, out, _ = commands.run(capsys, "verify", str(saved("fold", False)))
    assert code == 0
    assert out.startswith("verified: equilibria over t from -1.0 to 1.0, 2 arcs (1 of index 0, 1")
    parts, data = parts_of(saved("fold", False)), described(saved("fold", False))
    data["events"].pop()
    path = rewritten(tmp_path / "less.zip", data, parts)
    code, out, _ = commands.run(capsys, "verify", str(path))
    assert code == 1
    assert out.startswith("NOT VERIFIED: ")


def test_a_sample_is_said_to_be_one(saved):
    fine, line = verdict(saved("corner limit"), "--sample", "3")
    assert fine
    assert "ONLY A SAMPLE of 3" in line
