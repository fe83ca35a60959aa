"""Contacts of a crowd in a compact form, in which sweeps read little memory.

The velocity of a body is ``v_free + U w``, with the root ``U`` of its inverse mass matrix,
``M^-1 = U U'``.  In the coordinates ``w`` masses are one, and a row ``J U`` is its own response to
an impulse.  A unilateral contact and the friction that it presses on, which is the next block, are
one compact contact; any other block is one alone.
"""

import numpy as np

from polycorner.motion.engine.arrays import WATCHED
from polycorner.motion.engine.families import coordinates_of, kind_of
from polycorner.motion.engine.gauss_seidel import EXACT
from polycorner.motion.engine.impacts import mixed, plastic_offset
from polycorner.motion.engine.jit import NONE, ONE, TWO, ZERO, compiled
from polycorner.motion.engine.linear_algebra import factorise
from polycorner.motion.engine.rows import (
    add_row,
    add_two_rows,
    load_on,
    row_at,
    row_times,
    rows_product,
)
from polycorner.motion.engine.sets import DISC, INTERVAL, contains, project
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import entry, load, store, total, zeros

RELAXATION = 1.5  # multiple by which impulses change in a sweep of what would solve a contact
SEPARATED = 0.2  # share of what is too much that one contact takes away

# Numbers of a compact contact: velocities of its rows at w = 0, reciprocals of the squares of its
# rows, the product of its rows, its impulses, and the overlap that is too much.
NORMAL, NORMAL_RHO, SLIP, SLIP_RHO, COUPLING, PRESSES, RUBS, EXCESS = range(8)
# Further ones where friction has two rows: of the second, W as in `BlockWork.delassus`, impulse.
ACROSS, W00, W01, W11, RUBS_ACROSS = range(5)
# Its whole numbers: ranks of its bodies, the first of its blocks, what it is: bits, and the number
# of its set of friction.
FIRST, SECOND, BLOCK, FORM = range(4)
HAS_GAP, HAS_FRICTION, BILATERAL, TWO_ROWS, SET_BITS = 1, 2, 4, 8, 4


@compiled
def begin_compact(model, state, mid, crowd, i):
    """Start a body of a crowd at its velocity after forces alone."""
    k, K, root, at = model.dimension, model.lanes, crowd.mass_root[i], state.rank[i]
    for c in range(K):
        crowd.unit_velocity[at, c] = crowd.unit_shift[at, c] = 0.0
    if model.constant_mass[kind_of(model, i)] and root[0, 0] > 0.0:
        return
    for a in range(k):
        for c in range(k):
            root[a, c] = mid.inverse_mass[i, a, c] if c <= a else 0.0
    if not factorise(root, coordinates_of(model, i)):
        # The body and all that touches it become not a number, which stops the run with a reason.
        root[0, 0] = np.nan


@compiled
def end_compact(model, state, velocity, crowd, i):
    """Set the change of a body of a crowd, and its change of place."""
    K, at = model.lanes, state.rank[i] * model.lanes
    for a in range(model.dimension):
        change, shift = zeros(), zeros()
        for c in range(0, K, WIDTH):
            root = load(crowd.mass_root, (i * model.dimension + a) * K + c)
            change = change + root * load(crowd.unit_velocity, at + c)
            shift = shift + root * load(crowd.unit_shift, at + c)
        velocity.new[i, a] = velocity.free[i, a] + total(change)
        crowd.shift[i, a] = total(shift)


@compiled
def compact_row(model, body, block, crowd, b, row, r, target, to):
    """Write a row of a block, times ``U``, to a place for compact contact ``r``."""
    k, K, at, first = model.dimension, model.lanes, row_at(model, b, row), crowd.contact[r, BLOCK]
    exchanged = block.bodies[b, 0] != block.bodies[first, 0]
    for side in range(2):
        i = block.bodies[first, side]
        begin = at + (K if (side == 1) != exchanged else 0)
        for c in range(0, K, WIDTH):
            value = zeros()
            if i >= 0 and body.awake[i]:
                for a in range(k):
                    root = load(crowd.mass_root, (i * k + a) * K + c)
                    value = value + entry(block.jacobian, begin + a) * root
            store(target, to + side * K + c, value)


@compiled
def places(model, r):
    """Return where the rows of a compact contact stand: normal, slip, slip across."""
    return 4 * r * model.lanes, (4 * r + 2) * model.lanes, 2 * r * model.lanes


@compiled
def reciprocal(square):
    """Return the reciprocal of a square, and one of nothing."""
    return 1.0 / square if square > 0.0 else 1.0


