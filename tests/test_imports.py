"""Importing the package is cheap, and every public name is there."""

import ast
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import networkx as nx
import pytest

import polycorner
import polycorner.cli
import polycorner.toolkit
from docs.extensions import homes

ROOT = Path(polycorner.__file__).parents[1]
HEAVY = ("sympy", "numba", "llvmlite", "scipy", "cvxpy", "clarabel", "matplotlib", "rich", "click")
OUTSIDE = re.compile(r"polycorner(?!\.dumbbells)\b")
LOADED = """
import sys
before = set(sys.modules)
{statement}
names = {{name.partition(".")[0] for name in set(sys.modules) - before}}
print(*sorted(names - set(sys.stdlib_module_names)))
"""


def loaded_by(statement):
    """Return the packages outside the standard library that a statement loads."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", LOADED.format(statement=statement)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    return {name for name in done.stdout.split() if not name.startswith("_")}


def test_importing_the_package_loads_numpy_at_most():
    assert loaded_by("import polycorner") <= {"polycorner", "numpy", "lazy_loader"}


def test_the_first_name_costs_numpy_and_nothing_more():
    assert loaded_by("from polycorner import Manifold") == {"polycorner", "numpy", "lazy_loader"}


@pytest.mark.parametrize(
    "statement",
    [
        "from polycorner import AllOf, AnyOf, Polyhedron, SmoothFunction, Stratum, stratum_at",
        "from polycorner import Verdict, Entrapment, PolycornerError, SolverError",
        "from polycorner.polyhedra import LocalType",
        "import polycorner; dir(polycorner); polycorner.__version__",
    ],
)
def test_names_for_writing_a_problem_load_nothing_heavy(statement):
    assert not loaded_by(statement) & set(HEAVY)


@pytest.mark.parametrize("name", polycorner.__all__)
def test_every_public_name_resolves(name):
    value = getattr(polycorner, name)
    assert value.__name__.rpartition(".")[2] == name
    assert value.__module__.startswith("polycorner.")
    assert value.__doc__


def test_public_names_are_sorted_and_listed():
    assert list(polycorner.__all__) == sorted(polycorner.__all__)
    assert set(polycorner.__all__) <= set(dir(polycorner))
    assert polycorner.__version__.count(".") == 2


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no 'Dumbbell'"):
        _ = polycorner.Dumbbell


VERB = """
from polycorner import Manifold, Polyhedron, minimise, minima
M = Manifold.euclidean("x")
x = M.symbols[0]
print(len(minima(Polyhedron(M, [1 - x**2]), -(x**2), starts=[[0.3], [-0.2]])))
"""


def test_minima_is_a_verb_whatever_was_imported_before():
    command = [sys.executable, "-c", VERB]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "2"


def test_no_imports_form_a_circle_not_even_for_type_checking():
    grimp = pytest.importorskip("grimp", reason="grimp comes with the extra lint")
    graph = grimp.build_graph("polycorner", "paper_checks", exclude_type_checking_imports=False)
    edges = ((a, b) for a in graph.modules for b in graph.find_modules_directly_imported_by(a))
    arrows = nx.DiGraph(edges)
    assert len(arrows) > 200
    circles = [c for c in nx.strongly_connected_components(arrows) if len(c) > 1]
    assert not circles


UNDEFINED = """
import warnings, numpy, polycorner
for name in ("polycorner.motion.anywhere", "mine"):
    with warnings.catch_warnings(record=True) as heard:
        exec("numpy.array([1.0, 0.0]) / 0", {"__name__": name, "numpy": numpy})
    print(name, len(heard))
"""


def test_warnings_of_numpy_are_those_of_a_users_own_lines():
    command = [sys.executable, "-c", UNDEFINED]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["polycorner.motion.anywhere 0", "mine 2"]


def _declared():
    """Return the public names of every package, and of what applications are built with."""
    packages = [polycorner, *map(importlib.import_module, homes.ROOMS[1:])]
    doors = ("polycorner.cli", "polycorner.toolkit", "polycorner.models.wells")
    packages += map(importlib.import_module, doors)
    return {package.__name__: {*package.__all__, "__version__"} for package in packages}


@pytest.mark.parametrize("application", ["polycorner/dumbbells", "paper_checks"])
def test_an_application_imports_public_names_only(application):
    declared = _declared()
    private = []
    for file in sorted((ROOT / application).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in getattr(node, "names", ())]
            if isinstance(node, ast.Import):
                private += [f"{file}: {name}" for name in names if name.startswith("polycorner")]
            elif isinstance(node, ast.ImportFrom) and OUTSIDE.match(node.module):
                known = declared.get(node.module, ())
                private += [f"{file}: {node.module}.{n}" for n in names if n not in known]
    assert private == []


def test_every_name_that_applications_are_built_with_resolves():
    for door in (polycorner.cli, polycorner.toolkit):
        assert all(getattr(door, name) is not None for name in door.__all__)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("minimize", "did you mean minimise?"),
        ("optimize", "did you mean minimise?"),
        ("Polyhedra", "did you mean Polyhedron?"),
        ("Simulate", "did you mean simulate?"),
        ("stationary_points", "it is in polycorner.proofs"),
        ("Arrangement", "it is in polycorner.bodies"),
        ("arangement", "did you mean polycorner.bodies.Arrangement?"),
        ("disk", "did you mean bodies.disc?"),
        ("xyzzy", "has no 'xyzzy'"),
    ],
)
def test_a_name_that_people_type_is_answered(typed, meant):
    with pytest.raises(AttributeError, match=re.escape(meant)):
        getattr(polycorner, typed)
    assert not hasattr(polycorner, typed)


def test_rooms_are_found_without_words_about_names():
    assert importlib.import_module("polycorner.bodies") is polycorner.bodies
    with pytest.raises(AttributeError, match="__nothing__"):
        polycorner.__nothing__  # noqa: B018 - that it raises
