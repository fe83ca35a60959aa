"""Frequencies of small motions of bodies that are tied to each other."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, block_diag, coo_array, csc_array, diags_array
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs, splu

from polycorner.motion.formulation import Formulation, force_slopes, moment
from polycorner.motion.tie_forms import Ties
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

Places = NDArray[np.intp]

DENSE = 64  # coordinates up to which all frequencies are found
CLOSE = 0.01  # relative error of the highest of more, by ARPACK


class PlacedKind(NamedTuple):
    """Bodies of a kind where they are.

    Attributes
    ----------
    law, parameters
        Equations of motion of a body.
    scales : (n,) array
    q, v : (N, n) array
    own : (array, array) or None
        Gradients ``(N, j, n)`` and Hessians ``(N, j, n, n)`` of the equations of each body.
    """

    law: Formulation
    parameters: Array
    scales: Array
    q: Array
    v: Array
    own: tuple[Array, Array] | None


def tied_square(kinds: Sequence[PlacedKind], ties: Ties, time: float) -> float:
    """Return the square of the highest frequency of small motions of tied bodies.

    As :func:`~polycorner.motion.formulation.highest_square` does for one body, for all of them
    with sparse matrices.  Bodies have as many coordinates as those that have most: further ones
    have the mass 1 and no forces.
    """
    k = max(kind.q.shape[1] for kind in kinds)
    q = np.concatenate([_wide(kind.q, k) for kind in kinds])
    v = np.concatenate([_wide(kind.v, k) for kind in kinds])
    each = [(kind, *at) for kind in kinds for at in zip(kind.q, kind.v, strict=True)]
    units = np.concatenate([_wide(kind.scales[None], k, 1.0)[0] for kind, _, _ in each])
    masses, slopes, forces = [], [], []
    for kind, place, speed in each:
        n, now = len(kind.scales), moment(kind.law, kind.parameters, place, speed)
        own = force_slopes(kind.law, kind.parameters, kind.scales, place, speed)
        forces.append(np.pad(now.force, (0, k - n)))
        masses.append(block_diag([now.mass, np.eye(k - n)]) if n < k else now.mass)
        slopes.append(np.pad(own, (0, k - n)))
    size, force = q.size, np.concatenate(forces)
    parts = [_placed(np.array(slopes), np.arange(size).reshape(q.shape), size)]
    for which, (values, gradients) in ties.evaluate("forces", q, v, time, 1):
        at = _places(ties, which, k)
        np.add.at(force, at[at >= 0], values[:, : 2 * k][at >= 0])
        parts.append(_placed(gradients[:, : 2 * k, : 2 * k], at, size))
    if not (np.isfinite(force).all() and all(np.isfinite(part.data).all() for part in parts)):
        return 0.0  # the first step says what is wrong, or it is the edge of where forces are
    mass = diags_array(units) @ block_diag(masses) @ diags_array(units)
    equations = [*_equations(kinds, ties, q, time)]
    jacobian = [_rows(rows, at, size) @ diags_array(units) for rows, _, at in equations]
    respond = _response(mass, jacobian)
    # A balance M a + J' l = F: an equation pulls with -l along its gradient.
    pulls, first = -respond(units * force)[size:], 0
    for rows, hessians, at in equations:
        lam, first = pulls[first : first + len(rows)], first + len(rows)
        sizes = np.linalg.norm(_scaled(rows, at, units), axis=1)
        parts.append(_placed((lam / sizes)[:, None, None] * hessians, at, size))
    stiffness = diags_array(units) @ sum(parts[1:], parts[0]) @ diags_array(units)
    return _largest(lambda u: respond(stiffness @ u)[:size], size)


def _wide(values: Array, k: int, fill: float = 0.0) -> Array:
    """Return rows of numbers with further ones up to a width."""
    return np.pad(values, ((0, 0), (0, k - values.shape[1])), constant_values=fill)


def _equations(
    kinds: Sequence[PlacedKind], ties: Ties, q: Array, time: float
) -> Iterator[tuple[Array, Array, Places]]:
    """Yield gradients ``(s, n)`` and Hessians of equations, and where their coordinates stand."""
    k, first = q.shape[1], 0
    for kind in kinds:
        count, n = kind.q.shape
        places = (first + np.arange(count))[:, None] * k + np.arange(n)
        first += count
        if kind.own is not None:
            at = np.repeat(places, kind.own[0].shape[1], axis=0)
            yield kind.own[0].reshape(-1, n), kind.own[1].reshape(-1, n, n), at
    for which, (_, gradients, hessians) in ties.evaluate("rows", q, None, time, 2):
        limits = ties.forms[ties.form[which[0]]].limits
        at = np.repeat(_places(ties, which, k), gradients.shape[1] - limits, axis=0)
        bends = hessians[:, limits:, : 2 * k, : 2 * k].reshape(-1, 2 * k, 2 * k)
        yield gradients[:, limits:, : 2 * k].reshape(-1, 2 * k), bends, at


def _places(ties: Ties, which: list[int], k: int) -> Places:
    """Return where the coordinates of both bodies of ties stand, -1 for the world."""
    bodies = np.array([ties.bodies[t] for t in which])
    at = np.where(bodies[:, :, None] >= 0, bodies[:, :, None] * k + np.arange(k), -1)
    return np.asarray(at.reshape(len(which), -1), dtype=np.intp)


def _placed(blocks: Array, at: Places, size: int) -> Any:
    """Return small matrices ``(s, n, n)`` at their places ``(s, n)`` in a large sparse one."""
    row, column = np.repeat(at, at.shape[1], axis=1).ravel(), np.tile(at, at.shape[1]).ravel()
    inside = (row >= 0) & (column >= 0)
    entries = blocks.ravel()[inside], (row[inside], column[inside])
    return coo_array(entries, shape=(size, size)).tocsr()


def _scaled(rows: Array, at: Places, units: Array) -> Array:
    """Return gradients by scaled coordinates; zeros for the world."""
    return np.asarray(rows * np.where(at >= 0, units[at], 0.0))


def _rows(rows: Array, at: Places, size: int) -> Any:
    """Return gradients ``(s, n)`` at their places in long rows."""
    number, inside = np.repeat(np.arange(len(rows)), rows.shape[1]), at.ravel() >= 0
    entries = rows.ravel()[inside], (number[inside], at.ravel()[inside])
    return coo_array(entries, shape=(len(rows), size)).tocsr()


def _response(masses: Any, jacobian: list[Any]) -> Callable[[Array], Array]:
    """Return what gives accelerations along equations, and their forces, for forces ``(D,)``.

    Rows of equations are scaled to length 1; a compliance near rounding lets some follow from
    others.
    """
    system, count = masses, 0
    if jacobian:
        sizes = [1 / np.sqrt((rows.multiply(rows)).sum(axis=1)) for rows in jacobian]
        rows = block_array(
            [[diags_array(size) @ row] for size, row in zip(sizes, jacobian, strict=True)]
        )
        count = rows.shape[0]
        soft = DEFAULT.rounding / masses.diagonal().max()
        system = block_array([[masses, rows.T], [rows, diags_array(np.full(count, -soft))]])
    factors = splu(csc_array(system))
    return lambda force: np.asarray(factors.solve(np.append(force, np.zeros(count))))


def _largest(operator: Callable[[Array], Array], size: int) -> float:
    """Return the largest magnitude of the eigenvalues of a linear map of ``size`` numbers."""
    if size <= DENSE:
        matrix = np.column_stack([operator(column) for column in np.eye(size)])
        return float(np.abs(np.linalg.eigvals(matrix)).max(initial=0.0))
    start = np.random.default_rng(0).normal(size=size)
    if not np.any(operator(start)):
        return 0.0
    found: Any
    linear = LinearOperator((size, size), matvec=operator, dtype=np.float64)
    try:
        found = eigs(linear, 1, v0=start, tol=CLOSE, return_eigenvectors=False)
    except ArpackNoConvergence as error:
        found = error.eigenvalues
    return float(np.abs(found).max(initial=0.0))
