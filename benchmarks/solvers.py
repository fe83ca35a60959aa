"""The dyad's minimisation problem for other solvers, formulated as well as possible for each.

All of them get the same formulation as polycorner's own search: variables in the manifold's scales,
gaps in ball radii, the energy divided by its size at the minimum, and functions compiled to machine
code.
Each solver is a callable from a start to the point where it stops.
"""

import shutil
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path
from typing import Any

import numpy as np

from polycorner.dumbbells import DumbbellPair

Solver = Callable[[np.ndarray], np.ndarray]


class Scaled:
    """The energy and the nine gaps in scaled variables, values and gradients in one evaluation.

    Solvers ask for the four parts separately, so the last evaluation is kept.

    Parameters
    ----------
    pair : DumbbellPair
        The model.
    rest : (6,) array
        Point at which the energy is taken as zero and its size measured.
    """

    def __init__(self, pair: DumbbellPair, rest: np.ndarray) -> None:
        self.scales = pair.manifold.scale_array
        gaps, energy = pair.polyhedron.functions[0], pair.energy
        self._numbers = [np.array(f.parameters) for f in (gaps, energy)]
        self._addresses = [numbers.ctypes.data for numbers in self._numbers]
        self._kernels = [f.family.kernel.compiled(1) for f in (gaps, energy)]
        self.floor = float(energy.value(rest))
        slope = abs(energy.gradient(rest) * self.scales).max()
        bend = abs(energy.hessian(rest) * np.outer(self.scales, self.scales)).max()
        self.size = float(max(slope, bend))
        self.by_gap = self.scales / pair.ball_radius
        self.by_energy = self.scales / self.size
        self.gap_unit = 1.0 / pair.ball_radius
        self._last = b""

    def at(self, u: np.ndarray) -> "Scaled":
        """Evaluate at ``u`` unless that was the last point, and return this object."""
        key = u.tobytes()
        if key != self._last:
            q = u * self.scales
            f, J = self._kernels[0].at(q, self._addresses[0])
            e, g = self._kernels[1].at(q, self._addresses[1])
            self._last, self.gaps, self.jacobian = key, f * self.gap_unit, J * self.by_gap
            self.energy, self.slope = (e.item() - self.floor) / self.size, g[0] * self.by_energy
        return self


def scipy_slsqp(pair: DumbbellPair, rest: np.ndarray) -> Solver:
    """Return SciPy's SLSQP."""
    from scipy.optimize import minimize

    scaled = Scaled(pair, rest)
    constraint = {
        "type": "ineq",
        "fun": lambda u: scaled.at(u).gaps,
        "jac": lambda u: scaled.at(u).jacobian,
    }

    def solve(start: np.ndarray) -> np.ndarray:
        found = minimize(
            lambda u: scaled.at(u).energy,
            start / scaled.scales,
            jac=lambda u: scaled.at(u).slope,
            method="SLSQP",
            constraints=[constraint],
            options={"ftol": 1e-12, "maxiter": 500},
        )
        return found.x * scaled.scales

    return solve


def nlopt_slsqp(pair: DumbbellPair, rest: np.ndarray) -> Solver:
    """Return NLopt's SLSQP, with the nine gaps as one constraint of several components."""
    import nlopt

    scaled = Scaled(pair, rest)

    def objective(u: np.ndarray, gradient: np.ndarray) -> float:
        here = scaled.at(u)
        if gradient.size:
            gradient[:] = here.slope
        return here.energy

    def constraint(result: np.ndarray, u: np.ndarray, gradient: np.ndarray) -> None:
        here = scaled.at(u)
        np.negative(here.gaps, out=result)
        if gradient.size:
            np.negative(here.jacobian, out=gradient)

    search = nlopt.opt(nlopt.LD_SLSQP, 6)
    search.set_min_objective(objective)
    search.add_inequality_mconstraint(constraint, np.full(9, 1e-10))
    search.set_xtol_rel(1e-10)
    search.set_maxeval(2000)
    return lambda start: search.optimize(start / scaled.scales) * scaled.scales


