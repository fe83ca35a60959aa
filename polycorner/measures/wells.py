"""Corners with dependent gradients: what wells of finite width make of them ([KHC]).

Let every contact ``i`` have the well ``exp(-U_i / T) = e^D exp(-k f_i^2 / 2)`` with the *stiffness*
``k``, so that its stickiness is ``kappa = e^D sqrt(2 pi / k)``.  About a corner with ``m`` contacts
let ``A`` have their gradients as rows, on the tangent space of the equations, with the singular
values ``s_1, ..., s_r``; ``v`` be the flexes, which it annihilates beside the orbit, and the rows
of ``W`` orthonormal relations, ``W A = 0``, which are stresses.  With ``f = A y + Q(v) + ...``, the
integral over ``y`` is Gaussian, and of ``Q`` remains what is orthogonal to the range of ``A``:

``Z = sqrt(det T T^T) (k / 2 pi)^((m - r) / 2) / (s_1 ... s_r) int exp(-k |W Q(v)|^2 / 2) dv``.

A corner with more contacts than dimensions and no flex has no integral.  One with ``p`` flexes is
rigid to second order where ``W Q`` vanishes for no direction; by the radius ``|v|``

``int = k^(-p/4) Gamma(p/4) / 4  int over |v| = 1 of (2 / |W Q(v)|^2)^(p/4)``.

So ``Z`` grows with ``k^((m - r) / 2 - p / 4)``: a singular cluster of nine spheres, with a stress
and a flex, with ``k^(1/4)``.  This is to leading order for stiff wells, and other wells than
harmonic ones give other factors.
"""

import math

import numpy as np

from polycorner.polyhedra.cones import null_space
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array

FEWEST, MOST = 16, 2**14  # directions of flexes, around a circle


def confined(
    quotient: Quotient, rows: list[int], q: Array, stiffness: float, tolerance: float
) -> float:
    """Return what a corner weighs by harmonic wells, without stickiness, energy and symmetry.

    NaN where it has more than two flexes, or is not rigid to second order.

    ``rows`` are the contacts of the corner ``q``.  The stiffness is one over temperature, in
    inverse squared units of the contacts' functions; the tolerance is the relative error of the
    integral over the directions of two flexes.
    """
    at, (_, slopes, bends) = quotient.at(q), quotient.bent(q)
    fixed, limit = list(quotient.equations), quotient.tolerances.rank
    left, singular, _ = np.linalg.svd(slopes[rows] @ null_space(slopes[fixed], limit))
    r = len(at.basis(rows))
    stresses, flexes = left[:, r:].T, null_space(at.matrix(rows), limit)
    if flexes.size and not len(stresses):
        return math.nan
    # On the equations a flex bends, by the least correction.
    back = np.linalg.pinv(slopes[fixed])
    bent = bends[rows] - np.einsum("ri,ie,ejk->rjk", slopes[rows], back, bends[fixed])
    forms = np.einsum("sr,rjk,ja,kb->sab", stresses, bent / 2, flexes, flexes)
    least = quotient.options.definite * float(abs(bent).max())
    volume = math.sqrt(np.linalg.det(at.orbit @ at.orbit.T)) / float(singular[:r].prod())
    factor = (stiffness / math.tau) ** (len(stresses) / 2)
    factor /= stiffness ** (flexes.shape[1] / 4)
    return float(volume * factor) * _along_flexes(forms, least, tolerance)


def _along_flexes(forms: Array, least: float, tolerance: float) -> float:
    """Return ``int exp(-|forms(v)|^2 / 2) dv`` for forms ``(s, p, p)``, NaN where it is not known.

    One that is at most ``least`` on a unit vector counts as zero there.
    """
    p = forms.shape[1]
    if p == 0:
        return 1.0

    def over(directions: Array, weight: float) -> float:
        """Return the integral over unit vectors ``(k, p)`` of one weight."""
        values = np.einsum("sab,ka,kb->ks", forms, directions, directions)
        squares = (values**2).sum(axis=1)
        if squares.min() <= least**2:
            return math.nan
        return float(math.gamma(p / 4) / 4 * weight * ((2 / squares) ** (p / 4)).sum())

    if p == 1:
        return over(np.array([[1.0], [-1.0]]), 1.0)
    last, count = math.nan, FEWEST
    while p == 2 and count <= MOST:
        turn = math.tau / count * np.arange(count)
        found = over(np.stack([np.cos(turn), np.sin(turn)], axis=1), math.tau / count)
        if abs(found - last) <= tolerance * found:
            return found
        last, count = found, 2 * count
    return math.nan
