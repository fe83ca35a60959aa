"""Equal hard disks on a flat torus, and their critical configurations.

Lengths are in units of the shortest lattice vector: the square torus has area 1, the hexagonal
one (a regular hexagon with opposite sides identified) has area ``sqrt(3)/2`` ([EM] sec. 2).
"""

from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.models.disks.configurations import CriticalConfiguration, coincide
from polycorner.models.disks.critical import CriticalSearch
from polycorner.models.disks.torus import IMAGES, OWN, Pairs, bound, gap, wrapped
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Described
from polycorner.progress import Progress
from polycorner.spaces.arguments import scalar
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property

Lattice = Literal["square", "hexagonal"]

COSINES = {"square": 0.0, "hexagonal": 0.5}


@dataclass(frozen=True)
class TorusDisks(Checked, Described):
    """``n`` equal disks on the torus ``R^2/L``.

    ::

        +-----------+        x_i, y_i: centre i is x_i a + y_i b in the lattice basis a, b;
        |  (1)      |        1-2(0,1): disk 1 touches the image of disk 2
        |       (2) |                  that is moved by 0 a + 1 b
        +-----------+

    A pair may touch through several images at once.  A disk touches its own image (contact
    ``own``) at the radius 1/2; two points of either torus have images closer than 1, so this
    matters for one disk only.

    Parameters
    ----------
    count : int
        The number ``n`` of disks, at least 1.
    lattice : {"square", "hexagonal"}, optional
        Basis vectors of length 1 at 90 (default) or 60 degrees.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> found = TorusDisks(2).critical(np.random.default_rng(0))
    >>> [(round(c.radius, 6), c.index) for c in found]
    [(0.353553, 0), (0.25, 1)]
    """

    count: int
    lattice: Lattice = "square"

    def __post_init__(self) -> None:
        object.__setattr__(self, "count", checks.whole("count", self.count, least=1))
        checks.choice("lattice", self.lattice, COSINES)

    @cached_property
    def basis(self) -> Array:
        """The lattice vectors ``a`` and ``b`` as rows, ``(2, 2)``."""
        cosine = COSINES[self.lattice]
        return np.array([[1.0, 0.0], [cosine, np.sqrt(1 - cosine**2)]])

    @cached_property
    def point_group(self) -> NDArray[np.intp]:
        """The lattice's symmetries that fix the origin, on lattice coordinates, ``(g, 2, 2)``.

        All integer matrices that preserve the lengths of ``a``, ``b`` and ``a + b``: 8 of them on
        the square torus, 12 on the hexagonal one.
        """
        gram = self.basis @ self.basis.T
        matrices = [np.array(m).reshape(2, 2) for m in product((-1, 0, 1), repeat=4)]
        return np.array([m for m in matrices if np.allclose(m.T @ gram @ m, gram)])

    @cached_property
    def manifold(self) -> Manifold:
        """The centres' lattice coordinates ``x1 y1 x2 ...``, circles of period 1, and ``r``."""
        names = [f"{axis}{i}" for i in range(1, self.count + 1) for axis in "xy"]
        periods = (1.0,) * len(names) + (np.inf,)
        scale = 0.5 / np.sqrt(self.count)
        n = len(periods)
        return Manifold((*names, "r"), periods, (scale,) * n, ("lattice vector",) * n)

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """Placements without overlap: ``|x_j - x_i + v| >= 2r`` for all pairs and images ``v``.

        A distance to one image is no function on the torus: moving a disk around a circle permutes
        the images.  The functions are smooth and complete where all coordinates lie within 0.6 of
        zero, so in the chart ``(-1/2, 1/2]`` of ``manifold.wrap`` and on its cut: nine images of
        each pair are all that can be nearest there.
        """
        own = SmoothFunction.member(bound(), OWN, self.manifold)
        return Polyhedron(self.manifold, AllOf(*self.gaps, own))

    @cached_property
    def energy(self) -> SmoothFunction:
        """``-r``, least where the disks are largest."""
        return SmoothFunction.member(bound(), "smallness", self.manifold)

    @cached_property
    def gaps(self) -> tuple[SmoothFunction, ...]:
        """The functions ``|x_j - x_i + v| - 2r`` of all pairs and images."""
        family, cosine = gap(), COSINES[self.lattice]
        return tuple(
            SmoothFunction.member(
                family,
                "gap",
                self.manifold,
                parameters=(p, q, cosine),
                reads=(f"x{i}", f"y{i}", f"x{j}", f"y{j}", "r"),
                label=name,
            )
            for name, (i, j, (p, q)) in self.ends.items()
            if name != OWN
        )

    @cached_property
    def ends(self) -> dict[str, tuple[int, int, tuple[int, int]]]:
        """The two disks of each contact, and the image of the second."""
        pairs = combinations(range(1, self.count + 1), 2)
        ends = {f"{i}-{j}({p},{q})": (i, j, (p, q)) for i, j in pairs for p, q in IMAGES}
        return {**ends, OWN: (1, 1, (1, 0))}

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the gaps, one for each pair and image."""
        return tuple(gap.name for gap in self.gaps)

    def fewer(self, count: int) -> "TorusDisks":
        """Return ``count`` disks on the same torus."""
        return replace(self, count=count)

    @cached_property
    def _bundle(self) -> Bundle:
        return Bundle(self.manifold, self.gaps)

    @checked
    def starts(self, rng: np.random.Generator, count: int) -> Array:
        """Return ``count`` random placements in the polyhedron, at half their largest radius."""
        points = rng.random((checks.whole("count", count, least=1), 2 * self.count + 1))
        points[:, -1] = self.radius(points) / 2
        return self.manifold.wrap(points)

    def centres(self, q: ArrayLike) -> Array:
        """Return the centres in the plane, ``(..., n, 2)``, for points ``(..., 2n + 1)``."""
        points = self.manifold.points(q)[..., :-1]
        return np.asarray(points.reshape(*points.shape[:-1], self.count, 2) @ self.basis)

    @checked
    def segment(self, q: ArrayLike, contact: str) -> Array:
        """Return the two centres, ``(2, 2)``, between which a contact lies."""
        if contact not in self.ends:
            checks.refuse("contact", f"one of {', '.join(self.polyhedron.names)}", contact)
        i, j, image = self.ends[contact]
        centres = self.centres(self.manifold.point(q))
        return np.stack([centres[i - 1], centres[j - 1] + np.array(image) @ self.basis])

    def radius(self, q: ArrayLike) -> Any:
        """Return the largest common radius of disks at the centres of ``q``, ``(...)``.

        The last coordinate of the points ``(..., 2n + 1)`` is not read.
        """
        points = self.manifold.wrap(q)
        outer = points.shape[:-1]
        (distances,) = self.distances(points[..., :-1].reshape(-1, 2 * self.count), 0)
        return scalar(np.minimum(distances.min(axis=1, initial=1.0), 1.0).reshape(outer) / 2)

    def distances(self, centres: Array, order: int) -> tuple[Array, ...]:
        """Return the distances of all pairs and images, and their derivatives by the centres.

        Parameters
        ----------
        centres : (B, 2n) array
            Lattice coordinates, anywhere.
        order : int
            0 for ``((B, m),)``, 1 to add gradients ``(B, m, 2n)``, 2 to add Hessians.
        """
        points = np.hstack([wrapped(centres), np.zeros((len(centres), 1))])
        distances, *derivatives = self._bundle.evaluate(points, order)
        last = 2 * self.count
        return (
            distances,
            *(d[:, :, :last] if d.ndim == 3 else d[:, :, :last, :last] for d in derivatives),
        )

    @cached_property
    def pairs(self) -> Pairs:
        """The same distances, grouped by pair, for batches."""
        return Pairs(self.count, COSINES[self.lattice])

    @checked
    def critical(
        self,
        rng: np.random.Generator | int | None = None,
        *,
        starts: int | None = None,
        progress: Progress | None = None,
    ) -> tuple[CriticalConfiguration, ...]:
        """Return the critical configurations of the largest common radius ``tau / 2``.

        ``tau`` is the least distance ``d_k`` over pairs and images.  A configuration is critical
        when the contacts carry a stress in equilibrium, ``lam_k >= 0``, ``sum lam_k = 1``,
        ``sum lam_k grad d_k = 0`` ([BBK]).  On the null space of the stressed gradients modulo
        translations, the Hessian of ``sum lam_k d_k`` is positive semidefinite, as distances are
        convex:

        ===========  ====================================================================
        ``index``    its rank: the number of independent directions along which ``tau``
                     grows to second order; 0 at a local maximum of the radius
        ``nullity``  the dimension of its kernel: components of the stressed contact
                     graph move as rigid bodies, two translations for each but one
        ===========  ====================================================================

        So ``index`` is the number of negative eigenvalues of a repulsive energy's Hessian
        ([EM] sec. 3), and the Morse-Bott index unless the configuration is ``degenerate``.  Where
        stresses are many, the one with the largest product is taken.

        Equal are configurations whose stressed components can be made to coincide by relabelling,
        one lattice symmetry, and a translation for each component; rattlers are anywhere.

        The search repeats until a round finds nothing new.  It is complete in practice, not by
        proof, for a handful of disks.  Configurations with rattlers are those of fewer disks
        with room for the others.

        Parameters
        ----------
        rng : Generator or int, optional
            Draws the starts; default a generator with seed 0.
        starts : int, optional
            Random starts of each round; default 80 for each disk.
        progress : callable, optional
            Called as ``progress(round, None, note)`` after every round, for 2 disks and more.

        Returns
        -------
        tuple of CriticalConfiguration
            The largest radius first; equal radii by index and nullity.
        """
        search = self.critical_search(rng, starts=starts)
        while not search.complete:
            search = search.advanced()
            if progress is not None:
                count = len(search.configurations)
                progress(search.rounds, None, f"{count} critical configurations")
        return search.configurations

    def critical_search(
        self, rng: np.random.Generator | int | None = None, *, starts: int | None = None
    ) -> CriticalSearch:
        """Return the search of :meth:`critical` before its first round, to be saved and resumed.

        Parameters
        ----------
        rng, starts
            As for :meth:`critical`.

        Examples
        --------
        >>> search = TorusDisks(2).critical_search(0)
        >>> while not search.complete:
        ...     search = CriticalSearch.restored(TorusDisks(2), search.advanced().record)
        >>> [round(c.radius, 6) for c in search.configurations]
        [0.353553, 0.25]
        """
        if starts is not None:
            checks.whole("starts", starts, least=1)
        first = 2 if self.count > 1 else 3
        return CriticalSearch(self, starts, checks.generator("rng", rng), disks=first)

    @checked
    def same(
        self,
        first: CriticalConfiguration,
        second: CriticalConfiguration,
        *,
        tolerance: float = DEFAULT.same,
    ) -> bool:
        """Whether two critical configurations are equal; see :meth:`critical`."""
        return coincide(self, first, second, tolerance)
