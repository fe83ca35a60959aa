"""Vector fields along which a problem is exactly invariant, by exact algebra.

A vector field ``xi`` is a *generator* of a symmetry if ``sum xi_i df/dq_i`` is identically zero
for the energy and for every active function.  No evaluation in intervals can show this identity; it
is derived by forward differentiation along ``xi`` in exact rational arithmetic, with slopes as
polynomials in the nodes of the functions' own graph.  What cancels there cancels for all arguments;
an identity that this algebra does not recognise counts as not shown.

The polynomials have no fixed set of variables, as differentiation adds nodes
(:mod:`~polycorner.proofs.polynomials`).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.programs import Graph
from polycorner.intervals.balls import Ball, dot
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided, write
from polycorner.intervals.tapes import Box
from polycorner.polyhedra.symmetry import vector_field
from polycorner.proofs.polynomials import Polynomial, TooLargeError, product, total
from polycorner.spaces.manifold import Manifold
from polycorner.values import cached_property

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True, eq=False)
class Generator:
    """A vector field on a manifold, given by one component for each coordinate.

    Components that are constant are functions, too.
    """

    manifold: Manifold
    components: tuple[SmoothFunction, ...]

    @cached_property
    def formulas(self) -> Formulas:
        """The components as formulas."""
        return Formulas(self.components, self.manifold)

    def bounds(self, q: "Sequence[Ball]") -> "list[Ball]":
        """Return enclosures of the components on a box, infinite where they are not bounded."""
        return self.formulas.values(Box(q[: self.manifold.size]), range(len(self.components)))

    def at(self, q: "Sequence[Ball]") -> "list[Ball] | Undecided":
        """Return enclosures of the components on a box, or why smoothness is undecided."""
        rows = range(len(self.components))
        box = Box(q[: self.manifold.size])
        forms = self.formulas.smooth(box, rows)
        return forms if isinstance(forms, Undecided) else list(forms.evaluate(box, 0)[0])

    def __str__(self) -> str:
        """Return the field as a sum over coordinate directions."""
        pairs = zip(self.manifold.names, self.components, strict=True)
        terms = [_term(f.expression, name) for name, f in pairs]
        return " + ".join(term for term in terms if term).replace("+ -", "- ")


def _term(component: "sympy.Expr", name: str) -> str:
    """Write ``component d/dname``; nothing where it is zero."""
    import sympy

    number = component.is_number
    exact = sympy.Rational(component) if component.is_Float else component
    if number and exact in {0, 1, -1}:
        return {0: "", 1: f"d/d{name}", -1: f"-d/d{name}"}[int(exact)]
    return f"{exact} d/d{name}" if number else f"({exact}) d/d{name}"


def generators(manifold: Manifold, fields: Iterable[Any]) -> list[Generator]:
    """Return the vector fields of a symmetry; see :func:`vector_field` for their forms."""
    return [Generator(manifold, vector_field(manifold, field)) for field in fields]


def translations(forms: SmoothForms) -> list[list[Fraction]]:
    """Return a basis of constant vectors, of whole numbers, along which the functions are constant.

    These are the vectors that annihilate every argument of a nonlinear operation, where all of
    these are linear forms with rational coefficients.
    """
    n = forms.dimension
    zero = (Fraction(0),) * n
    slopes: dict[int, tuple[Fraction, ...]] = {}
    rows: set[tuple[Fraction, ...]] = set()
    for a in forms.graph.needed(forms.outputs):
        op, args = forms.graph.nodes[a]
        children = [slopes[child] for child in forms.graph.children(a)]
        slopes[a] = zero
        if op == "var" and int(args[0]) < n:
            slopes[a] = tuple(Fraction(int(k == args[0])) for k in range(n))
        elif op in {"add", "sub"}:
            sign = 1 if op == "add" else -1
            slopes[a] = tuple(u + sign * v for u, v in zip(*children, strict=True))
        elif op == "neg":
            slopes[a] = tuple(-u for u in children[0])
        elif op == "mul" and (factor := _factor(forms.graph, a)) is not None:
            slopes[a] = tuple(factor[0] * u for u in slopes[factor[1]])
        else:
            rows.update(children)
    rows.update(slopes[output] for output in forms.outputs)
    return _null_space([list(row) for row in rows if any(row)], n)


def _factor(graph: Graph, a: int) -> tuple[Fraction, int] | None:
    """Return a rational factor of a product and the node of the other factor."""
    u, v = graph.children(a)
    for constant, other in ((u, v), (v, u)):
        op, args = graph.nodes[constant]
        if op == "const" and isinstance(args[0], Fraction):
            return args[0], other
    return None


def _null_space(rows: list[list[Fraction]], n: int) -> list[list[Fraction]]:
    """Return a basis of the null space of rational rows, in whole numbers."""
    from sympy import QQ
    from sympy.polys.matrices import DomainMatrix

    entries = [[QQ(x.numerator, x.denominator) for x in row] for row in rows]
    reduced, pivots = DomainMatrix(entries, (len(rows), n), QQ).rref()
    basis = []
    for free in (column for column in range(n) if column not in pivots):
        vector = [Fraction(int(k == free)) for k in range(n)]
        for pivot, row in zip(pivots, reduced.to_list(), strict=False):
            vector[pivot] = -Fraction(int(row[free].numerator), int(row[free].denominator))
        denominator = math.lcm(*(x.denominator for x in vector))
        basis.append([denominator * x for x in vector])
    return basis


def annihilated(forms: SmoothForms, field: Generator) -> list[bool]:
    """Return for each function whether its slope along the field is proved to be zero."""
    components = [write(forms.graph, f) for f in field.components]
    slopes = _Slopes(forms.graph, components)
    return [slopes.vanishes(output) for output in forms.outputs]


def slope_bounds(forms: SmoothForms, field: Generator, box: Box) -> "list[Ball]":
    """Return enclosures of the slopes of the functions along a field; none if it is not smooth."""
    along = field.at(box.hull)
    if isinstance(along, Undecided):
        return []
    _, gradients = forms.evaluate(box, 1)
    return [dot(row[: len(along)], along) for row in gradients]


class _Slopes:
    """Derivatives along a vector field as polynomials in nodes."""

    def __init__(self, graph: Graph, components: list[int]) -> None:
        self.graph, self.components = graph, components
        self._written: dict[int, Polynomial] = {}
        self._slopes: dict[int, Polynomial] = {}

    def vanishes(self, output: int) -> bool:
        """Whether the slope of a node is identically zero; False if that is not recognised."""
        try:
            return not self.slope(output)
        except TooLargeError:
            return False

    def written(self, a: int) -> Polynomial:
        """Return a node as a polynomial in nodes that are neither sums nor products."""
        if a not in self._written:
            self._written[a] = self._write(a)
        return self._written[a]

    def _write(self, a: int) -> Polynomial:
        op, args = self.graph.nodes[a]
        if op == "const" and isinstance(args[0], Fraction):
            return {(): args[0]} if args[0] else {}
        if op not in {"add", "sub", "neg", "mul"}:
            return {(a,): Fraction(1)}
        parts = [self.written(child) for child in self.graph.children(a)]
        if op == "mul":
            return product(*parts)
        return total(parts, op)

    def slope(self, a: int) -> Polynomial:
        """Return the derivative of a node along the field."""
        if a not in self._slopes:
            self._slopes[a] = self._slope(a)
        return self._slopes[a]

    def _slope(self, a: int) -> Polynomial:
        op, args = self.graph.nodes[a]
        if op == "var":
            inside = int(args[0]) < len(self.components)
            return self.written(self.components[int(args[0])]) if inside else {}
        children = self.graph.children(a)
        slopes = [self.slope(child) for child in children]
        if not any(slopes):
            return {}
        if op in {"add", "sub", "neg"}:
            return total(slopes, op)
        if op in _DERIVATIVES:
            twin, sign = _DERIVATIVES[op]
            known = a if twin == op else self.graph.unary(twin, children[0])
            return product(slopes[0], product({(): sign}, self.written(known)))
        if op in {"mul", "div", "atan2", "log"}:
            return self._rational_slope(op, a, children, slopes)
        parts = [product(slope, _opaque(a, k)) for k, slope in enumerate(slopes)]
        return parts[0] if len(parts) == 1 else total(parts, "add")

    def _rational_slope(
        self, op: str, a: int, children: Sequence[int], slopes: list[Polynomial]
    ) -> Polynomial:
        """Return the slope of a product, a quotient, an angle or a logarithm."""
        if op == "log":
            return _quotient(slopes[0], self.written(children[0]), a)
        u, v = (self.written(child) for child in children)
        first, second = product(slopes[0], v), product(u, slopes[1])
        if op == "mul":
            return total([first, second], "add")
        bottom = product(v, v)
        if op == "atan2":
            bottom = total([bottom, product(u, u)], "add")
        return _quotient(total([first, second], "sub"), bottom, a)


# Functions whose derivative is, up to sign, a function of the same argument.
_DERIVATIVES = {
    "sin": ("cos", Fraction(1)),
    "cos": ("sin", Fraction(-1)),
    "exp": ("exp", Fraction(1)),
    "sinh": ("cosh", Fraction(1)),
    "cosh": ("sinh", Fraction(1)),
}


def _quotient(top: Polynomial, bottom: Polynomial, a: int) -> Polynomial:
    """Return a quotient: a number if it is constant, otherwise a multiple of a new symbol."""
    if top.keys() == bottom.keys() and top:
        ratios = {top[monomial] / bottom[monomial] for monomial in top}
        if len(ratios) == 1:
            return {(): ratios.pop()}
    return product(top, _opaque(a, 0)) if top else {}


def _opaque(a: int, position: int) -> Polynomial:
    """Return the partial derivative of a node by an argument as a symbol of its own."""
    return {(-1 - 3 * a - position,): Fraction(1)}
