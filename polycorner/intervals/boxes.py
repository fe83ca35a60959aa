"""Enclosures of functions on many boxes at once, compiled.

The formulas are those of :mod:`~polycorner.intervals.enclosures`, with exact constants, evaluated
in double precision with outward rounding: a fast and coarser companion of ball arithmetic, for
searches that look at millions of boxes.
"""

from collections.abc import Sequence
from functools import lru_cache
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner import checks
from polycorner.formulas.adjoints import derivatives
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.interval_kernels import IntervalKernel
from polycorner.formulas.programs import Graph, Program
from polycorner.intervals.enclosures import exact_program, written
from polycorner.spaces.manifold import Array, Manifold


class BoxFunctions:
    """Functions on a manifold, enclosed on batches of boxes by compiled interval arithmetic.

    All functions share one graph and one routine for each order of derivatives.  Bounds of a
    number that may be undefined or unbounded somewhere in the box are infinite: quotients whose
    denominator may be smaller than ``2**-200`` in absolute value, square roots and logarithms
    that reach below their domain, exponential functions beyond ``600``, coordinates beyond
    ``2**40``, and what may overflow.

    An undecided branch is enclosed by the hull of both branches; ``Min``, ``Max``, ``Abs`` and
    clamps are enclosed sharply.  Gradients on such a box enclose the derivatives of both branches;
    where :meth:`continuous` is true they contain Clarke's generalised gradient, so that the mean
    value theorem holds with them ([Clarke] sec. 2.3).

    Parameters
    ----------
    functions : sequence of SmoothFunction
        The functions to enclose.
    manifold : Manifold
        Their domain, of dimension ``n``.
    rounding : str, optional
        ``"embedded"`` or ``"stepped"`` (:mod:`~polycorner.formulas.rounding`); default the best
        that this processor has.

    Attributes
    ----------
    names : tuple of str
        Names of the ``m`` functions.
    dimension : int
        ``n``.
    """

    def __init__(
        self, functions: Sequence[SmoothFunction], manifold: Manifold, *, rounding: str = ""
    ) -> None:
        checks.instance("manifold", manifold, Manifold)
        self.functions = tuple(functions)
        self.names, self.dimension = tuple(f.name for f in self.functions), manifold.size
        self.rounding = rounding
        self.graph = Graph()
        self._kernels: dict[tuple[int, str], tuple[IntervalKernel, list[int]]] = {}
        self._making = RLock()  # of kernels, for which threads write into the one graph

    def values(self, lo: ArrayLike, hi: ArrayLike) -> tuple[Array, Array]:
        """Return lower and upper bounds ``(B, m)`` of values on boxes ``lo <= hi`` ``(B, n)``."""
        low, high = self._evaluate(lo, hi, 0)
        return low, high

    def gradients(
        self,
        lo: ArrayLike,
        hi: ArrayLike,
        *,
        mean_value: bool = False,
        monotone: bool = False,
    ) -> tuple[Array, ...]:
        """Return bounds of values ``(B, m)`` and of first derivatives ``(B, m, n)``.

        In the order lower values, upper values, lower derivatives, upper derivatives.

        Parameters
        ----------
        lo, hi : (B, n) array
            The boxes.
        mean_value, monotone : bool, optional
            Intersect the bounds of values with those of the mean value form, or with those on the
            faces where a monotone function is least and greatest
            (:class:`~polycorner.formulas.interval_kernels.Sharper`).  At most one of them.
        """
        if mean_value and monotone:
            checks.refuse("mean_value, monotone", "at most one form", (True, True))
        form = "mean value" if mean_value else "monotone" if monotone else "natural"
        return self._evaluate(lo, hi, 1, form)

    def hessians(self, lo: ArrayLike, hi: ArrayLike) -> tuple[Array, ...]:
        """Return what :meth:`gradients` does, and bounds of second derivatives ``(B, m, n, n)``."""
        return self._evaluate(lo, hi, 2)

    def mean_value_gradients(
        self, lo: ArrayLike, hi: ArrayLike, *, hessians: bool = False
    ) -> tuple[Array, ...]:
        """Return bounds of first derivatives ``(B, m, n)``, with those of their mean value form.

        By second derivatives on the box, and by the gradients in its middle; the bounds of a
        derivative that may not be continuous on the box are those of :meth:`gradients`.  With
        ``hessians`` the bounds of second derivatives ``(B, m, n, n)`` follow.
        """
        low, high = self._boxes(lo, hi)
        kernel, entries = self._kernel(2, "slopes")
        count, n, m = len(entries), self.dimension, len(self.functions)
        parts = tuple(
            [np.zeros((len(low), count, *shape)) for shape in ((), (n,)) for _ in range(2)]
        )
        kernel.fill(low, high, parts)
        sides = []
        for part in parts if hessians else parts[:2]:
            side = np.zeros((len(low), m * n, *part.shape[2:]))
            side[:, entries] = part
            sides.append(side.reshape(len(low), m, n, *part.shape[2:]))
        return tuple(sides)

    def continuous(self, lo: ArrayLike, hi: ArrayLike) -> NDArray[np.bool_]:
        """Return ``(B, m)`` whether a function is bounded and continuous on a box, for certain.

        It is if all branches it depends on are decided or are ``Min``, ``Max``, ``Abs`` or a clamp.
        """
        return self._are_continuous(lo, hi, 0)

    def differentiable(self, lo: ArrayLike, hi: ArrayLike) -> NDArray[np.bool_]:
        """Return ``(B, m)`` whether first derivatives are bounded and continuous, for certain."""
        low, high = self._boxes(lo, hi)
        found = self._are_continuous(low, high, 1)
        return np.asarray(found.reshape(len(low), len(self.functions), -1).all(axis=2))

    def _are_continuous(self, lo: ArrayLike, hi: ArrayLike, order: int) -> NDArray[np.bool_]:
        low, high = self._boxes(lo, hi)
        kernel, entries = self._kernel(order, "continuity")
        found = np.zeros((len(low), len(entries)))
        kernel.fill(low, high, [found])
        result = np.ones((len(low), len(self.functions) * self.dimension**order), dtype=np.bool_)
        result[:, entries] = found > 0
        return result

    def _evaluate(
        self, lo: ArrayLike, hi: ArrayLike, order: int, form: str = "natural"
    ) -> tuple[Array, ...]:
        low, high = self._boxes(lo, hi)
        m, n = len(self.functions), self.dimension
        shapes = ((m,), (m, n), (m, n, n))[: order + 1]
        results = tuple([np.zeros((len(low), *shape)) for shape in shapes for _ in range(2)])
        self._kernel(order, form)[0].fill(low, high, results)
        return results

    def _boxes(self, lo: ArrayLike, hi: ArrayLike) -> tuple[Array, Array]:
        check_arithmetic()
        low, high = (np.ascontiguousarray(side, dtype=np.float64) for side in (lo, hi))
        if low.shape != high.shape or low.ndim != 2 or low.shape[1] != self.dimension:
            expected = f"two arrays of boxes (B, {self.dimension})"
            checks.refuse("lo, hi", expected, (low.shape, high.shape))
        return low, high

    def _kernel(self, order: int, form: str = "natural") -> tuple[IntervalKernel, list[int]]:
        """Return the kernel of derivatives up to an order, and which of those are not zero.

        ``form`` is one of ``FORMS``; ``"continuity"``, for flags of the highest derivatives that
        are not zero (orders 0 and 1); or ``"slopes"``, for first derivatives in mean value form.
        """
        with self._making:
            if (order, form) not in self._kernels:
                levels, n = self._levels(order), self.dimension
                entries = [e for e, a in enumerate(levels[min(order, 1)]) if a is not None]
                options: dict[str, Any] = {"kind": self.rounding}
                if form == "continuity":
                    levels = [[levels[order][e] for e in entries]]
                    options["continuity"] = True
                elif form == "slopes":
                    bends = [a for e in entries for a in levels[2][e * n :][:n]]
                    levels = [[levels[1][e] for e in entries], bends]
                    options["form"] = "mean value"
                else:
                    options["form"] = form
                kernel = IntervalKernel(self.graph, n, levels, **options)
                self._kernels[order, form] = kernel, entries
            return self._kernels[order, form]

    def _levels(self, order: int) -> list[list[int | None]]:
        """Return the nodes of values, first and second derivatives, None for structural zeros."""
        n = self.dimension
        levels: list[list[int | None]] = [[] for _ in range(order + 1)]
        for f in self.functions:
            program, found = _differentiated(f.family, order)
            row, k = f.family.names.index(f.member_name), len(f.reads)
            parts = [
                nodes[row * k**level : (row + 1) * k**level] for level, nodes in enumerate(found)
            ]
            placed = written(self.graph, f, program, [a for part in parts for a in part])
            for level, part in enumerate(parts):
                entries = np.full((n,) * level, -1)
                entries[np.ix_(*[f.reads] * level)] = np.reshape(
                    [placed[a] for a in part], (k,) * level
                )
                levels[level] += [self._entry(a, level) for a in entries.ravel().tolist()]
        return levels

    def _entry(self, node: int, level: int) -> int | None:
        return None if level and (node < 0 or node == self.graph.const(0)) else node


@lru_cache(maxsize=64)
def _differentiated(family: Family, order: int) -> tuple[Program, tuple[list[int], ...]]:
    """Return a family's program with its derivatives; the first hold what is stationary."""
    return derivatives(exact_program(family), order)


def check_arithmetic() -> None:
    """Raise RuntimeError if this thread does not round to nearest, or flushes small numbers."""
    one, half, tiny = float("1"), 2.0**-53, float("5e-324")
    if (
        one + half != one
        or -one - half != -one
        or one + 3 * half != 1 + 4 * half
        or tiny * one == 0
    ):
        msg = (
            "this thread does not round to nearest or takes subnormal numbers for zero, so that "
            "bounds would not be safe; a library that it has loaded has changed that setting"
        )
        raise RuntimeError(msg)
