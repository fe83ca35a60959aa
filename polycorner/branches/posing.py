"""Fritz John equations of a problem over an interval of each parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from polycorner.branches.sparse import SparseSystem
from polycorner.branches.system import FritzJohnSystem
from polycorner.minimisation.parametric import lifted_problem
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.equations import independent_equations
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

UNITS = 5.0  # of the continuation in an interval: a step is at most a tenth of it by default


def posed(
    problem: Problem,
    rates: Sequence[Mapping[str, float]],
    intervals: Sequence[tuple[float, float]],
    now: Sequence[float],
    q: Array,
    symmetry: Symmetry,
    tolerances: Tolerances,
) -> FritzJohnSystem:
    """Return the equations over an interval of each parameter, sized at a point.

    Parameters
    ----------
    problem : Problem
        At the values ``now`` of the parameters.
    rates : sequence of mapping from str to float
        For each parameter the derivatives of the formulas' parameters by it.
    intervals : sequence of (float, float)
    now : sequence of float
    q : (n,) array
    symmetry : Symmetry
    tolerances : Tolerances
    """
    names = tuple(dict.fromkeys(name for some in rates for name in some))
    speeds = np.array([[some.get(name, 0.0) for some in rates] for name in names])
    values = np.array([next(iter(problem.parameter_values[name])) for name in names])
    low, high = np.transpose(intervals)
    given: dict[str, Any] = {
        "manifold": problem.polyhedron.manifold,
        "start": values + speeds @ (low - now),
        "rates": speeds * (high - low) / UNITS,
        "length": UNITS,
        "sizes": np.ones(problem.rows),
        "symmetry": symmetry,
        "tolerances": tolerances,
    }
    if problem.is_sparse:
        equations = tuple(range(problem.inequalities, problem.rows - 1))
        system: FritzJohnSystem = SparseSystem(problem, equations=equations, names=names, **given)
    else:
        equations = tuple(independent_equations(problem.polyhedron, [q]))
        system = FritzJohnSystem(lifted_problem(problem, names), equations=equations, **given)
    s = (now - low) / (high - low) * UNITS
    return replace(system, sizes=system.sized(q / problem.scales, s))