@compiled
def friction_of(contact):
    """Return the block of the friction of a compact contact, which has some."""
    return contact[BLOCK] + (ONE if contact[FORM] & HAS_GAP else ZERO)


@compiled
def compact_contact(model, state, work, r, b, pressed):
    """Write a block, and the friction that follows if it is ``pressed``; return their speed."""
    body, block, crowd = work.body, work.block, work.crowd
    contact, numbers, rows = crowd.contact[r], crowd.numbers[r], crowd.rows
    i, j = block.bodies[b, 0], block.bodies[b, 1]
    # By rank, so that bodies that are near each other are near each other in memory, too.
    contact[FIRST], contact[SECOND] = state.rank[i], state.rank[j] if j >= 0 else NONE
    contact[BLOCK], contact[FORM], numbers[EXCESS] = b, ZERO, 0.0
    at, _, _ = places(model, r)
    speed = 0.0
    if block.rows[b] == 0:
        contact[FORM] = HAS_GAP
        compact_row(model, body, block, crowd, b, ZERO, r, rows, at)
        numbers[NORMAL], numbers[PRESSES] = (
            block.free[b, 0] + block.offset[b, 0],
            block.impulse[b, 0],
        )
        numbers[NORMAL_RHO] = reciprocal(rows_product(model, rows, at, rows, at, TWO))
        speed = abs(numbers[NORMAL])
        if block.bilateral[b]:
            contact[FORM] |= BILATERAL
        else:
            numbers[EXCESS] = -gap_of(work.mid, work.pair, block, b) - model.crowd_overlap
    if pressed or block.rows[b] > 0:
        contact[FORM] |= HAS_FRICTION
        speed = max(speed, compact_friction(model, body, block, crowd, r, friction_of(contact)))
    return speed


@compiled
def gap_of(mid, pair, block, b):
    """Return the gap of a unilateral block."""
    if block.bodies[b, 1] < 0:
        return mid.gap[block.origin[b, 2]]
    return pair.gap[block.origin[b, 1]]


@compiled
def compact_friction(model, body, block, crowd, r, f):
    """Write the friction of a compact contact; return the largest velocity of its rows."""
    contact, numbers, rows = crowd.contact[r], crowd.numbers[r], crowd.rows
    at, along, across = places(model, r)
    compact_row(model, body, block, crowd, f, ZERO, r, rows, along)
    square = top = rows_product(model, rows, along, rows, along, TWO)
    numbers[SLIP], numbers[RUBS] = block.free[f, 0] + block.offset[f, 0], block.impulse[f, 0]
    numbers[COUPLING], speed = 0.0, abs(numbers[SLIP])
    if contact[FORM] & HAS_GAP:
        numbers[COUPLING] = rows_product(model, rows, at, rows, along, TWO)
    contact[FORM] |= block.set[f] << SET_BITS
    if block.rows[f] == 2:
        more, others = crowd.across[r], crowd.across_rows
        compact_row(model, body, block, crowd, f, ONE, r, others, across)
        other = rows_product(model, others, across, others, across, TWO)
        more[ACROSS], more[RUBS_ACROSS] = block.free[f, 1] + block.offset[f, 1], block.impulse[f, 1]
        if other > 0.0 or more[ACROSS] != 0.0:  # bodies in a plane slip along one row only
            contact[FORM] |= TWO_ROWS
            more[W00], more[W11] = square, other
            more[W01] = rows_product(model, rows, along, others, across, TWO)
            top = 0.5 * (square + other) + np.sqrt((0.5 * (square - other)) ** 2 + more[W01] ** 2)
            speed = max(speed, abs(more[ACROSS]))
    numbers[SLIP_RHO] = reciprocal(top)
    return speed


@compiled
def press_contact(model, crowd, r):
    """Apply the impulses of a compact contact, from which a step starts."""
    form, numbers, w = crowd.contact[r, FORM], crowd.numbers[r], crowd.unit_velocity
    i, j, rows = crowd.contact[r, FIRST], crowd.contact[r, SECOND], crowd.rows
    at, along, across = places(model, r)
    if form & HAS_GAP:
        add_row(model, rows, at, numbers[PRESSES], w, i, j)
    if form & HAS_FRICTION:
        add_row(model, rows, along, numbers[RUBS], w, i, j)
    if form & TWO_ROWS:
        q = crowd.across[r, RUBS_ACROSS]
        add_row(model, crowd.across_rows, across, q, w, i, j)


