"""Corners built on purpose: a quadrant bent by a smooth change of coordinates.

With ``z = z(x)`` new coordinates around ``c``, the polyhedron is ``{z_1 >= 0, ..., z_k >= 0}`` and
the energy ``sum lam_i z_i + sum kap_i z_i^2 / 2 + beta z_1 z_2``, so that its multipliers are the
``lam_i`` and every verdict is known beforehand.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sp

from polycorner import AllOf, Manifold, Polyhedron, SmoothFunction, certify, minimise
from polycorner.formulas.families import Family

LARGEST = 4


@lru_cache
def family(n):
    """Return the bent coordinates and the energy in ``n`` dimensions, all numbers left open."""
    x = sp.symbols(f"x1:{n + 1}", real=True)
    matrix = sp.Matrix(n, n, lambda i, j: sp.Symbol(f"a{i}_{j}", real=True))
    names = {letter: sp.symbols(f"{letter}1:{n + 1}", real=True) for letter in "cswgk"}
    lam = sp.symbols(f"lam1:{n + 1}", real=True)
    e, beta = sp.symbols("e beta", real=True)
    away = [sp.Symbol(f"away{i}", real=True) for i in range(n)]
    definitions = {
        f"away{i}": w * (x[i] - c)
        for i, (c, w) in enumerate(zip(names["c"], names["w"], strict=True))
    }
    z = sp.symbols(f"z1:{n + 1}", real=True)
    for i in range(n):
        bend = names["s"][i] * (away[(i + 1) % n] ** 2 + sp.sin(away[i]) * away[(i + 1) % n])
        definitions[f"z{i + 1}"] = (matrix[i, :] * sp.Matrix(away))[0] + bend
    expressions = {f"f{i + 1}": names["g"][i] * z[i] for i in range(n)}
    energy = sum(lam[i] * z[i] + names["k"][i] * z[i] ** 2 / 2 for i in range(n))
    expressions["energy"] = e * (energy + (beta * z[0] * z[1] if n > 1 else 0))
    parameters = [*matrix, *names["c"], *names["s"], *names["w"], *names["g"], *names["k"], *lam]
    symbols = [symbol.name for symbol in (*parameters, e, beta)]
    return Family.of(expressions, [s.name for s in x], symbols, definitions)


@dataclass(frozen=True)
class Corner:
    """A bent quadrant with ``contacts`` faces and the energy on it.

    ``units`` multiplies the coordinates and the manifold's scales alike, ``gains`` the
    constraints, ``gain`` the energy: none of them may change what the corner is.
    """

    matrix: np.ndarray
    centre: np.ndarray
    bends: np.ndarray
    contacts: int
    slopes: np.ndarray
    curvatures: np.ndarray
    mixed: float = 0.0
    units: tuple = ()
    gains: tuple = ()
    gain: float = 1.0

    @property
    def n(self):
        return len(self.centre)

    @property
    def scales(self):
        return np.array(self.units or (1.0,) * self.n)

    @property
    def point(self):
        return self.centre * self.scales

    def posed(self):
        """Return the polyhedron and the energy."""
        names = [f"x{i + 1}" for i in range(self.n)]
        manifold = Manifold(names, scales=tuple(self.scales))
        gains = np.array(self.gains or (1.0,) * self.n)
        numbers = np.concatenate(
            [
                self.matrix.ravel(), self.point, self.bends, 1 / self.scales, gains,
                self.curvatures, self.slopes, [self.gain, self.mixed],
            ]
        )  # fmt: skip

        def member(name):
            return SmoothFunction.member(
                family(self.n), name, manifold, parameters=numbers.tolist()
            )

        faces = AllOf(*[member(f"f{i + 1}") for i in range(self.contacts)])
        if not self.contacts:
            faces = AllOf(
                SmoothFunction("far", manifold.symbols[0] + 1000 * self.scales[0], manifold)
            )
        return Polyhedron(manifold, faces), member("energy")

    def certify(self, **options):
        return certify(*self.posed(), self.point, **options)

    def minimise(self, start, **options):
        return minimise(*self.posed(), start * self.scales, **options)
