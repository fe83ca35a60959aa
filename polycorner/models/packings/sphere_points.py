"""Points on the sphere: far from one another, or with a low energy of repulsion."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.models.packings.regions import family, symbols
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Described
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    from polycorner.models.packings.regions import Formulas

ENDS = ("x1", "y1", "z1", "x2", "y2", "z2")
SHAKES = (0.05, 0.2, 0.5, 1.0)  # of all points, in mean distances


@dataclass(frozen=True)
class PointsOnSphere(Checked, Described):
    """``n`` points of the unit sphere, as unit vectors ``(x_i, y_i, z_i)``.

    ============  ==============================================================================
    ``problem``   what is minimised
    ============  ==============================================================================
    ``tammes``    ``c``, with ``c - x_i . x_j >= 0`` for all pairs ``i-j``: the largest cosine of
                  an angle between two of them; circles of the radius ``arccos(c) / 2`` about
                  the points do not overlap
    ``thomson``   ``sum 1 / |x_j - x_i|``: the electrostatic energy of equal charges
    ============  ==============================================================================

    Parameters
    ----------
    count : int
        The number ``n`` of points, at least 2.
    problem : {"tammes", "thomson"}

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> model = PointsOnSphere(4, "tammes")
    >>> q = model.point([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    >>> round(float(model.energy.value(q)), 6)
    -0.333333
    """

    count: int
    problem: Literal["tammes", "thomson"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", checks.whole("count", self.count, least=2))
        checks.choice("problem", self.problem, ("tammes", "thomson"))

    @cached_property
    def manifold(self) -> Manifold:
        """The product of ``n`` spheres, and a line of ``c`` for ``"tammes"``."""
        scale = self._apart / 2
        whole = Manifold.sphere("x1 y1 z1", scale=scale)
        for i in range(2, self.count + 1):
            whole = whole * Manifold.sphere(f"x{i} y{i} z{i}", scale=scale)
        return whole * Manifold.euclidean("c", scale=scale) if self._packs else whole

    @property
    def _apart(self) -> float:
        """The distance of neighbours in a dense arrangement, roughly."""
        return float(np.sqrt(4 * np.pi / self.count))

    @property
    def _packs(self) -> bool:
        return self.problem == "tammes"

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """``c - x_i . x_j >= 0`` for all pairs, or all arrangements."""
        parts = self._of_pairs(_cosine(), ("c",)) if self._packs else []
        return Polyhedron(self.manifold, AllOf(*parts))

    @cached_property
    def energy(self) -> SmoothFunction:
        """``c``, or the sum of the inverse distances."""
        if self._packs:
            return SmoothFunction.member(_largest(), "largest cosine", self.manifold, reads=("c",))
        return SmoothFunction.sum("energy", self._of_pairs(_repulsion(), ()))

    def _of_pairs(self, functions: Family, more: tuple[str, ...]) -> list[SmoothFunction]:
        return [
            SmoothFunction.member(
                functions,
                functions.names[0],
                self.manifold,
                reads=(*[f"{axis}{k}" for k in pair for axis in "xyz"], *more),
                label=f"{pair[0]}-{pair[1]}",
            )
            for pair in combinations(range(1, self.count + 1), 2)
        ]

    @cached_property
    def symmetry(self) -> Symmetry:
        """Rotations about the three axes, as vector fields."""
        x = dict(zip(self.manifold.names, self.manifold.symbols, strict=True))
        fields = []
        for a, b in ("xy", "yz", "zx"):
            each = range(1, self.count + 1)
            fields.append(
                {f"{a}{i}": -x[f"{b}{i}"] for i in each} | {f"{b}{i}": x[f"{a}{i}"] for i in each}
            )
        return Symmetry(fields=fields)

    @checked
    def starts(self, rng: "np.random.Generator | int | None", count: int) -> Array:
        """Return ``count`` points with uniform vectors."""
        rng = checks.generator("rng", rng)
        several = checks.whole("count", count, least=1)
        vectors = rng.standard_normal((several, self.count, 3))
        return np.array([self.point(part) for part in vectors])

    @checked
    def point(self, vectors: ArrayLike) -> Array:
        """Return the point of given vectors ``(n, 3)``, of any length but zero, such as a table's.

        For ``"tammes"`` with the largest cosine of two of them.
        """
        expected = f"finite vectors of shape ({self.count}, 3), none of them zero"
        given = checks.numbers("vectors", vectors, expected)
        lengths = np.sqrt((given**2).sum(axis=-1)) if given.ndim else given
        if given.shape != (self.count, 3) or not np.isfinite(given).all() or not lengths.all():
            checks.refuse("vectors", expected, vectors)
        unit = given / lengths[:, None]
        i, j = np.triu_indices(self.count, 1)
        most = [(unit[i] * unit[j]).sum(axis=1).max()] if self._packs else []
        return np.concatenate([unit.ravel(), most])

    def vectors(self, q: ArrayLike) -> Array:
        """Return the unit vectors of one point, ``(n, 3)``."""
        return self.manifold.point(q)[: 3 * self.count].reshape(-1, 3)

    def repaired(self, q: ArrayLike) -> Array:
        """Return the same vectors with their largest cosine."""
        return self.point(self.vectors(q))

    def moved(self, q: ArrayLike, rng: "np.random.Generator | int | None" = None) -> Array:
        """Return ``q`` with all vectors shaken, or one put elsewhere."""
        vectors, rng = self.vectors(q).copy(), checks.generator("rng", rng)
        if rng.random() < 0.5:
            vectors[rng.integers(self.count)] = rng.standard_normal(3)
        width = self._apart * rng.choice(SHAKES)
        return self.point(vectors + width * rng.standard_normal(vectors.shape))


@lru_cache(maxsize=1)
def _cosine() -> Family:
    return family(("gap",), (*ENDS, "c"), (), _cosine_formula)


@lru_cache(maxsize=1)
def _largest() -> Family:
    return family(("largest cosine",), ("c",), (), _largest_formula)


@lru_cache(maxsize=1)
def _repulsion() -> Family:
    return family(("repulsion",), ENDS, (), _repulsion_formula)


def _cosine_formula() -> "Formulas":
    x1, y1, z1, x2, y2, z2, c = symbols(" ".join((*ENDS, "c")))
    return {}, {"gap": c - x1 * x2 - y1 * y2 - z1 * z2}


def _largest_formula() -> "Formulas":
    (c,) = symbols("c")
    return {}, {"largest cosine": c}


def _repulsion_formula() -> "Formulas":
    import sympy

    x1, y1, z1, x2, y2, z2 = symbols(" ".join(ENDS))
    square = (x2 - x1) ** 2 + (y2 - y1) ** 2 + (z2 - z1) ** 2
    return {}, {"repulsion": 1 / sympy.sqrt(square)}
