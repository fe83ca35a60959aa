"""Small spheres about a corner, and what of a polyhedron lies on them."""

import numpy as np

from polycorner.formulas.bundles import Bundle
from polycorner.polyhedra.cones import unit_rows
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import EvaluatedPoint, Quotient
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array, Manifold

# Largest dimension of a quotient in which links are sampled.
SAMPLED = 3


class _Sliced(Bundle):
    """A bundle's functions, and those that vanish on a slice across an orbit and on a sphere."""

    def __init__(self, ambient: Bundle, centre: Array, scales: Array, across: Array) -> None:
        self.ambient, self.centre, self.scales, self.across = ambient, centre, scales, across

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values and derivatives at one point ``(n,)``."""
        u, n = (q - self.centre) / self.scales, len(q)
        values = np.append(self.across @ u, (u @ u - 1) / 2)
        slopes = np.vstack([self.across, u]) / self.scales
        bends = np.zeros((len(values), n, n))
        bends[-1] = np.diag(self.scales**-2)
        found = self.ambient.evaluate(q, order)
        return tuple(
            np.concatenate([part, more])
            for part, more in zip(found, (values, slopes, bends), strict=False)
        )


class Link(Polyhedron):
    """A polyhedron's intersection with a sphere about a point, orthogonal to the orbit there.

    Its scales are the radius, so that walks and tolerances shrink with it.

    Attributes
    ----------
    radius : float
        In scale units of the polyhedron.
    """

    def __init__(self, point: EvaluatedPoint, radius: float) -> None:
        base = point.quotient.polyhedron
        self.__setstate__(base.__getstate__())
        manifold = base.manifold
        self.radius = radius
        scales = radius * manifold.scale_array
        self.manifold = Manifold(manifold.names, scales=tuple(scales.tolist()))
        across = unit_rows(point.orbit)
        extra = [f"slice {k}" for k in range(len(across))]
        self.equation_names = (*base.equation_names, *extra, "sphere")
        self._sliced = _Sliced(base.bundle, point.q, scales, across)

    @property
    def is_large(self) -> bool:
        """Whether its faces are too many to cross: those of the corner suffice."""
        return len(self.manifold.names) - len(self.equation_names) >= SAMPLED

    @property
    def bundle(self) -> Bundle:
        """Inequalities first, equations after them, the sphere's last."""
        return self._sliced


def link_about(point: EvaluatedPoint, radius: float) -> Quotient:
    """Return the link of a corner for one radius, in scale units."""
    quotient, sphere = point.quotient, Link(point, radius)
    extra = range(len(point.values), quotient.count + len(sphere.equation_names))
    equations = (*quotient.equations, *extra)
    options = quotient.options
    return Quotient(
        sphere, Symmetry(), quotient.tolerances, options.link_extent, equations, options
    )
