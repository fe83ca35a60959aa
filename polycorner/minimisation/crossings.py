"""Parameter values at which the multiplier of a contact vanishes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.parametric import Lifted, Linear, bordered, check_rates
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

NEWTON = 40  # steps, at most


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
