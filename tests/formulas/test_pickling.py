"""Pickles of functions and families: the same bits elsewhere, without SymPy if possible."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
import sympy as sp
from elsewhere import called

from polycorner import Manifold, SmoothFunction
from polycorner.dumbbells import DumbbellPair
from polycorner.formulas import Family

M = Manifold(("x", "a"), periods=(np.inf, 2 * np.pi))
X, A = M.symbols
K = sp.Symbol("k", real=True)
Q = [0.3, 1.2]


def function():
    return SmoothFunction("f", sp.sin(A) * X**2 + K, M, parameters={"k": 0.25})


def closed_over(power):
    return Family(("g",), ("x",), (), lambda: ({}, {"g": X**power}), "")


def jet(f):
    return f.value(Q), f.gradient(Q), f.hessian(Q)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda f: pickle.loads(pickle.dumps(f))])
@pytest.mark.parametrize("warm", [False, True])
def test_a_copy_is_the_same_function(copied, warm):
    f = function()
    if warm:
        f.value(Q)
    g = copied(f)
    for mine, other in zip(jet(f), jet(g), strict=True):
        np.testing.assert_array_equal(mine, other)
    assert g.expression == f.expression
    assert g.manifold == f.manifold


def test_a_spawned_process_gets_the_same_bits():
    f = function()
    for mine, other in zip(jet(f), called(jet, f), strict=True):
        np.testing.assert_array_equal(mine, other)


READ = """
import pickle, sys
f = pickle.loads(open(sys.argv[1], "rb").read())
print(f.value([0.3, 1.2]).hex(), "sympy" in sys.modules)
"""


def test_where_the_machine_code_is_on_disk_sympy_is_not_imported(tmp_path):
    f = function()
    value = f.value(Q)
    (tmp_path / "f").write_bytes(pickle.dumps(f))
    command = [sys.executable, "-c", READ, str(tmp_path / "f")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [value.hex(), "False"]


def test_formulas_of_a_closure_are_written_out():
    family = pickle.loads(pickle.dumps(closed_over(3)))
    assert family.expression("g") == X**3


def test_families_of_a_model_are_pickled_by_the_name_of_their_formulas():
    f = DumbbellPair(16, 3, 1.5, 125).energy
    text = pickle.dumps(f.family)
    assert len(text) < 2000
    assert pickle.loads(text).expression(f.member_name) == f.family.expression(f.member_name)
