"""Energies on polyhedra, and their layout as flat arrays for the compiled descent."""

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import SparseRows
from polycorner.polyhedra.equations import independent_equations
from polycorner.polyhedra.polyhedron import Piece, Polyhedron
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import Tolerances
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

    from polycorner.minimisation.descent.intermediate import Laid

    Energy: TypeAlias = SmoothFunction | sympy.Expr

T = TypeVar("T")

MOST_NUMBERS = 20_000_000  # second derivatives that are kept as a full array
TOO_MANY = 1_000_000_000  # of them, that are not even tried: 8 GB
MOST_READ = 0.1  # share of the coordinates that a function of a sparse polyhedron reads
MANY = 100  # coordinates from which on an energy is kept as the sum of the terms it is written as


@dataclass(frozen=True, eq=False)
class Problem(Checked):
    """Minimise ``energy`` over ``polyhedron``.

    Rows of the system are the inequalities, the equations, and last the energy; derivatives here
    are in scaled coordinates ``u = q / scales``.
    """

    polyhedron: Polyhedron
    energy: SmoothFunction

    @property
    def dimension(self) -> int:
        """The number of coordinates ``n``."""
        return self.polyhedron.manifold.size

    @property
    def inequalities(self) -> int:
        """The number of inequalities ``m``."""
        return len(self.polyhedron.functions)

    @property
    def rows(self) -> int:
        """The number of rows: inequalities, equations, energy."""
        return self.inequalities + len(self.polyhedron.equations) + 1

    @cached_property
    def scales(self) -> Array:
        """The manifold's scales."""
        return self.polyhedron.manifold.scale_array

    @cached_property
    def _areas(self) -> Array:
        return np.outer(self.scales, self.scales)

    @cached_property
    def functions(self) -> tuple[SmoothFunction, ...]:
        """The function of every row."""
        return (*self.polyhedron.functions, *self.polyhedron.equations, self.energy)

    @cached_property
    def _bundle(self) -> Bundle:
        return Bundle(self.polyhedron.manifold, self.functions)

    def evaluate(self, q: Array, order: int) -> tuple[Array, ...]:
        """Return values ``(M,)``, scaled gradients ``(M, n)`` and scaled Hessians ``(M, n, n)``."""
        results = list(self._bundle.evaluate(q, order))
        if order >= 1:
            results[1] = results[1] * self.scales
        if order >= 2:
            results[2] *= self._areas  # (M, n, n) may be large: no copy
        return tuple(results)

    def stated(self, by_name: Mapping[str, T]) -> dict[str, T]:
        """Return the entries but those of the equations that normalise vectors."""
        hidden = self.polyhedron.hidden
        return {name: entry for name, entry in by_name.items() if name not in hidden}

    @cached_property
    def parameter_values(self) -> dict[str, frozenset[float]]:
        """The values of every parameter of the functions, by name."""
        found: dict[str, frozenset[float]] = {}
        parts = (*self.polyhedron.functions, *self.polyhedron.equations, *self.energy.terms)
        for f in parts:
            for name, value in zip(f.family.parameters, f.parameters, strict=True):
                found[name] = found.get(name, frozenset()) | {value}
        return found

    def check_parameters(self, names: Iterable[str]) -> None:
        """Raise ValueError for names without one value in all functions."""
        chosen = list(names)
        checks.names("parameters", chosen, self.parameter_values)
        for name in chosen:
            values = self.parameter_values[name]
            if len(values) > 1:
                got = ", ".join(f"{value:g}" for value in sorted(values))
                msg = f"parameters: expected one value of {name} in all functions; got {got}"
                raise ValueError(msg)

    def check_energy(self, q: Array, argument: str) -> None:
        """Raise ValueError for a point at which the energy is not finite."""
        value = self.energy.value(q)
        if not np.isfinite(value):
            msg = f"{argument}: expected a point with a finite energy; its energy is {value}"
            raise ValueError(msg)

    @cached_property
    def is_sparse(self) -> bool:
        """Whether all second derivatives would be too many numbers, nearly all of them zero."""
        n = self.dimension
        if self.polyhedron.is_union or self.rows * n * n < MOST_NUMBERS:
            return False
        read = self.sparse_rows.entries + self.sparse_energy.entries
        return read < MOST_READ * self.rows * n

    def check_size(self) -> None:
        """Raise ValueError for a problem whose full matrices are too large, if it needs these."""
        n = self.dimension
        if self.is_sparse or self.rows * n * n < TOO_MANY:
            return
        reason = "no unions" if self.polyhedron.is_union else "functions of few coordinates each"
        msg = (
            f"polyhedron: expected {reason}, as sparse matrices need; full matrices of "
            f"{self.rows} functions of {n} coordinates would have {self.rows * n * n:.2g} entries"
        )
        raise ValueError(msg)

    @cached_property
    def sparse_rows(self) -> SparseRows:
        """Inequalities, then equations, as sparse rows; derivatives not scaled."""
        d = self.polyhedron
        return SparseRows.of((*d.functions, *d.equations), self.dimension)

    @cached_property
    def sparse_energy(self) -> SparseRows:
        """The terms of the energy as sparse rows."""
        return SparseRows.of(self.energy.terms, self.dimension)

    @cached_property
    def _laid(self) -> "Laid":
        """The problem as arrays for the compiled descent."""
        return self._lay_out(self.scales)

    def _lay_out(self, scales: Array) -> "Laid":
        from polycorner.minimisation.descent.intermediate import Laid

        return Laid.of(
            **self._bundle.tabulated(2, 1),
            scales=scales,
            inequalities=self.inequalities,
            rows=self.rows,
        )

    @cached_property
    def _everything(self) -> NDArray[np.bool_]:
        return np.ones(self.inequalities, dtype=np.bool_)

    def mask(self, piece: Piece) -> NDArray[np.bool_]:
        """Return the mask ``(m,)`` of the inequalities of a piece."""
        if len(piece) == self.inequalities:
            return self._everything
        use = np.zeros(self.inequalities, dtype=np.bool_)
        use[list(piece)] = True
        return use

    def descend(
        self, piece: Piece, q: Array, limit: int, scales: Array | None = None
    ) -> tuple[int, int, Array, Array]:
        """Run the compiled descent inside one piece, in units of other ``scales`` if given.

        Returns
        -------
        status, iterations, point, multipliers
            As of the compiled ``descend``.
        """
        from polycorner.minimisation.descent import intermediate as descent

        laid = self._laid if scales is None else self._lay_out(scales)
        units = self.scales if scales is None else scales
        status, iterations, u, lam = descent.descend(laid, self.mask(piece), q / units, limit)
        return status, iterations, u * units, lam

    def restore(self, piece: Piece, q: Array) -> tuple[bool, Array]:
        """Project ``q`` onto a piece by repeated linearisation; return success and the point."""
        from polycorner.minimisation.descent import intermediate as descent

        reached, u = descent.restore(self._laid, self.mask(piece), q / self.scales)
        return reached, u * self.scales

    def on_face(self, active: Piece, q: Array) -> tuple[Array, float]:
        """Apply Newton's method on a face; return the point and the length of the last step."""
        from polycorner.minimisation.descent import intermediate as descent

        u, step = descent.on_face(self._laid, self.mask(active), q / self.scales)
        return u * self.scales, step

    def with_independent_equations(
        self, piece: Piece, points: Iterable[Array], tolerances: Tolerances
    ) -> "Problem":
        """Return the problem in one piece, of the equations there that imply the others.

        These are independent near given points.
        """
        d, m = self.polyhedron, self.inequalities
        chosen = independent_equations(d, points, tolerances)
        parts = [d.functions[i] for i in sorted(piece)]
        stated = [d.equations[i - m] for i in chosen if i - m < len(d.stated)]
        return pose(Polyhedron(d.manifold, parts, stated), self.energy)

    def holds(self, piece: Piece, values: Array, gradients: Array, miss: float) -> bool:
        """Whether a point lies in a piece and on all equations, to first order within ``miss``."""
        away = distances(values[:-1], gradients[:-1])
        inside = (away[sorted(piece)] >= -miss).all()
        return bool(inside and (abs(away[self.inequalities :]) <= miss).all())


