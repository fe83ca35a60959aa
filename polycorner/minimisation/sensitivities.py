"""Derivatives of stationary points, their energies and multipliers by parameters.

A stationary point ``q`` of the energy on a face and its multipliers ``lam`` solve

========================  ======================================================
``dE = sum lam_i df_i``   the energy is stationary on the face
``f_i = 0``               the active functions and the equations vanish
``n_k (q - q0) = 0``      a gauge condition for every free direction
========================  ======================================================

While no multiplier vanishes, the active set stays the same and the implicit function theorem gives
the derivatives of both by the parameters ([Fi] ch. 3).  Where one vanishes the contact may open:
generically, the minimum ends there or continues without the contact ([JJT], type 2).

Derivatives of stationary points by parameters, with sparse matrices throughout.

The equations are those of :mod:`~polycorner.minimisation.parametric`; coordinates that nothing
reads are the free directions.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array

from polycorner import checks
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import SparseRows
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.parametric import (
    Lifted,
    Rates,
    check_rates,
    lifted_family,
    partial_derivatives,
    slots_of,
)
from polycorner.minimisation.sparse.factorisation import Saddle, lengths
from polycorner.minimisation.sparse.optimality import nondegenerate
from polycorner.minimisation.sparse_analysis import SparseAnalysis
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.strata import local_pieces
from polycorner.printing import Printed, Sheet, Table, number, titled, units
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

    Quantity: TypeAlias = SmoothFunction | sympy.Expr | str


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of a point by ``p`` parameters.

    Attributes
    ----------
    names : tuple of str
        The active functions and the equations.
    point, multipliers : (n, p), (k, p) array
    energy, envelope : (p,) array
    free : (n, r) array
        The coordinates that nothing reads.
    """

    names: tuple[str, ...]
    point: Array
    multipliers: Array
    energy: Array
    envelope: Array
    free: Array


@dataclass(frozen=True)
class _Lifted:
    """A function whose parameters are variables, after the coordinates."""

    family: Family
    member_name: str
    reads: tuple[int, ...]
    parameters: tuple[float, ...] = ()


def lifted_rows(
    functions: Sequence[SmoothFunction], slots: dict[tuple[str, float], int], n: int
) -> SparseRows:
    """Return functions of ``n`` coordinates, and after them of the parameters in their slots."""
    lifted: list[SmoothFunction | _Lifted] = []
    for f in functions:
        if not f.family.parameters:
            lifted.append(f)
            continue
        own = [n + slots[slot] for slot in zip(f.family.parameters, f.parameters, strict=True)]
        family = lifted_family(f.family, frozenset({f.member_name}))
        lifted.append(_Lifted(family, f.member_name, (*f.reads, *own)))
    return SparseRows.of(lifted, n + len(slots))


def sparse_obstacle(analysis: SparseAnalysis) -> str:
    """Return why the implicit function theorem does not apply, or an empty string."""
    if analysis.verdict in {Verdict.OUTSIDE, Verdict.DOMAIN_EDGE}:
        return str(analysis.verdict.value)
    if not analysis.independent:
        return "the gradients of the active functions are dependent"
    if analysis.first.residual > analysis.local.small:
        return "the energy is not stationary on the face of its active functions"
    weak = np.setdiff1d(np.arange(len(analysis.active)), analysis.strong_positions)
    if len(weak):
        first = analysis.names[int(weak[0])]
        return f"the multiplier of {first} is zero, so that derivatives are one-sided"
    return ""


