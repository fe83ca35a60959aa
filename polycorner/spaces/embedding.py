"""Unit spheres in their embedding coordinates, and unit quaternions as rotations.

A unit quaternion ``a = (w, x, y, z)`` is the rotation ``v -> a v a*`` of space; ``a`` and ``-a``
are the same one.  Turning with the angular velocity ``omega`` in the body's axes is
``a' = a (0, omega) / 2``: rotations by the angle ``phi`` are ``phi / 2`` apart on the sphere
([MLS] ch. 2).
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Sequence

    import sympy

Array = NDArray[np.float64]


def normalised(u: Array) -> Array:
    """Return vectors ``(..., k)`` divided by their lengths; those of length zero stay."""
    length = np.sqrt(np.einsum("...i,...i->...", u, u))[..., None]
    return np.asarray(u / np.where(length > 0, length, 1.0))


def upright(a: Array) -> Array:
    """Return quaternions ``(..., 4)`` with the sign that makes their first nonzero entry > 0."""
    first = np.argmax(a != 0, axis=-1)[..., None]
    return np.where(np.take_along_axis(a, first, axis=-1) < 0, -a, a)


def logarithm(p: Array, q: Array) -> Array:
    """Return the tangent vectors at ``q`` of the shortest arcs to ``p``, as long as these.

    At antipodes all directions are as good; the first coordinate axis decides.
    """
    cosine = np.einsum("...i,...i->...", p, q)[..., None]
    across = p - cosine * q
    sine = np.sqrt(np.einsum("...i,...i->...", across, across))[..., None]
    way = np.where(sine > 0, across, 0.0) / np.where(sine > 0, sine, 1.0)
    if ((sine == 0) & (cosine < 0)).any():
        way = np.where((sine == 0) & (cosine < 0), tangent_basis(q)[..., 0], way)
    return np.asarray(np.arctan2(sine, cosine) * way)


def exponential(q: Array, v: Array) -> Array:
    """Return where great circles from ``q`` along the tangent parts of ``v`` end."""
    along = v - np.einsum("...i,...i->...", v, q)[..., None] * q
    angle = np.sqrt(np.einsum("...i,...i->...", along, along))[..., None]
    return normalised(np.cos(angle) * q + np.sinc(angle / np.pi) * along)


def tangent_basis(q: Array) -> Array:
    """Return orthonormal bases ``(..., k, k - 1)`` of tangent spaces, as columns.

    They are the reflections of coordinate axes that carry the axis nearest to ``q`` to ``+-q``.
    """
    k = q.shape[-1]
    nearest = np.argmax(abs(q), axis=-1)[..., None]
    side = np.where(np.take_along_axis(q, nearest, axis=-1) < 0, -1.0, 1.0)
    axis = side * (np.arange(k) == nearest)
    mirror = normalised(q + axis)
    whole = np.eye(k) - 2 * mirror[..., :, None] * mirror[..., None, :]
    others = np.argsort(np.arange(k) == nearest, axis=-1, kind="stable")[..., None, : k - 1]
    others = np.broadcast_to(others, (*whole.shape[:-1], k - 1))
    return np.asarray(np.take_along_axis(whole, others, axis=-1))


def body_frame(a: Array) -> Array:
    """Return ``da / domega`` for angular velocities in the body's axes, ``(..., 4, 3)``."""
    w, x, y, z = np.moveaxis(a, -1, 0)
    columns = [[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]]
    return np.asarray(np.moveaxis(np.array(columns), (0, 1), (-1, -2)) / 2)


def rotation_matrix(a: "Sequence[sympy.Symbol]") -> "sympy.ImmutableMatrix":
    """Return the matrix of a unit quaternion: quadratic forms in its entries.

    >>> from sympy import symbols
    >>> rotation_matrix(symbols("w x y z"))[0, 0]
    w**2 + x**2 - y**2 - z**2
    """
    import sympy

    w, x, y, z = a
    return sympy.ImmutableMatrix(
        [
            [w**2 + x**2 - y**2 - z**2, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w**2 - x**2 + y**2 - z**2, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w**2 - x**2 - y**2 + z**2],
        ]
    )