def pose(polyhedron: Polyhedron, energy: "Energy") -> Problem:
    """Return the problem of an energy on a polyhedron, checking that they belong together."""
    checks.instance("polyhedron", polyhedron, Polyhedron)
    if not isinstance(energy, Hashable):
        checks.refuse("energy", "a SmoothFunction or a SymPy expression", energy, TypeError)
    return _posed(polyhedron, energy)


@lru_cache(maxsize=64)
def _posed(polyhedron: Polyhedron, energy: Any) -> Problem:
    """Return the problem, from a cache: its layout and kernels are reused."""
    manifold = polyhedron.manifold
    function: Any = energy
    if not isinstance(energy, SmoothFunction):
        function = _stated(energy, manifold)
    if function.manifold != manifold:
        msg = (
            f"energy: is a function of the coordinates {', '.join(function.manifold.names)}; "
            f"expected those of the polyhedron, {', '.join(manifold.names)}"
        )
        raise ValueError(msg)
    return Problem(polyhedron, function)


def _stated(expression: Any, manifold: Manifold) -> SmoothFunction:
    """Return an energy as one function; in many coordinates, as the sum of the terms written."""
    if manifold.size < MANY or not getattr(expression, "is_Add", False):
        return SmoothFunction("energy", expression, manifold)
    varying = [term for term in expression.args if term.free_symbols]
    constants = [term for term in expression.args if not term.free_symbols]
    if not all(s.name in manifold.positions for s in expression.free_symbols) or not varying:
        return SmoothFunction("energy", expression, manifold)
    varying[0] = sum(constants, varying[0])
    terms = []
    for term in varying:
        reads = sorted(symbol.name for symbol in term.free_symbols)
        terms.append(SmoothFunction("energy", term, manifold, variables=reads))
    return SmoothFunction.sum("energy", terms)
