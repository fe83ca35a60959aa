"""Functions on one manifold evaluated together in as few calls of kernels as possible."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from polycorner.formulas.families import Family
from polycorner.formulas.shapes import FormulaShape
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value, cached_property


class BoundFunction(Protocol):
    """A function of a family, bound to coordinates and parameters."""

    @property
    def family(self) -> Family:
        """The family."""

    @property
    def member_name(self) -> str:
        """The function's name in it."""

    @property
    def reads(self) -> tuple[int, ...]:
        """Positions of the coordinates it reads."""

    @property
    def parameters(self) -> tuple[float, ...]:
        """Values of the parameters."""


@dataclass(frozen=True, eq=False)
class Call(Value):
    """One call of a kernel: which coordinates go in, which rows come out."""

    family: Family | FormulaShape
    reads: tuple[int, ...]
    parameters: Array
    rows: tuple[int, ...]
    columns: tuple[int, ...]


def resolve(
    f: BoundFunction,
) -> tuple[Family | FormulaShape, tuple[int, ...], tuple[float, ...], int]:
    """Return what evaluates a function: kernel, coordinates, parameters and column."""
    binding = f.family.bindings.get(f.member_name)
    if binding is None:
        return f.family, f.reads, f.parameters, f.family.names.index(f.member_name)
    reads = tuple([f.reads[i] for i in binding.reads])
    return binding.shape, reads, (*f.parameters, *binding.numbers), 0


def _run(positions: tuple[int, ...]) -> slice | None:
    """Return successive positions as a slice."""
    run = slice(positions[0], positions[0] + len(positions)) if positions else slice(0)
    return run if positions == tuple(range(run.start or 0, run.stop)) else None


class _Batch:
    """Calls of one kernel with different coordinates or parameters: one call over all of them."""

    def __init__(self, calls: Sequence[Call]) -> None:
        first = calls[0]
        self.kernel = first.family.kernel
        same = len({call.parameters.tobytes() for call in calls}) == 1
        numbers = [first.parameters] if same else [call.parameters for call in calls]
        self.parameters = np.array(numbers)
        self.period = len(numbers)
        self.address = self.parameters.ctypes.data  # of an array that this value keeps alive
        everything = first.columns == tuple(range(len(first.family.names)))
        self.columns: Any = None if everything else list(first.columns)
        rows, reads = np.array([call.rows for call in calls]), np.array([c.reads for c in calls])
        self.reads: Any = reads
        self.places: tuple[tuple[Any, ...], ...] = (
            (..., rows),
            (..., rows[:, :, None], reads[:, None, :]),
            (..., rows[:, :, None, None], reads[:, None, :, None], reads[:, None, None, :]),
        )
        row, read = _run(first.rows), _run(first.reads)
        if len(calls) == 1 and row is not None and read is not None:  # a block, copied as one
            self.reads = read
            self.places = (..., row), (..., row, read), (..., row, read, read)

    def scatter(self, q: Array, results: tuple[Array, ...]) -> None:
        """Evaluate at the point or points ``q`` ``(..., n)`` and scatter the results."""
        order, inputs = len(results) - 1, q[..., self.reads]
        outer, variables = inputs.shape[:-1], inputs.shape[-1]
        if not outer or outer == (1,):
            parts = self.kernel.at(inputs.reshape(variables), self.address, order)
        else:
            parts = self.kernel.over(
                inputs.reshape(-1, variables), self.address, order, self.period
            )
        for k, (result, part, place) in enumerate(zip(results, parts, self.places, strict=False)):
            block = part.reshape(*outer, *part.shape[-1 - k :])
            if self.columns is not None:
                block = block[(..., self.columns, *(np.s_[:],) * k)]
            result[place] = block