@compiled
def relax_contact(model, block, crowd, scratch, r):
    """Change the impulse of a contact with all others fixed, then that of its friction."""
    contact, numbers = crowd.contact[r], crowd.numbers[r]
    rows, w = crowd.rows, crowd.unit_velocity
    i, j, form = contact[FIRST], contact[SECOND], contact[FORM]
    at, along, _ = places(model, r)
    more = support = 0.0
    if form & HAS_GAP:
        p = numbers[PRESSES]
        u = numbers[NORMAL] + row_times(model, rows, at, w, i, j)
        new = p - RELAXATION * u * numbers[NORMAL_RHO]
        if not form & BILATERAL:
            new = max(new, 0.0)
        numbers[PRESSES], more, support = new, new - p, abs(new)
        if crowd.strips[WATCHED]:
            # Only for friction that stands apart; for all others the load is at hand, and this
            # write would cost a cache line in each sweep.
            block.impulse[contact[BLOCK], 0] = new
        if new == 0.0 and p == 0.0 and numbers[RUBS] == 0.0 and not form & TWO_ROWS:
            return  # an open contact, as before
    if not form & HAS_FRICTION:
        add_row(model, rows, at, more, w, i, j)
        return
    slip = numbers[SLIP] + row_times(model, rows, along, w, i, j) + numbers[COUPLING] * more
    if not form & HAS_GAP:
        support = load_on(block, contact[BLOCK])
    if form & TWO_ROWS:
        if form & HAS_GAP:
            add_row(model, rows, at, more, w, i, j)
        slide_across(model, crowd, scratch, r, support, slip)
        return
    q = numbers[RUBS]
    aim = q - RELAXATION * slip * numbers[SLIP_RHO]
    numbers[RUBS] = nearest(model, scratch, form >> SET_BITS, aim, support)
    if form & HAS_GAP:
        add_two_rows(model, rows, at, more, along, numbers[RUBS] - q, w, i, j)
    else:
        add_row(model, rows, along, numbers[RUBS] - q, w, i, j)


@compiled
def nearest(model, scratch, shape, x, support):
    """Return the admissible friction along one direction that is nearest to ``x``."""
    kind, a, b = model.set_kinds[shape], model.set_sizes[shape, 0], model.set_sizes[shape, 1]
    if kind == DISC:
        a, b = -a, a
    if kind in (INTERVAL, DISC):
        return min(max(x, a * support), b * support)
    project(model, shape, x, 0.0, support, scratch.image)
    return scratch.image[0]


@compiled
def slide_across(model, crowd, scratch, r, support, slip):
    """Solve friction of two rows, from the slip along the first one."""
    contact, numbers, more = crowd.contact[r], crowd.numbers[r], crowd.across[r]
    i, j, shape, w, out = (
        contact[FIRST],
        contact[SECOND],
        contact[FORM] >> SET_BITS,
        crowd.unit_velocity,
        scratch.image,
    )
    _, along, across = places(model, r)
    # The normal impulse has been applied already.
    other = more[ACROSS] + row_times(model, crowd.across_rows, across, w, i, j)
    x, y, rho = numbers[RUBS], more[RUBS_ACROSS], numbers[SLIP_RHO]
    project(model, shape, x - slip * rho, y - other * rho, support, out)
    d00, d01, d11 = more[W00], more[W01], more[W11]
    determinant = d00 * d11 - d01 * d01
    # As in :func:`relax_block`: sticking is solved exactly.
    if support > 0.0 and determinant > EXACT * d00 * d11:
        sx = x - (d11 * slip - d01 * other) / determinant
        sy = y - (d00 * other - d01 * slip) / determinant
        if contains(model, shape, sx, sy, support, 0.0):
            out[0], out[1] = sx, sy
    add_row(model, crowd.rows, along, out[0] - x, w, i, j)
    add_row(model, crowd.across_rows, across, out[1] - y, w, i, j)
    numbers[RUBS], more[RUBS_ACROSS] = out[0], out[1]


