"""Formulas in files are read in bounded time, or refused in one sentence that names them."""

import json
import os
import subprocess
import sys
from pathlib import Path

import hostile_formulas
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron, certify
from polycorner.files import graphs, load_certificate, load_graph, load_skeleton, save_certificate
from polycorner.files.certificates import KIND
from polycorner.files.formulas import DEEPEST, formula_text, read_formula, symbols
from polycorner.formulas.families import Family
from polycorner.polyhedra.groups import MOST_BRANCHES

GENEROUS = 600  # s; a formula that hangs takes hours
JUDGE = """
import hostile_formulas, json, sys, warnings
warnings.simplefilter("ignore")
for name in json.loads(sys.stdin.read()):
    try:
        found = hostile_formulas.outcome(hostile_formulas.FAMILY[name])
    except BaseException as error:
        found = f"{type(error).__name__}: {error}"
    print(json.dumps([name, found[:300]]), flush=True)
"""
M = Manifold.euclidean("x y")
x, y = M.symbols


def outcomes(names, cache):
    """Return what becomes of formulas, in a process of its own."""
    places = [Path(hostile_formulas.__file__).parent, *sys.path]
    done = subprocess.run(
        [sys.executable, "-c", JUDGE],
        input=json.dumps(list(names)),
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join(map(str, places)), "POLYCORNER_CACHE_DIR": str(cache)},
        stdout=subprocess.PIPE,
        text=True,
        timeout=GENEROUS,
        check=True,
    )
    return dict(map(json.loads, done.stdout.splitlines()))


def test_numbers_and_texts_are_read_or_refused_in_one_sentence(tmp_path):
    chosen = hostile_formulas.NUMBERS | hostile_formulas.TEXTS
    found = outcomes(chosen, tmp_path)
    assert found.keys() == chosen.keys()
    assert {k: x for k, x in found.items() if x not in {"read", "refused"}} == {}
    assert {found[name] for name in hostile_formulas.TEXTS} == {"refused"}


def test_towers_and_crowds_are_read_or_refused_in_one_sentence(tmp_path):
    chosen = (
        hostile_formulas.FAMILY.keys()
        - hostile_formulas.NUMBERS.keys()
        - hostile_formulas.TEXTS.keys()
    )
    found = outcomes(sorted(chosen), tmp_path)
    assert found.keys() == chosen
    assert {k: x for k, x in found.items() if x not in {"read", "refused"}} == {}
    assert {x for k, x in found.items() if ", 3000 deep" in k} == {"refused"}
    assert {x for k, x in found.items() if ", 8 deep" in k} == {"read"}


def nested(depth):
    e = x
    for _ in range(depth):
        e = sp.sin(e)
    return e


@pytest.mark.parametrize(
    "expression",
    [
        nested(DEEPEST - 1),
        sp.Min(*(x * k + y for k in range(20)), sp.Max(x, y - 3)),
        sp.Piecewise((sp.sqrt(x + 1), (x > 0) & (y < sp.exp(x))), (sp.Abs(x - y), True)),
        (x + y) ** 100000,
        sp.Rational(10**400, 10**399 + 1) * x,
        1 / (sp.sqrt(x) * (y + 1) ** 2 * 3),
        sp.cbrt(2) * x ** sp.Rational(-3, 2) * sp.pi**y / (7 * sp.E),
    ],
)
def test_what_sympy_writes_is_read_as_it_was(expression):
    """Functions are not evaluated again, since SymPy has done that already."""
    assert read_formula(formula_text(expression), symbols("xy")) == expression


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (hostile_formulas.nested("sin({})", DEEPEST), f"at most {DEEPEST} operations"),
        (f"Min({hostile_formulas.several('x + {}', MOST_BRANCHES + 1)})", "branches"),
        (hostile_formulas.nested("Min({}, y, x, 1)", 65), "branches"),
        ("x + 0x" + "f" * 4000, "notation"),
    ],
)
def test_bounds_are_stated(text, words):
    with pytest.raises(ValueError, match=f"^formula 'g': expected .*{words}.*; got [^\n]*$"):
        read_formula(text, symbols("xy"), "formula 'g'")


def test_branches_may_follow_one_another_further_than_calls():
    """Derivatives of four hundred branches, against the formula without any."""
    chain = sp.Piecewise(*((k * x * y, x < k) for k in range(1, 400)), (x, True), evaluate=False)
    program = Family.of({"f": chain}, ["x", "y"]).program()
    from polycorner.formulas.adjoints import derivatives

    graph, (values, slopes, seconds) = derivatives(program, 2)
    assert (len(values), len(slopes), len(seconds)) == (1, 2, 4)
    assert len(graph.graph.nodes) < 20 * 400


# ------------------------------------------------------------------------------------------- files


def spoilt(path, change):
    """Write a certificate whose entries were changed, with a digest that fits."""
    entries = KIND.load_json(save_certificate(certify(Polyhedron(M, {"f": x}), x, [0, 0]), path))
    change(entries)
    entries.pop("written by")
    return KIND.save_json(path, entries)


@pytest.mark.parametrize(
    "change",
    [
        lambda e: e["problem"]["families"][0]["formulas"].update(f="9**9**9**9"),
        lambda e: e["problem"]["families"][0]["formulas"].update(f=10**400),
        lambda e: e["problem"]["families"][0]["formulas"].update(f=["x"]),
        lambda e: e["problem"]["families"][0].update(definitions={"d": "Min()"}),
        lambda e: e["problem"]["functions"][0].update(parameters=[10**400]),
        lambda e: e["problem"]["coordinates"][0].update(scale=10**400),
        lambda e: e["problem"]["coordinates"][0].update(period=10**400),
        lambda e: e["coordinates"][0].update(value=10**400),
        lambda e: e.update(tolerance=10**400),
    ],
)
def test_a_certificate_is_refused_with_its_name(tmp_path, change):
    path = spoilt(tmp_path / "c.json", change)
    with pytest.raises(
        ValueError, match=r"^path: expected a certificate that [^\n]*c\.json[^\n]*$"
    ):
        load_certificate(path)


@pytest.mark.parametrize("load", [load_certificate, load_skeleton])
@pytest.mark.parametrize("body", [b'{"a": ' + b"[" * 100_000, b'{"a": ' + b"9" * 5000, b"{1"])
def test_json_of_any_depth_is_refused_with_its_name(tmp_path, load, body):
    from polycorner.files import skeletons

    kind = KIND if load is load_certificate else skeletons.KIND
    path = kind.save(tmp_path / "c.json", body + b",\n")
    with pytest.raises(ValueError, match=r"^path: expected a [^\n]*c\.json[^\n]*$"):
        load(path)


@pytest.mark.parametrize("body", ["<graphml>" * 2, "<graphml/>", "<a>" * 5000, "", "&"])
def test_a_graph_that_is_none_is_refused_with_its_name(tmp_path, body):
    path = graphs.KIND.save(tmp_path / "g.graphml", body.encode())
    with pytest.raises(ValueError, match=r"^path: expected a graph that [^\n]*g\.graphml[^\n]*$"):
        load_graph(path)
