"""Clusters of sticky hard spheres, or discs: rigid ones are corners, hinges edges; and of atoms.

``n`` spheres of unit diameter do not overlap: ``|x_i - x_j|^2 >= 1`` for every pair.  Modulo
congruence a rigid cluster is a corner of this polyhedron; breaking one contact opens a one-
dimensional motion, an edge, that ends where a new contact closes ([HC] sec. 2).  Clusters are
counted up to relabelling and mirror images.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner import checks
from polycorner.formulas import cache
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Relabelling, Symmetry
from polycorner.printing import Described
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

VARIABLES = ("x1", "y1", "z1", "x2", "y2", "z2")
PLANE = ("x1", "y1", "x2", "y2")


@lru_cache(maxsize=2)
def _gap(dimension: int) -> Family:
    """Return the gap of two spheres or discs of unit diameter, ``|x_2 - x_1|^2 - 1``."""
    key = cache.source_key(__name__)
    if dimension == 2:
        return Family(("gap",), PLANE, (), _in_plane, f"{key} in the plane", "diameter^2")
    return Family(("gap",), VARIABLES, (), _in_space, key, "diameter^2")


def _in_space() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    return {}, {"gap": _squared_distance(VARIABLES) - 1}


def _in_plane() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    return {}, {"gap": _squared_distance(PLANE) - 1}


def _squared_distance(names: tuple[str, ...]) -> "sympy.Expr":
    import sympy

    x = [sympy.Symbol(name, real=True) for name in names]
    d = len(x) // 2
    return sympy.Add(*[(b - a) ** 2 for a, b in zip(x[:d], x[d:], strict=True)])


@dataclass(frozen=True)
class SphereCluster(Checked, Described):
    """``n`` hard spheres of unit diameter in space, or discs in the plane.

    Coordinates are ``x1 y1 z1 ... xn yn zn``, in diameters; in the plane ``x1 y1 ... xn yn``.
    The contact of spheres ``i < j`` is called ``i-j``.

    Parameters
    ----------
    count : int
        Number of spheres, at least 2.
    dimension : int, optional
        3, or 2 for discs in the plane.

    Raises
    ------
    ValueError
        If ``count`` is no whole number above 1, or for other dimensions.
    """

    count: int
    dimension: int = 3

    def __post_init__(self) -> None:
        checks.whole("count", self.count, least=2)
        checks.whole("dimension", self.dimension, least=2, most=3)

    @cached_property
    def manifold(self) -> Manifold:
        """The product of one space for each sphere."""
        return Manifold.euclidean("x y z"[: 2 * self.dimension - 1], unit="diameter") ** self.count

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs of spheres, counted from 0, in the order of the functions."""
        return tuple(combinations(range(self.count), 2))

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """``|x_i - x_j|^2 - 1 >= 0`` for every pair."""
        gaps = []
        for i, j in self.pairs:
            d = self.dimension
            reads = [self.manifold.names[d * k + axis] for k in (i, j) for axis in range(d)]
            name = f"{i + 1}-{j + 1}"
            gaps.append(
                SmoothFunction.member(_gap(d), "gap", self.manifold, reads=reads, label=name)
            )
        return Polyhedron(self.manifold, AllOf(*gaps))

    @cached_property
    def symmetry(self) -> Symmetry:
        """Congruences, mirror images and relabellings."""
        return Symmetry(
            tangents=self._motions,
            invariants=self.distances,
            key=self._sorted_distances,
            relabel=self._relabellings,
            canonical=self._canonical,
        )

    def distances(self, q: ArrayLike) -> Array:
        """Return the distances of all pairs of centres, ``(..., n (n - 1) / 2)``."""
        points = self.manifold.points(q)
        centres = points.reshape(*points.shape[:-1], self.count, self.dimension)
        first, second = (list(side) for side in zip(*self.pairs, strict=True))
        return np.asarray(np.linalg.norm(centres[..., first, :] - centres[..., second, :], axis=-1))

    @checked
    def contacts(self, q: ArrayLike, *, tolerance: float = 1e-6) -> NDArray[np.bool_]:
        """Return the adjacency matrix ``(n, n)`` of touching spheres, as booleans."""
        touching = np.zeros((self.count, self.count), dtype=np.bool_)
        for (i, j), distance in zip(
            self.pairs, self.distances(self.manifold.point(q)), strict=True
        ):
            touching[i, j] = touching[j, i] = abs(distance - 1) <= tolerance
        return touching

    def stacked(self) -> Array:
        """Return a rigid cluster: a tetrahedron, and every further sphere in a hollow of three.

        For fewer than four spheres a triangle or a pair; of discs a strip of triangles.
        """
        if self.dimension == 2:
            k = np.arange(self.count)
            return np.stack([k / 2, math.sqrt(0.75) * (k % 2)], axis=1).ravel()
        centres = [np.zeros(3), np.array([1.0, 0, 0]), np.array([0.5, math.sqrt(0.75), 0])]
        taken: set[tuple[int, ...]] = set()
        while len(centres) < self.count:
            centres.append(_hollow(centres, taken))
        return np.concatenate(centres[: self.count])

    def starts(self) -> Array:
        """Return the start of a search, ``(1, 3 n)``: the stacked cluster."""
        return self.stacked()[None]

    def _sorted_distances(self, q: Array) -> Array:
        return np.sort(self.distances(q))

    def _motions(self, q: Array) -> Array:
        """Return the velocities of translations, and of rotations about the centroid."""
        return np.concatenate([self._translations, (self._rotations @ q).reshape(-1, len(q))])

    @cached_property
    def _translations(self) -> Array:
        return np.tile(np.eye(self.dimension), self.count)

    @cached_property
    def _rotations(self) -> Array:
        """The matrices of the rotations, stacked."""
        d, planes = self.dimension, [(1, 2), (2, 0), (0, 1)]
        planes = planes if d == 3 else planes[2:]
        motions = np.zeros((len(planes), d, d))
        for motion, (after, before) in zip(motions, planes, strict=True):
            motion[before, after], motion[after, before] = 1.0, -1.0
        centred = np.eye(self.count) - 1 / self.count
        return np.concatenate([np.kron(centred, motion) for motion in motions])

    def _matrix(self, q: Array) -> Array:
        matrix = np.zeros((self.count, self.count))
        first, second = (list(side) for side in zip(*self.pairs, strict=True))
        matrix[first, second] = matrix[second, first] = self.distances(q)
        return matrix

    def _relabellings(self, p: Array, q: Array, tolerance: float) -> list[Relabelling]:
        """Return all relabellings that carry the distances of ``p`` to those of ``q``."""
        labels = [f"{i + 1}-{j + 1}" for i, j in self.pairs]
        found: list[Relabelling] = []
        for image in _isometries(self._matrix(p), self._matrix(q), tolerance):
            targets = (sorted((image[i], image[j])) for i, j in self.pairs)
            names = (f"{i + 1}-{j + 1}" for i, j in targets)
            found.append(dict(zip(labels, names, strict=True)))
        return found

    def _canonical(self, contacts: frozenset[str]) -> frozenset[str]:
        """Return the contacts for a numbering of the spheres that does not depend on theirs."""
        beside: list[list[int]] = [[] for _ in range(self.count)]
        for name in contacts:
            i, j = (int(k) - 1 for k in name.split("-"))
            beside[i].append(j)
            beside[j].append(i)
        return frozenset(f"{i + 1}-{j + 1}" for i, j in _least_pairs(beside, [0] * self.count))


