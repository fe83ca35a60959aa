"""Smooth functions on a manifold: one SymPy expression gives value, gradient and Hessian."""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.expressions import announce, check_periodic
from polycorner.formulas.families import Family
from polycorner.formulas.signs import check_even
from polycorner.spaces.arguments import finite, reals, scalar
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value

if TYPE_CHECKING:
    import sympy


def _words(argument: str, names: Sequence[str] | None) -> tuple[str, ...]:
    if names is None:
        return ()
    if isinstance(names, str) or not isinstance(names, Sequence):
        checks.refuse(argument, "a sequence of coordinate names", names, TypeError)
    return tuple(names)


class SmoothFunction(Value):
    """A smooth function ``f`` on a manifold.

    Parameters
    ----------
    name : str
        The function's name in strata and certificates.
    expression : sympy.Expr
        Written in the manifold's coordinates (or in ``variables``) and in parameters.
    manifold : Manifold
        Its domain.
    parameters : mapping from str to float, optional
        Values of the expression's other symbols.
    variables : sequence of str, optional
        Formal names used in the expression; default the coordinates' own names.
    reads : sequence of str, optional
        The coordinates bound to ``variables``, in order.
    definitions : mapping from str to sympy.Expr, optional
        Intermediate quantities the expression uses by name.
    unit : str, optional
        Unit of the values, shown in tables and files; none by default.

    Raises
    ------
    ValueError
        If a symbol is neither coordinate nor parameter, a function has no compiled form, or the
        expression is not periodic in a coordinate that is a circle.

    Warns
    -----
    NonsmoothWarning
        If derivatives may jump: the expression contains ``Abs``, ``Min``, ``Max`` or ``Piecewise``.

    Examples
    --------
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> f = SmoothFunction("bowl", y - x**2, M)
    >>> f.value([2.0, 5.0]), f.gradient([2.0, 5.0]).tolist()
    (1.0, [-4.0, 1.0])
    """

    def __init__(
        self,
        name: str,
        expression: "sympy.Expr",
        manifold: Manifold,
        *,
        parameters: Mapping[str, float] | None = None,
        variables: Sequence[str] | None = None,
        reads: Sequence[str] | None = None,
        definitions: "Mapping[str, sympy.Expr] | None" = None,
        unit: str = "",
    ) -> None:
        checks.instance("manifold", manifold, Manifold)
        checks.instance("name", name, str)
        for argument, given in (("parameters", parameters), ("definitions", definitions)):
            checks.mapping(argument, {} if given is None else given)
        values = {str(symbol): value for symbol, value in (parameters or {}).items()}
        formal = _words("variables", variables) or manifold.names
        bound = _words("reads", reads) or formal
        family = Family.of({name: expression}, formal, values, definitions, unit=unit)
        self._bind(family, name, manifold, bound, tuple(values.values()))
        check_function(self)

    @classmethod
    def member(
        cls,
        family: Family,
        name: str,
        manifold: Manifold,
        *,
        parameters: Sequence[float] = (),
        reads: Sequence[str] | None = None,
        label: str | None = None,
    ) -> "SmoothFunction":
        """Return a function of a family, bound to coordinates and parameter values."""
        function = cls.__new__(cls)
        reads = tuple(reads or family.variables)
        cls._bind(function, family, name, manifold, reads, tuple(parameters), label)
        return function

    @classmethod
    def quantity(cls, name: str, expression: "sympy.Expr", manifold: Manifold) -> "SmoothFunction":
        """Return a quantity to be read off near a point; unlike others it need not be periodic.

        An angle is such a quantity: a function on the line that is wound on the circle.
        """
        return cls.member(Family.of({name: expression}, manifold.names), name, manifold)

    def _bind(
        self,
        family: Family,
        name: str,
        manifold: Manifold,
        reads: tuple[str, ...],
        parameters: tuple[float, ...],
        label: str | None = None,
    ) -> None:
        unknown = [coordinate for coordinate in reads if coordinate not in manifold.names]
        if unknown or len(set(reads)) != len(reads) or len(reads) != len(family.variables):
            msg = (
                f"reads: expected {len(family.variables)} different ones of the coordinates "
                f"{', '.join(manifold.names)}; got {', '.join(reads)}"
            )
            raise ValueError(msg)
        numbers = finite(reals(parameters or np.empty(0), "parameters"), "parameters")
        if numbers.shape != (len(family.parameters),):
            msg = f"parameters: expected {len(family.parameters)} numbers; got {numbers.shape}"
            raise ValueError(msg)
        self.family, self.member_name, self.manifold = family, name, manifold
        self.name = label or name
        self.reads = tuple(manifold.names.index(coordinate) for coordinate in reads)
        self.parameters = tuple(numbers.tolist())

    def renamed(self, name: str) -> "SmoothFunction":
        """Return the same function under another name."""
        reads = [self.manifold.names[i] for i in self.reads]
        return SmoothFunction.member(
            self.family,
            self.member_name,
            self.manifold,
            parameters=self.parameters,
            reads=reads,
            label=name,
        )

    def __repr__(self) -> str:
        """Return the name and what the function reads."""
        return (
            f"SmoothFunction({self.name!r}, reads {[self.manifold.names[i] for i in self.reads]})"
        )

    @property
    def unit(self) -> str:
        """The unit of the values, ``""`` if none is stated."""
        return self.family.unit

    @property
    def kinks(self) -> tuple[str, ...]:
        """The parts of the expression across which derivatives may jump, as text."""
        return self.family.kinks.get(self.member_name, ())

    @property
    def expression(self) -> "sympy.Expr":
        """The SymPy expression in coordinates and parameter symbols."""
        import sympy

        formal = self.family.expression(self.member_name)
        renamed = {
            name: sympy.Symbol(self.manifold.names[i], real=True)
            for name, i in zip(self.family.variables, self.reads, strict=True)
        }
        return formal.xreplace(
            {s: renamed[s.name] for s in formal.free_symbols if s.name in renamed}
        )

    @property
    def parameter_values(self) -> dict[str, float]:
        """The values of its parameters, by name."""
        return dict(zip(self.family.parameters, self.parameters, strict=True))

    @cached_property
    def _bundle(self) -> Bundle:
        return Bundle(self.manifold, (self,))

    def value(self, q: ArrayLike) -> Any:
        """Return ``f(q)``, shape ``(...)`` for points ``(..., n)``."""
        return scalar(self._bundle.evaluate(self.manifold.points(q), 0)[0][..., 0])

    def gradient(self, q: ArrayLike) -> Array:
        """Return the partial derivatives ``(..., n)``."""
        return self._bundle.evaluate(self.manifold.points(q), 1)[1][..., 0, :]

    def hessian(self, q: ArrayLike) -> Array:
        """Return the second partial derivatives ``(..., n, n)``."""
        return self._bundle.evaluate(self.manifold.points(q), 2)[2][..., 0, :, :]


def check_function(function: SmoothFunction, *, periodic: bool = True) -> None:
    """Warn of kinks; raise ValueError for a function that should be periodic and is not.

    A section, such as ``sin((a + b) / 2) = 0``, may change its sign, or fix an angle in one chart.
    """
    announce(function.name, function.kinks)
    if periodic and function.manifold.rotations:
        check_even(function.name, function.expression, function.manifold, function.parameter_values)
    if periodic and any(map(math.isfinite, (function.manifold.periods[i] for i in function.reads))):
        family = function.family
        check_periodic(
            function.name,
            family.expression(function.member_name),
            function.manifold,
            dict(zip(family.variables, function.reads, strict=True)),
            dict(zip(family.parameters, function.parameters, strict=True)),
        )
