"""Steepest descent inside a polyhedron, contact by contact."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.minimisation import Certificate, minimise
from polycorner.toolkit import Array, Checked, checked, pose, real, steepest

if TYPE_CHECKING:
    from polycorner.polyhedra import Polyhedron

STRIDE = 0.15  # longest step of a path, in scale units
LEAST = 1e-4  # length of a last step that is not worth a point of its own
MOST = 600  # points of a path


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

    At every point the step is the negative gradient in scaled coordinates, as far as the contacts
    allow it.  It is the overdamped motion of a body: contacts close one by one, and stay closed
    while the energy presses on them.  Close to the minimum :func:`~polycorner.minimise` takes over.

    Parameters
    ----------
    polyhedron : Polyhedron
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
        For arguments that :func:`~polycorner.minimise` refuses.
    """
    real("stride", stride, above=0)
    problem = pose(polyhedron, energy)
    q = polyhedron.manifold.point(start, "start")
    points = steepest(problem, q, stride, most)
    certificate = minimise(polyhedron, energy, points[-1] if points else q)
    if not points:
        return Descent(q[None], certificate)
    last = points[-1] + polyhedron.manifold.difference(certificate.point, points[-1])
    if len(points) > 1 and np.linalg.norm((last - points[-1]) / problem.scales) < LEAST:
        points = points[:-1]
    return Descent(np.array([*points, last]), certificate)
