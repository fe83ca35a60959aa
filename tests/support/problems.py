"""Hock-Schittkowski problems, written down from their mathematics, with their optima.

A problem says which inequalities hold its optimum and where that is: exactly, in SymPy numbers,
or as a guess good to a few digits from which the KKT equations are solved in forty.
"""

from dataclasses import dataclass
from functools import cached_property

import mpmath
import numpy as np
import sympy as sp

from polycorner import Manifold, Polyhedron

DIGITS = 40


@dataclass(frozen=True)
class Posed:
    """Minimise ``energy`` where every inequality is ``>= 0`` and every equation is 0."""

    name: str
    coordinates: tuple
    energy: sp.Expr
    inequalities: dict
    equations: dict
    start: tuple
    active: tuple
    optimum: tuple
    exact: bool = True

    @cached_property
    def manifold(self):
        return Manifold.euclidean([symbol.name for symbol in self.coordinates])

    @cached_property
    def polyhedron(self):
        return Polyhedron(self.manifold, self.inequalities, self.equations)

    @cached_property
    def kkt(self):
        """The KKT equations of the optimum's face and their unknowns: coordinates, multipliers."""
        held = {name: self.inequalities[name] for name in self.active} | self.equations
        multipliers = sp.symbols(f"lam:{len(held)}", real=True)
        pull = [
            sp.diff(self.energy, x)
            - sum(lam * sp.diff(f, x) for lam, f in zip(multipliers, held.values(), strict=True))
            for x in self.coordinates
        ]
        return [*pull, *held.values()], [*self.coordinates, *multipliers], tuple(held)

    @cached_property
    def solution(self):
        """Return ``(point, multipliers by name)`` in forty digits: Newton's method on the KKT."""
        equations, unknowns, names = self.kkt
        with mpmath.workdps(DIGITS):
            guess = [mpmath.mpf(sp.N(x, DIGITS)) for x in self.optimum]
            guess += self._first_multipliers(guess)
            function = sp.lambdify(unknowns, equations, "mpmath")
            jacobian = sp.lambdify(unknowns, sp.Matrix(equations).jacobian(unknowns), "mpmath")
            u = mpmath.matrix(guess)
            for _ in range(60):
                step = mpmath.lu_solve(jacobian(*u), -mpmath.matrix(function(*u)))
                u += step
                if mpmath.norm(step) < mpmath.mpf(10) ** (5 - DIGITS):
                    break
            else:
                message = f"{self.name}: the KKT equations did not converge"
                raise AssertionError(message)
        n = len(self.coordinates)
        return list(u[:n]), dict(zip(names, u[n:], strict=True))

    def _first_multipliers(self, point):
        """Return least-squares multipliers, as good as the guess is."""
        held = [self.inequalities[name] for name in self.active] + list(self.equations.values())
        if not held:
            return []
        at = dict(zip(self.coordinates, map(float, point), strict=True))
        rows = np.array(
            [
                [float(sp.diff(f, x).subs(at)) for x in self.coordinates]
                for f in [self.energy, *held]
            ]
        )
        return list(map(mpmath.mpf, np.linalg.lstsq(rows[1:].T, rows[0], rcond=None)[0].tolist()))

    @cached_property
    def face_curvatures(self):
        """Eigenvalues of the Lagrangian's Hessian on the optimum's face, ascending."""
        point, multipliers = self.solution
        at = dict(zip(self.coordinates, map(float, point), strict=True))
        functions = self.inequalities | self.equations
        lagrangian = self.energy - sum(lam * functions[f] for f, lam in multipliers.items())
        numbers = np.array(sp.hessian(lagrangian, self.coordinates).subs(at), dtype=float)
        rows = [
            [float(sp.diff(functions[f], x).subs(at)) for x in self.coordinates]
            for f in multipliers
        ]
        if not rows:
            return np.linalg.eigvalsh(numbers)
        left = np.linalg.svd(np.array(rows))[2][len(rows) :].T
        return np.linalg.eigvalsh(left.T @ numbers @ left)


def _coordinates(n):
    return sp.symbols(f"x1:{n + 1}", real=True)


def _box(symbols, low, high):
    lower = {f"{x}_low": x - a for x, a in zip(symbols, low, strict=True) if a is not None}
    upper = {f"{x}_high": b - x for x, b in zip(symbols, high, strict=True) if b is not None}
    return lower | upper


