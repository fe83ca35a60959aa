"""Where joints put the links of a chain: products of rigid motions, as numbers and as formulas.

A joint that turns by ``q`` about the unit vector ``a`` of its own axes has the matrix ``R (a a^T +
cos q (1 - a a^T) + sin q [a])``, with ``R`` that of the joint at rest.  The gap of two links is a
function of the joints between them alone: of the placement of one link in the axes of the other.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner.bodies import frames
from polycorner.bodies.frames import POSE, symbols
from polycorner.bodies.gaps import FIRST, SECOND
from polycorner.bodies.rigid_motions import number, spin
from polycorner.formulas import cache, families
from polycorner.formulas.families import Family, Term, composition
from polycorner.formulas.families import stationary as stationary_of
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.programs import Program
from polycorner.formulas.translate import compile_expressions
from polycorner.motion.formulation import dotted
from polycorner.spaces.embedding import rotation_matrix
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.families import Formulas

    Expressions = dict[str, sympy.Expr]
    Vector = list[sympy.Expr]
    Matrix = list[Vector]

Pose = tuple[Array, Array]  # matrix and origin
Numbers = tuple[float, ...]
IDENTITY: Numbers = tuple(np.eye(3).ravel().tolist())


def clean(values: Array) -> Array:
    """Return numbers of the order of one without what rounding left of zeros."""
    near = np.round(values)
    return np.where(abs(values - near) <= DEFAULT.rounding, near, values)


class LinkStep(NamedTuple):
    """How a joint, or nothing but free coordinates, place a link in the axes of the one before.

    Attributes
    ----------
    kind : {"turn", "slide", "free", "shift"}
        About or along an axis; freely, by a position and a quaternion; or by a position alone.
    reads : tuple of str
        The coordinates.
    origin, turn : tuple of float
        Of the joint at rest, the matrix row by row.
    axis : tuple of float
        A unit vector, in the axes of the joint.
    rate, offset : float
        The joint stands at ``rate q + offset``.
    """

    kind: str
    reads: tuple[str, ...]
    origin: Numbers = (0.0, 0.0, 0.0)
    turn: Numbers = IDENTITY
    axis: Numbers = (0.0, 0.0, 0.0)
    rate: float = 1.0
    offset: float = 0.0

    def terms(self) -> tuple[Array, Array, Array]:
        """Return the constant of the matrix of a turn, and the factors of cosine and sine."""
        start, axis = np.reshape(self.turn, (3, 3)), np.array(self.axis)
        along = np.outer(axis, axis)
        return (
            clean(start @ along),
            clean(start @ (np.eye(3) - along)),
            clean(start @ spin(axis, 3)),
        )

    def pose(self, values: Mapping[str, float]) -> Pose:
        """Return matrix and origin at values of the coordinates."""
        q = [values[name] for name in self.reads]
        if self.kind in {"free", "shift"}:
            turned = Rotation.from_quat([*q[4:], q[3]]).as_matrix() if q[3:] else np.eye(3)
            return turned, np.array(q[:3])
        start, at = np.reshape(self.turn, (3, 3)), self.rate * q[0] + self.offset
        if self.kind == "slide":
            return start, np.array(self.origin) + start @ np.array(self.axis) * at
        constant, cosine, sine = self.terms()
        return constant + math.cos(at) * cosine + math.sin(at) * sine, np.array(self.origin)

    def formulas(self) -> "tuple[Matrix, Vector]":
        """Return matrix and origin as formulas."""
        import sympy

        q = symbols(self.reads)
        if self.kind in {"free", "shift"}:
            matrix = rotation_matrix(q[3:]) if q[3:] else sympy.eye(3)
            return matrix.tolist(), [*q[:3]]
        at = number(self.rate) * q[0] + number(self.offset)
        origin = [number(x) for x in self.origin]
        start = clean(np.reshape(self.turn, (3, 3)))
        if self.kind == "slide":
            way = clean(start @ np.array(self.axis)).tolist()
            matrix = [[number(x) for x in row] for row in start.tolist()]
            return matrix, [o + number(w) * at for o, w in zip(origin, way, strict=True)]
        entries = np.stack(self.terms(), axis=-1).tolist()
        one, c, s = sympy.S.One, sympy.cos(at), sympy.sin(at)
        basis = [one, c, s]
        return [[dot([number(x) for x in e], basis) for e in row] for row in entries], origin


def dot(a: "Vector", b: "Vector") -> "sympy.Expr":
    """Return a sum of products, without those of zeros, about which SymPy thinks for long."""
    import sympy

    return sum((x * y for x, y in zip(a, b, strict=True) if x != 0 and y != 0), sympy.S.Zero)


def times(matrix: "Matrix", vector: "Vector") -> "Vector":
    """Return the product of a matrix and a vector of formulas."""
    return [dot(row, vector) for row in matrix]


def transposed(matrix: "Matrix") -> "Matrix":
    """Return the rows of a matrix as columns."""
    return [*map(list, zip(*matrix, strict=True))]


@dataclass(frozen=True)
class Chain:
    """The placement of a link in the axes of another.

    Attributes
    ----------
    steps : tuple of (LinkStep, bool)
        From the other link to this one, and which of them are taken backwards.
    """

    steps: tuple[tuple[LinkStep, bool], ...]

    @property
    def reads(self) -> tuple[str, ...]:
        """The coordinates of the joints between the links."""
        return tuple(dict.fromkeys(name for step, _ in self.steps for name in step.reads))

    def formulas(self) -> "Formulas":
        """Return definitions on the way, and the numbers of the placement by the names of POSE."""
        import sympy

        definitions: Expressions = {}

        def named(name: str, e: "sympy.Expr") -> "sympy.Expr":
            if not e.args:
                return e  # a number or a symbol
            definitions[name] = e
            return symbols([name])[0]

        matrix, origin = sympy.eye(3).tolist(), [sympy.S.Zero] * 3
        for k, (step, backwards) in enumerate(self.steps):
            own, at = step.formulas()
            own = [[named(f"m{k}{i}{j}", e) for j, e in enumerate(r)] for i, r in enumerate(own)]
            at = [named(f"o{k}{i}", e) for i, e in enumerate(at)]
            if backwards:
                own = transposed(own)
                at = [-x for x in times(own, at)]
            moved = [o + x for o, x in zip(origin, times(matrix, at), strict=True)]
            turned = transposed([times(matrix, column) for column in transposed(own)])
            origin = [named(f"p{k}{i}", e) for i, e in enumerate(moved)]
            matrix = [
                [named(f"r{k}{i}{j}", e) for j, e in enumerate(row)] for i, row in enumerate(turned)
            ]
        entries = [*origin, *(e for row in matrix for e in row)]
        return definitions, dict(zip(POSE, entries, strict=True))

    def moving(self) -> "Formulas":
        """Return the formulas, with rates of all numbers by the chain rule; ``x_dot`` of ``x``."""
        import sympy

        definitions, pose = self.formulas()
        reads = zip(symbols(self.reads), symbols([*map(dotted, self.reads)]), strict=True)
        rates, written = dict(reads), dict[str, sympy.Expr]()

        def rate(e: "sympy.Expr") -> "sympy.Expr":
            known = sorted(e.free_symbols & {*rates}, key=str)
            return sum((sympy.diff(e, x) * rates[x] for x in known), sympy.S.Zero)

        for name, e in definitions.items():
            written[name] = e
            if (change := rate(e)) != 0:
                written[dotted(name)] = change
                old, new = symbols([name, dotted(name)])
                rates[old] = new
        return written, pose | {dotted(name): rate(sympy.S.Zero + e) for name, e in pose.items()}

    def function(
        self, manifold: Manifold, family: Family, parameters: list[float], label: str, member: str
    ) -> SmoothFunction:
        """Return a gap or slip of a linked part as a function of the joints, and their rates."""
        found = linked(family, self)
        return SmoothFunction.member(
            found,
            member,
            manifold,
            parameters=parameters,
            reads=found.variables,
            label=label,
        )


@dataclass(frozen=True, eq=False)
class Linked(Family):
    """A family of gaps or slips of a linked part, composed with the placement of the link."""

    gap: Family | None = None
    chain: Chain | None = None

    def program(self) -> Program:
        """Return the straight-line program of the values: that of the gaps, after the placement."""
        assert self.gap is not None
        assert self.chain is not None
        definitions, pose = _placement(self.gap, self.chain)
        placed = compile_expressions([*pose.values()], self.variables, (), definitions)
        graph, entry = placed.graph.copy(), dict(zip(pose, placed.outputs, strict=True))
        inputs = {("var", i): entry[_entry(name)] for i, name in enumerate(self.gap.variables)}
        inputs |= {("par", i): graph.node("par", i) for i in range(len(self.parameters))}
        program = self.gap.program()
        found = graph.grafted(program, inputs)
        return Program(
            graph,
            tuple(found[a] for a in program.outputs),
            len(self.variables),
            len(self.parameters),
            tuple(graph.core(found[a]) for a in program.stationary)
            if self.variables == self.chain.reads
            else tuple(graph.node("var", i) for i in range(len(self.chain.reads))),
        )


def _entry(variable: str) -> str:
    """Return the number of a placement that a variable of gaps stands for."""
    return variable.replace(FIRST, "").replace(SECOND, "")


def _moves(family: Family) -> bool:
    """Whether functions of a family have velocities, as slips do."""
    return any(name.endswith(dotted("")) for name in family.variables)


def _placement(family: Family, chain: Chain) -> "Formulas":
    return chain.moving() if _moves(family) else chain.formulas()


@lru_cache(maxsize=256)
def linked(family: Family, chain: Chain) -> Family:
    """Return the gaps of a family as functions of the joints of a chain."""
    sources = cache.source_key(frames.__name__, families.__name__, __name__)
    return Linked(
        family.names,
        (*chain.reads, *map(dotted, chain.reads)) if _moves(family) else chain.reads,
        family.parameters,
        partial(_formulas, family, chain),
        repr((sources, family.key, chain)),
        stationary=chain.reads if _moves(family) else stationary_of([family] * len(family.names)),
        gap=family,
        chain=chain,
    )


def _formulas(family: Family, chain: Chain) -> "Formulas":
    definitions, pose = _placement(family, chain)
    places = {
        symbol: pose[_entry(name)]
        for name, symbol in zip(family.variables, symbols(family.variables), strict=True)
    }
    terms = {name: Term(family, name, places) for name in family.names}
    shared, found = composition(terms)
    return definitions | shared, found


@dataclass(frozen=True, eq=False)
class Moving:
    """A link in motion, as formulas of coordinates and velocities.

    Attributes
    ----------
    matrix, origin : Matrix, Vector
        Its placement in space.
    spin, velocity : Vector
        Angular velocity, and velocity of the origin, in the axes of the link.
    """

    matrix: "Matrix"
    origin: "Vector"
    spin: "Vector"
    velocity: "Vector"

    def point(self, local: Array) -> "Vector":
        """Return where a point of the link is."""
        there = times(self.matrix, [number(x) for x in local.tolist()])
        return [o + x for o, x in zip(self.origin, there, strict=True)]


def crossed(a: "Vector", b: "Vector") -> "Vector":
    """Return the cross product of two vectors of formulas."""
    return [dot([a[i - 2], -a[i - 1]], [b[i - 1], b[i - 2]]) for i in range(3)]


def still() -> Moving:
    """Return what stands in space."""
    import sympy

    zero = [sympy.S.Zero] * 3
    return Moving(sympy.eye(3).tolist(), zero, zero, zero)


def moved(before: Moving, step: LinkStep, rates: "Mapping[str, sympy.Symbol]") -> Moving:
    """Return the motion of a link, of that of the link before and of its joint.

    Formulas of one link contain those of the one before; what compiles them visits each once.
    """
    matrix, origin = step.formulas()
    v = [rates[name] for name in step.reads]
    back = transposed(matrix)
    carried = [a + b for a, b in zip(before.velocity, crossed(before.spin, origin), strict=True)]
    spin_, velocity = times(back, before.spin), times(back, carried)
    if step.kind in {"free", "shift"}:  # in space
        velocity = times(back, v[:3])
        if v[3:]:
            a, (w, *u) = symbols(step.reads[3:]), v[3:]
            across = crossed(a[1:], u)
            spin_ = [2 * (a[0] * x - w * y - z) for x, y, z in zip(u, a[1:], across, strict=True)]
    else:
        axis = [number(x * step.rate) * v[0] for x in clean(np.array(step.axis)).tolist()]
        if step.kind == "turn":
            spin_ = [a + b for a, b in zip(spin_, axis, strict=True)]
        else:
            velocity = [a + b for a, b in zip(velocity, axis, strict=True)]
    columns = [times(before.matrix, column) for column in back]
    at = [o + x for o, x in zip(before.origin, times(before.matrix, origin), strict=True)]
    return Moving(transposed(columns), at, spin_, velocity)
