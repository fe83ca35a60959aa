"""Functions of several families together, with other expressions in place of their symbols.

A function of a family is composed with a map when expressions take the place of its variables, and
bound to numbers or other parameters when they take the place of its parameters.  Definitions get
names of their own; what turns out to be equal is computed once by the program (hash-consing).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycorner.formulas.families import Family

if TYPE_CHECKING:
    import sympy

    Expressions = Mapping[str, sympy.Expr]
    Places = Mapping[sympy.Symbol, sympy.Expr]
    Formulas = tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]


@dataclass(frozen=True, eq=False)
class Term:
    """A function of a family, and what takes the place of its symbols.

    Attributes
    ----------
    family : Family
    name : str
        The function's name in it.
    places : mapping from sympy.Symbol to sympy.Expr
        Of variables and parameters; others stay.
    """

    family: Family
    name: str
    places: "Places"


def symbol(name: str) -> "sympy.Symbol":
    """Return the symbol that the formulas of a family have for a name."""
    import sympy

    return sympy.Symbol(name, real=True)


def substituted(formulas: "tuple[Expressions, Expressions]", places: "Places") -> "Formulas":
    """Return definitions and expressions with other expressions in place of symbols."""
    definitions, expressions = formulas
    return (
        {name: e.xreplace(places) for name, e in definitions.items()},
        {name: e.xreplace(places) for name, e in expressions.items()},
    )


def composition(terms: Mapping[str, Term]) -> "Formulas":
    """Return several functions by new names; ``_k`` marks the definitions of the k-th."""
    shared: dict[str, sympy.Expr] = {}
    found: dict[str, sympy.Expr] = {}
    for k, (name, term) in enumerate(terms.items()):
        formulas = term.family.formulas()
        own = {symbol(d): symbol(f"{d}_{k}") for d in formulas[0]}
        definitions, expressions = substituted(formulas, {**term.places, **own})
        shared |= {f"{d}_{k}": e for d, e in definitions.items()}
        found[name] = expressions[term.name]
    return shared, found


def stationary(families: Iterable[Family]) -> tuple[str, ...]:
    """Return the stationary definitions of a :func:`composition` of functions of families."""
    return tuple(
        f"{d}_{k}"
        for k, family in enumerate(families)
        for d in family.stationary
        if d not in family.variables
    )
