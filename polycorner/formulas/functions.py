"""Smooth functions on a manifold: one SymPy expression gives value, gradient and Hessian."""

from collections.abc import Container, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.checks import reals
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.expressions import as_expression, substitute
from polycorner.formulas.families import Family
from polycorner.formulas.periodicity import check_function
from polycorner.kinds import checked
from polycorner.spaces.arguments import finite, scalar
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value, cached_property

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.rows import SparseRows


def _words(argument: str, names: Sequence[str] | None) -> tuple[str, ...]:
    if names is None:
        return ()
    if isinstance(names, str) or not isinstance(names, Sequence):
        checks.refuse(argument, "a sequence of coordinate names", names, TypeError)
    return tuple(checks.instance(argument, name, str) for name in names)


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
        expressions = {name: as_expression(name, expression)}
        family = Family.of(expressions, formal, values, definitions, unit=unit)
        self._bind(family, name, manifold, bound, tuple(values.values()))
        check_function(self)

    @classmethod
    @checked
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
        reads = tuple(family.variables if reads is None else reads) or family.variables
        cls._bind(function, family, name, manifold, reads, tuple(parameters), label)
        return function

    @classmethod
    @checked
    def quantity(cls, name: str, expression: "sympy.Expr", manifold: Manifold) -> "SmoothFunction":
        """Return a quantity to be read off near a point; unlike others it need not be periodic.

        An angle is such a quantity: a function on the line that is wound on the circle.
        """
        expressions = {name: as_expression(name, expression)}
        return cls.member(Family.of(expressions, manifold.names), name, manifold)

    @classmethod
    @checked
    def sum(cls, name: str, terms: "Iterable[SmoothFunction]") -> "SmoothFunction":
        """Return a sum of functions of few coordinates each, such as the energies of many springs.

        Large polyhedra with sparse matrices need the energy in this form.

        Parameters
        ----------
        name : str
            The sum's name.
        terms : iterable of SmoothFunction
            On one manifold.  Parameters of one name and one value are one parameter of the sum;
            those of one name and several values are numbers in it.

        Raises
        ------
        TypeError, ValueError
            For other terms, for none, or for terms on several manifolds.

        Examples
        --------
        >>> M = Manifold.euclidean("x y z")
        >>> spring = Family.of({"spring": (M.symbols[1] - M.symbols[0]) ** 2 / 2}, "xy")
        >>> pairs = [("x", "y"), ("y", "z")]
        >>> E = SmoothFunction.sum(
        ...     "springs", [SmoothFunction.member(spring, "spring", M, reads=p) for p in pairs]
        ... )
        >>> E.value([0.0, 1.0, 3.0]), E.gradient([0.0, 1.0, 3.0]).tolist()
        (2.5, [-1.0, -1.0, 2.0])
        """
        parts = tuple(terms)
        for part in parts:
            checks.instance("terms", part, SmoothFunction)
        if not parts or any(part.manifold != parts[0].manifold for part in parts):
            checks.refuse("terms", "at least one function, all on one manifold", parts[:3])
        return _Sum(name, parts)

    def _bind(
        self,
        family: Family,
        name: str,
        manifold: Manifold,
        reads: tuple[str, ...],
        parameters: tuple[float, ...],
        label: str | None = None,
    ) -> None:
        known = manifold.positions
        unknown = [name for name in reads if name not in known]
        if unknown or len(set(reads)) != len(reads) or len(reads) != len(family.variables):
            different = f"{len(family.variables)} different ones of the coordinates"
            checks.refuse("reads", f"{different} {', '.join(manifold.names)}", reads)
        numbers = finite(reals("parameters", parameters or np.empty(0)), "parameters")
        if numbers.shape != (len(family.parameters),):
            checks.refuse("parameters", f"{len(family.parameters)} numbers", numbers.shape)
        self._family, self.member_name, self.manifold = family, name, manifold
        self.name = label or name
        places = tuple([known[coordinate] for coordinate in reads])
        self._reads = manifold.everything if places == manifold.everything else places
        self._parameters = tuple(numbers.tolist())

    @property
    def family(self) -> Family:
        """The family of formulas that it belongs to."""
        return self._family

    @property
    def reads(self) -> tuple[int, ...]:
        """Positions of the coordinates that it reads."""
        return self._reads

    @property
    def parameters(self) -> tuple[float, ...]:
        """The values of the family's parameters."""
        return self._parameters

    @property
    def terms(self) -> "tuple[SmoothFunction, ...]":
        """The functions whose sum it is: itself alone, unless it was made by :meth:`sum`."""
        return (self,)

    @checked
    def renamed(self, name: str) -> "SmoothFunction":
        """Return the same function under another name."""
        reads = [self.manifold.names[i] for i in self.reads]
        bound: Any = {"parameters": self.parameters, "reads": reads, "label": name}
        return SmoothFunction.member(self.family, self.member_name, self.manifold, **bound)

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
        found = {s: renamed[s.name] for s in formal.free_symbols if s.name in renamed}
        return substitute(formal, found)

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


