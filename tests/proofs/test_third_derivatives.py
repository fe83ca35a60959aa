"""Third and fourth derivatives of the checker of saved proofs, against SymPy's."""

import flint
import pytest
import sympy
from flint import arb

from polycorner.proofs.checker.curves import StoredFamily
from polycorner.proofs.checker.problem import StoredProgram

x, y, t = sympy.symbols("x y t")
INNER = x * y / 3 + t / 5 + sympy.Rational(2, 5)
SINGLE = ("neg", "square", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh",
          "tanh", "exp", "log", "erf", "abs")  # fmt: skip
KNOWN = {"neg": lambda u: -u, "square": lambda u: u**2, "abs": lambda u: u}
DOUBLE = {
    "add": lambda u, v: u + v, "sub": lambda u, v: u - v, "mul": lambda u, v: u * v,
    "div": lambda u, v: u / v, "pow": lambda u, v: u**v, "atan2": sympy.atan2,
}  # fmt: skip
AT = {x: sympy.Rational(1, 2), y: sympy.Rational(3, 4), t: sympy.Rational(1, 8)}
ALONG = [sympy.Rational(2), sympy.Rational(-1), sympy.Rational(1, 2)]


def cases():
    """Yield the name of an operation, nodes after those of the coordinates, and the formula."""
    # u = xy/3 + t/5 + 2/5 is node 10, v = x + t node 11
    inner = [["var", 0], ["var", 1], ["var", 2], ["mul", 0, 1], ["const", "1/3"], ["mul", 3, 4],
             ["const", "1/5"], ["mul", 2, 6], ["add", 5, 7], ["const", "2/5"], ["add", 8, 9],
             ["add", 0, 2]]  # fmt: skip
    for op in SINGLE:
        known = KNOWN.get(op) or getattr(sympy, op)
        yield op, [*inner, [op, 10]], known(INNER)
    for op, known in DOUBLE.items():
        yield op, [*inner, [op, 10, 11]], known(INNER, x + t)
    yield "a cube", [*inner, ["const", "3"], ["pow", 10, 12]], INNER**3
    yield "an inverse", [*inner, ["const", "-2"], ["pow", 10, 12]], INNER**-2
    yield "a power of 2", [*inner, ["const", "2"], ["pow", 12, 10]], 2**INNER
    yield "min", [*inner, ["min", 10, 11]], INNER  # it is the smaller at this point
    yield "max", [*inner, ["max", 10, 11]], x + t


def along_it(formula):
    return sum(w * sympy.diff(formula, c) for w, c in zip(ALONG, (x, y, t), strict=True))


@pytest.mark.parametrize("case", list(cases()), ids=lambda case: case[0])
def test_third_and_fourth_derivatives(case):
    _, nodes, formula = case
    data = {
        "coordinates": ["x", "y", "t"], "periods": [None] * 3, "functions": ["E"],
        "inequalities": 0, "equations": 0, "branches": [[]], "nodes": nodes,
        "outputs": [len(nodes) - 1], "parameters": [2], "interval": [(0.0).hex(), (1.0).hex()],
        "weights": ["1"], "scales": ["1"] * 3,
    }  # fmt: skip
    before = flint.ctx.prec
    try:
        family = StoredFamily(StoredProgram(data), data)
        box = [arb(flint.fmpq(int(AT[z].p), int(AT[z].q))) for z in (x, y, t)]
        along = [arb(flint.fmpq(int(z.p), int(z.q))) for z in ALONG]
        (hessian,), (turned,), (twice,) = family.bends(box, [0], along, 2)
        for i, a in enumerate((x, y, t)):
            for j, b in enumerate((x, y, t)[: i + 1]):
                second = sympy.diff(formula, a, b)
                third, fourth = along_it(second), along_it(along_it(second))
                for exact, found in ((second, hessian), (third, turned), (fourth, twice)):
                    value = arb(str(sympy.N(exact.subs(AT), 50))) + arb(0, 1e-40)
                    for entry in ((i, j), (j, i)):
                        assert found.get(entry, arb(0)).overlaps(value)
                        assert found.get(entry, arb(0)).rad() < 1e-30
    finally:
        flint.ctx.prec = before
