"""Linear programmes of one step: the linearised energy over the linearised polyhedron."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array

from polycorner.spaces.manifold import Array


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
