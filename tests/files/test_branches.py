"""Diagrams in files: read to the last bit, and refused where functions differ."""

import numpy as np
import pytest
import sympy
from diagrams import PLANE, STOP, T, X, Y, leaning_well
from kept_files import rewritten

from polycorner import AnyOf, Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import branches
from polycorner.files import load_diagram, save_diagram
from polycorner.files.branches import KIND


def vanishing():
    """A lens whose corner goes through dependent gradients, over two rates under one name."""
    a = SmoothFunction("a", 1 + T - (X - 1) ** 2 - Y**2, PLANE, parameters={"t": 0.5})
    s = sympy.Symbol("s")
    b = SmoothFunction("b", s - (X + 1) ** 2 - Y**2, PLANE, parameters={"s": 1.0})
    found = minimise(Polyhedron(PLANE, [a, b]), Y, [0, -0.2])
    return branches(found, {"t": 1.0, "s": 0.25}, (-0.7, 0.3)).named("size", 2.0)


def on_a_sphere():
    """Equilibria on a sphere, in a union, whose heights turn with the parameter."""
    M = Manifold.sphere("u")
    u = M.symbols
    energy = SmoothFunction("E", u[2] + T * u[0] + u[1] ** 2, M, parameters={"t": 0.3})
    either = Polyhedron(M, [AnyOf(u[0], u[1] + 2)])
    return branches(minimise(either, energy, [0.0, 0.6, -0.8]), "t", (-0.5, 0.5))


@pytest.mark.parametrize("make", [leaning_well, vanishing, on_a_sphere])
def test_a_diagram_is_read_to_the_last_bit(make, tmp_path):
    found = make()
    path = save_diagram(found, tmp_path / "diagram.json")
    read = load_diagram(path)
    assert str(read) == str(found)
    for one, other in zip(read.arcs, found.arcs, strict=True):
        assert (one.active, one.index, one.events) == (other.active, other.index, other.events)
        for name in ("parameters", "points", "energies"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for name, values in other.multipliers.items():
            np.testing.assert_array_equal(one.multipliers[name], values)
    for one, other in zip(read.events, found.events, strict=True):
        np.testing.assert_array_equal(one.point, other.point)
        for name in ("kind", "parameter", "before", "after", "functions", "arcs", "note"):
            assert getattr(one, name) == getattr(other, name)
    middle = sum(found.interval) / 2
    assert [c.verdict for c in read.at(middle)] == [c.verdict for c in found.at(middle)]
    assert save_diagram(read, tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_ones_own_problem_may_be_passed(tmp_path):
    path = save_diagram(leaning_well(), tmp_path / "d.json")
    problem = leaning_well().problem
    for own in ((problem.polyhedron,), (problem.polyhedron, problem.energy)):
        assert load_diagram(path, *own).problem.polyhedron is problem.polyhedron


@pytest.mark.parametrize(
    ("polyhedron", "more", "what"),
    [
        (None, X / 1000, r"energy at point 0 of arcs\[0\]"),
        ({"stop": STOP - X}, 0, "functions: written stop, far, found stop"),
        ({"stop": STOP + 0.1 - X, "far": X + 9}, 0, r"'stop' at point 0 .*: written as zero"),
        ({"stop": STOP - X, "far": X + 1}, 0, r"'far' at point 0 of arcs\[0\]: written as met"),
    ],
)
def test_another_problem_is_refused(polyhedron, more, what, tmp_path):
    path = save_diagram(leaning_well(), tmp_path / "d.json")
    old = leaning_well().problem.energy
    energy = SmoothFunction("E", old.expression + more, PLANE, parameters={"t": 0.0})
    chosen = None if polyhedron is None else Polyhedron(PLANE, polyhedron)
    with pytest.raises(ValueError, match=rf"^path: .*d\.json is of another .*: {what}"):
        load_diagram(path, chosen, energy)


DAMAGES = [
    (lambda c: c.pop("arcs"), "arcs"),
    (lambda c: c.update(problem=[]), "problem"),
    (lambda c: c.update(rates={"s": 1.0}), "parameters"),
    (lambda c: c.update(rates={}), "parameters with one value: written none, found t"),
    (lambda c: c.update(interval=[0.6, -0.6]), "interval"),
    (lambda c: c.update(value=0.1), r"arcs\[0\]"),
    (lambda c: c.update(closed=1), "closed"),
    (lambda c: c["arcs"][0].update(active=["wall"]), r"arcs\[0\].active\[0\]"),
    (lambda c: c["arcs"][0]["parameters"].reverse(), r"arcs\[0\].parameters"),
    (lambda c: c["arcs"][0]["parameters"].pop(), r"arcs\[0\]: expected two points or more"),
    (lambda c: c["arcs"][0]["points"][1].pop(), r"arcs\[0\].points\[1\]"),
    (lambda c: c["arcs"][0]["points"][1].reverse(), r"point 1 of arcs\[0\]"),
    (lambda c: c["arcs"][0]["energies"].reverse(), r"energy at point 0 of arcs\[0\]"),
    (lambda c: c["arcs"][0].update(index=-1), r"arcs\[0\].index"),
    (lambda c: c["arcs"][0].update(events=[0, 9]), r"arcs\[0\].events\[1\]"),
    (lambda c: c["arcs"][-1]["multipliers"].update(stop=[1.0]), r"arcs\[3\]"),
    (lambda c: c["arcs"][-1]["multipliers"]["stop"].reverse(), r"multipliers at point 0"),
    (lambda c: c["events"][0].update(kind="BANG"), r"events\[0\].kind"),
    (lambda c: c["events"][0].update(parameter="nan"), r"events\[0\].parameter"),
    (lambda c: c["events"][0].update(parameter=0.0), r"events\[0\]: written"),
    (lambda c: c["events"][0]["point"].reverse(), r"events\[0\]: written"),
    (lambda c: c["events"][0].update(arcs=[3]), r"events\[0\].arcs\[0\]"),
    (lambda c: c["events"][0].update(functions=[0]), r"events\[0\].functions\[0\]"),
    (lambda c: c["events"][0].update(note=None), r"events\[0\].note"),
]


@pytest.mark.parametrize(("damage", "place"), DAMAGES)
def test_each_number_is_checked(damage, place, tmp_path):
    path = save_diagram(leaning_well(), tmp_path / "d.json")
    rewritten(KIND, path, damage)
    with pytest.raises(ValueError, match=rf"^path: [^\n]*d\.json[^\n]*{place}[^\n]*$"):
        load_diagram(path)


def test_formulas_are_not_executed(tmp_path):
    path = save_diagram(leaning_well(), tmp_path / "d.json")
    target = tmp_path / "made"
    code = f"__import__('pathlib').Path('{target}').touch()"

    def damage(content):
        formulas = content["problem"]["families"][0]["formulas"]
        formulas[next(iter(formulas))] = code

    rewritten(KIND, path, damage)
    with pytest.raises(ValueError, match=r"^path: "):
        load_diagram(path)
    assert not target.exists()
