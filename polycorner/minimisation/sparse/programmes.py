"""Programmes of one step: the linearised polyhedron, with a linear or a quadratic energy.

Linear ones are solved by HiGHS, quadratic ones by Clarabel's interior-point method.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import block_array, csc_array, csr_array, eye_array, triu, vstack

from polycorner.spaces.manifold import Array

NEARBY = 1e-2  # curvature of the distance beside the violation, so that a near point is sought
SOLVED = {"Solved", "AlmostSolved"}


@dataclass(frozen=True)
class Linearised:
    """Values and first derivatives at a point, in scaled coordinates.

    Attributes
    ----------
    values, rows : (m,) array, (m, n) sparse array
        Of the inequalities that a step can reach.
    sections, section_rows : (e,) array, (e, n) sparse array
        Of the equations.
    gradient : (n,) array
        Of the energy.
    """

    values: Array
    rows: csr_array
    sections: Array
    section_rows: csr_array
    gradient: Array


@dataclass(frozen=True)
class Step:
    """A step ``d`` with the multipliers of the linearised inequalities."""

    displacement: Array
    multipliers: Array


def step(at: Linearised, reach: Array) -> Step | None:
    """Minimise ``g.d`` over ``f + A d >= 0``, ``h + B d = 0``, ``|d_i| <= reach_i``.

    By HiGHS's interior-point method with crossover, so that the multipliers are those of a corner
    of the programme: exactly zero for all but at most ``n`` functions.  The programme is stated in
    units of ``reach``, since tolerances of the solver are absolute.  None where it fails.
    """
    size = float(np.max(reach))
    bounds = np.column_stack([-reach, reach]) / size
    scale = float(abs(at.gradient).max()) or 1.0
    equations = len(at.sections) > 0
    solve: Any = linprog  # whose stubs know no sparse arrays
    found = solve(
        at.gradient / scale,
        A_ub=-at.rows,
        b_ub=at.values / size,
        A_eq=at.section_rows if equations else None,
        b_eq=-at.sections / size if equations else None,
        bounds=bounds,
        method="highs-ipm",
    )
    if found.x is None or found.status != 0:
        return None
    return Step(found.x * size, -found.ineqlin.marginals * scale)


def quadratic_step(at: Linearised, hessian: csr_array, reach: float) -> Step | None:
    """Minimise ``g.d + d.B d / 2`` over ``f + A d >= 0``, ``h + C d = 0``, ``|d_i| <= reach``.

    ``B`` has no negative eigenvalues.  The programme is stated in units of ``reach``, since
    tolerances of the solver are relative to sizes of one.  None where it fails.
    """
    n = len(at.gradient)
    curved = reach * (hessian + 1e-7 * eye_array(n))  # coordinates that nothing moves stay
    unit = eye_array(n, format="csr")
    rows = vstack([at.section_rows, -at.rows, unit, -unit], format="csc")
    right = np.concatenate([-at.sections / reach, at.values / reach, np.ones(2 * n)])
    found = _solved(curved, at.gradient, rows, right, len(at.sections))
    if found is None:
        return None
    (x, z), first = found, len(at.sections)
    return Step(x * reach, z[first : first + len(at.values)])


def elastic_step(at: Linearised, reach: float) -> Array | None:
    """Minimise the violation ``sum max(0, -f - A d) + sum |h + C d|`` over ``|d_i| <= reach``.

    Of equal violations the step with the least ``|d|`` is preferred; the energy plays no part.
    """
    n, m, e = len(at.gradient), len(at.values), len(at.sections)
    unit, slack, excess = eye_array(n), eye_array(m), eye_array(e)
    rows = block_array(
        [
            [at.section_rows, csr_array((e, m)), -excess, excess],
            [-at.rows, -slack, csr_array((m, e)), csr_array((m, e))],
            [unit, csr_array((n, m)), csr_array((n, e)), csr_array((n, e))],
            [-unit, csr_array((n, m)), csr_array((n, e)), csr_array((n, e))],
            [csr_array((m, n)), -slack, csr_array((m, e)), csr_array((m, e))],
            [csr_array((e, n)), csr_array((e, m)), -excess, csr_array((e, e))],
            [csr_array((e, n)), csr_array((e, m)), csr_array((e, e)), -excess],
        ],
        format="csc",
    )
    zero = np.zeros(m + 2 * e)
    right = np.concatenate([-at.sections / reach, at.values / reach, np.ones(2 * n), zero])
    cost = np.concatenate([np.zeros(n), np.ones(m + 2 * e)])
    stacked: Any = block_array
    curved = stacked([[NEARBY * reach * unit, None], [None, csr_array((m + 2 * e,) * 2)]])
    found = _solved(curved, cost, rows, right, e)
    return None if found is None else found[0][:n] * reach


def _solved(
    curved: Any, cost: Array, rows: Any, right: Array, equations: int
) -> tuple[Array, Array] | None:
    """Minimise ``c.x + x.P x / 2`` over ``b - A x``, zero in its first entries, then not negative.

    Returns ``x`` and the multipliers of the rows.
    """
    import clarabel

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    cones = [clarabel.NonnegativeConeT(len(right) - equations)]
    if equations:
        cones.insert(0, clarabel.ZeroConeT(equations))
    parts: Any = csc_array(triu(curved)), cost, csc_array(rows), right
    found = clarabel.DefaultSolver(*parts, cones, settings).solve()
    if str(found.status) not in SOLVED:
        return None
    return np.asarray(found.x), np.asarray(found.z)
