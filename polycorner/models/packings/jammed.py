"""Jammed packings: centres, contacts, forces, and what is computed from them."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import Group, SparseRows
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate, certify
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Described
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

AXES = "xyz"


@lru_cache(maxsize=2)
def gap(dimension: int) -> Family:
    """Return ``|x_2 - x_1 + v| - s sigma``: the gap of two bodies that are inflated by ``s``.

    ``sigma`` is the sum of their radii, ``v`` the vector of the box to the image that is meant.
    """
    from polycorner.formulas.cache import source_key

    axes = AXES[:dimension]
    variables = (*[f"{a}1" for a in axes], *[f"{a}2" for a in axes], "s")
    key = repr((source_key(__name__), dimension))
    parameters = (*[f"v{a}" for a in axes], "sigma")
    formulas = _plane if dimension == 2 else _space
    return Family(("gap",), variables, parameters, formulas, key, "length")


def _plane() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    return _formulas(AXES[:2])


def _space() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    return _formulas(AXES)


def _formulas(axes: str) -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    import sympy

    def symbol(name: str) -> "sympy.Symbol":
        return sympy.Symbol(name, real=True)

    squares = [(symbol(f"{a}2") - symbol(f"{a}1") + symbol(f"v{a}")) ** 2 for a in axes]
    distance = sympy.sqrt(sum(squares[1:], squares[0]))
    return {}, {"gap": distance - symbol("s") * symbol("sigma")}


def neighbours(
    centres: Array, radii: Array, inflation: float, box: float, reach: float
) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the pairs ``(m, 2)`` with gaps up to ``reach``, their images and their gaps.

    Of every pair the nearest image is taken; ``x_j - x_i + image`` is the vector between them.
    """
    tree = cKDTree(centres % box, boxsize=np.full(centres.shape[1], box))
    longest = min(2 * inflation * radii.max() + reach, box / 2)
    pairs = tree.query_pairs(longest, output_type="ndarray").astype(np.int64).reshape(-1, 2)
    between = centres[pairs[:, 1]] - centres[pairs[:, 0]]
    images = -box * np.round(between / box)
    gaps = np.linalg.norm(between + images, axis=1) - inflation * radii[pairs].sum(axis=1)
    near = gaps <= reach
    order = np.lexsort(pairs[near].T[::-1])
    return pairs[near][order], images[near][order], gaps[near][order]


def rows_of(
    pairs: NDArray[np.int64], images: Array, sums: Array, bodies: int, dimension: int
) -> SparseRows:
    """Return the gaps of pairs as functions of all centres and the inflation, in this order.

    ``sums`` are those of the two radii of each pair.
    """
    places = pairs[:, :, None] * dimension + np.arange(dimension)
    n = bodies * dimension + 1
    reads = np.column_stack([places.reshape(len(pairs), 2 * dimension), np.full(len(pairs), n - 1)])
    parameters = np.column_stack([images, sums])
    group = Group.separate(gap(dimension), reads, parameters)
    return SparseRows((group,) if len(pairs) else (), len(pairs), n)


def gaps_polyhedron(
    radii: Array, box: float, centres: Array, inflation: float, held: int, reach: float = 0.5
) -> Polyhedron:
    """Return the gaps of pairs up to ``reach`` mean diameters apart, as functions of a manifold.

    The equations hold one body in place, since a translation of all changes nothing.
    """
    count, d = centres.shape
    diameter = float(2 * inflation * radii.mean())
    names = [f"{a}{i}" for i in range(1, count + 1) for a in AXES[:d]]
    manifold = Manifold(
        (*names, "s"),
        scales=(*[diameter] * (count * d), inflation),
    )
    pairs, images, _ = neighbours(centres, radii, inflation, box, reach * diameter)
    parts = []
    for (i, j), image in zip(pairs.tolist(), images.tolist(), strict=True):
        reads = [*names[i * d : (i + 1) * d], *names[j * d : (j + 1) * d], "s"]
        parameters = [*image, float(radii[i] + radii[j])]
        label = f"{i + 1}-{j + 1}"
        parts.append(
            SmoothFunction.member(
                gap(d), "gap", manifold, parameters=parameters, reads=reads, label=label
            )
        )
    symbols = manifold.symbols[held * d : (held + 1) * d]
    pins = {
        f"hold {names[held * d + axis]}": symbol - float(centres[held, axis])
        for axis, symbol in enumerate(symbols)
    }
    return Polyhedron(manifold, AllOf(*parts), pins)


@dataclass(frozen=True)
class PackingResiduals:
    """Deviations from the conditions of a jammed packing; all dimensionless.

    Attributes
    ----------
    overlap : float
        Deepest overlap of any two bodies, in mean diameters.
    contact : float
        Largest ``|gap|`` of a contact that carries force, in mean diameters.
    balance : float
        Largest component of the sum of forces on a body, relative to the mean force.
    normalisation : float
        ``|sum f_ij (r_i + r_j) - 1|``: the multipliers' condition for the inflation.
    """

    overlap: float
    contact: float
    balance: float
    normalisation: float

    @property
    def worst(self) -> float:
        """The largest of them."""
        return max(self.overlap, self.contact, self.balance, self.normalisation)


