"""Problems of Hock and Schittkowski with their optima.

The formulas are those of the trials.  A problem says which inequalities hold its optimum and where
that is: exactly, in SymPy numbers, or as a guess good to a few digits from which the KKT equations
are solved in forty.
"""

from dataclasses import dataclass
from functools import cached_property

import mpmath
import numpy as np
import sympy as sp

from benchmarks.trials.hock_schittkowski import problems

DIGITS = 40


@dataclass(frozen=True)
class Posed:
    """Minimise ``energy`` where every inequality is ``>= 0`` and every equation is 0.

    Inequalities are called ``g1``, ``low_x1`` and ``high_x1``, equations ``h1``, and so on.
    """

    name: str
    active: tuple
    optimum: tuple
    exact: bool = True

    @cached_property
    def _problem(self):
        (found,) = problems(self.name)
        return found

    @property
    def coordinates(self):
        return self._problem.symbols

    @property
    def energy(self):
        return self._problem.energy

    @property
    def start(self):
        return self._problem.start

    @property
    def polyhedron(self):
        return self._problem.polyhedron

    @cached_property
    def inequalities(self):
        return {f.name: f.expression for f in self.polyhedron.functions}

    @cached_property
    def equations(self):
        return {f"h{i}": h for i, h in enumerate(self._problem.equations, 1)}

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


def _rational(*numbers):
    return tuple(sp.Rational(number) for number in numbers)


REGULAR = (
    Posed("HS6", (), (1, 1)),
    Posed("HS7", (), (0, sp.sqrt(3))),
    Posed("HS21", ("low_x1",), (2, 0)),
    Posed("HS22", ("g1", "g2"), (1, 1)),
    Posed("HS23", ("g4", "g5"), (1, 1)),
    Posed("HS24", ("g1", "g3"), (3, sp.sqrt(3))),
    Posed("HS28", (), _rational("1/2", "-1/2", "1/2")),
    Posed("HS35", ("g1",), _rational("4/3", "7/9", "4/9")),
    Posed("HS43", ("g1", "g3"), (0, 1, 2, -1)),
    Posed("HS48", (), (1,) * 5),
    Posed("HS65", ("g1",), (3.65046, 3.65046, 4.62042), exact=False),
    Posed("HS71", ("g1", "low_x1"), (1, 4.743, 3.8211, 1.3794), exact=False),
    Posed("HS76", ("g1", "low_x3"), _rational("3/11", "23/11", "0", "6/11")),
    Posed(
        "HS100",
        ("g1", "g4"),
        (2.330499, 1.951372, -0.4775414, 4.365726, -0.6244870, 1.038131, 1.594227),
        exact=False,
    ),
)


def hs13():
    """The cusp: no multiplier exists at the optimum."""
    return Posed("HS13", ("g1", "low_x2"), (1, 0))


def hs26():
    """A quartic optimum: the second order vanishes along one direction of the face."""
    return Posed("HS26", (), (1, 1, 1))
