"""Approximate stationary points near boxes that are left, by Newton's method in doubles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.batches import bordered, solved
from polycorner.proofs.lists.branches import Mask
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

MOST_STEPS = 20
STRIDE = 0.5  # longest step in scale units
RELEVANT = 1e-6  # share of the largest force at which a function counts as active


@dataclass
class FacesOfPoints:
    """Rows of the functions that vanish on faces, one face for each point.

    Attributes
    ----------
    rows : (B, k) array of int
        The active inequalities, filled up to the most that a face has, then the equations.
    filled : (B, k) array of bool
        Which of them only fill up.
    """

    rows: NDArray[np.intp]
    filled: Mask

    @classmethod
    def of(cls, problem: Problem, active: Mask) -> "FacesOfPoints":
        """Return the faces with some active inequalities ``(B, m)``."""
        counts = active.sum(axis=1)
        most = int(counts.max(initial=0))
        first = np.argsort(~active, axis=1, kind="stable")[:, :most]
        others = np.arange(problem.inequalities, problem.rows - 1)
        rows = np.hstack([first, np.broadcast_to(others, (len(active), len(others)))])
        filled = np.zeros(rows.shape, dtype=np.bool_)
        filled[:, :most] = np.arange(most) >= counts[:, None]
        return cls(rows, filled)

    def of_rows(self, which: NDArray[np.intp], quantity: Array) -> Array:
        """Return the rows of a quantity ``(b, M, ...)`` at some of the points, 0 for fillings."""
        found: Array = quantity[np.arange(len(which))[:, None], self.rows[which]]
        found[self.filled[which]] = 0.0
        return found


def newton(
    problem: Problem,
    q: Array,
    active: Mask,
    free: Sequence[int],
    reach: ArrayLike = np.inf,
) -> tuple[Array, NDArray[np.bool_]]:
    """Return solutions near some points of the KKT equations of a face each.

    Parameters
    ----------
    problem : Problem
    q : (B, n) array
        Starting points.
    active : (B, m) array of bool
        Inequalities that vanish on the face.
    free : sequence of int
        Coordinates that are unknowns.
    reach : (B,) array, optional
        How far from the start in scale units a solution may be; the method is ended at points that
        are twice as far.

    Returns
    -------
    points : (B, n) array
    found : (B,) array of bool
        Where the method has settled, with positive multipliers of the inequalities.
    """
    faces, free = FacesOfPoints.of(problem, active), list(free)
    n, units, count = len(free), problem.scales[free], faces.rows.shape[1]
    start, reach = q, np.broadcast_to(reach, len(q))
    q, lam, found = q.copy(), np.zeros((len(q), count)), np.zeros(len(q), dtype=np.bool_)
    going, unit = np.arange(len(q)), np.arange(n, n + count)
    for step in range(MOST_STEPS):
        values, gradients, hessians = problem.evaluate(q[going], 2)
        bends = faces.of_rows(going, hessians)[:, :, free][:, :, :, free]
        bent = hessians[:, -1][:, free][:, :, free]
        fine = np.isfinite(values).all(axis=1) & np.isfinite(bends).all(axis=(1, 2, 3))
        fine &= np.isfinite(bent).all(axis=(1, 2))
        slopes = faces.of_rows(going, gradients)[fine][:, :, free]
        pull, values = gradients[fine, -1][:, free], faces.of_rows(going, values)[fine]
        going, bends, bent = going[fine], bends[fine], bent[fine]
        if step == 0 and count:
            lam[going] = np.einsum("bik,bi->bk", np.linalg.pinv(slopes), pull)
        weights = lam[going]
        matrix = bordered(bent - np.einsum("bk,bkij->bij", weights, bends), slopes)
        matrix[:, unit, unit] = faces.filled[going]
        balance = pull - np.einsum("bk,bki->bi", weights, slopes)
        change = solved(matrix, -np.concatenate([balance, values], axis=1))
        length = abs(change[:, :n]).max(axis=1, initial=0.0)
        with np.errstate(divide="ignore"):
            change *= np.minimum(1.0, STRIDE / length)[:, None]
        fine = np.isfinite(change).all(axis=1)
        going, change, length = going[fine], change[fine], length[fine]
        q[going[:, None], free] += change[:, :n] * units
        lam[going] += change[:, n:]
        away = abs((q[going] - start[going])[:, free] / units).max(axis=1, initial=0.0)
        found[going[(length < DEFAULT.rounding) & (away <= reach[going])]] = True
        going = going[(length >= DEFAULT.rounding) & (away <= 2 * reach[going])]
        if not going.size:
            break
    most = count - (problem.rows - 1 - problem.inequalities)
    return q, found & ((lam > 0) | faces.filled)[:, :most].all(axis=1)


def active_sets(weights: Array, pulls: Array) -> Mask:
    """Return the functions ``(B, m)`` that balance the energy in nearest combinations.

    Parameters
    ----------
    weights : (B, m + 1) array
        Weights of the gradients, the energy's last.
    pulls : (B, m + 1) array
        Lengths of the gradients.
    """
    forces = weights * pulls
    most = forces.max(axis=1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore"):
        return np.asarray((forces[:, :-1] > RELEVANT * most) & (most > 0))