class _Sum(SmoothFunction):
    """A sum of functions, evaluated term by term; one formula only where that is asked for."""

    def __init__(self, name: str, terms: tuple[SmoothFunction, ...]) -> None:
        self.name = self.member_name = name
        self.manifold = terms[0].manifold
        self._terms = tuple([part for term in terms for part in term.terms])

    def renamed(self, name: str) -> SmoothFunction:
        """Return the same sum under another name."""
        return _Sum(name, self._terms)

    def __repr__(self) -> str:
        """Return the name and the number of terms."""
        return f"SmoothFunction.sum({self.name!r}, {len(self._terms)} terms)"

    @cached_property
    def _whole(self) -> SmoothFunction:
        """The sum as one formula."""
        import sympy

        values: dict[str, set[float]] = {}
        for term in self._terms:
            for parameter, value in term.parameter_values.items():
                values.setdefault(parameter, set()).add(value)
        shared = {p: found for p, (found, *others) in values.items() if not others}
        written = sympy.Add(*[with_numbers(term, shared) for term in self._terms])
        family = Family.of({self.name: written}, self.manifold.names, shared, unit=self.unit)
        numbers = tuple(shared.values())
        return SmoothFunction.member(family, self.name, self.manifold, parameters=numbers)

    @property
    def terms(self) -> tuple[SmoothFunction, ...]:
        return self._terms

    @property
    def family(self) -> Family:
        return self._whole.family

    @property
    def reads(self) -> tuple[int, ...]:
        return self._whole.reads

    @property
    def parameters(self) -> tuple[float, ...]:
        return self._whole.parameters

    @property
    def unit(self) -> str:
        return self._terms[0].unit

    @property
    def kinks(self) -> tuple[str, ...]:
        return tuple([kink for term in self._terms for kink in term.kinks])

    @cached_property
    def _rows(self) -> "SparseRows":
        from polycorner.formulas.rows import SparseRows

        return SparseRows.of(self._terms, self.manifold.size)

    def value(self, q: ArrayLike) -> Any:
        points = self.manifold.points(q)
        flat = points.reshape(-1, points.shape[-1])
        sums = np.array([self._rows.values(point).sum() for point in flat])
        return scalar(sums.reshape(points.shape[:-1]))

    def gradient(self, q: ArrayLike) -> Array:
        points = self.manifold.points(q)
        flat = points.reshape(-1, self.manifold.size)
        slopes = [self._rows.evaluate(point)[1].sum(axis=0) for point in flat]
        return np.array(slopes, dtype=np.float64).reshape(points.shape)


def with_numbers(function: SmoothFunction, shared: Container[str] = ()) -> "sympy.Expr":
    """Return an expression with numbers in place of all parameters but those that are shared."""
    import sympy

    own = {p: value for p, value in function.parameter_values.items() if p not in shared}
    written = function.expression
    numbers = {s: sympy.Float(own[s.name]) for s in written.free_symbols if s.name in own}
    return substitute(written, numbers)
