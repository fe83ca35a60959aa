"""Degenerate germs of known type, in bent coordinates: normal forms composed with diffeomorphisms.

Every polynomial in ``(U, V)`` of degree up to eight shares one kernel: its coefficients, the
diffeomorphism and its centre are parameters.
"""

from functools import lru_cache

import numpy as np
import sympy as sp

from polycorner import Manifold, Polyhedron, SmoothFunction, certify
from polycorner.formulas.families import Family

DEGREE = 10
POWERS = [(a, b) for a in range(DEGREE + 1) for b in range(DEGREE + 1 - a) if a + b >= 2]
U, V = sp.symbols("U V")

# Forms, and whether they have a minimum at 0.
HALF = [  # on U >= 0
    (U**2 + V**4, True),
    (U**2 - V**4, False),
    (U**3 + V**2, True),
    (-(U**3) + V**2, False),
    (U**3 + V**4, True),
    (U * V + U**2 + V**4, False),
    (U**2 - U * V**2 + V**4, True),
    (U**2 - 3 * U * V**2 + V**4, False),
    (U**2 + 3 * U * V**2 + V**4, True),
    (U**2 + V**5, False),
]
QUADRANT = [  # on U, V >= 0
    (U * V + U**3 + V**3, True),
    (U * V + U**5 + V**7, True),
    (U * V - U**3, False),
    (U * V + U**3 - V**6, False),
    ((U - V) ** 2 + U**3, True),
    ((U - V) ** 2 - U**3, False),
    ((U - V) ** 2 + U * V**4, True),
    (U**2 * V + U * V**2 + U**4 + V**5, True),
]


@lru_cache
def family():
    """Return bent coordinates ``F1, F2, F3`` and the energy, all numbers left open."""
    x = sp.symbols("x1:4", real=True)
    matrix = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"a{i}{j}", real=True))
    bend = sp.Matrix(3, 6, lambda i, j: sp.Symbol(f"b{i}{j}", real=True))
    centre = sp.symbols("c1:4", real=True)
    units = sp.symbols("w1:4", real=True)
    push, stiff = sp.symbols("push stiff", real=True)
    y = sp.symbols("y1:4", real=True)
    z = sp.symbols("z1:4", real=True)
    definitions = {f"y{i + 1}": (x[i] - centre[i]) / units[i] for i in range(3)}
    squares = [y[i] * y[j] for i in range(3) for j in range(i, 3)]
    for i in range(3):
        curved = sum(bend[i, k] * square for k, square in enumerate(squares))
        definitions[f"z{i + 1}"] = (matrix[i, :] * sp.Matrix(y))[0] + curved
    numbers = [sp.Symbol(f"k{a}_{b}", real=True) for a, b in POWERS]
    form = sum(k * z[0] ** a * z[1] ** b for k, (a, b) in zip(numbers, POWERS, strict=True))
    expressions = {f"F{i + 1}": z[i] for i in range(3)}
    expressions["energy"] = form + stiff * z[2] ** 2 + push * z[2] * (1 + y[0] / 3)
    names = [s.name for s in (*matrix, *bend, *centre, *units, push, stiff, *numbers)]
    return Family.of(expressions, [s.name for s in x], names, definitions)


def posed(form, generator, *, contacts=(), equations=(), push=0.0, offset=0.0):
    """Return a certificate of a germ in random bent coordinates.

    Parameters
    ----------
    form : sympy.Expr
        A polynomial in ``U`` and ``V``; the third coordinate adds ``Z^2`` and ``push Z``.
    contacts, equations : tuple of int
        Which of the bent coordinates 1, 2, 3 are not negative, or zero.
    offset : float
        Distance of the point from the germ's centre in a random direction, in scale units.
    """
    scales = 10.0 ** generator.uniform(-2, 2, 3)
    manifold = Manifold(["x1", "x2", "x3"], scales=tuple(scales))
    matrix = np.linalg.qr(generator.normal(size=(3, 3)))[0] + generator.uniform(-0.2, 0.2, (3, 3))
    bend = generator.uniform(-0.4, 0.4, (3, 6))
    centre = scales * generator.integers(-2, 3, 3)
    terms = sp.Poly(sp.expand(form), U, V).as_dict()
    coefficients = [float(terms.pop(power, 0)) for power in POWERS]
    assert not terms
    numbers = np.concatenate(
        [matrix.ravel(), bend.ravel(), centre, scales, [push, 1.0], coefficients]
    )

    def member(name, label):
        return SmoothFunction.member(
            family(), name, manifold, parameters=numbers.tolist(), label=label
        )

    inequalities = [member(f"F{i}", f"f{i}") for i in contacts] or [member("F1", "far")]
    if not contacts:
        far = SmoothFunction("far", manifold.symbols[0] + 1000 * float(scales[0]), manifold)
        inequalities = [far]
    held = [member(f"F{i}", f"h{i}") for i in equations]
    polyhedron = Polyhedron(manifold, inequalities, equations=held)
    way = generator.normal(size=3)
    point = centre + offset * scales * way / np.linalg.norm(way)
    return certify(polyhedron, member("energy", "energy"), point)
