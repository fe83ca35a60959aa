"""How a point of rest moves with the parameters of its formulas, and where that ends.

Where the energy is stationary on a face, the point ``q`` and the multipliers ``lam`` solve

========================  ======================================================
``dE = sum lam_i df_i``   the energy is stationary on the face
``f_i = 0``               the active functions and the equations vanish
``n_k (q - q0) = 0``      nothing moves along free directions: a gauge
========================  ======================================================

While no multiplier vanishes the active set stays the same, and the implicit function theorem gives
the derivatives of both by the parameters ([Fi] ch. 3).  Where one vanishes the contact may open:
generically a minimum of the face ends there, or goes on without the contact ([JJT], type 2).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.parametric import (
    Lifted,
    Linear,
    Rates,
    bordered,
    check_rates,
    partial_derivatives,
)
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.strata import local_pieces
from polycorner.printing import Printed, Sheet
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import sympy

    Quantity: TypeAlias = SmoothFunction | sympy.Expr | str

DRIFT = 1e-8  # relative slope along a free direction that counts as none
NEWTON = 40
CLOSE = 1e-8  # a relative step from which the next one of Newton's method is the last


@dataclass(frozen=True, eq=False)
class Sensitivity(Printed):
    """Derivatives of a point of rest by ``p`` parameters; see :func:`sensitivity`.

    Attributes
    ----------
    certificate : Certificate
        The point.
    rates : mapping from str to mapping from str to float
        The parameters by name, and how fast each of them moves the parameters of the formulas.
    point : (n, p) array
        Derivatives of the coordinates; where there are free directions, the shortest ones in
        scaled coordinates.
    multipliers : dict from str to (p,) array
        Derivatives of the multipliers ``dE/df``.
    energy : (p,) array
        Derivatives of the energy at the point, by the chain rule through ``point``.
    envelope : (p,) array
        The same by the envelope theorem, ``E_p - sum lam_i f_i,p``, which does not need ``point``.
    free : (n, r) array
        Directions in which nothing changes, orthonormal in scaled coordinates.
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
            If it is nothing of the kind, or changes along a free direction, where its derivative
            is not determined.
        """
        function = self.function(quantity)
        point, scales = self.certificate.point, self.certificate.problem.scales
        slope = np.asarray(function.gradient(point))
        loose = abs((slope * scales) @ self.free)
        if (loose > DRIFT * np.linalg.norm(slope * scales)).any():
            msg = (
                "quantity: expected one that stays the same along the free directions; "
                f"{function.name} changes along them, so that its derivative is not determined"
            )
            raise ValueError(msg)
        return np.asarray(slope @ self.point + partial_derivatives(function, point, self.rates))

    def function(self, quantity: "Quantity") -> SmoothFunction:
        """Return a quantity, as :meth:`of` takes it, as a function on the manifold."""
        manifold = self.certificate.problem.polyhedron.manifold
        if isinstance(quantity, str):
            if quantity not in manifold.names:
                listed = ", ".join(manifold.names)
                msg = f"quantity: expected a coordinate among {listed}; got {quantity!r}"
                raise ValueError(msg)
            symbol = manifold.symbols[manifold.names.index(quantity)]
            return SmoothFunction(quantity, symbol, manifold)
        if not isinstance(quantity, SmoothFunction):
            return SmoothFunction("quantity", quantity, manifold)
        if quantity.manifold != manifold:
            msg = f"quantity: expected a function on {', '.join(manifold.names)}; got {quantity!r}"
            raise ValueError(msg)
        return quantity

    def predict(self, changes: Mapping[str, float]) -> Array:
        """Return where the point goes, to first order, when parameters change by so much."""
        self.check_names("changes", changes)
        steps = np.array([float(changes.get(name, 0.0)) for name in self.rates])
        manifold = self.certificate.problem.polyhedron.manifold
        return manifold.shift(self.certificate.point, self.point @ steps)

    def check_names(self, argument: str, given: Iterable[str]) -> None:
        """Refuse names that are none of the parameters."""
        unknown = [str(name) for name in given if name not in self.rates]
        if unknown:
            listed = ", ".join(self.rates)
            msg = f"{argument}: expected names among {listed}; got {', '.join(unknown)}"
            raise ValueError(msg)

    def __repr__(self) -> str:
        """Return what moves, and with which parameters."""
        coordinates = ", ".join(self.certificate.problem.polyhedron.manifold.names)
        return f"Sensitivity(of {coordinates} by {', '.join(self.rates)})"

    def _sheet(self) -> Sheet:
        from polycorner.minimisation.report import sensitivity_sheet

        return sensitivity_sheet(self)


def sensitivity(
    certificate: Certificate, parameters: Iterable[str] | Rates | None = None
) -> Sensitivity:
    """Differentiate a point of rest, its energy and its multipliers by parameters.

    Parameters
    ----------
    certificate : Certificate
        A point stationary on its face: the active gradients independent, no multiplier zero, and
        no degenerate direction but free ones.  It need not be a minimum.
    parameters : iterable of str, or mapping from str to mapping from str to float, optional
        Names of parameters of the problem's functions (default all).  A parameter of that name
        moves in all functions at once.  A mapping defines parameters of its own by the chain rule:
        ``{"ball_radius": {"r": 1, "rho": -1}}`` moves ``r`` and ``rho = R - r`` together.

    Returns
    -------
    Sensitivity

    Raises
    ------
    TypeError, ValueError
        Naming the argument, with the reason: not stationary, dependent gradients, a weakly active
        function (the derivative is one-sided), a degenerate direction, an unknown parameter, or
        one that the point does not follow because a free direction ends being free.

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
    lifted, reference = Lifted(certificate), certificate.analysis.reference
    multipliers = np.array(list(certificate.multipliers.values()))
    still, directions = np.zeros(len(lifted.slots)), lifted.directions(rates)
    linear = lifted.linearise(certificate.point, still, multipliers, directions)
    free = linear.free_directions(certificate)
    solved = linear.solve(free, reference)
    if solved is None:
        raise ValueError(_refusal("the second order vanishes in a direction that is not free"))
    moved, changed, slopes = solved
    loose = (slopes > DRIFT).any(axis=0)
    if loose.any():
        name = list(rates)[int(np.flatnonzero(loose)[0])]
        msg = (
            f"parameters: expected ones that the point follows; as {name} changes, "
            "the energy slopes along a direction that was free"
        )
        raise ValueError(msg)
    return Sensitivity(
        certificate=certificate,
        rates=rates,
        point=moved * certificate.problem.scales[:, None],
        multipliers=dict(zip(lifted.names, changed, strict=True)),
        energy=linear.drift[-1] + linear.gradients[-1] @ moved,
        envelope=linear.drift[-1] - multipliers @ linear.drift[:-1],
        free=free,
    )


