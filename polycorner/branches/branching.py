"""Branch points: where the Jacobian of the Fritz John equations loses ranks.

Let the kernel have the dimension ``d + 1``, and the left kernel ``z`` the dimension ``d``.  With
the unknowns across the kernel eliminated, ``d`` equations ``g(c) = 0`` in ``d + 1`` unknowns are
left, without linear parts.  Curves leave along their zeros to lowest order ([Gov] ch. 6):

- along the zeros of the forms ``z_i F''``: two lines for ``d = 1``, at most four for ``d = 2``;
- where the forms vanish as long as the parameter stays, as ``2 sigma l_i(c)`` with its change
  ``sigma``: along ``l = 0``, and along ``w`` with ``sigma = 0`` if the cubic part ``C(w)`` is a
  multiple of ``l(w)``, in at most four lines for ``d = 2``.

The lines are roots of a polynomial, of which all are found.  There are no others as long as
these are simple ([Gov]); double ones, and ``d > 2``, are not decided.
"""

import math
from typing import NamedTuple

import numpy as np

from polycorner.branches.system import FritzJohn
from polycorner.spaces.manifold import Array


class BranchPoint(NamedTuple):
    """A point at which curves of one face cross.

    Attributes
    ----------
    at : FritzJohn
    kernel : (d + 1, k) array
        Orthonormal basis.
    left : (d, N) array
        Orthonormal basis of the left kernel.
    forms : (d, d + 1, d + 1) array
        Second derivatives of the equations on the kernel.
    """

    at: FritzJohn
    kernel: Array
    left: Array
    forms: Array


def branch_point(near: FritzJohn) -> BranchPoint | None:
    """Return the branch point beside a point, or None if Newton's method finds none."""
    values = np.linalg.svd(near.bordered, compute_uv=False)
    most = int((values <= 10 * near.system.tolerances.beside).sum())
    tried = (_polished(near, lost) for lost in range(most, 0, -1))
    return next((found for found in tried if found is not None), None)


def _polished(near: FritzJohn, lost: int) -> BranchPoint | None:
    """Solve ``z F' v = 0`` on the kernel, and the equations across it."""
    tolerances, at = near.system.tolerances, near
    for _ in range(12):
        if not at.finite or np.linalg.norm(at.x - near.x) > 10 * tolerances.beside:
            return None
        u, values, vt = np.linalg.svd(at.bordered)
        kept = len(values) - lost
        found = _forms(at, u[:, kept:].T, vt[kept:])
        slopes = found.left @ at.bordered @ found.kernel.T
        matrix = found.forms.reshape(-1, lost + 1)  # rows (i, k), columns j
        on = np.linalg.lstsq(matrix, -slopes.ravel(), rcond=tolerances.rank)[0]
        across = vt[:kept].T @ (u[:, :kept].T @ at.left / values[:kept])
        step = (on @ found.kernel - across)[: len(at.x)]
        at = at.system.point(at.face, at.x + step)
        if np.linalg.norm(step) <= tolerances.settled:
            break
    if not at.finite or abs(at.left).max() > tolerances.zero:
        return None
    u, values, vt = np.linalg.svd(at.bordered)
    kept = len(values) - lost
    flat = (values[kept:] <= tolerances.same).all() and values[kept - 1] > 10 * tolerances.same
    return _forms(at, u[:, kept:].T, vt[kept:]) if flat else None


def _forms(at: FritzJohn, left: Array, kernel: Array) -> BranchPoint:
    h, k = at.system.tolerances.near, len(at.x)
    change = [
        at.system.point(at.face, at.x + h * v[:k]).bordered
        - at.system.point(at.face, at.x - h * v[:k]).bordered
        for v in kernel
    ]
    forms = np.einsum("in,jnm,km->ikj", left, np.array(change) / (2 * h), kernel)
    return BranchPoint(at, kernel, left, (forms + forms.transpose(0, 2, 1)) / 2)


def curves(point: BranchPoint) -> tuple[list[Array], str]:
    """Return a unit tangent of every curve through a branch point, and what is not decided."""
    d, k, tolerances = len(point.left), len(point.at.x), point.at.system.tolerances
    size, small = float(np.abs(point.forms).max()), tolerances.beside
    if size <= tolerances.same:
        return [], "curves touch there"
    forms = point.forms / size
    if d == 1:
        zeros = _lines(forms[0], small)
    elif d == 2:
        zeros = _pair(point, forms, size, small)
    else:
        return [], f"{d} curvatures vanish together"
    if zeros is None or not zeros:
        return [], "curves touch there"
    tangents = [(c @ point.kernel)[:k] for c in zeros]
    return [t / np.linalg.norm(t) for t in tangents], ""


def _lines(form: Array, small: float) -> list[Array] | None:
    """Return the zeros of a quadratic form of two variables, or None if they are none or double."""
    (low, high), (one, two) = (part.T for part in np.linalg.eigh(form))
    if not -low * high > small**2:
        return None
    return [math.sqrt(high) * one + sign * math.sqrt(-low) * two for sign in (1.0, -1.0)]


