"""Unions: which pieces hold at a point, where a union is left, and which of its pieces is kept.

A union of pieces is left alone as long as a displacement stays in it.  Where one does not, the
displacement is found anew in a piece that holds where the union would be left.  Where several hold,
at a concave corner, the motion may go on in each.
"""

import numpy as np

from polycorner.formulas.compilation import never_inline
from polycorner.motion.sweeping.draws import compiled
from polycorner.motion.sweeping.records import BODY, PART, UNION
from polycorner.motion.sweeping.rows import evaluate_own

SAMPLES = 4  # points of a displacement at which a union is looked at
HALVINGS = 50  # with which the place is found where it is left
FREE, TOLD, MET = range(3)  # what became of the unions: nothing, a piece was chosen, a choice


@compiled
def count_unions(s):
    """Return the number of unions."""
    return s.piece_of_union.shape[0] - 1


@compiled
def piece_value(s, w, value, first, p):
    """Return the least distance of a body to the zero sets of a piece's functions."""
    least = np.inf
    for e in range(s.row_of_piece[p], s.row_of_piece[p + 1]):
        r = first + s.rows[e]
        if w.norm[r] > 0.0:
            least = min(least, value[r] / w.norm[r])
    return least


@compiled
def union_value(s, w, value, first, u):
    """Return the largest value of a union's pieces."""
    best = -np.inf
    for p in range(s.piece_of_union[u], s.piece_of_union[u + 1]):
        best = max(best, piece_value(s, w, value, first, p))
    return best


@compiled
def place(s, st, w, i, part):
    """Set the point after a part of a body's displacement, and the values of its functions."""
    for c in range(s.k):
        w.x[i, c] = st.q[i, c] + part * w.d[i, c]
    evaluate_own(s, w, w.x, i, w.trial, False)


@compiled
def leaves(s, st, w, i, u):
    """Return after which part of its displacement a body leaves a union; 2 if it does not."""
    never_inline()
    first, inside, outside = i * (s.m + s.limits), 0.0, 2.0
    for sample in range(1, SAMPLES + 1):
        part = sample / SAMPLES
        place(s, st, w, i, part)
        if union_value(s, w, w.trial, first, u) < -s.zero:
            outside = part
            break
        inside = part
    if outside > 1.0:
        return 2.0
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        place(s, st, w, i, middle)
        if union_value(s, w, w.trial, first, u) < -s.zero:
            outside = middle
        else:
            inside = middle
    return inside


@compiled
def holding(s, w, value, first, u):
    """List the pieces of a union that hold at a point, those that fail least if none does."""
    limit = -max(s.touching, -union_value(s, w, value, first, u))
    count = 0
    for p in range(s.piece_of_union[u], s.piece_of_union[u + 1]):
        if piece_value(s, w, value, first, p) >= limit:
            w.meeting[count] = p
            count += 1
    return count


@compiled
def choose(s, st, w, i, ask):
    """Choose pieces of the unions that a body's displacement leaves; return what became of them.

    Where several may be chosen, and this is asked for, none is: the body and the union are noted.
    """
    never_inline()
    found, first, far = FREE, i * (s.m + s.limits), 0.0
    for c in range(s.k):
        far += abs(w.d[i, c]) * s.units[c]
    for u in range(count_unions(s)):
        # What is farther than twice the displacement is not met.
        if w.chosen[i, u] >= 0 or union_value(s, w, w.before, first, u) > 2.0 * far:
            continue
        part = leaves(s, st, w, i, u)
        if part > 1.0:
            continue
        place(s, st, w, i, part)
        count = holding(s, w, w.trial, first, u)
        chosen = w.forced[i, u]
        if chosen < 0:
            if ask and count > 1:
                w.status[BODY], w.status[UNION], w.room[PART] = i, u, part
                w.meeting[count] = -1
                return MET
            chosen = w.meeting[0]
        w.chosen[i, u] = chosen
        for e in range(s.row_of_piece[chosen], s.row_of_piece[chosen + 1]):
            w.on[first + s.rows[e]] = 1
        found = TOLD
    return found


@compiled
def opens(s, st, w, i):
    """Return after which part of its displacement a body may leave the piece that it is kept in.

    There another piece of the same union begins to hold.  2 if none does.
    """
    never_inline()
    first, soonest = i * (s.m + s.limits), 2.0
    for u in range(count_unions(s)):
        kept = w.chosen[i, u]
        for p in range(s.piece_of_union[u], s.piece_of_union[u + 1]):
            if kept < 0 or p == kept:
                continue
            place(s, st, w, i, 0.0)
            closed = piece_value(s, w, w.trial, first, p) < -s.touching
            place(s, st, w, i, 1.0)
            if not closed or piece_value(s, w, w.trial, first, p) <= s.touching:
                continue
            low, high = 0.0, 1.0
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                place(s, st, w, i, middle)
                if piece_value(s, w, w.trial, first, p) > 0.0:
                    high = middle
                else:
                    low = middle
            soonest = min(soonest, high)
    return soonest
