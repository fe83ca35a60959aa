"""Velocities and kinetic energies of rotations, as formulas in quaternions and their derivatives.

A body turns with ``a' = a (0, omega) / 2``, ``omega`` in its own axes, so that
``omega = 2 Im(a* a')``; in the axes of space it is ``2 Im(a' a*)`` ([MLS] ch. 2).
"""

from threading import Lock
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import choice, instance, reals, refuse
from polycorner.kinds import checked
from polycorner.motion.contacts import velocities
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Manifold

if TYPE_CHECKING:
    import sympy

FRAMES = ("body", "space")
_RECOGNISING = Lock()  # of numbers: SymPy sets the precision of mpmath, which all threads share


@checked
def angular_velocity(
    manifold: Manifold, name: str | None = None, *, frame: Literal["body", "space"] = "body"
) -> "sympy.ImmutableMatrix":
    """Return the angular velocity of a rotation, ``(3, 1)``, linear in the velocities.

    Parameters
    ----------
    manifold : Manifold
    name : str, optional
        Name of the rotation; see :meth:`Manifold.matrix`.
    frame : {"body", "space"}, optional
        The axes it is given in.

    Examples
    --------
    >>> M = Manifold.rotation("a")
    >>> angular_velocity(M)[0]
    2*aw*ax_dot - 2*aw_dot*ax - 2*ay*az_dot + 2*ay_dot*az
    """
    import sympy

    choice("frame", frame, FRAMES)
    a, v = _quaternion(manifold, name)
    imaginary, side = a[1:, :], -1 if frame == "body" else 1
    turned = a[0] * v[1:, :] - v[0] * imaginary + side * imaginary.cross(v[1:, :])
    return sympy.ImmutableMatrix((2 * turned).expand())


@checked
def rotational_energy(
    manifold: Manifold, inertia: ArrayLike, name: str | None = None
) -> "sympy.Expr":
    """Return the kinetic energy ``omega J omega / 2`` of a rotation.

    It is written as ``omega . (J - j) omega / 2 + 2 j |a'|^2`` with the mean moment ``j``, the same
    for unit quaternions: the mass matrix is regular, and constant for a ball.

    Parameters
    ----------
    manifold : Manifold
    inertia : (3,) or (3, 3) array
        The three moments of inertia ``J`` about the axes of the body, positive, or the symmetric
        matrix ``(3, 3)`` of a body in other axes.
    name : str, optional
        Name of the rotation; see :meth:`Manifold.matrix`.

    Raises
    ------
    ValueError
        If the moments are not positive.

    Examples
    --------
    >>> M = Manifold.rotation("a")
    >>> ball = rotational_energy(M, [1, 1, 1])
    >>> ball == 2 * sum(v**2 for v in velocities(M))
    True
    """
    import sympy

    given = finite(reals("inertia", inertia), "inertia")
    matrix = np.diag(given) if given.shape == (3,) else given
    symmetric = matrix.shape == (3, 3) and np.allclose(matrix, matrix.T, rtol=1e-12, atol=0)
    if not symmetric or np.linalg.eigvalsh(matrix)[0] <= 0:
        refuse("inertia", "three positive moments, or a positive symmetric 3 x 3 matrix", inertia)
    _, v = _quaternion(manifold, name)
    omega = angular_velocity(manifold, name)
    with _RECOGNISING:
        tensor = sympy.Matrix(3, 3, [sympy.nsimplify(x) for x in matrix.ravel().tolist()])
    mean = tensor.trace() / 3
    deviation = tensor - mean * sympy.eye(3)
    return sympy.expand((omega.T * deviation * omega)[0] / 2 + 2 * mean * v.dot(v))


def _quaternion(manifold: Manifold, name: str | None) -> "tuple[sympy.Matrix, sympy.Matrix]":
    """Return the quaternion of a rotation and its derivative, as columns."""
    import sympy

    instance("manifold", manifold, Manifold)
    factor = manifold.factors.named(name, turns=True)
    symbols = manifold.symbols, velocities(manifold)
    a, v = (sympy.Matrix(some[factor.at]) for some in symbols)
    return a, v
