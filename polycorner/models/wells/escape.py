"""Mean escape times of a mass from a well under white noise, without simulation.

Three answers, from the coarsest to the finest: the exponent with which the time grows as the noise
gets weaker, the mean time where drag outweighs inertia, and the mean time for any drag, friction
and restitution from a partial differential equation.

``kick`` is the intensity of the force as in :class:`~polycorner.motion.noise.Noise`: a free mass
has ``<dv^2> = (kick / mass)^2 t``.
"""

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from polycorner.models.wells.wells import Well
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

NODES = 120  # nodes of Gauss's rule
CELLS = 80  # grid cells between 0 and the rim
MOST_CELLS = 3000  # grid cells up to the largest speed
CROWD = 0.2  # ratio of the steps at the wall and at zero speed to those of an even grid


def barrier(well: Well, kick: float) -> float:
    """Return ``S``: the mean escape time grows like ``exp(S)`` as the noise becomes weaker.

    ``S`` is the least of ``(integral of u^2 dt) / (2 kick^2)`` over the forces ``u(t)`` that lead
    from rest at 0 to the rim ([FW] ch. 4).  With ``D`` the depth, ``c`` the drag, ``f`` the slope,
    ``T = kick^2 / 2c`` and ``h`` the place after a unit impulse:

    ====================  ======================================================================
    U, or ``e = 1``       ``D / T``, whatever the inertia; 0 without drag
    half-U, ``e = 0``     ``D / T / (1 - exp(-pi c / (m w)))``, ``w^2 = k/m - (c/2m)^2``, and
                          ``D / T`` where that is negative: no swing comes back to the wall
    half-V, ``e = 0``     the least over ``t`` of ``(a + f H)^2 / (2 kick^2 G)``, with ``H`` and
                          ``G`` the integrals of ``h`` and of ``h^2`` from 0 to ``t``
    ====================  ======================================================================

    At an absorbing wall all that was gained is lost, so that one flight must do it.

    Raises
    ------
    ValueError
        With friction, or with ``0 < e < 1``.
    """
    well.check_no("friction")
    if 0 < well.kept < 1:
        msg = f"restitution: expected 0 or 1, for there is no closed form; got {well.kept:g}"
        raise ValueError(msg)
    if well.kept == 1:
        return 2 * well.drag * well.depth / kick**2
    return _harmonic_barrier(well, kick) if well.slope == 0 else _sloping_barrier(well, kick)


def _harmonic_barrier(well: Well, kick: float) -> float:
    rate = 2 * well.drag * well.depth / kick**2
    square = well.frequency**2 - (well.drag / (2 * well.mass)) ** 2
    if square <= 0:
        return rate
    turn = math.pi / (well.mass * math.sqrt(square))
    if well.drag * turn < 1e-12:
        return 2 * well.depth / (turn * kick**2)
    return rate / -math.expm1(-well.drag * turn)


def _sloping_barrier(well: Well, kick: float) -> float:
    from scipy.optimize import minimize_scalar

    def action(log_time: float) -> float:
        responses, weights = _responses(well, math.exp(log_time))
        lift = well.rim + well.slope * (weights @ responses)
        return float(math.log(lift**2 / (2 * kick**2 * (weights @ responses**2))))

    # Without drag and spring the optimal time is sqrt(6 a m / f), with much drag a c / f.  A spring
    # shortens it, below the half swing after which the mass would be back at the wall.
    fast = math.sqrt(6 * well.rim * well.mass / well.slope)
    slow = 2 * fast + 4 * well.rim * well.drag / well.slope
    if well.stiffness > 0:
        fast = min(fast, math.pi / well.frequency)
        square = well.frequency**2 - (well.drag / (2 * well.mass)) ** 2
        slow = min(slow, math.pi / math.sqrt(square)) if square > 0 else slow
    span = (math.log(0.2 * fast), math.log(slow))
    return math.exp(float(minimize_scalar(action, bounds=span, method="bounded").fun))


