"""Narrower sides of boxes, beyond which no point of the set lies.

Let ``f`` be continuous on a box, where ``l_k <= q_k <= u_k``, with ``f <= F`` and ``df/dq_k >= g >
0``.  Along the coordinate ``k`` the function grows by at least ``g (u_k - q_k)`` up to the side, so
that ``f(q) <= F - g (u_k - q_k)``: it is negative where ``q_k < u_k - F / g``.  The other side, and
negative slopes, are the same in a mirror.  What is cut off is a part of the subdivision like any
other, on which a function is negative: nothing else has to be trusted or checked.
"""

from collections.abc import Sequence

import numpy as np

from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.entries import UNIT
from polycorner.proofs.lists.tree import Boxes
from polycorner.spaces.manifold import Array

KEPT = 0.05  # of what could be cut off, so that the function is negative by a margin


def narrowed(
    boxes: Boxes, bounds: Sequence[Array], continuous: Mask, conj: Mask, equations: int
) -> Array:
    """Return narrower sides of boxes, ``(2, B, n)``.

    Parameters
    ----------
    boxes : Boxes
    bounds : four arrays
        Lower and upper values ``(B, m + k + ...)``, lower and upper slopes ``(B, m + k + ..., n)``.
    continuous : (B, m + k + ...) array of bool
        Which functions are continuous with bounded slopes on which boxes.
    conj : (c, m) array of bool
        The set as a union of intersections; those functions are used that are in all of them.
    equations : int
        How many equations follow the inequalities.
    """
    m, lower, upper = conj.shape[1], boxes.lower, boxes.upper
    held, zero = np.flatnonzero(conj.all(axis=0)).tolist(), range(m, m + equations)
    least, most = lower.copy(), upper.copy()
    v_lo, v_hi, g_lo, g_hi = bounds
    with np.errstate(all="ignore"):
        # A function of one branch alone may be negative where the set lies in another branch.
        for i in (*held, *zero):
            ends = [(v_hi[:, i], g_lo[:, i], g_hi[:, i])]
            ends += [(-v_lo[:, i], -g_hi[:, i], -g_lo[:, i])] if i >= m else []
            for above, low, high in ends:
                used = (continuous[:, i] & (above >= 0))[:, None]
                # Division and product round: a cut too far out costs a little volume, one too far
                # in costs a point.
                reach = above[:, None] / np.where(low > 0, low, -high) * (1 + 4 * UNIT)
                reach += 4 * UNIT * (abs(lower) + abs(upper) + reach)
                # fmax and fmin ignore NaN, which bounds of infinite slopes leave behind.
                least = np.where(used & (low > 0), np.fmax(least, upper - reach), least)
                most = np.where(used & (high < 0), np.fmin(most, lower + reach), most)
    # The strip is examined like any box: the function must be seen to be negative on it.
    least = lower + (1 - KEPT) * (least - lower)
    most = upper - (1 - KEPT) * (upper - most)
    return np.stack([least, most])
