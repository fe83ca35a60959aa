"""Equations that depend on each other: independent ones, which imply the others nearby."""

from collections.abc import Iterable
from itertools import islice

import numpy as np

from polycorner.polyhedra.cones import rank
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import evaluated
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, Tolerances

RANKED = 4  # points that are looked at
AROUND = (0.1, 1.0)  # distances, in scale units, of points beside them, and one much smaller
STEPS = 50  # to the equations


def independent_equations(
    polyhedron: Polyhedron, points: Iterable[Array], tolerances: Tolerances = DEFAULT
) -> tuple[int, ...]:
    """Return positions of equations with independent gradients that span those of all equations.

    The rank of equations on the set is the largest near given points: near, because it may fall
    short at the points themselves; on the set, because beside it dependent equations, such as one
    equation and its square, may have independent gradients.  Equations whose gradients vary least
    in size come first: those of squares vanish on the set, those of multiples may.  Before them
    come those that normalise vectors and quaternions, so that these are always among them.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set.
    points : iterable of (n,) arrays
        Points on the set or beside it.
    tolerances : Tolerances, optional
    """
    first, count = len(polyhedron.functions), len(polyhedron.equation_names)
    rng, scales = np.random.default_rng(0), polyhedron.manifold.scale_array
    found = (
        _on_equations(polyhedron, q + radius * scales * rng.standard_normal(len(q)), tolerances)
        for q in islice(points, RANKED if count > 1 else 0)
        for radius in (tolerances.beside, *AROUND)
    )
    samples = [gradients for gradients in found if gradients is not None]
    if not samples:
        return tuple(range(first, first + count))
    sizes = np.linalg.norm(samples, axis=2)
    steady = sizes.min(axis=0) / np.maximum(sizes.max(axis=0), 1e-300)
    normalising = np.arange(count) >= count - polyhedron.normalised
    order = np.lexsort((-steady, ~normalising)).tolist()
    most = max((_first_independent(some, order, tolerances.rank) for some in samples), key=len)
    return tuple(first + i for i in sorted(most))


def _first_independent(gradients: Array, order: list[int], tolerance: float) -> list[int]:
    """Return the positions, taken in order, of rows that are independent of those before."""
    chosen: list[int] = []
    for i in order:
        if rank(gradients[[*chosen, i]], tolerance) > len(chosen):
            chosen.append(i)
    return chosen


def _on_equations(polyhedron: Polyhedron, q: Array, tolerances: Tolerances) -> Array | None:
    """Return the gradients of all equations where Gauss and Newton's steps to them end, if so."""
    first, scales = len(polyhedron.functions), polyhedron.manifold.scale_array
    for _ in range(STEPS):
        values, gradients = (part[first:] for part in evaluated(polyhedron, q))
        if not (np.isfinite(values).all() and np.isfinite(gradients).all()):
            return None
        step = -np.asarray(np.linalg.lstsq(gradients, values, rcond=tolerances.rank)[0])
        if np.linalg.norm(step) <= tolerances.settled:
            return gradients
        q = q + scales * step
    return None
