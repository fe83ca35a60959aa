"""Contacts between two bodies of sharp hulls, as tables of the compiled code."""

import ctypes
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner.formulas.bundles import Call
from polycorner.formulas.kernels import address
from polycorner.motion.bodies import FrictionContact, PairContacts, PairLaw
from polycorner.motion.contacts import ContactFamily
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.hulls.intermediate import NAMES, SHIPPED
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value, cached_property


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
        parts = [np.array(shape), points, np.column_stack([normals, levels]), np.array(edges)]
        return [*map(float, np.concatenate([part.ravel() for part in parts]))]

    def touches(self, other: "Hull") -> list[str]:
        """Return the names of the contacts of two hulls, in the order of ``gaps.py``."""
        found = [f"{other.name}.v{i + 1}-{self.name}" for i in range(len(other.vertices))]
        found += [f"{self.name}.v{i + 1}-{other.name}" for i in range(len(self.vertices))]
        pairs = [(i, j) for i in range(len(self.edges)) for j in range(len(other.edges))]
        return found + [f"{self.name}.e{i + 1}-{other.name}.e{j + 1}" for i, j in pairs]


def _padded(vectors: Array) -> Array:
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def _placed(vertices: Array, q: Array) -> Array:
    """Return vertices of a body with the coordinates ``q``, none if it is fixed, in space."""
    d = vertices.shape[1]
    origin, turned = q[:d], q[d:]
    if len(turned) == 1:
        (cosine,), (sine,) = np.cos(turned), np.sin(turned)
        vertices = vertices @ np.array([[cosine, sine], [-sine, cosine]])
    elif len(turned):
        vertices = vertices @ Rotation.from_quat(turned[[1, 2, 3, 0]]).as_matrix().T
    return vertices + origin if len(q) else vertices


VALUES = 9  # entry of a table for the address of formulas; that of their gradients follows


class Machine(NamedTuple):
    """What callers look for in machine code: its address."""

    point: int


