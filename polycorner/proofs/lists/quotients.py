"""Coordinates that may be fixed because continuous symmetries carry every point to their values.

Let the fields ``xi`` be symmetries whose components have bounded derivatives on the whole manifold,
so that their flows exist for all times.  After the coordinates ``F``, a coordinate ``j`` may be
fixed if a combination of the fields with constant coefficients has, wherever ``q_F`` has its
values, components 0 along ``F`` and a constant other than 0 along ``j``: its flow keeps ``q_F`` and
carries ``q_j`` to any value.

At a point of the section the fields leave it, and the energy and all functions are constant along
them: the point is stationary in the section if and only if it is in the whole space.
"""

import math
from collections.abc import Sequence

import numpy as np

from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms
from polycorner.intervals.tapes import Box, needed
from polycorner.proofs.invariance import Generator, annihilated, generators, translations
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.operators import BITS
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT


def unreached(formulas: Formulas, domain: Domain, fields: Sequence[object]) -> list[int]:
    """Return the fixed coordinates whose values not every orbit is shown to reach.

    Parameters
    ----------
    formulas : Formulas
        All functions of the problem.
    domain : Domain
    fields : sequence of vector fields
        Declared symmetries; translations are found without being declared.
    """
    left = list(domain.fixed)
    if not left:
        return left
    everything = SmoothForms(formulas.graph, formulas.outputs, formulas.dimension, formulas.inputs)
    with precision(BITS):
        known = [f for f in generators(domain.manifold, fields) if all(annihilated(everything, f))]
        known += generators(domain.manifold, translations(everything))
        complete = [f for f in known if _is_complete(f)]
        done: list[int] = []
        while left:
            rows = [_constants(f, domain, done) for f in complete]
            new = next((j for j in left if _moves(rows, done, j)), None)
            if new is None:
                break
            done.append(new)
            left.remove(new)
    return left


def _constants(field: Generator, domain: Domain, done: Sequence[int]) -> Array:
    """Return the components that are constant where some coordinates are fixed, NaN for others."""
    hull = [ball(0, math.inf)] * domain.manifold.dimension
    for i in done:
        hull[i] = ball(float(domain.lower[i]))
    found = field.bounds(hull)
    return np.array([float(x) if x.is_finite() and x.rad() == 0 else math.nan for x in found])


def _moves(rows: Sequence[Array], done: Sequence[int], new: int) -> bool:
    """Whether a combination of rows is 0 along ``done`` and not along ``new``."""
    usable = [row[[*done, new]] for row in rows if np.isfinite(row[[*done, new]]).all()]
    if not usable:
        return False
    matrix = np.array(usable)
    return _rank(matrix) > _rank(matrix[:, :-1])


def _rank(matrix: Array) -> int:
    return int(np.linalg.matrix_rank(matrix, rtol=DEFAULT.alike)) if matrix.size else 0


def _is_complete(field: Generator) -> bool:
    """Whether the derivatives of the components are bounded, without branches."""
    formulas = field.formulas
    nodes = needed(formulas.graph, formulas.outputs)
    if any(formulas.graph.nodes[a][0] == "select" for a in nodes):
        return False
    forms = SmoothForms(formulas.graph, formulas.outputs, formulas.dimension, formulas.inputs)
    _, slopes = forms.evaluate(Box([ball(0, math.inf)] * formulas.dimension), 1)
    return all(x.is_finite() for row in slopes for x in row)
