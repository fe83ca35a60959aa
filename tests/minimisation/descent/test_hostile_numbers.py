"""Whatever numbers formulas give, the compiled descent ends, and stays within its arrays."""

import checked_memory
import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron, Verdict, certify, minimise

M = Manifold.euclidean("x y")
x, y = M.symbols


def test_no_number_of_a_kernel_leads_out_of_an_array():
    for seed in (1, 2):
        checked_memory.run("hostile_numbers", "descents", seed, 40)


@pytest.mark.filterwarnings("ignore::polycorner.NonsmoothWarning")
def test_infinite_second_derivatives_are_undecided_and_no_end_of_a_descent():
    root = sp.Abs(13 * y / 8 - sp.Rational(3, 2)) ** sp.Rational(3, 2)
    D = Polyhedron(M, {"disc": 9 - x**2 - y**2, "root": root})
    found = certify(D, x + y**2 / 8, [-np.sqrt(9 - (12 / 13) ** 2), 12 / 13])
    assert not found.holds(1)
    assert not found.is_minimum
    # The root vanishes on a line, at which it holds nothing back: the search goes on across it.
    assert minimise(D, x + y**2 / 8, [1.7, 1.7]).point == pytest.approx([-3, 0], abs=1e-6)


@pytest.mark.filterwarnings("ignore::polycorner.NonsmoothWarning")
def test_infinite_gradients_on_the_way_to_an_empty_set_are_no_crash():
    flat = sp.Abs(x * y) ** sp.Rational(3, 2)
    D = Polyhedron(M, {"disc": 9 - x**2 - y**2, "power": -(sp.Abs(x * y) ** (x * y))}, {"h": flat})
    energy = y + sp.Abs(x + y - 1) ** sp.Rational(5, 2)
    assert minimise(D, energy, [12 / 13, 0.0]).verdict is Verdict.INFEASIBLE


def test_equations_without_gradient_are_no_rows_of_a_programme():
    D = Polyhedron(M, {"right": x}, {"double": (x + y) ** 2})
    found = minimise(D, x, [1.0, -1.0])
    assert found.point == pytest.approx([0, 0], abs=1e-6)
