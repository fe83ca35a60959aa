"""Rest of an island at given velocities: contacts that can carry, and impulses to begin with."""

import numpy as np

from polycorner.motion.engine.island_matrix import add_transposed
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.neighbours import TOUCHING
from polycorner.motion.engine.rest import REST_FACTOR
from polycorner.motion.engine.rows import load_on, velocity_of
from polycorner.motion.engine.sets import INTERVAL, barrier, contains

TARGET_PRESSURE = 0.2  # n_0, as a share of the impulse that would stop a body
START_MARGIN = 0.1  # relative distance from the boundary of the sets at the start
BALANCE_TOLERANCE = 1e-1  # of the solver's tolerance, to which forces balance
STILL_BALANCED = 0.5  # the same, for impulses of the step before


@compiled
def contacts_remain(model, work, first, last, goal):
    """Return whether no contact that carries load slips, opens or closes at the velocities of rest.

    ``work.carries`` gets which blocks can carry load at rest: those of contacts that neither open
    nor close, where gaps below ``TOUCHING`` count as zero.  Bounds close to what rest requires are
    moved there, whatever the outcome: otherwise piles missed the tolerance a third more often, and
    one jam twitched for seconds.
    """
    u = work.slip
    for s in range(first, last):
        b = work.order[s]
        pressing = work.pressing[b]
        velocity_of(model, work, b, work.v_rest, u)
        if work.block_rows[b] == 0:
            near = REST_FACTOR * goal
            if not work.bilateral[b]:
                near = max(near, TOUCHING * model.gap_unit / model.step)
            if u[0] < -near or (work.bilateral[b] and u[0] > near):
                return False
            work.carries[b] = 0.0
            if u[0] <= near:  # closed
                work.carries[b] = 1.0
                work.offset[b, 0] -= u[0]
            continue
        work.carries[b] = work.carries[pressing] if pressing >= 0 else 1.0
        if work.carries[b] > 0.0 and (
            abs(u[0]) > REST_FACTOR * goal
            or (work.block_rows[b] == 2 and abs(u[1]) > REST_FACTOR * goal)
        ):
            return False
    return True


@compiled
def imbalance(model, work, first, last, n):
    """Return how far the velocities after all impulses are from rest, as a speed.

    ``M (v_rest - v_free) - J' p`` is left in ``work.island_vector``.
    """
    k, K, x, p = model.dimension, model.lanes, work.island_vector, work.impulse
    far = 0.0
    for at in range(n):
        i = work.members[at]
        for c in range(k):
            value = 0.0
            for a in range(k):
                value += work.mass[i, c, a] * (work.v_rest[i, a] - work.v_free[i, a])
            x[at * K + c] = value
        for c in range(k, K):
            x[at * K + c] = 0.0
    for s in range(first, last):
        b = work.order[s]
        add_transposed(model, work, b, -p[b, 0], -p[b, 1], x)
    for at in range(n):
        i = work.members[at]
        for c in range(k):
            value = 0.0
            for a in range(k):
                value += work.inverse_mass[i, c, a] * x[at * K + a]
            far = max(far, abs(value) * model.units[c])
    return far


@compiled
def still_balance(model, work, first, last, n, goal):
    """Return whether the impulses at hand prove rest: they balance the forces, in their sets.

    In most steps of a pile at rest those of the step before do.
    """
    p = work.impulse
    for s in range(first, last):
        b = work.order[s]
        if work.carries[b] == 0.0:
            if p[b, 0] != 0.0 or p[b, 1] != 0.0:
                return False
        elif work.block_rows[b] > 0 and not contains(
            model, work.block_set[b], p[b, 0], p[b, 1], load_on(work, b), 0.0
        ):
            return False
    return imbalance(model, work, first, last, n) <= STILL_BALANCED * goal


@compiled
def find_interior_start(model, work, first, last, speed):
    """Find impulses in the interior of their sets; return whether there are any."""
    out = work.image
    for s in range(first, last):
        b = work.order[s]
        shape = work.block_set[b]
        if work.carries[b] == 0.0:
            work.impulse[b, 0], work.impulse[b, 1] = 0.0, 0.0
            continue
        if work.block_rows[b] == 0:
            p, least = work.impulse[b, 0], TARGET_PRESSURE * work.delassus[b, 3] * speed
            p = np.copysign(max(abs(p), least), p) if work.bilateral[b] else max(p, least)
            work.impulse[b, 0] = p
            continue
        load = load_on(work, b)
        if model.set_kinds[shape] == INTERVAL or work.block_rows[b] == 1:
            work.impulse[b, 1] = 0.0
        tries = 0
        while not contains(
            model, shape, work.impulse[b, 0], work.impulse[b, 1], load, -START_MARGIN
        ):
            tries += 1
            share = 0.8 if tries < 20 else 0.0
            work.impulse[b, 0] *= share
            work.impulse[b, 1] *= share
            if tries > 20:
                return False
        barrier(model, shape, load, work.impulse[b, 0], work.impulse[b, 1], out)
        if not (load > 0.0 and out[6] < np.inf):  # no interior
            return False
    return True
