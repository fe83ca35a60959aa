"""Steepest descent inside a polyhedron, contact by contact."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.minimisation import Certificate, Problem, minimise
from polycorner.toolkit import (
    Array,
    Checked,
    Quotient,
    approach,
    checked,
    pose,
    project,
    real,
    refuse,
)

if TYPE_CHECKING:
    from polycorner.polyhedra import Polyhedron

STRIDE = 0.15  # longest step of a path, in scale units
LEAST = 1e-4  # shortest step, below which the minimiser takes over
TOUCHING = 1e-4  # scaled distance within which a contact closes if the energy presses on it
MOST = 600  # points of a path
GROWTH = 1.5

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Descent(Checked):
    """A path of steepest descent, and the certificate of its end.

    Attributes
    ----------
    points : (k, n) array
        From the start, or the nearest point of the polyhedron, to the minimum; coordinates on
        circles are not wrapped.  The energy decreases from each to the next.
    certificate : Certificate
        Of :func:`~polycorner.minimise` at the end; ``certificate.point`` is the last point, unless
        the polyhedron was not reached.
    """

    points: Array
    certificate: Certificate

    @property
    def lengths(self) -> Array:
        """Arc length of the path up to each point, ``(k,)``, in scale units."""
        scales = self.certificate.problem.scales
        steps = np.linalg.norm(np.diff(self.points, axis=0) / scales, axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])


@checked
def descent(
    polyhedron: "Polyhedron",
    energy: Any,
    start: ArrayLike,
    *,
    stride: float = STRIDE,
    most: int = MOST,
) -> Descent:
    """Return the path of steepest descent from ``start`` to a minimum.

    At every point the step is the negative gradient in scaled coordinates, projected on the cone
    of the contacts that are closed (``min |d + dE|`` over ``df_i d >= 0``, by non-negative least
    squares), followed by a projection on the polyhedron.  It is the overdamped motion of a body:
    contacts close one by one, and stay closed while the energy presses on them.  Close to the
    minimum :func:`~polycorner.minimise` takes over.

    Parameters
    ----------
    polyhedron : Polyhedron
        An intersection.
    energy : SmoothFunction or sympy.Expr
    start : (n,) array
        The start; outside the polyhedron, the path begins at a point of it nearby.
    stride : float, optional
        Longest step in scale units; a longer one may pass through thin bodies.
    most : int, optional
        Largest number of points.

    Raises
    ------
    ValueError
        For a polyhedron that is a union, or arguments that :func:`~polycorner.minimise` refuses.
    """
    real("stride", stride, above=0)
    if polyhedron.is_union:
        refuse("polyhedron", "an intersection", polyhedron)
    problem = pose(polyhedron, energy)
    q = polyhedron.manifold.point(start, "start")
    points = _steepest(problem, q, stride, most)
    certificate = minimise(polyhedron, energy, points[-1] if points else q)
    if not points:
        return Descent(q[None], certificate)
    last = points[-1] + polyhedron.manifold.difference(certificate.point, points[-1])
    if len(points) > 1 and np.linalg.norm((last - points[-1]) / problem.scales) < LEAST:
        points = points[:-1]
    return Descent(np.array([*points, last]), certificate)


def _steepest(problem: Problem, q: Array, stride: float, most: int) -> list[Array]:
    """Return the points of the path; none if the polyhedron is not reached."""
    everything, quotient = frozenset(range(problem.inequalities)), Quotient(problem.polyhedron)
    reached, nearby = problem.restore(everything, q)
    if not reached:
        found = approach(problem, everything, q)
        if not found.feasible:
            return []
        nearby = found.point
    q = nearby
    points, step = [q], stride
    height, way, pressed = _downhill(problem, q)
    while len(points) < most and step > LEAST:
        size = float(np.linalg.norm(way))
        if size <= LEAST:
            break
        ahead = q + step / size * way * problem.scales
        ahead = project(quotient, ahead, pressed.tolist()).point.q
        reached, trial = problem.restore(everything, ahead)
        lower, onward, held = _downhill(problem, trial)
        # A reversed direction means that the step overshot; contacts only deflect.
        if reached and lower < height and onward @ way >= 0:
            q, height, way, pressed = trial, lower, onward, held
            points.append(q)
            step = min(GROWTH * step, stride)
        else:
            step /= 2
    return points


def _downhill(problem: Problem, q: Array) -> tuple[float, Array, Indices]:
    """Return the energy, the direction of steepest descent, and the contacts that press.

    In scaled coordinates and fractions of the slope.  With ``dE = sum w_i df_i - d`` over closed
    contacts the weights are those of a least-squares fit with ``w_i >= 0``; then ``d`` is ``-dE``
    projected on the cone ``df_i d >= 0``, and contacts with positive weights stay closed along it.
    """
    from scipy.optimize import nnls

    values, gradients = problem.evaluate(q, 1)
    m, slope = problem.inequalities, gradients[-1]
    pull = slope / (float(np.linalg.norm(slope)) or 1.0)
    closed = np.flatnonzero(values[:m] <= TOUCHING * np.linalg.norm(gradients[:m], axis=1))
    if not len(closed):
        return float(values[-1]), -pull, closed
    rows = gradients[closed]
    weights, _ = nnls(rows.T, pull)
    return float(values[-1]), rows.T @ weights - pull, closed[weights > 0]
