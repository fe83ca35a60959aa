"""Paths inside a polyhedron, and bounds of the energy along them."""

from dataclasses import dataclass

from polycorner.spaces.manifold import Array
from polycorner.values import Checked


@dataclass(frozen=True, eq=False)
class Route(Checked):
    """A polyline on a manifold.

    Attributes
    ----------
    vertices : (k, n) array
        Its vertices, in the order of the way.  Angles are not wrapped: neighbours are joined by
        the straight line between them.
    energies : (k,) array
        The energy at the vertices.
    top : float
        An upper bound of the energy along it; of a route that is not verified, the largest value
        at a vertex.
    verified : bool
        Whether it is proved that a path near the polyline lies in the set and below ``top``: the
        polyline itself in the midst, curves along walls at passes and minima, and along equations.
    """

    vertices: Array
    energies: Array
    top: float
    verified: bool

    def __repr__(self) -> str:
        """Return the number of vertices and the top."""
        how = "verified" if self.verified else "not verified"
        return f"Route({len(self.vertices)} vertices, top {self.top:.6g}, {how})"