def _check_point(certificate: Certificate) -> None:
    """Refuse a certificate whose point need not move smoothly with the parameters."""
    if not isinstance(certificate, Certificate):
        msg = f"certificate: expected a Certificate; got {type(certificate).__name__}"
        raise TypeError(msg)
    reason = _reason(certificate)
    if reason:
        raise ValueError(_refusal(reason))


def _refusal(reason: str) -> str:
    return f"certificate: expected a point that moves smoothly with the parameters; {reason}"


def _reason(certificate: Certificate) -> str:
    """Return why the implicit function theorem does not apply, or nothing."""
    analysis, d = certificate.analysis, certificate.problem.polyhedron
    values, gradients = analysis.local.values, analysis.local.gradients
    if analysis.verdict is Verdict.OUTSIDE:
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
    if analysis.verdict is Verdict.UNDECIDED:
        return "the second order vanishes in a direction that is not free"
    return ""


@dataclass(frozen=True, eq=False)
class Crossing:
    """Where the multiplier of a contact vanishes; see :func:`crossing`.

    Attributes
    ----------
    change : float
        By how much the parameter differs from that of the certificate.
    point : (n,) array
        The point.
    multipliers : dict from str to float
        All multipliers there.
    """

    change: float
    point: Array
    multipliers: dict[str, float]


def crossing(
    certificate: Certificate, contact: str, parameter: str | Mapping[str, float]
) -> Crossing | None:
    """Find the value of a parameter at which a multiplier vanishes, by Newton's method.

    The unknowns are the point, the multipliers and the parameter; the equations are those of the
    face, and ``lam_contact = 0``.

    Parameters
    ----------
    certificate : Certificate
        A point stationary on its face, with independent gradients: where to start.
    contact : str
        The active function whose multiplier is to vanish.
    parameter : str or mapping from str to float
        What changes: a parameter of the problem's functions, or several at these rates.

    Returns
    -------
    Crossing or None
        None if Newton's method does not settle.
    """
    moved = {parameter: 1.0} if isinstance(parameter, str) else dict(parameter)
    rates = check_rates(certificate, {"parameter": moved})
    lifted = Lifted(certificate)
    if contact not in lifted.names:
        msg = f"contact: expected one among {', '.join(lifted.names)}; got {contact!r}"
        raise ValueError(msg)
    directions, which = lifted.directions(rates)[:, 0], lifted.names.index(contact)
    scales, wrap = certificate.problem.scales, certificate.problem.polyhedron.manifold.wrap
    lam = np.array(list(certificate.multipliers.values()))
    q, s, free, last = certificate.point, 0.0, None, False
    for _ in range(NEWTON):
        linear = lifted.linearise(q, s * directions, lam, directions[:, None])
        free = linear.free_directions(certificate) if free is None else free
        step = _augmented_step(linear, free, lam, which)
        if not np.isfinite(step).all():
            return None
        du, dlam, ds = step[: len(q)], step[len(q) : len(q) + len(lam)], float(step[-1])
        q, lam, s = q + scales * du, lam + dlam, s + ds
        if last:
            return Crossing(s, wrap(q), dict(zip(lifted.names, lam.tolist(), strict=True)))
        last = max(abs(du).max(), abs(ds / (s or 1.0))) < CLOSE
    return None


def _augmented_step(linear: Linear, free: Array, multipliers: Array, which: int) -> Array:
    """Return Newton's step ``(du, dlam, dnu, ds)``; not finite where there is none."""
    rows, n, k = linear.gradients[:-1], len(linear.curvature), len(multipliers)
    core = bordered(linear.curvature, np.vstack([rows, free.T]))
    matrix = np.zeros((len(core) + 1, len(core) + 1))
    matrix[:-1, :-1] = core
    matrix[:n, -1], matrix[n : n + k, -1] = linear.turning[:, 0], linear.drift[:-1, 0]
    matrix[-1, n + which] = 1.0
    residual = np.zeros(len(matrix))
    residual[:n] = linear.gradients[-1] - multipliers @ rows
    residual[n : n + k] = linear.values
    residual[-1] = multipliers[which]
    try:
        return np.asarray(np.linalg.solve(matrix, -residual), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.full(len(matrix), np.nan)
