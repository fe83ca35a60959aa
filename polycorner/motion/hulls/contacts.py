"""Contacts between two bodies of sharp hulls, as tables of the compiled code."""

import ctypes
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from polycorner.formulas.kernels import address
from polycorner.motion.bodies import PairContacts, PairLaw
from polycorner.motion.hulls.intermediate import NAMES, SHIPPED
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Hull(Value):
    """A sharp polygon or polyhedron of a body, in coordinates of the body.

    Attributes
    ----------
    name : str
    vertices : (k, d) array
    normals : (f, d) array
        Unit vectors out of its faces; in the plane, its edges.
    on : (f,) array of int
        A vertex of each face.
    edges : tuple of (int, int, int, int)
        Two vertices of each edge, and the faces beside it; in the plane none.
    """

    name: str
    vertices: Array
    normals: Array
    on: Array
    edges: tuple[tuple[int, int, int, int], ...]

    @property
    def numbers(self) -> list[float]:
        """The entries of a part in a table; see ``geometry.py``."""
        points, normals = (_padded(a) for a in (self.vertices, self.normals))
        levels = np.einsum("fc,fc->f", normals, points[self.on])
        widths = [np.ptp(points @ normal) for normal in normals]
        centre = points.mean(axis=0)
        edges = [
            [points[i], points[j] - points[i], normals[left], normals[right]]
            for i, j, left, right in self.edges
        ]
        shape = [len(points), len(normals), len(edges), *centre, min(widths) / 2]
        parts = [shape, points, np.column_stack([normals, levels]), np.array(edges)]
        return [float(x) for part in parts for x in np.ravel(part)]

    def touches(self, other: "Hull") -> list[str]:
        """Return the names of the contacts of two hulls, in the order of ``gaps.py``."""
        found = [f"{other.name}.v{i + 1}-{self.name}" for i in range(len(other.vertices))]
        found += [f"{self.name}.v{i + 1}-{other.name}" for i in range(len(self.vertices))]
        pairs = [(i, j) for i in range(len(self.edges)) for j in range(len(other.edges))]
        return found + [f"{self.name}.e{i + 1}-{other.name}.e{j + 1}" for i, j in pairs]


def _padded(vectors: Array) -> Array:
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


class Machine(NamedTuple):
    """What callers look for in machine code: its address."""

    point: int


class HullKernel:
    """Gaps, or slips, of two hulls as a kernel: what a table says is a parameter."""

    def __init__(self, key: str, names: tuple[str, str], variables: int, outputs: int) -> None:
        self.key, self.variables, self.outputs, self._names = key, variables, outputs, names

    def compiled(self, order: int) -> Machine:
        """Return the machine code for derivatives up to an order, 0 or 1."""
        return Machine(SHIPPED.addresses[NAMES.index(self._names[order])])

    def at(self, q: Array, parameters: int, _: int = 0) -> tuple[Array]:
        """Return the values ``(m,)`` at one point; see :meth:`Kernel.at`."""
        found, q = np.empty(self.outputs), np.array(q, dtype=np.float64)
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5)(self.compiled(0).point)
        call(address(q), parameters, address(found), None, None)
        return (found,)


@dataclass(frozen=True, eq=False)
class HullFamily(Value):
    """Functions of two bodies that are no formulas, in the place of a family of formulas.

    Attributes
    ----------
    names, variables : tuple of str
    key : str
        Identifies them between processes, with all numbers.
    kernel : HullKernel
    """

    names: tuple[str, ...]
    variables: tuple[str, ...]
    key: str
    kernel: HullKernel


@dataclass(frozen=True, eq=False)
class HullContacts(Value):
    """The contacts between any two of several bodies of sharp hulls.

    Attributes
    ----------
    pairs : sequence of (Hull, Hull)
        The parts of two bodies that may touch.
    coordinates : (int, int)
        How many coordinates either body has: 2 or 3 in the plane, 3 or 7 in space, 0 if it is
        fixed.
    through, zero : float
        Height up to which a plane passes through two hulls, and length that is none.
    periods : sequence of float
        After which positions repeat; infinite if they do not.
    reach, position, restitution
        As in :class:`~polycorner.motion.ContactFamily`.
    laws : tuple of PairLaw
        Of dry friction.
    """

    pairs: Sequence[tuple[Hull, Hull]]
    coordinates: tuple[int, int]
    through: float
    zero: float
    periods: Sequence[float]
    reach: float
    position: tuple[str, ...]
    laws: tuple[PairLaw, ...] = ()
    restitution: float = 0.0

    @property
    def dimension(self) -> int:
        """The dimension of space."""
        return int(self.pairs[0][0].vertices.shape[1])

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the contacts."""
        return tuple(name for one, two in self.pairs for name in one.touches(two))

    @property
    def table(self) -> list[float]:
        """The entries of the table; see ``geometry.py``."""
        periods = [p if np.isfinite(p) else 0.0 for p in (*self.periods, np.inf, np.inf)[:3]]
        head = [
            *self.coordinates,
            self.through,
            self.zero,
            *periods,
            self.dimension,
            len(self.pairs),
        ]
        places: dict[int, int] = {}
        parts: list[float] = []
        first, listed = len(head) + 3 * len(self.pairs), []
        contacts = 0
        for pair in self.pairs:
            for hull in pair:
                if id(hull) not in places:
                    places[id(hull)] = first + len(parts)
                    parts += hull.numbers
            one, two = pair
            listed += [places[id(one)], places[id(two)], contacts]
            contacts += len(one.touches(two))
        return [*map(float, [*head, *listed]), *parts]

    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""
        laws = [[str(law.static), str(law.dynamic), law.cause] for law in self.laws]
        return {
            "hulls": self.table,
            "friction between bodies": laws,
            "restitution between bodies": self.restitution,
            "reach": self.reach,
        }

    def compiled(self, manifold: Manifold, other: Manifold | None = None) -> PairContacts:
        """Return the compiled contacts of bodies with coordinates on a manifold, or on two."""
        table, names, both = self.table, self.names, (manifold, other or manifold)
        n = sum(one.size for one in both)
        digest = hashlib.sha256(np.array(table).tobytes()).hexdigest()
        variables = tuple(f"{x}{k}" for k, one in enumerate(both, 1) for x in one.names)
        kernel = HullKernel(f"hulls {digest}", ("values", "gradients"), n, len(names))
        gaps = HullFamily(names, variables, kernel.key, kernel)
        slips = ()
        if self.laws:
            rows = tuple(f"s{i}" for i in range(self.dimension - 1))
            slip = HullKernel("slips of hulls", ("slips", "slips"), 2 * n, len(rows))
            family = HullFamily(
                rows, (*variables, *(f"{x}_dot" for x in variables)), slip.key, slip
            )
            # The table stands before the entries, of two numbers each.
            back = len(table)
            slips = tuple(
                (family, False, (float(g), float(back + 2 * g))) for g in range(len(names))
            )
        return PairContacts(
            gaps,  # type: ignore[arg-type]  # what is asked of a family, it has
            tuple(table),
            tuple((body, c) for body, one in enumerate(both) for c in range(one.size)),
            slips,  # type: ignore[arg-type]
            self.laws,
            self.restitution,
            self.reach,
        )