def casadi_sqp(pair: DumbbellPair, rest: np.ndarray, convexify: str, folder: Path) -> Solver:
    """Return CasADi's SQP method with exact Hessians made convex in the given way.

    Its functions are compiled by gcc if it is available, else run by CasADi's own interpreter;
    the compiled files stay in the folder as long as the solver exists.
    """
    import casadi

    scaled = Scaled(pair, rest)
    u = casadi.SX.sym("u", 6)
    q = casadi.vertsplit(u * scaled.scales)
    problem = {
        "x": u,
        "f": (_energy(casadi, pair, q) - scaled.floor) / scaled.size,
        "g": casadi_gaps(casadi, pair, q) / pair.ball_radius,
    }
    silent = dict.fromkeys(("print_time", "print_header", "error_on_fail"), False)
    options = {
        **silent,
        "print_iteration": False,
        "print_status": False,
        "qpsol": "qrqp",
        "qpsol_options": {**silent, "print_iter": False, "print_info": False},
        "hessian_approximation": "exact",
        "convexify_strategy": convexify,
        "max_iter_ls": 0,
    }
    if shutil.which("gcc") is not None:
        flags = {"flags": ["-O3", "-march=native"]}
        options |= {"jit": True, "compiler": "shell", "jit_options": flags}
    with chdir(folder):
        search = casadi.nlpsol("search", "sqpmethod", problem, options)

    def solve(start: np.ndarray) -> np.ndarray:
        found = search(x0=start / scaled.scales, lbg=0.0, ubg=np.inf)
        return found["x"].full().ravel() * scaled.scales

    return solve


def casadi_gaps(casadi: Any, pair: DumbbellPair, q: list[Any]) -> Any:
    """Return the nine gaps as a CasADi expression, with the same cases as polycorner's."""
    r, t = pair.ball_radius, pair.rod_radius
    a, b = _centres(casadi, pair, q[:3]), _centres(casadi, pair, q[3:])
    norm, dot, choose = casadi.norm_2, casadi.dot, casadi.if_else
    apart = [[norm(p - s) for s in b] for p in a]

    def from_rod(p: Any, rod: list[Any], ends: list[Any]) -> Any:
        axis = rod[1] - rod[0]
        foot = dot(p - rod[0], axis) / dot(axis, axis)
        beside = norm(p - rod[0] - foot * axis)
        return choose(foot <= 0, ends[0], choose(foot >= 1, ends[1], beside))

    ends = [from_rod(a[i], b, apart[i]) for i in (0, 1)]
    ends += [from_rod(b[j], a, [apart[0][j], apart[1][j]]) for j in (0, 1)]
    u, v, w = a[1] - a[0], b[1] - b[0], a[0] - b[0]
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    den, s, z = uu * vv - uv * uv, uv * vw - vv * uw, uu * vw - uv * uw
    crossing = casadi.logic_and(den > 1e-20 * uu * vv, casadi.fmin(s, z) > 0)
    crossing = casadi.logic_and(crossing, casadi.fmax(s, z) < den)
    # The branch not taken must stay finite: its derivative is multiplied by zero.
    height = casadi.fabs(dot(w, casadi.cross(u, v))) / casadi.sqrt(choose(crossing, den, 1))
    least = casadi.fmin(casadi.fmin(ends[0], ends[1]), casadi.fmin(ends[2], ends[3]))
    gaps = [d - 2 * r for row in apart for d in row] + [d - r - t for d in ends]
    return casadi.vertcat(*gaps, choose(crossing, height, least) - 2 * t)


def _centres(casadi: Any, pair: DumbbellPair, q: list[Any]) -> list[Any]:
    phi, eta, theta = q
    rho, half = pair.centre_radius, pair.length / 2
    s = half * casadi.sin(theta) / rho
    c = casadi.sqrt(1 - s * s)
    sine, cosine = casadi.sin(phi), casadi.cos(phi)
    return [
        casadi.vertcat(
            rho * (sine * c + sign * cosine * s),
            eta + sign * half * casadi.cos(theta),
            -rho * (cosine * c - sign * sine * s),
        )
        for sign in (-1, 1)
    ]


def _energy(casadi: Any, pair: DumbbellPair, q: list[Any]) -> Any:
    rho = pair.centre_radius
    total = 0
    for phi, theta in ((q[0], q[2]), (q[3], q[5])):
        chord = casadi.sqrt(1 - (pair.length * casadi.sin(theta) / (2 * rho)) ** 2)
        total += (2 + pair.rod_weight) * (pair.drum_radius - rho * casadi.cos(phi) * chord)
    return total