def sparse_derivatives(certificate: Certificate, rates: Rates) -> Derivatives | str:
    """Solve the linearised KKT equations; return a sentence instead where that is impossible."""
    problem, analysis = certificate.problem, certificate.found
    assert isinstance(analysis, SparseAnalysis)
    d, n, scales = problem.polyhedron, problem.dimension, problem.scales
    held = (*(d.functions[i] for i in analysis.active), *d.equations)
    slots = slots_of((*held, *problem.energy.terms))
    directions = csr_array(
        np.array(
            [[moved.get(name, 0.0) for moved in rates.values()] for name, _ in slots], dtype=float
        ).reshape(len(slots), len(rates))
    )
    at = np.concatenate([certificate.point, [value for _, value in slots]])
    faces, terms = lifted_rows(held, slots, n), lifted_rows(problem.energy.terms, slots, n)
    weights = np.array(list(analysis.named_multipliers.values()))
    jacobian, slopes = faces.evaluate(at)[1], terms.evaluate(at)[1]
    slope = np.asarray(slopes.sum(axis=0))
    bent = terms.curvature(at, np.ones(terms.count)) - faces.curvature(at, weights)
    scaling = diags_array(scales)
    rows = csr_array(jacobian[:, :n] @ scaling)
    sizes, reference = lengths(rows), analysis.reference
    units = csr_array(diags_array(1 / sizes) @ rows)
    hessian = csr_array(scaling @ bent[:n, :n] @ scaling / reference)
    drift = (jacobian[:, n:] @ directions).toarray()
    turning = (scaling @ (bent[:n, n:] @ directions)).toarray()
    moved = np.setdiff1d(np.arange(n), analysis.unmoved)
    small = analysis.small_curvature / reference
    if not nondegenerate(hessian[moved][:, moved], csr_array(units[:, moved]), small):
        return "the second order vanishes in a direction that is not free"
    right = np.vstack([-turning / reference, -drift / sizes[:, None]])
    system = Saddle(hessian, units)
    found = system.solve(right, np.zeros_like(right))
    left = abs(right - system.matrix @ found).max(axis=0, initial=0.0)
    size = np.maximum(abs(right).max(axis=0, initial=0.0), np.finfo(float).tiny)
    sloping = left > certificate.tolerances.stationary * size  # there is no solution
    if sloping.any():
        name = list(rates)[int(np.flatnonzero(sloping)[0])]
        return f"the energy does not stay constant along the free coordinates as {name} changes"
    still = slope[n:] @ directions
    point = found[:n] * scales[:, None]
    return Derivatives(
        names=(*analysis.names, *d.equation_names),
        point=point,
        multipliers=-reference * found[n:] / sizes[:, None],
        energy=still + slope[:n] @ point,
        envelope=still - weights @ drift,
        free=csr_array(eye_array(n))[:, analysis.unmoved].toarray(),
    )


