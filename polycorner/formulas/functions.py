"""Smooth functions on a manifold: one SymPy expression gives value, gradient and Hessian."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.formulas.programs import Program
from polycorner.formulas.translate import compile_expressions
from polycorner.spaces.manifold import Array, Manifold, finite, reals, scalar

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.kernels import Kernel

    Expressions = Mapping[str, sympy.Expr]


@dataclass(frozen=True, eq=False)
class Family:
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
    """

    names: tuple[str, ...]
    variables: tuple[str, ...]
    parameters: tuple[str, ...]
    formulas: "Callable[[], tuple[Expressions, Expressions]]"
    key: str = ""

    @classmethod
    def of(
        cls,
        expressions: "Mapping[str, Any]",
        variables: Iterable[str],
        parameters: Iterable[str] = (),
        definitions: "Mapping[str, Any] | None" = None,
    ) -> "Family":
        """Return the family of given expressions, checking every symbol at once."""
        variables, parameters = tuple(variables), tuple(parameters)
        _check_new("parameters", parameters, variables)
        _check_new("definitions", tuple(definitions or ()), variables + parameters)
        given = {name: _sympified(name, e) for name, e in expressions.items()}
        known = {name: _sympified(name, e) for name, e in (definitions or {}).items()}
        family = cls(tuple(given), tuple(variables), tuple(parameters), lambda: (known, given))
        return cls(
            family.names,
            family.variables,
            family.parameters,
            family.formulas,
            family.program().digest(),
        )

    def program(self) -> Program:
        """Return the straight-line program of the values."""
        definitions, expressions = self.formulas()
        ordered = [expressions[name] for name in self.names]
        return compile_expressions(
            ordered, self.variables, self.parameters, definitions, self.names
        )

    @cached_property
    def kernel(self) -> "Kernel":
        """The compiled functions."""
        from polycorner.formulas.kernels import Kernel

        return Kernel(
            self.key,
            self.program,
            variables=len(self.variables),
            parameters=len(self.parameters),
            outputs=len(self.names),
        )

    def expression(self, name: str) -> "sympy.Expr":
        """Return one function with all definitions written out."""
        import sympy

        definitions, expressions = self.formulas()
        written: dict[str, sympy.Expr] = {}

        def expand(e: "sympy.Expr") -> "sympy.Expr":
            return e.xreplace({s: written[s.name] for s in e.free_symbols if s.name in written})

        for definition, e in definitions.items():
            written[definition] = expand(e)
        return expand(expressions[name])


class SmoothFunction:
    """A smooth function ``f`` on a manifold.

    Parameters
    ----------
    name : str
        What the function is called in strata and certificates.
    expression : sympy.Expr
        Written in the manifold's coordinates (or in ``variables``) and in parameters.
    manifold : Manifold
        Where it lives.
    parameters : mapping from str to float, optional
        Values of the expression's other symbols.
    variables : sequence of str, optional
        Formal names used in the expression; default the coordinates' own names.
    reads : sequence of str, optional
        The coordinates bound to ``variables``, in order.
    definitions : mapping from str to sympy.Expr, optional
        Intermediate quantities the expression uses by name.

    Raises
    ------
    ValueError
        If a symbol is neither coordinate nor parameter, or a function has no compiled form.

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
        definitions: "Expressions | None" = None,
    ) -> None:
        if not isinstance(manifold, Manifold):
            msg = f"manifold: expected a Manifold; got {type(manifold).__name__}"
            raise TypeError(msg)
        values = {str(symbol): value for symbol, value in (parameters or {}).items()}
        formal = tuple(variables or manifold.names)
        family = Family.of({name: expression}, formal, values, definitions)
        self._bind(family, name, manifold, tuple(reads or formal), tuple(values.values()))

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

    @cached_property
    def _bundle(self) -> "Bundle":
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


@dataclass(frozen=True, eq=False)
class Call:
    """One call of a family's kernel: which coordinates go in, which rows come out."""

    family: Family
    reads: tuple[int, ...]
    parameters: Array
    rows: tuple[int, ...]
    columns: tuple[int, ...]