def _rational(*numbers):
    return tuple(sp.Rational(number) for number in numbers)


def hs6():
    x1, x2 = s = _coordinates(2)
    return Posed("HS6", s, (1 - x1) ** 2, {}, {"h": 10 * (x2 - x1**2)}, (-1.2, 1), (), (1, 1))


def hs7():
    x1, x2 = s = _coordinates(2)
    h = (1 + x1**2) ** 2 + x2**2 - 4
    return Posed("HS7", s, sp.log(1 + x1**2) - x2, {}, {"h": h}, (2, 2), (), (0, sp.sqrt(3)))


def hs21():
    x1, x2 = s = _coordinates(2)
    inequalities = {"g": 10 * x1 - x2 - 10} | _box(s, (2, -50), (50, 50))
    energy = x1**2 / 100 + x2**2 - 100
    return Posed("HS21", s, energy, inequalities, {}, (-1, -1), ("x1_low",), (2, 0))


def hs22():
    x1, x2 = s = _coordinates(2)
    inequalities = {"line": 2 - x1 - x2, "bowl": x2 - x1**2}
    energy = (x1 - 2) ** 2 + (x2 - 1) ** 2
    return Posed("HS22", s, energy, inequalities, {}, (2, 2), ("line", "bowl"), (1, 1))


def hs23():
    x1, x2 = s = _coordinates(2)
    inequalities = {
        "line": x1 + x2 - 1,
        "circle": x1**2 + x2**2 - 1,
        "ellipse": 9 * x1**2 + x2**2 - 9,
        "under": x1**2 - x2,
        "left": x2**2 - x1,
    } | _box(s, (-50, -50), (50, 50))
    energy = x1**2 + x2**2
    return Posed("HS23", s, energy, inequalities, {}, (3, 1), ("under", "left"), (1, 1))


def hs24():
    x1, x2 = s = _coordinates(2)
    root = sp.sqrt(3)
    inequalities = {
        "lower": x1 / root - x2,
        "side": x1 + root * x2,
        "upper": 6 - x1 - root * x2,
    } | _box(s, (0, 0), (None, None))
    energy = ((x1 - 3) ** 2 - 9) * x2**3 / (27 * root)
    return Posed("HS24", s, energy, inequalities, {}, (1, 0.5), ("lower", "upper"), (3, root))


def hs28():
    x1, x2, x3 = s = _coordinates(3)
    h = x1 + 2 * x2 + 3 * x3 - 1
    energy = (x1 + x2) ** 2 + (x2 + x3) ** 2
    optimum = _rational("1/2", "-1/2", "1/2")
    return Posed("HS28", s, energy, {}, {"h": h}, (-4, 1, 1), (), optimum)


def hs35():
    x1, x2, x3 = s = _coordinates(3)
    inequalities = {"plane": 3 - x1 - x2 - 2 * x3} | _box(s, (0, 0, 0), (None,) * 3)
    energy = 9 - 8 * x1 - 6 * x2 - 4 * x3
    energy += 2 * x1**2 + 2 * x2**2 + x3**2 + 2 * x1 * x2 + 2 * x1 * x3
    optimum = _rational("4/3", "7/9", "4/9")
    return Posed("HS35", s, energy, inequalities, {}, (0.5, 0.5, 0.5), ("plane",), optimum)


def hs43():
    x1, x2, x3, x4 = s = _coordinates(4)
    inequalities = {
        "g1": 8 - x1**2 - x2**2 - x3**2 - x4**2 - x1 + x2 - x3 + x4,
        "g2": 10 - x1**2 - 2 * x2**2 - x3**2 - 2 * x4**2 + x1 + x4,
        "g3": 5 - 2 * x1**2 - x2**2 - x3**2 - 2 * x1 + x2 + x4,
    }
    energy = x1**2 + x2**2 + 2 * x3**2 + x4**2 - 5 * x1 - 5 * x2 - 21 * x3 + 7 * x4
    return Posed("HS43", s, energy, inequalities, {}, (0,) * 4, ("g1", "g3"), (0, 1, 2, -1))


def hs48():
    x1, x2, x3, x4, x5 = s = _coordinates(5)
    equations = {"sum": sum(s) - 5, "mixed": x3 - 2 * (x4 + x5) + 3}
    energy = (x1 - 1) ** 2 + (x2 - x3) ** 2 + (x4 - x5) ** 2
    return Posed("HS48", s, energy, {}, equations, (3, 5, -3, 2, -2), (), (1,) * 5)


