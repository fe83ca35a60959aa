"""Derivatives of stationary points by parameters, and parameters at which a multiplier vanishes.

A stationary point ``q`` of the energy on a face and its multipliers ``lam`` solve

========================  ======================================================
``dE = sum lam_i df_i``   the energy is stationary on the face
``f_i = 0``               the active functions and the equations vanish
``n_k (q - q0) = 0``      a gauge condition for every free direction
========================  ======================================================

While no multiplier vanishes, the active set stays the same and the implicit function theorem gives
the derivatives of both by the parameters ([Fi] ch. 3).  Where one vanishes the contact may open:
generically, the minimum ends there or continues without the contact ([JJT], type 2).

In a large sparse polyhedron the coordinates that nothing reads are the free directions.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NoReturn, TypeAlias

import numpy as np

from polycorner import checks
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.minimisation.certificate import LONGEST, Certificate
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
from polycorner.printing import Printed, Sheet, Table, names, number, titled, units
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

    Quantity: TypeAlias = SmoothFunction | sympy.Expr | str

NEWTON = 40  # steps, at most


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
            checks.refuse("quantity", f"a function on {', '.join(manifold.names)}", quantity)
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
    checks.instance("certificate", certificate, Certificate)
    _check_point(certificate)
    rates = check_rates(certificate, parameters)
    lifted, found = Lifted(certificate), certificate.found
    multipliers = np.array(list(found.named_multipliers.values()))
    still, directions = np.zeros(len(lifted.slots)), lifted.directions(rates)
    linear = lifted.linearise(certificate.point, still, multipliers, directions)
    free = linear.free_directions(certificate)
    solved = linear.solve(found, free)
    if solved is None:
        _refuse("the second order vanishes in a direction that is not free")
    moved, changed, sloping = solved
    if sloping.any():
        name = list(rates)[int(np.flatnonzero(sloping)[0])]
        msg = (
            "parameters: expected ones that keep the energy constant along the free directions; "
            f"got {name}, whose change makes the energy slope along one"
        )
        raise ValueError(msg)
    return Sensitivity(
        certificate=certificate,
        rates=rates,
        point=moved * certificate.problem.scales[:, None],
        multipliers=found.stated(dict(zip(lifted.names, changed, strict=True))),
        energy=linear.drift[-1] + linear.slope @ moved,
        envelope=linear.drift[-1] - multipliers @ linear.drift[:-1],
        free=free,
    )


def _refuse(reason: str) -> NoReturn:
    msg = f"certificate: expected a point that depends smoothly on the parameters; {reason}"
    raise ValueError(msg)


def _check_point(certificate: Certificate) -> None:
    """Raise where the implicit function theorem does not apply."""
    a, d = certificate.found, certificate.problem.polyhedron
    if a.verdict in {Verdict.OUTSIDE, Verdict.DOMAIN_EDGE}:
        _refuse(str(a.verdict.value))
    if d.is_union and len(local_pieces(d, a.local.away, certificate.tolerance)) > 1:
        _refuse("several pieces of the polyhedron meet there")
    if not a.independent:
        _refuse(f"the gradients of {names(certificate.active, LONGEST)} are dependent")
    if a.multipliers.residual > a.local.small:
        _refuse("the energy is not stationary on the face of its active functions")
    if a.weak:
        weak = names([d.names[i] for i in a.weak], LONGEST)
        _refuse(f"the multiplier of {weak} is zero, so that derivatives are one-sided")
    if a.verdict is Verdict.UNDECIDED or (a.decision is not None and a.decision.degree > 2):
        _refuse("the second order vanishes in a direction that is not free")


# --------------------------------------------------------------- vanishing multipliers


@dataclass(frozen=True, eq=False)
class Crossing(Checked):
    """A point at which the multiplier of a contact vanishes; see :func:`crossing`.

    Attributes
    ----------
    change : float
        Difference of the parameter from its value in the certificate.
    point : (n,) array
        The point.
    multipliers : dict from str to float
        All multipliers there.
    """

    change: float
    point: Array
    multipliers: dict[str, float]


@checked
def crossing(
    certificate: Certificate, contact: str, parameter: str | Mapping[str, float]
) -> Crossing | None:
    """Find the value of a parameter at which a multiplier vanishes, by Newton's method.

    The unknowns are the point, the multipliers and the parameter; the equations are those of the
    face, and ``lam_contact = 0``.

    Parameters
    ----------
    certificate : Certificate
        A point stationary on its face, with independent gradients, to start from.
    contact : str
        The active function whose multiplier is to vanish.
    parameter : str or mapping from str to float
        A parameter of the problem's functions, or several of them with their rates.

    Returns
    -------
    Crossing or None
        None if Newton's method does not converge.

    Raises
    ------
    ValueError
        For a contact that is not active, or an unknown parameter.
    """
    moved = {parameter: 1.0} if isinstance(parameter, str) else dict(parameter)
    rates = check_rates(certificate, {"parameter": moved})
    lifted = Lifted(certificate)
    checks.choice("contact", contact, lifted.names)
    directions, which = lifted.directions(rates)[:, 0], lifted.names.index(contact)
    scales, wrap = certificate.problem.scales, certificate.problem.polyhedron.manifold.canonical
    lam = np.array(list(certificate.analysis.named_multipliers.values()))
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
            named = dict(zip(lifted.names, lam.tolist(), strict=True))
            return Crossing(s, wrap(q), certificate.analysis.stated(named))
        last = max(abs(du).max(), abs(ds / (s or 1.0))) < certificate.tolerances.settled
    return None


def _augmented_step(linear: Linear, free: Array, multipliers: Array, which: int) -> Array:
    """Return Newton's step ``(du, dlam, dnu, ds)``, NaN if the matrix is singular."""
    rows, n, k = linear.rows, len(linear.slope), len(multipliers)
    core = bordered(linear.curvature, np.vstack([rows, free.T]))
    matrix = np.zeros((len(core) + 1, len(core) + 1))
    matrix[:-1, :-1] = core
    matrix[:n, -1], matrix[n : n + k, -1] = linear.turning[:, 0], linear.drift[:-1, 0]
    matrix[-1, n + which] = 1.0
    residual = np.zeros(len(matrix))
    residual[:n] = linear.slope - multipliers @ rows
    residual[n : n + k] = linear.values
    residual[-1] = multipliers[which]
    try:
        return np.asarray(np.linalg.solve(matrix, -residual), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.full(len(matrix), np.nan)