class _Batch:
    """Calls of one kernel that differ only in what they read: one call over all of them."""

    def __init__(self, calls: Sequence[Call]) -> None:
        first = calls[0]
        self.kernel, self.parameters = first.family.kernel, first.parameters
        self.address = self.parameters.ctypes.data  # of an array that this value keeps alive
        self.reads = np.array([call.reads for call in calls])
        everything = first.columns == tuple(range(len(first.family.names)))
        self.columns: Any = np.s_[:] if everything else list(first.columns)
        rows, reads = np.array([call.rows for call in calls]), self.reads
        self.places: tuple[tuple[Any, ...], ...] = (
            (rows,),
            (rows[:, :, None], reads[:, None, :]),
            (rows[:, :, None, None], reads[:, None, :, None], reads[:, None, None, :]),
        )

    def scatter(self, q: Array, results: tuple[Array, ...]) -> None:
        """Evaluate at every row of ``q`` ``(N, n)`` and put what comes out in its place."""
        count, order = len(self.reads), len(results) - 1
        inputs = q[:, self.reads].reshape(len(q) * count, self.reads.shape[1])
        parts = self.kernel.over(inputs, self.address, order)
        for result, part, place in zip(results, parts, self.places, strict=False):
            shaped = part.reshape(len(q), count, *part.shape[1:])
            result[(slice(None), *place)] = shaped[:, :, self.columns]

    def scatter_point(self, q: Array, results: tuple[Array, ...]) -> None:
        """Evaluate at the point ``q`` ``(n,)`` and put what comes out in its place."""
        order = len(results) - 1
        if len(self.reads) == 1:
            single = self.kernel.at(q[self.reads[0]], self.address, order)
            parts = tuple([part[None] for part in single])
        else:
            parts = self.kernel.over(q[self.reads], self.address, order)
        for result, part, place in zip(results, parts, self.places, strict=False):
            result[place] = part[:, self.columns]


class Bundle:
    """Several functions on one manifold, evaluated together in as few calls as possible.

    Attributes
    ----------
    calls : list of Call
        One call for each family, choice of coordinates and choice of parameters.
    """

    def __init__(self, manifold: Manifold, functions: Sequence[SmoothFunction]) -> None:
        self.manifold, self.functions = manifold, tuple(functions)
        grouped: dict[tuple[int, tuple[int, ...], tuple[float, ...]], list[int]] = {}
        for row, f in enumerate(self.functions):
            grouped.setdefault((id(f.family), f.reads, f.parameters), []).append(row)
        self.calls = [self._call(rows) for rows in grouped.values()]
        only = self.calls[0] if len(self.calls) == 1 else None
        self._direct = only if only is not None and self._is_direct(only) else None

    def _call(self, rows: list[int]) -> Call:
        first = self.functions[rows[0]]
        columns = [first.family.names.index(self.functions[row].member_name) for row in rows]
        numbers = np.array(first.parameters, dtype=np.float64)
        return Call(first.family, first.reads, numbers, tuple(rows), tuple(columns))

    def _is_direct(self, call: Call) -> bool:
        n, m = self.manifold.dimension, len(call.family.names)
        return call.reads == tuple(range(n)) and call.columns == tuple(range(m))

    @cached_property
    def _batches(self) -> list[_Batch]:
        grouped: dict[tuple[int, bytes, tuple[int, ...]], list[Call]] = {}
        for call in self.calls:
            key = (id(call.family), call.parameters.tobytes(), call.columns)
            grouped.setdefault(key, []).append(call)
        return [_Batch(calls) for calls in grouped.values()]

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values ``(..., m)``, gradients ``(..., m, n)``, Hessians ``(..., m, n, n)``.

        ``q`` must be a float64 array ``(..., n)``; nothing is checked here.
        """
        if q.ndim == 1:
            return self._at(q, order)
        flat = q.reshape(-1, q.shape[-1])
        if self._direct is not None:
            call = self._direct
            results = call.family.kernel.over(flat, call.parameters.ctypes.data, order)
        else:
            results = tuple([np.zeros((len(flat), *shape)) for shape in self._shapes(order)])
            for batch in self._batches:
                batch.scatter(flat, results)
        outer = q.shape[:-1]
        return tuple([result.reshape(outer + result.shape[1:]) for result in results])

    def _at(self, q: Array, order: int) -> tuple[Array, ...]:
        if self._direct is not None:
            batch = self._batches[0]
            return batch.kernel.at(q, batch.address, order)
        results = tuple([np.zeros(shape) for shape in self._shapes(order)])
        for batch in self._batches:
            batch.scatter_point(q, results)
        return results

    def _shapes(self, order: int) -> tuple[tuple[int, ...], ...]:
        m, n = len(self.functions), self.manifold.dimension
        return ((m,), (m, n), (m, n, n))[: order + 1]


def _check_new(argument: str, names: Sequence[str], taken: Sequence[str]) -> None:
    hidden = [name for name in names if name in taken]
    if hidden:
        msg = f"{argument}: expected names other than {', '.join(taken)}; got {', '.join(hidden)}"
        raise ValueError(msg)


def _sympified(name: str, expression: object) -> "sympy.Expr":
    import sympy

    if isinstance(expression, str):
        msg = f"{name}: expected a SymPy expression; got the string {expression!r}"
        raise TypeError(msg)
    try:
        result = sympy.sympify(expression, strict=True)
    except sympy.SympifyError as error:
        msg = f"{name}: expected a SymPy expression; got {expression!r}"
        raise TypeError(msg) from error
    if isinstance(result, sympy.core.relational.Relational):
        msg = f"{name}: expected f, meaning f >= 0, instead of an inequality; got {result}"
        raise TypeError(msg)
    if not isinstance(result, sympy.Expr):
        msg = f"{name}: expected a SymPy expression; got {type(expression).__name__}"
        raise TypeError(msg)
    return result
