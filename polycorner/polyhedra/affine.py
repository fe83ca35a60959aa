"""The largest heights where affine functions are not negative, by linear programmes."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from polycorner.checks import instance, refuse
from polycorner.errors import SolverError
from polycorner.formulas.functions import SmoothFunction
from polycorner.polyhedra.polyhedron import Piece, Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT


class Programmes:
    """The largest height where given functions are not negative, by linear programmes.

    Sets of functions that a symmetry carries to each other have the same, which is kept.
    """

    def __init__(self, polyhedron: Polyhedron, height: Any, symmetry: Symmetry | None) -> None:
        instance("polyhedron", polyhedron, Polyhedron)
        if symmetry is not None:
            instance("symmetry", symmetry, Symmetry)
        if np.isfinite(polyhedron.manifold.periods).any() or polyhedron.manifold.factors:
            refuse("polyhedron", "a manifold of lines", polyhedron.manifold)
        n = polyhedron.manifold.size
        self.always, self.unions = polyhedron.unions
        self._rows = _affine("polyhedron", polyhedron.functions, n)
        self._equations = _affine("polyhedron", polyhedron.stated, n)
        self._height = (
            None if height is None else _affine("height", [_on(polyhedron, height)], n)[0]
        )
        self._images = self._relabellings(polyhedron.names, symmetry)
        self._known: dict[Piece, float] = {}

    def meet(self, functions: Piece) -> bool:
        """Whether there is a point."""
        return self.highest(functions) > -np.inf

    def highest(self, functions: Piece) -> float:
        """Return the largest height; ``-inf`` if there is no point."""
        if functions not in self._known:
            found = self._solved(functions | self.always)
            for image in self._images:
                self._known[frozenset(image[i] for i in functions)] = found
        return self._known[functions]

    def _solved(self, functions: Piece) -> float:
        from scipy.optimize import linprog

        rows, n = self._rows[sorted(functions)], self._rows.shape[1] - 1
        aim = np.zeros(n + 1) if self._height is None else self._height
        equal = self._equations
        result: Any = linprog(
            -aim[:n], A_ub=-rows[:, :n], b_ub=rows[:, n], bounds=(None, None), method="highs",
            A_eq=equal[:, :n] if len(equal) else None, b_eq=-equal[:, n] if len(equal) else None,
        )  # fmt: skip
        if result.status == 2:
            return -np.inf
        if result.status == 3 or (result.status == 0 and self._height is None):
            return np.inf
        if result.status != 0:
            msg = f"nerve: expected an optimum of a linear programme; got {result.message}"
            raise SolverError(msg)
        return float(aim[n] - result.fun)

    def _relabellings(
        self, names: tuple[str, ...], symmetry: Symmetry | None
    ) -> list[tuple[int, ...]]:
        """Return where functions are carried, after a check that this is by an affine map."""
        identity = tuple(range(len(names)))
        if symmetry is None:
            return [identity]
        if symmetry.relabel is not None:
            refuse("symmetry", "a group that is listed in elements", symmetry)
        position = {name: i for i, name in enumerate(names)}
        found = {
            tuple(position.get(g.names.get(name, name), -1) for name in names)
            for g in symmetry.elements
        }
        for image in found:
            if sorted(image) != list(identity) or not self._carries(image):
                refuse("symmetry", "symmetries of polyhedron and height", symmetry)
        return [identity, *sorted(found - {identity})]

    def _carries(self, image: tuple[int, ...]) -> bool:
        """Whether an affine map carries each function to its image, and keeps all else."""
        kept = [self._equations, np.eye(self._rows.shape[1])[-1:]]
        kept += [] if self._height is None else [self._height[None]]
        before, after = (np.vstack([rows, *kept]) for rows in (self._rows, self._rows[[*image]]))
        affine = np.linalg.lstsq(after, before)[0]
        off = abs(after @ affine - before).max()
        same = frozenset(image[i] for i in self.always) == self.always
        return bool(off <= DEFAULT.alike * abs(before).max()) and same


def _on(polyhedron: Polyhedron, height: Any) -> SmoothFunction:
    if isinstance(height, SmoothFunction):
        return height
    return SmoothFunction("height on the polyhedron", height, polyhedron.manifold)


def _affine(argument: str, functions: Iterable[SmoothFunction], n: int) -> Array:
    """Return gradients and values at zero of affine functions, ``(k, n + 1)``, or raise."""
    import sympy

    rows = []
    for f in functions:
        symbols, values = f.manifold.symbols, f.parameter_values
        numbers = {sympy.Symbol(name, real=True): value for name, value in values.items()}
        slopes = [f.expression.diff(q) for q in symbols]
        if any(slope.free_symbols & set(symbols) for slope in slopes):
            refuse(argument, "affine functions", f.expression)
        constant = f.expression.xreplace(dict.fromkeys(symbols, sympy.S.Zero))
        rows.append([float(e.xreplace(numbers)) for e in (*slopes, constant)])
    return np.array(rows).reshape(-1, n + 1)