def _least_pairs(beside: list[list[int]], colours: list[int]) -> list[tuple[int, int]]:
    """Return the least pairs that numberings by colours make of those of a graph.

    Vertices are told apart by the colours of their neighbours, and where that ends by each of a
    class in turn.
    """
    n, classes = len(beside), 0
    while True:
        keys = [(colours[i], *sorted(colours[j] for j in beside[i])) for i in range(n)]
        ranks = {key: k for k, key in enumerate(sorted(set(keys)))}
        colours = [ranks[key] for key in keys]
        if len(ranks) == classes:
            break
        classes = len(ranks)
    if classes == n:
        return sorted(
            (a, b) for i, a in enumerate(colours) for j in beside[i] if (b := colours[j]) > a
        )
    several = min(colour for colour in colours if colours.count(colour) > 1)
    members = [i for i, colour in enumerate(colours) if colour == several]
    return min(
        _least_pairs(beside, [2 * colour - (i == one) for i, colour in enumerate(colours)])
        for one in members
    )


def _hollow(centres: list[Array], taken: set[tuple[int, ...]]) -> Array:
    """Return the first free point that touches three spheres.

    Triples without a free point are added to ``taken``: further spheres do not free one.
    """
    others = np.array(centres)
    for triple in combinations(range(len(centres)), 3):
        if triple in taken:
            continue
        taken.add(triple)
        a, b, c = others[list(triple)]
        u, v = b - a, c - a
        normal = np.cross(u, v)
        if np.linalg.norm(normal) < 1e-9:
            continue
        # The point x = a + s u + t v + h n at distance 1 from a, b and c.
        gram = np.array([[u @ u, u @ v], [u @ v, v @ v]])
        s, t = np.linalg.solve(gram, [u @ u / 2, v @ v / 2])
        foot = s * u + t * v
        if foot @ foot > 1:
            continue
        rise = math.sqrt(1 - foot @ foot) / np.linalg.norm(normal)
        for sign in (1, -1):
            place = a + foot + sign * rise * normal
            if np.linalg.norm(place - others, axis=1).min() > 1 - 1e-9:
                taken.discard(triple)
                return np.asarray(place)
    msg = "a cluster of spheres always has a free hollow"
    raise AssertionError(msg)


def _isometries(p: Array, q: Array, tolerance: float) -> list[tuple[int, ...]]:
    """Return all permutations ``s`` with ``|p_ij - q_s(i)s(j)| <= tolerance``, by backtracking."""
    n = len(p)
    rows_p, rows_q = np.sort(p, axis=1), np.sort(q, axis=1)
    alike = abs(rows_p[:, None] - rows_q[None]).max(axis=2) <= tolerance
    partial: list[tuple[int, ...]] = [()]
    for i in range(n):
        longer = []
        for image in partial:
            fits = alike[i].copy()
            fits[list(image)] = False
            if image:
                fits &= (abs(q[list(image)] - p[:i, i][:, None]) <= tolerance).all(axis=0)
            longer += [(*image, int(k)) for k in np.flatnonzero(fits)]
        partial = longer
    return partial


# -------------------------------------------------------------------------------- clusters of atoms

# ``E = 4 sum_{i<j} (r_ij^-12 - r_ij^-6)``, in units of the depth of the well of a pair and of the
# distance at which its energy vanishes. Congruent clusters, and those whose atoms are only
# exchanged, are one up to :attr:`LennardJones.symmetry`. Numbers of minima and saddles of up to
# nine atoms were listed by [DW].

SPREAD = 0.45  # standard deviation of coordinates at the start, over the cube root of the count


@lru_cache(maxsize=1)
def _pair() -> Family:
    key = repr((cache.source_key(__name__), "atoms"))
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
