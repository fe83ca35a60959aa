"""Formulas up to the names of their coordinates and their numbers: those of one shape share code.

``x3 - 0.25`` and ``7 - y`` are affine functions of one coordinate, and the gaps of two pairs of
discs are one formula.  A shape is compiled once; a function is a shape with the coordinates it
reads, in the order in which they occur, and its numbers as parameters.  Polynomials of degree one
and two are data altogether: their shape is given by the number of coordinates alone.
"""

import hashlib
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from threading import Lock
from typing import TYPE_CHECKING, Any
from weakref import WeakValueDictionary

import numpy as np

from polycorner.formulas.programs import Polynomial, Program
from polycorner.formulas.translate import Translator, representable
from polycorner.values import Value, cached_property

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.kernels import Kernel

# Kernels in use, by the key of their shape.
_KERNELS: "WeakValueDictionary[str, Kernel]" = WeakValueDictionary()
_SHARING = Lock()


@dataclass(frozen=True, eq=False)
class FormulaShape(Value):
    """A formula up to the names of its coordinates and its numbers.

    Attributes
    ----------
    key : str
        Equal keys mean equal shapes.
    program : Program or Polynomial
        What is compiled.
    """

    key: str
    program: Program | Polynomial
    names: tuple[str, ...] = ("f",)

    @cached_property
    def kernel(self) -> "Kernel":
        """The compiled function; all equal shapes share it."""
        return shared_kernel(
            self.key,
            lambda: self.program,
            self.program.variables,
            self.program.parameters,
            1,
        )


def shared_kernel(
    key: str,
    program: "Callable[[], Program | Polynomial]",
    variables: int,
    parameters: int,
    outputs: int,
) -> "Kernel":
    """Return the kernel of a key: the one in use, if there is one."""
    from polycorner.formulas.kernels import Kernel

    with _SHARING:
        kernel = _KERNELS.get(key)
        if kernel is None:
            sizes = {"variables": variables, "parameters": parameters, "outputs": outputs}
            kernel = _KERNELS[key] = Kernel(key, program, **sizes)
    return kernel


def forget() -> None:
    """Let later functions have kernels of their own, compiled or loaded anew."""
    _KERNELS.clear()


@dataclass(frozen=True, eq=False)
class Binding(Value):
    """A formula as a shape bound to coordinates and numbers.

    Attributes
    ----------
    shape : FormulaShape
    reads : tuple of int
        Which of the formula's variables the shape reads, in order.
    numbers : tuple of float
        Values of the shape's parameters after those that the formula has by name.
    exact : str
        The numbers to the last digit.
    """

    shape: FormulaShape
    reads: tuple[int, ...]
    numbers: tuple[float, ...]
    exact: str = field(repr=False)

    @property
    def is_polynomial(self) -> bool:
        """Whether the formula is a polynomial of degree one or two, written out."""
        return isinstance(self.shape.program, Polynomial)


def bind(
    name: str,
    expression: "sympy.Expr",
    variables: Mapping[str, int],
    parameters: Sequence[str],
    definitions: "Mapping[str, sympy.Expr]",
) -> Binding:
    """Return an expression as a shape bound to variables, given with their positions, and numbers.

    Raises
    ------
    ValueError
        As :func:`~polycorner.formulas.translate.compile_expressions`.
    """
    found = None if parameters or definitions else _polynomial(expression, variables)
    return found or _general(name, expression, variables, parameters, definitions)


def _general(
    name: str,
    expression: "sympy.Expr",
    variables: Mapping[str, int],
    parameters: Sequence[str],
    definitions: "Mapping[str, sympy.Expr]",
) -> Binding:
    translator = _Abstract(variables, parameters)
    for known, e in definitions.items():
        translator.subject = known
        translator.names[known] = translator.translate(e)
    translator.subject = name
    output = translator.translate(expression)
    reads = tuple(translator.reads) or (0,)
    count = len(parameters) + len(translator.numbers)
    program = Program(translator.graph, (output,), len(reads), count)
    shape = FormulaShape(program.digest(), program)
    numbers = tuple([float(number) for number in translator.numbers])
    return Binding(shape, reads, numbers, repr((shape.key, reads, translator.numbers)))