class HullKernel:
    """Gaps, or slips, of two hulls as a kernel: what a table says is a parameter."""

    def __init__(self, key: str, names: tuple[str, str], variables: int, outputs: int) -> None:
        self.key, self.variables, self.outputs, self._names = key, variables, outputs, names
        self.calls: Any = None

    def compiled(self, order: int) -> Machine:
        """Return the machine code for derivatives up to an order, 0 or 1."""
        return Machine(SHIPPED.addresses[NAMES.index(self._names[order])])

    def at(self, q: Array, parameters: int, _: int = 0) -> tuple[Array]:
        """Return the values ``(m,)`` at one point; see :meth:`Kernel.at`."""
        found, q = np.empty(self.outputs), np.array(q, dtype=np.float64)
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5)(self.compiled(0).point)
        call(address(q), parameters, address(found), None, None)
        return (found,)

    def over(self, points: Array, parameters: int, _: int = 0) -> tuple[Array]:
        """Return the values ``(k, m)`` at several points; see :meth:`Kernel.over`."""
        found = [self.at(q, parameters)[0] for q in points]
        return (np.array(found).reshape(len(points), self.outputs),)


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
    """The contacts between any two of several bodies of sharp hulls, or of two in one system.

    Attributes
    ----------
    pairs : sequence of (Hull, Hull)
        The parts of two bodies that may touch.
    coordinates : (int, int)
        How many coordinates either body has: 2 or 3 in the plane, 3 or 7 in space, 0 if it is
        fixed.
    lengths : (float, float)
        Height up to which a plane passes through two hulls, and length that is none.
    reads : tuple of str
        The coordinates of both.
    periods : sequence of float, optional
        After which positions repeat; infinite if they do not.
    reach, position, restitution : optional
        Of bodies that are repeated, as in :class:`~polycorner.motion.ContactFamily`.
    laws : tuple of PairLaw, optional
        Of the dry friction of these.
    further : ContactFamily, optional
        Further contacts of these, which are formulas.
    friction : mapping from str to (ConvexSet, ConvexSet), optional
        Of two bodies in one system, the static and the dynamic set at contacts that rub.
    """

    pairs: Sequence[tuple[Hull, Hull]]
    coordinates: tuple[int, int]
    lengths: tuple[float, float]
    reads: tuple[str, ...]
    periods: Sequence[float] = ()
    reach: float = 0.0
    position: tuple[str, ...] = ()
    laws: tuple[PairLaw, ...] = ()
    restitution: float = 0.0
    further: ContactFamily | None = None
    friction: Mapping[str, tuple[ConvexSet, ConvexSet]] = field(default_factory=dict)

    @property
    def dimension(self) -> int:
        """The dimension of space."""
        return int(self.pairs[0][0].vertices.shape[1])

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the contacts of hulls."""
        return tuple(name for one, two in self.pairs for name in one.touches(two))

    @cached_property
    def table(self) -> list[float]:
        """The entries of the table; see ``geometry.py``."""
        periods = [p if np.isfinite(p) else 0.0 for p in (*self.periods, *[np.inf] * 3)[:3]]
        head = [*self.coordinates, *self.lengths, *periods, self.dimension]
        head += [len(self.names), 0, 0, len(self.pairs)]
        places: dict[int, int] = {}
        parts: list[float] = []
        listed: list[int] = []
        first, contacts = len(head) + 3 * len(self.pairs), 0
        for one, two in self.pairs:
            for hull in (one, two):
                if id(hull) not in places:
                    places[id(hull)] = first + len(parts)
                    parts += hull.numbers
            listed += [places[id(one)], places[id(two)], contacts]
            contacts += len(one.touches(two))
        return [*map(float, [*head, *listed]), *parts]

    @property
    def _key(self) -> str:
        return f"hulls {hashlib.sha256(np.array(self.table).tobytes()).hexdigest()}"

    def gaps_of(self, names: Sequence[str], first: int) -> Call:
        """Return the gaps as those of a system with its surroundings.

        ``names`` are its coordinates, of which the two bodies have :attr:`reads`; ``first`` is the
        number of the first contact.
        """
        n, count = len(self.reads), len(self.names)
        kernel = HullKernel(self._key, ("values", "finite"), n, count)
        family = HullFamily(self.names, self.reads, kernel.key, kernel)
        reads = tuple(map(list(names).index, self.reads))
        rows = tuple(range(first, first + count))
        return Call(family, reads, np.array(self.table), rows, tuple(range(count)))  # type: ignore[arg-type]

    def slips_of(self, names: Sequence[str], columns: Sequence[int], first: int) -> Call:
        """Return the slips at some contacts in the same way, from the row ``first`` on."""
        n, each = len(self.reads), self.dimension - 1
        outputs = each * len(self.names)
        kernel = HullKernel("slips of hulls", ("all_slips", "all_slips"), 2 * n, outputs)
        family = HullFamily(tuple(f"s{i}" for i in range(outputs)), (), kernel.key, kernel)
        reads = tuple(map(list(names).index, self.reads))
        some = tuple(each * g + c for g in columns for c in range(each))
        reads = (*reads, *(r + len(names) for r in reads))
        rows = tuple(range(first, first + len(some)))
        return Call(family, reads, np.array(self.table), rows, some)  # type: ignore[arg-type]

    def values(self, names: Sequence[str], q: Array) -> Array:
        """Return the gaps ``(N, m)`` at coordinates ``(N, n)`` of a system."""
        call = self.gaps_of(names, 0)
        kernel, numbers = call.family.kernel, call.parameters.ctypes.data
        return np.array([kernel.at(x, numbers, 0)[0] for x in q[:, call.reads]])

    def site(self, contact: str, q: Array) -> tuple[Array, Array]:
        """Return where a contact is, and the normal towards the second body, ``(d,)`` each.

        ``q`` are the coordinates in the order of :attr:`reads`.  The normal is the gradient by
        where the second body is, that of the plane along which the contact closes.
        """
        d, n, (first, _) = self.dimension, len(self.reads), self.coordinates
        call = self.gaps_of(self.reads, 0)
        f, J, at = np.empty(len(self.names)), np.zeros((len(self.names), n)), np.array(q)
        kernel = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5)
        run = kernel(call.family.kernel.compiled(1).point)
        table = call.parameters.ctypes.data
        run(address(at), table, address(f), address(J), None)
        row = J[self.names.index(contact)]
        normal = row[first : first + d] if n > first else -row[:d]
        ends = q[:first], q[first:]
        for one, two in self.pairs:
            a, b = (_placed(hull.vertices, own) for hull, own in zip((one, two), ends, strict=True))
            b = b + self._shift(ends, d)
            k, m = len(one.vertices), len(two.vertices)
            if contact not in (known := one.touches(two)):
                continue
            g = known.index(contact)
            if g < m:
                return b[g], normal
            if g < m + k:
                return a[g - m], normal
            i, j = divmod(g - m - k, len(two.edges))
            (p, u), (r, w) = ((x[e[0]], x[e[1]]) for x, e in ((a, one.edges[i]), (b, two.edges[j])))
            # They cross as seen along the normal.
            sides = np.column_stack([u - p, r - w, normal])
            along = np.linalg.lstsq(sides, r - p, rcond=None)[0][0]
            return p + np.clip(along, 0.0, 1.0) * (u - p), normal
        raise KeyError(contact)

    def _shift(self, ends: tuple[Array, Array], d: int) -> Array:
        """Return the way to the image of the second body that is nearest to the first."""
        periods = np.array([*self.periods, *[np.inf] * d])[:d]
        finite = np.isfinite(periods)
        shift = np.zeros(d)
        if finite.any():
            away = (ends[1][:d] - ends[0][:d])[finite] / periods[finite]
            shift[finite] = -periods[finite] * np.floor(away + 0.5)
        return shift

    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""
        laws = [[str(law.static), str(law.dynamic), law.cause] for law in self.laws]
        return {
            "hulls": self.table,
            "friction between bodies": laws,
            "friction": {name: [*map(str, sets)] for name, sets in self.friction.items()},
            "restitution between bodies": self.restitution,
            "reach": self.reach,
            "further": None if self.further is None else self.further.described(),
        }

    def compiled(self, manifold: Manifold, other: Manifold | None = None) -> PairContacts:
        """Return the compiled contacts of bodies with coordinates on a manifold, or on two."""
        table, names, n = [*self.table], self.names, len(self.reads)
        formulas = None if self.further is None else self.further.compiled(manifold, other)
        key = self._key
        more: tuple[str, ...] = ()
        if formulas is not None:
            codes = [formulas.gaps.kernel.compiled(order) for order in range(2)]
            table[VALUES : VALUES + 2] = [float(code.point) for code in codes]
            key, more = f"{key} {formulas.gaps.key}", formulas.gaps.names
        kernel = HullKernel(key, ("values", "gradients"), n, len(names) + len(more))
        kernel.calls = formulas  # lives as long as its address is in the table
        gaps = HullFamily((*names, *more), self.reads, key, kernel)
        slips: list[Any] = []
        if self.laws:
            rows = tuple(f"s{i}" for i in range(self.dimension - 1))
            slip = HullKernel("slips of hulls", ("slips", "slips"), 2 * n, len(rows))
            rates = tuple(f"{name}_dot" for name in self.reads)
            family = HullFamily(rows, (*self.reads, *rates), slip.key, slip)
            # The table stands before the entries, of two numbers each.
            back = len(table)
            slips = [(family, False, (float(g), float(back + 2 * g))) for g in range(len(names))]
            slips += [] if formulas is None else formulas.slips
        one, two = self.coordinates
        reads = [(0, c) for c in range(one)] + [(1, c) for c in range(two)]
        return PairContacts(
            gaps,  # type: ignore[arg-type]  # what is asked of a family, it has
            tuple(table),
            tuple(reads),
            tuple(slips),
            self.laws,
            self.restitution,
            self.reach,
        )


def beside(
    several: Sequence[HullContacts], names: Sequence[str], first: int, row: int
) -> tuple[list[Call], tuple[FrictionContact, ...], list[Call]]:
    """Return gaps, friction and slips of hulls of a system with the coordinates ``names``.

    Contacts are numbered from ``first``, slips from ``row`` on.
    """
    gaps, rubbing, slips = [], list[FrictionContact](), []
    for hulls in several:
        gaps.append(hulls.gaps_of(names, first))
        rows, some = (
            hulls.dimension - 1,
            [g for g, n in enumerate(hulls.names) if n in hulls.friction],
        )
        for g in some:
            name, sets = hulls.names[g], hulls.friction[hulls.names[g]]
            law = FrictionContact(f"{name} slips", rows, *sets, first + g, (), "sliding")
            rubbing.append(law)
        if some:
            slips.append(hulls.slips_of(names, some, row))
        first, row = first + len(hulls.names), row + rows * len(some)
    return gaps, tuple(rubbing), slips
