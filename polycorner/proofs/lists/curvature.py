"""Boxes without local minima, by negative curvature along faces.

Let ``U`` be the functions that may vanish in a box in a branch, with the equations, ``G`` their
gradients, ``W`` any matrix, and let the derivatives of all functions involved be continuous on the
box.  If ``|I - W G^T| < 1`` on the box, in the row and the column norm, then

*   the gradients are independent, and multipliers with ``dE = G^T lam`` are bounded by
    ``lam = W dE + (I - W G^T) lam``;
*   for each vector ``d_0`` there is ``d = d_0 + W^T y`` with ``G d = 0`` and
    ``|y| <= |G d_0| / (1 - |I - G W^T|)`` in the maximum norm.

If moreover ``d^T (E'' - sum lam_i f_i'') d < 0`` for all of these multipliers and vectors, a
stationary point in the box is no local minimum of the branch, nor of the set.  For let ``V`` be the
functions of ``U`` that vanish there.  The multipliers of the others are 0, and ``d`` is tangent to
``V``: some curve with this tangent stays in the zeros of ``V``, on which the energy has the
derivatives 0 and ``d^T (E'' - sum lam_i f_i'') d`` ([NW] thm 12.5), and all others stay positive.
Nothing is asked of the signs of multipliers, so that those that nearly vanish do no harm.

``W`` and ``d_0`` are found in floating point; all bounds include rounding errors, as in
:mod:`~polycorner.proofs.lists.directions`.
"""

from polycorner.formulas.linking import linked
from polycorner.proofs.lists.entries import TINY, UNIT

compiled = linked()


@compiled
def bent_down(g_lo, g_hi, h_lo, h_hi, left, start, spread, lam, reach):
    """Show that there is no local minimum in a box; see the module.

    Parameters
    ----------
    g_lo, g_hi : (k + 1, n) arrays
        Enclosures of gradients on the box: inequalities, equations, the energy.
    h_lo, h_hi : (k + 1, n, n) arrays
        Enclosures of second derivatives.
    left : (k, n) array
        ``W``.
    start : (n,) array
        ``d_0``.
    spread, lam, reach : (n,), (k,), (k,) arrays
        Work space.
    """
    k, n = left.shape
    slack = (n * n + 16) * (k + 4) * UNIT
    rows, columns = 0.0, 0.0
    reach[:] = 0.0
    for i in range(k):  # reach: row sums of |I - W G^T|
        for c in range(k):
            defect = residue(g_lo[c], g_hi[c], left[i], 1.0 if i == c else 0.0, slack)
            reach[i] += defect
        rows = max(rows, reach[i])
    for c in range(k):
        total = 0.0
        for i in range(k):
            total += residue(g_lo[c], g_hi[c], left[i], 1.0 if i == c else 0.0, slack)
        columns = max(columns, total)
    if not (rows < 0.5 and columns < 0.5):
        return False
    largest, away = 0.0, 0.0
    for i in range(k):
        middle, radius = product(g_lo[k], g_hi[k], left[i], slack)
        lam[i] = middle
        largest = max(largest, abs(middle) + radius)
        away = max(away, residue(g_lo[i], g_hi[i], start, 0.0, slack))
    largest *= 2.0
    away *= 2.0
    for i in range(k):
        _, radius = product(g_lo[k], g_hi[k], left[i], slack)
        reach[i] = (radius + reach[i] * largest) * (1.0 + slack)
    for j in range(n):
        total = 0.0
        for i in range(k):
            total += abs(left[i, j])
        spread[j] = total * away * (1.0 + slack)
    above, size = 0.0, 0.0
    for j in range(n):
        for c in range(n):
            middle = 0.5 * h_lo[k, j, c] + 0.5 * h_hi[k, j, c]
            radius = 0.5 * h_hi[k, j, c] - 0.5 * h_lo[k, j, c]
            weight = abs(middle)
            for i in range(k):
                mid = 0.5 * h_lo[i, j, c] + 0.5 * h_hi[i, j, c]
                rad = 0.5 * h_hi[i, j, c] - 0.5 * h_lo[i, j, c]
                middle -= lam[i] * mid
                radius += (abs(lam[i]) + reach[i]) * rad + reach[i] * abs(mid)
                weight += (abs(lam[i]) + reach[i]) * (abs(mid) + rad)
            both = (abs(start[j]) + spread[j]) * (abs(start[c]) + spread[c])
            off = both - abs(start[j] * start[c])
            above += start[j] * start[c] * middle + abs(start[j] * start[c]) * radius
            above += off * (abs(middle) + radius)
            size += both * (weight + radius)
    return above + 4.0 * slack * size + TINY < 0.0


@compiled
def product(low, high, v, slack):
    """Return middle and radius of ``v . g`` for ``low <= g <= high``, rounding included."""
    middle, radius, size = 0.0, 0.0, 0.0
    for j in range(v.size):
        if v[j] != 0.0:
            mid, rad = 0.5 * low[j] + 0.5 * high[j], 0.5 * high[j] - 0.5 * low[j]
            middle += v[j] * mid
            radius += abs(v[j]) * rad
            size += abs(v[j]) * (abs(mid) + rad)
    return middle, radius + slack * size + TINY


@compiled
def residue(low, high, v, target, slack):
    """Return a bound of ``|v . g - target|`` for ``low <= g <= high``."""
    middle, radius = product(low, high, v, slack)
    return abs(middle - target) * (1.0 + slack) + radius + slack
