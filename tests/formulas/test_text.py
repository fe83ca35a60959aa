"""No argument is executed: text where a formula belongs is refused in one sentence."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from diagrams import leaning_well
from landscape_values import double_well

import polycorner
from polycorner import (
    Manifold,
    Polyhedron,
    SmoothFunction,
    certify,
    exact_point,
    minima,
    minimise,
    prove,
)
from polycorner.bodies import (
    Arrangement,
    Mass,
    Motor,
    Prescribed,
    Rail,
    Robot,
    RobotJoint,
    RobotLink,
    box,
    disc,
    sphere,
)
from polycorner.dumbbells.viewer import descent
from polycorner.files import (
    load_certificate,
    load_diagram,
    load_landscape,
    save_certificate,
    save_diagram,
    save_landscape,
    save_problem,
)
from polycorner.formulas.families import Family
from polycorner.landscapes import basins, landscape, search_landscape
from polycorner.minimisation import stationary_on
from polycorner.motion import (
    Attraction,
    ContactFamily,
    Drift,
    Friction,
    PairFriction,
    System,
    Tie,
    random_field,
    random_signal,
    velocities,
)
from polycorner.motion.friction import Interval
from polycorner.polyhedra import AllOf, AnyOf, Symmetry, nerve
from polycorner.proofs import stationary_points

ROOT = Path(polycorner.__file__).parent
M = Manifold.euclidean("x y")
x, y = M.symbols
vx, vy = velocities(M)
D = Polyhedron(M, {"right": x, "above": y})
FLAT = Polyhedron(M, {"right": AnyOf(x - 1, y), "above": 2 - y})
MOVING = (vx**2 + vy**2) / 2
FIELD = {"rms": 1.0, "correlation_length": 1.0}


def pair(**given):
    """Return a family of contacts with one argument spoilt."""
    usual = {"gaps": {"g": sp.Symbol("x1", real=True)}, "reach": 1.0}
    return ContactFamily(**{**usual, **given})


def certificate():
    return certify(D, x**2 + y**2, [0.0, 0.0])


# Of every public callable that is given formulas: its name and argument, what the sentence names,
# and a call with something else in their place.
CASES = {
    "Family.of.expressions": ("f", lambda e, _: Family.of({"f": e}, ["x"])),
    "Family.of.definitions": ("d", lambda e, _: Family.of({"f": x}, ["x"], (), {"d": e})),
    "SmoothFunction.expression": ("f", lambda e, _: SmoothFunction("f", e, M)),
    "SmoothFunction.definitions": (
        "d",
        lambda e, _: SmoothFunction("f", x, M, definitions={"d": e}),
    ),
    "SmoothFunction.quantity.expression": (
        "expression",
        lambda e, _: SmoothFunction.quantity("f", e, M),
    ),
    "Polyhedron.parts": ("f", lambda e, _: Polyhedron(M, {"f": e})),
    "Polyhedron.equations": ("h", lambda e, _: Polyhedron(M, {"f": x}, {"h": e})),
    "AllOf.parts": ("parts", lambda e, _: Polyhedron(M, AllOf(e, x))),
    "AnyOf.parts": ("parts", lambda e, _: Polyhedron(M, AnyOf(e, x))),
    "Symmetry.fields": (
        "x",
        lambda e, _: prove(certificate(), symmetry=Symmetry(fields=[{"x": e}])),
    ),
    "nerve.height": ("height", lambda e, _: nerve(FLAT, e)),
    "certify.energy": ("energy", lambda e, _: certify(D, e, [1.0, 1.0])),
    "exact_point.energy": ("energy", lambda e, _: exact_point(D, [1.0, 1.0], e)),
    "save_problem.energy": ("energy", lambda e, folder: save_problem(folder / "p.toml", D, e)),
    "minimise.energy": ("energy", lambda e, _: minimise(D, e, [1.0, 1.0])),
    "minima.energy": ("energy", lambda e, _: minima(D, e, starts=[[1.0, 1.0]])),
    "stationary_on.energy": ("energy", lambda e, _: stationary_on(D, e, [1.0, 1.0], ["right"])),
    "stationary_points.energy": (
        "energy",
        lambda e, _: stationary_points(D, e, box={"x": (0, 1), "y": (0, 1)}),
    ),
    "Proof.enclose.expression": ("expression", lambda e, _: prove(certificate()).enclose(e)),
    "descent.energy": ("energy", lambda e, _: descent(D, e, [1.0, 1.0])),
    "landscape.energy": ("energy", lambda e, _: landscape(D, e, box=[(-1, 2), (-1, 2)])),
    "search_landscape.energy": ("energy", lambda e, _: search_landscape(D, e, starts=[[1.0, 1.0]])),
    "basins.energy": ("energy", lambda e, _: basins(D, e, starts=[[1.0, 1.0]])),
    "load_landscape.energy": (
        "energy",
        lambda e, folder: load_landscape(save_landscape(double_well(), folder / "l.json"), D, e),
    ),
    "load_diagram.energy": (
        "energy",
        lambda e, folder: load_diagram(save_diagram(leaning_well(), folder / "b.json"), D, e),
    ),
    "load_certificate.energy": (
        "energy",
        lambda e, folder: load_certificate(
            save_certificate(certificate(), folder / "c.json"), D, e
        ),
    ),
    "System.kinetic": ("kinetic", lambda e, _: System(D, e)),
    "System.potential": ("potential", lambda e, _: System(D, MOVING, e)),
    "System.forces": ("forces", lambda e, _: System(D, MOVING, forces={"x": e})),
    "System.rheonomic": ("rheonomic", lambda e, _: System(D, MOVING, rheonomic={"h": e})),
    "System.limits": ("limits", lambda e, _: System(D, MOVING, limits={"f": e})),
    "System.nonholonomic": ("nonholonomic", lambda e, _: System(D, MOVING, nonholonomic={"h": e})),
    "Attraction.energy.gap": ("gap", lambda e, _: Attraction(1.0, 0.1).energy(e)),
    "Drift.velocity": ("velocity", lambda e, _: Drift(D, {"x": e})),
    "Drift.limits": ("limits", lambda e, _: Drift(D, {"x": 1.0}, limits={"f": e})),
    "Friction.slip": ("slip", lambda e, _: Friction("f", (e,), Interval(0.5), "right")),
    "Friction.load": ("load", lambda e, _: Friction("f", (vx,), Interval(0.5), (e,))),
    "PairFriction.slip": ("slip", lambda e, _: PairFriction({"g": (e,)}, Interval(0.5))),
    "ContactFamily.gaps": ("gaps", lambda e, _: pair(gaps={"g": e})),
    "Tie.equations": ("equations", lambda e, _: Tie(0, "t", equations={"h": e})),
    "Tie.limits": ("limits", lambda e, _: Tie(0, "t", limits={"f": e})),
    "Tie.potential": ("potential", lambda e, _: Tie(0, "t", potential=e)),
    "Tie.forces": ("forces", lambda e, _: Tie(0, "t", forces={"x1": e})),
    "ContactFamily.definitions": ("definitions", lambda e, _: pair(definitions={"d": e})),
    "random_signal.time": ("time", lambda e, _: random_signal(e, rms=1.0, band=(1.0, 2.0))),
    "random_field.x": ("x", lambda e, _: random_field(e, y, **FIELD)),
    "random_field.y": ("y", lambda e, _: random_field(x, e, **FIELD)),
    "Rail.curve": ("curve", lambda e, _: Rail("world", "A", curve=e)),
    "Motor.torque": ("torque", lambda e, _: Motor("J", e)),
    "Motor.speed": ("speed", lambda e, _: Motor("J", speed=e, limit=1.0)),
    "Prescribed.motion": ("motion", lambda e, _: Prescribed("J", e, limit=1.0)),
    "Robot.system.torques": ("torques", lambda e, _: hinged().system(torques={"hinge": e})),
    "Robot.system.motions": ("motions", lambda e, _: hinged().system(motions={"hinge": e})),
    "Robot.system.limits": ("limits", lambda e, _: hinged().system(limits={"f": e})),
    "Robot.system.nonholonomic": (
        "nonholonomic",
        lambda e, _: hinged().system(nonholonomic={"h": e}),
    ),
    "Arrangement.system.forces": (
        "forces",
        lambda e, _: Arrangement({"A": disc(1.0)}, WALLS).system(forces={"A": [e, 0.0]}),
    ),
    "Arrangement.system.gravity": (
        "gravity",
        lambda e, _: Arrangement({"disc": disc(1.0)}).system(density=1.0, gravity=[e, -9.81]),
    ),
}

WALLS = box([-5, -5], [5, 5])


def hinged():
    links = {"a": RobotLink(), "b": RobotLink(sphere(0.1), Mass(1.0, [1, 0, 0], [1, 1, 1]))}
    return Robot(links, {"hinge": RobotJoint("a", "b", upper=1.0)})


DISGUISES = {
    "text": lambda text: text,
    "text of NumPy": np.str_,
    "bytes": str.encode,
    "list": lambda text: [text],
    "tuple": lambda text: (text,),
    "set": lambda text: frozenset([text]),
    "mapping": lambda text: {"a": text},
    "mapping of keys": lambda text: {text: 1},
    "array": lambda text: np.array([text], dtype=object),
    "array of no dimension": lambda text: np.array(text, dtype=object),
    "array of text": np.array,
    "nested": lambda text: [[{"a": (text,)}]],
}


@pytest.mark.parametrize(("named", "call"), CASES.values(), ids=CASES)
def test_text_is_not_executed(named, call, tmp_path, subtests):
    canary = tmp_path / "executed"
    for name, disguise in DISGUISES.items():
        with subtests.test(name):
            given = disguise(f"__import__('pathlib').Path({str(canary)!r}).touch()")
            with pytest.raises((TypeError, ValueError)) as caught:
                call(given, tmp_path)
            assert not canary.exists()
            assert re.search(rf"\b{named}\b", str(caught.value)), "the argument is named"
            assert "\n" not in str(caught.value)


FORMULAS = re.compile(r"sympy\.Expr|\bEnergy\b|\bExpressions\b|ForwardRef\('sympy")


def public():
    """Yield the public classes and functions with their names."""
    for stub in ROOT.rglob("__init__.pyi"):
        package = importlib.import_module(".".join(stub.parent.relative_to(ROOT.parent).parts))
        for node in ast.parse(stub.read_text()).body:
            if isinstance(node, ast.ImportFrom):
                for name in (alias.asname or alias.name for alias in node.names):
                    yield name, getattr(package, name)


def called():
    """Yield what a user can call, methods included."""
    for name, value in public():
        if callable(value):
            yield name, value
        for method, member in inspect.getmembers(value) if inspect.isclass(value) else ():
            if not method.startswith("_") and callable(member):
                yield f"{name}.{method}", member


def test_every_public_argument_that_is_a_formula_is_tried():
    found = set()
    for name, value in called():
        try:
            parameters = inspect.signature(value).parameters.values()
        except (TypeError, ValueError):
            continue
        found |= {f"{name}.{p.name}" for p in parameters if FORMULAS.search(str(p.annotation))}
    # Given by a callable, which is code anyway.
    assert found - {"Family.formulas"} - CASES.keys() == set()


ALLOWED = {
    "sympify": {"formulas/expressions.py"},
    "parse_expr": set(),
    "parse_latex": set(),
    "S()": set(),
    "N()": set(),
    "nsimplify": {"motion/rotations.py"},  # of doubles
    # Of expressions that have a compiled form in known symbols.
    "lambdify": {"formulas/periodicity.py"},
    "eval": {"kinds.py"},  # of annotations in the package's own source
    "exec": set(),
    # Of what this process, or the one that started it, has pickled.
    "pickle.loads": {"workers.py", "formulas/families.py", "formulas/shipped.py"},
    "pickle.load": set(),
    "marshal.loads": set(),
    "yaml.load": set(),
    "allow_pickle=True": set(),
}


def used(tree):
    """Yield the names that are called or handed on, and those of arguments."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name | ast.Attribute | ast.keyword):
            yield ast.unparse(node)
        elif isinstance(node, ast.Call):
            yield f"{ast.unparse(node.func)}()"
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_text_is_read_in_one_place_only():
    found = {name: set() for name in ALLOWED}
    for file in ROOT.rglob("*.py"):
        for word in used(ast.parse(file.read_text(encoding="utf-8"))):
            for name in ALLOWED:
                if f".{word}".endswith(f".{name}"):
                    found[name].add(file.relative_to(ROOT).as_posix())
    assert found == ALLOWED