@dataclass(frozen=True, eq=False)
class Sensitivity(Checked, Printed):
    """Derivatives of a stationary point by ``p`` parameters; see :func:`sensitivity`.

    Attributes
    ----------
    certificate : Certificate
        The point.
    rates : mapping from str to mapping from str to float
        The parameters by name, with the derivatives of the formulas' parameters by each.
    point : (n, p) array
        Derivatives of the coordinates; with free directions, the shortest ones in scaled
        coordinates.
    multipliers : dict from str to (p,) array
        Derivatives of the multipliers ``dE/df``.
    energy : (p,) array
        Derivatives of the energy at the point, by the chain rule through ``point``.
    envelope : (p,) array
        The same by the envelope theorem, ``E_p - sum lam_i f_i,p``, which does not need ``point``.
    free : (n, r) array
        Directions along which energy and active functions are constant, orthonormal in scaled
        coordinates.
    """

    certificate: Certificate
    rates: Rates
    point: Array
    multipliers: dict[str, Array]
    energy: Array
    envelope: Array
    free: Array

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.rates)

    @checked
    def of(self, quantity: "Quantity") -> Array:
        """Return the derivatives ``(p,)`` of a function of the point and the parameters.

        Parameters
        ----------
        quantity : SmoothFunction, sympy.Expr or str
            A function on the same manifold, an expression in its coordinates, or the name of one
            coordinate.  A SmoothFunction's own parameters move with those of the same name.

        Raises
        ------
        TypeError, ValueError
            For anything else, or a quantity that changes along a free direction, so that its
            derivative is not determined.
        """
        function = self.function(quantity)
        point, scales = self.certificate.point, self.certificate.problem.scales
        slope = np.asarray(function.gradient(point))
        loose = abs((slope * scales) @ self.free)
        still = self.certificate.tolerances.stationary * np.linalg.norm(slope * scales)
        if (loose > still).any():
            msg = (
                "quantity: expected one that is constant along the free directions; got "
                f"{function.name}, which changes along them: its derivative is not determined"
            )
            raise ValueError(msg)
        return np.asarray(slope @ self.point + partial_derivatives(function, point, self.rates))

    @checked
    def function(self, quantity: "Quantity") -> SmoothFunction:
        """Return a quantity, as :meth:`of` takes it, as a function on the manifold."""
        manifold = self.certificate.problem.polyhedron.manifold
        if isinstance(quantity, str):
            checks.choice("quantity", quantity, manifold.names)
            symbol = manifold.symbols[manifold.names.index(quantity)]
            return SmoothFunction.quantity(quantity, symbol, manifold)
        if not isinstance(quantity, SmoothFunction):
            with checks.about("quantity"):
                return SmoothFunction.quantity("quantity", quantity, manifold)
        if quantity.manifold != manifold:
            msg = f"quantity: expected a function on {', '.join(manifold.names)}; got {quantity!r}"
            raise ValueError(msg)
        return quantity

    @checked
    def predict(self, changes: Mapping[str, float]) -> Array:
        """Return the point ``(n,)`` to first order in given changes of the parameters."""
        checks.names("changes", changes, self.rates)
        steps = np.array([float(changes.get(name, 0.0)) for name in self.rates])
        manifold = self.certificate.problem.polyhedron.manifold
        return manifold.shift(self.certificate.point, self.point @ steps)

    def __repr__(self) -> str:
        """Return the coordinates and the parameters in one line."""
        coordinates = ", ".join(self.certificate.problem.polyhedron.manifold.names)
        return f"Sensitivity(of {coordinates} by {', '.join(self.rates)})"

    def _sheet(self) -> Sheet:
        """Return a table of derivatives, a column for each parameter."""
        manifold = self.certificate.problem.polyhedron.manifold
        head = ("derivative of", *(f"d/d {name}" for name in self.rates))
        titles = map(titled, manifold.names, manifold.periods)
        derivatives = [
            *zip(titles, self.point, strict=True),
            ("energy", self.energy),
            *((f"multiplier {name}", row) for name, row in self.multipliers.items()),
        ]
        rows = tuple((name, *(number(x, 6) for x in row.tolist())) for name, row in derivatives)
        table = Table(head, rows, tuple(range(1, len(head))))
        return Sheet("Sensitivity", (table, units(manifold.periods)))


