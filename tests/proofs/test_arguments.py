"""Wrong arguments raise errors of one sentence that names the argument."""

import math

import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron, SmoothFunction, Symmetry, certify, prove

M = Manifold.euclidean("x y z")
x, y, z = M.symbols
a, b = sp.symbols("a b", real=True)


def corner(**parameters):
    """Certify the origin shifted by parameters, on a wall that is defined for ``b >= 0``."""
    wall = SmoothFunction("wall", x - sp.sqrt(b), M, parameters={"b": 1.0})
    energy = SmoothFunction("energy", a * x + y**2 + z**2, M, parameters={"a": 1.0})
    return prove(certify(Polyhedron(M, wall), energy, [1, 0, 0]), **parameters)


def plain(**arguments):
    return prove(certify(Polyhedron(M, {"f": x}), x + y**2 + z**2, [0, 0, 0]), **arguments)


def two_values():
    parts = [
        SmoothFunction("f", x - a, M, parameters={"a": 1.0}),
        SmoothFunction("g", y - a, M, parameters={"a": 2.0}),
    ]
    c = certify(Polyhedron(M, parts), x + y + z**2, [1, 2, 0])
    prove(c, parameters={"a": (0.5, 1.5)})


def changed():
    f = SmoothFunction("gap", x - a, M, parameters={"a": 1.0})
    c = certify(Polyhedron(M, f), x + y**2 + z**2, [1, 0, 0])
    assert prove(c).proved
    object.__setattr__(f, "_parameters", (2.0,))
    prove(c)


def flat():
    return prove(certify(Polyhedron(M, {"f": x}), x + y**4 + z**2, [0, 0, 0]))


# call, exception, argument named
REFUSED = [
    (lambda: prove("x"), TypeError, "certificate"),
    (changed, ValueError, "certificate"),
    *((lambda d=d: plain(digits=d), ValueError, "digits") for d in (0, -3, 10_001)),
    *((lambda d=d: plain(digits=d), TypeError, "digits") for d in (1.5, True, "30", None)),
    *((lambda m=m: plain(max_cells=m), ValueError, "max_cells") for m in (0, -1)),
    *((lambda m=m: plain(max_cells=m), TypeError, "max_cells") for m in (2.5, True)),
    (lambda: plain(progress=3), TypeError, "progress"),
    (lambda: plain(symmetry=[{"x": 1}]), TypeError, "symmetry"),
    (lambda: plain(symmetry=3), TypeError, "symmetry"),
    (lambda: plain(symmetry=Symmetry(fields=[3])), TypeError, "fields"),
    (lambda: plain(symmetry=Symmetry(fields=["xyz"])), TypeError, "fields"),
    (lambda: plain(symmetry=Symmetry(fields=[{"w": 1}])), ValueError, "symmetry"),
    (lambda: plain(symmetry=Symmetry(fields=[{}])), TypeError, "symmetry"),
    (lambda: plain(symmetry=Symmetry(fields=[[1, 0]])), ValueError, "symmetry"),
    (lambda: plain(parameters={"a": (0, 1)}), ValueError, "parameters"),
    (lambda: corner(parameters={"q": (0, 1)}), ValueError, "parameters"),
    (lambda: corner(parameters={"a": (2, 1)}), ValueError, "parameters"),
    (lambda: corner(parameters={"a": (1, 1)}), ValueError, "parameters"),
    (lambda: corner(parameters={"a": (0, math.inf)}), ValueError, "parameters"),
    (lambda: corner(parameters={"a": (math.nan, 1)}), ValueError, "parameters"),
    (lambda: corner(parameters={"a": 1}), TypeError, "parameters"),
    (lambda: corner(parameters={"a": (1, 2, 3)}), TypeError, "parameters"),
    (lambda: corner(parameters={"a": ("1", 2)}), TypeError, "parameters"),
    (lambda: corner(parameters={}), TypeError, "parameters"),
    (lambda: corner(parameters=[("a", (0, 1))]), TypeError, "parameters"),
    (lambda: corner(parameters={"b": (-1, 1)}), ValueError, "parameters"),
    (two_values, ValueError, "parameters"),
    (lambda: plain().enclose(1 / y), ValueError, "expression"),
    (lambda: flat().enclose(x), ValueError, "enclose"),
]


@pytest.mark.parametrize(("call", "kind", "argument"), REFUSED)
def test_wrong_arguments_are_named(call, kind, argument):
    with pytest.raises(kind) as caught:
        call()
    message = str(caught.value)
    assert message.startswith(f"{argument}: "), message
    assert "\n" not in message
