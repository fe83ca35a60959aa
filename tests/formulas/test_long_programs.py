"""Programs too long for one function of machine code."""

import numpy as np
import pytest
import sympy as sp

from polycorner.formulas import batches
from polycorner.formulas.adjoints import derivatives
from polycorner.formulas.families import Family
from polycorner.formulas.kernels import Kernel

NAMES = ("x", "y", "z")
x, y, z = sp.symbols(NAMES, real=True)
TERMS = [x * z, sp.sqrt(4 + x**2 + y**2), sp.sin(x + 2 * y) * z, -x / 2, sp.cos(y - z)]
SHARED = {f"f{i}": sum(TERMS[i % 5 :]) * sp.sin(i + x) for i in range(30)}
SPARSE = {f"g{i}": sp.exp(sp.sin(i * (x, y, z)[i % 3])) for i in range(40)}


@pytest.mark.parametrize("formulas", [SHARED, SPARSE], ids=["shared", "sparse"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_long_program_in_several_functions_has_the_same_results(formulas, order, monkeypatch):
    q = np.random.default_rng(3).uniform(-1.5, 1.5, (3, 3))
    program = Family(tuple(formulas), NAMES, (), lambda: ({}, formulas)).program()
    sizes = {"variables": 3, "parameters": 0, "outputs": len(formulas)}
    found = []
    for most in (10**6, 20):
        monkeypatch.setattr(batches, "LONG", most)
        assert (len(list(batches._parts(*derivatives(program, order)))) > 5) == (most == 20)
        kernel = Kernel(f"{program.digest()} at most {most}", lambda: program, **sizes)
        found.append(kernel.over(q, 0, order))
    for one, other in zip(*found, strict=True):
        assert (one == other).all()
        assert one.any()
