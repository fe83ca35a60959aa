"""Families of formulas that are compiled together and bound to numbers late."""

import pickle
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import about, names, reals, refuse, whole
from polycorner.formulas.expressions import as_expression, kinks, substitute
from polycorner.formulas.programs import Program
from polycorner.formulas.shapes import Binding, bind, digest, shared_kernel
from polycorner.formulas.translate import compile_expressions
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.kernels import Kernel

    Expressions = Mapping[str, sympy.Expr]
    Places = Mapping[sympy.Symbol, sympy.Expr]
    Formulas = tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]

MOST_TOGETHER = 200  # second derivatives of a family that is compiled whole


class Written:
    """Definitions and expressions given as SymPy objects.

    They are pickled as bytes of their own, so that a process which finds the machine code on disk
    reads them back, and imports SymPy, only when a formula itself is asked for.
    """

    def __init__(self, definitions: "Expressions", expressions: "Expressions") -> None:
        self._content: Any = (definitions, expressions)

    def __call__(self) -> "tuple[Expressions, Expressions]":
        """Return definitions and expressions."""
        if isinstance(self._content, bytes):
            self._content = pickle.loads(self._content)
        definitions, expressions = self._content
        return definitions, expressions

    def __getstate__(self) -> bytes:
        """Return the content as bytes."""
        content = self._content
        return content if isinstance(content, bytes) else pickle.dumps(content)

    def __setstate__(self, content: bytes) -> None:
        """Keep the bytes until the content is asked for."""
        self._content = content


