"""And/or groups of inequalities as they are written, and the functions that they contain."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Union

from polycorner.checks import refuse
from polycorner.formulas.expressions import as_expression
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.periodicity import check_function
from polycorner.spaces.manifold import Manifold
from polycorner.values import Value

if TYPE_CHECKING:
    import sympy

Part = Union["AllOf", "AnyOf", SmoothFunction, "sympy.Expr"]

BENT = frozenset({"Min", "Max", "Abs"})
MOST_BRANCHES = 256  # of one expression with Min and Max outermost


class _Group(Value):
    """Parts joined by one word; an immutable value."""

    def __init__(self, *parts: Part) -> None:
        for part in parts:
            if not isinstance(part, _Group | SmoothFunction | _Plain):
                as_expression("parts", part)
        self.parts = parts

    def __repr__(self) -> str:
        """Return the group as it would be written."""
        return f"{type(self).__name__}({', '.join(map(repr, self.parts))})"


class AllOf(_Group):
    """The intersection of its parts: every inequality holds."""


class AnyOf(_Group):
    """The union of its parts: at least one inequality holds (locally concave corners)."""


def collect(
    manifold: Manifold, argument: str, parts: Any, letter: str
) -> tuple[Any, list[SmoothFunction]]:
    """Return the tree with every expression made a function, and its functions in order."""
    named = parts.items() if isinstance(parts, Mapping) else None
    if named is None and not isinstance(parts, Sequence):
        parts = [parts]
    items = list(named) if named is not None else [("", part) for part in parts]
    collection = _Collection(manifold, argument, branching=letter == "f")
    tree = AllOf(*[collection.named(name, part, letter) for name, part in items])
    return collection.finished(tree), collection.functions


class _Plain:
    """An expression waiting for the family that all plain expressions share."""

    def __init__(self, name: str) -> None:
        self.name = name


@dataclass
class _Collection:
    """The functions of one argument, and names for those that have none.

    In inequalities, Min and Max are groups, and functions on a circle are periodic.
    """

    manifold: Manifold
    argument: str
    branching: bool
    plain: "dict[str, sympy.Expr]" = field(default_factory=dict)
    functions: list[SmoothFunction] = field(default_factory=list)
    known: set[int] = field(default_factory=set)
    counts: Counter[str] = field(default_factory=Counter)

    def named(self, name: str, part: Any, letter: str) -> Any:
        """Return a part with every expression replaced by its name."""
        if isinstance(part, AllOf | AnyOf):
            if isinstance(part, AnyOf) and not part.parts:
                msg = f"{self.argument}: an AnyOf of nothing is empty; give it at least one part"
                raise ValueError(msg)
            return type(part)(*[self.named("", p, name or letter) for p in part.parts])
        if not isinstance(name, str):
            refuse(f"{self.argument}", "names to be strings", name, TypeError)
        if isinstance(part, SmoothFunction):
            return self._on_manifold(part, name)
        group = outermost(part) if self.branching else part
        if group is not part:
            return self.named(name, group, letter)
        self.counts[letter] += not name
        label = name or f"{letter}{self.counts[letter]}"
        if label in self.plain:
            msg = f"{self.argument}: expected distinct names; got {label} more than once"
            raise ValueError(msg)
        argument = f"{self.argument}[{name!r}]" if name else label
        self.plain[label] = as_expression(argument, part)
        return _Plain(label)

    def _on_manifold(self, function: SmoothFunction, name: str) -> SmoothFunction:
        if function.manifold != self.manifold:
            msg = (
                f"{self.argument}: {function.name} lives on the coordinates "
                f"{', '.join(function.manifold.names)}; expected {', '.join(self.manifold.names)}"
            )
            raise ValueError(msg)
        return function.renamed(name) if name else function

    def finished(self, tree: Any) -> Any:
        """Return a tree of functions: all plain expressions are members of one family."""
        family = Family.of(self.plain, self.manifold.names) if self.plain else None
        return self._finished(tree, family)

    def _finished(self, part: Any, family: Family | None) -> Any:
        if isinstance(part, AllOf | AnyOf):
            return type(part)(*[self._finished(p, family) for p in part.parts])
        if isinstance(part, _Plain):
            assert family is not None
            part = SmoothFunction.member(family, part.name, self.manifold)
            check_function(part, periodic=self.branching)  # an equation may be a section
        if id(part) not in self.known:  # the list keeps it alive
            self.known.add(id(part))
            self.functions.append(part)
        return part


def outermost(expression: Any) -> Any:
    """Return the group of expressions with the same sign as one with Min and Max outermost.

    ``Min(f, g) >= 0`` says that both are, ``Max(f, g) >= 0`` that one is.  Both commute with sums
    and with positive factors, and exchange their places under negative ones; ``Abs(u)`` beside
    other terms is ``Max(u, -u)``.  Any other expression, and one with too many branches, is
    returned as it is.

    Examples
    --------
    >>> from sympy import Abs, Max, Symbol
    >>> x = Symbol("x", real=True)
    >>> outermost(2 - Abs(x)), outermost(3 * Max(x, 1) - 6), outermost(x**2)
    (AllOf(2 - x, x + 2), AnyOf(-3, 3*x - 6), x**2)
    """
    kind = type(expression).__name__
    if kind not in {"Min", "Max", "Add", "Mul"} or not any(map(_is_bent, _terms(expression))):
        return expression
    return expression if _count(expression) > MOST_BRANCHES else _branched(expression)


def _terms(expression: "sympy.Expr") -> "tuple[sympy.Expr, ...]":
    return expression.args if expression.is_Add else (expression,)


def _is_bent(term: "sympy.Expr") -> bool:
    """Whether a term is a multiple of Min, Max or Abs."""
    core = term.args[1] if term.is_Mul and len(term.args) == 2 else term
    return type(core).__name__ in BENT


def _count(expression: "sympy.Expr") -> int:
    """Return the number of branches of an expression."""
    terms = _terms(expression)
    return math.prod(sum(map(_count, _choices(term)[1])) or 1 for term in terms)


def _branched(expression: "sympy.Expr") -> Any:
    for term in _terms(expression):
        group, choices = _choices(term)
        if choices:
            rest = expression - term
            return group(*[_branched(rest + choice) for choice in choices])
    return expression


def _order(expression: "sympy.Expr") -> Any:
    """Return a key for an order that is the same in every process."""
    return expression.sort_key()


def _choices(term: "sympy.Expr") -> "tuple[type[_Group], list[sympy.Expr]]":
    """Return a multiple of Min, Max or Abs as a group of its choices; none for other terms."""
    factor, core = term.as_coeff_Mul()
    kind = type(core).__name__
    if kind not in BENT:
        return AllOf, []
    args = [core.args[0], -core.args[0]] if kind == "Abs" else sorted(core.args, key=_order)
    lowest = (kind == "Min") == bool(factor > 0)
    return AllOf if lowest else AnyOf, [factor * a for a in args]