@checked
def sensitivity(
    certificate: Certificate, parameters: Iterable[str] | Rates | None = None
) -> Sensitivity:
    """Differentiate a stationary point, its energy and its multipliers by parameters.

    Parameters
    ----------
    certificate : Certificate
        A point stationary on its face, with independent active gradients, no zero multiplier,
        and no degenerate directions but free ones.  It need not be a minimum.
    parameters : iterable of str, or mapping from str to mapping from str to float, optional
        Names of parameters of the problem's functions (default all), each varied in all functions
        at once.  A mapping defines new parameters by the chain rule:
        ``{"ball_radius": {"r": 1, "rho": -1}}`` varies ``r`` and ``rho = R - r`` together.

    Returns
    -------
    Sensitivity

    Raises
    ------
    TypeError, ValueError
        With the reason: the point is not stationary, has dependent gradients, a weakly active
        function (the derivative is one-sided) or a degenerate direction; a parameter is unknown,
        or the energy does not stay constant along a free direction as it changes.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
    >>> import sympy
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> a = sympy.Symbol("a")
    >>> bowl = SmoothFunction("bowl", y - a * x**2, M, parameters={"a": 1.0})
    >>> c = minimise(Polyhedron(M, bowl), x + y, [1.0, 1.5])  # at (-1/2a, 1/4a)
    >>> s = sensitivity(c, ["a"])
    >>> s.point[:, 0].round(9).tolist(), s.energy.round(9).tolist(), s.of(x * y).round(9).tolist()
    ([0.5, -0.25], [0.25], [0.25])
    """
    _check_point(certificate)
    rates = check_rates(certificate, parameters)
    if certificate.problem.is_sparse:
        return _sparse(certificate, rates)
    lifted, reference = Lifted(certificate), certificate.analysis.reference
    multipliers = np.array(list(certificate.analysis.named_multipliers.values()))
    still, directions = np.zeros(len(lifted.slots)), lifted.directions(rates)
    linear = lifted.linearise(certificate.point, still, multipliers, directions)
    free = linear.free_directions(certificate)
    solved = linear.solve(free, reference)
    if solved is None:
        raise ValueError(_refusal("the second order vanishes in a direction that is not free"))
    moved, changed, slopes = solved
    loose = (slopes > certificate.tolerances.stationary).any(axis=0)
    if loose.any():
        name = list(rates)[int(np.flatnonzero(loose)[0])]
        msg = (
            "parameters: expected ones that keep the energy constant along the free directions; "
            f"got {name}, whose change makes the energy slope along one"
        )
        raise ValueError(msg)
    return Sensitivity(
        certificate=certificate,
        rates=rates,
        point=moved * certificate.problem.scales[:, None],
        multipliers=certificate.analysis.stated(dict(zip(lifted.names, changed, strict=True))),
        energy=linear.drift[-1] + linear.gradients[-1] @ moved,
        envelope=linear.drift[-1] - multipliers @ linear.drift[:-1],
        free=free,
    )


def _sparse(certificate: Certificate, rates: Rates) -> Sensitivity:
    found = sparse_derivatives(certificate, rates)
    if isinstance(found, str):
        raise ValueError(_refusal(found))
    changed = dict(zip(found.names, found.multipliers, strict=True))
    return Sensitivity(
        certificate=certificate,
        rates=rates,
        point=found.point,
        multipliers=certificate.problem.stated(changed),
        energy=found.energy,
        envelope=found.envelope,
        free=found.free,
    )


def _check_point(certificate: Certificate) -> None:
    """Raise for a certificate whose point need not depend smoothly on the parameters."""
    checks.instance("certificate", certificate, Certificate)
    reason = _reason(certificate)
    if reason:
        raise ValueError(_refusal(reason))


def _refusal(reason: str) -> str:
    return f"certificate: expected a point that depends smoothly on the parameters; {reason}"


def _reason(certificate: Certificate) -> str:
    """Return the reason why the implicit function theorem does not apply, or an empty string."""
    if isinstance(certificate.found, SparseAnalysis):
        return sparse_obstacle(certificate.found)
    analysis, d = certificate.analysis, certificate.problem.polyhedron
    values, gradients = analysis.local.values, analysis.local.gradients
    if analysis.verdict in {Verdict.OUTSIDE, Verdict.DOMAIN_EDGE}:
        return str(analysis.verdict.value)
    if len(local_pieces(d, values[:-1], gradients[:-1], certificate.tolerance)) > 1:
        return "several pieces of the polyhedron meet there"
    if not analysis.independent:
        return f"the gradients of {', '.join(certificate.active)} are dependent"
    if analysis.multipliers.residual > analysis.local.small:
        return "the energy is not stationary on the face of its active functions"
    if analysis.weak:
        names = ", ".join(d.names[i] for i in analysis.weak)
        return f"the multiplier of {names} is zero, so that derivatives are one-sided"
    higher = analysis.decision is not None and analysis.decision.degree > 2
    if higher or analysis.verdict is Verdict.UNDECIDED:
        return "the second order vanishes in a direction that is not free"
    return ""