@dataclass(frozen=True, eq=False)
class Family(Checked):
    """Functions written in the same variables and parameters, compiled together once.

    Parameters are bound late: a thousand contacts of one type are one family.

    Attributes
    ----------
    names : tuple of str
        Names of the functions.
    variables, parameters : tuple of str
        Names of the symbols they read.
    formulas : callable
        Returns ``(definitions, expressions)``, two mappings from names to SymPy expressions;
        a definition may be used in later definitions and in the expressions.
    key : str
        Identifies the formulas between processes.  With a key, SymPy is not even imported
        once the kernels are on disk; without one, it is computed from the expressions.
    unit : str
        Unit of the functions' values, such as ``"mm"``; ``""`` if none is stated.
    kinks : mapping from str to tuple of str
        The subexpressions across which derivatives of each function may jump.  A model that writes
        its formulas on branches which fit together leaves it empty.
    bindings : mapping from str to Binding
        The shapes that the functions are evaluated as; empty where the family is compiled whole.
    stationary : tuple of str
        Definitions ``t`` on which no function depends to the first order, ``df/dt = 0``: what a
        minimum over ``t`` is taken at, such as the foot of a perpendicular.  First derivatives
        leave their changes out (the envelope theorem, [Danskin]); second ones do not.  Also
        variables by which derivatives are not asked for, and zero.
    """

    names: tuple[str, ...]
    variables: tuple[str, ...]
    parameters: tuple[str, ...]
    formulas: "Callable[[], tuple[Expressions, Expressions]]"
    key: str = ""
    unit: str = ""
    kinks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    bindings: Mapping[str, Binding] = field(default_factory=dict, repr=False)
    stationary: tuple[str, ...] = ()

    @classmethod
    @checked
    def of(
        cls,
        expressions: "Mapping[str, Any]",
        variables: Iterable[str],
        parameters: Iterable[str] = (),
        definitions: "Mapping[str, Any] | None" = None,
        *,
        unit: str = "",
        stationary: Iterable[str] = (),
    ) -> "Family":
        """Return the family of given expressions, checking every symbol at once."""
        variables, parameters = _names("variables", variables), _names("parameters", parameters)
        _check_new("parameters", parameters, variables)
        _check_new("definitions", tuple(definitions or ()), variables + parameters)
        with about("expressions"):
            given = {name: as_expression(name, e) for name, e in expressions.items()}
        known = {name: as_expression(name, e) for name, e in (definitions or {}).items()}
        written, held = Written(known, given), tuple(stationary)
        family = cls(tuple(given), variables, parameters, written, unit=unit, stationary=held)
        symbols = variables, parameters
        bindings: dict[str, Binding] = {}
        if _is_shared(family, known):
            places = {name: i for i, name in enumerate(variables)}
            bindings = {name: bind(name, e, places, parameters, known) for name, e in given.items()}
            numbers = [(name, b.shape.key, b.reads, b.exact) for name, b in bindings.items()]
            key = digest([*symbols, *numbers])
        else:
            key = family.program().digest()
        bent = {
            name: kinks([e, *known.values()])
            for name, e in given.items()
            if name not in bindings or not bindings[name].is_polynomial
        }
        return replace(family, key=key, bindings=bindings, kinks=bent)

    def program(self) -> Program:
        """Return the straight-line program of the values."""
        definitions, expressions = self.formulas()
        ordered = [expressions[name] for name in self.names]
        symbols = self.variables, self.parameters
        return compile_expressions(ordered, *symbols, definitions, self.names, self.stationary)

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes, with formulas that a pickle cannot name written out."""
        state = super().__getstate__()
        if not (isinstance(self.formulas, Written) or _is_importable(self.formulas)):
            state["formulas"] = Written(*self.formulas())
        return state

    @cached_property
    def kernel(self) -> "Kernel":
        """The compiled functions."""
        sizes = len(self.variables), len(self.parameters), len(self.names)
        return shared_kernel(self.identity, self.program, *sizes)

    @cached_property
    def identity(self) -> str:
        """The key; without one, a hash of the program of the formulas."""
        return self.key or self.program().digest()

    @checked
    def evaluate(
        self, points: ArrayLike, parameters: ArrayLike = (), order: int = 0
    ) -> tuple[Array, ...]:
        """Return values, and derivatives by the variables up to an order.

        Parameters
        ----------
        points : (..., k) array
            The variables.
        parameters : (p,) array, optional
        order : int, optional
            0, 1 or 2.

        Returns
        -------
        tuple of arrays
            Values ``(..., m)``, gradients ``(..., m, k)``, Hessians ``(..., m, k, k)``.
        """
        from polycorner.formulas.kernels import address

        k, p = len(self.variables), len(self.parameters)
        at, numbers = reals("points", points), np.atleast_1d(reals("parameters", parameters))
        if not at.ndim or at.shape[-1] != k:
            refuse("points", f"an array of shape (..., {k})", at.shape)
        if numbers.shape != (p,):
            refuse("parameters", f"an array of shape ({p},)", numbers.shape)
        order = whole("order", order, least=0, most=2)
        fixed = np.array([*numbers, 0.0])  # not empty, and with an address that can be taken
        found = self.kernel.over(at.reshape(-1, k), address(fixed), order)
        return tuple(part.reshape(*at.shape[:-1], *part.shape[1:]) for part in found)

    @checked
    def expression(self, name: str) -> "sympy.Expr":
        """Return one function with all definitions written out."""
        import sympy

        names("name", [name], self.names)
        definitions, expressions = self.formulas()
        written: dict[str, sympy.Expr] = {}

        def expand(e: "sympy.Expr") -> "sympy.Expr":
            found = {s: written[s.name] for s in e.free_symbols if s.name in written}
            return substitute(e, found)

        for definition, e in definitions.items():
            written[definition] = expand(e)
        return expand(expressions[name])


def _is_shared(family: Family, definitions: "Expressions") -> bool:
    """Whether functions are compiled one by one, as shapes, and not together.

    Together, few functions of few variables share their operations and are evaluated by one call;
    the derivatives of many, most of them zero, would all be compiled.
    """
    functions = len(family.names)
    entries = functions * len(family.variables) ** 2
    return functions == 1 or (entries > MOST_TOGETHER and not definitions)


def _is_importable(function: Any) -> bool:
    """Return whether a function, or that of a partial one, is found under its name."""
    if isinstance(function, partial):
        return _is_importable(function.func)
    module = sys.modules.get(getattr(function, "__module__", ""))
    return getattr(module, getattr(function, "__qualname__", ""), None) is function


def _names(argument: str, given: Iterable[Any]) -> tuple[str, ...]:
    names = tuple(given) if isinstance(given, Iterable) else ()
    if not isinstance(given, Iterable) or not all(isinstance(name, str) for name in names):
        refuse(argument, "names of symbols", given, TypeError)
    return names


def _check_new(argument: str, names: Sequence[str], taken: Sequence[str]) -> None:
    hidden = [name for name in names if name in taken]
    if hidden:
        msg = f"{argument}: expected names other than {', '.join(taken)}; got {', '.join(hidden)}"
        raise ValueError(msg)


# ------------------------------------------------------------------------------------- compositions

# A function of a family is composed with a map when expressions take the place of its variables,
# and bound to numbers or other parameters when they take the place of its parameters. Definitions
# get names of their own; what turns out to be equal is computed once by the program (hash-consing).


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