class Bundle(Value):
    """Several functions on one manifold, evaluated together in as few calls as possible.

    Attributes
    ----------
    calls : list of Call
        One call for each family, choice of coordinates and choice of parameters.
    """

    def __init__(self, manifold: Manifold, functions: Sequence[BoundFunction]) -> None:
        self.manifold, self.functions = manifold, tuple(functions)
        grouped: dict[Any, list[tuple[int, int]]] = {}
        resolved: dict[Any, tuple[Family | FormulaShape, tuple[int, ...], Array]] = {}
        for row, f in enumerate(self.functions):
            family, reads, numbers, column = resolve(f)
            key = (family.key or id(family), reads, numbers)
            grouped.setdefault(key, []).append((row, column))
            if key not in resolved:
                resolved[key] = (family, reads, np.array(numbers, dtype=np.float64))
        self.calls = [
            Call(*resolved[key], *map(tuple, zip(*places, strict=True)))
            for key, places in grouped.items()
        ]
        only = self.calls[0] if len(self.calls) == 1 else None
        self._direct = only if only is not None and self._is_direct(only) else None

    def _is_direct(self, call: Call) -> bool:
        n, m = self.manifold.size, len(call.family.names)
        return call.reads == tuple(range(n)) and call.columns == tuple(range(m))

    @cached_property
    def _batches(self) -> list[_Batch]:
        grouped: dict[Any, list[Call]] = {}
        for call in self.calls:
            key = (call.family.key or id(call.family), call.columns)
            grouped.setdefault(key, []).append(call)
        return [_Batch(calls) for calls in grouped.values()]

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values ``(..., m)``, gradients ``(..., m, n)``, Hessians ``(..., m, n, n)``.

        ``q`` must be a float64 array ``(..., n)``; nothing is checked here.
        """
        if self._direct is None:
            results = tuple([np.zeros(q.shape[:-1] + shape) for shape in self._shapes(order)])
            for batch in self._batches:
                batch.scatter(q, results)
            return results
        batch = self._batches[0]
        if q.ndim == 1:
            return batch.kernel.at(q, batch.address, order)
        results = batch.kernel.over(q.reshape(-1, q.shape[-1]), batch.address, order)
        return tuple([result.reshape(q.shape[:-1] + result.shape[1:]) for result in results])

    def tabulated(self, *orders: int) -> dict[str, Any]:
        """Return the calls as tables for compiled code.

        Returns
        -------
        dict
            ``calls``, of each the addresses of the code for the ``orders`` of derivatives, how many
            variables go in and outputs come out, and where its entries begin in the others:
            ``reads``, the coordinates; ``outputs``, the row of every output, or -1;
            ``parameters``.  ``size`` is that of an array for inputs and outputs of one call.
        """
        calls: list[tuple[int, ...]] = []
        reads: list[int] = []
        outputs: list[int] = []
        parameters: list[float] = []
        size = 1
        for call in self.calls:
            kernel = call.family.kernel
            k, m = kernel.variables, kernel.outputs
            code = [kernel.compiled(order).point for order in orders]
            for where in _layers(call.columns, call.rows):
                calls.append((*code, k, m, len(reads), len(outputs), len(parameters)))
                reads += call.reads
                outputs += [where.get(column, -1) for column in range(m)]
                parameters += call.parameters.tolist()
            size = max(size, k + m * (1 + k + k * k))
        return {
            "calls": np.reshape(calls, (-1, len(orders) + 5)),
            "reads": reads,
            "outputs": outputs,
            "parameters": [*parameters, 0.0],
            "size": size,
        }

    def _shapes(self, order: int) -> tuple[tuple[int, ...], ...]:
        m, n = len(self.functions), self.manifold.size
        return ((m,), (m, n), (m, n, n))[: order + 1]


def _layers(columns: tuple[int, ...], rows: tuple[int, ...]) -> list[dict[int, int]]:
    """Split (output, row) pairs into parts in which every output occurs at most once."""
    layers: list[dict[int, int]] = []
    for column, row in zip(columns, rows, strict=True):
        free = next((layer for layer in layers if column not in layer), None)
        if free is None:
            layers.append({column: row})
        else:
            free[column] = row
    return layers