def _responses(well: Well, time: float) -> tuple[Array, Array]:
    """Return the place after a unit impulse at the nodes of a rule on ``[0, time]``.

    The nodes crowd at 0, where drag makes it change most.
    """
    nodes, weights = _rule()
    s, half = time * nodes**3, well.drag / (2 * well.mass)
    root = np.sqrt(complex(half**2 - well.frequency**2))
    if abs(root) * time < 1e-6:
        found = s * np.exp(-half * s)
    else:
        found = ((np.exp((root - half) * s) - np.exp((-root - half) * s)) / (2 * root)).real
    return found / well.mass, 3 * time * nodes**2 * weights


@lru_cache(maxsize=1)
def _rule() -> tuple[Array, Array]:
    """Return Gauss's rule on ``[0, 1]``."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return (1 + nodes) / 2, weights / 2


def overdamped_escape_time(well: Well, kick: float) -> float:
    """Return the mean time from 0 to the rim where drag outweighs inertia.

    It is ``c/T`` times the integral of ``exp((V(y) - V(z)) / T)`` over ``0 <= z <= y <= a``
    ([Gardiner] sec. 5.2.7).  A wall only reflects then, whatever its restitution, and a U well with
    two rims is a half-U well with one.

    For the same rim and depth half-V is never the stronger one: with ``b = D/T`` the integrals are
    ``sum b^n / (n! (n+1)(n+2))`` for half-V and, for half-U, each term of it times
    ``(n + 2) sqrt(pi) Gamma(n+1) / (4 Gamma(n + 3/2))``, which is 1, 1, 16/15, ... and grows.
    """
    well.check_no("friction")
    temperature = well.temperature(kick)
    nodes, weights = _rule()
    y = well.rim * nodes
    factor = np.exp((well.potential(y)[:, None] - well.potential(np.outer(y, nodes))) / temperature)
    return float(well.drag / temperature * well.rim * ((weights * y) @ factor @ weights))


def mean_escape_time(well: Well, kick: float, *, cells: int = CELLS) -> float:
    """Return the mean time until a mass that starts at rest at 0 is at the rim.

    ``tau(x, v)`` solves the backward equation ([Gardiner] sec. 5.2.7)

    ``v tau_x - (V'(x) + c v + F sign(v)) / m tau_v + kick^2 / (2 m^2) tau_vv = -1``

    with ``tau = 0`` where the mass moves out at the rim, and ``tau(0, -v) = tau(0, e v)`` at the
    wall.  Differences are of second order.  With the default number of cells the result is good to
    a per cent or two up to ``S = 5``; the longer the time, the more cells it needs.

    Parameters
    ----------
    well : Well
    kick : float
        Intensity of the noise, positive.
    cells : int, optional
        Of the grid between 0 and the rim, with as many speeds as the noise asks for.  A second
        number tells how good the first one is.

    Raises
    ------
    ValueError
        If the noise is too weak for a grid of that size, or for any of reasonable size.
    """
    from scipy.sparse.linalg import splu

    x, v = places(well, cells), speeds(well, kick, cells)
    shape, start = (len(x), len(v)), 0 if well.wall else cells
    inside, boundary = _boundary(well, x, v)
    flow = _transport(x, v) + _forces(well, kick, x, v)
    matrix = (boundary + flow.multiply(inside.ravel()[:, None])).tocsc()
    tau = splu(matrix).solve(-inside.ravel().astype(np.float64)).reshape(shape)
    if tau.min() < -1e-3 * tau.max():
        msg = f"cells: expected more for noise as weak as {kick:g}; with {cells} times are negative"
        raise ValueError(msg)
    middle = len(v) // 2
    return float(tau[start, middle] if well.wall else tau[start, middle - 1 : middle + 1].mean())


def places(well: Well, cells: int) -> Array:
    """Return the positions of the grid, both ends of the well included; denser at a wall."""
    if not well.wall:
        return well.rim * np.linspace(-1, 1, 2 * cells + 1)
    share = np.linspace(0, 1, cells + 1)
    return well.rim * (CROWD * share + (1 - CROWD) * share**2)


def speeds(well: Well, kick: float, cells: int) -> Array:
    """Return the speeds of the grid: denser at zero, which is not one of them.

    They go up to what leaves the well at once, and five times what noise adds on the way.
    """
    spread = (kick / well.mass) ** 2 / 2
    leaving = math.sqrt(2 * well.depth / well.mass)
    gained = kick / well.mass * math.sqrt(2 * well.rim / leaving)
    top = leaving + 5 * min(gained, math.sqrt(well.temperature(kick) / well.mass))
    force = 2 * well.depth / well.rim + well.drag * leaving + well.friction
    half = math.ceil(cells * max(2.0, top * force / (10 * well.mass * spread)))
    if half > MOST_CELLS:
        msg = f"kick: expected noise that shakes the mass out now and then; {kick:g} is too weak"
        raise ValueError(msg)
    share = (np.arange(-half, half) + 0.5) / half
    return top * (CROWD * share + (1 - CROWD) * share**3)


def _transport(x: Array, v: Array) -> "csr_matrix":
    """Return ``v d/dx``, upwind differences of second order."""
    from scipy.sparse import csr_matrix, diags, kron

    outward, inward = diags(np.maximum(v, 0)), diags(np.minimum(v, 0))
    behind = -_ahead(-x[::-1])[::-1, ::-1]
    return csr_matrix(kron(_ahead(x), outward) + kron(behind, inward))


def _ahead(x: Array) -> "csr_matrix":
    """Return ``d/dx`` by a parabola through a point and the next two."""
    from scipy.sparse import csr_matrix

    n, near, far = len(x), np.diff(x), x[2:] - x[:-2]
    weights = [
        np.append(-(near[:-1] + far) / (near[:-1] * far), -1 / near[-1]),
        np.append(far / (near[:-1] * near[1:]), 1 / near[-1]),
        -near[:-1] / (far * near[1:]),
    ]
    rows = [np.arange(len(weight)) for weight in weights]
    columns = [row + k for k, row in enumerate(rows)]
    entries = np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix(entries, shape=(n, n))


def _forces(well: Well, kick: float, x: Array, v: Array) -> "csr_matrix":
    """Return ``kick^2 / (2 m^2) d^2/dv^2`` plus the force over the mass times ``d/dv``."""
    from scipy.sparse import csr_matrix, diags, identity, kron

    m, width, between = len(v), np.diff(v), (v[:-1] + v[1:]) / 2
    between[m // 2 - 1] = 0.0
    step = diags(1 / width) @ diags([-1.0, 1.0], [0, 1], shape=(m - 1, m))
    mean = abs(step.T) @ diags(width) / 2
    cell = np.convolve(np.pad(width, 1, mode="edge"), [0.5, 0.5], mode="valid")
    bend = -diags((kick / well.mass) ** 2 / 2 / cell) @ step.T @ diags(width) @ step
    lost = -(well.drag * between + well.friction * np.sign(between)) / well.mass
    pull = -(well.slope * (x >= 0) + well.stiffness * x) / well.mass
    alike = bend + mean @ diags(lost) @ step
    return csr_matrix(kron(identity(len(x)), alike) + kron(diags(pull), mean @ step))


def _boundary(well: Well, x: Array, v: Array) -> "tuple[NDArray[np.bool_], csr_matrix]":
    """Return where the equation holds, and boundary rows for the rim and the wall."""
    from scipy.sparse import csr_matrix

    half, inside = len(v) // 2, np.ones((len(x), len(v)), dtype=np.bool_)
    inside[-1, half:] = inside[0, :half] = False
    number = np.arange(inside.size).reshape(inside.shape)
    fixed = number[~inside]
    rows, columns, values = [fixed], [fixed], [np.ones(len(fixed))]
    if well.wall:
        back, up = well.restitution * -v[:half], v[half:]
        near = np.clip(np.searchsorted(up, back) - 1, 0, half - 2)
        beyond = (back - up[near]) / (up[near + 1] - up[near])
        for offset, share in ((0, 1 - beyond), (1, beyond)):
            rows.append(number[0, :half])
            columns.append(number[0, half + near + offset])
            values.append(-share)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return inside, csr_matrix(entries, shape=(inside.size, inside.size))
