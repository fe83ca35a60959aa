"""Definitions on which functions do not depend to the first order: the envelope theorem.

Where ``t(q)`` minimises ``F(q, t)``, the gradient of ``f(q) = F(q, t(q))`` is that of ``F`` for a
fixed ``t``; its Hessian is not.  The oracles write everything out and differentiate all of it.
"""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from polycorner.dumbbells import DumbbellPair
from polycorner.formulas import adjoints
from polycorner.formulas.families import Family
from polycorner.formulas.kernels import Kernel

NAMES = ("x", "y", "z")
x, y, z = sp.symbols(NAMES, real=True)
s, t = sp.symbols("s t", real=True)
SLOPES = [x * y - z, -2 * (x + y), -(sp.sin(x) * z) / 2, y - x, sp.exp(x) / (2 + z**2)]
BENDS = [1 + x**2, 2 + sp.sin(y * z), sp.exp(x - y), sp.Integer(4), 3 + x * y / 2]
RESTS = [x * z, sp.sqrt(4 + x**2 + y**2), sp.sin(x + 2 * y) * z, -x / 2, sp.cos(y - z)]


def evaluated(program, q, order):
    """Return values and derivatives of a program at the rows of ``q``."""
    sizes = {"variables": q.shape[1], "parameters": 0, "outputs": len(program.outputs)}
    kernel = Kernel(f"{program.digest()} {adjoints.FEW}", lambda: program, **sizes)
    return kernel.over(q, 0, order)


def written_out(expression, q):
    """Return value, gradient and Hessian at one point, by SymPy's derivatives."""
    symbols = (x, y, z)
    levels = expression, sp.Matrix([expression]).jacobian(symbols), sp.hessian(expression, symbols)
    return [np.squeeze(sp.lambdify(symbols, level)(*q)) for level in levels]


@pytest.mark.parametrize("few", [adjoints.FEW, 0], ids=["forward", "reverse"])
@pytest.mark.parametrize("parts", list(zip(SLOPES, BENDS, RESTS, strict=True)))
def test_derivatives_of_least_values(few, parts, monkeypatch):
    """A parabola is least at ``t``, and on ``[0, 1]`` at ``s``."""
    slope, bend, rest = parts
    monkeypatch.setattr(adjoints, "FEW", few)
    definitions = {"t": -slope / bend, "s": sp.Piecewise((0, t <= 0), (1, t >= 1), (t, True))}
    free, clamped = (bend * k**2 / 2 + slope * k + rest for k in (t, s))
    formulas = {"free": free, "clamped": 3 * clamped - z * rest}
    symbols = tuple(formulas), NAMES, ()
    family = Family(*symbols, lambda: (definitions, formulas), stationary=("s", "t"))
    q = np.random.default_rng(7).uniform(-1.5, 1.5, (6, 3))
    found = evaluated(family.program(), q, 2)
    least = rest - slope**2 / (2 * bend)
    for row, point in enumerate(q):
        foot = float((-slope / bend).subs(dict(zip((x, y, z), point, strict=True))))
        inside = least if foot < 1 else bend / 2 + slope + rest
        branch = inside if foot > 0 else rest
        for column, e in enumerate((least, 3 * branch - z * rest)):
            for got, exact in zip(found, written_out(e, point), strict=True):
                np.testing.assert_allclose(got[row, column], exact, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("shape", ["drum", "plane"])
def test_gaps_do_not_depend_on_feet_and_normals(shape):
    """Gradients and Hessians are those in which the feet move along."""
    drum = {"drum_radius": 125} if shape == "drum" else {}
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, **drum)
    rng = np.random.default_rng(3)
    moved = rng.uniform(-1, 1, (300, 6)) * pair.manifold.scale_array
    q = pair.nested("R") + moved
    gap = pair.polyhedron.functions[0]
    full = replace(gap.family, key=f"{gap.family.key} all", stationary=())
    parameters = np.array(gap.parameters)
    assert gap.family.stationary
    for order in (1, 2):
        one, other = (
            family.kernel.over(q, parameters.ctypes.data, order) for family in (gap.family, full)
        )
        for a, b in zip(one, other, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("few", [adjoints.FEW, 0], ids=["forward", "reverse"])
def test_derivatives_by_variables_that_are_held_are_zero_and_others_as_they_are(few, monkeypatch):
    monkeypatch.setattr(adjoints, "FEW", few)
    formulas = dict(zip("fghkl", RESTS, strict=True))
    q = np.random.default_rng(3).uniform(-1.5, 1.5, (6, 3))
    free, held = (
        evaluated(
            Family(tuple(formulas), NAMES, (), lambda: ({}, formulas), stationary=s).program(), q, 1
        )
        for s in ((), ("y",))
    )
    assert (held[0] == free[0]).all()
    assert (held[1] == free[1] * [1, 0, 1]).all()
