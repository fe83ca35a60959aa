"""Functions that are evaluated by one kernel are the same functions."""

import pickle

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold
from polycorner.formulas import fusion
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.fusion import fused

u, v, a, b, t, along = sp.symbols("u v a b t along", real=True)
MANIFOLD = Manifold.euclidean("x y z")


def lines():
    return {"along": a * u + b}, {"f": sp.sqrt(1 + u**2 + v**2) - a * v - b * along}


def feet():
    """The distance from the point ``a`` of a parabola over the line, at a foot that is held."""
    return {"t": (u + a * v) / (1 + a**2)}, {"g": (u - t) ** 2 + (v - a * t) ** 2 + b}


LINE = Family(("f",), ("u", "v"), ("a", "b"), lines, key="a line of the test")
FOOT = Family(("g",), ("u", "v"), ("a", "b"), feet, key="a foot of the test", stationary=("t",))


@pytest.fixture
def functions():
    """Return functions with numbers that are equal, opposite and zero."""
    numbers = [(LINE, "f", (2.0, 0.5)), (LINE, "f", (-2.0, 0.0)), (FOOT, "g", (0.5, -2.0))]
    reads = [("x", "y"), ("z", "x"), ("y", "z")]
    return [
        SmoothFunction.member(family, name, MANIFOLD, parameters=given, reads=some, label=f"n{k}")
        for k, ((family, name, given), some) in enumerate(zip(numbers, reads, strict=True))
    ]


@pytest.mark.parametrize("count", [1, 200], ids=["one point", "many points"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_values_and_derivatives_are_those_of_the_functions(functions, order, count):
    q = np.random.default_rng(0).uniform(-2, 2, (count, 3))
    together = Bundle(MANIFOLD, fused(functions)).evaluate(q, order)
    for level, found in enumerate(together):
        for k, f in enumerate(functions):
            alone = (f.value, f.gradient, f.hessian)[level](q)
            assert found[:, k] == pytest.approx(alone, abs=1e-13)


def test_one_kernel_evaluates_all(functions):
    assert len(Bundle(MANIFOLD, functions).calls) == 3
    assert len(Bundle(MANIFOLD, fused(functions)).calls) == 1


def test_names_and_expressions_stay(functions):
    for f, g in zip(functions, fused(functions), strict=True):
        assert g.name == f.name
        one, two = (bound(h) for h in (f, g))
        assert sp.simplify(sp.nsimplify(one - two)) == 0


def bound(f):
    known = f.parameter_values
    return f.expression.subs(
        {s: known[s.name] for s in f.expression.free_symbols if s.name in known}
    )


def renumbered(f, numbers):
    reads = [MANIFOLD.names[i] for i in f.reads]
    return SmoothFunction.member(
        f.family, f.member_name, MANIFOLD, parameters=numbers, reads=reads, label=f.name
    )


def test_numbers_equal_in_the_same_places_share_a_kernel(functions):
    def key(f, g):
        return fused([renumbered(functions[0], f), renumbered(functions[1], g)])[0].family.key

    assert key((1.0, 2.0), (-2.0, 0.0)) == key((3.0, 5.0), (-5.0, 0.0))
    assert key((1.0, 2.0), (-2.0, 0.0)) != key((1.0, 2.0), (2.0, 0.0))
    assert key((1.0, 2.0), (3.0, 0.0)) != key((1.0, 1.0), (3.0, 0.0))


def test_too_many_functions_and_single_ones_stay_as_they_are(functions, monkeypatch):
    assert fused(functions[:1])[0] is functions[0]
    monkeypatch.setattr(fusion, "MOST_FUSED", 26)  # 3 functions of 3 coordinates have 27
    assert all(f is g for f, g in zip(functions, fused(functions), strict=True))


def test_pickles_hold_what_the_families_are_made_of(functions):
    q = np.array([0.3, -1.2, 0.7])
    for f in fused(functions):
        again = pickle.loads(pickle.dumps(f))
        assert again.value(q) == f.value(q)
        assert again.family.key == f.family.key