def hs65():
    x1, x2, x3 = s = _coordinates(3)
    inequalities = {"ball": 48 - x1**2 - x2**2 - x3**2}
    inequalities |= _box(s, (-4.5, -4.5, -5), (4.5, 4.5, 5))
    energy = (x1 - x2) ** 2 + (x1 + x2 - 10) ** 2 / 9 + (x3 - 5) ** 2
    guess = (3.65046, 3.65046, 4.62042)
    return Posed("HS65", s, energy, inequalities, {}, (-5, 5, 0), ("ball",), guess, exact=False)


def hs71():
    x1, x2, x3, x4 = s = _coordinates(4)
    inequalities = {"volume": x1 * x2 * x3 * x4 - 25} | _box(s, (1,) * 4, (5,) * 4)
    equations = {"sphere": x1**2 + x2**2 + x3**2 + x4**2 - 40}
    energy = x1 * x4 * (x1 + x2 + x3) + x3
    guess, active = (1, 4.743, 3.8211, 1.3794), ("volume", "x1_low")
    return Posed(
        "HS71", s, energy, inequalities, equations, (1, 5, 5, 1), active, guess, exact=False
    )


def hs76():
    x1, x2, x3, x4 = s = _coordinates(4)
    half = sp.Rational(1, 2)
    inequalities = {
        "g1": 5 - x1 - 2 * x2 - x3 - x4,
        "g2": 4 - 3 * x1 - x2 - 2 * x3 + x4,
        "g3": x2 + 4 * x3 - 3 * half,
    } | _box(s, (0,) * 4, (None,) * 4)
    energy = x1**2 + half * x2**2 + x3**2 + half * x4**2 - x1 * x3 + x3 * x4
    energy += -x1 - 3 * x2 + x3 - x4
    optimum = _rational("3/11", "23/11", "0", "6/11")
    return Posed("HS76", s, energy, inequalities, {}, (0.5,) * 4, ("g1", "x3_low"), optimum)


def hs100():
    x1, x2, x3, x4, x5, x6, x7 = s = _coordinates(7)
    inequalities = {
        "g1": 127 - 2 * x1**2 - 3 * x2**4 - x3 - 4 * x4**2 - 5 * x5,
        "g2": 282 - 7 * x1 - 3 * x2 - 10 * x3**2 - x4 + x5,
        "g3": 196 - 23 * x1 - x2**2 - 6 * x6**2 + 8 * x7,
        "g4": -4 * x1**2 - x2**2 + 3 * x1 * x2 - 2 * x3**2 - 5 * x6 + 11 * x7,
    }
    energy = (x1 - 10) ** 2 + 5 * (x2 - 12) ** 2 + x3**4 + 3 * (x4 - 11) ** 2 + 10 * x5**6
    energy += 7 * x6**2 + x7**4 - 4 * x6 * x7 - 10 * x6 - 8 * x7
    guess = (2.330499, 1.951372, -0.4775414, 4.365726, -0.6244870, 1.038131, 1.594227)
    start = (1, 2, 0, 4, 0, 1, 1)
    return Posed("HS100", s, energy, inequalities, {}, start, ("g1", "g4"), guess, exact=False)


def hs13():
    """The cusp: no multiplier exists at the optimum ``(1, 0)``."""
    x1, x2 = s = _coordinates(2)
    inequalities = {"cusp": (1 - x1) ** 3 - x2} | _box(s, (0, 0), (None, None))
    energy = (x1 - 2) ** 2 + x2**2
    return Posed("HS13", s, energy, inequalities, {}, (-2, -2), ("cusp", "x2_low"), (1, 0))


def hs26():
    """A quartic optimum: the second order vanishes along one direction of the face."""
    x1, x2, x3 = s = _coordinates(3)
    h = (1 + x2**2) * x1 + x3**4 - 3
    energy = (x1 - x2) ** 2 + (x2 - x3) ** 4
    return Posed("HS26", s, energy, {}, {"h": h}, (-2.6, 2, 2), (), (1, 1, 1))


REGULAR = tuple(
    make()
    for make in (
        hs6,
        hs7,
        hs21,
        hs22,
        hs23,
        hs24,
        hs28,
        hs35,
        hs43,
        hs48,
        hs65,
        hs71,
        hs76,
        hs100,
    )
)