class _Abstract(Translator):
    """A translator that numbers coordinates as they occur and makes parameters of all numbers."""

    def __init__(self, variables: Mapping[str, int], parameters: Sequence[str]) -> None:
        super().__init__((), parameters)
        self._positions = variables
        self._given = len(parameters)
        self.reads: list[int] = []
        self.numbers: list[Fraction] = []

    @property
    def known(self) -> Iterable[str]:
        """The names of all symbols."""
        return (*self._positions, *self.names)

    def symbol(self, name: str) -> int:
        """Return the node of a symbol, counting variables as they occur."""
        if name in self._positions and name not in self.names:
            self.names[name] = self.graph.node("var", len(self.reads))
            self.reads.append(self._positions[name])
        return super().symbol(name)

    def number(self, value: Fraction) -> int:
        """Return a new parameter in place of a number."""
        self.numbers.append(value)
        return self.graph.node("par", self._given + len(self.numbers) - 1)


# ------------------------------------------------------------------------------------- polynomials


def _polynomial(expression: "sympy.Expr", position: Mapping[str, int]) -> Binding | None:
    """Return a polynomial of degree one or two that is written as a sum of terms."""
    terms: dict[tuple[int, ...], float] = {}
    exact: list[Any] = []
    for term in expression.args if expression.is_Add else (expression,):
        found = _term(term, position)
        if found is None or found[0] in terms:
            return None
        terms[found[0]] = found[1]
        exact.append((found[0], found[2]))
    reads = tuple(sorted({i for monomial in terms for i in monomial}))
    if not reads:
        return None
    place = {i: k for k, i in enumerate(reads)}
    n, degree = len(reads), max(map(len, terms))
    slopes, curvature = np.zeros(n), np.zeros((n, n))
    for monomial, value in terms.items():
        if len(monomial) == 1:
            slopes[place[monomial[0]]] = value
        elif monomial:
            i, j = (place[k] for k in monomial)
            curvature[i, j] += value
            curvature[j, i] += value
    bent = curvature.ravel().tolist() if degree == 2 else []
    numbers = (terms.get((), 0.0), *slopes.tolist(), *bent)
    shape = FormulaShape(f"polynomial {n} {degree}", Polynomial(n, degree))
    return Binding(shape, reads, numbers, repr(sorted(exact, key=lambda known: known[0])))


def _term(
    term: "sympy.Expr", position: Mapping[str, int]
) -> tuple[tuple[int, ...], float, Any] | None:
    """Return the variables of a term, ``(i,)`` or ``(i, j)``, its coefficient, and that exactly."""
    coefficient: tuple[float, Any] | None = None
    monomial: list[int] = []
    for factor in term.args if term.is_Mul else (term,):
        if factor.is_Number and coefficient is None:
            coefficient = _coefficient(factor)
            if coefficient is None:
                return None
            continue
        power, base = 1, factor
        if factor.is_Pow:
            base, exponent = factor.args
            power = 2 if exponent == 2 else 3
        if not base.is_Symbol or base.name not in position or len(monomial) + power > 2:
            return None
        monomial += [position[base.name]] * power
    value, exact = coefficient or (1.0, 1)
    return tuple(sorted(monomial)), value, exact


def _coefficient(number: "sympy.Number") -> tuple[float, Any] | None:
    """Return a number as a double and exactly; None if it is out of range."""
    if number.is_Rational:
        exact = number.p, number.q
        return (exact[0] / exact[1], exact) if representable(exact) else None
    if not number.is_Float:
        return None
    _, mantissa, exponent, bits = number._mpf_
    if bits > 53 or not -1000 < exponent < 900:
        value = float(number)
        return (value, value) if math.isfinite(value) and value else None
    value = math.ldexp(-mantissa if number._mpf_[0] else mantissa, exponent)
    return value, value


def digest(parts: Iterable[object]) -> str:
    """Return a hash of the texts of some values."""
    return hashlib.sha256(repr(list(parts)).encode()).hexdigest()
