"""Regular minima that floating point can hardly tell from others."""

import sympy as sp

from polycorner import Manifold, Polyhedron, SmoothFunction, certify

M = Manifold.euclidean("x y z")
x, y, z = M.symbols
angle, first, second, bend = LETTERS = sp.symbols("angle first second bend", real=True)

# Two curved walls at an angle, and a bowl along their common edge.
WALLS = x + bend * z**2, x + angle * y + bend * y * z
ENERGY = first * WALLS[0] + second * WALLS[1] + z**2


def regular(*numbers):
    """Return the certificate of a minimum at 0, from the angle, two multipliers and a bend."""
    values = dict(zip(LETTERS, numbers, strict=True))

    def function(name, e):
        used = {s.name: v for s, v in values.items() if s in e.free_symbols}
        return SmoothFunction(name, e, M, parameters=used)

    walls = [function(name, e) for name, e in zip("fg", WALLS, strict=True)]
    return certify(Polyhedron(M, walls), function("energy", ENERGY), [0, 0, 0])
