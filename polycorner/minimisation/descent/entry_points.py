"""Entry points of the compiled descent, cached under a key over the sources of all stages."""

from typing import Any

import numpy as np
from numba import njit

from polycorner.formulas.cache import sources_digest
from polycorner.minimisation.descent import flat_directions, newton, sqp
from polycorner.minimisation.descent.feasibility import project

RESTORATIONS = np.int64(100)  # linearisations with which a point is restored


def _entry_points(sources: str) -> tuple[Any, ...]:
    """Return the compiled functions; each reads ``sources``, which puts it into its cache key."""

    @njit(cache=True)
    def descend(problem, use, m, rows, u, size, limit):
        """Descend inside a piece; see ``sqp.descend``."""
        _ = sources
        return sqp.descend(problem, use, m, rows, u, size, limit)

    @njit(cache=True)
    def restore(problem, use, m, rows, u, size):
        """Project a copy of ``u`` onto a piece; return success and the point."""
        _ = sources
        n = u.size
        F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
        v = u.copy()
        return project(problem, use, m, v, F, J, H, size, RESTORATIONS), v

    @njit(cache=True)
    def on_face(problem, on, m, rows, u, size):
        """Apply Newton's method on a face to a copy of ``u``; see ``newton.polish``."""
        _ = sources
        n = u.size
        F, J, H = np.zeros(rows), np.zeros((rows, n)), np.zeros((rows, n, n))
        v = u.copy()
        lam, step = newton.polish(problem, on, m, np.zeros((0, n)), v, F, J, H, size)
        return v, lam, step

    @njit(cache=True)
    def probe(problem, on, use, m, rows, u, directions, held, steps, size):
        """Follow directions along a face; see ``flat_directions.probe``."""
        _ = sources
        return flat_directions.probe(problem, on, use, m, rows, u, directions, held, steps, size)

    return descend, restore, on_face, probe


descend, restore, on_face, probe = _entry_points(sources_digest(__package__))