def _pair(point: BranchPoint, forms: Array, size: float, small: float) -> list[Array] | None:
    """Return the zeros of two quadratic forms of three variables, or of what takes their place."""
    # Unit vectors: the parameter changes along the first, and stays along the others.
    speed = point.kernel[:, point.at.system.n]
    basis = np.linalg.svd(speed[None])[2]
    turned = np.einsum("ai,nij,bj->nab", basis, forms, basis)
    mixed, plane = turned[:, 0, 1:], float(abs(turned[:, 1:, 1:]).max())
    if np.linalg.norm(speed) <= small:
        return _common(forms, small)
    if plane > point.at.system.tolerances.corner:
        # In units of the parameter in which both parts of the forms are alike.
        unit = np.diag([plane / float(abs(mixed).max()), 1.0, 1.0])
        zeros = _common(np.einsum("ai,nij,bj->nab", unit, turned, unit) / plane, small)
        return None if zeros is None else [c @ unit @ basis for c in zeros]
    if abs(np.linalg.det(mixed)) <= small:
        return None
    through = np.array([1.0, *np.linalg.solve(mixed, -turned[:, 0, 0] / 2)])
    cubic = _cubic(point, basis[1:], math.sqrt(point.at.system.tolerances.near)) / size
    # C(w) x l(w) = 0, of degree four in w = (x, y), the highest power of x first.
    crossed = np.convolve(cubic[0], mixed[1]) - np.convolve(cubic[1], mixed[0])
    slopes = _roots(crossed, small)
    if slopes is None:
        return None
    return [through @ basis, *(w @ basis[1:] for w in slopes)]


def _roots(powers: Array, small: float) -> list[Array] | None:
    """Return the zeros of ``sum a_j x^(n - j) y^j``, or None where some are nearly double."""
    n = len(powers) - 1
    size = float(abs(powers).max())
    if size <= small:
        return None
    # In coordinates in which none is at infinity.
    angles = np.linspace(0, math.pi, 4 * n, endpoint=False)
    j = np.arange(n + 1)

    def value(x: Array, y: Array) -> Array:
        return np.asarray((powers / size) @ (x ** (n - j[:, None]) * y ** j[:, None]))

    turn = float(angles[np.argmax(abs(value(np.cos(angles), np.sin(angles))))])
    c, s = math.cos(turn), math.sin(turn)
    at = np.linspace(-1, 1, n + 1)
    inner = np.polyfit(at, value(c - s * at, s + c * at), n)
    found = np.roots(inner)
    slopes = np.polyval(np.polyder(inner), found) / (1 + abs(found) ** 2) ** (n / 2 - 1)
    if abs(slopes).min(initial=math.inf) <= small:
        return None
    real = found[abs(found.imag) <= small * (1 + abs(found))].real
    return [np.array([c - s * r, s + c * r]) / math.hypot(1, r) for r in real.tolist()]


def _common(forms: Array, small: float) -> list[Array] | None:
    """Return the common zeros of two quadratic forms of three variables; None if not all simple.

    With ``c = (1, a, b)`` in turned coordinates, the resultant by ``b`` is of degree four in ``a``.
    """
    turn = np.linalg.qr(np.array([[3.0, 1.0, 2.0], [1.0, -4.0, 1.0], [-1.0, 1.0, 5.0]]))[0]
    p, q = np.einsum("ia,nij,jb->nab", turn, forms, turn)

    def parts(f: Array) -> tuple[Array, Array, Array]:  # of b^2, b, 1, by powers of a
        return f[2, 2:], 2 * f[[1, 0], 2], np.array([f[1, 1], 2 * f[0, 1], f[0, 0]])

    (a1, b1, c1), (a2, b2, c2) = parts(p), parts(q)
    bend, lean = a1 * c2 - a2 * c1, a1 * b2 - a2 * b1
    tilt = np.convolve(b1, c2) - np.convolve(b2, c1)
    found = np.roots(np.polysub(np.convolve(bend, bend), np.convolve(lean, tilt)))
    if len(found) < 4:
        return None
    zeros = []
    for a in found:
        c = np.array([1.0, a, -np.polyval(bend, a) / np.polyval(lean, a)])
        c /= np.linalg.norm(c)
        if np.linalg.svd(np.array([p @ c, q @ c]), compute_uv=False)[-1] <= small:
            return None
        if abs(c.imag).max() <= small:
            zeros.append(turn @ c.real / np.linalg.norm(c.real))
    return zeros


def _cubic(point: BranchPoint, plane: Array, r: float) -> Array:
    """Return the cubic parts of the equations on a plane of the kernel, ``(d, 4)``.

    By powers of ``x`` in ``w = x plane[0] + y plane[1]``, the highest first; from differences
    of the reduced equations over a length ``r``.
    """
    angles = np.arange(8) * math.pi / 8
    powers = np.array([np.cos(angles) ** (3 - j) * np.sin(angles) ** j for j in range(4)]).T
    ways = np.column_stack([np.cos(angles), np.sin(angles)]) @ plane
    odd = [(_reduced(point, r * w) - _reduced(point, -r * w)) / (2 * r**3) for w in ways]
    return np.asarray(np.linalg.lstsq(powers, np.array(odd), rcond=None)[0].T)


def _reduced(point: BranchPoint, c: Array) -> Array:
    """Return the equations on the kernel with the unknowns across it eliminated, ``(d,)``."""
    at, kernel, left = point.at, point.kernel, point.left
    d, k = len(left), len(at.x)
    corner = np.zeros((d + 1, d))
    matrix = np.block([[at.bordered, left.T], [kernel, corner]])
    moved = c @ kernel
    for _ in range(20):
        here = at.system.point(at.face, at.x + moved[:k])
        step = np.linalg.solve(matrix, np.concatenate([-here.left, np.zeros(d + 1)]))
        moved = moved + step[: len(moved)]
        if np.linalg.norm(step[: len(moved)]) <= at.system.tolerances.rounding:
            break
    return np.asarray(left @ here.left)
