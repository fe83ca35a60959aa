"""Certificates: why a point is, or is not, a local minimum of an energy on a polyhedron.

Sign convention, for functions ``f_i >= 0`` and equations ``h_j = 0``:

=======================  =====================================================
first order              ``dE = sum lam_i df_i + sum mu_j dh_j``
``lam_i >= 0``           the energy grows when contact ``i`` opens
``mu_j``                 of either sign
=======================  =====================================================
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from polycorner.minimisation.analysis import Analysis, analyse
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.verdicts import Entrapment, Verdict
from polycorner.polyhedra.strata import (
    RANK_TOLERANCE,
    TOLERANCE,
    Stratum,
    check_tolerance,
    distances,
    stratum_at,
)
from polycorner.printing import Printed, Sheet
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy
    from polycorner.polyhedra.polyhedron import Polyhedron


@dataclass(frozen=True)
class Residuals:
    """How far a certificate's conditions are from holding exactly; all dimensionless.

    Attributes
    ----------
    infeasibility : float
        Scaled distance by which the polyhedron is missed.
    stationarity : float
        Largest component of ``dE - sum lam df`` in scaled coordinates, as a fraction of the
        energy's own size there: its largest first or second derivative.
    complementarity : float
        Largest ``|lam_i f_i|``, as the same fraction.
    """

    infeasibility: float
    stationarity: float
    complementarity: float

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.infeasibility, self.stationarity, self.complementarity)


@dataclass(frozen=True)
class Condition:
    """One hypothesis of the minimisation lemma ([GMBN] app. C), checked.

    Attributes
    ----------
    statement : str
        What is required.
    holds : bool
        Whether it does.
    figure : float
        The number that decides it.
    """

    statement: str
    holds: bool
    figure: float


@dataclass(frozen=True, eq=False)
class Certificate(Printed):
    """A point, and the evidence for or against its being a local minimum.

    Everything but the point is computed when asked for, from the problem the certificate keeps.

    Attributes
    ----------
    problem : Problem
        The polyhedron and the energy.
    point : (n,) array
        The point, circle coordinates wrapped; read-only.
    tolerance : float
        What counts as zero: scaled distances, and derivatives relative to the energy's own.
    rank_tolerance : float
        Relative size below which a singular value of the active gradients counts as zero.
    method : str
        What found the point.
    iterations : int
        How many steps that took.
    search : Verdict or None
        Set when the search itself failed: INFEASIBLE, UNBOUNDED or NOT_CONVERGED.
    """

    problem: Problem
    point: Array
    tolerance: float = TOLERANCE
    rank_tolerance: float = RANK_TOLERANCE
    method: str = "certify"
    iterations: int = 0
    search: Verdict | None = field(default=None)

    def __post_init__(self) -> None:
        point = self.problem.polyhedron.manifold.wrap(self.point)
        point.setflags(write=False)
        object.__setattr__(self, "point", point)

    @cached_property
    def analysis(self) -> Analysis:
        """First and second order at the point, in scaled coordinates."""
        return analyse(self.problem, self.point, self.tolerance, self.rank_tolerance)

    @property
    def energy(self) -> float:
        """The energy at the point."""
        return float(self.problem.energy.value(self.point))

    @cached_property
    def stratum(self) -> Stratum:
        """The face the point lies on."""
        return stratum_at(
            self.problem.polyhedron,
            self.point,
            tolerance=self.tolerance,
            rank_tolerance=self.rank_tolerance,
        )

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the active functions."""
        return tuple(self.problem.polyhedron.names[i] for i in self.analysis.active)

    @property
    def multipliers(self) -> dict[str, float]:
        """``dE/df`` for each active function and equation; one choice if they are not unique."""
        return self._by_name(self.analysis.multipliers.values)

    @property
    def multiplier_ranges(self) -> dict[str, tuple[float, float]]:
        """The least and largest value each multiplier can take."""
        lower = self._by_name(self.analysis.multipliers.lower)
        upper = self._by_name(self.analysis.multipliers.upper)
        return {name: (lower[name], upper[name]) for name in lower}

    def _by_name(self, values: Array) -> dict[str, float]:
        d, analysis = self.problem.polyhedron, self.analysis
        names = self.active + d.equation_names
        sizes = np.linalg.norm(analysis.gradients, axis=1)
        safe = np.where(sizes > 0, sizes, 1.0)
        return dict(zip(names, (values / safe).tolist(), strict=True))

    @property
    def multipliers_unique(self) -> bool:
        """Whether the multipliers are determined by the first-order condition."""
        return self.analysis.multipliers.unique

    @property
    def licq(self) -> bool:
        """Whether the active gradients are independent."""
        return self.analysis.independent

    @property
    def strictly_complementary(self) -> bool:
        """Whether every active function has a strictly positive multiplier."""
        values = self.analysis.multipliers.values[: len(self.active)]
        return bool((values > self.analysis.local.small).all())

    @property
    def curvatures(self) -> Array:
        """Eigenvalues of the Lagrangian's Hessian along the face, in scaled coordinates."""
        return self.analysis.curvature.values

    @property
    def verdict(self) -> Verdict:
        """The verdict; its value is a sentence."""
        if self.search in (Verdict.INFEASIBLE, Verdict.UNBOUNDED):
            return self.search
        found = self.analysis.verdict
        if self.search is not None and found in (Verdict.NOT_STATIONARY, Verdict.OUTSIDE):
            return self.search
        return found

    @property
    def is_minimum(self) -> bool:
        """Whether the evidence is that of a local minimum."""
        return self.verdict.is_minimum

    @property
    def signature(self) -> tuple[int, int, int]:
        """The lemma's ``(p, q, r)``: first order, second order, no dependence."""
        return self.analysis.signature

    @property
    def entrapment(self) -> dict[str, Entrapment]:
        """The kind of entrapment in every direction.

        Keys are the contacts that hold the point, then the principal directions along the face,
        named by the coordinates that change most.
        """
        return dict(self.analysis.entrapment)

    @property
    def entrapment_counts(self) -> dict[str, int]:
        """How many directions are half-V, half-U, U and free."""
        kinds = list(self.analysis.entrapment.values())
        return {kind.value: kinds.count(kind) for kind in Entrapment if kind is not Entrapment.NONE}

    @property
    def lemma(self) -> tuple[Condition, ...]:
        """The four hypotheses of the minimisation lemma, each with its deciding number."""
        a = self.analysis
        held = a.multipliers.values[[*a.strong_positions]]
        curved = a.curvature.values[abs(a.curvature.values) > a.small_curvature]
        least = float(curved.min()) if len(curved) else float("inf")
        return (
            Condition(
                "(1) the energy grows to first order as each of the p contacts opens",
                bool((held > 0).all()) and a.multipliers.exist,
                float(held.min(initial=np.inf)),
            ),
            Condition(
                "(2) its other first derivatives vanish (relative size)",
                a.multipliers.exist,
                a.multipliers.residual / a.reference,
            ),
            Condition(
                "(3) its second derivatives in the q directions are positive definite",
                least > 0,
                least,
            ),
            Condition(
                "(4) it does not depend on the remaining r coordinates",
                a.flat_verified,
                a.flat_change,
            ),
        )

    @property
    def residuals(self) -> Residuals:
        """The residuals, recomputed from the functions and the stored multipliers."""
        values, gradients, hessians = self.problem.evaluate(self.point, 2)
        names = [*self.problem.polyhedron.names, *self.problem.polyhedron.equation_names]
        multipliers = self.multipliers
        pull, product = gradients[-1].copy(), 0.0
        for row, name in enumerate(names):
            if name in multipliers:
                pull -= multipliers[name] * gradients[row]
                product = max(product, abs(multipliers[name] * float(values[row])))
        reference = max(abs(gradients[-1]).max(), abs(hessians[-1]).max()) or 1.0
        return Residuals(
            self._miss(), float(abs(pull).max() / reference), float(product / reference)
        )

    def _miss(self) -> float:
        d = self.problem.polyhedron
        values, gradients, *_ = self.problem.evaluate(self.point, 1)
        away = distances(values[:-1], gradients[:-1])
        m = self.problem.inequalities
        short = -d.implicit_of(away[:m]) if m else 0.0
        return float(max(0.0, short, abs(away[m:]).max(initial=0.0)))

    def holds(self, tolerance: float | None = None) -> bool:
        """Whether this is a minimum whose recomputed residuals are all within ``tolerance``."""
        limit = self.tolerance if tolerance is None else tolerance
        return self.is_minimum and self.residuals.worst <= limit

    def explain(self, *, unit: str | None = None) -> str:
        """Say in a few sentences why the point is, or is not, a local minimum.

        Parameters
        ----------
        unit : str, optional
            Unit of the inequalities, such as ``"mm"``, for the rates that are told.

        Examples
        --------
        >>> from polycorner import Manifold, Polyhedron
        >>> M = Manifold.euclidean("x y")
        >>> x, y = M.symbols
        >>> D = Polyhedron(M, {"floor": y, "wall": x})
        >>> print(certify(D, 2 * y - 3 * x, [0.0, 0.0]).explain(unit="mm").splitlines()[2])
        Leaving wall, all others kept as they are, lowers the energy at the rate 3 per mm:
        its multiplier is negative.
        """
        from polycorner.minimisation.explanation import explanation

        return explanation(self, unit)

    def __repr__(self) -> str:
        """Return the verdict, the point, the energy and the active functions in one line."""
        from polycorner.minimisation.report import certificate_line

        return certificate_line(self)

    def _sheet(self) -> Sheet:
        from polycorner.minimisation.report import certificate_sheet

        return certificate_sheet(self)


def certify(
    polyhedron: "Polyhedron",
    energy: "Energy",
    q: ArrayLike | Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Certificate:
    """Say why ``q`` is, or is not, a local minimum of the energy on the polyhedron.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    q : (n,) array or mapping from coordinate names
        The point.
    tolerance, rank_tolerance : float, optional
        See :class:`Certificate`.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> c = certify(Polyhedron(M, {"floor": y}), x**2 + y, [0.0, 0.0])
    >>> c.verdict.name, c.multipliers, c.signature
    ('STRICT_MINIMUM', {'floor': 1.0}, (1, 1, 0))
    """
    check_tolerance("tolerance", tolerance)
    check_tolerance("rank_tolerance", rank_tolerance)
    problem = pose(polyhedron, energy)
    point = polyhedron.manifold.point(q)
    problem.check_energy(point, "q")
    return Certificate(problem, point, tolerance, rank_tolerance)
