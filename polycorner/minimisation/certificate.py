"""Certificates of local minima: a point and the evidence for or against it.

Sign convention, for functions ``f_i >= 0`` and equations ``h_j = 0``:

=======================  =====================================================
first order              ``dE = sum lam_i df_i + sum mu_j dh_j``
``lam_i >= 0``           the energy grows when contact ``i`` opens
``mu_j``                 of either sign
=======================  =====================================================
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from polycorner.kinds import check_fields, checked
from polycorner.minimisation.analysis import analyse, analyse_sparse
from polycorner.minimisation.explanation import explanation, sparse_explanation
from polycorner.minimisation.findings import Analysis, Local
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.verdicts import SEARCHES, Entrapment, Verdict
from polycorner.polyhedra.strata import Stratum, stratum_at
from polycorner.printing import (
    Printed,
    Sheet,
    Table,
    angle_unit,
    coordinates,
    facts,
    listed,
    names,
    number,
    units,
)
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, RANK_TOLERANCE, TOLERANCE, Tolerances
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy
    from polycorner.polyhedra.polyhedron import Polyhedron

LONGEST = 400  # letters of a list of names that is printed
SHOWN = 100  # coordinates that are shown in one line
# What an analysis finds where a search has stopped says less than that it has not converged.
VAGUE = frozenset({Verdict.NOT_STATIONARY, Verdict.OUTSIDE, Verdict.MINIMUM_ALONG_LOCUS})


@dataclass(frozen=True)
class Residuals(Checked):
    """Deviations from the first-order conditions at a point; all dimensionless.

    Attributes
    ----------
    infeasibility : float
        Scaled distance by which the polyhedron is missed.
    stationarity : float
        Largest component of ``dE - sum lam df`` in scaled coordinates, relative to the size of the
        energy there: its largest first or second derivative.
    complementarity : float
        Largest ``|lam_i f_i|``, relative to the same size.
    """

    infeasibility: float
    stationarity: float
    complementarity: float

    @property
    def worst(self) -> float:
        """The largest of the three."""
        return max(self.infeasibility, self.stationarity, self.complementarity)


@dataclass(frozen=True)
class Condition(Checked):
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


def residuals_at(problem: Problem, q: Array, multipliers: Mapping[str, float]) -> Residuals:
    """Return the residuals of the first-order conditions with given multipliers ``dE/df``."""
    d, m = problem.polyhedron, problem.inequalities
    local = (Local.sparsely_at if problem.is_sparse else Local.at)(problem, q, DEFAULT)
    weights = np.array([multipliers.get(name, 0.0) for name in (*d.names, *d.equation_names)])
    held = np.flatnonzero(weights)
    pull, product = local.without(weights), abs(weights[held] * local.values[held])
    away, reference = local.away, local.reference
    short = -d.implicit_of(away[:m]) if m else 0.0
    pull, reference = (np.full(1, np.nan), 1.0) if not np.isfinite(reference) else (pull, reference)
    return Residuals(
        infeasibility=float(max(0.0, short, abs(away[m:]).max(initial=0.0))),
        stationarity=float(abs(pull).max() / reference),
        complementarity=float(product.max(initial=0.0) / reference),
    )


def hypotheses(a: Analysis) -> tuple[Condition, ...]:
    """Return the four hypotheses of the minimisation lemma, each with its deciding number."""
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


@dataclass(frozen=True, eq=False)
class Certificate(Checked, Printed):
    """A point, and the evidence for or against its being a local minimum.

    Everything but the point is computed on demand from the problem.

    Attributes
    ----------
    problem : Problem
        The polyhedron and the energy.
    point : (n,) array
        The point, wrapped; read-only.
    tolerance : float
        Size up to which scaled distances, and derivatives relative to the energy's, count as zero.
    rank_tolerance : float
        Relative size below which a singular value of the active gradients counts as zero.
    method : str
        The method that found the point; ``"certify"`` for a given point, ``"face"`` for
        :func:`~polycorner.minimisation.methods.stationary_on`.
    iterations : int
        Number of its steps.
    search : Verdict or None
        Set when the search failed: INFEASIBLE, UNBOUNDED, NOT_ATTAINED, DOMAIN_EDGE or
        NOT_CONVERGED.
    note : str
        What the search saw, in words, where it failed.
    """

    problem: Problem
    point: Array
    tolerance: float = TOLERANCE
    rank_tolerance: float = RANK_TOLERANCE
    method: str = "certify"
    iterations: int = 0
    search: Verdict | None = None
    note: str = ""

    def __post_init__(self) -> None:
        check_fields(self)
        point = self.problem.polyhedron.manifold.canonical(self.point)
        point.flags.writeable = False  # the only array: the base class would search for others
        object.__setattr__(self, "point", point)

    @cached_property
    def tolerances(self) -> Tolerances:
        """All numbers that belong to the two tolerances."""
        return Tolerances.of(self.tolerance, self.rank_tolerance)

    @cached_property
    def found(self) -> Analysis:
        """First and second order at the point, with sparse matrices for a large polyhedron."""
        some = analyse_sparse if self.problem.is_sparse else analyse
        return some(self.problem, self.point, self.tolerances)

    @property
    def analysis(self) -> Analysis:
        """First and second order at the point, in scaled coordinates, with full matrices."""
        if self.problem.is_sparse:
            msg = "analysis: expected a small polyhedron; full matrices of this one are too large"
            raise ValueError(msg)
        return self.found

    @property
    def energy(self) -> float:
        """The energy at the point."""
        return float(self.problem.energy.value(self.point))

    @cached_property
    def stratum(self) -> Stratum:
        """The face the point lies on; not computed for large sparse polyhedra."""
        if self.problem.is_sparse:
            msg = "stratum: expected a small polyhedron; its cones are computed with full matrices"
            raise ValueError(msg)
        return stratum_at(
            self.problem.polyhedron,
            self.point,
            tolerance=self.tolerance,
            rank_tolerance=self.rank_tolerance,
        )

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the active functions."""
        return self.found.names

    @property
    def multipliers(self) -> dict[str, float]:
        """``dE/df`` for each active function and equation; one choice if they are not unique."""
        return self.problem.stated(self.found.named_multipliers)

    @property
    def multiplier_ranges(self) -> dict[str, tuple[float, float]]:
        """The least and the largest value each multiplier can take."""
        return self.problem.stated(self.found.named_ranges)

    @property
    def multipliers_unique(self) -> bool:
        """Whether the multipliers are determined by the first-order condition."""
        return self.found.multipliers.unique

    @property
    def licq(self) -> bool:
        """Whether the active gradients are independent."""
        return self.found.independent

    @property
    def strictly_complementary(self) -> bool:
        """Whether every active function has a strictly positive multiplier."""
        values = self.found.multipliers.values[: len(self.active)]
        return bool((values > self.found.local.small).all())

    @property
    def curvatures(self) -> Array:
        """Eigenvalues of the Lagrangian's Hessian along the face, in scaled coordinates."""
        return self.found.curvature.values

    @property
    def verdict(self) -> Verdict:
        """The verdict; its value is a sentence."""
        if self.search in SEARCHES:
            return self.search
        found = self.found.verdict
        if self.search is not None and found in VAGUE:
            return self.search
        return found

    @property
    def is_minimum(self) -> bool:
        """Whether the evidence is that of a local minimum."""
        return self.verdict.is_minimum

    @property
    def signature(self) -> tuple[int, int, int]:
        """The lemma's ``(p, q, r)``: first order, second order, no dependence."""
        return self.found.signature

    @property
    def entrapment(self) -> dict[str, Entrapment]:
        """The kind of entrapment in every direction.

        Keys are the contacts that hold the point, then the principal directions along the face,
        named by the coordinates that change most.
        """
        return dict(self.found.entrapment)

    @property
    def entrapment_counts(self) -> dict[str, int]:
        """The numbers of directions that are half-V, half-U, U and free."""
        kinds = list(self.found.entrapment.values())
        return {kind.value: kinds.count(kind) for kind in Entrapment if kind is not Entrapment.NONE}

    @property
    def lemma(self) -> tuple[Condition, ...]:
        """The four hypotheses of the minimisation lemma, each with its deciding number."""
        return hypotheses(self.found)

    @property
    def residuals(self) -> Residuals:
        """The residuals, recomputed from the functions and the multipliers."""
        return residuals_at(self.problem, self.point, self.found.named_multipliers)

    @checked
    def holds(self, tolerance: float | None = None) -> bool:
        """Whether this is a minimum with all recomputed residuals at most ``tolerance``."""
        limit = self.tolerance if tolerance is None else tolerance
        return self.is_minimum and self.residuals.worst <= limit

    @checked
    def explain(self, *, unit: str | None = None) -> str:
        """Explain in a few sentences why the point is, or is not, a local minimum.

        Parameters
        ----------
        unit : str, optional
            Unit of the inequalities, such as ``"mm"``, for gaps and rates in the text.

        Examples
        --------
        >>> from polycorner import Manifold, Polyhedron
        >>> M = Manifold.euclidean("x y")
        >>> x, y = M.symbols
        >>> D = Polyhedron(M, {"floor": y, "wall": x})
        >>> print(certify(D, 2 * y - 3 * x, [0.0, 0.0]).explain(unit="mm").splitlines()[2])
        Opening wall, all other contacts kept closed, lowers the energy at the rate 3 per mm:
        its multiplier is negative.
        """
        if self.problem.is_sparse:
            return sparse_explanation(self.found, self.verdict, self.note)
        return explanation(self.found, self.stratum, self.verdict, self.search, unit, self.note)

    def __repr__(self) -> str:
        """Return the verdict, the point, the energy and the active functions in one line."""
        manifold = self.problem.polyhedron.manifold
        if manifold.dimension > SHOWN:
            where = f"in {manifold.dimension} coordinates; energy {number(self.energy, 6)}"
            return f"Certificate({self.verdict.name} {where}; on {len(self.active)} functions)"
        point = ", ".join(
            f"{name} = {number(x, 6)} {angle_unit(period)}".rstrip()
            for name, period, x in zip(manifold.names, manifold.periods, self.point, strict=True)
        )
        return (
            f"Certificate({self.verdict.name} at {point}; energy {number(self.energy, 6)}; "
            f"on {names(self.active, 40) or 'nothing'})"
        )

    def _sheet(self) -> Sheet:
        """Return tables of the point, the active functions and the directions."""
        d, sparse, residuals = self.problem.polyhedron, self.problem.is_sparse, self.residuals
        rows = [("verdict", self.verdict.value), ("energy", number(self.energy, 12))]
        if sparse:
            rows += [
                ("coordinates", str(self.problem.dimension)),
                ("active", f"{len(self.active)} of {self.problem.inequalities} inequalities"),
                ("equations", str(len(d.equations))),
            ]
        else:
            rows += [
                ("active", names(self.active, LONGEST) or "none"),
                ("signature", "(p, q, r) = ({}, {}, {})".format(*self.signature)),
            ]
        kinds = ("infeasibility", "stationarity", "complementarity")
        rows += [(kind, f"{getattr(residuals, kind):.1e}") for kind in kinds]
        if sparse:
            return Sheet("Certificate", (facts(rows), self.explain()))
        held = [(name, kind.value) for name, kind in self.entrapment.items()]
        parts = (
            facts(rows),
            coordinates(d.manifold.names, d.manifold.periods, self.point.tolist()),
            self._multiplier_table(),
            "" if self.multipliers_unique else "The multipliers are one choice of several.",
            listed("", ("direction", "entrapment"), held, len(held)),
            units(d.manifold.periods),
        )
        return Sheet("Certificate", parts)

    def _multiplier_table(self) -> Table:
        d, values = self.problem.polyhedron, self.found.local.values[:-1].tolist()
        value = dict(zip((*d.names, *d.equation_names), values, strict=True))
        rows = [(name, number(value[name], 3), number(x)) for name, x in self.multipliers.items()]
        head = ("active function", "value", "multiplier dE/df")
        if self.multipliers_unique:
            return listed("", head, rows, len(rows), (1, 2))
        spans = [(number(low), number(high)) for low, high in self.multiplier_ranges.values()]
        wide = ((*row, *span) for row, span in zip(rows, spans, strict=True))
        return listed("", (*head, "least", "largest"), wide, len(rows), (1, 2, 3, 4))


@shown
def certify(
    polyhedron: "Polyhedron",
    energy: "Energy",
    q: ArrayLike | Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Certificate:
    """Analyse whether ``q`` is a local minimum of the energy on the polyhedron.

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

    Returns
    -------
    Certificate
        Its verdict says whether the point is a minimum; it is ``OUTSIDE`` for a point not in ``D``.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind, or an energy that is not finite at the point.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> c = certify(Polyhedron(M, {"floor": y}), x**2 + y, [0.0, 0.0])
    >>> c.verdict.name, c.multipliers, c.signature
    ('STRICT_MINIMUM', {'floor': 1.0}, (1, 1, 0))
    """
    Tolerances.of(tolerance, rank_tolerance)  # whatever else is wrong, these are refused first
    problem = pose(polyhedron, energy)
    point = polyhedron.manifold.point(q)
    problem.check_energy(point, "q")
    return Certificate(problem, point, tolerance, rank_tolerance)