@compiled
def judge_contact(model, block, crowd, scratch, r):
    """Leave the impulses and the velocities of the rows in the blocks; return the residual."""
    contact, numbers, rows = crowd.contact[r], crowd.numbers[r], crowd.rows
    i, j, form, w = contact[FIRST], contact[SECOND], contact[FORM], crowd.unit_velocity
    at, along, across = places(model, r)
    worst = support = 0.0
    if form & HAS_GAP:
        b, p, rho = contact[BLOCK], numbers[PRESSES], numbers[NORMAL_RHO]
        u, support = numbers[NORMAL] + row_times(model, rows, at, w, i, j), abs(p)
        block.after[b, 0], block.impulse[b, 0] = u, p
        worst = abs(u) if form & BILATERAL else abs(max(0.0, p - u * rho) - p) / rho
    if form & HAS_FRICTION:
        f, q, rho = friction_of(contact), numbers[RUBS], numbers[SLIP_RHO]
        if not form & HAS_GAP:
            support = load_on(block, f)
        u = numbers[SLIP] + row_times(model, rows, along, w, i, j)
        block.after[f, 0], block.impulse[f, 0] = u, q
        if form & TWO_ROWS:
            y, out = crowd.across[r, RUBS_ACROSS], scratch.image
            row = row_times(model, crowd.across_rows, across, w, i, j)
            other = crowd.across[r, ACROSS] + row
            block.after[f, 1], block.impulse[f, 1] = other, y
            project(model, form >> SET_BITS, q - u * rho, y - other * rho, support, out)
            worst = max(worst, abs(out[0] - q) / rho, abs(out[1] - y) / rho)
        else:
            block.after[f, 1] = 0.0
            x = nearest(model, scratch, form >> SET_BITS, q - u * rho, support)
            worst = max(worst, abs(x - q) / rho)
    # What is not a number fails the comparison, and counts as infinite.
    return worst if worst < np.inf else np.inf


@compiled
def separate_contact(model, crowd, r):
    """Move bodies apart that overlap, by a share of what is too much; return whether they sank in.

    The changes of place, in ``crowd.unit_shift``, are as impulses would make them, but leave
    velocities as they are.  Bodies have sunk in by half the thickness of the thinnest: what presses
    them on may soon push them out on the other side.
    """
    excess = crowd.numbers[r, EXCESS]
    if excess <= 0.0:
        return False
    sunk = excess + model.crowd_overlap > model.gap_unit
    at, _, _ = places(model, r)
    i, j, shift = crowd.contact[r, FIRST], crowd.contact[r, SECOND], crowd.unit_shift
    # What neighbours have moved already counts, so that a row of overlaps is not taken away twice.
    excess -= row_times(model, crowd.rows, at, shift, i, j)
    if excess > 0.0:
        p = SEPARATED * excess * crowd.numbers[r, NORMAL_RHO]
        add_row(model, crowd.rows, at, p, shift, i, j)
    return sunk


@compiled
def gain_contact(block, crowd, r):
    """Return the work of a contact that was judged, and of its friction, at the mean velocity."""
    contact, work = crowd.contact[r], 0.0
    form = contact[FORM]
    if form & HAS_GAP and not form & BILATERAL:
        b = contact[BLOCK]
        after = block.after[b, 0] - block.offset[b, 0]
        work += block.impulse[b, 0] * 0.5 * (block.before[b, 0] + after)
    if form & HAS_FRICTION:
        f = friction_of(contact)
        for t in range(TWO if form & TWO_ROWS else ONE):
            slip = block.before[f, t] + block.offset[f, t] + block.after[f, t]
            work += block.impulse[f, t] * 0.5 * slip
    return work


@compiled
def compress_contact(block, crowd, r):
    """Let a contact start anew, from no impulse, and be plastic.

    Its impulses are kept as those of the whole impact.
    """
    contact, numbers = crowd.contact[r], crowd.numbers[r]
    form, b = contact[FORM], contact[BLOCK]
    keep_contact(block.expanded, block, crowd, r)
    numbers[PRESSES] = numbers[RUBS] = crowd.across[r, RUBS_ACROSS] = 0.0
    if form & HAS_GAP:
        if block.bounces[b] and not form & BILATERAL:
            offset = plastic_offset(block, b)
            numbers[NORMAL] += offset - block.offset[b, 0]
            block.offset[b, 0] = offset
        block.impulse[b, 0] = 0.0  # the load of friction that stands apart


@compiled
def keep_contact(kept, block, crowd, r):
    """Copy the impulses of a contact, and of its friction."""
    contact = crowd.contact[r]
    b, form = contact[BLOCK], contact[FORM]
    kept[b, 0], kept[b, 1] = block.impulse[b, 0], block.impulse[b, 1]
    if form & HAS_FRICTION:
        f = friction_of(contact)
        kept[f, 0], kept[f, 1] = block.impulse[f, 0], block.impulse[f, 1]


@compiled
def mix_contact(block, crowd, r, share):
    """Set the impulses of a contact between those of the compression and of the whole impact."""
    contact, numbers = crowd.contact[r], crowd.numbers[r]
    form, b = contact[FORM], contact[BLOCK]
    if form & HAS_GAP:
        numbers[PRESSES] = block.impulse[b, 0] = mixed(block, b, 0, share)
    if form & HAS_FRICTION:
        f = friction_of(contact)
        numbers[RUBS] = mixed(block, f, 0, share)
        crowd.across[r, RUBS_ACROSS] = mixed(block, f, 1, share)
