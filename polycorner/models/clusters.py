"""Clusters of atoms that attract each other, with the potential of Lennard-Jones.

``E = 4 sum_{i<j} (r_ij^-12 - r_ij^-6)``, in units of the depth of the well of a pair and of the
distance at which its energy vanishes.  Congruent clusters, and those whose atoms are only
exchanged, are one up to :attr:`LennardJones.symmetry`.  Numbers of minima and saddles of up to nine
atoms were listed by [DW].
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from polycorner import checks
from polycorner.formulas import cache
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.models.spheres import VARIABLES, SphereCluster
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Described
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

SPREAD = 0.45  # standard deviation of coordinates at the start, over the cube root of the count


@lru_cache(maxsize=1)
def _pair() -> Family:
    key = cache.source_key(__name__)
    return Family(("energy",), VARIABLES, (), _formulas, key, "depth of a pair")


def _formulas() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    import sympy

    x1, y1, z1, x2, y2, z2 = (sympy.Symbol(name, real=True) for name in VARIABLES)
    square = (x2 - x1) ** 2 + (y2 - y1) ** 2 + (z2 - z1) ** 2
    return {}, {
        "energy": 4 * (square**-6 - square**-3),
    }


@dataclass(frozen=True)
class LennardJones(Checked, Described):
    """Atoms in space with the potential of Lennard-Jones.

    Coordinates are ``x1 y1 z1 ... xn yn zn``.  The only inequality, ``extent``, bounds the radius
    of gyration, so that no atom is lost: ``extent^2 - sum_{i<j} r_ij^2 / n^2 >= 0``.  Where it is
    active atoms attract each other, so that nothing rests there.

    Parameters
    ----------
    count : int
        Number of atoms, at least 2.
    extent : float, optional
        The largest radius of gyration.

    Raises
    ------
    TypeError, ValueError
        For a count that is no whole number above 1, or an extent that is not positive.
    """

    count: int
    extent: float = 2.0

    def __post_init__(self) -> None:
        checks.whole("count", self.count, least=2)
        checks.real("extent", self.extent, above=0)

    @cached_property
    def _spheres(self) -> SphereCluster:
        return SphereCluster(self.count)

    @property
    def manifold(self) -> Manifold:
        """The product of one space for each atom."""
        return self._spheres.manifold

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """Clusters of a radius of gyration of at most ``extent``."""
        x = np.array(self.manifold.symbols).reshape(-1, 3)
        squares = ((x - x.sum(axis=0) / self.count) ** 2).sum() / self.count
        return Polyhedron(self.manifold, {"extent": self.extent**2 - squares})

    @cached_property
    def energy(self) -> SmoothFunction:
        """The sum over all pairs."""
        names = np.array(self.manifold.names).reshape(-1, 3)
        terms = [
            SmoothFunction.member(
                _pair(),
                "energy",
                self.manifold,
                reads=[*names[i], *names[j]],
                label=f"{i + 1}-{j + 1}",
            )
            for i, j in self._spheres.pairs
        ]
        return SmoothFunction.sum("energy", terms)

    @property
    def symmetry(self) -> Symmetry:
        """Congruences, mirror images and exchanges of atoms."""
        return self._spheres.symmetry

    def starts(self, rng: np.random.Generator | int | None, count: int) -> Array:
        """Return ``count`` random clusters, ``(count, 3 n)``, atoms normally distributed.

        Every fourth is in a plane, which what moves by its energy alone does not leave: saddles
        that are plane attract hardly anything else.
        """
        generator = checks.generator("rng", rng)
        size = (checks.whole("count", count, least=1, most=checks.MOST), self.count, 3)
        found = generator.normal(scale=SPREAD * np.cbrt(self.count), size=size)
        found[::4, :, 2] = 0.0
        return np.asarray(found.reshape(count, -1))