@dataclass(frozen=True, eq=False)
class JammedPacking(Checked, Described):
    """A packing at a maximum of the inflation, with its contacts and forces.

    Attributes
    ----------
    radii : (N,) array
        Radii before the inflation.
    box : float
        Edge of the periodic box.
    centres : (N, d) array
        Not wrapped into the box.
    inflation : float
        ``s``: the bodies' radii are ``s radii``.
    pairs : (m, 2) array of int
        The contacts that carry force, ``i < j``.
    images : (m, d) array
        ``x_j - x_i + image`` is the vector of the contact.
    forces : (m,) array
        The multipliers: ``f = dE/dgap`` for ``E = -s``, so that ``sum f (r_i + r_j) = 1``.
    programmes : int
        Number of linear programmes solved.
    converged : bool
        Whether the chain ended at a corner.
    """

    radii: Array
    box: float
    centres: Array
    inflation: float
    pairs: NDArray[np.int64]
    images: Array
    forces: Array
    programmes: int
    converged: bool

    @property
    def count(self) -> int:
        """The number of bodies ``N``."""
        return len(self.radii)

    @property
    def dimension(self) -> int:
        """``d``."""
        return int(self.centres.shape[1])

    @property
    def density(self) -> float:
        """The part of the box that the bodies fill."""
        ball = math.pi if self.dimension == 2 else 4 * math.pi / 3
        filled = ball * ((self.inflation * self.radii) ** self.dimension).sum()
        return float(filled / self.box**self.dimension)

    @property
    def diameter(self) -> float:
        """The mean diameter."""
        return float(2 * self.inflation * self.radii.mean())

    @cached_property
    def degrees(self) -> NDArray[np.int64]:
        """The number of contacts of each body, ``(N,)``."""
        return np.bincount(self.pairs.ravel(), minlength=self.count)

    @cached_property
    def rattlers(self) -> NDArray[np.int64]:
        """The bodies that carry no force."""
        return np.flatnonzero(self.degrees == 0)

    @property
    def isostatic_number(self) -> int:
        """``d (N' - 1) + 1``, the contacts that fix ``N'`` bodies without rattlers."""
        return self.dimension * (self.count - len(self.rattlers) - 1) + 1

    @property
    def is_isostatic(self) -> bool:
        """Whether there are as many contacts as fix the bodies: one state of self-stress."""
        return len(self.pairs) == self.isostatic_number

    @property
    def coordination(self) -> float:
        """The mean number of contacts of a body that carries force."""
        return 2 * len(self.pairs) / max(self.count - len(self.rattlers), 1)

    @cached_property
    def vectors(self) -> Array:
        """The vectors ``x_j - x_i`` of the contacts, ``(m, d)``."""
        return self.centres[self.pairs[:, 1]] - self.centres[self.pairs[:, 0]] + self.images

    @checked
    def near_gaps(self, reach: float = 0.1) -> tuple[NDArray[np.int64], Array]:
        """Return pairs that do not carry force, with gaps up to ``reach`` mean diameters.

        Gaps ``(k,)`` are in mean diameters; pairs with rattlers are left out.
        """
        pairs, _, gaps = neighbours(
            self.centres, self.radii, self.inflation, self.box, reach * self.diameter
        )
        held = {tuple(pair) for pair in self.pairs.tolist()}
        moving = set(self.rattlers.tolist())
        keep = [
            tuple(pair) not in held and not moving.intersection(pair) for pair in pairs.tolist()
        ]
        return pairs[keep], gaps[keep] / self.diameter

    @cached_property
    def residuals(self) -> PackingResiduals:
        """The residuals, recomputed from centres and forces."""
        _, _, gaps = neighbours(
            self.centres, self.radii, self.inflation, self.box, 0.01 * self.diameter
        )
        lengths = np.linalg.norm(self.vectors, axis=1)
        sums = self.radii[self.pairs].sum(axis=1)
        pushes = self.forces[:, None] * self.vectors / lengths[:, None]
        total = np.zeros_like(self.centres)
        np.add.at(total, self.pairs[:, 1], pushes)
        np.subtract.at(total, self.pairs[:, 0], pushes)
        mean = float(self.forces.mean()) if len(self.forces) else 1.0
        touching = abs(lengths - self.inflation * sums).max(initial=0.0)
        return PackingResiduals(
            overlap=float(max(0.0, -gaps.min(initial=0.0)) / self.diameter),
            contact=float(touching / self.diameter),
            balance=float(abs(total).max() / mean),
            normalisation=float(abs(self.forces @ sums - 1)),
        )

    @property
    def verdict(self) -> Verdict:
        """The verdict on the inflation as a local maximum.

        As many contacts as coordinates, with independent gradients and positive forces, make a
        strict local maximum to first order; rattlers are free.
        """
        if not self.converged:
            return Verdict.NOT_CONVERGED
        return Verdict.MINIMUM_ALONG_LOCUS if len(self.rattlers) else Verdict.STRICT_MINIMUM

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The gaps of all pairs near one another, one body that carries force held in place.

        Coordinates are ``x1 y1 ... xN yN s``; gaps are called ``i-j``, bodies counted from 1.
        A polyhedron of more functions is the same near the packing.
        """
        return gaps_polyhedron(
            self.radii, self.box, self.centres, self.inflation, int(self.pairs[0, 0])
        )

    @property
    def energy(self) -> "sympy.Expr":
        """``-s``."""
        return -self.polyhedron.manifold.symbols[-1]

    @property
    def point(self) -> Array:
        """The packing as a point of its polyhedron, ``(d N + 1,)``."""
        return np.append(self.centres.ravel(), self.inflation)

    @cached_property
    def certificate(self) -> Certificate:
        """The certificate of the packing as a minimum of ``-s``, computed anew by ``certify``."""
        return certify(self.polyhedron, self.energy, self.point)

    def __repr__(self) -> str:
        """Return numbers, density and verdict in one line."""
        return (
            f"JammedPacking({self.count} bodies in {self.dimension} dimensions, density "
            f"{self.density:.6f}, {len(self.pairs)} contacts, {len(self.rattlers)} rattlers; "
            f"{self.verdict.name})"
        )
